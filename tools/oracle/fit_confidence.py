"""Fits the weights of crates/pose/src/confidence.rs to the signs of many accepted blocks.

    SIGNS=signs.csv SEED=700001 target/release/examples/bench_poses ...      (docs/bench/poses.md names the piles)
    tsumu-lab reproduce pose-confidence --scenes 4 --seed 700001 --out signs
    python3 tools/oracle/fit_confidence.py signs.csv signs/pose-features.csv

Logistic regression with a weak pull towards plain weights, because wrong blocks are rare. Blocks of the recipes' surveys
count three times: piles of cubes and of strangers are there for their wrong blocks. Needs numpy. Check the result with
other seeds: a fit says nothing about itself.
"""

import sys

import numpy as np

#                 1   area  fit  own  agree against shared sd  rough rival
PLAIN = np.array([-4.0, 0.1, 2.0, 1.0, 3.0, -0.5, -6.0, -0.5, -1.0, -2.0])
# Area and evidence against are held: they say little beside the others, and their sign must not turn.
PULL = np.array([0.02, 1e4, 0.3, 0.3, 0.3, 1e4, 0.1, 0.3, 0.3, 0.3])

lines = [line.rstrip("\n").split(",") for file in sys.argv[1:] for line in open(file)]
rows = [row for row in lines if row[2] in "01"]
x = np.array([[float(v) for v in row[5].split()] for row in rows])
y = np.array([int(row[2]) for row in rows])
counts = np.array([1.0 if row[0] == "bench" else 3.0 for row in rows])
w = PLAIN.copy()
for _ in range(300):
    p = 1 / (1 + np.exp(-x @ w))
    gradient = x.T @ (counts * (y - p)) - PULL * (w - PLAIN)
    curvature = (x * (counts * p * (1 - p))[:, None]).T @ x + np.diag(PULL)
    w = w + np.clip(np.linalg.solve(curvature, gradient), -3, 3)
print(f"{len(y)} blocks, {np.sum(1 - y)} wrong")
print("WEIGHTS = [" + ", ".join(f"{v:.3f}" for v in w) + "]")
p = 1 / (1 + np.exp(-x @ w))
for low, high in [(0, 0.5), (0.5, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.01)]:
    inside = (p >= low) & (p < high)
    print(f"{low:.2f} to {min(high, 1):.2f}: {inside.sum()} blocks, {y[inside].sum()} right")

margin = np.array([float(row[4]) for row in rows])
kind = np.array([int(row[3]) for row in rows])
both = (y == 1) & np.isfinite(margin)
if both.any():
    slopes = np.linspace(0.02, 2.0, 100)
    chance = 1 / (1 + np.exp(-slopes[:, None] * margin[both][None, :]))
    likely = np.log(np.where(kind[both] == 1, chance, 1 - chance) + 1e-9).sum(axis=1)
    print(f"TYPE_SLOPE = {slopes[likely.argmax()]:.2f} from {both.sum()} blocks, {np.sum(kind[both] == 0)} of the wrong type")
