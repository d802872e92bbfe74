//! Fast questions to a mesh: rays, nearest points, inside or outside. The wall around parry's BVH.

use crate::{MeshError, TriMesh, Vec3};
use parry3d::query::{PointQuery, PointQueryWithLocation, Ray, RayCast};
use parry3d::shape::{TriMesh as ParryMesh, TriMeshFlags};

/// A mesh with a bounding-volume hierarchy.
pub struct MeshQuery {
    mesh: ParryMesh,
}

/// Where a ray first meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the unit direction, metres.
    pub distance_m: f32,
    /// Outward unit normal of the triangle.
    pub normal: Vec3,
    /// Index of the triangle.
    pub triangle: u32,
}

/// The surface point nearest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The point of the surface.
    pub point: Vec3,
    /// Distance to it, metres, negative when the place lies inside the solid.
    pub distance_m: f32,
    /// Its triangle.
    pub triangle: u32,
}

impl MeshQuery {
    /// Builds the hierarchy. Errors: [`MeshError::Empty`], [`MeshError::BadIndex`].
    pub fn new(mesh: &TriMesh) -> Result<Self, MeshError> {
        if mesh.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let count = mesh.vertices.len();
        for (triangle, t) in mesh.triangles.iter().enumerate() {
            if let Some(&vertex) = t.iter().find(|&&i| i as usize >= count) {
                return Err(MeshError::BadIndex { triangle, vertex, count });
            }
        }
        let flags = TriMeshFlags::ORIENTED;
        let mesh = ParryMesh::with_flags(mesh.vertices.clone(), mesh.triangles.clone(), flags)
            .or_else(|_| ParryMesh::new(mesh.vertices.clone(), mesh.triangles.clone()))
            .map_err(|_| MeshError::Empty)?;
        Ok(Self { mesh })
    }

    /// First hit of the ray within `max_m`; `direction` must be a unit vector.
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, max_m: f32) -> Option<Hit> {
        let hit =
            self.mesh.cast_local_ray_and_get_normal(&Ray::new(origin, direction), max_m, false)?;
        let triangle = hit.subshape;
        let normal = self.mesh.triangle(triangle).normal().unwrap_or(Vec3::ZERO);
        Some(Hit { distance_m: hit.time_of_impact, normal, triangle })
    }

    /// Nearest point of the surface and its triangle.
    pub fn nearest(&self, point: Vec3) -> (Vec3, u32) {
        let (projection, (triangle, _)) =
            self.mesh.project_local_point_and_get_location(point, false);
        (projection.point, triangle)
    }

    /// Nearest point of the surface with the signed distance to it; the sign needs a watertight mesh.
    pub fn nearest_signed(&self, point: Vec3) -> Nearest {
        let (projection, (triangle, _)) =
            self.mesh.project_local_point_and_get_location(point, false);
        let distance = (projection.point - point).length();
        let distance_m = if projection.is_inside { -distance } else { distance };
        Nearest { point: projection.point, distance_m, triangle }
    }

    /// Distance to the surface, negative inside; needs a watertight mesh.
    pub fn signed_distance_m(&self, point: Vec3) -> f32 {
        let projection = self.mesh.project_local_point(point, false);
        let distance = (projection.point - point).length();
        if projection.is_inside { -distance } else { distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> TriMesh {
        let vertices = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32))
            .collect();
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles =
            quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        TriMesh { vertices, triangles }
    }

    #[test]
    fn rays_and_distances_on_a_cube() {
        let mesh = cube();
        assert_eq!(mesh.check_solid(), Ok(()));
        assert!((mesh.moments().volume_m3 - 1.0).abs() < 1e-6);
        let query = MeshQuery::new(&mesh).unwrap();
        let hit = query.cast_ray(Vec3::new(0.3, 0.4, 5.0), Vec3::NEG_Z, 10.0).unwrap();
        assert!((hit.distance_m - 4.0).abs() < 1e-5);
        assert!((hit.normal - Vec3::Z).length() < 1e-5);
        assert!(query.cast_ray(Vec3::new(3.0, 0.4, 5.0), Vec3::NEG_Z, 10.0).is_none());
        assert!((query.signed_distance_m(Vec3::splat(0.5)) + 0.5).abs() < 1e-5);
        assert!((query.signed_distance_m(Vec3::new(0.5, 0.5, 3.0)) - 2.0).abs() < 1e-5);
    }
}
