"""Two halves of one scan of a pile as two surveys: nothing happened, so no change may be called and levels must hold.

  pip install numpy
  python3 tools/oracle/foreign_piles.py ...            # piles of another engine and scanner: FOLDER/CONDITION/SEED/cloud.ply
  python3 tools/oracle/halves.py FOLDER --seeds 15,16 no-ground ground-dolos [--program target/release/tsumu]

Each point goes to one half by chance. Both are recognised from nothing and compared. A difference of which every axis lies within 1.96
standard deviations in 95 of 100 cases is shorter than its level in 72 of 100.
"""
import argparse
import collections
import csv
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

SITE = """name = "Half"
crs = "EPSG:6679"
vertical_datum = "T.P."
[[survey]]
file = "survey.xyz"
sensor = "uav"
vertical_offset_m = 0.0
"""
KINDS = {"float": "<f4", "double": "<f8", "int": "<i4", "uint": "<u4", "uchar": "u1", "short": "<i2", "ushort": "<u2", "char": "i1"}


def positions(file):
    raw = file.read_bytes()
    at = raw.index(b"end_header\n") + len(b"end_header\n")
    head = raw[:at].decode()
    if "binary_little_endian" not in head:
        raise SystemExit(f"{file}: not a binary PLY")
    fields = [line.split() for line in head.splitlines() if line.startswith("property")]
    cloud = np.frombuffer(raw[at:], dtype=[(name, KINDS[kind]) for _, kind, name in fields])
    return np.column_stack([cloud[axis] for axis in "xyz"])


def compared(program, scene, work):
    points = positions(scene / "cloud.ply")
    first = np.random.default_rng(7).random(len(points)) < 0.5
    for name, half in (("a", first), ("b", ~first)):
        site = work / name
        site.mkdir(parents=True)
        np.savetxt(site / "survey.xyz", points[half], fmt="%.5f")
        (site / "site.toml").write_text(SITE)
        for file in [scene / "catalog.toml", *scene.glob("*.stl")]:
            shutil.copy(file, site)
    subprocess.run([program, "compare", work / "a", work / "b", "--out", work / "c", "--quiet"], check=True)
    with (work / "c/changes.csv").open() as file:
        return list(csv.DictReader(file))


def main():
    ask = argparse.ArgumentParser()
    ask.add_argument("folder", type=Path)
    ask.add_argument("conditions", nargs="+")
    ask.add_argument("--seeds", default="15,16")
    ask.add_argument("--program", default="target/release/tsumu")
    asked = ask.parse_args()
    classes, pairs, inside = collections.Counter(), 0, 0
    for scene in [asked.folder / c / s for c in asked.conditions for s in asked.seeds.split(",")]:
        with tempfile.TemporaryDirectory() as work:
            rows = compared(asked.program, scene, Path(work))
        both = [row for row in rows if row["earlier_id"] and row["later_id"]]
        short = sum(float(row["distance_m"]) <= float(row["level_m"]) for row in both)
        found = collections.Counter(row["class"] for row in rows)
        print(f"{scene.parent.name} {scene.name}: {len(both)} pairs, {short} within their level, {dict(found)}", flush=True)
        classes, pairs, inside = classes + found, pairs + len(both), inside + short
    print(f"together: {pairs} pairs, {inside} within their level, {dict(classes)}")


if __name__ == "__main__":
    main()
