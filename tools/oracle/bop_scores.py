"""MSSD and VSD by the formulas of the BOP benchmark, in NumPy: golden values of crates/metrics/src/bop.rs."""
import numpy as np

HALF = np.array([0.05, 0.03, 0.01])
V = np.array([[(1 if i >> a & 1 else -1) * HALF[a] for a in range(3)] for i in range(8)])
QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
T = [[q[0], q[1], q[2]] for q in QUADS] + [[q[0], q[2], q[3]] for q in QUADS]


def rot(z, x):
    c, s = np.cos, np.sin
    rz = np.array([[c(z), -s(z), 0], [s(z), c(z), 0], [0, 0, 1]])
    rx = np.array([[1, 0, 0], [0, c(x), -s(x)], [0, s(x), c(x)]])
    return rz @ rx


def pose(t, z, x):
    return rot(z, x), np.array(t)


def mssd(est, gt):
    best = np.inf
    for s in (rot(0, 0), rot(np.pi, 0)):
        a = V @ est[0].T + est[1]
        b = V @ (gt[0] @ s).T + gt[1]
        best = min(best, np.linalg.norm(a - b, axis=1).max())
    return best


def render(p, w=80, h=60, f=(300.0, 310.0), c=(39.5, 29.5)):
    u, v = np.meshgrid(np.arange(w), np.arange(h))
    rays = np.stack([(u - c[0]) / f[0], (v - c[1]) / f[1], np.ones_like(u, float)], -1).reshape(-1, 3)
    cam = V @ p[0].T + p[1]
    dist = np.full(len(rays), np.inf)
    for t in T:  # Möller and Trumbore
        a, b, d = cam[t]
        e1, e2 = b - a, d - a
        q = np.cross(rays, e2)
        det = q @ e1
        with np.errstate(all="ignore"):
            s = -a
            uu = (q @ s) / det
            r = np.cross(s, e1)
            vv = (rays @ r) / det
            tt = (r @ e2) / det
        hit = (uu >= 0) & (vv >= 0) & (uu + vv <= 1) & (tt > 0)
        z = np.where(hit, tt * np.linalg.norm(rays, axis=1), np.inf)
        dist = np.minimum(dist, z)
    return np.where(np.isfinite(dist), dist, 0).reshape(h, w)


def visible(test, model, delta=0.015):
    return ((model - test <= delta) | (test == 0)) & (model > 0)


def vsd(test, gt, est, taus):
    vg = visible(test, gt)
    ve = visible(test, est) | (vg & (est > 0))
    inter, union = vg & ve, vg | ve
    d = np.abs(gt[inter] - est[inter])
    n = union.sum()
    return [1.0 if n == 0 else ((d >= t).sum() + n - inter.sum()) / n for t in taus]


if __name__ == "__main__":
    gt = pose([0.01, -0.02, 0.6], 0.3, 0.2)
    cases = [
        pose([0.012, -0.02, 0.603], 0.3, 0.2),
        pose([0.01, -0.02, 0.6], 0.3 + 3.2, 0.2),
        pose([0.03, -0.01, 0.61], 0.9, 0.5),
    ]
    diameter = max(np.linalg.norm(a - b) for a in V for b in V)
    image = render(gt)
    test = image.copy()
    test[:, :34] = 0.5
    test[30] = 0.0
    taus = [0.1 * diameter, 0.02 * diameter]
    print("MSSD", [float(mssd(e, gt)) for e in cases])
    print("VSD", [[float(x) for x in vsd(test, image, render(e), taus)] for e in cases])
