"""What photogrammetry makes of tetrapods: real ones cut out of a drone survey beside simulated ones.

    tsumu synth RECIPE --scenes 3 --seed 1 --out SIM        # tetrapods, sensor "uav", at the density of the real clouds
    tsumu recognise FOLDER/*.laz --catalog tetrapod-2.8m.toml --out RUN
    python3 tools/oracle/uav_statistics.py --real FOLDER --run RUN --size 2.8 --sim SIM [--plot plot.png]

Every block the run states is fitted again with its size free, by an exact distance (four capped cones) and least squares: an
independent check of `tsumu`'s own size fit. Then, for points of that block: density, scatter about the local
surface at 2 to 4 cm, and the signed distance from the block by the distance from the rim of a leg's tip: how far edges are
rounded. Needs numpy, scipy, laspy with lazrs; matplotlib for the plot. Prints Markdown tables.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parent))
from foreign.shapes import tetrapod_axes  # noqa: E402

TIP_AT, TIP_R, ROOT_AT, ROOT_R = 0.644, 0.151, 0.167, 0.235
RIMS = [0.0, 0.02, 0.04, 0.07, 0.11, 0.16, 0.24]


def capped_cone(t, r, h):
    """Signed distance to a leg in its own plane: along the axis t, away from it r. Only the flank and the tip are surface."""
    slope = (TIP_R - ROOT_R) / (TIP_AT - ROOT_AT)
    c = 1 / np.hypot(1, slope)
    flank = (r - (ROOT_R + (t / h - ROOT_AT) * slope) * h) * c
    cap = t - TIP_AT * h
    both = (flank > 0) & (cap > 0)
    return np.where(both, np.hypot(flank, cap), np.maximum(flank, cap))


def distance(p, h):
    """Signed distance of points in block coordinates from a tetrapod of height h, and the leg that is nearest."""
    along = p @ tetrapod_axes().T
    away = np.sqrt(np.maximum((p**2).sum(1)[:, None] - along**2, 0))
    d = capped_cone(along, away, h)
    leg = d.argmin(1)
    row = np.arange(len(p))
    return d[row, leg], along[row, leg], away[row, leg]


def moved(x, p):
    return Rotation.from_rotvec(x[3:6]).inv().apply(p - x[:3])


def fit(points, x, rng):
    """Pose and height that fit the points of one block best, from a pose that is nearly right."""

    def residual(x, p, scale):
        d = distance(moved(x, p), x[6])[0]
        return d / np.sqrt(1 + (d / scale) ** 2)

    for scale in (0.06, 0.04, 0.03, 0.03):
        near = np.flatnonzero(np.abs(distance(moved(x, points), x[6])[0]) < 4 * scale)
        few = points[rng.choice(near, min(5000, len(near)), replace=False)]
        x = least_squares(residual, x, args=(few, scale), max_nfev=20).x
    return x


def scatter(points, radius, rng):
    """Median robust scatter about local planes of one radius."""
    tree, out = cKDTree(points), []
    for i in rng.choice(len(points), 300):
        near = points[tree.query_ball_point(points[i], radius)]
        if len(near) >= 12:
            q = near - near.mean(0)
            w = np.linalg.svd(q, full_matrices=False)[2][2]
            out.append(1.4826 * np.median(np.abs(q @ w)))
    return np.median(out) if out else np.nan


def profile(points, x):
    """Median signed distance of flank and cap points by the distance from the tip's rim, m."""
    d, t, r = distance(moved(x, points), x[6])
    rim = np.hypot(t - TIP_AT * x[6], r - TIP_R * x[6])
    own = np.abs(d) < 0.12
    rows = []
    for low, high in zip(RIMS, RIMS[1:]):
        these = own & (rim >= low) & (rim < high)
        rows.append(np.median(d[these]) if these.sum() > 30 else np.nan)
    far = own & (rim > RIMS[-1])
    return rows, float(np.sqrt(np.mean(d[far & (np.abs(d) < 0.06)] ** 2)))


