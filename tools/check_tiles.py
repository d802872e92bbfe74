#!/usr/bin/env python3
"""Tiles worked on by a Dask cluster of which a worker is killed in the middle: the run folder has the same bytes as from tiles worked
on one after the other, backwards, in one process each.

    python3 -m venv .venv && .venv/bin/pip install -r tools/requirements-tiles.txt
    .venv/bin/python tools/check_tiles.py target/release/tsumu WORK_FOLDER
"""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from distributed import Client, LocalCluster

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "examples" / "tiles"))
from tiles_dask import missing_tiles, work_on_all  # noqa: E402

PROGRAM, WORK = sys.argv[1], Path(sys.argv[2])
SITE = WORK / "site"
BLOCKS = "40"

RECIPE = """name = "short strip"
count = [100, 110]
density_per_m2 = 220.0
[site]
kind = "strip"
length_m = 52.0
width_m = 8.0
[sensor]
kind = "gaussian"
noise_sd_m = 0.01
"""
CATALOG = """[[block]]
name = "tetrapod-5t"
shape = { kind = "tetrapod", size = 2.0 }
"""
SITE_TOML = """name = "short strip"
crs = "EPSG:6679"
vertical_datum = "T.P."
seed = 5
[[survey]]
file = "survey.laz"
vertical_offset_m = 0.0
"""


def tsumu(*arguments):
    subprocess.run([PROGRAM, "--quiet", *map(str, arguments)], check=True)


def make_site():
    SITE.mkdir(parents=True, exist_ok=True)
    for name, text in [("recipe.toml", RECIPE), ("catalog.toml", CATALOG), ("site.toml", SITE_TOML)]:
        (SITE / name).write_text(text)
    place = ["--site-crs", "EPSG:6679", "--site-origin", "41250,-98760,1.5"]
    tsumu("synth", SITE / "recipe.toml", "--catalog", SITE / "catalog.toml", "--seed", "17", *place, "--out", SITE)


def planned(name):
    tsumu("tiles", "plan", SITE, "--out", WORK / name, "--blocks-per-tile", BLOCKS)
    return WORK / name


def merged(plan, name):
    """Files of the run by name, wall times aside."""
    out = WORK / name
    tsumu("tiles", "merge", plan, "--out", out)
    files = [file for file in out.rglob("*") if file.is_file() and file.name != "timing.json"]
    return {str(file.relative_to(out)): file.read_bytes() for file in sorted(files)}


def kill_a_busy_worker(client, killed):
    """Waits until a worker is at work on a tile, then kills it as the system would."""
    while not killed:
        pids = client.run(os.getpid)
        for worker, tasks in client.processing().items():
            if tasks and not killed:
                time.sleep(0.5)
                # The tile's process may outlive its worker: two may then work on one tile.
                os.kill(pids[worker], signal.SIGKILL)
                killed.append(worker)
        time.sleep(0.05)


def by_dask(plan):
    killed = []
    with LocalCluster(n_workers=2, threads_per_worker=1, memory_limit=0, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            killer = threading.Thread(target=kill_a_busy_worker, args=(client, killed), daemon=True)
            killer.start()
            count = work_on_all(client, PROGRAM, plan)
            killer.join(timeout=5)
    if not killed:
        sys.exit("no worker was killed: the test tests nothing")
    print(f"  {count} tiles by Dask, worker {killed[0]} killed in the middle")


def main():
    make_site()
    one = planned("plan-backwards")
    keys = missing_tiles(PROGRAM, one)
    if len(keys) < 3:
        sys.exit(f"the site has {len(keys)} tiles: give a larger one")
    for key in reversed(keys):
        tsumu("tiles", "run", one, "--key", key, "--threads", "1")
    other = planned("plan-dask")
    by_dask(other)
    a, b = merged(one, "run-backwards"), merged(other, "run-dask")
    differing = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
    if differing:
        sys.exit(f"these files differ: {', '.join(differing)}")
    print(f"  {len(a)} files of the run have the same bytes")


if __name__ == "__main__":
    main()
