"""Rays of Embree at the meshes of a scene: points with the number of the block each one hit."""

import numpy as np
from trimesh.ray.ray_pyembree import RayMeshIntersector


class World:
    """Meshes with a label each (0 = no block), as one thing to cast rays at."""

    def __init__(self, meshes):
        import trimesh

        self.mesh = trimesh.util.concatenate([m for m, _ in meshes])
        self.label = np.repeat([l for _, l in meshes], [len(m.faces) for m, _ in meshes])
        self.rays = RayMeshIntersector(self.mesh)

    def cast(self, origins, directions):
        """First hits: positions, labels, and cosine of incidence."""
        face = np.asarray(self.rays.intersects_first(origins, directions))
        hit = face >= 0
        face, o, d = face[hit], origins[hit], directions[hit]
        n = self.mesh.face_normals[face]
        a = self.mesh.triangles[face][:, 0]
        along = np.einsum("ij,ij->i", a - o, n) / np.einsum("ij,ij->i", d, n)
        return o + d * along[:, None], self.label[face], np.abs(np.einsum("ij,ij->i", d, n))

    def sees(self, points, normals, eyes, directions):
        """Whether each point is seen: from any of the places `eyes`, or along any of the parallel `directions`."""
        seen = np.zeros(len(points), bool)
        start = points + normals * 2e-3
        for eye in eyes:
            seen |= self.clear(start, normals, np.asarray(eye) - start)
        for d in directions:
            seen |= self.clear(start, normals, np.tile(-np.asarray(d, float), (len(points), 1)) * 100.0)
        return seen

    def clear(self, start, normals, to):
        way = to / np.linalg.norm(to, axis=1)[:, None]
        facing = np.einsum("ij,ij->i", way, normals) > 0.09
        out = np.zeros(len(start), bool)
        out[facing] = np.asarray(self.rays.intersects_first(start[facing], way[facing])) < 0
        return out


def parallel(world, direction, spacing, rng):
    """Rays along one direction on a jittered lattice of the given spacing (m)."""
    d = np.asarray(direction, float)
    d /= np.linalg.norm(d)
    u = np.cross(d, [0.2, 1.0, 0.1])
    u /= np.linalg.norm(u)
    v = np.cross(d, u)
    middle = world.mesh.bounds.mean(axis=0)
    half = np.linalg.norm(world.mesh.extents) / 2
    s = np.arange(-half, half, spacing)
    a, b = (g.ravel() + rng.uniform(-0.5, 0.5, g.size) * spacing for g in np.meshgrid(s, s))
    origins = middle - d * (half + 5) + np.outer(a, u) + np.outer(b, v)
    return world.cast(origins, np.tile(d, (len(origins), 1)))


def from_place(world, eye, step_rad, rng):
    """A scanner's rays from one place, equal steps of angle, towards all of the scene."""
    low, high = world.mesh.bounds
    eye = np.asarray(eye, float)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]) - eye
    azimuth = np.arctan2(corners[:, 1], corners[:, 0])
    reference = np.arctan2(*((low + high)[:2] / 2 - eye[:2])[::-1])
    relative = (azimuth - reference + np.pi) % (2 * np.pi) - np.pi
    elevation = np.arctan2(corners[:, 2], np.linalg.norm(corners[:, :2], axis=1))
    a, e = np.meshgrid(
        reference + np.arange(relative.min(), relative.max(), step_rad),
        np.arange(max(elevation.min(), -1.5), min(elevation.max(), 1.5), step_rad),
    )
    a, e = (g.ravel() + rng.uniform(-0.5, 0.5, g.size) * step_rad for g in (a, e))
    d = np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return world.cast(np.tile(eye, (len(d), 1)), d)


VIEWS = {
    "uav": [(0, 0, -1), (1, 0, -1), (-1, 0.1, -1), (0.1, 1, -1), (0, -1, -1)],
    "nadir": [(0, 0, -1)],
}


def scan(world, sensor, density, rng):
    """Points, labels, eyes, directions. `density` in points per m² of the middle's plan area, before thinning."""
    if sensor in VIEWS:
        views = VIEWS[sensor]
        spacing = 1 / np.sqrt(density / len(views) * 1.15)
        got = [parallel(world, d, spacing, rng) for d in views]
        eyes, directions = [], [np.asarray(d, float) / np.linalg.norm(d) for d in views]
    else:
        low, high = world.mesh.bounds
        middle = (low + high) / 2
        if sensor == "terrestrial":
            eyes = [[middle[0], low[1] - 4.0, low[2] + 6.0]]
        elif sensor == "crest":
            eyes = [[middle[0] - 3.0, high[1] + 1.0, high[2] + 2.0], [middle[0] + 3.0, high[1] + 1.0, high[2] + 2.0]]
        elif sensor == "boat":
            eyes = [[x, low[1] - 22.0, low[2] + 3.0] for x in np.linspace(middle[0] - 25, middle[0] + 25, 11)]
        else:
            raise ValueError(f"unknown sensor {sensor}")
        distance = np.mean([np.linalg.norm(middle - e) for e in eyes])
        step = 1 / (distance * np.sqrt(density / len(eyes)))
        got = [from_place(world, e, step, rng) for e in eyes]
        directions = []
    p, label, cosine = (np.concatenate([g[i] for g in got]) for i in range(3))
    keep = cosine > 0.12
    return p[keep], label[keep], eyes, directions
