"""Recognised blocks and labels, as numpy views."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import view

if TYPE_CHECKING:
    from .site import Site

_NO_TYPE = 0xFFFF


@dataclass(frozen=True, eq=False)
class Block:
    """One block, or one place that may be one (`judged` is False)."""

    #: Number, from 1; that of `labels`.
    id: int
    #: Name of the type in the catalogue; None for a place of no type.
    type: str | None
    #: Whether pose and type are stated, so that the block counts.
    judged: bool
    #: Whether the type is told from the others, or is only the likeliest.
    type_judged: bool
    #: (4, 4) site_from_block, metres.
    pose: npt.NDArray[np.float64]
    #: (3,) centre of mass, site coordinates, metres.
    centre: npt.NDArray[np.float64]
    #: (4,) x, y, z, w of the pose.
    quaternion: npt.NDArray[np.float64]
    #: (6, 6) of (tx, ty, tz, rx, ry, rz), m and rad.
    covariance: npt.NDArray[np.float32]
    #: Probability that what is stated is right, in [0, 1]; NaN: not known.
    confidence: float
    #: 1 − visible surface / whole surface.
    occlusion: float
    #: Mean nearest distance from its points to the model, metres.
    fitness_m: float
    #: Indices of its points, ascending.
    points: npt.NDArray[np.uint32]

    @property
    def position(self) -> npt.NDArray[np.float64]:
        """(3,) where the block's own origin lies, site coordinates, metres."""
        return self.pose[:3, 3]


