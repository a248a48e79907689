#!/bin/sh
# Draws the README's pictures from what the README's commands write. Usage: draw.sh TOOL SOURCE_FOLDER WORK_FOLDER
# `cmake --build --preset dev -t update_pictures` calls it.
set -eu
tool=$1 source=$2 work=$3
here=$source/notebooks_cpp/pictures
rm -rf "$work"
mkdir -p "$work"
cd "$source"
model=stability/models/crazyflie-small.toml

for run in 1 2 3 4 5; do
  "$tool" simulate random-walk --vehicles 2 --duration 40 --model stability/models/crazyflie-small-effects.toml \
    --gains controller/gains/crazyflie-small.toml --seed "$run" -o "$work/flights/$run" -q
done
"$tool" add auto --model "$model" "$work/flights" -o "$work/fitted.toml" -q
"$tool" compare "$model" "$work/flights" --report "$work/before" -q
"$tool" compare "$work/fitted.toml" "$work/flights" --report "$work/after" -q
"$tool" certify nn/networks/demo/network.toml --report "$work/certificate" -q

cd "$work"
gnuplot "$here/residual_maps.gp" "$here/certificate.gp"
cp residual_maps.png certificate.png "$here/"
