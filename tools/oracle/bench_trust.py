"""The standing gate on foreign data: runs the built program over every condition of foreign_piles.py and prints one table.

    cargo xtask bench trust OUT [--seeds 12,13] [--only …] [--shapes …] [--data DIR] [--check] [--again]

builds the program, installs what is needed into an environment of its own and calls this script:

    python3 tools/oracle/bench_trust.py --tsumu target/release/tsumu --scenes DIR [--seeds 12,13] [--only …] [--shapes …]
                                        [--data DIR] [--out TABLE.md] [--runs DIR] [--check] [--again] [-- recognise options]

--only takes conditions, groups (see foreign_piles.py --list), `bins`, `bin-PART` and `real`; --shapes makes the conditions
with other blocks than the usual ones (tetrapod, dolos, cube, hook).

P, R, E_d and E_R as `tsumu evaluate` counts them; "n. j.": not judged; ".9+": how many of the statements of confidence .9 or
more are right. Scenes that are missing are made. Runs are kept in --runs, and only new ones made, until --again or another
program: the runs are filed under a hash of the binary. With --data, real clouds are run too when the folder holds them:
tetrapods (ajaccio_tetrapods), land and trees (lidar), boulders (rocks), pipes (realsense_pipes). --check ends with status 1 when a row misses what it expects.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from foreign import bins, conditions, real, score  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tsumu", type=Path, required=True)
    parser.add_argument("--scenes", type=Path, required=True)
    parser.add_argument("--seeds", default="12")
    parser.add_argument("--only", default="")
    parser.add_argument("--shapes", default="")
    parser.add_argument("--data", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--runs", type=Path)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("options", nargs="*", help="handed to `tsumu recognise` as they are")
    return parser.parse_args()


def recognise(args, cloud, catalog, run, extra=()):
    """Runs the program; its log, status and seconds are kept beside the run."""
    log = run / "bench.json"
    if log.is_file() and not args.again and json.loads(log.read_text())["status"] == 0:
        return json.loads(log.read_text())
    shutil.rmtree(run, ignore_errors=True)
    run.parent.mkdir(parents=True, exist_ok=True)
    command = [args.tsumu, "recognise", *cloud, "--catalog", catalog, "--out", run, *extra, *args.options]
    start = time.perf_counter()
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    facts = {"status": done.returncode, "seconds": time.perf_counter() - start, "said": done.stdout + done.stderr}
    run.mkdir(exist_ok=True)
    log.write_text(json.dumps(facts))
    return facts


def run_scene(args, runs, condition, seed):
    scene = args.scenes / condition.name / str(seed)
    if not (scene / "scene.json").is_file():
        from foreign import make

        make.write(condition, seed, scene)
    facts = json.loads((scene / "scene.json").read_text())
    places = [v for p in facts["sensor_positions"] for v in ("--sensor-position", ",".join(f"{x:.3f}" for x in p))]
    run = runs / condition.name / str(seed)
    did = recognise(args, [scene / "cloud.ply"], scene / "catalog.toml", run, places)
    got = score.score(scene, run)
    got.seconds, got.refused = did["seconds"], int(did["status"] != 0)
    got.warned = int("warning" in did["said"].lower() or did["status"] != 0)
    return got


def missed(expect, got):
    """What a row does not reach, in words."""
    share = {"precision": got.precision, "recall": got.recall}
    out = [f"{k} below {v:.2f}" for k, v in expect.items() if k in share and (share[k] is None or share[k] < v)]
    if got.refused and "precision" in expect:
        out.append("refused")
    if "stated_at_half" in expect and got.stated_from(0.5) > expect["stated_at_half"]:
        out.append(f"{got.stated_from(0.5)} stated at .5 or more")
    if "stated" in expect and got.stated > expect["stated"] * got.scenes:
        out.append(f"{got.stated} stated")
    if "warned" in expect and got.warned < got.scenes:
        out.append("no warning")
    return "; ".join(out)


def percent(v):
    return "–" if v is None else f"{100 * v:.1f}"


def mean(values, factor=1.0, digits=1):
    return f"{factor * sum(values) / len(values):.{digits}f}" if values else "–"


HEAD = "| condition | scenes | asked | stated | P % | R % | E_d mm | E_R ° | n. j. | .9+ right | s | misses |\n|---|---|---|---|---|---|---|---|---|---|---|---|"


def line(name, got, misses):
    ok, n = got.right_from(0.9)
    sure = f"{round(ok * n)} of {n}" if n else "–"
    return (
        f"| {name} | {got.scenes} | {got.asked} | {got.stated} | {percent(got.precision)} | {percent(got.recall)} | "
        f"{mean(got.displaced_m, 1000)} | {mean(got.turned_deg, digits=2)} | {got.not_judged} | {sure} | "
        f"{got.seconds / max(got.scenes, 1):.1f} | {misses or '–'} |"
    )


def calibration(scores):
    """Share right by band of confidence, over everything."""
    bands = [(0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 0.97), (0.97, 0.99), (0.99, 1.01)]
    statements = [s for got in scores for s in got.statements]
    out = ["| confidence | statements | mean | right |", "|---|---|---|---|"]
    for low, high in bands:
        these = [s for s in statements if low <= s[0] < high]
        if these:
            said, right = (sum(float(s[i]) for s in these) / len(these) for i in (0, 1))
            out.append(f"| {low:.2f}–{min(high, 1):.2f} | {len(these)} | {said:.3f} | {right:.3f} |")
    for least in (0.9, 0.99):
        these = [ok for c, ok in statements if c >= least]
        out.append(f"| {least} and more | {len(these)} | | {sum(these) / max(len(these), 1):.4f} |")
    return out


def broken_line(got):
    seen = [f for true, f in got.flagged if true]
    whole = [f for true, f in got.flagged if not true]
    if seen and whole:
        return f"Broken units flagged: {sum(seen)} of {len(seen)}; whole ones flagged: {sum(whole)} of {len(whole)}."
    return None


def main():
    args = arguments()
    digest = hashlib.blake2b(args.tsumu.read_bytes(), digest_size=6).hexdigest()
    runs = (args.runs or args.scenes / "runs") / digest
    wanted = {w for w in args.only.split(",") if w}
    shapes = [s for s in args.shapes.split(",") if s]
    rows = conditions.of_shapes(shapes) if shapes else conditions.rows()
    known = set(rows) | {c.group for c in rows.values()} | {"bins", "real"} | {f"bin-{p}" for p in bins.PARTS}
    known |= {f"bin-{p}-{w}" for p in bins.PARTS for w in bins.WAYS} | {c.split("@")[0] for c in rows}
    if wanted - known:
        sys.exit(f"no condition called {', '.join(sorted(wanted - known))}; see foreign_piles.py --list")
    say = lambda text: print(text, file=sys.stderr, flush=True)
    text, scores, short = [], [], 0
    chosen = [c for c in rows.values() if not wanted or wanted & {c.name, c.group, c.name.split("@")[0]}]
    if chosen:
        text.append(HEAD)
    for c in chosen:
        got = sum((run_scene(args, runs, c, int(s)) for s in args.seeds.split(",")), score.Score())
        misses = missed(c.expect, got)
        short += bool(misses)
        scores.append(got)
        text.append(line(c.name, got, misses))
        say(text[-1])
        if broken_line(got):
            text.append(f"\n{broken_line(got)}\n\n{HEAD}")
    if scores:
        text += ["", *calibration(scores)]
    run = lambda *a: recognise(args, *a)
    if not shapes:
        seeds = args.seeds.split(",")
        text += ["", *bins.table(args.tsumu, seeds, args.scenes / "bins", runs, run, wanted, say)]
    if args.data and (not wanted or "real" in wanted):
        text += ["", *real.table(args.data, runs, run, say)]
    table = "\n".join(text) + "\n"
    print(table)
    if args.out:
        part = args.out.with_suffix(".part")
        part.write_text(table)
        os.replace(part, args.out)
    sys.exit(1 if args.check and short else 0)


if __name__ == "__main__":
    main()
