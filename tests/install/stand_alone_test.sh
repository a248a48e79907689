#!/bin/sh
# The packages of a release give a page from a log where nothing else is installed: the wheel in a fresh virtual
# environment without gnuplot, and the .deb in a bare Debian. Exit code 77: cannot be tried here.
#   stand_alone_test.sh SOURCE BUILD SCRATCH
set -eu
source=$1 build=$2 scratch=$3
for program in patchelf autoreconf debootstrap; do
  command -v $program >/dev/null || { echo "skipped: $program is missing"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: a bare Debian needs root"; exit 77; }

rm -rf "$scratch"
mkdir -p "$scratch"
"$source/analysis/ci/package.sh" "$build" "$scratch/packages"
ls -l "$scratch/packages"

# A flight with drag, and a page on a model without it.
page() {  # page COMMAND... : the tool
  "$@" simulate circle --vehicles 1 --duration 20 --seed 1 -q -o "$work/flights" \
    --model "$share/models/crazyflie-small-effects.toml" --gains "$share/gains/crazyflie-small.toml"
  "$@" compare "$share/models/crazyflie-small.toml" "$work/flights" -q --report "$work/report"
}
has_plots() {
  grep -q '<img src="data:image/svg+xml;base64,' "$1"/*.html && ! grep -q 'Not drawn' "$1"/*.html
}

python3=/usr/bin/python3
$python3 -m venv --system-site-packages "$scratch/venv"  # numpy is the distribution's
"$scratch/venv/bin/pip" install --quiet --no-index --no-deps "$scratch"/packages/*.whl
share=$scratch/venv/share/swarmcert work=$scratch/wheel
start=$(date +%s)
PATH=/nowhere page "$scratch/venv/bin/swarmcert"
echo "wheel: from a log to a page in $(($(date +%s) - start)) s"
has_plots "$work/report"
"$scratch/venv/bin/python" -c 'import swarmcert; print("module", swarmcert.__version__)'

root=$scratch/root
in_root() {  # with /proc, mounted for this command only
  unshare --mount sh -c 'root=$1 && shift && mount -t proc proc "$root/proc" && exec chroot "$root" "$@"' - "$root" "$@"
}
debootstrap --variant=minbase "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$root" >"$scratch/debootstrap.log"
cp "$scratch"/packages/swarmcert_*.deb "$root/tmp/"
chroot "$root" sh -c 'apt-get update -q && apt-get install -q -y /tmp/swarmcert_*.deb' >"$scratch/apt.log"
share=/usr/share/swarmcert work=/tmp/deb
start=$(date +%s)
page in_root swarmcert
echo "deb: from a log to a page in $(($(date +%s) - start)) s"
has_plots "$root$work/report"  # gnuplot-nox is recommended by the package
rm -rf "$scratch"
