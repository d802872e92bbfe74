"""Block types."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import array, finite, view
from .errors import BadInput

CONCRETE_KG_M3 = 2300.0


@dataclass(frozen=True)
class BlockType:
    """One type of block."""

    #: Name in the catalogue.
    name: str
    #: Volume, m³.
    volume_m3: float
    #: Mass, kg.
    mass_kg: float
    #: Density, kg/m³.
    density_kg_m3: float
    #: Largest edge of the box around it, metres.
    longest_edge_m: float
    #: Largest distance from the centre of mass to the surface, metres.
    reach_m: float
    #: Centre of mass in the block's own coordinates, metres.
    centre: tuple[float, float, float]
    #: Rotations that map it onto itself, the identity included.
    symmetries: int


class Catalog:
    """The block types that may lie in a pile, in order.

    >>> tetrapods = Catalog.tetrapod(2.0, name="5 t")
    >>> both = tetrapods + Catalog.cube(1.2)
    >>> [t.name for t in both]
    ['5 t', 'cube 1.2 m']
    """

    def __init__(self, inner: _tsumu.Catalog) -> None:
        self._inner = inner
        self._types = tuple(BlockType(**facts) for facts in inner.types())

    @classmethod
    def shape(cls, kind: str, size_m: float, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """A built-in shape: `tetrapod`, `dolos`, `cube`, `antifer`, `core-loc-like`, `xbloc-like`, `accropode-like`,
        `six-leg-like`, or a bin part: `eye-bolt`, `gear-shaft`, `holed-plate`, `hook-plate`, `bracket`.

        `size_m`: its height, edge or length, metres (docs/guide/block.md). Raises `BadInput`.
        """
        block = {
            "name": name or f"{kind} {size_m:g} m",
            "shape": {"kind": kind, "size": float(size_m)},
            "density_kg_m3": float(density_kg_m3),
        }
        return cls(_tsumu.catalog_of(json.dumps({"block": [block]}), [], None))

    @classmethod
    def named(cls, shape: str, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """A built-in block by its nominal name, e.g. `"tetrapod 5t"`. Raises `BadInput`."""
        block = {"name": name or shape, "shape": shape, "density_kg_m3": float(density_kg_m3)}
        return cls(_tsumu.catalog_of(json.dumps({"block": [block]}), [], None))

    @classmethod
    def tetrapod(cls, height_m: float, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """Tetrapods of this height, metres."""
        return cls.shape("tetrapod", height_m, name=name, density_kg_m3=density_kg_m3)

    @classmethod
    def dolos(cls, length_m: float, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """Dolosse of this fluke length, metres."""
        return cls.shape("dolos", length_m, name=name, density_kg_m3=density_kg_m3)

    @classmethod
    def cube(cls, edge_m: float, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """Cubes of this edge, metres."""
        return cls.shape("cube", edge_m, name=name, density_kg_m3=density_kg_m3)

    @classmethod
    def antifer(cls, height_m: float, *, name: str | None = None, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """Antifer cubes of this height, metres."""
        return cls.shape("antifer", height_m, name=name, density_kg_m3=density_kg_m3)

    @classmethod
    def mesh(cls, vertices: Any, triangles: Any, *, name: str, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """A block of one's own: a closed surface.

        `vertices`: (V, 3) metres. `triangles`: (T, 3) indices of corners, counter-clockwise seen from outside.
        Raises `BadInput` where they are no such surface.
        """
        corners = finite("vertices", array("vertices", vertices, "<f4", 3))
        faces = array("triangles", triangles, "<u4", 3)
        block = {"name": name, "mesh": "mesh", "unit": "m", "density_kg_m3": float(density_kg_m3)}
        meshes = [("mesh", corners.tobytes(), faces.tobytes())]
        return cls(_tsumu.catalog_of(json.dumps({"block": [block]}), meshes, None))

    @classmethod
    def of_files(cls, files: Mapping[str, str | os.PathLike[str]], *, unit: str, density_kg_m3: float = CONCRETE_KG_M3) -> Catalog:
        """Blocks of one's own in mesh files (STL, OBJ, PLY), by name. `unit`: of the files: "m", "cm", "mm", "in" or "ft".

        All files lie in one folder. Raises `BadInput` that names file and fault.
        """
        paths = {name: Path(file) for name, file in files.items()}
        folders = {path.parent for path in paths.values()}
        if len(folders) != 1:
            raise BadInput(f"files: lie in {len(folders)} folders, one is needed")
        blocks = [
            {"name": name, "mesh": path.name, "unit": unit, "density_kg_m3": float(density_kg_m3)}
            for name, path in paths.items()
        ]
        beside = os.fspath(folders.pop() / "catalog.toml")
        return cls(_tsumu.catalog_of(json.dumps({"block": blocks}), [], beside))

    @classmethod
    def load(cls, file: str | os.PathLike[str]) -> Catalog:
        """Reads a `catalog.toml` with the meshes beside it. Raises `BadInput` with file, key and line."""
        return cls(_tsumu.read_catalog(os.fspath(file)))

    @property
    def types(self) -> tuple[BlockType, ...]:
        """The types in order."""
        return self._types

    def surface(self, name: str) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
        """Corners (V, 3), metres, and triangles (T, 3) of a type, in the block's own coordinates. Raises `KeyError`."""
        for index, of in enumerate(self._types):
            if of.name == name:
                corners, triangles = self._inner.mesh(index)
                return view(corners, "<f4", 3), view(triangles, "<u4", 3)
        raise KeyError(name)

    def __add__(self, other: Catalog) -> Catalog:
        return Catalog(self._inner.joined(other._inner))

    def __len__(self) -> int:
        return len(self._types)

    def __iter__(self) -> Iterator[BlockType]:
        return iter(self._types)

    def __repr__(self) -> str:
        return f"Catalog({', '.join(t.name for t in self._types)})"


def catalog_of(catalog: Any) -> Catalog:
    """A catalogue, or the file of one. Raises `BadInput`."""
    if isinstance(catalog, Catalog):
        return catalog
    if isinstance(catalog, (str, os.PathLike)):
        return Catalog.load(catalog)
    raise BadInput(f"catalog: is a {type(catalog).__name__}, a tsumu.Catalog or the path of a catalog.toml is needed")
