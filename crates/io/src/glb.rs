//! GLB (glTF 2.0 binary): every type's mesh once, one node per unit, in metres, y up; the root node turns z up into y up.

use crate::drawing::{Drawing, Source};
use crate::{IoError, atomic};
use geom::{TriMesh, Vec3};
use serde_json::{Value, json};
use std::path::Path;

/// Writes the scene near the local origin; the site coordinates of that origin are in `asset.extras`.
pub fn write(path: &Path, drawing: &Drawing) -> Result<(), IoError> {
    atomic::write_bytes(path, &bytes(drawing))
}

/// The file's bytes.
pub fn bytes(drawing: &Drawing) -> Vec<u8> {
    let mut buffer = Vec::new();
    let (mut views, mut accessors, mut meshes) = (Vec::new(), Vec::new(), Vec::new());
    // A mesh in two materials for each type: recognised 2·id, planned 2·id + 1.
    for (_, model) in drawing.catalog.iter() {
        let first = push_mesh(&mut buffer, &mut views, &mut accessors, &model.mesh);
        for (material, layer) in ["recognised", "planned"].iter().enumerate() {
            meshes.push(json!({
                "name": format!("{} {layer}", model.name),
                "primitives": [{ "attributes": { "POSITION": first, "NORMAL": first + 1 }, "material": material }],
            }));
        }
    }
    let mut nodes = vec![
        json!({ "name": drawing.name, "rotation": [-0.5_f32.sqrt(), 0.0, 0.0, 0.5_f32.sqrt()] }),
    ];
    for unit in drawing.units() {
        let (t, q) = (unit.pose.translation, unit.pose.rotation.normalize());
        let mut extras =
            json!({ "layer": unit.layer(), "model": drawing.catalog.get(unit.model).name });
        match unit.source {
            Source::Recognised(_, fit) => extras["confidence"] = json!(fit.confidence),
            Source::Planned(p) => {
                extras["order"] = json!(p.order);
                extras["round"] = json!(p.round);
            }
        }
        let planned = usize::from(matches!(unit.source, Source::Planned(_)));
        nodes.push(json!({
            "name": unit.label(), "mesh": 2 * usize::from(unit.model.0) + planned,
            "translation": t.to_array(), "rotation": [q.x, q.y, q.z, q.w], "extras": extras,
        }));
    }
    if nodes.len() > 1 {
        nodes[0]["children"] = json!((1..nodes.len()).collect::<Vec<_>>());
    }
    let material = |name: &str, colour: [f32; 4]| {
        let metallic =
            json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.9 });
        json!({ "name": name, "pbrMetallicRoughness": metallic })
    };
    let document = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("tsumu ", env!("CARGO_PKG_VERSION")),
            "extras": { "origin_m": drawing.frame.origin, "crs": drawing.frame.crs, "vertical_datum": drawing.frame.vertical_datum },
        },
        "scene": 0,
        "scenes": [{ "name": drawing.name, "nodes": [0] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [material("recognised", [0.55, 0.55, 0.53, 1.0]), material("planned", [0.0, 0.45, 0.7, 1.0])],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": buffer.len() }],
    });
    container(without_empty(document), buffer)
}

/// glTF forbids empty arrays.
fn without_empty(mut document: Value) -> Value {
    let object = document.as_object_mut().expect("the document is an object");
    object.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
    if !object.contains_key("bufferViews") {
        object.remove("buffers");
    }
    document
}

/// Flat-shaded corners: positions, then normals; returns the first of the two accessors.
fn push_mesh(
    buffer: &mut Vec<u8>,
    views: &mut Vec<Value>,
    accessors: &mut Vec<Value>,
    mesh: &TriMesh,
) -> usize {
    let first = accessors.len();
    let count = mesh.triangles.len() * 3;
    let bounds = mesh.bounds();
    let positions = (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t));
    push_column(buffer, views, positions);
    accessors.push(json!({
        "bufferView": first, "componentType": 5126, "count": count, "type": "VEC3",
        "min": bounds.min.to_array(), "max": bounds.max.to_array(),
    }));
    let upright = |n: Vec3| if n == Vec3::ZERO { Vec3::Z } else { n };
    let normals = (0..mesh.triangles.len()).flat_map(|t| [upright(mesh.triangle_normal(t)); 3]);
    push_column(buffer, views, normals);
    accessors.push(
        json!({ "bufferView": first + 1, "componentType": 5126, "count": count, "type": "VEC3" }),
    );
    first
}

fn push_column(buffer: &mut Vec<u8>, views: &mut Vec<Value>, column: impl Iterator<Item = Vec3>) {
    let start = buffer.len();
    buffer.extend(column.flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes));
    views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": buffer.len() - start, "target": 34962 }));
}

/// Header, JSON chunk padded with blanks, binary chunk padded with zeros.
fn container(document: Value, mut buffer: Vec<u8>) -> Vec<u8> {
    let mut json = serde_json::to_vec(&document).expect("plain data");
    json.resize(json.len().next_multiple_of(4), b' ');
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut out = Vec::with_capacity(28 + json.len() + buffer.len());
    let word = |out: &mut Vec<u8>, v: usize| out.extend((v as u32).to_le_bytes());
    out.extend(b"glTF");
    word(&mut out, 2);
    let binary = if buffer.is_empty() { 0 } else { 8 + buffer.len() };
    word(&mut out, 20 + json.len() + binary);
    word(&mut out, json.len());
    out.extend(b"JSON");
    out.extend(json);
    if !buffer.is_empty() {
        word(&mut out, buffer.len());
        out.extend(b"BIN\0");
        out.extend(buffer);
    }
    out
}
