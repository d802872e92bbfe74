#!/usr/bin/env python3
"""LAZ reading and writing against laspy + lazrs, in one run, turn about.

    cargo build --release -p io --example convert
    python tools/bench_files.py target/release/examples/convert FILE.laz…

Prints the least of five CPU and wall times. Ours contain the start of a process (CPU) but not in the wall times, which
the program takes itself.
"""

import os
import re
import resource
import subprocess
import sys
import tempfile
import time

import laspy

CONVERT, FILES = sys.argv[1], sys.argv[2:]
PARALLEL, ALONE = laspy.LazBackend.LazrsParallel, laspy.LazBackend.Lazrs


def ours(*arguments):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = subprocess.run([CONVERT, *arguments], capture_output=True, text=True, check=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, [float(s) for s in re.findall(r"in ([\d.]+) s", out)]


def timed(work):
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


for path in FILES:
    with tempfile.TemporaryDirectory() as folder:
        mine, theirs = os.path.join(folder, "mine.laz"), os.path.join(folder, "theirs.laz")
        read, peer_read, peer_alone, both, peer_write = [], [], [], [], []
        for _ in range(5):
            cpu, wall = ours(path)
            read.append((cpu, wall[0]))
            peer_read.append(timed(lambda: laspy.read(path, laz_backend=PARALLEL).xyz))
            peer_alone.append(timed(lambda: laspy.read(path, laz_backend=ALONE).xyz))
            cpu, wall = ours(path, mine)
            both.append((cpu, wall[1]))
            cloud = laspy.read(mine)
            peer_write.append(timed(lambda: cloud.write(theirs, laz_backend=PARALLEL)))
        least = lambda rows: [min(column) for column in zip(*rows)]
        (r, rw), (p, pw), (a, aw), (b, bw), (w, ww) = map(least, (read, peer_read, peer_alone, both, peer_write))
        print(f"{os.path.basename(path)}: {len(cloud)} points, written {os.path.getsize(mine)} / {os.path.getsize(theirs)} bytes")
        print(f"  read   CPU {r:.3f} s, laspy {p:.3f} s (one thread {a:.3f} s): {r / p:.2f}; wall {rw:.3f} / {pw:.3f} s: {rw / pw:.2f}")
        print(f"  write  CPU {b - r:.3f} s, laspy {w:.3f} s: {(b - r) / w:.2f}; wall {bw:.3f} / {ww:.3f} s: {bw / ww:.2f}")
