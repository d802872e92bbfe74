"""Surface change of two surveys against py4dgeo's M3C2 on the same clouds, in one run, with the time of both.

  pip install py4dgeo laspy[lazrs]
  cargo build --release -p monitor --example surface_change
  python3 tools/oracle/m3c2.py EARLIER.laz LATER.laz --size 2.0 [--program target/release/examples/surface_change]

Twice: at our places with our normals, where both must say the same, and with py4dgeo's own normals at the same scale.
"""
import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import laspy
import numpy as np
import py4dgeo

# Scales of `tsumu compare`, in block lengths (crates/monitor/src/surface.rs).
NORMAL, CYLINDER, REACH, LEAST = 0.25, 0.125, 0.75, 5


def points(file, origin=None):
    las = laspy.read(file)
    xyz = np.column_stack([las.x, las.y, las.z])
    origin = np.floor(xyz.min(axis=0)) if origin is None else origin
    return (xyz - origin).astype(np.float32), origin


def m3c2(clouds, cores, normals, size):
    epochs = [py4dgeo.Epoch(c.astype(np.float64)) for c in clouds]
    how = dict(corepoint_normals=normals) if normals is not None else dict(normal_radii=[NORMAL * size])
    algorithm = py4dgeo.M3C2(epochs=tuple(epochs), corepoints=cores, cyl_radius=CYLINDER * size,
                             max_distance=REACH * size, registration_error=0.0, **how)
    start = time.time()
    distances, uncertainty = algorithm.run()
    return distances, uncertainty, time.time() - start


def told(name, ours, level, theirs, theirs_level, enough):
    both = enough & np.isfinite(theirs) & np.isfinite(ours)
    apart = np.abs(ours - theirs)[both]
    inside = apart <= level[both]
    # Where only one of the two calls a change.
    calls = np.abs(ours[both]) > level[both]
    calls_theirs = np.abs(theirs[both]) > theirs_level[both]
    print(f"{name}: {both.sum()} places; apart {1e3 * np.median(apart):.4f} mm in the median, {1e3 * np.quantile(apart, 0.99):.3f} mm for 99 %; "
          f"within our level {100 * inside.mean():.2f} %; levels apart {1e3 * np.median(np.abs(level - theirs_level)[both]):.4f} mm; "
          f"same verdict {100 * np.mean(calls == calls_theirs):.2f} %")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("earlier")
    parser.add_argument("later")
    parser.add_argument("--size", type=float, default=2.0, help="block length, m")
    parser.add_argument("--program", default="target/release/examples/surface_change")
    given = parser.parse_args()
    first, origin = points(given.earlier)
    second, _ = points(given.later, origin)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / name for name in ("a", "b", "out.csv")]
        first.astype("<f4").tofile(files[0])
        second.astype("<f4").tofile(files[1])
        line = [given.program, *map(str, files[:2]), str(given.size), str(files[2])]
        seconds = float(subprocess.run(line, check=True, capture_output=True, text=True).stdout)
        table = np.genfromtxt(files[2], delimiter=",", names=True)
    cores = np.column_stack([table[c] for c in "xyz"])
    normals = np.column_stack([table[c] for c in ("nx", "ny", "nz")])
    ours, level = table["distance_m"], table["level_m"]
    print(f"{len(first)} and {len(second)} points, {len(cores)} places")
    took = {}
    for name, given_normals in (("our normals", normals), ("its own normals", None)):
        distance, uncertainty, took[name] = m3c2((first, second), cores, given_normals, given.size)
        enough = (uncertainty["num_samples1"] >= LEAST) & (uncertainty["num_samples2"] >= LEAST)
        told(name, ours, level, distance, uncertainty["lodetection"], enough)
    theirs = took["its own normals"]
    print(f"seconds, places and normals included: ours {seconds:.3f}, py4dgeo {theirs:.3f} ({theirs / seconds:.1f} times)")


if __name__ == "__main__":
    main()
