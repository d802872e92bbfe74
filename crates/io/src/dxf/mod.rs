//! DXF: results out; design surfaces and alignments in, from what model space shows.

mod entities;
mod groups;
mod meshes;
mod polylines;
mod sections;
mod surface;
mod write;

pub(crate) use polylines::arc;
pub use polylines::{DrawnLine, read_polylines};
pub use surface::{DxfSurface, read_faces, read_surface};
pub use write::{text, write, write_with};

use geom::DVec3;

/// The format's arbitrary-axis rule: x and y axes for an extrusion direction.
fn arbitrary_axes(normal: DVec3) -> [DVec3; 2] {
    let near_z = normal.x.abs() < 1.0 / 64.0 && normal.y.abs() < 1.0 / 64.0;
    let x = if near_z { DVec3::Y.cross(normal) } else { DVec3::Z.cross(normal) }.normalize();
    [x, normal.cross(x).normalize()]
}
