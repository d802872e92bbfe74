"""A bin that stays."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tsumu
from conftest import BIN_SETTINGS
from tsumu import bop

Looked = tuple[tsumu.Bin, tsumu.BinLook, tsumu.SyntheticScene]


def test_what_is_seen_lies_there(bin_look: Looked) -> None:
    _, look, scene = bin_look
    assert 1 <= len(look) <= len(scene.ids) and look.poses.shape == (len(look), 4, 4)
    for grasp in look:
        away = np.linalg.norm(scene.poses[:, :3, 3] - grasp.pose[:3, 3], axis=1)
        assert away.min() < 0.01 and 0 <= grasp.free <= 1
    worth = [grasp.free * grasp.confidence for grasp in look]
    assert worth == sorted(worth, reverse=True)


def test_a_bin_sees_what_recognise_sees(bin_look: Looked) -> None:
    _, look, scene = bin_look
    seen_from = scene.sensor_positions
    found = tsumu.recognise(scene.points, scene.catalog, "depth-camera", sensor_positions=seen_from, settings=BIN_SETTINGS)
    poses = {block.id: block.pose for block in found}
    assert {grasp.id for grasp in look} == set(poses) != set()
    assert all(np.array_equal(grasp.pose, poses[grasp.id]) for grasp in look)


def test_a_look_changes_nothing_for_the_next(bin_look: Looked) -> None:
    bin, look, scene = bin_look
    with pytest.raises(tsumu.BadInput, match="points: is empty"):
        bin.look(np.zeros((0, 3)))
    with pytest.raises(tsumu.BadInput):
        bin.look(scene.points * 1e-4)
    again = bin.look(scene.points, sensor_positions=scene.sensor_positions)
    assert np.array_equal(again.poses, look.poses)


def test_a_closed_bin_refuses() -> None:
    bin = tsumu.Bin(tsumu.Catalog.cube(0.08), threads=1)
    bin.close()
    with pytest.raises(tsumu.BadInput, match="closed"):
        bin.look(np.random.default_rng(1).uniform(0, 0.3, (100, 3)))
    with pytest.raises(tsumu.BadInput, match="nowhere"):
        tsumu.Bin(tsumu.Catalog.cube(0.08), weights="nowhere")


def test_the_command_answers_with_the_same_parts(bin_look: Looked, program: str, tmp_path: Path) -> None:
    _, look, scene = bin_look
    catalog = tmp_path / "catalog.toml"
    catalog.write_text('[[block]]\nname = "cube"\nshape = { kind = "cube", size = 0.08 }\ndensity_kg_m3 = 2700.0\n')
    config = tmp_path / "config.toml"
    config.write_text("[background]\nbin = false\n")
    request = {"points": scene.points.tolist(), "sensor_positions": scene.sensor_positions.tolist()}
    lines = [{"id": "a", **request}, {"id": "b", "cloud": "nowhere.ply"}, {"id": "c", **request}]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    words = [program, "serve-bin", "--catalog", str(catalog), "--config", str(config), "--quiet"]
    done = subprocess.run(words, input=text, capture_output=True, text=True, check=True)
    answers: list[dict[str, Any]] = [json.loads(line) for line in done.stdout.splitlines()]
    assert [answer["id"] for answer in answers] == ["a", "b", "c"]
    assert "nowhere.ply" in answers[1]["error"] and answers[1]["kind"] == "bad-input"
    for answer in (answers[0], answers[2]):
        assert [part["part"] for part in answer["parts"]] == [grasp.id for grasp in look]
        places = np.array([part["position_m"] for part in answer["parts"]])
        assert np.allclose(places, look.poses[:, :3, 3], atol=1e-9) and answer["seconds"] > 0


def test_bop_folders_in_and_results_out(bin_look: Looked, tmp_path: Path) -> None:
    """A depth image rendered from the true poses comes back as rows of the challenge's format, in its frame and unit."""
    image = pytest.importorskip("PIL.Image")
    _, _, scene = bin_look
    models = tmp_path / "models"
    models.mkdir()
    corners, triangles = scene.catalog.surface("cube")
    write_ply(models / "obj_000001.ply", corners * 1000.0, triangles)
    camera_at = scene.sensor_positions[0]
    turn = np.diag([1.0, -1.0, -1.0])
    depth = rendered(scene.points, camera_at, turn)
    folder = tmp_path / "000007"
    (folder / "depth").mkdir(parents=True)
    image.fromarray(depth).save(folder / "depth" / "000003.png")
    camera = {"3": {"cam_K": [FOCAL, 0, SIZE / 2, 0, FOCAL, SIZE / 2, 0, 0, 1], "depth_scale": 0.05}}
    (folder / "scene_camera.json").write_text(json.dumps(camera))
    out = tmp_path / "tsumu_bin-test.csv"
    assert bop.main([str(folder), "--models", str(models), "--out", str(out)]) == 0
    rows = [line.split(",") for line in out.read_text().splitlines()]
    assert tuple(rows[0]) == bop.COLUMNS and len(rows) > 1
    assert len({row[6] for row in rows[1:]}) == 1, "all rows of an image have one time"
    for row in rows[1:]:
        assert row[:3] == ["7", "3", "1"] and 0 <= float(row[3]) <= 1
        rotation = np.array(row[4].split(), float).reshape(3, 3)
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
        centre = turn @ (np.array(row[5].split(), float) / 1000.0) + camera_at
        assert np.linalg.norm(scene.poses[:, :3, 3] - centre, axis=1).min() < 0.015
    for scenes, said in (([str(tmp_path)], "by its number"), ([str(models)], "by its number")):
        with pytest.raises(SystemExit) as stop:
            bop.main([*scenes, "--models", str(models), "--out", str(out)])
        assert stop.value.code == 2, said


