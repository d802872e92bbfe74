"""The training step of FPCCv2 with our heads, independently in PyTorch: losses must agree, times are compared.

    cargo run --release -p segment --example training_step FOLDER 20
    python fpccv2_step.py FOLDER 20
FOLDER holds model.safetensors and tile.csv (x, y, z, instance, offset of the centre, inner), lengths in d_max. Same
network, losses, neighbours, AdamW with the norm of every tensor's gradient clipped at 1, same rate. One thread.
"""

import json
import struct
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

WARM = 3
RATE, DECAY = 1e-3, 1e-2
PAIR_POINTS = 512


def read(path):
    raw = open(path, "rb").read()
    (length,) = struct.unpack("<Q", raw[:8])
    header = json.loads(raw[8 : 8 + length])
    meta = header.pop("__metadata__")
    body = raw[8 + length :]
    tensors = {}
    for name, t in header.items():
        a, b = t["data_offsets"]
        values = np.frombuffer(body[a:b], dtype="<f4").reshape(t["shape"]).copy()
        tensors[name] = torch.from_numpy(values).requires_grad_()
    return tensors, json.loads(meta["description"])["network"]["backbone"]


def neighbours(p, k, d):
    nearest = torch.cdist(p, p, compute_mode="donot_use_mm_for_euclid_dist").topk(k * d, largest=False).indices
    return nearest[:, ::d]


def forward(t, net, p):
    k = net["neighbours"]
    n = len(p)

    def linear(name, x):
        y = x @ t[name + ".weight"]
        return y + t[name + ".bias"] if name + ".bias" in t else y

    hood = neighbours(p, k, net["dilation"])
    near = p[hood]
    mean = near.mean(1, keepdim=True)
    other = near - mean
    own = (p[:, None] - mean).expand_as(near)
    gap = own - other
    relative = torch.cat([own, other, gap, gap.norm(dim=2, keepdim=True)], 2)
    flat = hood.reshape(-1)

    x, results = p, []
    for level in range(len(net["edge"])):
        name = f"backbone.levels.{level}."
        a = linear(name + "feature", x)
        # One index_select: its backward is the fast index_add.
        around = a.index_select(0, flat).view(n, k, -1)
        r = F.relu(a[:, None] - around + relative @ t[name + "position"] + t[name + "bias"])
        f = torch.cat([r, relative], 2)
        w = torch.softmax(f @ t[name + "attention"], 1)
        pooled = (w * f).sum(1)
        y = linear(name + "out", pooled)
        y = F.layer_norm(y, y.shape[1:], t[name + "norm.gamma"], t[name + "norm.beta"], 1e-5)
        x = F.relu(y)
        results.append(x)
    x = F.relu(linear("backbone.join", torch.cat(results, 1)))
    x = F.relu(linear("backbone.mix", x) + x)
    embedding = F.relu(linear("embedding", x))
    centre = torch.sigmoid(linear("centre", F.relu(linear("centre_hidden", x))))[:, 0]
    vote = linear("vote", F.relu(linear("vote_hidden", x)))
    return embedding, centre, vote[:, :3], vote[:, 3].clamp(-4.0, 1.1), vote[:, 4]


def loss(out, p, instance, offset_true, inner):
    embedding, centre, offset, log_error, block = out
    on = (instance > 0).float() * inner
    counted = on.sum().clamp(min=1)
    all_inner = inner.sum().clamp(min=1)
    error = ((offset - offset_true).square().sum(1) + 1e-8).sqrt()
    offset_loss = (error * on).sum() / counted
    expected = ((error.detach() * torch.exp(-log_error) + 3 * log_error) * on).sum() / counted
    label = (instance > 0).float()
    block_loss = (F.binary_cross_entropy_with_logits(block, label, reduction="none") * inner).sum() / all_inner
    score = torch.where(instance > 0, (1 - offset_true.square().sum(1)).clamp(0, 1), torch.zeros(()))
    centre_loss = ((centre - score).square() * 0.5 * on).sum() / counted

    chosen = torch.nonzero(on > 0)[:, 0]
    if len(chosen) > PAIR_POINTS:
        chosen = chosen[torch.arange(PAIR_POINTS) * len(chosen) // PAIR_POINTS]
    e, q, s, b = embedding[chosen], p[chosen], score[chosen], instance[chosen]
    near = ((q[:, None] - q[None]).square().sum(2) < 4).float()
    weight = near * (s[:, None] + s[None]).clamp(max=1)
    same = b[:, None] == b[None]
    norm = e.square().sum(1)
    distance = (F.relu(norm[:, None] + norm[None] - 2 * e @ e.T) + 1e-8).sqrt()
    kappa = torch.where(same, F.relu(distance - 0.5), F.relu(1 - distance))
    pair_loss = (kappa * weight).sum() / near.sum().clamp(min=1)

    total = 2 * offset_loss + 0.1 * expected + 0.5 * block_loss + centre_loss + 0.5 * pair_loss
    return total, pair_loss, centre_loss, offset_loss, block_loss


def main():
    folder, steps = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20
    torch.set_num_threads(1)
    tensors, net = read(f"{folder}/model.safetensors")
    table = torch.from_numpy(np.loadtxt(f"{folder}/tile.csv", delimiter=",", dtype=np.float32))
    p, instance, offset, inner = table[:, :3].contiguous(), table[:, 3].int(), table[:, 4:7].contiguous(), table[:, 7]
    weights = list(tensors.values())
    optimiser = torch.optim.AdamW(weights, lr=RATE, eps=1e-8, weight_decay=DECAY)
    lines = []
    for step in range(WARM + steps):
        if step == WARM:
            start = (time.perf_counter(), time.process_time())
        optimiser.zero_grad(set_to_none=True)
        parts = loss(forward(tensors, net, p), p, instance, offset, inner)
        parts[0].backward()
        for w in weights:
            torch.nn.utils.clip_grad_norm_([w], 1.0)
        optimiser.step()
        lines.append([float(v.detach()) for v in parts])
    wall, processor = time.perf_counter() - start[0], time.process_time() - start[1]
    for step, (total, pair, centre, offset_loss, block) in enumerate(lines):
        print(f"{step}: loss {total:.6f}, pair {pair:.6f}, centre {centre:.6f}, offset {offset_loss:.6f}, block {block:.6f}")
    print(f"{len(p)} points, {wall / steps:.4f} s a step, {processor / steps:.4f} s of the processor")


if __name__ == "__main__":
    main()
