"""Arrays on their way in and out: checked and named on the way in, views of one buffer on the way out."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import BadInput

#: Beyond this distance from zero, metres, a 32-bit float steps by a millimetre and more.
FLOAT32_REACH_M = 10_000.0


def array(name: str, values: Any, dtype: str, columns: int | None) -> npt.NDArray[Any]:
    """`values` as a C-contiguous array of `dtype`; no copy is made of one that is so already.

    `columns`: the width of its rows, or None for a flat array. Raises `BadInput` that names the argument.
    """
    try:
        found = np.asarray(values)
    except (ValueError, TypeError) as error:
        raise BadInput(f"{name}: is no array of numbers ({error})") from error
    kinds = "iu" if dtype[1] == "u" else "fiu"
    if found.dtype.kind not in kinds:
        what = "whole numbers" if dtype[1] == "u" else "numbers"
        hint = "; a structured array goes through tsumu.points_of" if found.dtype.names else ""
        raise BadInput(f"{name}: has dtype {found.dtype}, {what} are needed{hint}")
    wanted = f"(N, {columns})" if columns else "(N,)"
    fits = found.ndim == 2 and found.shape[1] == columns if columns else found.ndim == 1
    if not fits:
        turned = columns and found.ndim == 2 and found.shape[0] == columns
        hint = f"; give {name}.T" if turned else ""
        raise BadInput(f"{name}: has shape {found.shape}, {wanted} is needed{hint}")
    if dtype[1] == "u":
        limits = np.iinfo(dtype)
        if found.size and (found.min() < limits.min or found.max() > limits.max):
            raise BadInput(f"{name}: holds {found.min()} to {found.max()}, {limits.min} to {limits.max} is allowed")
    return np.ascontiguousarray(found, dtype=dtype)


def finite(name: str, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The same array. Raises `BadInput` that names the first row with a NaN or an infinity."""
    good = np.isfinite(values)
    if not good.all():
        rows = good.all(axis=1) if values.ndim == 2 else good
        bad = np.flatnonzero(~rows)
        raise BadInput(
            f"{name}: row {bad[0]} is {values[bad[0]].tolist()} ({len(bad)} of {len(values)} rows are not finite); leave such rows out"
        )
    return values


def points(values: Any) -> npt.NDArray[np.float64]:
    """Points as (N, 3) float64 metres: an array, or anything `tsumu.points_of` knows. Raises `BadInput`."""
    found = array("points", xyz(values), "<f8", 3)
    if not len(found):
        raise BadInput("points: is empty; give one row of x, y, z a point")
    narrow = getattr(values, "dtype", None) == np.float32
    finite("points", found)
    if narrow and np.abs(found).max() > FLOAT32_REACH_M:
        raise BadInput(
            f"points: are float32 and reach {np.abs(found).max():.0f} m, where float32 steps by a millimetre and more; "
            "give float64, or subtract an origin before the cloud is narrowed"
        )
    return found


def xyz(values: Any) -> Any:
    """The points of a laspy file (`.xyz`), an Open3D cloud (`.points`), a PDAL or other structured array with X, Y, Z, or a
    table with columns x, y, z; anything else comes back as it is."""
    dtype = getattr(values, "dtype", None)
    if dtype is None and hasattr(values, "xyz"):
        return values.xyz
    if dtype is None and hasattr(values, "points") and hasattr(values, "has_normals"):
        return np.asarray(values.points)
    names = getattr(dtype, "names", None)
    if names is None and hasattr(values, "columns"):
        names = list(values.columns)
    if names is None and isinstance(values, dict):
        names = list(values)
    if names is None:
        return values
    for wanted in (("X", "Y", "Z"), ("x", "y", "z")):
        if all(axis in names for axis in wanted):
            return np.column_stack([np.asarray(values[axis], dtype="f8") for axis in wanted])
    raise BadInput(f"points: has the columns {', '.join(map(str, names))}; x, y, z (or X, Y, Z) are needed")


def view(buffer: bytes, dtype: str, *shape: int) -> npt.NDArray[Any]:
    """The numbers in `buffer`, where they lie: read-only, no copy. `shape`: that of a row."""
    return np.frombuffer(buffer, dtype=dtype).reshape(-1, *shape) if shape else np.frombuffer(buffer, dtype=dtype)