def test_bop_scenes_that_are_not_whole_are_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is missing or odd in a scene folder is named with its file; an image without a point has no rows."""
    image = pytest.importorskip("PIL.Image")
    models, folder, out = tmp_path / "models", tmp_path / "000002", tmp_path / "out.csv"
    models.mkdir()
    (folder / "depth").mkdir(parents=True)
    corners, triangles = tsumu.Catalog.cube(0.08, name="cube").surface("cube")
    write_ply(models / "obj_000001.ply", corners * 1000.0, triangles)
    image.fromarray(np.zeros((4, 4), np.uint16)).save(folder / "depth" / "000000.png")
    cameras = folder / "scene_camera.json"
    whole = '{"0": {"cam_K": [9, 0, 2, 0, 9, 2, 0, 0, 1], "depth_scale": 0.1}}'
    words = [str(folder), "--models", str(models), "--out"]
    for text, file, said in (
        ("[1]", out, "scene_camera.json"),
        ('{"a": {}}', out, "`a`"),
        ('{"0": {}}', out, "cam_K"),
        ('{"1": {}}', out, "000001.png"),
        ("{", out, "scene_camera.json"),
        (whole, tmp_path / "nowhere" / "out.csv", "nowhere"),
    ):
        cameras.write_text(text)
        with pytest.raises(SystemExit) as stop:
            bop.main([*words, str(file)])
        lines = capsys.readouterr().err.strip().splitlines()
        assert stop.value.code == 2 and len(lines) == 1 and said in lines[0], lines
    assert not list(tmp_path.glob("out.csv*"))
    cameras.write_text(whole)
    assert bop.main([*words, str(out)]) == 0
    assert out.read_text() == ",".join(bop.COLUMNS) + "\n"


FOCAL, SIZE = 900.0, 480


def rendered(points: np.ndarray[Any, Any], camera_at: np.ndarray[Any, Any], turn: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The cloud as a depth image in steps of 0.05 mm: the nearest point of each pixel."""
    seen = (points - camera_at) @ turn.T
    column = np.round(FOCAL * seen[:, 0] / seen[:, 2] + SIZE / 2).astype(int)
    row = np.round(FOCAL * seen[:, 1] / seen[:, 2] + SIZE / 2).astype(int)
    inside = (0 <= column) & (column < SIZE) & (0 <= row) & (row < SIZE)
    depth = np.full((SIZE, SIZE), 65535.0)
    np.minimum.at(depth, (row[inside], column[inside]), seen[inside, 2] * 1000.0 / 0.05)
    return np.where(depth < 65535, depth, 0).astype("u2")


def write_ply(file: Path, corners: np.ndarray[Any, Any], triangles: np.ndarray[Any, Any]) -> None:
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(corners)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [" ".join(f"{v:.6f}" for v in corner) for corner in corners]
    rows += ["3 " + " ".join(map(str, triangle)) for triangle in triangles]
    file.write_text(head + "\n".join(rows) + "\n")