def real_blocks(folder, run, size, rng):
    """Blocks that a run of tsumu on the joined clouds states, each fitted again here with its size free."""
    import laspy

    clouds = [laspy.read(path) for path in sorted(Path(folder).glob("*.laz"))]
    p = np.vstack([np.column_stack([c.x, c.y, c.z]) for c in clouds])
    p = np.unique(p.round(4), axis=0)
    origin = p.mean(0).round()
    for row in csv.DictReader(open(Path(run) / "recognise" / "blocks.csv")):
        turn = Rotation.from_quat([float(row[k]) for k in ("qx", "qy", "qz", "qw")])
        at = np.array([float(row[k]) for k in ("x_m", "y_m", "z_m")]) - origin
        x = fit(p - origin, np.concatenate([at, turn.as_rotvec(), [size]]), rng)
        own = (p - origin)[np.abs(distance(moved(x, p - origin), x[6])[0]) < 0.12]
        yield row["block_id"], own, x, x[6], np.abs(distance(moved(x, own), x[6])[0])


def simulated_blocks(folder, rng, fewest=4000):
    for scene in sorted(Path(folder).glob("scenes/*")):
        raw = (scene / "cloud.ply").read_bytes()
        head = raw.index(b"end_header\n") + 11
        a = np.frombuffer(raw[head:], [("p", "<f8", 3), ("i", "<u4")])
        for row in csv.DictReader(open(scene / "truth.csv")):
            p = a["p"][a["i"] == int(row["block_id"])]
            if len(p) < fewest or float(row["occlusion"]) > 0.65:
                continue
            turn = Rotation.from_quat([float(row[k]) for k in ("qx", "qy", "qz", "qw")])
            at = [float(row[k]) for k in ("x_m", "y_m", "z_m")]
            size = float(row["model"].rsplit("-", 1)[-1].rstrip("m"))
            x = np.concatenate([at, turn.as_rotvec(), [size]])
            d = np.abs(distance(moved(x, p), size)[0])
            yield f"{scene.name}/{row['block_id']}", p, x, size, d


def density(points):
    """Points a square metre of surface, from the fifteenth neighbour."""
    few = points[:: max(1, len(points) // 400)]
    far = cKDTree(points).query(few, k=16)[0][:, -1]
    return float(np.median(15 / (np.pi * far**2)))


def middle_of(rows):
    """Median of each column over the blocks that have it; not a number where none has."""
    return [np.median([v for v in column if not np.isnan(v)] or [np.nan]) for column in zip(*rows)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--real")
    parser.add_argument("--run")
    parser.add_argument("--size", type=float, default=2.8)
    parser.add_argument("--sim")
    parser.add_argument("--plot")
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    print("| block | size m | points/m² of surface | median distance mm | scatter at 2 cm, 4 cm mm | rms far from rims mm |")
    print("|---|---|---|---|---|---|")
    profiles = {}
    for kind, blocks in (("real", real_blocks(args.real, args.run, args.size, rng) if args.real else []), ("simulated", simulated_blocks(args.sim, rng) if args.sim else [])):
        for name, p, x, h, d in blocks:
            row, rms = profile(p, x)
            profiles.setdefault(kind, []).append(row)
            s = [1000 * scatter(p, radius, rng) for radius in (0.02, 0.04)]
            near = d[d < 0.12]
            print(f"| {kind} {name} | {h:.3f} | {density(p):.0f} | {1000 * np.median(near):.1f} | {s[0]:.1f}, {s[1]:.1f} | {1000 * rms:.1f} |", flush=True)
    print("\n| from the rim of a tip, cm | " + " | ".join(f"{100 * a:.0f}–{100 * b:.0f}" for a, b in zip(RIMS, RIMS[1:])) + " |")
    print("|---|" + "---|" * (len(RIMS) - 1))
    for kind, rows in profiles.items():
        print(f"| {kind}, mm | " + " | ".join(f"{1000 * v:.1f}" for v in middle_of(rows)) + " |")
    if args.plot:
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        middle = [50 * (a + b) for a, b in zip(RIMS, RIMS[1:])]
        figure, axes = plt.subplots(figsize=(6, 3.6))
        for kind, rows in profiles.items():
            colour = "tab:red" if kind == "real" else "tab:blue"
            for row in rows:
                axes.plot(middle, [1000 * v for v in row], color=colour, alpha=0.25, lw=1)
            axes.plot(middle, [1000 * v for v in middle_of(rows)], color=colour, lw=2.5, label=f"{kind}, median of {len(rows)} blocks")
        axes.axhline(0, color="0.6", lw=0.8)
        axes.set_xlabel("distance from the rim of a leg's tip, cm")
        axes.set_ylabel("survey above the block, mm")
        axes.legend()
        figure.tight_layout()
        figure.savefig(args.plot, dpi=110)


if __name__ == "__main__":
    main()
