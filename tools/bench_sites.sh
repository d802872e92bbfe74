#!/usr/bin/env bash
# Recognition on held-out piles of the six site-sensor sets: makes scenes of a seed no training used, recognises them,
# scores each set. Usage: tools/bench_sites.sh TSUMU SCENES OUT [SEED]
set -euo pipefail
tsumu=$1 scenes=$2 out=$3 seed=${4:-900001}
cd "$(dirname "$0")/.."
for recipe in sawara todohokke era; do
  for sensor in uav mbes; do
    set_dir="$out/$recipe-$sensor"
    "$tsumu" synth "recipes/$recipe-$sensor.toml" --scenes "$scenes" --seed "$seed" --out "$set_dir" --quiet
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
