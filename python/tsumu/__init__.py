"""Tsumu looks at a pile and plans the next layer.

>>> import tsumu
>>> found = tsumu.recognise(points, tsumu.Catalog.tetrapod(2.0))    # doctest: +SKIP
>>> found.poses.shape, found.labels.shape                           # doctest: +SKIP
((62, 4, 4), (101558,))

Coordinates are metres: x east, y north, z up. Arrays that come out are read-only views. Long calls let other Python threads work,
stop at Ctrl-C, and tell `progress`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from . import _tsumu
from .arrays import points as _checked, xyz as _xyz
from .bins import Bin, BinLook, Grasp
from .catalog import BlockType, Catalog
from .errors import BadInput, Failed, Stopped, TryAgain, TsumuError, TsumuWarning
from .planning import Plan
from .progress import Progress
from .recognition import Block, Recognition, Segments
from .runs import Comparison, Run, compare, evaluate, run
from .site import Site, section
from .synthetic import SyntheticScene, synth, synth_dataset

__version__: str = _tsumu.version()

__all__ = [
    "BadInput", "Bin", "BinLook", "Block", "BlockType", "Catalog", "Comparison", "Failed", "Grasp", "Plan", "Progress", "Recognition", "Run", "Segments",
    "Site", "Stopped", "SyntheticScene", "TryAgain", "TsumuError", "TsumuWarning", "compare", "evaluate", "pdal_filter", "plan", "points_of",
    "recognise", "run", "section", "segment", "synth", "synth_dataset",
]  # fmt: skip


def recognise(
    points: Any,
    catalog: Catalog | str | os.PathLike[str],
    sensor: str = "uav",
    *,
    normals: Any = None,
    lines: Any = None,
    sensor_positions: Any = None,
    weights: str | os.PathLike[str] | None = None,
    settings: Mapping[str, Any] | str | os.PathLike[str] | None = None,
    crs: str = "",
    progress: Progress | bool | None = None,
    threads: int | None = None,
    **of_site: Any,
) -> Recognition:
    """Finds every block in a cloud: which points, which pose, which type.

    `points`: (N, 3) metres; or a laspy, Open3D, PDAL or pandas object. `sensor`: "uav", "mbes" or "depth-camera". `normals`:
    (N, 3) unit vectors, `lines`: (N,) survey lines, `sensor_positions`: (K, 3) metres, all optional. `threads` does not change the
    result. More arguments are those of `Site.of_points`. Raises `BadInput` that names the argument.
    """
    site = Site.of_points(
        points, catalog, sensor=sensor, normals=normals, lines=lines, sensor_positions=sensor_positions,
        settings=settings, crs=crs, threads=threads, **of_site,
    )  # fmt: skip
    return site.recognise(weights=weights, progress=progress, threads=threads)


def segment(
    points: Any,
    catalog: Catalog | str | os.PathLike[str],
    sensor: str = "uav",
    *,
    weights: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
    **of_site: Any,
) -> Segments:
    """The segmentation network alone: instance of each point and places of centres. Arguments as of `recognise`."""
    site = Site.of_points(points, catalog, sensor=sensor, threads=threads, **of_site)
    return site.segment(weights=weights, progress=progress, threads=threads)


def plan(
    recognition: Recognition,
    *,
    placement_weights: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
) -> Plan:
    """Plans the blocks to add to a recognised pile whose site has a design."""
    if not isinstance(recognition, Recognition):
        raise BadInput(f"recognition: is a {type(recognition).__name__}, what tsumu.recognise gave is needed")
    return recognition.site.plan(recognition, placement_weights=placement_weights, progress=progress, threads=threads)


def points_of(cloud: Any) -> Any:
    """The points of a laspy file, an Open3D cloud, a PDAL array or a table as (N, 3) float64 metres. Raises `BadInput`."""
    return _checked(_xyz(cloud))


def pdal_filter(ins: dict[str, Any], outs: dict[str, Any], catalog: Catalog, sensor: str = "uav", **more: Any) -> bool:
    """The body of a PDAL `filters.python` function: adds `BlockId` (uint32, 0 = none) and `BlockConfidence` (float32).

    `ins`, `outs`: what PDAL hands over. Give the stage `"add_dimension": ["BlockId=uint32", "BlockConfidence=float"]`.
    """
    found = recognise(ins, catalog, sensor, **more)
    outs["BlockId"], outs["BlockConfidence"] = found.labels, found.label_confidence
    return True
