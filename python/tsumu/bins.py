"""Bins: weights and types stay ready; one cloud in, parts out in the order in which to take them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import view
from .catalog import Catalog, catalog_of
from .progress import Progress, asked, threads_of
from .site import Settings, columns_of, given_of, text_of


@dataclass(frozen=True, eq=False)
class Grasp:
    """A part that may be taken."""

    #: Number of the part in its look.
    id: int
    #: Name of its type.
    type: str
    #: Whether the type is told from the others, or is only the likeliest.
    type_judged: bool
    #: (4, 4) cloud_from_part, metres: a point of the part's mesh to the cloud's coordinates.
    pose: npt.NDArray[np.float64]
    #: (4,) x, y, z, w of the pose.
    quaternion: npt.NDArray[np.float64]
    #: (3,) centre of mass, metres.
    centre: npt.NDArray[np.float64]
    #: Probability that type and pose are right, in [0, 1].
    confidence: float
    #: 1 − visible surface / whole surface.
    occlusion: float
    #: Share of its surface towards the sensor with no other part over it, in [0, 1].
    free: float


@dataclass(frozen=True, eq=False)
class BinLook:
    """What was seen in one cloud. Iterates over the parts, that to take first at the front."""

    #: The stated parts, by free share × confidence, then by height.
    grasps: list[Grasp]
    #: Places of too little evidence.
    not_judged: int
    #: (G, 4, 4) cloud_from_part of `grasps`, metres.
    poses: npt.NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.grasps)

    def __iter__(self) -> Iterator[Grasp]:
        return iter(self.grasps)


class Bin:
    """A bin that is looked at again and again.

    >>> with Bin(Catalog.shape("bracket", 0.091)) as bin:       # doctest: +SKIP
    ...     look = bin.look(points, sensor_positions=[0, 0, 0.8])
    ...     first = look.grasps[0].pose
    """

    def __init__(
        self,
        catalog: Catalog | str | os.PathLike[str],
        *,
        sensor: str = "depth-camera",
        weights: str | os.PathLike[str] | None = None,
        settings: Settings | str | os.PathLike[str] | None = None,
        threads: int | None = None,
    ) -> None:
        """Reads weights and makes the types ready: seconds, once. Raises `BadInput`."""
        #: The types that may lie in it.
        self.catalog = catalog_of(catalog)
        self._sensor = sensor
        given = given_of(settings, None)
        self._inner = _tsumu.Bin.start(self.catalog._inner, given, text_of(weights), threads_of(threads))

    def look(
        self, points: Any, *, sensor_positions: Any = None, normals: Any = None, progress: Progress | bool | None = None
    ) -> BinLook:
        """The parts in a cloud.

        `points`: (N, 3) metres, z up. `sensor_positions`: (3,) or (K, 3) metres; None: straight above. Raises `BadInput` that names
        the argument; the bin stays usable after any exception.
        """
        columns = columns_of(
            points, self._sensor, normals, None, sensor_positions,
            crs="", vertical_datum="", name="", design=None, ground=None,
        )  # fmt: skip
        with asked(progress, None) as how:
            return self._look(self._inner.look(columns, how))

    def _look(self, found: dict[str, Any]) -> BinLook:
        shapes: dict[str, tuple[str, tuple[int, ...]]] = {
            "id": ("<u4", ()),
            "type": ("<u2", ()),
            "type_judged": ("<u1", ()),
            "pose": ("<f8", (4, 4)),
            "quaternion": ("<f8", (4,)),
            "centre": ("<f8", (3,)),
            "confidence": ("<f4", ()),
            "occlusion": ("<f4", ()),
            "free": ("<f4", ()),
        }
        c = {name: view(found[name], dtype, *shape) for name, (dtype, shape) in shapes.items()}
        grasps = [
            Grasp(
                id=int(c["id"][row]),
                type=self.catalog.types[c["type"][row]].name,
                type_judged=bool(c["type_judged"][row]),
                pose=c["pose"][row],
                quaternion=c["quaternion"][row],
                centre=c["centre"][row],
                confidence=float(c["confidence"][row]),
                occlusion=float(c["occlusion"][row]),
                free=float(c["free"][row]),
            )
            for row in range(len(c["id"]))
        ]
        return BinLook(grasps, int(found["not_judged"]), c["pose"])

    def close(self) -> None:
        """Lets weights and types go; `look` refuses from then on."""
        self._inner.close()

    def __enter__(self) -> Bin:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()
