"""MSSD of the BOP benchmark from truth.csv and blocks.csv of cubes, by its published formula in NumPy: what `tsumu evaluate --out`
calls mssd_average_recall, computed again.

    python3 mssd_files.py make FOLDER                       cubes of 2 m, true and disturbed, with catalog.toml
    python3 mssd_files.py FOLDER/truth FOLDER/result [METRICS.json]

MSSD = min over the symmetries S of max over the corners x of |P x - G S x|; an estimate is right below a share of the diameter; estimates are
taken the surest first, each takes the nearest truth that is still free; recall is averaged over the shares .05, .10 ... .50. Cubes
have 24 symmetries, written out here as signed permutations.
"""
import csv
import itertools
import json
import os
import sys

import numpy as np

EDGE = 2.0
CORNERS = np.array(list(itertools.product([-1, 1], repeat=3))) * EDGE / 2
HEAD = "block_id,model,x_m,y_m,z_m,qw,qx,qy,qz,occlusion,confidence"


def symmetries():
    for order in itertools.permutations(range(3)):
        for signs in itertools.product([-1, 1], repeat=3):
            m = np.zeros((3, 3))
            m[range(3), order] = signs
            if np.linalg.det(m) > 0:
                yield m


SYMMETRIES = list(symmetries())


def matrix(w, x, y, z):
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def read(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    number = lambda row, key, missing: float(row[key]) if row.get(key) else missing
    poses = [(matrix(*(float(r[k]) for k in ("qw", "qx", "qy", "qz"))), np.array([float(r[k]) for k in ("x_m", "y_m", "z_m")])) for r in rows]
    return poses, [number(r, "occlusion", 0.0) for r in rows], [number(r, "confidence", 1.0) for r in rows]


def mssd(estimate, truth):
    a = CORNERS @ estimate[0].T + estimate[1]
    return min(np.linalg.norm(a - (CORNERS @ (truth[0] @ s).T + truth[1]), axis=1).max() for s in SYMMETRIES)


def average_recall(truth_folder, result_folder, hidden=0.8):
    truths, occlusion, _ = read(truth_folder, "truth.csv")
    estimates, _, confidence = read(result_folder, "blocks.csv")
    truths = [t for t, o in zip(truths, occlusion) if o < hidden]
    order = np.argsort(-np.array(confidence), kind="stable")
    diameter = EDGE * np.sqrt(3)
    errors = np.array([[mssd(estimates[i], t) / diameter for t in truths] for i in order])
    found = 0
    for limit in 0.05 * np.arange(1, 11):
        free = np.ones(len(truths), bool)
        for row in errors:
            open_row = np.where(free & (row < limit), row, np.inf)
            if np.isfinite(open_row.min()):
                free[open_row.argmin()] = False
        found += (~free).sum()
    return found / (10 * len(truths))


def make(folder):
    rng = np.random.default_rng(7)
    for name in ("truth", "result"):
        os.makedirs(os.path.join(folder, name), exist_ok=True)
    with open(os.path.join(folder, "catalog.toml"), "w", encoding="utf-8") as file:
        file.write(f'[[block]]\nname = "cube"\nshape = {{ kind = "cube", size = {EDGE} }}\n')
    truth, result = [], []
    for i in range(40):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
        place = np.array([3.0 * (i % 8), 3.0 * (i // 8), 0.0]) + rng.uniform(-0.3, 0.3, 3)
        truth.append((i + 1, place, q, rng.uniform(0, 1), ""))
        if i % 7 == 3:
            continue  # missed
        turn = rng.normal(size=3) * rng.choice([0.01, 0.1, 0.4])
        if i % 5 == 0:
            turn = turn + [np.pi / 2, 0, 0]  # a symmetry of the cube, nearly
        angle = np.linalg.norm(turn)
        axis = turn / angle
        d = np.append(np.cos(angle / 2), np.sin(angle / 2) * axis)
        p = np.array([
            q[0] * d[0] - q[1:] @ d[1:],
            *(q[0] * d[1:] + d[0] * q[1:] + np.cross(q[1:], d[1:])),
        ])
        result.append((len(result) + 1, place + rng.normal(size=3) * rng.choice([0.01, 0.1, 0.5]), p, "", rng.uniform(0.3, 1)))
    for name, rows in (("truth/truth.csv", truth), ("result/blocks.csv", result)):
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(HEAD + "\n")
            for number, place, q, occlusion, confidence in rows:
                values = [number, "cube", *(f"{v:.9f}" for v in place), *(f"{v:.9f}" for v in q), occlusion, confidence]
                file.write(",".join(str(v) for v in values) + "\n")


if __name__ == "__main__":
    if sys.argv[1] == "make":
        make(sys.argv[2])
    else:
        here = average_recall(sys.argv[1], sys.argv[2])
        print(f"average recall of MSSD: {here:.9f}")
        if len(sys.argv) > 3:
            with open(sys.argv[3], encoding="utf-8") as file:
                said = json.load(file)["mssd_average_recall"]
            print(f"the program says {said:.9f}")
            sys.exit(abs(said - here) > 1e-9)
