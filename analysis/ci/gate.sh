#!/usr/bin/env bash
# Runs the gate of action.yml. Other continuous integration systems set the variables below. The exit code is that of
# swarmcert gate. Whatever happens, gate.xml (JUnit) and gate.sarif are left in the output folder.
#   GATE_POLICY              policy.toml
#   GATE_BASELINE            values and conditions of the last release; empty: none
#   GATE_OUTPUT              folder for the results; default: gate
#   GATE_ALLOW_INCONCLUSIVE  true: inconclusive checks do not fail
#   GATE_SWARMCERT           the tool. If it is not found: the package of GATE_RELEASE, else a build of the repository
#                            that contains this script
#   GATE_RELEASE             OWNER/REPOSITORY@TAG whose released package (.deb) is used
#   GATE_CACHE               folder that keeps the tool between runs; default: ~/.cache/swarmcert-gate
set -uo pipefail

policy=${GATE_POLICY:?name a policy.toml}
output=${GATE_OUTPUT:-gate}
cache=${GATE_CACHE:-$HOME/.cache/swarmcert-gate}
tool=${GATE_SWARMCERT:-swarmcert}
mkdir -p "$output" || exit
rm -f "$output"/gate.{json,xml,sarif,md}

# Results for a run that ended before the tool wrote any.
leave_results() {
  code=$?
  what="swarmcert gate did not run to its end (exit code $code); see the log of this step"
  [ -e "$output/gate.xml" ] || cat >"$output/gate.xml" <<END
<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="swarmcert gate" tests="1" failures="0" errors="1" skipped="0" time="0">
  <testsuite name="swarmcert gate" tests="1" failures="0" errors="1" skipped="0" time="0">
    <testcase classname="swarmcert.gate" name="gate" time="0"><error message="$what"/></testcase>
  </testsuite>
</testsuites>
END
  [ -e "$output/gate.sarif" ] || cat >"$output/gate.sarif" <<END
{"\$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [
  {"tool": {"driver": {"name": "swarmcert"}}, "results": [],
   "invocations": [{"executionSuccessful": false, "toolExecutionNotifications": [
     {"level": "error", "message": {"text": "$what"}}]}]}]}
END
  if [ -n "${GITHUB_OUTPUT:-}" ]; then
    verdict=$(sed -n 's/^  "verdict": "\(pass\|fail\|inconclusive\)",\{0,1\}$/\1/p' "$output/gate.json" 2>/dev/null)
    printf 'verdict=%s\n' "${verdict:-fail}" >>"$GITHUB_OUTPUT"
  fi
  exit "$code"
}
trap leave_results EXIT

# Installs the package that the release has for this distribution, with what it depends on.
released() {
  [ -n "${GATE_RELEASE:-}" ] && command -v gh >/dev/null || return
  distribution=$(. /etc/os-release && printf '%s' "$ID$VERSION_ID")
  rm -rf "$cache/download" && mkdir -p "$cache/download" || return
  gh release download "${GATE_RELEASE##*@}" --repo "${GATE_RELEASE%@*}" \
    --pattern "swarmcert_*_$distribution.deb" --dir "$cache/download" || return
  as_root=(); [ "$(id -u)" = 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get install -y --no-install-recommends "$cache"/download/*.deb || return
  tool=swarmcert
  "$tool" --version
}

built() {
  tool=$cache/swarmcert
  "$tool" --version 2>/dev/null && return
  root=$(cd -P "$(dirname "$0")/../.." && pwd) || return
  "$root/bootstrap" build || return
  cmake --install "$root/build/release" --prefix "$cache/built" --component tool >/dev/null &&
    ln -sfn built/bin/swarmcert "$tool"
}

command -v "$tool" >/dev/null || released || built || exit
options=(--json "$output/gate.json" --junit "$output/gate.xml" --sarif "$output/gate.sarif"
         --markdown "$output/gate.md" --bundle "$output/bundle" --force -q)
[ -n "${GATE_BASELINE:-}" ] && options+=(--baseline "$GATE_BASELINE")
[ "${GATE_ALLOW_INCONCLUSIVE:-false}" = true ] && options+=(--allow-inconclusive)
[ "${GITHUB_ACTIONS:-false}" = true ] && options+=(--github)
"$tool" gate "${options[@]}" -- "$policy"
