#!/usr/bin/env python3
"""What a large site costs in tiles: CPU seconds and peak memory of every step, for sites made of copies of one strip.

    python3 -m venv .venv && .venv/bin/pip install numpy==2.4.6 laspy==2.7.0 lazrs==0.8.2
    .venv/bin/python tools/bench_tiles.py target/release/tsumu WORK 1 5 10

WORK/strip is synthesised once (recipes/strip.toml, seed 7); a site of n copies has them one behind the other, 220 m apart, each with
fresh noise of 3 mm. Prints a Markdown table.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np

PROGRAM, WORK = sys.argv[1], Path(sys.argv[2])
COPIES = [int(n) for n in sys.argv[3:]] or [1, 5, 10]
ORIGIN = (41_250.0, -98_760.0, 1.5)

SITE = """name = "strip x {n}"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5

[[survey]]
file = "survey.laz"
sensor = "uav"
vertical_offset_m = 0.0
"""


def measured(*arguments):
    """Runs the program; CPU seconds and peak memory in MB."""
    child = subprocess.Popen([PROGRAM, "--quiet", *map(str, arguments)])
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        sys.exit(f"tsumu {' '.join(map(str, arguments))} ended with {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def strip():
    folder = WORK / "strip"
    if not (folder / "survey.laz").exists():
        folder.mkdir(parents=True, exist_ok=True)
        recipe = Path(__file__).resolve().parent.parent / "recipes" / "strip.toml"
        origin = ",".join(map(str, ORIGIN))
        subprocess.run([PROGRAM, "synth", recipe, "--seed", "7", "--site-crs", "EPSG:6679", "--site-origin", origin, "--out", folder, "--quiet"], check=True)
    return folder


def site(copies):
    base, folder = strip(), WORK / f"x{copies}"
    if (folder / "survey.laz").exists():
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "catalog.toml").write_text('[[block]]\nname = "tetrapod-2.0m"\nshape = { kind = "tetrapod", size = 2.0 }\n')
    (folder / "site.toml").write_text(SITE.format(n=copies))
    cloud = laspy.read(base / "survey.laz")
    xyz = cloud.xyz
    along = int(np.argmax(np.ptp(xyz[:, :2], axis=0)))
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = [0.001] * 3, [round(v) for v in xyz.mean(axis=0)]
    random = np.random.default_rng(11)
    with laspy.open(folder / "survey.laz", "w", header=header) as out:
        for n in range(copies):
            moved = xyz + random.normal(0, 0.003, xyz.shape)
            moved[:, along] += 220.0 * n
            points = laspy.ScaleAwarePointRecord.zeros(len(moved), header=header)
            points.x, points.y, points.z = moved.T
            out.write_points(points)
    return folder


def row(copies):
    folder = site(copies)
    plan, run = folder / "plan", folder / "run-tiles"
    planned = measured("tiles", "plan", folder, "--out", plan)
    tiles = json.loads((plan / "tiles.json").read_text())["tiles"]
    each = [measured("tiles", "run", plan, "--key", tile["key"]) for tile in tiles]
    merged = measured("tiles", "merge", plan, "--out", run)
    points = sum(tile["points"] for tile in tiles)
    blocks = sum(1 for _ in open(run / "recognise" / "blocks.csv")) - 1
    cpu = planned[0] + sum(e[0] for e in each)
    said = max(tile["memory_bytes"] for tile in tiles)
    return (
        f"| {points / 1e6:.2f} M | {blocks} | {len(tiles)} | {planned[0]:.0f} s, {planned[1]:.0f} MB | {sum(e[0] for e in each):.0f} s "
        f"| {max(e[1] for e in each):.0f} MB ({said / 1e6:.0f} promised) | {merged[0]:.0f} s, {merged[1]:.0f} MB | {1e3 * cpu / blocks:.1f} ms | {1e6 * cpu / points:.2f} µs |"
    )


print("| points | blocks | tiles | plan | all tiles, CPU | largest tile | merge | plan and tiles a block | a point |")
print("|---|---|---|---|---|---|---|---|---|")
for copies in COPIES:
    print(row(copies), flush=True)
