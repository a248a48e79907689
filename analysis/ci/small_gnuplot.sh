#!/bin/sh
# Builds gnuplot from the distribution's source package with the SVG terminal alone, which is all that reports need:
# one program of 2 MB that depends on the C library only, for packages that stand alone.
#   small_gnuplot.sh FOLDER      writes FOLDER/gnuplot and FOLDER/gnuplot.copyright
set -eu
mkdir -p "$1"
folder=$(cd "$1" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The package lists of sources, without changing those of the system.
mkdir -p "$scratch/sources" "$scratch/lists/partial"
sed 's/^Types: deb$/Types: deb-src/' /etc/apt/sources.list.d/*.sources >"$scratch/sources/src.sources"
apt_get() {
  apt-get -q -o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts="$scratch/sources" \
    -o Dir::State::lists="$scratch/lists" "$@"
}
cd "$scratch"
apt_get update
apt_get source gnuplot  # with the distribution's patches, without which it cannot be configured
cd gnuplot-*/
autoreconf -fi
./configure --without-x --without-gd --without-cairo --without-lua --without-readline --without-latex \
  --without-bitmap-terminals --disable-wxwidgets --with-qt=no
make -C src gnuplot
cp src/gnuplot "$folder/gnuplot"
cp Copyright "$folder/gnuplot.copyright"
