"""A site: a folder with surveys, catalogue and design, or a cloud in memory."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import array, finite, points as checked_points, view
from .catalog import Catalog, catalog_of
from .errors import BadInput
from .planning import Plan
from .progress import Progress, asked
from .recognition import Recognition, Segments

SENSORS = ("uav", "mbes", "depth-camera")
#: Settings as tables (`{"plan": {"rounds": 3}}`), or the path of a TOML file such as a run's config.toml.
Settings = Mapping[str, Any]


def given_of(settings: Settings | str | os.PathLike[str] | None, seed: int | None) -> _tsumu._Given:
    """Settings and seed as the library takes them. Raises `BadInput`."""
    tables, file = None, None
    if isinstance(settings, (str, os.PathLike)):
        file = os.fspath(settings)
    elif isinstance(settings, Mapping):
        tables = json.dumps(settings)
    elif settings is not None:
        raise BadInput(f"settings: is a {type(settings).__name__}; give a dict of tables, or the path of a TOML file")
    if seed is not None and (isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**64):
        raise BadInput(f"seed: is {seed!r}, a whole number from 0 is needed")
    return {"tables": tables, "file": file, "seed": None if seed is None else int(seed)}


def text_of(path: str | os.PathLike[str] | None) -> str | None:
    """A path as text."""
    return None if path is None else os.fspath(path)


def columns_of(
    points: Any,
    sensor: str,
    normals: Any,
    lines: Any,
    sensor_positions: Any,
    *,
    crs: str,
    vertical_datum: str,
    name: str,
    design: Mapping[str, Any] | None,
    ground: Mapping[str, Any] | float | None,
) -> _tsumu._Columns:
    """What a caller gives, checked, as the library takes it. Raises `BadInput` that names the argument."""
    cloud = checked_points(points)
    if sensor not in SENSORS:
        raise BadInput(f"sensor: is {sensor!r}, one of {', '.join(SENSORS)} is needed")
    columns: dict[str, bytes | None] = {"normals": None, "lines": None, "sensor_positions": None}
    if normals is not None:
        columns["normals"] = finite("normals", of_length("normals", array("normals", normals, "<f4", 3), cloud)).tobytes()
    if lines is not None:
        columns["lines"] = of_length("lines", array("lines", lines, "<u2", None), cloud).tobytes()
    if sensor_positions is not None:
        places = np.atleast_2d(np.asarray(sensor_positions))
        columns["sensor_positions"] = finite("sensor_positions", array("sensor_positions", places, "<f8", 3)).tobytes()
    if isinstance(ground, (int, float)):
        ground = {"level_m": float(ground)}
    return {
        "points": cloud.tobytes(),
        "normals": columns["normals"],
        "lines": columns["lines"],
        "sensor_positions": columns["sensor_positions"],
        "sensor": sensor,
        "crs": crs,
        "vertical_datum": vertical_datum,
        "name": name,
        "design": None if design is None else json.dumps(dict(design)),
        "ground": None if ground is None else json.dumps(dict(ground)),
    }


def of_length(name: str, column: npt.NDArray[Any], cloud: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The column. Raises `BadInput` where it is not one entry a point."""
    if len(column) != len(cloud):
        raise BadInput(f"{name}: has {len(column)} rows, points has {len(cloud)}; give one a point")
    return column


