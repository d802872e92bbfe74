"""Shapes, units and what the columns say of each other."""

from __future__ import annotations

import numpy as np
import pytest

import tsumu


def test_columns_belong_together(site: tsumu.Site, found: tsumu.Recognition) -> None:
    assert found.labels.shape == (len(site),) and found.labels.dtype == np.uint32
    assert found.label_confidence.shape == (len(site),) and found.label_confidence.dtype == np.float32
    assert found.poses.shape == (len(found), 4, 4) and found.covariances.shape == (len(found), 6, 6)
    assert set(np.unique(found.labels)) - {0} <= set(found.ids)
    assert found.summary["recognised_blocks"] == len(found) == len(found.blocks)
    assert found.type_names == ["tetrapod-5t"] * len(found)
    for block in found:
        assert np.array_equal(np.flatnonzero(found.labels == block.id), block.points)
        rotation = block.pose[:3, :3]
        assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
        x, y, z, w = block.quaternion
        assert np.isclose(rotation[0, 0], 1 - 2 * (y * y + z * z), atol=1e-5) and abs(w) <= 1
        centre = block.pose @ np.array([*site.catalog.types[0].centre, 1.0])
        assert np.allclose(centre[:3], block.centre, atol=1e-3)


def test_points_lie_on_their_blocks(site: tsumu.Site, found: tsumu.Recognition) -> None:
    reach_m = site.catalog.types[0].reach_m
    points = site.points
    for block in found:
        away = np.linalg.norm(points[block.points] - block.centre, axis=1)
        assert away.max() < 1.2 * reach_m


def test_arrays_are_views_that_cannot_be_written(found: tsumu.Recognition) -> None:
    assert not found.labels.flags.owndata and not found.labels.flags.writeable
    with pytest.raises(ValueError):
        found.labels[0] = 7
    assert found.labels is found.labels


def test_the_truth_is_found(found: tsumu.Recognition, site: tsumu.Site) -> None:
    scores = tsumu.evaluate(str(site.folder) + "/truth", found, catalog=str(site.folder) + "/catalog.toml")
    assert scores["pose_precision"] == 1.0 and scores["pose_recall"] == 1.0
    assert scores["mean_displacement_m"] < 0.02


def test_the_network_alone(site: tsumu.Site, found: tsumu.Recognition) -> None:
    segments = tsumu.segment(site.points, site.catalog, crs=site.crs)
    assert segments.labels.shape == (len(site),) and segments.labels.max() == len(segments)
    assert segments.centres.shape == (len(segments.scores), 3) and len(segments.centres) >= len(segments)
    near = np.linalg.norm(found.centres[:, None] - segments.centres[None], axis=2).min(axis=1)
    assert np.median(near) < 0.3
    other = tsumu.segment(site.points, site.catalog, crs=site.crs, weights="any-shape")
    assert "any shape" in other.weights and other.weights != segments.weights


def test_a_plan_has_its_columns(site: tsumu.Site, found: tsumu.Recognition) -> None:
    quick = tsumu.Site.load(str(site.folder), settings={"plan": {"policy": "random", "uncertainty": {"seeds": 0}}}, seed=3)
    plan = quick.plan(found)
    assert len(plan) == plan.summary["blocks"] > 0
    assert plan.rests.shape == plan.drops.shape == (len(plan), 4, 4)
    assert (plan.drops[:, 2, 3] >= plan.rests[:, 2, 3] - 1e-6).all()
    assert plan.filled_m3.shape == plan.contacts.shape == (len(plan),)


def test_a_design_in_memory_is_planned(site: tsumu.Site, found: tsumu.Recognition) -> None:
    design = tsumu.section(
        [[41243.0, -98760.0], [41257.0, -98760.0]],
        crest_level=3.4, crest_width=6.0, left_slope=1.5, right_slope=1.5, toe_level=1.0,
    )  # fmt: skip
    settings = {"plan": {"policy": "random", "uncertainty": {"seeds": 0}}}
    memory = tsumu.Site.of_points(site.points, site.catalog, crs=site.crs, design=design, settings=settings, seed=1)
    folder = tsumu.Site.load(str(site.folder), settings=settings)
    blocks = memory.recognise()
    assert np.array_equal(blocks.poses, found.poses)
    assert np.array_equal(memory.plan(blocks).rests, folder.plan(found).rests)


def test_blocks_of_another_survey_are_refused(site: tsumu.Site, found: tsumu.Recognition) -> None:
    design = {"kind": "level", "level_m": 3.0, "boundary": [[41240, -98770], [41260, -98770], [41260, -98750]]}
    fewer = tsumu.Site.of_points(site.points[:-1], site.catalog, crs=site.crs, design=design)
    with pytest.raises(tsumu.BadInput, match="another survey"):
        fewer.plan(found)
    other = tsumu.Site.of_points(site.points, tsumu.Catalog.cube(1.5), crs=site.crs, design=design)
    with pytest.raises(tsumu.BadInput, match="another catalogue"):
        other.plan(found)


def test_tables_of_others(found: tsumu.Recognition) -> None:
    pandas = pytest.importorskip("pandas")
    table = found.to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == len(found)
    assert {"block_id", "model", "x_m", "qw", "confidence", "sd_z_m"} <= set(table)


def test_what_is_not_installed_is_said(found: tsumu.Recognition, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    for name in ("pandas", "geopandas", "open3d"):
        monkeypatch.setitem(sys.modules, name, None)
    for call in (found.to_pandas, found.to_geopandas, found.to_open3d):
        with pytest.raises(tsumu.BadInput, match="pip install"):
            call()


def test_a_scene_is_made_again() -> None:
    from conftest import SAMPLE

    scene = tsumu.synth(SAMPLE / "recipe.toml", seed=5)
    again = tsumu.synth(SAMPLE / "recipe.toml", seed=5, threads=1)
    assert np.array_equal(scene.points, again.points) and np.array_equal(scene.poses, again.poses)
    assert scene.labels.shape == (len(scene.points),) and set(np.unique(scene.labels)) - {0} <= set(scene.ids)
    assert ((0 <= scene.occlusion) & (scene.occlusion <= 1)).all()
