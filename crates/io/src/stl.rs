//! STL, ascii and binary. Which one is decided by the file's size, because some binary files start with `solid`.

use crate::input::Input;
use crate::{IoError, Place, atomic};
use geom::{TriMesh, Vec3};
use std::path::Path;

const HEADER: u64 = 84;
const RECORD: u64 = 50;

/// Every triangle with three vertices of its own, as the format has it.
pub fn read(input: &mut Input) -> Result<TriMesh, IoError> {
    let mut head = [0; HEADER as usize];
    if input.len < HEADER {
        return read_ascii(input);
    }
    input.fill(&mut head, "the header")?;
    let promised = u64::from(u32::from_le_bytes(head[80..84].try_into().expect("four bytes")));
    if HEADER + promised * RECORD == input.len || !head.trim_ascii_start().starts_with(b"solid") {
        return read_binary(input, promised);
    }
    input.go_to(0, "the first line")?;
    read_ascii(input)
}

fn read_binary(input: &mut Input, promised: u64) -> Result<TriMesh, IoError> {
    let at_most = (input.len - HEADER) / RECORD;
    if promised > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany { path, what: "triangles", promised, at_most, file_bytes });
    }
    let bytes = input.take(promised * RECORD, "the triangles")?;
    let mut mesh = TriMesh::default();
    mesh.vertices.reserve_exact(promised as usize * 3);
    for (i, record) in bytes.chunks_exact(RECORD as usize).enumerate() {
        let value = |k: usize| {
            f32::from_le_bytes(record[12 + 4 * k..16 + 4 * k].try_into().expect("four bytes"))
        };
        let corners = [0, 3, 6].map(|k| Vec3::new(value(k), value(k + 1), value(k + 2)));
        push(input, &mut mesh, corners, Place::Record(i as u64 + 1))?;
    }
    Ok(mesh)
}

fn read_ascii(input: &mut Input) -> Result<TriMesh, IoError> {
    let (mut mesh, mut corners, mut buffer, mut line) =
        (TriMesh::default(), Vec::new(), Vec::new(), 1);
    let mut started = false;
    while input.line(&mut buffer, line, 4096)? {
        let text = String::from_utf8_lossy(&buffer);
        let mut words = text.split_whitespace();
        let first = words.next().unwrap_or_default().to_ascii_lowercase();
        if !started && !first.is_empty() && first != "solid" {
            return Err(input.malformed(
                Place::Line(line),
                "this is neither a text STL (`solid …`) nor a whole binary one",
            ));
        }
        started |= first == "solid";
        if first == "vertex" {
            let numbers: Vec<f32> = words.map_while(|w| w.parse().ok()).collect();
            let [x, y, z] = numbers[..] else {
                return Err(input.malformed(Place::Line(line), "`vertex` needs three numbers"));
            };
            corners.push(Vec3::new(x, y, z));
        } else if first == "endloop" {
            let [a, b, c] = corners[..] else {
                let what = format!("a loop has {} corners instead of 3", corners.len());
                return Err(input.malformed(Place::Line(line), what));
            };
            push(input, &mut mesh, [a, b, c], Place::Line(line))?;
            corners.clear();
        }
        line += 1;
    }
    if corners.is_empty() {
        Ok(mesh)
    } else {
        Err(input.malformed(Place::Line(line), "the file ends inside a triangle"))
    }
}

fn push(input: &Input, mesh: &mut TriMesh, corners: [Vec3; 3], at: Place) -> Result<(), IoError> {
    if let Some(p) = corners.iter().find(|p| !p.is_finite()) {
        let (x, y, z) = (p.x.into(), p.y.into(), p.z.into());
        return Err(IoError::NotFinite { path: input.path.into(), at, x, y, z });
    }
    let n = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    mesh.triangles.push([n, n + 1, n + 2]);
    Ok(())
}

/// Binary STL.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<(), IoError> {
    atomic::write(path, |out| {
        let mut head = [b' '; 80];
        head[..12].copy_from_slice(b"made by tsum");
        head[12] = b'u';
        out.write_all(&head)?;
        out.write_all(&(mesh.triangles.len() as u32).to_le_bytes())?;
        for t in 0..mesh.triangles.len() {
            let normal = mesh.triangle_normal(t);
            for v in std::iter::once(normal).chain(mesh.corners(t)).flat_map(|v| v.to_array()) {
                out.write_all(&v.to_le_bytes())?;
            }
            out.write_all(&[0, 0])?;
        }
        Ok(())
    })
}
