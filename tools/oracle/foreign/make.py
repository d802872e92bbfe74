"""One scene of a condition: what lies where, what a sensor sees of it, what is handed over."""

import json

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from . import deliver, drop, ground, scan, shapes

MODEL_SAMPLES = 1500


def rng_of(condition, seed):
    """The same condition and seed give the same scene; conditions of one physical pile do not share it."""
    return np.random.default_rng([seed, int.from_bytes(condition.name.encode(), "big") % (2**32)])


def placed(shape, at):
    rotation, t = at
    mesh = shape.surface.copy()
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = rotation.as_matrix(), t
    mesh.apply_transform(m)
    return mesh


def in_rows(c, shape, rng):
    """Cubes side by side in a square field, joints and heights a little uneven as a crane leaves them."""
    edge, n = shape.d_box, int(round(np.sqrt(c.count)))
    poses = []
    for i in range(n):
        for j in range(n):
            turn = Rotation.from_euler("zyx", rng.normal(size=3) * [0.25, 0.12, 0.12], degrees=True)
            jitter = rng.uniform(-0.2, 0.2, 2) * c.rows_joint
            at = [i * (edge + c.rows_joint) + jitter[0], j * (edge + c.rows_joint) + jitter[1], edge / 2 + rng.normal() * 0.004]
            poses.append((turn, np.array(at)))
    return poses, []


def fixed_bodies(c, shape, rng, side):
    """Meshes that neither move nor count: the bed, structures; each with whether the sensor's points of it are handed over."""
    low, high = (-1.5 * shape.d_box,) * 2, (side + 1.5 * shape.d_box,) * 2
    slope = 1 / 1.5 if c.bed.startswith("slope") else 0.0
    toe = side * 0.35 if c.bed == "slope-toe" else None
    if c.bed == "none":
        fixed = [(ground.grid(low, high, 1.0, lambda x, y: 0.0 * x), False)]
    else:
        bed = ground.rubble(rng, low, high, 0.22 * shape.d_box, slope, toe)
        fixed = [(bed, not c.bed_hidden)]
    if c.structure == "wall":
        fixed.append((ground.box((low[0], side - 0.4, -1), (high[0], side + 1.2, 1.6 * shape.d_box)), True))
    return fixed, low, high


def stated_sand(c, shape, low, high, side):
    """Sand over the lowest layer: level, or a wedge that ends up the slope."""
    if not c.sand_blocks:
        return []
    level = c.sand_blocks * shape.d_box
    wave = lambda x, y: 0.02 * np.sin(1.3 * x + 0.4 * y)
    return [ground.grid(low, high, 0.25, lambda x, y: level + wave(x, y))]


def pile(c, shape, rng):
    """Poses of the blocks, which are broken (leg, or -1), other meshes with (mesh, handed over)."""
    if c.rows_joint:
        poses, other = in_rows(c, shape, rng)
        return poses, [-1] * len(poses), other
    side = c.side_blocks * shape.d_box
    fixed, low, high = fixed_bodies(c, shape, rng, side)
    broken = [int(rng.integers(4)) if rng.random() < c.broken_share else -1 for _ in range(c.count)]
    cut = {k: shapes.tetrapod(shape.d_box_height, cut_leg=k) for k in set(broken) - {-1}}
    bodies = [((shape if k < 0 else cut[k]).parts, shape.d_max) for k in broken]
    stones = [ground.lump(rng, c.stone_blocks * shape.d_box) for _ in range(c.stones)]
    mixed = bodies + [([s], shape.d_max) for s in stones]
    order = rng.permutation(len(mixed))
    got = drop.drop([mixed[i] for i in order], [m for m, _ in fixed], rng, (0, 0), (side, side))
    poses = [None] * len(mixed)
    for i, at in zip(order, got):
        poses[i] = at
    other = list(fixed) + [(m, True) for m in stated_sand(c, shape, low, high, side)]
    for corners, (rotation, t) in zip(stones, poses[len(bodies) :]):
        other.append((trimesh.convex.convex_hull(rotation.apply(corners) + t), True))
    if c.structure == "deck":
        top = max(t[2] for _, t in poses)
        other.append((ground.box((0, side * 0.4, top + 0.9), (side, side * 0.6, top + 1.3)), True))
    return poses[: len(bodies)], broken, other


