//! Points, meshes, poses and their geometry.
//!
//! Lengths are metres, angles radians, everything f32 near a local origin. Nothing here knows what a
//! block is, reads a file or looks at a clock.

pub mod bounds;
pub mod cloud;
pub mod convex;
pub mod height_map;
pub mod hidden_points;
mod hull_corners;
pub mod knn;
pub mod mesh;
pub mod mesh_query;
pub mod normals;
pub mod observer;
pub mod plane;
pub mod point_grid;
mod raster;
pub mod sdf;
pub mod seeds;
mod silhouette;
pub mod union;
pub mod voxel;

pub use bounds::Bounds;
pub use cloud::PointCloud;
pub use convex::ConvexSolid;
/// A rigid transform; `site_from_block * point` reads right to left.
pub use glamx::Pose3 as Pose;
pub use glamx::{DMat3, DQuat, DVec2, DVec3, Mat3, Quat, Vec2, Vec3};
pub use height_map::{CellRect, HeightMap};
pub use knn::{KnnTable, knn};
pub use mesh::{MeshError, TriMesh};
pub use mesh_query::MeshQuery;
pub use normals::normals;
pub use observer::{Event, Observer, Silent, Warning};
pub use plane::{Plane, find_plane, find_walls};
pub use point_grid::PointGrid;
pub use sdf::DistanceField;
pub use seeds::SeedTree;
pub use union::union;
pub use silhouette::silhouette;
pub use voxel::{Thinned, thin};
