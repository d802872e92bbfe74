"""Independent forward pass of FPCCv2 with our heads, in NumPy, float64.

Reads a model file (safetensors) and a cloud, writes what the network should say:
    python fpccv2_forward.py MODEL.safetensors POINTS.csv OUT.csv
POINTS.csv: x,y,z in d_max, one point a line. OUT.csv: offset (3), log_error, block, centre, first four of the embedding.
Written from METHOD section 3 and the layer names alone; nearest neighbours by brute force.
"""

import csv
import json
import struct
import sys

import numpy as np


def read(path):
    raw = open(path, "rb").read()
    (length,) = struct.unpack("<Q", raw[:8])
    header = json.loads(raw[8 : 8 + length])
    meta = header.pop("__metadata__")
    body = raw[8 + length :]
    tensors = {}
    for name, t in header.items():
        assert t["dtype"] == "F32"
        a, b = t["data_offsets"]
        tensors[name] = np.frombuffer(body[a:b], dtype="<f4").reshape(t["shape"]).astype(np.float64)
    return tensors, json.loads(meta["description"])


def linear(t, name, x):
    y = x @ t[name + ".weight"]
    return y + t[name + ".bias"] if name + ".bias" in t else y


def layer_norm(t, name, x):
    m = x.mean(axis=1, keepdims=True)
    v = ((x - m) ** 2).mean(axis=1, keepdims=True)
    return (x - m) / np.sqrt(v + 1e-5) * t[name + ".gamma"] + t[name + ".beta"]


def relu(x):
    return np.maximum(x, 0.0)


def forward(t, description, p):
    net = description["network"]["backbone"]
    k, d = net["neighbours"], net["dilation"]
    n = len(p)
    # float32 distances, as measured points are; ties go to the lower index.
    q = p.astype(np.float32)
    diff = q[None, :, :] - q[:, None, :]
    d2 = diff[..., 0] * diff[..., 0] + diff[..., 1] * diff[..., 1] + diff[..., 2] * diff[..., 2]
    order = np.argsort(d2, axis=1, kind="stable")[:, : k * d]
    hood = order[:, np.minimum(np.arange(k) * d, order.shape[1] - 1)]
    near = p[hood]
    mean = near.mean(axis=1, keepdims=True)
    own = np.broadcast_to(p[:, None, :] - mean, near.shape)
    other = near - mean
    gap = own - other
    relative = np.concatenate([own, other, gap, np.linalg.norm(gap, axis=2, keepdims=True)], axis=2)

    x, results = p, []
    for level in range(len(net["edge"])):
        name = f"backbone.levels.{level}."
        a = linear(t, name + "feature", x)
        r = relu(a[:, None, :] - a[hood] + relative @ t[name + "position"] + t[name + "bias"])
        f = np.concatenate([r, relative], axis=2)
        score = f @ t[name + "attention"]
        score = np.exp(score - score.max(axis=1, keepdims=True))
        pooled = (score / score.sum(axis=1, keepdims=True) * f).sum(axis=1)
        x = relu(layer_norm(t, name + "norm", linear(t, name + "out", pooled)))
        results.append(x)
    x = relu(linear(t, "backbone.join", np.concatenate(results, axis=1)))
    x = relu(linear(t, "backbone.mix", x) + x)

    embedding = relu(linear(t, "embedding", x))
    centre = 1 / (1 + np.exp(-linear(t, "centre", relu(linear(t, "centre_hidden", x)))))
    vote = linear(t, "vote", relu(linear(t, "vote_hidden", x)))
    log_error = np.clip(vote[:, 3:4], -4.0, 1.1)
    return np.concatenate([vote[:, :3], log_error, vote[:, 4:5], centre, embedding[:, :4]], axis=1)


def main():
    model, points, out = sys.argv[1:]
    tensors, description = read(model)
    p = np.array([[float(v) for v in row] for row in csv.reader(open(points))])
    y = forward(tensors, description, p)
    with open(out, "w") as f:
        for row in y:
            f.write(",".join(f"{v:.6g}" for v in row) + "\n")


if __name__ == "__main__":
    main()