def without_blocks(c, shape, rng):
    """Meshes of a scene that holds none."""
    side = c.side_blocks * shape.d_box
    if c.nothing == "rocks":
        lumps = [ground.lump(rng, shape.d_box * rng.uniform(0.4, 1.3)) for _ in range(70)]
        bodies = [([p], float(np.linalg.norm(p, axis=1).max())) for p in lumps]
        floor = ground.rubble(rng, (-2, -2), (side + 2, side + 2), 0.3)
        got = drop.drop(bodies, [floor], rng, (0, 0), (side * 0.7, side * 0.7), most_s=6.0)
        return [floor] + [trimesh.convex.convex_hull(r.apply(p) + t) for p, (r, t) in zip(lumps, got)]
    return {"terrain": ground.terrain, "trees": ground.trees, "stairs": ground.stairs, "water": ground.water}[c.nothing](rng, side)


def handed_over(c, p, label, rng):
    """The survey as delivered: points in metres and labels."""
    if c.smooth:
        p = deliver.smoothed(p, c.smooth)
    p = deliver.noisy(p, c.noise, rng)
    if c.drift:
        p = deliver.drifted(p, c.drift, rng)
    for keep in (
        lambda: deliver.uneven(p, c.uneven, rng) if c.uneven > 1 else None,
        lambda: deliver.holes(p, c.holes, 0.45, rng) if c.holes else None,
        lambda: deliver.cropped(p, c.crop) if c.crop < 1 else None,
    ):
        index = keep()
        if index is not None:
            p, label = p[index], label[index]
    if c.duplicates:
        again = deliver.thinned(len(p), c.duplicates, rng)
        p, label = np.vstack([p, p[again]]), np.append(label, label[again])
    if c.cell:
        p, label = deliver.gridded(p, label, c.cell, c.rule)
    return p, label


def seen_share(c, world, meshes, scanned, rng, delivered):
    """Share of each block's surface that the sensor sees and that was handed over."""
    _, _, eyes, directions = scanned
    shares = []
    holes_matter = c.crop < 1 or c.holes
    from scipy.spatial import cKDTree

    tree = cKDTree(delivered) if holes_matter else None
    for mesh in meshes:
        p, face = trimesh.sample.sample_surface(mesh, MODEL_SAMPLES, seed=int(rng.integers(2**31)))
        seen = world.sees(p, mesh.face_normals[face], eyes, directions)
        if tree is not None:
            reach = 4 / np.sqrt(c.density)
            seen[seen] = tree.query(p[seen], distance_upper_bound=reach)[0] < np.inf
        shares.append(seen.mean())
    return shares


def scene(c, seed):
    """Everything of one scene as a dictionary of arrays and texts."""
    rng = rng_of(c, seed)
    shape = shapes.by_name(c.shape)
    shape.d_box_height = {"tetrapod": 2.0}.get(c.shape, shape.d_box)
    if c.nothing:
        poses, broken, meshes = [], [], []
        other = [(m, True) for m in without_blocks(c, shape, rng)]
    else:
        poses, broken, other = pile(c, shape, rng)
        whole = [shape if k < 0 else shapes.tetrapod(shape.d_box_height, cut_leg=k) for k in broken]
        meshes = [placed(s, at) for s, at in zip(whole, poses)]
    world = scan.World([(m, i + 1) for i, m in enumerate(meshes)] + [(m, 0 if keep else -1) for m, keep in other])
    scanned = scan.scan(world, c.sensor, c.density, rng)
    p, label = scanned[0], scanned[1]
    inside = (label >= 0) & in_plan(p, meshes or [m for m, _ in other])
    p, label = handed_over(c, p[inside], label[inside], rng)
    intact = [placed(shape, at) for at in poses]
    shares = seen_share(c, world, intact, scanned, rng, p)
    return {
        "shape": shape, "points": p, "label": label, "poses": poses, "broken": broken,
        "occlusion": [1 - s for s in shares], "eyes": scanned[2], "shares": shares,
    }


