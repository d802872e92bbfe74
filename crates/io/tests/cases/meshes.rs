//! Meshes: concave outlines, far origins, wrong counts.

use geom::{DVec3, Vec3};
use io::{Input, mesh};
use std::path::Path;

fn read(kind: &str, bytes: &[u8]) -> Result<mesh::MeshRead, String> {
    let name = format!("a.{kind}");
    mesh::read_moved_as(&mut Input::of_bytes(Path::new(&name), bytes), kind)
        .map_err(|e| e.to_string())
}

/// An L of 6 corners, 1 high: 3 m².
const L: [(f64, f64); 6] = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];

fn profile(at: DVec3, start: usize) -> String {
    let mut text = String::new();
    for z in [0.0, 1.0] {
        for (x, y) in L {
            text += &format!("v {} {} {}\n", x + at.x, y + at.y, z + at.z);
        }
    }
    let cap = |up: bool| -> String {
        let corner = |k: usize| 1 + (k + start) % 6 + if up { 6 } else { 0 };
        let order: Vec<String> =
            (0..6).map(|k| corner(if up { k } else { 5 - k }).to_string()).collect();
        format!("f {}\n", order.join(" "))
    };
    text += &(cap(false) + &cap(true));
    for i in 0..6 {
        let j = (i + 1) % 6;
        text += &format!("f {} {} {} {}\n", i + 1, j + 1, j + 7, i + 7);
    }
    text
}

#[test]
fn concave_ngon() {
    for start in 0..6 {
        let found = read("obj", profile(DVec3::ZERO, start).as_bytes()).unwrap().mesh;
        assert_eq!(found.check_solid(), Ok(()), "{start}");
        assert!((found.moments().volume_m3 - 3.0).abs() < 1e-5, "{start}");
        // Not the volume alone: no triangle may leave the outline.
        assert_eq!(geom::shells_in_each_other(&found), None, "{start}");
    }
}

#[test]
fn far_from_origin() {
    let at = DVec3::new(41_250.123, -98_760.456, 2.789);
    let found = read("obj", profile(at, 0).as_bytes()).unwrap();
    assert!((found.mesh.moments().volume_m3 - 3.0).abs() < 1e-4);
    assert!((found.moved_by - at).abs().max_element() < 3.0);
    let corner = found.mesh.vertices[0].as_dvec3() + found.moved_by;
    assert!((corner - at).length() < 1e-6, "{corner}");
    // Near the origin nothing is moved.
    assert_eq!(read("obj", profile(DVec3::ONE, 0).as_bytes()).unwrap().moved_by, DVec3::ZERO);
    // 32-bit floats of the file have lost the shape already.
    let stl = stl(&[[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]].map(|_| triangle(41_250.0)), 2, b"binary", 0);
    assert!(read("stl", &stl).unwrap_err().contains("32-bit"));
}

fn triangle(at: f32) -> [Vec3; 3] {
    [Vec3::splat(at), Vec3::splat(at) + Vec3::X, Vec3::splat(at) + Vec3::Y]
}

fn stl(triangles: &[[Vec3; 3]], count: u32, head: &[u8], trailing: usize) -> Vec<u8> {
    let mut out = vec![b' '; 80];
    out[..head.len()].copy_from_slice(head);
    out.extend(count.to_le_bytes());
    for t in triangles {
        out.extend([0; 12]);
        t.iter().flat_map(|v| v.to_array()).for_each(|v| out.extend(v.to_le_bytes()));
        out.extend([0; 2]);
    }
    out.extend(vec![7; trailing]);
    out
}

#[test]
fn solid_header_trailing_bytes() {
    let many = [triangle(0.0); 20];
    for trailing in [0, 1, 2, 49] {
        let found = read("stl", &stl(&many, 20, b"solid made by a program", trailing)).unwrap();
        assert_eq!(found.mesh.triangles.len(), 20, "{trailing}");
    }
    // Counts that were never filled in.
    for count in [0, u32::MAX] {
        assert_eq!(read("stl", &stl(&many, count, b"x", 0)).unwrap().mesh.triangles.len(), 20);
    }
    // A wrong count, and a file cut short.
    assert!(read("stl", &stl(&many, 12, b"x", 0)).unwrap_err().contains("room for 20"));
    assert!(read("stl", &stl(&many, 21, b"x", 3)).unwrap_err().contains("promises 21"));
    // A text stays a text.
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    assert_eq!(read("stl", text.as_bytes()).unwrap().mesh.triangles.len(), 1);
}

#[test]
fn text_in_capitals_is_text() {
    let t = triangle(0.0);
    let corners: String = t.iter().map(|v| format!("VERTEX {} {} {}\n", v.x, v.y, v.z)).collect();
    let facet = format!("FACET NORMAL 0 0 0\nOUTER LOOP\n{corners}ENDLOOP\nENDFACET\n");
    let text = format!("SOLID part\n{}ENDSOLID part\n", facet.repeat(4));
    assert_eq!(read("stl", text.as_bytes()).unwrap().mesh.triangles.len(), 4);
}
