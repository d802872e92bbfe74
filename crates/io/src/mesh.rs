//! Triangle meshes from STL, OBJ and PLY, by extension, in the file's own unit.

use crate::input::Input;
use crate::{IoError, obj, ply, stl};
use geom::TriMesh;
use std::path::Path;

/// Reads a mesh as it is: nothing welded, closed or scaled. Indices are checked, the rest is the caller's.
pub fn read(path: &Path) -> Result<TriMesh, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "stl" | "obj" | "ply") {
        return Err(IoError::UnknownExtension { path: path.into(), known: ".stl, .obj, .ply" });
    }
    read_as(&mut Input::open(path)?, &kind)
}

/// Reads a mesh of a known kind: `stl`, `obj` or `ply`.
pub fn read_as(input: &mut Input, kind: &str) -> Result<TriMesh, IoError> {
    let mesh = match kind {
        "stl" => stl::read(input)?,
        "obj" => obj::read(input)?,
        _ => ply::read_mesh(input)?,
    };
    let count = mesh.vertices.len();
    if mesh.triangles.is_empty() {
        return Err(input.malformed(crate::Place::File, "the mesh has no triangles"));
    }
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(v) = triangle.iter().find(|&&v| v as usize >= count) {
            let what = format!("a triangle names vertex {v}, but there are only {count}");
            return Err(input.malformed(crate::Place::Record(i as u64 + 1), what));
        }
    }
    Ok(mesh)
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

/// A polygon as a fan of triangles.
pub(crate) fn push_polygon(mesh: &mut TriMesh, polygon: &[u32]) {
    for i in 2..polygon.len() {
        mesh.triangles.push([polygon[0], polygon[i - 1], polygon[i]]);
    }
}
