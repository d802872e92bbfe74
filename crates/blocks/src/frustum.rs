//! Square frustums: the cube and the Antifer cube.

use geom::{TriMesh, Vec3};
use scene::ConvexPart;

/// A square frustum of the given height and edges, its middle height at the origin.
pub fn square_frustum(height_m: f32, bottom_m: f32, top_m: f32) -> (TriMesh, Vec<ConvexPart>) {
    let ring = |edge: f32, z: f32| {
        let h = edge / 2.0;
        [Vec3::new(-h, -h, z), Vec3::new(h, -h, z), Vec3::new(h, h, z), Vec3::new(-h, h, z)]
    };
    let mut vertices = ring(bottom_m, -height_m / 2.0).to_vec();
    vertices.extend(ring(top_m, height_m / 2.0));
    let quads =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let parts = vec![ConvexPart { corners: vertices.clone() }];
    (TriMesh { vertices, triangles }, parts)
}
