//! Triangle meshes from STL, OBJ and PLY, by extension, in the file's own unit. Read in f64; a mesh far from its origin is
//! moved there, so that f32 holds its shape.

use crate::input::Input;
use crate::{IoError, Place, obj, ply, polygon, stl};
use geom::{DVec3, TriMesh};
use std::path::Path;

/// Vertices and triangles as the file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RawMesh {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// The file stores 32-bit floats.
    pub float32: bool,
}

impl RawMesh {
    /// A polygon as triangles, concave ones too. Corners that name no vertex are left to the check of indices.
    pub fn push_polygon(&mut self, polygon: &[u32]) {
        let outline: Option<Vec<DVec3>> =
            polygon.iter().map(|&i| self.vertices.get(i as usize).copied()).collect();
        match outline {
            Some(outline) => {
                let cut = polygon::triangles(&outline);
                self.triangles.extend(cut.iter().map(|t| t.map(|k| polygon[k])));
            }
            None => {
                let fan = (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]]);
                self.triangles.extend(fan);
            }
        }
    }
}

/// A mesh, and what had to be done to it.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshRead {
    /// The mesh in the file's unit.
    pub mesh: TriMesh,
    /// Subtracted from every vertex: the middle of a mesh that lies far from its origin, else zero.
    pub moved_by: DVec3,
}

/// A mesh further from its origin than this many of its own sizes is moved.
const FAR: f64 = 50.0;
/// 32-bit floats may cost this share of a mesh's size.
const MOST_ROUNDING: f64 = 5e-4;

/// Reads a mesh: nothing welded, closed or scaled. Indices are checked, the rest is the caller's.
pub fn read(path: &Path) -> Result<TriMesh, IoError> {
    read_moved(path).map(|r| r.mesh)
}

/// The same, with the place it was moved from.
pub fn read_moved(path: &Path) -> Result<MeshRead, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "stl" | "obj" | "ply") {
        return Err(IoError::UnknownExtension { path: path.into(), known: ".stl, .obj, .ply" });
    }
    read_moved_as(&mut Input::open(path)?, &kind)
}

/// Reads a mesh of a known kind: `stl`, `obj` or `ply`.
pub fn read_as(input: &mut Input, kind: &str) -> Result<TriMesh, IoError> {
    read_moved_as(input, kind).map(|r| r.mesh)
}

/// The same, with the place it was moved from.
pub fn read_moved_as(input: &mut Input, kind: &str) -> Result<MeshRead, IoError> {
    let raw = match kind {
        "stl" => stl::read(input)?,
        "obj" => obj::read(input)?,
        _ => ply::read_mesh(input)?,
    };
    let count = raw.vertices.len();
    if raw.triangles.is_empty() {
        return Err(input.malformed(Place::File, "the mesh has no triangles"));
    }
    for (i, triangle) in raw.triangles.iter().enumerate() {
        if let Some(v) = triangle.iter().find(|&&v| v as usize >= count) {
            let what = format!("a triangle names vertex {v}, but there are only {count}");
            return Err(input.malformed(Place::Record(i as u64 + 1), what));
        }
    }
    near_origin(input, raw)
}

/// The mesh in f32, moved to its origin when it lies far from it; refuses one that 32-bit floats have already rounded away.
fn near_origin(input: &Input, raw: RawMesh) -> Result<MeshRead, IoError> {
    let all = raw
        .vertices
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)]);
    let size = (all[1] - all[0]).max_element();
    let largest = all[0].abs().max(all[1].abs()).max_element();
    let far = size > 0.0 && largest > FAR * size;
    let spacing = f64::from((largest as f32).next_up() - largest as f32);
    if raw.float32 && far && spacing > MOST_ROUNDING * size {
        let what = format!(
            "the mesh lies {largest:.0} units from its origin, where the file's 32-bit floats are {spacing:.4} apart; move it to the origin and export it again, or export OBJ or PLY with double coordinates"
        );
        return Err(input.malformed(Place::File, what));
    }
    let moved_by = if far { ((all[0] + all[1]) / 2.0).round() } else { DVec3::ZERO };
    let vertices = raw.vertices.iter().map(|p| (*p - moved_by).as_vec3()).collect();
    let mesh = TriMesh { vertices, triangles: raw.triangles };
    Ok(MeshRead { mesh, moved_by })
}

/// Writes `.stl` (binary), `.obj` or `.ply`.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<(), IoError> {
    match extension(path).as_str() {
        "stl" => stl::write(path, mesh),
        "obj" => obj::write(path, mesh),
        "ply" => ply::write_mesh(path, mesh),
        _ => Err(IoError::UnknownExtension { path: path.into(), known: ".stl, .obj, .ply" }),
    }
}

/// Lower-case extension without the dot; empty when there is none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
