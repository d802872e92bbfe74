"""What blocks lie on, under, or in front of: beds, slopes, sand, walls, stones; and scenes that hold no block."""

import numpy as np
import trimesh


def grid(low, high, cell, height):
    """A surface z = height(x, y) as a mesh."""
    x, y = np.arange(low[0], high[0] + cell, cell), np.arange(low[1], high[1] + cell, cell)
    gx, gy = np.meshgrid(x, y, indexing="ij")
    z = height(gx, gy)
    n, m = gx.shape
    i = np.arange(n * m).reshape(n, m)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return trimesh.Trimesh(np.column_stack([gx.ravel(), gy.ravel(), z.ravel()]), faces, process=False)


def rough(rng, amplitude, lengths):
    """A sum of waves of the given lengths: rubble, sand ripples, hills."""
    waves = []
    for length in lengths:
        for _ in range(6):
            a = rng.uniform(0, 2 * np.pi)
            k = 2 * np.pi / (length * rng.uniform(0.7, 1.4))
            waves.append((k * np.cos(a), k * np.sin(a), rng.uniform(0, 2 * np.pi), amplitude * length / max(lengths)))
    return lambda x, y: sum(s * np.sin(kx * x + ky * y + ph) for kx, ky, ph, s in waves) / 2.4


def rubble(rng, low, high, size, slope=0.0, toe=None):
    """A bed of stones of the size: level, or rising 1 : 1/slope towards +y, from the `toe` on when one is given."""
    wave = rough(rng, size * 0.3, [size * 4, size * 1.8])

    def height(x, y):
        run = y if toe is None else np.maximum(y - toe, 0.0)
        return slope * run + wave(x, y)

    return grid(low, high, 0.25, height)


def lump(rng, size):
    """A convex stone."""
    p = rng.normal(size=(40, 3))
    p *= (rng.uniform(0.75, 1.0, (40, 1)) / np.linalg.norm(p, axis=1)[:, None])
    return p * rng.uniform(0.6, 1.0, 3) * size / 2


def box(low, high):
    low, high = np.asarray(low, float), np.asarray(high, float)
    return trimesh.creation.box(high - low, trimesh.transformations.translation_matrix((low + high) / 2))


def terrain(rng, side):
    return [grid((0, 0), (side, side), 0.3, rough(rng, 1.6, [14.0, 5.0, 2.0, 0.7]))]


def trees(rng, side):
    """Ground with crowns of leaves (small triangles in ellipsoids) on trunks."""
    meshes = [grid((0, 0), (side, side), 0.5, rough(rng, 0.4, [9.0, 3.0]))]
    for _ in range(9):
        x, y = rng.uniform(1, side - 1, 2)
        r = rng.uniform(1.0, 2.4)
        h = rng.uniform(1.5, 5.0)
        trunk = trimesh.creation.cylinder(0.15, h + 1, sections=8)
        trunk.apply_translation([x, y, h / 2])
        p = rng.normal(size=(1500, 3))
        p *= (rng.uniform(0.35, 1.0, (1500, 1)) / np.linalg.norm(p, axis=1)[:, None])
        p = p * [r, r, 0.8 * r] + [x, y, h + r]
        leaf = p[:, None, :] + rng.normal(size=(1500, 3, 3)) * 0.09
        meshes += [trunk, trimesh.Trimesh(leaf.reshape(-1, 3), np.arange(4500).reshape(-1, 3), process=False)]
    return meshes


def stairs(rng, side):
    rise, run = rng.uniform(0.3, 0.6), rng.uniform(0.4, 1.2)
    steps = [box((0, k * run, -1), (side, (k + 1) * run, k * rise)) for k in range(int(side / run))]
    return steps + [box((side * 0.3, side * 0.2, 0), (side * 0.36, side, side * 0.5))]


def water(rng, side):
    return [grid((0, 0), (side, side), 0.3, rough(rng, 0.12, [6.0, 2.0, 0.8]))]
