"""The drop of `crates/sim/examples/drop_bench.rs` repeated in PyBullet and MuJoCo: same hulls, mass, inertia, starts,
step, friction between two surfaces and criterion of rest.

    cargo run --release --example drop_bench 24 120 > drop.json
    python3 tools/oracle/drop_compare.py drop.json --out RESULTS.json --plot drop.png

Needs pybullet, mujoco, scipy; matplotlib for the plot. Prints two Markdown tables: the engines, and each of the others
against ours, seed by seed. Seconds are processor seconds: ours with building the world, theirs in stepping alone.
RESULTS.json keeps every run, so that an interrupted comparison goes on where it stopped.
"""

import argparse
import json
import math
import os
import statistics
import tempfile
import time

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

# Cell of the raster that the pile's upper surface is measured on.
CELL_M = 0.1
LONGEST_S = 60
WALLS = [((0, 0, 1), 0), ((1, 0, 0), 1), ((-1, 0, 0), 1), ((0, 1, 0), 1), ((0, -1, 0), 1)]


class Rest:
    """The criterion of rest of the drop: nothing faster than a limit for half a second."""

    def __init__(self, data):
        self.limit = data["rest_speed_m_s"]
        self.needed = math.ceil(data["rest_time_s"] / data["step_s"])
        self.reach = data["reach_m"]
        self.still = 0

    def reached(self, linear, angular):
        speeds = np.linalg.norm(linear, axis=1) + np.linalg.norm(angular, axis=1) * self.reach
        self.still = self.still + 1 if speeds.max() < self.limit else 0
        return self.still > self.needed


