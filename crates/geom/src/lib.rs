//! Points, meshes, poses and their geometry.
//!
//! Lengths are metres, angles radians, everything f32 near a local origin. Nothing here knows what a
//! block is, reads a file or looks at a clock.

mod bounds;
mod cells;
mod cloud;
mod convex;
mod gaps;
mod height_map;
pub mod hidden_points;
mod hull_corners;
mod knn;
mod lattice;
mod mesh;
mod mesh_query;
mod normals;
mod observer;
mod plane;
mod point_grid;
mod raster;
mod roughness;
mod sdf;
mod seeds;
mod silhouette;
mod stage;
mod strays;
mod thinning;
mod union;
mod winding;

pub use bounds::Bounds;
pub use cloud::PointCloud;
pub use convex::{ConvexSolid, HalfSpace, union_volume_m3};
/// A rigid transform; `site_from_block * point` reads right to left.
pub use glamx::Pose3 as Pose;
pub use glamx::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Mat3, Quat, Vec2, Vec3};
pub use height_map::{CellRect, HeightMap};
pub use hull_corners::hull_corners;
pub use knn::{KnnTable, knn};
pub use lattice::{CellRule, Lattice, SurfacePoint};
pub use mesh::{MeshError, SolidMoments, TriMesh};
pub use mesh_query::{Hit, MeshQuery, Nearest};
pub use normals::{normals, smallest_direction};
pub use observer::{Event, Observer, PartState, Silent, Warning};
pub use plane::{Plane, find_plane, find_walls};
pub use point_grid::PointGrid;
pub use roughness::{RegionScatter, Scatter, scatter, scatter_about_patch_m};
pub use sdf::DistanceField;
pub use seeds::SeedTree;
pub use silhouette::silhouette;
pub use stage::{JobPart, Stage};
pub use strays::{Strays, strays};
pub use thinning::{Thinned, thin, thin_from_lowest};
pub use union::union;
pub use winding::{Sides, shells_in_each_other, winding_number};
