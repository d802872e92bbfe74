#!/usr/bin/env bash
# Recognition on held-out piles of the six site-sensor sets: makes scenes of a seed no training used, recognises them,
# scores each set. Usage: tools/bench_sites.sh TSUMU SCENES OUT [SEED [white-noise]]
# white-noise: the thesis' sensors (1 cm for the drone, 3 cm for the echo sounder, one viewpoint) in place of the realistic ones.
set -euo pipefail
tsumu=$(realpath "$1") scenes=$2 out=$3 seed=${4:-900001} noise=${5:-realistic}
mkdir -p "$out"
out=$(realpath "$out")
cd "$(dirname "$0")/.."
for recipe in sawara todohokke era; do
  for sensor in uav mbes; do
    set_dir="$out/$recipe-$sensor"
    made_of="recipes/$recipe-$sensor.toml"
    if [ "$noise" = white-noise ]; then
      [ "$sensor" = uav ] && noise_m=0.01 || noise_m=0.03
      # The table [sensor] up to the next empty line gives way.
      awk -v noise="$noise_m" -v sensor="$sensor" '
        /^\[sensor\]/ { print "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = " noise "\nmeasured_as = \"" sensor "\""; skip = 1; next }
        /^$/ { skip = 0 }
        !skip' "$made_of" > "$out/$recipe-$sensor.toml"
      made_of="$out/$recipe-$sensor.toml"
    fi
    "$tsumu" synth "$made_of" --scenes "$scenes" --seed "$seed" --out "$set_dir" --quiet
    sed -n '/^\[\[catalog.block\]\]/,$p' "recipes/$recipe-$sensor.toml" | sed 's/^\[\[catalog\.block\]\]/[[block]]/' > "$set_dir/catalog.toml"
    start=$(date +%s.%N)
    for scene in "$set_dir"/scenes/*/; do
      name=$(basename "$scene")
      # The boat's and the drone's positions are known, as they are in a survey with its trajectory.
      positions=$(python3 -c 'import json, sys
for p in json.load(open(sys.argv[1]))["sensor_positions"]: print("--sensor-position=" + ",".join(map(str, p)))' "$scene/scene.json")
      # shellcheck disable=SC2086
      "$tsumu" recognise "$scene/cloud.ply" $positions --catalog "$set_dir/catalog.toml" --sensor "$sensor" \
        --out "$out/result/$recipe-$sensor/$name" --quiet
    done
    seconds=$(awk -v a="$start" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f", b - a }')
    echo "== $recipe-$sensor: $scenes scenes, recognised in $seconds s"
    "$tsumu" evaluate --truth "$set_dir/scenes" --result "$out/result/$recipe-$sensor" \
      --catalog "$set_dir/catalog.toml" --out "$out/$recipe-$sensor.json"
  done
done
