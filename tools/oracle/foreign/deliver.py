"""What surveyors and programs do to a cloud before it is handed over: noise, thinning, gridding, holes, crops."""

import numpy as np
from scipy.spatial import cKDTree


def noisy(p, sd, rng):
    return p + rng.normal(size=p.shape) * sd


def drifted(p, sd, rng):
    """A smooth vertical error, some 7 m long."""
    total = np.zeros(len(p))
    for _ in range(5):
        k = rng.normal(size=2) * 2 * np.pi / 9
        total += np.sin(p[:, :2] @ k + rng.uniform(0, 2 * np.pi))
    return p + np.column_stack([np.zeros((len(p), 2)), total * sd / np.sqrt(2.5)])


def smoothed(p, radius):
    """Each point the weighted mean of its neighbours, as dense matching averages over windows."""
    tree = cKDTree(p)
    out = np.empty_like(p)
    for start in range(0, len(p), 4096):
        block = p[start : start + 4096]
        for i, near in enumerate(tree.query_ball_point(block, 2 * radius)):
            q = p[near]
            w = np.exp(-((q - block[i]) ** 2).sum(1) / (2 * radius**2))
            out[start + i] = (q * w[:, None]).sum(0) / w.sum()
    return out


def thinned(n, keep, rng):
    return np.flatnonzero(rng.random(n) < keep)


def uneven(p, ratio, rng):
    """Indices left when the density falls by `ratio` from west to east."""
    t = (p[:, 0] - p[:, 0].min()) / max(np.ptp(p[:, 0]), 1e-9)
    return np.flatnonzero(rng.random(len(p)) < ratio ** (-t))


def holes(p, count, radius, rng):
    """Indices outside `count` round holes in plan."""
    low, high = p.min(0), p.max(0)
    keep = np.ones(len(p), bool)
    for _ in range(count):
        c = rng.uniform(low[:2], high[:2])
        keep &= np.linalg.norm(p[:, :2] - c, axis=1) > radius * rng.uniform(0.6, 1.4)
    return np.flatnonzero(keep)


def cropped(p, share):
    """Indices inside the middle rectangle of this share of the sides."""
    low, high = p[:, :2].min(0), p[:, :2].max(0)
    margin = (high - low) * (1 - share) / 2
    return np.flatnonzero(((p[:, :2] > low + margin) & (p[:, :2] < high - margin)).all(1))


def gridded(p, label, cell, rule):
    """One z a cell (`mean` or `highest` of its points) at the cell's middle; the label of its highest point."""
    key = np.floor(p[:, :2] / cell).astype(np.int64)
    order = np.lexsort((p[:, 2], key[:, 1], key[:, 0]))
    key, z, label = key[order], p[order, 2], label[order]
    last = np.append(np.any(np.diff(key, axis=0) != 0, axis=1), True)
    ends = np.flatnonzero(last)
    starts = np.append(0, ends[:-1] + 1)
    if rule == "highest":
        height = z[ends]
    else:
        height = np.add.reduceat(z, starts) / (ends - starts + 1)
    middle = (key[ends] + 0.5) * cell
    return np.column_stack([middle, height]), label[ends]
