"""Results as other libraries' objects. Each is imported when it is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import BadInput

if TYPE_CHECKING:
    from .recognition import Recognition


def needed(name: str, package: str | None = None) -> Any:
    """A module that may not be there, and the package it comes with. Raises `BadInput` that says how to get it."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise BadInput(f"{package or name} is not installed: pip install {package or name}") from error


def columns_of(found: Recognition) -> dict[str, Any]:
    """The stated blocks as columns, named as in blocks.csv: positions in site coordinates, metres."""
    poses, turns = found.poses, found._of_stated("quaternion")
    sd = np.sqrt(np.diagonal(found.covariances, axis1=1, axis2=2)).astype("f8")
    columns = {"block_id": found.ids, "model": found.type_names}
    columns |= {name: poses[:, axis, 3] for axis, name in enumerate(("x_m", "y_m", "z_m"))}
    columns |= {name: turns[:, axis] for name, axis in (("qw", 3), ("qx", 0), ("qy", 1), ("qz", 2))}
    for name in ("occlusion", "confidence", "fitness_m"):
        columns[name] = found._of_stated(name)
    columns["type_judged"] = found._of_stated("type_judged").astype(bool)
    columns["points"] = found._of_stated("points")
    columns |= {f"centre_{axis}_m": found.centres[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"sd_{axis}_m": sd[:, i] for i, axis in enumerate("xyz")}
    return columns


def pandas_of(found: Recognition) -> Any:
    """A DataFrame with a row a stated block."""
    return needed("pandas").DataFrame(columns_of(found))


def geopandas_of(found: Recognition) -> Any:
    """A GeoDataFrame of centres."""
    geopandas = needed("geopandas")
    east, north, up = found.centres.T
    places = geopandas.points_from_xy(east, north, up)
    return geopandas.GeoDataFrame(columns_of(found), geometry=places, crs=found.site.crs or None)


def open3d_of(found: Recognition) -> Any:
    """A list of triangle meshes in site coordinates."""
    open3d = needed("open3d")
    meshes = []
    for block in found:
        corners, triangles = found.site.catalog.surface(str(block.type))
        placed = corners @ block.pose[:3, :3].T + block.pose[:3, 3]
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(placed), open3d.utility.Vector3iVector(triangles.astype("i4"))
        )
        mesh.compute_vertex_normals()
        meshes.append(mesh)
    return meshes