def in_plan(p, meshes):
    """Points within a metre of the pile's plan rectangle."""
    low = np.min([m.bounds[0] for m in meshes], axis=0) - 1.0
    high = np.max([m.bounds[1] for m in meshes], axis=0) + 1.0
    return ((p[:, :2] > low[:2]) & (p[:, :2] < high[:2])).all(1)


def catalogue_of(c, shape):
    """The catalogue the recogniser gets: text, and meshes to write beside it."""
    size = {"tetrapod": 2.0, "dolos": 2.2, "cube": 1.6, "hook": 1.8}[c.catalogue_shape or c.shape] * c.catalogue_scale
    given = shapes.by_name(c.catalogue_shape or c.shape, size)
    files, entry = {}, given.entry
    if c.catalogue_legs != 1.0:
        given = shapes.tetrapod(size, leg_scale=c.catalogue_legs)
        files["blunt.stl"], entry = given.surface, 'mesh = "blunt.stl"\nunit = "m"'
    elif given.name == "hook":
        files["hook.stl"] = shapes.hook(size, c.catalogue_mirrored).surface
    return f'[[block]]\nname = "{given.name}"\n{entry}\n', files, given


def write(c, seed, folder):
    """Makes the scene and writes its folder; whole or not at all."""
    got = scene(c, seed)
    shape = got["shape"]
    part = folder.with_name(folder.name + ".part")
    part.mkdir(parents=True, exist_ok=True)
    text, files, given = catalogue_of(c, shape)
    (part / "catalog.toml").write_text(text)
    for name, mesh in files.items():
        mesh.export(part / name)
    unit = c.unit_per_m
    rows = ["block_id,model,x_m,y_m,z_m,qw,qx,qy,qz,occlusion"]
    name = given.name if not c.catalogue_shape else shape.name
    for i, ((rotation, t), occlusion) in enumerate(zip(got["poses"], got["occlusion"])):
        x, y, z, w = rotation.as_quat()
        values = [*(t * unit), w, x, y, z, occlusion]
        rows.append(f"{i + 1},{name}," + ",".join(f"{v:.6f}" for v in values))
    (part / "truth.csv").write_text("\n".join(rows) + "\n")
    if any(k >= 0 for k in got["broken"]):
        lines = [f"{i + 1},{k}" for i, k in enumerate(got["broken"]) if k >= 0]
        (part / "broken.csv").write_text("block_id,leg\n" + "\n".join(lines) + "\n")
    write_ply(part / "cloud.ply", got["points"] * unit, np.maximum(got["label"], 0))
    facts = {
        "condition": c.name, "group": c.group, "seed": seed, "shape": shape.name, "blocks": len(got["poses"]),
        "points": len(got["points"]), "sensor": c.sensor, "expect": c.expect, "catalogue": given.name,
        "sensor_positions": [list(map(float, e)) for e in got["eyes"]] if c.tell_sensor else [],
        "group_xyzw": shape.group.as_quat().round(7).tolist(), "d_box_m": shape.d_box * unit,
        "noise_sd_m": c.noise, "cell_m": c.cell, "rule": c.rule,
    }
    (part / "scene.json").write_text(json.dumps(facts, indent=1) + "\n")
    part.rename(folder)
    return facts


def write_ply(path, p, label):
    data = np.empty(len(p), [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("instance", "<u4")])
    data["x"], data["y"], data["z"], data["instance"] = p[:, 0], p[:, 1], p[:, 2], label
    head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(p)
    head += "property double x\nproperty double y\nproperty double z\nproperty uint instance\nend_header\n"
    path.write_bytes(head.encode() + data.tobytes())
