"""Fits the weights of crates/pose/src/confidence.rs to the signs that `tsumu reproduce pose-confidence` leaves.

    tsumu reproduce pose-confidence --scenes 4 --seed 700001 --out signs
    python3 tools/oracle/fit_confidence.py signs/pose-signs.csv

Logistic regression with a weak pull towards plain weights, because wrong blocks are rare. Needs numpy. Check the result
with the same experiment and another seed: a fit says nothing about itself.
"""

import sys

import numpy as np

PLAIN = np.array([-4.0, 0.5, 2.0, 1.0, 3.0, -1.0, -6.0, -0.5])
PULL = np.array([0.02, 0.3, 0.3, 0.3, 0.3, 0.3, 0.1, 0.3])

rows = [line.rstrip("\n").split(",") for file in sys.argv[1:] for line in list(open(file))[1:]]
x = np.array([[float(v) for v in row[5].split()] for row in rows])
y = np.array([int(row[2]) for row in rows])
w = PLAIN.copy()
for _ in range(100):
    p = 1 / (1 + np.exp(-x @ w))
    gradient = x.T @ (y - p) - PULL * (w - PLAIN)
    curvature = (x * (p * (1 - p))[:, None]).T @ x + np.diag(PULL)
    w = w + np.linalg.solve(curvature, gradient)
print(f"{len(y)} blocks, {np.sum(1 - y)} wrong")
print("WEIGHTS = [" + ", ".join(f"{v:.3f}" for v in w) + "]")

margin = np.array([float(row[4]) for row in rows])
kind = np.array([int(row[3]) for row in rows])
both = (y == 1) & np.isfinite(margin)
if both.any():
    slopes = np.linspace(0.02, 2.0, 100)
    chance = 1 / (1 + np.exp(-slopes[:, None] * margin[both][None, :]))
    likely = np.log(np.where(kind[both] == 1, chance, 1 - chance) + 1e-9).sum(axis=1)
    print(f"TYPE_SLOPE = {slopes[likely.argmax()]:.2f} from {both.sum()} blocks, {np.sum(kind[both] == 0)} of the wrong type")
