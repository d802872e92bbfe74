#!/usr/bin/env python3
"""A ROS 2 node: PointCloud2 of a bin in, vision_msgs/Detection3DArray out, the part to take first at the front.

    ros2 run … or: python3 ros2_bin_node.py --ros-args -p catalog:=catalog.toml -p cloud:=/camera/points

Weights and types stay ready between clouds. What is computed (`xyz_of`, `detections`) knows no ROS and is tested without it; only
`main` needs rclpy, sensor_msgs and vision_msgs. The cloud's frame has z up (a camera that looks down: transform it first, e.g. with tf2).
"""

from __future__ import annotations

from typing import Any

import numpy as np

import tsumu

#: Number formats of sensor_msgs/PointField.
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def xyz_of(cloud: Any) -> np.ndarray[Any, Any]:
    """The finite points of a sensor_msgs/PointCloud2 (or anything with its fields) as (N, 3) float64."""
    order = ">" if cloud.is_bigendian else "<"
    fields = {field.name: (order + DATATYPES[field.datatype], field.offset) for field in cloud.fields}
    missing = [axis for axis in "xyz" if axis not in fields]
    if missing:
        raise tsumu.BadInput(f"the cloud has no field {', '.join(missing)}, only {', '.join(fields)}")
    layout = np.dtype(
        {
            "names": list("xyz"),
            "formats": [fields[axis][0] for axis in "xyz"],
            "offsets": [fields[axis][1] for axis in "xyz"],
            "itemsize": cloud.point_step,
        }
    )
    rows = np.frombuffer(cloud.data, dtype="u1").reshape(cloud.height, cloud.row_step)
    packed = np.ascontiguousarray(rows[:, : cloud.width * cloud.point_step])
    points = packed.reshape(-1).view(layout)
    xyz = np.column_stack([points[axis].astype("f8") for axis in "xyz"])
    return xyz[np.isfinite(xyz).all(axis=1)]


def detections(look: tsumu.BinLook, catalog: tsumu.Catalog, header: dict[str, Any]) -> dict[str, Any]:
    """A vision_msgs/Detection3DArray as nested dicts, for `rosidl_runtime_py.set_message_fields`."""
    return {"header": header, "detections": [detection(grasp, catalog, header) for grasp in look]}


def detection(grasp: tsumu.Grasp, catalog: tsumu.Catalog, header: dict[str, Any]) -> dict[str, Any]:
    """One vision_msgs/Detection3D: the pose of the part's own coordinates as hypothesis, its box around the mesh."""
    corners, _ = catalog.surface(grasp.type)
    low, high = corners.min(axis=0).astype("f8"), corners.max(axis=0).astype("f8")
    turn = dict(zip("xyzw", map(float, grasp.quaternion), strict=True))
    middle = grasp.pose @ np.array([*(low + high) / 2, 1.0])
    return {
        "header": header,
        "id": str(grasp.id),
        "results": [
            {
                "hypothesis": {"class_id": grasp.type, "score": grasp.confidence},
                "pose": {"pose": {"position": vector(grasp.pose[:3, 3]), "orientation": turn}},
            }
        ],
        "bbox": {"center": {"position": vector(middle[:3]), "orientation": turn}, "size": vector(high - low)},
    }


def vector(values: Any) -> dict[str, float]:
    """x, y, z by name."""
    x, y, z = map(float, values)
    return {"x": x, "y": y, "z": z}


def main() -> None:
    """The node."""
    import rclpy
    from rclpy.node import Node
    from rosidl_runtime_py import set_message_fields
    from sensor_msgs.msg import PointCloud2
    from vision_msgs.msg import Detection3DArray

    class BinNode(Node):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__("tsumu_bin")
            catalog = self.declare_parameter("catalog", "catalog.toml").value
            topic = self.declare_parameter("cloud", "/camera/points").value
            self.bin = tsumu.Bin(catalog)
            self.out = self.create_publisher(Detection3DArray, "~/parts", 1)
            self.create_subscription(PointCloud2, topic, self.look, 1)
            self.get_logger().info(f"ready: {self.bin.catalog}, {topic}")

        def look(self, cloud: Any) -> None:
            try:
                look = self.bin.look(xyz_of(cloud))
            except tsumu.BadInput as error:
                self.get_logger().warning(str(error))
                return
            stamp = {"sec": cloud.header.stamp.sec, "nanosec": cloud.header.stamp.nanosec}
            header = {"stamp": stamp, "frame_id": cloud.header.frame_id}
            message = Detection3DArray()
            set_message_fields(message, detections(look, self.bin.catalog, header))
            self.out.publish(message)

    rclpy.init()
    node = BinNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.bin.close()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