class Site:
    """What there is to recognise and to plan on.

    >>> site = Site.load("examples/breakwater")                     # doctest: +SKIP
    >>> site = Site.of_points(xyz, Catalog.tetrapod(2.0))           # doctest: +SKIP
    >>> plan = site.plan(site.recognise())                          # doctest: +SKIP
    """

    def __init__(self, inner: _tsumu.Site) -> None:
        self._inner = inner
        self.catalog = Catalog(inner.catalog())

    @classmethod
    def load(
        cls,
        folder: str | os.PathLike[str],
        *,
        settings: Settings | str | os.PathLike[str] | None = None,
        seed: int | None = None,
        progress: Progress | bool | None = None,
        threads: int | None = None,
    ) -> Site:
        """Reads a folder with `site.toml`; `settings` count before the site's own.

        Raises `BadInput` with everything that is wrong, one complaint a line, each with file, key or line.
        """
        with asked(progress, threads) as how:
            return cls(_tsumu.Site.load(os.fspath(folder), given_of(settings, seed), how))

    @classmethod
    def of_points(
        cls,
        points: Any,
        catalog: Catalog | str | os.PathLike[str],
        *,
        sensor: str = "uav",
        normals: Any = None,
        lines: Any = None,
        sensor_positions: Any = None,
        design: Mapping[str, Any] | None = None,
        ground: Mapping[str, Any] | float | None = None,
        crs: str = "",
        vertical_datum: str = "",
        name: str = "",
        settings: Settings | str | os.PathLike[str] | None = None,
        seed: int | None = None,
        threads: int | None = None,
    ) -> Site:
        """A cloud in memory.

        `points`: (N, 3) metres, east, north, up, in site coordinates; or anything with `.xyz` (laspy), `.points` (Open3D),
        fields X Y Z (PDAL) or columns x y z. `normals`: (N, 3) unit vectors; None: they are estimated. `lines`: (N,) survey
        line of each point from 1, 0 = unknown. `sensor_positions`: (K, 3) metres; None: straight above. `design`: the table
        `[design]` of a site.toml as a dict (see `section`). `ground`: level of the bed, metres, or the table `[ground]`.
        Raises `BadInput` that names the argument.
        """
        columns = columns_of(
            points, sensor, normals, lines, sensor_positions,
            crs=crs, vertical_datum=vertical_datum, name=name, design=design, ground=ground,
        )  # fmt: skip
        with asked(None, threads) as how:
            return cls(_tsumu.Site.of_arrays(columns, catalog_of(catalog)._inner, given_of(settings, seed), how))

    def recognise(
        self,
        *,
        weights: str | os.PathLike[str] | None = None,
        progress: Progress | bool | None = None,
        threads: int | None = None,
    ) -> Recognition:
        """Finds the blocks: which points, which pose, which type. `weights`: a file, a training's folder, or shipped weights
        by name (`tetrapod`, `bin-parts`, `any-shape`, `fpcc`); None: those that suit the catalogue."""
        with asked(progress, threads) as how:
            return Recognition(self._inner.recognise(text_of(weights), how), self)

    def segment(
        self,
        *,
        weights: str | os.PathLike[str] | None = None,
        progress: Progress | bool | None = None,
        threads: int | None = None,
    ) -> Segments:
        """The network alone: which point belongs to which instance, and where centres may be."""
        with asked(progress, threads) as how:
            return Segments(self._inner.segment(text_of(weights), how))

    def plan(
        self,
        recognition: Recognition,
        *,
        placement_weights: str | os.PathLike[str] | None = None,
        progress: Progress | bool | None = None,
        threads: int | None = None,
    ) -> Plan:
        """Plans the blocks to add. Raises `BadInput` for a site without a design."""
        if not isinstance(recognition, Recognition):
            raise BadInput(f"recognition: is a {type(recognition).__name__}, what site.recognise() gave is needed")
        with asked(progress, threads) as how:
            return Plan(self._inner.plan(recognition._inner, text_of(placement_weights), how), self)

    @property
    def points(self) -> npt.NDArray[np.float64]:
        """The points (N, 3), metres, in site coordinates; made anew at each call, for inside they are float32 about `origin`."""
        return view(self._inner.points(), "<f8", 3)

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of all stages, as a run's config.toml has them."""
        found: dict[str, Any] = json.loads(self._inner.config())
        return found

    @property
    def folder(self) -> Path | None:
        """The site folder; None for a cloud in memory."""
        return None if self._inner.folder is None else Path(self._inner.folder)

    @property
    def name(self) -> str:
        """Name for reports."""
        return self._inner.name

    @property
    def crs(self) -> str:
        """`EPSG:n`, or empty."""
        return self._inner.crs

    @property
    def origin(self) -> tuple[float, float, float]:
        """Site coordinates of the local origin, metres."""
        east, north, up = self._inner.origin
        return (east, north, up)

    @property
    def seed(self) -> int:
        """Root of all random choices."""
        return self._inner.seed

    @property
    def has_design(self) -> bool:
        """Whether there is something to plan."""
        return self._inner.has_design

    def __len__(self) -> int:
        return self._inner.len()

    def __repr__(self) -> str:
        return f"Site({self.name!r}, {len(self)} points, {self.crs or 'no CRS'}, {self.catalog!r})"


def section(
    alignment: Any,
    *,
    crest_level: float,
    crest_width: float,
    left_slope: float,
    right_slope: float,
    toe_level: float,
) -> dict[str, Any]:
    """A design for `Site.of_points`: a cross-section swept along an alignment.

    `alignment`: (K, 2) points of the crest's centre line, site coordinates. Levels and width in metres; slopes are 1 vertical to
    so many horizontal.
    """
    line = finite("alignment", array("alignment", alignment, "<f8", 2))
    return {
        "kind": "section",
        "alignment": line.tolist(),
        "crest_level_m": float(crest_level),
        "crest_width_m": float(crest_width),
        "left_slope_m": float(left_slope),
        "right_slope_m": float(right_slope),
        "toe_level_m": float(toe_level),
    }
