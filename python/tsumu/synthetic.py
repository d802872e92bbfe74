"""Synthetic piles with known truth."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import view
from .catalog import Catalog
from .progress import Progress, asked
from .site import given_of, text_of


@dataclass(frozen=True, eq=False)
class SyntheticScene:
    """A pile that was dropped and scanned. Arrays are read-only views."""

    #: (N, 3) points, metres.
    points: npt.NDArray[np.float64]
    #: (N,) true block of each point; 0 = ground.
    labels: npt.NDArray[np.uint32]
    #: (N,) survey line of each point, or (0,) where the sensor has none.
    lines: npt.NDArray[np.uint16]
    #: (K, 3) where the sensor was, metres; K may be 0.
    sensor_positions: npt.NDArray[np.float64]
    #: (B,) numbers of the blocks, those of `labels`.
    ids: npt.NDArray[np.uint32]
    #: (B,) their types, as indices of the catalogue.
    types: npt.NDArray[np.uint16]
    #: (B, 4, 4) true site_from_block, metres.
    poses: npt.NDArray[np.float64]
    #: (B,) 1 − visible surface / whole surface.
    occlusion: npt.NDArray[np.float32]
    #: The block types.
    catalog: Catalog


def synth(
    recipe: str | os.PathLike[str],
    seed: int = 1,
    *,
    scene: int = 0,
    catalog: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
) -> SyntheticScene:
    """Makes one scene of a recipe: scene `scene` of the dataset of this seed, the same every time.

    `recipe`: a TOML file (docs/guide/scenes.md). Raises `BadInput` for one that gives no pile.
    """
    inner = _tsumu.read_recipe(os.fspath(recipe), text_of(catalog))
    with asked(progress, threads) as how:
        made = inner.scene(_whole(seed), scene, how)
    return SyntheticScene(
        points=view(made["points"], "<f8", 3),
        labels=view(made["labels"], "<u4"),
        lines=view(made["lines"], "<u2"),
        sensor_positions=view(made["sensor_positions"], "<f8", 3),
        ids=view(made["id"], "<u4"),
        types=view(made["type"], "<u2"),
        poses=view(made["pose"], "<f8", 4, 4),
        occlusion=view(made["occlusion"], "<f4"),
        catalog=Catalog(inner.catalog()),
    )


def synth_dataset(
    recipe: str | os.PathLike[str],
    out: str | os.PathLike[str],
    scenes: int,
    seed: int = 1,
    *,
    shard: tuple[int, int] = (0, 1),
    split: tuple[float, float, float] = (0.8, 0.1, 0.1),
    preview: bool = False,
    catalog: str | os.PathLike[str] | None = None,
    progress: Progress | bool | None = None,
    threads: int | None = None,
) -> tuple[int, int]:
    """Makes the scenes of a dataset folder that are not there yet, as `tsumu synth`. Returns scenes made, scenes that were there."""
    inner = _tsumu.read_recipe(os.fspath(recipe), text_of(catalog))
    with asked(progress, threads) as how:
        return inner.dataset(os.fspath(out), scenes, _whole(seed), shard[0], shard[1], split, preview, how)


def _whole(seed: int) -> int:
    found = given_of(None, seed)["seed"]
    return 0 if found is None else found
