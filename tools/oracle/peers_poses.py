"""OpenCV's PPF + ICP and Open3D's FPFH-RANSAC + ICP on the very segments Tsumu gets, one thread each, in one run.

    cargo build --release --workspace --example bench_poses
    python3 tools/oracle/peers_poses.py target/release/examples/bench_poses [SHAPE NOISE_M DENSITY]

Needs numpy, open3d, opencv-contrib-python-headless. Success: displacement <= 0.1 d_box, rotation <= 5 degrees modulo
symmetry, blocks hidden to less than 80 %. Times are processor times. Nobody's preparation of the model counts. Tsumu's time
is that of its whole stage, normals and verification of the scene included; the others' leave out the normals.
"""

import json
import os
import subprocess
import sys
import tempfile
import time

for key in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[key] = "1"
import cv2
import numpy as np
import open3d as o3d

cv2.setNumThreads(1)


def rotation(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix(pose):
    m = np.eye(4)
    m[:3, :3] = rotation(pose["xyzw"])
    m[:3, 3] = pose["t"]
    return m


class Scene:
    def __init__(self, data):
        self.centre = np.array(data["centre"] + [1.0])
        self.group = [rotation(q) for q in data["rotations"]]
        self.d_box, self.d_max = data["d_box_m"], data["d_max_m"]
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(data["vertices"]), o3d.utility.Vector3iVector(data["triangles"])
        )
        o3d.utility.random.seed(1)
        self.model = mesh.sample_points_uniformly(4000, use_triangle_normal=True)
        sensor = data["sensor"][0] if data["sensor"] else [0.0, 0.0, 40.0]
        self.segments = []
        for s in data["segments"]:
            cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(s["points"]))
            cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
            cloud.orient_normals_towards_camera_location(np.array(sensor, dtype=float))
            if s["occlusion"] < 0.8 and len(s["points"]) >= 20:
                self.segments.append((cloud, matrix(s["truth"])))

    def right(self, found, truth):
        if np.linalg.norm((found @ self.centre - truth @ self.centre)[:3]) > 0.1 * self.d_box:
            return False
        angles = [
            np.arccos(np.clip((np.trace(found[:3, :3].T @ truth[:3, :3] @ g) - 1) / 2, -1, 1)) for g in self.group
        ]
        return np.degrees(min(angles)) <= 5.0


def opencv(scene):
    def rows(cloud):
        return np.hstack([np.asarray(cloud.points), np.asarray(cloud.normals)]).astype(np.float32)

    detector = cv2.ppf_match_3d_PPF3DDetector(0.08, 0.08, 30)
    model = rows(scene.model.voxel_down_sample(0.05 * scene.d_max))
    detector.trainModel(model)
    icp = cv2.ppf_match_3d_ICP(100, 0.005, 2.5, 6)

    def find(cloud):
        points = rows(cloud)
        best = detector.match(points, 1.0 / 5.0, 0.05)[:10]
        if len(best) == 0:
            return np.eye(4)
        _, refined = icp.registerModelToScene(model, points, list(best))
        return min(refined, key=lambda p: p.residual).pose

    return find


def open3d(scene):
    registration = o3d.pipelines.registration
    cell = 0.06 * scene.d_max
    search = o3d.geometry.KDTreeSearchParamHybrid(5 * cell, 100)
    model = scene.model.voxel_down_sample(cell)
    features = registration.compute_fpfh_feature(model, search)

    def find(cloud):
        down = cloud.voxel_down_sample(cell)
        own = registration.compute_fpfh_feature(down, search)
        coarse = registration.registration_ransac_based_on_feature_matching(
            down, model, own, features, True, 1.5 * cell, registration.TransformationEstimationPointToPoint(False), 3,
            [registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
             registration.CorrespondenceCheckerBasedOnDistance(1.5 * cell)],
            registration.RANSACConvergenceCriteria(100000, 0.999),
        )
        fine = registration.registration_icp(
            cloud, scene.model, 0.5 * cell, coarse.transformation, registration.TransformationEstimationPointToPlane()
        )
        return np.linalg.inv(fine.transformation)

    return find


def main():
    program = sys.argv[1]
    case = sys.argv[2:5] or ["tetrapod:2.0", "0.01", "900"]
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "scene.json")
        subprocess.run([program, *case, "1", "true"], env={**os.environ, "DUMP": file}, check=True)
        data = json.load(open(file))
    scene = Scene(data)
    stated = [matrix(p) for p in data["stated"]]
    right = sum(any(scene.right(s, truth) for s in stated) for _, truth in scene.segments)
    own_s = data["cpu_s"] / len(data["segments"])
    print(f"{len(scene.segments)} segments, {sum(len(c.points) for c, _ in scene.segments)} points")
    print(f"tsumu:  {right / len(scene.segments):.3f} right, {1e3 * own_s:.1f} ms a segment, whole stage without preparing the model")
    for name, make in [("opencv PPF + ICP", opencv), ("open3d FPFH-RANSAC + ICP", open3d)]:
        find = make(scene)
        start = time.process_time()
        right = sum(scene.right(find(cloud), truth) for cloud, truth in scene.segments)
        each = (time.process_time() - start) / len(scene.segments)
        print(f"{name}:  {right / len(scene.segments):.3f} right, {1e3 * each:.1f} ms a segment, {each / own_s:.1f} x")


if __name__ == "__main__":
    main()
