"""Piles of blocks from an engine (PyBullet) and a ray caster (Embree) that are not Tsumu's, in conditions surveys come in.

    pip install -r tools/oracle/requirements-foreign.txt
    python3 tools/oracle/foreign_piles.py --out DIR [--seeds 1,2] [--only no-ground,grid-10-mean] [--list]

Writes DIR/CONDITION/SEED/ with cloud.ply, truth.csv, catalog.toml (what the recogniser is given, wrong where the condition
says so), scene.json (what is expected of the recogniser, where the sensor was) and broken.csv where legs are missing.
A folder that is there is left as it is; an interrupted run goes on when the same line is run again. The conditions are in
foreign/conditions.py. One scene takes 2 to 20 s on one core.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--only", default="", help="conditions, or groups, separated by commas")
    parser.add_argument("--list", action="store_true", help="name the conditions and end")
    args = parser.parse_args()
    from foreign import conditions

    rows = conditions.rows()
    if args.list:
        for c in rows.values():
            print(f"{c.group:8} {c.name}")
        return
    wanted = [w for w in args.only.split(",") if w]
    chosen = [c for c in rows.values() if not wanted or c.name in wanted or c.group in wanted]
    unknown = set(wanted) - set(rows) - {c.group for c in rows.values()}
    if unknown:
        parser.error(f"no condition called {', '.join(sorted(unknown))}; see --list")
    from foreign import make

    for seed in (int(s) for s in args.seeds.split(",")):
        for c in chosen:
            folder = args.out / c.name / str(seed)
            if folder.is_dir():
                continue
            start = time.perf_counter()
            facts = make.write(c, seed, folder)
            took = time.perf_counter() - start
            print(f"{c.name}/{seed}: {facts['blocks']} blocks, {facts['points']} points, {took:.1f} s", flush=True)


if __name__ == "__main__":
    main()
