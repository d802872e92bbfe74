#!/usr/bin/env python3
"""What a call from Python costs over the command, on the sample: `bench_python.py PROGRAM [ROUNDS]`.

Turn by turn: `tsumu recognise` on the sample's survey, and a Python process that does the same with arrays (laspy reads, `tsumu.recognise`, `save`). CPU seconds of
the whole processes; also of the call alone within one process, against the library's own work.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "examples/breakwater"
CALL = """
import sys, time, laspy, tsumu
cloud = laspy.read(sys.argv[1])
cpu = time.process_time()
found = tsumu.recognise(cloud, tsumu.Catalog.load(sys.argv[2]), lines=cloud.point_source_id, crs="EPSG:6679")
labels, poses = found.labels, found.poses
print(time.process_time() - cpu)
found.save(sys.argv[3])
"""


def spent(words: list[str]) -> tuple[float, str]:
    """CPU seconds of a child, and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, said


def main(program: str, rounds: int) -> None:
    """Prints medians and their ratio."""
    survey, catalog = str(SAMPLE / "survey.laz"), str(SAMPLE / "catalog.toml")
    command, process, call = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(rounds):
            out = [str(Path(folder) / f"{name}{i}") for name in ("command", "python")]
            command.append(spent([program, "recognise", survey, "--catalog", catalog, "--out", out[0], "--quiet"])[0])
            seconds, said = spent([sys.executable, "-c", CALL, survey, catalog, out[1]])
            process.append(seconds)
            call.append(float(said))
            same = [(Path(o) / "recognise/blocks.csv").read_bytes() for o in out]
            assert same[0] == same[1], "the two differ"
    a, b, c = map(statistics.median, (command, process, call))
    print(f"command {a:.2f} s CPU; Python process {b:.2f} s ({100 * (b / a - 1):+.1f} %); the call alone {c:.2f} s; {rounds} rounds, same blocks")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7)
