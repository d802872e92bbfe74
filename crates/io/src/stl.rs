//! STL, ascii and binary. Which one is decided by size and content, because some binary files start with `solid`.

use crate::input::Input;
use crate::mesh::RawMesh;
use crate::{IoError, Place, atomic};
use geom::{DVec3, TriMesh};
use std::path::Path;

const HEADER: u64 = 84;
const RECORD: u64 = 50;

/// Every triangle with three vertices of its own, as the format has it.
pub(crate) fn read(input: &mut Input) -> Result<RawMesh, IoError> {
    let mut head = [0; HEADER as usize];
    if input.len < HEADER {
        return read_ascii(input);
    }
    input.fill(&mut head, "the header")?;
    let promised = u64::from(u32::from_le_bytes(head[80..84].try_into().expect("four bytes")));
    let body = input.len - HEADER;
    let first = head.trim_ascii_start().get(..5);
    let starts_solid = first.is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    if promised * RECORD == body || !starts_solid || !is_text(input, &head)? {
        return read_binary(input, triangles(promised, body));
    }
    input.go_to(0, "the first line")?;
    read_ascii(input)
}

/// Number of triangles: the header's, unless it is one of the two that writers leave who could not go back to fill it in.
fn triangles(promised: u64, body: u64) -> u64 {
    let unfilled = promised == 0 || promised == u64::from(u32::MAX);
    if unfilled && body > 0 && body.is_multiple_of(RECORD) { body / RECORD } else { promised }
}

/// Whether the first kilobyte is that of a text STL: printable, with a facet.
fn is_text(input: &mut Input, head: &[u8]) -> Result<bool, IoError> {
    let more = input.take((input.len - HEADER).min(1024), "the triangles")?;
    input.go_to(HEADER, "the triangles")?;
    let printable = |b: &u8| *b >= 0x20 || matches!(b, b'\t' | b'\n' | b'\r' | 0x0c);
    let text = [head, &more].concat();
    let facet = text.windows(5).any(|w| w.eq_ignore_ascii_case(b"facet"));
    let ends = text.windows(8).any(|w| w.eq_ignore_ascii_case(b"endsolid"));
    Ok(text.iter().all(printable) && (facet || ends))
}

fn read_binary(input: &mut Input, promised: u64) -> Result<RawMesh, IoError> {
    let at_most = (input.len - HEADER) / RECORD;
    if promised > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany { path, what: "triangles", promised, at_most, file_bytes });
    }
    // Some bytes behind the last triangle are a writer's own; room for another triangle is a wrong count.
    if promised > 0 && promised < at_most {
        let what = format!(
            "the header counts {promised} triangles, but the file has room for {at_most}; write it again with the program it came from"
        );
        return Err(input.malformed(Place::File, what));
    }
    let bytes = input.take(promised * RECORD, "the triangles")?;
    let mut mesh = RawMesh { float32: true, ..RawMesh::default() };
    mesh.vertices.reserve_exact(promised as usize * 3);
    for (i, record) in bytes.chunks_exact(RECORD as usize).enumerate() {
        let value = |k: usize| {
            let raw = record[12 + 4 * k..16 + 4 * k].try_into().expect("four bytes");
            f64::from(f32::from_le_bytes(raw))
        };
        let corners = [0, 3, 6].map(|k| DVec3::new(value(k), value(k + 1), value(k + 2)));
        push(input, &mut mesh, corners, Place::Record(i as u64 + 1))?;
    }
    Ok(mesh)
}

fn read_ascii(input: &mut Input) -> Result<RawMesh, IoError> {
    let (mut mesh, mut corners, mut buffer, mut line) =
        (RawMesh::default(), Vec::new(), Vec::new(), 1);
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
            let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
            let [x, y, z] = numbers[..] else {
                return Err(input.malformed(Place::Line(line), "`vertex` needs three numbers"));
            };
            corners.push(DVec3::new(x, y, z));
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

fn push(input: &Input, mesh: &mut RawMesh, corners: [DVec3; 3], at: Place) -> Result<(), IoError> {
    if let Some(p) = corners.iter().find(|p| !p.is_finite()) {
        let DVec3 { x, y, z } = *p;
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
