"""The examples do what they say; those that need PDAL or ROS are tried on what these would hand over."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import tsumu
from conftest import ROOT, SAMPLE

EXAMPLES = ROOT / "examples" / "python"


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_laspy(found_as_array: tsumu.Recognition, tmp_path: Path) -> None:
    laspy = pytest.importorskip("laspy")
    cloud = laspy.read(SAMPLE / "survey.laz")
    example("laspy_blocks").add_blocks(cloud, tsumu.Catalog.tetrapod(2.0))
    cloud.write(tmp_path / "labelled.laz")
    # An array has another frame than a site, so that blocks which add the same may be numbered the other way round.
    own = np.asarray(laspy.read(tmp_path / "labelled.laz")["block"])
    pairs, points = np.unique(np.stack([own, found_as_array.labels], axis=1), axis=0, return_counts=True)
    largest = {label: max(points[pairs[:, 0] == label]) for label in np.unique(own)}
    assert len(largest) == len(np.unique(found_as_array.labels)) == 63
    assert sum(largest.values()) > 0.999 * own.size


def test_pdal(site: tsumu.Site, found_as_array: tsumu.Recognition) -> None:
    """PDAL hands a dict of columns to the function and takes the new ones from another."""
    pipeline = json.loads((EXAMPLES / "pdal_blocks.json").read_text())
    stage = pipeline[1]
    assert (ROOT / stage["script"]).is_file() and (ROOT / pipeline[0]).is_file()
    east, north, up = site.points.T
    outs: dict[str, Any] = {}
    add = getattr(example(stage["module"]), stage["function"])
    assert add({"X": east, "Y": north, "Z": up}, outs) is True
    assert np.array_equal(outs["BlockId"], found_as_array.labels)
    wanted = {name.partition("=")[0]: name.partition("=")[2] for name in stage["add_dimension"]}
    assert wanted == {"BlockId": "uint32", "BlockConfidence": "float"} and set(outs) == set(wanted)
    assert outs["BlockId"].dtype == np.uint32 and outs["BlockConfidence"].dtype == np.float32


def test_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(EXAMPLES / "breakwater.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs are not kept in the repository"
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(ROOT)}})
    done = client.execute()
    said = "".join(str(output) for cell in done.cells for output in cell.get("outputs", []))
    assert "'pose_recall': 1.0" in said


def point_cloud2(points: np.ndarray[Any, Any], order: str, padding: int) -> SimpleNamespace:
    """A PointCloud2 of two rows with other fields between and padding after each row."""
    layout = np.dtype(
        {"names": ["x", "rgb", "y", "z"], "formats": [f"{order}f4", f"{order}u4", f"{order}f4", f"{order}f8"],
         "offsets": [0, 4, 8, 16], "itemsize": 28}
    )  # fmt: skip
    packed = np.zeros(len(points), dtype=layout)
    for axis, name in enumerate("xyz"):
        packed[name] = points[:, axis]
    rows = packed.reshape(2, -1).view("u1").reshape(2, -1)
    data = np.hstack([rows, np.full((2, padding), 255, "u1")])
    field = lambda name, offset, datatype: SimpleNamespace(name=name, offset=offset, datatype=datatype)  # noqa: E731
    fields = [field("x", 0, 7), field("rgb", 4, 6), field("y", 8, 7), field("z", 16, 8)]
    return SimpleNamespace(
        fields=fields, height=2, width=len(points) // 2, point_step=28, row_step=data.shape[1],
        is_bigendian=order == ">", data=data.tobytes(),
    )  # fmt: skip


@pytest.mark.parametrize("order", ["<", ">"])
def test_ros_clouds_are_read(order: str) -> None:
    node = example("ros2_bin_node")
    points = np.random.default_rng(2).uniform(-1, 1, (40, 3)).astype("f4").astype("f8")
    assert np.array_equal(node.xyz_of(point_cloud2(points, order, 5)), points)
    points[3, 2] = np.nan
    assert len(node.xyz_of(point_cloud2(points, order, 0))) == 39
    cloud = point_cloud2(points, order, 0)
    cloud.fields = cloud.fields[:2]
    with pytest.raises(tsumu.BadInput, match="no field y, z"):
        node.xyz_of(cloud)


def test_ros_messages_are_made(bin_look: tuple[tsumu.Bin, tsumu.BinLook, Any]) -> None:
    bin, look, _ = bin_look
    header = {"stamp": {"sec": 7, "nanosec": 8}, "frame_id": "bin"}
    message = example("ros2_bin_node").detections(look, bin.catalog, header)
    assert message["header"] == header and len(message["detections"]) == len(look) > 0
    for detection, grasp in zip(message["detections"], look, strict=True):
        assert set(detection) == {"header", "id", "results", "bbox"}
        (result,) = detection["results"]
        assert result["hypothesis"] == {"class_id": grasp.type, "score": grasp.confidence}
        pose = result["pose"]["pose"]
        assert np.isclose(sum(v * v for v in pose["orientation"].values()), 1.0)
        assert np.allclose(list(pose["position"].values()), grasp.pose[:3, 3])
        assert min(detection["bbox"]["size"].values()) > 0
    json.dumps(message)
