"""The drop of `crates/sim/examples/drop_bench.rs` repeated in PyBullet: same hulls, mass,
inertia, starts, step, friction between two surfaces and criterion of rest.

    cargo run --release -p tsumu-sim --example drop_bench 20 120 > drop.json
    python3 tools/oracle/drop_compare.py drop.json [seeds] [plot.png]

Needs pybullet; matplotlib is optional. Prints a Markdown table.
"""

import json
import math
import os
import statistics
import sys
import tempfile
import time

import pybullet as bullet


def settled(speeds, state, data):
    still = all(s < data["rest_speed_m_s"] for s in speeds)
    state[0] = state[0] + 1 if still else 0
    return state[0] > math.ceil(data["rest_time_s"] / data["step_s"])


def drop_pybullet(data, run):
    begun = time.process_time()
    bullet.connect(bullet.DIRECT)
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(data["step_s"])
    # Bullet multiplies the coefficients of two surfaces; the root gives the pair the same friction.
    friction = math.sqrt(data["friction"])
    half = data["half_pen_m"]
    for normal, offset in [((0, 0, 1), 0), ((1, 0, 0), -half), ((-1, 0, 0), -half), ((0, 1, 0), -half), ((0, -1, 0), -half)]:
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, planeNormal=normal)
        body = bullet.createMultiBody(0, plane, basePosition=[n * offset for n in normal])
        bullet.changeDynamics(body, -1, lateralFriction=friction)
    # One hull a part, as in the other engine: Bullet makes a convex hull of every object of an OBJ file.
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
        bullet.changeDynamics(
            body, -1, lateralFriction=friction, localInertiaDiagonal=[data["inertia"]] * 3, linearDamping=0, angularDamping=0
        )
        bodies.append(body)
    state, steps = [0], 0
    limit = int(60 / data["step_s"])
    at_rest = False
    while steps < limit and not at_rest:
        bullet.stepSimulation()
        steps += 1
        velocities = [bullet.getBaseVelocity(b) for b in bodies]
        at_rest = settled([math.hypot(*v) + math.hypot(*w) * data["reach_m"] for v, w in velocities], state, data)
    rest = [bullet.getBasePositionAndOrientation(b)[0] for b in bodies]
    bullet.disconnect()
    return time.process_time() - begun, at_rest, steps * data["step_s"], rest


def summary(name, data, results):
    heights = [statistics.mean(p[2] for p in r[3]) for r in results]
    area = (2 * data["half_pen_m"]) ** 2
    # A pile of even density and thickness H has its centres at H/2 on average.
    porosity = [1 - len(r[3]) * data["volume_m3"] / (area * 2 * h) for r, h in zip(results, heights)]
    spread = statistics.stdev(heights) if len(heights) > 1 else 0.0
    error = spread / math.sqrt(len(heights))
    seconds = statistics.median(r[0] for r in results)
    print(
        f"| {name} | {len(results)} | {seconds:.3f} | {sum(r[1] for r in results)} | "
        f"{statistics.median(r[2] for r in results):.1f} | {statistics.mean(heights):.3f} ± {error:.3f} | "
        f"{statistics.mean(porosity):.3f} |"
    )
    return heights


def main():
    data = json.load(open(sys.argv[1]))
    count = int(sys.argv[2]) if len(sys.argv) > 2 else len(data["runs"])
    runs = data["runs"]
    print("| engine | seeds | median CPU s | came to rest | simulated s | mean height of centres m | porosity |")
    print("|---|---|---|---|---|---|---|")
    ours = summary("tsumu", data, [(r["cpu_s"], r["at_rest"], r["time_s"], r["rest"]) for r in runs])
    theirs = summary("PyBullet", data, [drop_pybullet(data, r) for r in runs[:count]])
    if len(sys.argv) > 3:
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        figure, axis = plt.subplots(figsize=(6, 3.5))
        for k, (values, name) in enumerate([(ours, "tsumu"), (theirs, "PyBullet")]):
            axis.plot([k + 0.01 * i - 0.1 for i in range(len(values))], values, "o", alpha=0.6, label=name)
            axis.plot([k - 0.3, k + 0.3], [statistics.mean(values)] * 2, "k-")
        axis.set(xticks=[0, 1], xticklabels=["tsumu", "PyBullet"], ylabel="mean height of block centres, m")
        figure.tight_layout()
        figure.savefig(sys.argv[3], dpi=90)


main()