def drop_pybullet(data, run):
    import pybullet as bullet

    bullet.connect(bullet.DIRECT)
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(data["step_s"])
    # Bullet multiplies the coefficients of two surfaces; the root gives the pair the same friction.
    friction = math.sqrt(data["friction"])
    half = data["half_pen_m"]
    for normal, out in WALLS:
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=normal)
        body = bullet.createMultiBody(0, plane, basePosition=[-n * out * half for n in normal])
        bullet.changeDynamics(body, -1, lateralFriction=friction)
    # One hull a part, as in the other engines: Bullet makes a convex hull of every object of an OBJ file.
    with tempfile.NamedTemporaryFile("w", suffix=".obj", delete=False) as file:
        first = 1
        for k, hull in enumerate(data["hulls"]):
            file.write(f"o part{k}\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in hull))
            file.write("".join(f"f {first} {first + i} {first + i + 1}\n" for i in range(1, len(hull) - 1)))
            first += len(hull)
    shape = bullet.createCollisionShape(bullet.GEOM_MESH, fileName=file.name)
    os.unlink(file.name)
    bodies = []
    for start in run["start"]:
        body = bullet.createMultiBody(data["mass_kg"], shape, basePosition=start[:3], baseOrientation=start[3:])
        inertia = [data["inertia"]] * 3
        bullet.changeDynamics(
            body, -1, lateralFriction=friction, localInertiaDiagonal=inertia, linearDamping=0, angularDamping=0
        )
        bodies.append(body)
    rest, steps, at_rest, cpu = Rest(data), 0, False, 0.0
    while steps < LONGEST_S / data["step_s"] and not at_rest:
        begun = time.process_time()
        bullet.stepSimulation()
        cpu += time.process_time() - begun
        steps += 1
        velocities = [bullet.getBaseVelocity(b) for b in bodies]
        at_rest = rest.reached([v for v, _ in velocities], [w for _, w in velocities])
    poses = [bullet.getBasePositionAndOrientation(b) for b in bodies]
    bullet.disconnect()
    return {"cpu_s": cpu, "at_rest": at_rest, "time_s": steps * data["step_s"], "rest": [[*p, *q] for p, q in poses]}


def drop_mujoco(data, run):
    import mujoco

    # With MuJoCo's defaults (one contact a pair of hulls, soft friction that slips) piles creep for 50 s and end 0.4 m
    # lower; several contacts a pair, an elliptic cone without slip and the stiffest contact the step allows rest in 6 s.
    half, stiffness = data["half_pen_m"], f'solref="{2.001 * data["step_s"]:.6f} 1"'
    friction = f'friction="{data["friction"]} 0.005 0.0001" condim="3" {stiffness}'
    text = lambda values: " ".join(f"{v:.9g}" for v in values)
    meshes = "".join(
        f'<mesh name="part{k}" vertex="{text(np.ravel(hull))}"/>' for k, hull in enumerate(data["hulls"])
    )
    planes = "".join(
        f'<geom type="plane" size="0 0 1" pos="{text(-n * out * half for n in normal)}" zaxis="{text(normal)}" {friction}/>'
        for normal, out in WALLS
    )
    geoms = "".join(f'<geom type="mesh" mesh="part{k}" {friction}/>' for k in range(len(data["hulls"])))
    inertial = f'<inertial pos="0 0 0" mass="{data["mass_kg"]}" diaginertia="{text([data["inertia"]] * 3)}"/>'
    bodies = "".join(
        f'<body pos="{text(s[:3])}" quat="{text([s[6], *s[3:6]])}"><freejoint/>{inertial}{geoms}</body>'
        for s in run["start"]
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><size memory="256M"/><option timestep="{data["step_s"]}" gravity="0 0 -9.81" '
        f'cone="elliptic" impratio="10" noslip_iterations="20"><flag multiccd="enable"/></option>'
        f"<asset>{meshes}</asset><worldbody>{planes}{bodies}</worldbody></mujoco>"
    )
    state = mujoco.MjData(model)
    rest, steps, at_rest, cpu = Rest(data), 0, False, 0.0
    while steps < LONGEST_S / data["step_s"] and not at_rest:
        begun = time.process_time()
        mujoco.mj_step(model, state)
        cpu += time.process_time() - begun
        steps += 1
        velocity = state.qvel.reshape(-1, 6)
        at_rest = rest.reached(velocity[:, :3], velocity[:, 3:])
    poses = state.qpos.reshape(-1, 7)
    rest_poses = [[*map(float, p[:3]), *map(float, p[4:7]), float(p[3])] for p in poses]
    return {"cpu_s": cpu, "at_rest": bool(at_rest), "time_s": steps * data["step_s"], "rest": rest_poses}


def porosity(data, rest, planes):
    """1 − blocks' volume / volume under the pile's upper surface inside the pen, by columns through the hulls."""
    half = data["half_pen_m"]
    cells = round(2 * half / CELL_M)
    top = np.zeros((cells, cells))
    centre = lambda i: (i + 0.5) * CELL_M - half
    for pose in rest:
        turn = Rotation.from_quat(pose[3:])
        for hull, plane in zip(data["hulls"], planes):
            corners = turn.apply(hull) + pose[:3]
            normal = turn.apply(plane[:, :3])
            offset = plane[:, 3] - normal @ pose[:3]
            low = np.clip(((corners.min(0)[:2] + half) / CELL_M).astype(int), 0, cells - 1)
            high = np.clip(((corners.max(0)[:2] + half) / CELL_M).astype(int) + 1, 0, cells)
            x, y = np.meshgrid(centre(np.arange(low[0], high[0])), centre(np.arange(low[1], high[1])), indexing="ij")
            # n·p + d <= 0 inside: solved for z, faces that look up bound it above, those that look down below.
            room = -(normal[:, 0, None, None] * x + normal[:, 1, None, None] * y + offset[:, None, None])
            up, down = normal[:, 2] > 1e-9, normal[:, 2] < -1e-9
            upper = (room[up] / normal[up, 2, None, None]).min(0)
            lower = (room[down] / normal[down, 2, None, None]).max(0)
            beside = (room[~up & ~down] >= 0).all(0)
            part = top[low[0] : high[0], low[1] : high[1]]
            np.maximum(part, np.where((upper >= lower) & beside, upper, 0), out=part)
    return 1 - len(rest) * data["volume_m3"] / (top.sum() * CELL_M**2)


def mean_and_error(values):
    spread = statistics.stdev(values) if len(values) > 1 else math.nan
    return statistics.mean(values), spread / math.sqrt(len(values))


def tables(results):
    print("| engine | seeds | median CPU s | came to rest | median simulated s | mean height of centres m | porosity |")
    print("|---|---|---|---|---|---|---|")
    for name, runs in results.items():
        cell = [mean_and_error([r[k] for r in runs]) for k in ("height_m", "porosity")]
        print(
            f"| {name} | {len(runs)} | {statistics.median(r['cpu_s'] for r in runs):.3f} | "
            f"{sum(r['at_rest'] for r in runs)} | {statistics.median(r['time_s'] for r in runs):.1f} | "
            + " | ".join(f"{m:.3f} ± {e:.3f}" for m, e in cell)
            + " |"
        )
    print("\n| against | CPU time, median of the ratios | a simulated second | height − ours m | porosity − ours |")
    print("|---|---|---|---|---|")
    ours = results["tsumu"]
    for name, runs in list(results.items())[1:]:
        pairs = list(zip(ours, runs))
        ratio = statistics.median(b["cpu_s"] / a["cpu_s"] for a, b in pairs)
        pace = statistics.median(b["cpu_s"] / b["time_s"] / (a["cpu_s"] / a["time_s"]) for a, b in pairs)
        cells = []
        for key in ("height_m", "porosity"):
            mean, error = mean_and_error([b[key] - a[key] for a, b in pairs])
            cells.append(f"{mean:+.3f} ± {error:.3f} ({abs(mean) / error:.1f} standard errors)")
        print(f"| {name} | {ratio:.1f} × | {pace:.1f} × | " + " | ".join(cells) + " |")


def plot(results, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8))
    keys = [("height_m", "mean height of block centres, m"), ("porosity", "porosity"), ("cpu_s", "processor seconds")]
    for axis, (key, label) in zip(axes, keys):
        for k, (name, runs) in enumerate(results.items()):
            values = [r[key] for r in runs]
            spread = np.linspace(-0.25, 0.25, len(values))
            axis.plot(k + spread, values, "o", alpha=0.55, markersize=4)
            axis.plot([k - 0.35, k + 0.35], [statistics.mean(values)] * 2, "k-")
        axis.set(xticks=range(len(results)), xticklabels=results, ylabel=label)
    axes[2].set_yscale("log")
    axes[1].set_title(f"one dot a pile of {len(results['tsumu'][0]['rest'])} tetrapods, lines: means")
    figure.tight_layout()
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("drop")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--engines", default="PyBullet,MuJoCo")
    parser.add_argument("--out")
    parser.add_argument("--plot")
    arguments = parser.parse_args()
    data = json.load(open(arguments.drop))
    drops = data["runs"][: arguments.seeds]
    planes = [ConvexHull(np.array(hull)).equations for hull in data["hulls"]]
    kept = json.load(open(arguments.out)) if arguments.out and os.path.exists(arguments.out) else {}
    results = {"tsumu": [{k: r[k] for k in ("cpu_s", "at_rest", "time_s", "rest")} for r in drops]}
    engines = {"PyBullet": drop_pybullet, "MuJoCo": drop_mujoco}
    for name in arguments.engines.split(","):
        results[name] = kept.get(name, [])[: len(drops)]
        for run in drops[len(results[name]) :]:
            results[name].append(engines[name](data, run))
            if arguments.out:
                kept[name] = results[name]
                json.dump(kept, open(arguments.out, "w"))
    for runs in results.values():
        for run in runs:
            run["height_m"] = statistics.mean(p[2] for p in run["rest"])
            run["porosity"] = porosity(data, run["rest"], planes)
    tables(results)
    if arguments.plot:
        plot(results, arguments.plot)


main()
