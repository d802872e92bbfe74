//! DXF: 3DFACEs in, the drawing out.

use crate::input::Input;
use crate::{IoError, Place};
use geom::DVec3;

pub use crate::dxf_writer::{text, write, write_with};

/// Triangles of all 3DFACE entities (quadrilaterals as two), in the file's coordinates: a design surface from CAD.
pub fn read_faces(input: &mut Input) -> Result<Vec<[DVec3; 3]>, IoError> {
    let (mut buffer, mut line) = (Vec::new(), 0);
    let mut faces = Vec::new();
    let mut face: Option<[[f64; 3]; 4]> = None;
    loop {
        line += 1;
        if !input.line(&mut buffer, line, 1 << 16)? {
            break;
        }
        let code = String::from_utf8_lossy(&buffer).trim().to_string();
        if line == 1 && buffer.starts_with(b"AutoCAD Binary DXF") {
            return Err(IoError::unsupported(
                input.path,
                "binary DXF is not read; save it as a text DXF",
            ));
        }
        let code: i32 = code.parse().map_err(|_| {
            input.malformed(
                Place::Line(line),
                format!("`{code}` is not a DXF group code: is this a text DXF?"),
            )
        })?;
        line += 1;
        if !input.line(&mut buffer, line, 1 << 16)? {
            return Err(input.malformed(
                Place::Line(line),
                "the file ends inside a pair of lines; it is cut short",
            ));
        }
        let value = String::from_utf8_lossy(&buffer).trim().to_string();
        if code == 0 {
            if let Some(corners) = face.take() {
                push_face(&mut faces, corners);
            }
            face = (value == "3DFACE").then_some([[f64::NAN; 3]; 4]);
        } else if let Some(corners) = &mut face
            && let (axis, corner) = ((code - 10) / 10, (code - 10) % 10)
            && (10..40).contains(&code)
            && corner < 4
        {
            let number: f64 =
                value.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| {
                    input.malformed(Place::Line(line), format!("`{value}` is not a coordinate"))
                })?;
            corners[corner as usize][axis as usize] = number;
        }
    }
    if faces.is_empty() {
        return Err(input.malformed(
            Place::File,
            "the drawing has no complete 3DFACE; export the surface as 3D faces",
        ));
    }
    Ok(faces)
}

fn push_face(faces: &mut Vec<[DVec3; 3]>, corners: [[f64; 3]; 4]) {
    let [a, b, c, d] = corners.map(DVec3::from_array);
    if a.is_finite() && b.is_finite() && c.is_finite() {
        faces.push([a, b, c]);
        if d.is_finite() && d != c {
            faces.push([a, c, d]);
        }
    }
}
