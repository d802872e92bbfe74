"""Files by independent writers, read by Tsumu, and labelled files of Tsumu, read by independent readers.

pip install laspy[lazrs] plyfile numpy; cargo build --release -p io --examples; python tools/check_inputs.py target/release/examples
"""

import pathlib
import subprocess
import sys
import tempfile

import laspy
import numpy as np
import plyfile


def survey(count=3000, seed=7):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 8, (count, 2))
    z = 3 - 0.3 * np.abs(xy[:, 0] - 4)
    return np.column_stack([xy + [41246, -98764], z])


def las_file(path, point_format, points, rng):
    header = laspy.LasHeader(point_format=point_format, version="1.4" if point_format > 5 else "1.3")
    header.offsets, header.scales = [41250, -98760, 0], [0.001] * 3
    header.add_extra_dim(laspy.ExtraBytesParams(name="quality", type=np.uint16))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.intensity = rng.integers(0, 65535, len(points))
    las.classification = rng.choice([2, 5, 7], len(points))
    las.quality = rng.integers(0, 65535, len(points))
    for name in ("red", "green", "blue", "nir"):
        if name in las.point_format.dimension_names:
            las[name] = rng.integers(0, 65535, len(points))
    if "gps_time" in las.point_format.dimension_names:
        las.gps_time = np.sort(rng.uniform(0, 1e6, len(points)))
    las.write(path)


def check_las(tools, folder):
    rng = np.random.default_rng(1)
    points = survey()
    for point_format in range(11):
        for kind in ("las", "laz"):
            source, out = folder / f"f{point_format}.{kind}", folder / f"o{point_format}.laz"
            if kind == "laz" and point_format in (9, 10):
                continue  # lazrs writes no waveforms of the new formats
            las_file(source, point_format, points, rng)
            subprocess.run([tools / "relabel", source, out], check=True)
            before, after = laspy.read(source), laspy.read(out)
            assert after.header.point_format.id == point_format
            for name in before.point_format.dimension_names:
                assert np.array_equal(before[name], after[name]), (point_format, kind, name)
            kept = np.asarray(before.classification) != 7
            wanted = np.where(kept, np.arange(len(points)) % 7, 0)
            assert np.array_equal(after["instance"], wanted), (point_format, kind)
            print(f"format {point_format} {kind}: {len(points)} records equal, labels right")


def check_ply(tools, folder):
    points = survey()
    for text in (False, True):
        for order in "<>":
            vertex = np.zeros(len(points), dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("red", "u1"), ("label", "i4")])
            vertex["x"], vertex["y"], vertex["z"] = points.T
            vertex["red"], vertex["label"] = np.arange(len(points)) % 256, -1
            source, out = folder / "a.ply", folder / "b.ply"
            element = plyfile.PlyElement.describe(vertex, "vertex")
            plyfile.PlyData([element], text=text, byte_order=order).write(str(source))
            subprocess.run([tools / "relabel", source, out], check=True)
            after = plyfile.PlyData.read(str(out))["vertex"]
            for name in vertex.dtype.names:
                assert np.array_equal(after[name], vertex[name]), (text, order, name)
            assert np.array_equal(after["instance"], np.arange(len(points)) % 7)
            print(f"PLY text={text} order={order}: columns equal, labels right")


def main():
    tools = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        check_las(tools, pathlib.Path(name))
        check_ply(tools, pathlib.Path(name))


if __name__ == "__main__":
    main()
