"""Block shapes from published proportions: convex parts, one closed surface, the rotations that change nothing.

Block coordinates are those Tsumu documents for its built-in kinds (catalogue `shape = { kind, size }`), centre of mass at the
origin; `hook` is a mesh of its own, with a catalogue entry that names an STL file.
"""

from dataclasses import dataclass, field
from itertools import product

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

OCTAGON = 0.8284271


@dataclass
class Shape:
    """A block: its convex parts' corners (m), surface, proper rotations (quaternions x y z w)."""

    name: str
    parts: list
    surface: trimesh.Trimesh
    group: Rotation
    entry: str
    legs: list = field(default_factory=list)

    @property
    def d_box(self):
        return float(self.surface.extents.max())

    @property
    def d_max(self):
        return float(np.linalg.norm(self.surface.vertices, axis=1).max())


def union(parts):
    """One closed surface of the parts."""
    hulls = [trimesh.convex.convex_hull(np.asarray(p)) for p in parts]
    return hulls[0] if len(hulls) == 1 else trimesh.boolean.union(hulls, engine="manifold")


def closure(generators):
    """The group of rotations that the generators make."""
    found = [Rotation.identity()]
    new = True
    while new:
        new = False
        for a, g in product(list(found), generators):
            c = a * g
            if all((c * f.inv()).magnitude() > 1e-3 for f in found):
                found.append(c)
                new = True
    return Rotation.from_quat([f.as_quat() for f in found])


def tetrapod_axes():
    z, r = -1 / 3, np.sqrt(8 / 9)
    turn = [k * 2 * np.pi / 3 for k in range(3)]
    return np.array([[0, 0, 1]] + [[r * np.cos(a), r * np.sin(a), z] for a in turn])


def tetrapod(h, cut_leg=None, leg_scale=1.0):
    """Shore Protection Manual: tip radius .151 h, root radius .235 h at .167 h, tip at .644 h from the centre."""
    parts = []
    for k, a in enumerate(tetrapod_axes()):
        u = np.cross(a, [0.31, 0.87, 0.11])
        u /= np.linalg.norm(u)
        v = np.cross(a, u)
        tip = (0.27 if k == cut_leg else 0.644) * h
        slope = (0.151 - 0.235) / (0.644 - 0.167)
        radius = lambda t: (0.235 + (t / h - 0.167) * slope) * h * leg_scale
        angles = np.arange(32) * 2 * np.pi / 32
        ring = lambda t: a * t + (np.outer(np.cos(angles), u) + np.outer(np.sin(angles), v)) * radius(t)
        # At .088 h three neighbouring cones meet in one point; below it the part narrows to the centre.
        parts.append(np.vstack([[0.0 * a], ring(0.088 * h), ring(tip)]))
    group = closure([Rotation.from_rotvec(a * 2 * np.pi / 3) for a in tetrapod_axes()[:2]])
    return Shape("tetrapod", parts, union(parts), group, f'shape = {{ kind = "tetrapod", size = {h} }}', list(tetrapod_axes()))


def octagon(centre, u, v, width):
    h, c = width / 2, width / 2 * (np.sqrt(2) - 1)
    corners = [(h, -c), (h, c), (c, h), (-c, h), (-h, c), (-h, -c), (-c, -h), (c, -h)]
    return [np.asarray(centre) + a * np.asarray(u) + b * np.asarray(v) for a, b in corners]


def dolos(c):
    """Fluke length C, waist .32 C, tips .178 C (volume .16 C³)."""
    waist, tip = 0.32, 0.178
    x, y, z = np.eye(3)
    at = 0.5 - waist / 2
    shank = octagon(-x * at, y, z, waist) + octagon(x * at, y, z, waist)
    section = [(-0.5, tip), (-waist / 2, waist), (waist / 2, waist), (0.5, tip)]
    fluke = lambda centre, along, across: [p for t, w in section for p in octagon(centre + along * t, x, across, w)]
    parts = [np.array(p) * c for p in (shank, fluke(-x * at, z, y), fluke(x * at, y, z))]
    group = closure([Rotation.from_rotvec(x * np.pi), Rotation.from_rotvec((y + z) / np.sqrt(2) * np.pi)])
    return Shape("dolos", parts, union(parts), group, f'shape = {{ kind = "dolos", size = {c} }}')


def cube(edge):
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * edge
    group = closure([Rotation.from_rotvec(v * np.pi / 2) for v in np.eye(3)])
    return Shape("cube", [corners], union([corners]), group, f'shape = {{ kind = "cube", size = {edge} }}')


def hook(size, mirrored=False):
    """A chiral unit of three unequal arms on a body: no symmetry at all, so that mirrored ones differ everywhere."""

    def box(low, high):
        return np.array(list(product(*zip(low, high)))) * size

    parts = [
        box((-0.22, -0.2, -0.2), (0.22, 0.2, 0.2)),
        box((0.1, -0.16, -0.16), (0.62, 0.14, 0.14)),
        box((-0.15, 0.1, -0.12), (0.13, 0.5, 0.16)),
        box((-0.17, -0.13, 0.1), (0.1, 0.17, 0.42)),
        box((0.38, -0.14, 0.1), (0.6, 0.12, 0.36)),
    ]
    if mirrored:
        parts = [p * [1, -1, 1] for p in parts]
    surface = union(parts)
    centre = surface.center_mass
    surface.apply_translation(-centre)
    parts = [p - centre for p in parts]
    return Shape("hook", parts, surface, Rotation.from_quat([[0, 0, 0, 1]]), 'mesh = "hook.stl"\nunit = "m"')


def by_name(name, size=None):
    """A shape by its name at its usual size, or another."""
    usual = {"tetrapod": 2.0, "dolos": 2.2, "cube": 1.6, "hook": 1.8}
    make = {"tetrapod": tetrapod, "dolos": dolos, "cube": cube, "hook": hook}
    return make[name](size or usual[name])
