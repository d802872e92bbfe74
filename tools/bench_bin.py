#!/usr/bin/env python3
"""How long a look into a bin takes: `bench_bin.py [RECIPE] [--parts 20] [--points 50000] [--looks 40] [--seed 11]`.

Makes bins of the recipe (default recipes/bin-bracket.toml), thins each cloud to so many points, and looks at them in turn with one `tsumu.Bin`.
Prints a row: wall seconds (p50, p99), CPU seconds, and how many of the true parts that are hidden to less than 80 % were found within a tenth of
their size. Wall times count on a quiet machine only.
"""

from __future__ import annotations

import argparse
import re
import tempfile
import time
from pathlib import Path

import numpy as np

import tsumu

ROOT = Path(__file__).resolve().parents[1]


def recipe_of(file: Path, parts: int, folder: Path) -> Path:
    """The recipe with so many parts."""
    text, changed = re.subn(r"^count = .*$", f"count = [{parts}, {parts}]", file.read_text("utf-8"), flags=re.MULTILINE)
    if changed != 1:
        raise SystemExit(f"{file}: has no line `count = …`")
    out = folder / file.name
    out.write_text(text)
    return out


def found_of(look: tsumu.BinLook, scene: tsumu.SyntheticScene, size_m: float) -> tuple[int, int]:
    """True parts in sight that were found, and those in sight."""
    truth = scene.poses[scene.occlusion < 0.8][:, :3, 3]
    places = look.poses[:, :3, 3]
    near = [len(places) > 0 and np.linalg.norm(places - place, axis=1).min() < 0.1 * size_m for place in truth]
    return int(sum(near)), len(truth)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", nargs="?", type=Path, default=ROOT / "recipes/bin-bracket.toml")
    parser.add_argument("--parts", type=int, default=20)
    parser.add_argument("--points", type=int, default=50_000)
    parser.add_argument("--looks", type=int, default=40)
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--threads", type=int)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        recipe = recipe_of(args.recipe, args.parts, Path(folder))
        scenes = [tsumu.synth(recipe, args.seed, scene=i) for i in range(args.scenes)]
    random = np.random.default_rng(args.seed)
    clouds = []
    for scene in scenes:
        kept = min(args.points, len(scene.points))
        clouds.append(scene.points[np.sort(random.choice(len(scene.points), kept, replace=False))])
    start, cpu = time.perf_counter(), time.process_time()
    bin = tsumu.Bin(scenes[0].catalog, threads=args.threads)
    print(f"ready in {time.perf_counter() - start:.2f} s, {time.process_time() - cpu:.2f} s CPU")
    size_m = max(t.longest_edge_m for t in scenes[0].catalog)
    wall, spent, right, all_parts = [], [], 0, 0
    for i in range(args.looks):
        scene, cloud = scenes[i % len(scenes)], clouds[i % len(scenes)]
        start, cpu = time.perf_counter(), time.process_time()
        look = bin.look(cloud, sensor_positions=scene.sensor_positions if len(scene.sensor_positions) else None)
        wall.append(time.perf_counter() - start)
        spent.append(time.process_time() - cpu)
        if i < len(scenes):
            found = found_of(look, scene, size_m)
            right, all_parts = right + found[0], all_parts + found[1]
    sizes = "/".join(str(len(cloud)) for cloud in clouds)
    print("| recipe | parts | points | p50 s | p99 s | CPU s p50 | found |\n|---|---|---|---|---|---|---|")
    p50, p99 = np.percentile(wall, [50, 99])
    print(f"| {args.recipe.stem} | {args.parts} | {sizes} | {p50:.3f} | {p99:.3f} | {np.median(spent):.3f} | {right} of {all_parts} |")


if __name__ == "__main__":
    main()
