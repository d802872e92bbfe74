//! Writes clouds (double coordinates) and meshes as binary little-endian PLY.

use crate::{IoError, RawCloud, atomic};
use geom::TriMesh;
use std::path::Path;

/// A cloud with its columns; the CRS goes into a comment that the reader finds again.
pub fn write_cloud(path: &Path, cloud: &RawCloud) -> Result<(), IoError> {
    cloud.check_columns(path)?;
    atomic::write(path, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment made by tsumu")?;
        if let Some(crs) = &cloud.crs {
            writeln!(out, "comment crs {}", crs.replace(['\n', '\r'], " "))?;
        }
        writeln!(out, "element vertex {}", cloud.len())?;
        writeln!(out, "property double x\nproperty double y\nproperty double z")?;
        if cloud.normal.is_some() {
            writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
        }
        for (present, line) in [
            (cloud.instance.is_some(), "property uint instance"),
            (cloud.model.is_some(), "property ushort model"),
            (cloud.confidence.is_some(), "property float confidence"),
            (cloud.line.is_some(), "property ushort point_source_id"),
        ] {
            if present {
                writeln!(out, "{line}")?;
            }
        }
        writeln!(out, "end_header")?;
        for (i, p) in cloud.position.iter().enumerate() {
            for v in p.to_array() {
                out.write_all(&v.to_le_bytes())?;
            }
            if let Some(normal) = &cloud.normal {
                for v in normal[i].to_array() {
                    out.write_all(&v.to_le_bytes())?;
                }
            }
            if let Some(column) = &cloud.instance {
                out.write_all(&column[i].to_le_bytes())?;
            }
            if let Some(column) = &cloud.model {
                out.write_all(&column[i].to_le_bytes())?;
            }
            if let Some(column) = &cloud.confidence {
                out.write_all(&column[i].to_le_bytes())?;
            }
            if let Some(column) = &cloud.line {
                out.write_all(&column[i].to_le_bytes())?;
            }
        }
        Ok(())
    })
}

/// A triangle mesh.
pub fn write_mesh(path: &Path, mesh: &TriMesh) -> Result<(), IoError> {
    atomic::write(path, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment made by tsumu")?;
        writeln!(out, "element vertex {}", mesh.vertices.len())?;
        writeln!(out, "property float x\nproperty float y\nproperty float z")?;
        writeln!(out, "element face {}", mesh.triangles.len())?;
        writeln!(out, "property list uchar uint vertex_indices\nend_header")?;
        for v in mesh.vertices.iter().flat_map(|v| v.to_array()) {
            out.write_all(&v.to_le_bytes())?;
        }
        for t in &mesh.triangles {
            out.write_all(&[3])?;
            for i in t {
                out.write_all(&i.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
