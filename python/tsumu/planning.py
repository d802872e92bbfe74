"""Stacking plans."""

from __future__ import annotations

import json
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _tsumu
from .arrays import view

if TYPE_CHECKING:
    from .site import Site


class Plan:
    """Blocks to add, in placing order. `len(plan)`: how many stay. Arrays are read-only views."""

    def __init__(self, inner: _tsumu.Planned, site: Site) -> None:
        self._inner = inner
        #: What it was planned for.
        self.site = site

    @cached_property
    def _columns(self) -> dict[str, Any]:
        found = self._inner.placements()
        kept = sum(state == "kept" for state in found["state"])
        columns: dict[str, Any] = {"state": found["state"], "kept": kept}
        for name, dtype in (("order", "<u4"), ("round", "<u4"), ("type", "<u2"), ("filled_m3", "<f4"), ("contacts", "<u4")):
            columns[name] = view(found[name], dtype)
        for name in ("drop", "rest"):
            columns[name] = view(found[name], "<f8", 4, 4)
        return columns

    def _kept(self, name: str) -> npt.NDArray[Any]:
        column: npt.NDArray[Any] = self._columns[name]
        return column[: self._columns["kept"]]

    @property
    def drops(self) -> npt.NDArray[np.float64]:
        """(P, 4, 4) site_from_block at which the crane lets go, metres."""
        return self._kept("drop")

    @property
    def rests(self) -> npt.NDArray[np.float64]:
        """(P, 4, 4) site_from_block at rest, metres."""
        return self._kept("rest")

    @property
    def filled_m3(self) -> npt.NDArray[np.float32]:
        """(P,) void below the design that each fills, m³."""
        return self._kept("filled_m3")

    @property
    def contacts(self) -> npt.NDArray[np.uint32]:
        """(P,) blocks, and 1 for the ground, that each touches at rest."""
        return self._kept("contacts")

    @property
    def type_names(self) -> list[str]:
        """Names of their types."""
        names = [t.name for t in self.site.catalog]
        return [names[i] for i in self._kept("type")]

    @property
    def removed(self) -> list[str]:
        """Why each block that was tried and taken out was: overflow, unsettled, outside, unstable."""
        return list(self._columns["state"][self._columns["kept"] :])

    @property
    def summary(self) -> dict[str, Any]:
        """The figures, as `plan/summary.json` has them: count and its range, void before and after, concrete."""
        found: dict[str, Any] = json.loads(self._inner.summary())
        return found

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Leaves the whole run folder: blocks, plan, report, exports."""
        self._inner.save(os.fspath(folder))

    def to_pandas(self) -> Any:
        """A DataFrame with a row a block to add. Needs pandas."""
        from .frames import needed

        rests, drops = self.rests[:, :3, 3], self.drops[:, :3, 3]
        columns: dict[str, Any] = {"order": self._kept("order"), "round": self._kept("round"), "model": self.type_names}
        columns |= {f"drop_{axis}_m": drops[:, i] for i, axis in enumerate("xyz")}
        columns |= {f"rest_{axis}_m": rests[:, i] for i, axis in enumerate("xyz")}
        columns |= {"filled_m3": self.filled_m3, "contacts": self.contacts}
        return needed("pandas").DataFrame(columns)

    def __len__(self) -> int:
        return int(self._columns["kept"])

    def __repr__(self) -> str:
        return f"Plan({len(self)} blocks to add)"
