"""Noise statistics of multibeam pings: a real R2Sonic XTF file beside simulated pings over a flat bed.

    cargo run --release -p synth --example mbes_flat_bed > sim.csv
    python3 tools/oracle/mbes_statistics.py survey.xtf sim.csv [plot.png]

Needs numpy; matplotlib for the plot. Prints a Markdown table.
"""

import csv
import struct
import sys

import numpy as np

BINS = [(0, 20), (20, 30), (30, 40), (40, 50), (50, 62)]


def read_xtf(path):
    """Angles and slant ranges [ping, beam] of the R2Sonic BTH0 records inside an XTF file."""
    data = open(path, "rb").read()
    angles, ranges = [], []
    at = data.find(b"BTH0")
    while at >= 0:
        size = struct.unpack(">I", data[at + 4 : at + 8])[0]
        p, beams, sound = at + 12, 0, 0.0
        angle = rng = None
        while p < at + size:
            name, length = struct.unpack(">2sH", data[p : p + 4])
            if length == 0:
                break
            if name == b"H0":
                beams = struct.unpack(">H", data[p + length - 2 : p + length])[0]
                sound = struct.unpack(">f", data[p + 44 : p + 48])[0]
                beams = 256 if beams not in range(16, 2048) else beams
            elif name == b"R0":
                scale = struct.unpack(">f", data[p + 4 : p + 8])[0]
                raw = np.frombuffer(data, ">u2", (length - 8) // 2, p + 8)[:256]
                rng = raw * scale
            elif name == b"A2":
                first, scale = struct.unpack(">2f", data[p + 4 : p + 12])
                steps = np.frombuffer(data, ">u2", (length - 36) // 2, p + 36)[:256]
                angle = first + np.cumsum(steps) * scale
            p += length
        if not 1300 < sound < 1700:
            sound = 1513.9
        if rng is not None and angle is not None:
            angles.append(angle)
            ranges.append(rng * sound / 2)
        at = data.find(b"BTH0", at + 4)
    return np.array(angles), np.array(ranges)


def read_csv(path):
    rows = np.array([[float(v) for v in r] for r in list(csv.reader(open(path)))[1:]])
    pings, beams = int(rows[:, 0].max()) + 1, int(rows[:, 1].max()) + 1
    grid = np.full((2, pings, beams), np.nan)
    i, j = rows[:, 0].astype(int), rows[:, 1].astype(int)
    grid[0, i, j], grid[1, i, j] = rows[:, 2], rows[:, 3]
    return grid[0], grid[1]


def statistics(angles, ranges):
    degrees = np.abs(np.degrees(np.nanmedian(angles, axis=0)))
    second = (ranges[:-2] - 2 * ranges[1:-1] + ranges[2:]) / np.sqrt(6)
    second[np.abs(second) > 0.05] = np.nan  # gross errors are counted apart
    depth = ranges * np.cos(angles)
    beams = depth.shape[1]
    residual = np.full_like(depth, np.nan)
    x = np.arange(-7, 8)
    fit = np.linalg.pinv(np.vander(x, 3))
    for b in range(7, beams - 7):
        window = depth[:, b - 7 : b + 8]
        value = window[:, 7] - (window @ fit.T)[:, 2]
        residual[:, b] = value
    out = []
    for low, high in BINS:
        inside = np.where((degrees >= low) & (degrees < high))[0]
        noise = np.sqrt(np.nanmean(second[:, inside] ** 2))
        local = 1.4826 * np.nanmedian(np.abs(residual[:, inside]))

        def correlation(lag):
            pairs = [b for b in inside if b + lag in inside and np.sign(b - 128) == np.sign(b + lag - 128)]
            a = second[:, pairs]
            c = second[:, [b + lag for b in pairs]]
            good = np.isfinite(a) & np.isfinite(c)
            return float(np.mean(a[good] * c[good]) / np.sqrt(np.mean(a[good] ** 2) * np.mean(c[good] ** 2)))

        out.append((noise * 100, local * 100, correlation(1), correlation(4), correlation(16) if len(inside) > 40 else np.nan))
    return degrees, second, out


def main():
    real, sim = read_xtf(sys.argv[1]), read_csv(sys.argv[2])
    results = [statistics(*real), statistics(*sim)]
    print(f"real: {real[1].shape[0]} pings x {real[1].shape[1]} beams; simulated: {sim[1].shape}")
    print("| angle | ping-to-ping cm real / sim | in-ping residual cm real / sim | corr lag 1 | lag 4 | lag 16 |")
    print("|---|---|---|---|---|---|")
    for k, (low, high) in enumerate(BINS):
        r, s = results[0][2][k], results[1][2][k]
        cells = [f"{a:.2f} / {b:.2f}" for a, b in zip(r, s)]
        print(f"| {low}-{high}° | " + " | ".join(cells) + " |")
    if len(sys.argv) > 3:
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(1, 3, figsize=(13, 4))
        for (degrees, second, out), name in zip(results, ["real R2Sonic 2026", "simulated"]):
            middle = [(a + b) / 2 for a, b in BINS]
            axes[0].plot(middle, [o[0] for o in out], "o-", label=name)
            axes[1].plot(middle, [o[2] for o in out], "o-", label=name + ", lag 1")
            axes[1].plot(middle, [o[4] for o in out], "s--", label=name + ", lag 16")
        axes[0].set(xlabel="beam angle, degrees", ylabel="ping-to-ping rms of range, cm", ylim=(0, 1.5))
        axes[1].set(xlabel="beam angle, degrees", ylabel="correlation between beams", ylim=(-0.1, 1))
        both = np.concatenate([results[0][1][100:160], np.full((4, results[0][1].shape[1]), np.nan), results[1][1][100:160]])
        axes[2].imshow(both * 100, vmin=-2, vmax=2, cmap="RdBu", aspect="auto")
        axes[2].set(xlabel="beam", ylabel="ping (above: real, below: simulated)", title="range noise, ±2 cm")
        axes[0].legend()
        axes[1].legend()
        figure.tight_layout()
        figure.savefig(sys.argv[3], dpi=90)


main()