class Recognition:
    """The blocks of a survey. Iterates over the stated ones; `not_judged` has the others.

    All arrays are read-only views of one buffer each.
    """

    def __init__(self, inner: _tsumu.Recognition, site: Site) -> None:
        self._inner = inner
        #: What it was found in.
        self.site = site

    @cached_property
    def labels(self) -> npt.NDArray[np.uint32]:
        """(N,) block of each point, in the order of the points given; 0 = none."""
        return view(self._inner.labels(), "<u4")

    @cached_property
    def label_confidence(self) -> npt.NDArray[np.float32]:
        """(N,) confidence of each point's block, in [0, 1]; 0 = none."""
        return view(self._inner.label_confidence(), "<f4")

    @cached_property
    def instances(self) -> npt.NDArray[np.uint32]:
        """(N,) what the network alone said, before any pose; 0 = none. Numbers are not those of `labels`."""
        return view(self._inner.instances()[0], "<u4")

    @cached_property
    def _columns(self) -> dict[str, npt.NDArray[Any]]:
        shapes: dict[str, tuple[str, tuple[int, ...]]] = {
            "id": ("<u4", ()),
            "type": ("<u2", ()),
            "stated": ("<u1", ()),
            "type_judged": ("<u1", ()),
            "pose": ("<f8", (4, 4)),
            "quaternion": ("<f8", (4,)),
            "centre": ("<f8", (3,)),
            "confidence": ("<f4", ()),
            "occlusion": ("<f4", ()),
            "fitness_m": ("<f4", ()),
            "covariance": ("<f4", (6, 6)),
            "points": ("<u4", ()),
        }
        found = self._inner.blocks()
        return {name: view(found[name], dtype, *shape) for name, (dtype, shape) in shapes.items()}

    @cached_property
    def _stated(self) -> npt.NDArray[np.bool_]:
        return self._columns["stated"].astype(bool)

    def _of_stated(self, name: str) -> npt.NDArray[Any]:
        column = self._columns[name]
        return column if self._stated.all() else column[self._stated]

    @property
    def ids(self) -> npt.NDArray[np.uint32]:
        """(B,) numbers of the stated blocks, those of `labels`."""
        return self._of_stated("id")

    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """(B, 4, 4) site_from_block of the stated blocks, metres: a point of the block's mesh to site coordinates."""
        return self._of_stated("pose")

    @property
    def centres(self) -> npt.NDArray[np.float64]:
        """(B, 3) centres of mass of the stated blocks, site coordinates, metres."""
        return self._of_stated("centre")

    @property
    def confidences(self) -> npt.NDArray[np.float32]:
        """(B,) probability that each stated block is right, in [0, 1]."""
        return self._of_stated("confidence")

    @property
    def covariances(self) -> npt.NDArray[np.float32]:
        """(B, 6, 6) of (tx, ty, tz, rx, ry, rz), m and rad: shift of the centre along the site's axes, small turn about them."""
        return self._of_stated("covariance")

    @property
    def type_names(self) -> list[str]:
        """Names of the stated blocks' types."""
        names = [t.name for t in self.site.catalog]
        return [names[i] for i in self._of_stated("type")]

    @cached_property
    def blocks(self) -> list[Block]:
        """The stated blocks, in the order of their numbers."""
        return [self._block(int(row)) for row in np.flatnonzero(self._stated)]

    @cached_property
    def not_judged(self) -> list[Block]:
        """Places of too little evidence: reported, never counted."""
        return [self._block(int(row)) for row in np.flatnonzero(~self._stated)]

    def _block(self, row: int) -> Block:
        c = self._columns
        kind = int(c["type"][row])
        return Block(
            id=int(c["id"][row]),
            type=None if kind == _NO_TYPE else self.site.catalog.types[kind].name,
            judged=bool(c["stated"][row]),
            type_judged=bool(c["type_judged"][row]),
            pose=c["pose"][row],
            centre=c["centre"][row],
            quaternion=c["quaternion"][row],
            covariance=c["covariance"][row],
            confidence=float(c["confidence"][row]),
            occlusion=float(c["occlusion"][row]),
            fitness_m=float(c["fitness_m"][row]),
            points=view(self._inner.points_of(row), "<u4"),
        )

    @property
    def summary(self) -> dict[str, Any]:
        """The figures, as `recognise/summary.json` has them."""
        found: dict[str, Any] = json.loads(self._inner.summary())
        return found

    @property
    def weights(self) -> str:
        """Which weights were used."""
        return self._inner.weights

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Leaves what `tsumu recognise` leaves: blocks.csv, covariance.csv, clouds, summary, picture, manifest."""
        self._inner.save(os.fspath(folder))

    def to_pandas(self) -> Any:
        """A DataFrame with a row a stated block. Needs pandas."""
        from .frames import pandas_of

        return pandas_of(self)

    def to_geopandas(self) -> Any:
        """A GeoDataFrame of centres, with the site's CRS. Needs geopandas."""
        from .frames import geopandas_of

        return geopandas_of(self)

    def to_open3d(self) -> Any:
        """A list of Open3D triangle meshes, one a stated block, in site coordinates. Needs open3d."""
        from .frames import open3d_of

        return open3d_of(self)

    def __len__(self) -> int:
        return int(self._stated.sum())

    def __iter__(self) -> Iterator[Block]:
        return iter(self.blocks)

    def __repr__(self) -> str:
        return f"Recognition({len(self)} blocks, {len(self.not_judged)} not judged, {len(self.site)} points)"


class Segments:
    """What the network says of the points, before any pose. Arrays are read-only views."""

    def __init__(self, inner: _tsumu.Segments) -> None:
        self._inner = inner

    @cached_property
    def labels(self) -> npt.NDArray[np.uint32]:
        """(N,) instance of each point, from 1; 0 = none."""
        return view(self._inner.labels(), "<u4")

    @cached_property
    def confidence(self) -> npt.NDArray[np.float32]:
        """(N,) confidence of each label, in [0, 1]."""
        return view(self._inner.confidence(), "<f4")

    @cached_property
    def centres(self) -> npt.NDArray[np.float64]:
        """(H, 3) places where a centre of mass may be, site coordinates, metres; about two a block. The first `len(self)` are
        those of the instances, in order."""
        return view(self._inner.centres()[0], "<f8", 3)

    @cached_property
    def scores(self) -> npt.NDArray[np.float32]:
        """(H,) confidence of each of `centres`, in (0, 1]."""
        return view(self._inner.centres()[1], "<f4")

    @property
    def weights(self) -> str:
        """Which weights were used."""
        return self._inner.weights

    def __len__(self) -> int:
        return self._inner.instances

    def __repr__(self) -> str:
        return f"Segments({len(self)} instances, {len(self.labels)} points)"
