#!/usr/bin/env python3
"""Works on the tiles of a large site with Dask, then merges them into a run folder.

    pip install distributed==2026.8.0
    tsumu tiles plan SITE --out PLAN
    python examples/tiles/tiles_dask.py PLAN --out SITE/run                 # workers on this machine
    python examples/tiles/tiles_dask.py PLAN --out SITE/run --scheduler tcp://head:8786

Every worker must see PLAN under the same path (and the site folder, for its catalogue). A tile is a process of its own: a worker
that dies in the middle loses that tile's work and nothing else, and a tile done twice counts once.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

from distributed import Client, LocalCluster, as_completed

TRY_AGAIN = 75


class TryAgain(Exception):
    """What failed may go the next time."""


def tsumu(program, *arguments):
    """Runs the program; what it says on standard output as JSON lines."""
    done = subprocess.run([program, "--json", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode == TRY_AGAIN or done.returncode < 0:
        raise TryAgain(f"{' '.join(map(str, arguments))}: {done.returncode}: {done.stderr.strip()}")
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def work_on(program, plan, key, threads):
    """One tile, on a worker. Dask sends it elsewhere when this raises or the worker dies."""
    lines = tsumu(program, "tiles", "run", plan, "--key", key, "--threads", threads)
    return next(line["value"] for line in lines if line["event"] == "tile")


def missing_tiles(program, plan):
    """Names of the tiles that are not done yet. Tiles of another plan are an error at once."""
    status = next(line["value"] for line in tsumu(program, "tiles", "status", plan) if line["event"] == "status")
    if status["wrong"]:
        sys.exit("\n".join(status["wrong"]))
    return status["missing"]


def work_on_all(client, program, plan, threads=1, retries=3, tell=print):
    """All tiles that are missing; returns how many were worked on."""
    keys = missing_tiles(program, plan)
    tasks = [
        client.submit(work_on, program, str(plan), key, threads, key=f"tile-{key}", retries=retries, pure=False)
        for key in keys
    ]
    for number, task in enumerate(as_completed(tasks), 1):
        done = task.result()
        tell(f"{number} of {len(keys)}: {done['key']}, {done['blocks']} blocks{', kept' if done['kept'] else ''}")
    return len(keys)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plan", type=Path, help="folder of `tsumu tiles plan`")
    parser.add_argument("--out", type=Path, required=True, help="run folder")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; without it workers start on this machine")
    parser.add_argument("--workers", type=int, default=2, help="workers on this machine")
    parser.add_argument("--threads", type=int, default=1, help="threads of each tile's process")
    parser.add_argument("--tsumu", default="tsumu", help="the program")
    args = parser.parse_args()
    plan = args.plan.resolve()
    # The memory is the child process's, of which Dask sees nothing: `tiles plan --memory` bounds it.
    cluster = None if args.scheduler else LocalCluster(n_workers=args.workers, threads_per_worker=1, memory_limit=0, dashboard_address=None)
    with Client(args.scheduler or cluster) as client:
        work_on_all(client, args.tsumu, plan, args.threads)
    if cluster:
        cluster.close()
    subprocess.run([args.tsumu, "tiles", "merge", str(plan), "--out", str(args.out)], check=True)


if __name__ == "__main__":
    main()
