#!/usr/bin/env bash
# Runs the gate of action.yml. Other continuous integration systems set the variables below. The exit code is that of
# swarmcert gate.
#   GATE_POLICY              policy.toml
#   GATE_BASELINE            values of the last release; empty: none
#   GATE_OUTPUT              folder for the results; default: gate
#   GATE_ALLOW_INCONCLUSIVE  true: inconclusive checks do not fail
#   GATE_SWARMCERT           the tool; if it is not found, the repository that contains this script is built
set -uo pipefail

policy=${GATE_POLICY:?name a policy.toml}
output=${GATE_OUTPUT:-gate}
tool=${GATE_SWARMCERT:-swarmcert}
if ! command -v "$tool" >/dev/null; then
  root=$(cd -P "$(dirname "$0")/../.." && pwd) || exit
  "$root/bootstrap" build || exit
  tool=$root/build/release/analysis/swarmcert
fi

mkdir -p "$output" || exit
options=(--json "$output/gate.json" --junit "$output/gate.xml" --sarif "$output/gate.sarif"
         --markdown "$output/gate.md" --bundle "$output/bundle" --force -q)
[ -n "${GATE_BASELINE:-}" ] && options+=(--baseline "$GATE_BASELINE")
[ "${GATE_ALLOW_INCONCLUSIVE:-false}" = true ] && options+=(--allow-inconclusive)
[ "${GITHUB_ACTIONS:-false}" = true ] && options+=(--github)

"$tool" gate "${options[@]}" -- "$policy"
code=$?
if [ -n "${GITHUB_OUTPUT:-}" ]; then
  verdict=$(sed -n 's/^  "verdict": "\(pass\|fail\|inconclusive\)",\{0,1\}$/\1/p' "$output/gate.json" 2>/dev/null)
  printf 'verdict=%s\n' "${verdict:-fail}" >>"$GITHUB_OUTPUT"
fi
exit "$code"
