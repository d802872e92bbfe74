"""Every argument that is wrong is named, with its value and what to do; nothing is repaired in silence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tsumu

CUBE = tsumu.Catalog.cube(1.0)


def cloud(n: int = 200) -> np.ndarray[Any, Any]:
    return np.random.default_rng(1).uniform(0, 3, (n, 3))


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (np.zeros((0, 3)), "points: is empty"),
        (np.zeros((5, 2)), r"points: has shape \(5, 2\)"),
        (np.zeros((5, 4)), r"points: has shape \(5, 4\)"),
        (np.zeros((3, 7)), r"give points\.T"),
        (np.zeros(9), r"points: has shape \(9,\)"),
        (np.zeros((2, 3, 1)), "points: has shape"),
        (np.zeros((5, 3), dtype=complex), "points: has dtype complex128"),
        (np.zeros((5, 3), dtype=bool), "points: has dtype bool"),
        (np.array([["a", "b", "c"]]), "points: has dtype <U1"),
        (np.array([[1, 2, None]], dtype=object), "points: has dtype object"),
        ([[1, 2, 3], [4, 5]], "points: is no array of numbers"),
        (None, "points: has dtype object"),
        ("survey.laz", "points: has dtype"),
        ({"a": [1]}, "points: has the columns a"),
        (np.zeros(4, dtype=[("i", "f8")]), "points: has the columns i"),
    ],
)
def test_points_that_are_none(points: Any, said: str) -> None:
    with pytest.raises(tsumu.BadInput, match=said):
        tsumu.recognise(points, CUBE)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_point_that_is_not_finite_is_named(value: float) -> None:
    points = cloud()
    points[17, 1] = value
    points[19, 0] = value
    with pytest.raises(tsumu.BadInput, match=r"points: row 17 is .*\(2 of 200 rows"):
        tsumu.recognise(points, CUBE)


def test_float32_far_from_zero_is_refused() -> None:
    far = (cloud() + [40_000.0, -98_000.0, 0.0]).astype("f4")
    with pytest.raises(tsumu.BadInput, match="float32 and reach"):
        tsumu.recognise(far, CUBE)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"sensor": "sonar"}, "sensor: is 'sonar', one of uav, mbes, depth-camera"),
        ({"normals": np.zeros((3, 3))}, "normals: has 3 rows, points has 200"),
        ({"normals": np.full((200, 3), np.nan)}, "normals: row 0 is"),
        ({"lines": np.ones(199, int)}, "lines: has 199 rows"),
        ({"lines": np.ones(200)}, "lines: has dtype float64, whole numbers"),
        ({"lines": np.full(200, 70_000)}, "lines: holds 70000"),
        ({"lines": np.full(200, -1)}, "lines: holds -1"),
        ({"sensor_positions": [[0.0, 0.0]]}, "sensor_positions: has shape"),
        ({"sensor_positions": [[0.0, 0.0, np.nan]]}, "sensor_positions: row 0"),
        ({"threads": 0}, "threads: is 0"),
        ({"threads": 1.5}, "threads: is 1.5"),
        ({"progress": 3}, "progress: is neither"),
        ({"seed": -1}, "seed: is -1"),
        ({"settings": {"plan": {"speed": 3}}}, "speed"),
        ({"settings": 3}, "settings: is a int"),
        ({"design": {"kind": "level"}}, "design: missing field"),
        ({"design": {"kind": "tower"}}, "design: unknown variant `tower`"),
        ({"weights": "nothing-here"}, "nothing-here"),
    ],
)
def test_other_arguments(more: dict[str, Any], said: str) -> None:
    with pytest.raises(tsumu.BadInput, match=said):
        tsumu.recognise(cloud(), CUBE, **more)


def test_catalogues_that_are_none() -> None:
    with pytest.raises(tsumu.BadInput, match="catalog: is a int"):
        tsumu.recognise(cloud(), 3)  # type: ignore[arg-type]
    with pytest.raises(tsumu.BadInput, match="missing.toml"):
        tsumu.recognise(cloud(), "missing.toml")
    with pytest.raises(tsumu.BadInput, match="both have a type `cube 1 m`"):
        CUBE + tsumu.Catalog.cube(1.0)
    with pytest.raises(tsumu.BadInput, match="unknown variant `pyramid`, expected one of `tetrapod`"):
        tsumu.Catalog.shape("pyramid", 1.0)
    with pytest.raises(tsumu.BadInput):
        tsumu.Catalog.cube(-1.0)
    with pytest.raises(tsumu.BadInput, match="watertight"):
        tsumu.Catalog.mesh(np.eye(3), [[0, 1, 2]], name="sheet")
    with pytest.raises(tsumu.BadInput, match="vertices: row 1"):
        tsumu.Catalog.mesh([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]], name="sheet")
    with pytest.raises(tsumu.BadInput, match="triangles: has dtype float64"):
        tsumu.Catalog.mesh(np.eye(3), [[0.0, 1.0, 2.0]], name="sheet")
    with pytest.raises(tsumu.BadInput, match="refers to vertex 9"):
        tsumu.Catalog.mesh(np.eye(3), [[0, 1, 9]], name="sheet")


def test_blocks_that_cannot_lie_there() -> None:
    with pytest.raises(tsumu.BadInput, match="cube 900 m"):
        tsumu.recognise(cloud(), tsumu.Catalog.cube(900.0))


def test_a_site_that_is_none(tmp_path: Any) -> None:
    with pytest.raises(tsumu.BadInput, match="site.toml"):
        tsumu.Site.load(tmp_path)
    with pytest.raises(tsumu.BadInput, match="neither a site folder"):
        tsumu.Run.open(tmp_path)
    with pytest.raises(tsumu.BadInput, match="epochs: is one path"):
        tsumu.compare(str(tmp_path))


def test_no_design_no_plan(site: tsumu.Site, found: tsumu.Recognition) -> None:
    memory = tsumu.Site.of_points(site.points, site.catalog, crs=site.crs)
    with pytest.raises(tsumu.BadInput, match="design"):
        memory.plan(found)
    with pytest.raises(tsumu.BadInput, match="recognition: is a str"):
        tsumu.plan("run")  # type: ignore[arg-type]


def test_the_order_in_memory_is_no_matter(site: tsumu.Site) -> None:
    """Fortran order, strides, other byte orders and lists are read right, not refused."""
    points = site.points
    plain = tsumu.Site.of_points(points, site.catalog).points
    wide = np.zeros((len(points), 6))
    wide[:, ::2] = points
    for other in (
        np.asfortranarray(points),
        wide[:, ::2],
        points[::-1][::-1],
        points.astype(">f8"),
        {"X": points[:, 0], "Y": points[:, 1], "Z": points[:, 2]},
        np.rec.fromarrays(points.T, names="X,Y,Z"),
    ):
        assert np.array_equal(tsumu.Site.of_points(other, site.catalog).points, plain)
    rounded = np.round(points - points.min(axis=0))
    whole = tsumu.Site.of_points(rounded.astype(int), site.catalog).points
    assert np.array_equal(whole, rounded)
