//! Wavefront OBJ: vertices and faces alone. `mtllib` and every other line that names a file are passed over unread.

use crate::input::Input;
use crate::mesh::RawMesh;
use crate::{IoError, Place, atomic};
use geom::{DVec3, TriMesh};
use std::path::Path;

/// Vertices and triangulated faces.
pub(crate) fn read(input: &mut Input) -> Result<RawMesh, IoError> {
    let (mut mesh, mut buffer, mut line) = (RawMesh::default(), Vec::new(), 1);
    while input.line(&mut buffer, line, 1 << 20)? {
        let text = String::from_utf8_lossy(&buffer);
        let mut words = text.split_whitespace();
        let at = Place::Line(line);
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).collect();
                let [x, y, z] = numbers[..] else {
                    return Err(input.malformed(at, "`v` needs three numbers"));
                };
                if ![x, y, z].iter().all(|v| v.is_finite()) {
                    return Err(IoError::NotFinite { path: input.path.into(), at, x, y, z });
                }
                mesh.vertices.push(DVec3::new(x, y, z));
            }
            Some("f") => {
                let mut polygon = Vec::new();
                for word in words {
                    let index = corner(word, mesh.vertices.len());
                    let what = || format!("face corner `{word}` names no vertex above this line");
                    polygon.push(index.ok_or_else(|| input.malformed(at, what()))?);
                }
                if polygon.len() < 3 {
                    return Err(input.malformed(at, "a face needs at least three corners"));
                }
                mesh.push_polygon(&polygon);
            }
            _ => {}
        }
        line += 1;
    }
    Ok(mesh)
}

/// `7`, `7/1`, `7//2`, `-1`: from 1, or counted back from the last vertex.
fn corner(word: &str, vertices: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number < 0 { vertices as i64 + number } else { number - 1 };
    (index >= 0 && index < vertices as i64).then_some(index as u32)
}

/// Vertices and triangles as text, shortest digits that read back exactly.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<(), IoError> {
    atomic::write(path, |out| {
        writeln!(out, "# made by tsumu")?;
        for v in &mesh.vertices {
            writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
        }
        for [a, b, c] in &mesh.triangles {
            writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1)?;
        }
        Ok(())
    })
}
