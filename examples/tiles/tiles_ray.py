#!/usr/bin/env python3
"""The same as tiles_dask.py with Ray, for people who have a Ray cluster.

    pip install ray==2.60.0
    tsumu tiles plan SITE --out PLAN
    python examples/tiles/tiles_ray.py PLAN --out SITE/run
"""

import argparse
import json
import subprocess
from pathlib import Path

import ray

TRY_AGAIN = 75


class TryAgain(Exception):
    """What failed may go the next time."""


def tsumu(program, *arguments):
    done = subprocess.run([program, "--json", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode == TRY_AGAIN or done.returncode < 0:
        raise TryAgain(done.stderr.strip())
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


@ray.remote(max_retries=3, retry_exceptions=[TryAgain])
def work_on(program, plan, key):
    lines = tsumu(program, "tiles", "run", plan, "--key", key, "--threads", 1)
    return next(line["value"] for line in lines if line["event"] == "tile")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plan", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--address", help="address of a Ray cluster; without it Ray starts on this machine")
    parser.add_argument("--tsumu", default="tsumu")
    args = parser.parse_args()
    plan = str(args.plan.resolve())
    ray.init(address=args.address, include_dashboard=False)
    status = next(line["value"] for line in tsumu(args.tsumu, "tiles", "status", plan) if line["event"] == "status")
    for done in ray.get([work_on.remote(args.tsumu, plan, key) for key in status["missing"]]):
        print(done["key"], done["blocks"], "blocks")
    ray.shutdown()
    subprocess.run([args.tsumu, "tiles", "merge", plan, "--out", str(args.out)], check=True)


if __name__ == "__main__":
    main()
