"""Golden values for crates/metrics/src/surface_distance.rs: the Siléane evaluator's pose distance (Brégier et al. 2017)
by plain summation over surface points, no closed form. A 2 m cube with its corner at the origin and four symmetries
about the vertical through its centre. Run: python3 surface_distance.py"""
import numpy as np

n = 400
u = (np.arange(n) + 0.5) / n * 2
a, b = [g.ravel() for g in np.meshgrid(u, u)]
faces = []
for axis in range(3):
    for value in (0.0, 2.0):
        p = np.zeros((n * n, 3))
        p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = value, a, b
        faces.append(p)
x = np.vstack(faces)


def turn(axis, deg):
    axis = np.array(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    t = np.radians(deg)
    return np.eye(3) + np.sin(t) * k + (1 - np.cos(t)) * k @ k


def distance(r1, t1, r2, t2):
    c = np.ones(3)
    best = np.inf
    for k in range(4):
        g = turn([0, 0, 1], 90 * k)
        q = (x - c) @ g.T + c
        best = min(best, np.sqrt(np.mean(np.sum((x @ r1.T + t1 - q @ r2.T - t2) ** 2, axis=1))))
    return best


for r1, t1, r2, t2 in [
    (np.eye(3), [0.3, -0.4, 0.0], np.eye(3), [0, 0, 0]),
    (turn([0, 0, 1], 100), [0, 0, 0], np.eye(3), [0, 0, 0]),
    (turn([1, 2, 3], 40), [0.1, 0.2, 0.3], turn([0, 1, -1], 70), [0.5, 0, -0.2]),
]:
    print(f"{distance(r1, np.array(t1), r2, np.array(t2)):.6f}")
