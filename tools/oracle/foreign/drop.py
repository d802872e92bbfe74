"""Blocks dropped by PyBullet until they rest: poses of each; and the fixed bodies they fall on."""

import os
import tempfile

import numpy as np
import pybullet as bullet
import trimesh
from scipy.spatial.transform import Rotation


def collision_shape(parts, client):
    """A compound of convex hulls: Bullet makes one hull of every object of an OBJ file."""
    with tempfile.NamedTemporaryFile("w", suffix=".obj", delete=False) as f:
        offset = 1
        for i, corners in enumerate(parts):
            hull = trimesh.convex.convex_hull(np.asarray(corners))
            f.write(f"o part{i}\n")
            f.writelines(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in hull.vertices)
            f.writelines(f"f {a} {b} {c}\n" for a, b, c in hull.faces + offset)
            offset += len(hull.vertices)
    shape = bullet.createCollisionShape(bullet.GEOM_MESH, fileName=f.name, physicsClientId=client)
    os.unlink(f.name)
    return shape


def fixed_mesh(mesh, client):
    shape = bullet.createCollisionShape(
        bullet.GEOM_MESH,
        vertices=mesh.vertices.tolist(),
        indices=mesh.faces.ravel().tolist(),
        flags=bullet.GEOM_FORCE_CONCAVE_TRIMESH,
        physicsClientId=client,
    )
    return bullet.createMultiBody(0, shape, physicsClientId=client)


def pen(low, high, height, client):
    """Four walls that no sensor sees."""
    t = 1.0
    (x0, y0), (x1, y1) = low, high
    for cx, cy, hx, hy in [
        (x0 - t, (y0 + y1) / 2, t, y1 - y0),
        (x1 + t, (y0 + y1) / 2, t, y1 - y0),
        ((x0 + x1) / 2, y0 - t, x1 - x0, t),
        ((x0 + x1) / 2, y1 + t, x1 - x0, t),
    ]:
        box = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[hx, hy, height], physicsClientId=client)
        bullet.createMultiBody(0, box, basePosition=[cx, cy, 0], physicsClientId=client)


def drop(bodies, fixed, rng, low, high, most_s=14.0):
    """Poses (Rotation, position) of the bodies, each a list of convex parts and a reach in metres, dropped layer by layer."""
    client = bullet.connect(bullet.DIRECT)
    bullet.setGravity(0, 0, -9.81, physicsClientId=client)
    bullet.setPhysicsEngineParameter(fixedTimeStep=1 / 120, numSolverIterations=40, physicsClientId=client)
    for mesh in fixed:
        fixed_mesh(mesh, client)
    pen(low, high, 40.0, client)
    reach = max(r for _, r in bodies)
    places = [
        (x, y)
        for x in np.arange(low[0] + reach, high[0] - reach + 1e-6, 2.05 * reach)
        for y in np.arange(low[1] + reach, high[1] - reach + 1e-6, 2.05 * reach)
    ]
    ground = max([m.bounds[1][2] for m in fixed], default=0.0)
    shapes, handles = {}, []
    for start in range(0, len(bodies), len(places)):
        layer = bodies[start : start + len(places)]
        top = max([bullet.getAABB(h, physicsClientId=client)[1][2] for h in handles], default=ground)
        order = rng.permutation(len(places))
        for (parts, _), k in zip(layer, order):
            key = id(parts)
            if key not in shapes:
                shapes[key] = collision_shape(parts, client)
            x, y = np.array(places[k]) + rng.uniform(-0.02, 0.02, 2) * reach
            h = bullet.createMultiBody(
                2000.0, shapes[key], basePosition=[x, y, top + 1.1 * reach],
                baseOrientation=Rotation.random(random_state=rng).as_quat().tolist(), physicsClientId=client,
            )
            bullet.changeDynamics(
                h, -1, lateralFriction=0.8, rollingFriction=0.01, spinningFriction=0.02, restitution=0.0,
                collisionMargin=0.002, linearDamping=0.08, angularDamping=0.1, physicsClientId=client,
            )
            handles.append(h)
        settle(handles, client, most_s if start + len(places) >= len(bodies) else 2.0)
    poses = []
    for h in handles:
        at, q = bullet.getBasePositionAndOrientation(h, physicsClientId=client)
        poses.append((Rotation.from_quat(q), np.array(at)))
    bullet.disconnect(client)
    return poses


def settle(handles, client, most_s):
    for step in range(int(most_s * 120)):
        bullet.stepSimulation(physicsClientId=client)
        if step > 120 and step % 30 == 0:
            speed = max(np.linalg.norm(bullet.getBaseVelocity(h, physicsClientId=client)[0]) for h in handles)
            if speed < 0.02:
                return
