#!/bin/sh
# Makes what a release attaches, from a build of the release preset: the Debian packages, and the wheel with everything
# that its pages need. Needs patchelf, python3-wheel and, for gnuplot, the tools of a build by autoconf.
#   package.sh BUILD OUTPUT
set -eu
build=$(cd "$1" && pwd)
mkdir -p "$2"
output=$(cd "$2" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

cpack --config "$build/CPackConfig.cmake" -G DEB -B "$scratch/packages"
mv "$scratch"/packages/*.deb "$output"

version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
for component in tool python; do cmake --install "$build" --component "$component" --prefix "$scratch/prefix"; done
"$here/small_gnuplot.sh" "$scratch/gnuplot"
cp "$scratch/gnuplot/gnuplot.copyright" "$scratch/prefix/share/doc/swarmcert/licences/gnuplot"
/usr/bin/python3 "$here/../python/wheel.py" "$scratch/prefix" "$version" "$output" --gnuplot "$scratch/gnuplot/gnuplot"
