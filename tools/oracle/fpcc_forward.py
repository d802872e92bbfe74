"""Independent forward pass of FPCC (METHOD section 2), in NumPy, float64.

    python fpcc_forward.py WEIGHTS.safetensors POINTS.csv OUT.csv
POINTS.csv: x,y,z, one point a line. OUT.csv: centre score, then the first eight numbers of the embedding.
Nearest neighbours by brute force, the point itself included; no batch normalisation.
"""

import csv
import json
import struct
import sys

import numpy as np

K = 20


def read(path):
    raw = open(path, "rb").read()
    (length,) = struct.unpack("<Q", raw[:8])
    header = json.loads(raw[8 : 8 + length])
    header.pop("__metadata__", None)
    body = raw[8 + length :]
    return {
        name: np.frombuffer(body[t["data_offsets"][0] : t["data_offsets"][1]], dtype="<f4")
        .reshape(t["shape"])
        .astype(np.float64)
        for name, t in header.items()
    }


def relu(x):
    return np.maximum(x, 0.0)


def linear(t, name, x):
    y = x @ t[name + ".weight"]
    return y + t[name + ".bias"] if name + ".bias" in t else y


def nearest(x):
    d2 = ((x[:, None, :] - x[None, :, :]) ** 2).sum(axis=2)
    return np.argsort(d2, axis=1, kind="stable")[:, :K]


def edge_convolution(t, name, x, hood):
    own = np.broadcast_to(x[:, None, :], x[hood].shape)
    edge = relu(linear(t, name + ".own", own) + linear(t, name + ".other", x[hood] - own))
    if name + ".second.weight" in t:
        edge = relu(linear(t, name + ".second", edge))
    return edge.max(axis=1)


def forward(t, p):
    q = p - p.min(axis=0)
    x = np.concatenate([q, q / q.max(axis=0)], axis=1)
    a = edge_convolution(t, "first", x, nearest(q))
    b = edge_convolution(t, "second", a, nearest(a))
    c = edge_convolution(t, "third", b, nearest(b))
    local = np.concatenate([a, b, c], axis=1)
    top = relu(linear(t, "global", local)).max(axis=0, keepdims=True)
    joined = np.concatenate([local, np.repeat(top, len(p), axis=0)], axis=1)
    f = relu(linear(t, "mix", relu(linear(t, "join", joined))))
    centre = 1 / (1 + np.exp(-linear(t, "centre", relu(linear(t, "centre_hidden", f)))))
    return np.concatenate([centre, relu(linear(t, "embedding", f))[:, :8]], axis=1)


def main():
    weights, points, out = sys.argv[1:]
    p = np.array([[float(v) for v in row] for row in csv.reader(open(points))])
    with open(out, "w") as f:
        for row in forward(read(weights), p):
            f.write(",".join(f"{v:.6g}" for v in row) + "\n")


if __name__ == "__main__":
    main()
