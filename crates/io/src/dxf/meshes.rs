//! Faces of the entities that are surfaces: 3DFACE, polyface, polygon mesh and MESH.

use super::entities::Entity;
use geom::DVec3;

/// Triangles of the entity; `None` when it is no surface.
pub(super) fn faces(entity: &Entity) -> Option<Vec<[DVec3; 3]>> {
    match entity.kind.as_str() {
        "3DFACE" => Some(face(entity)),
        "POLYLINE" => {
            let flags = entity.integer(70).unwrap_or(0);
            if flags & 64 != 0 {
                Some(polyface(entity))
            } else {
                (flags & 16 != 0).then(|| polygon_mesh(entity, flags))
            }
        }
        "MESH" => Some(mesh(entity)),
        _ => None,
    }
}

/// The MESH is shown smoother than its corners say.
pub(super) fn is_smoothed(entity: &Entity) -> bool {
    entity.kind == "MESH" && entity.integer(91).is_some_and(|level| level > 0)
}

fn face(entity: &Entity) -> Vec<[DVec3; 3]> {
    let whole =
        |code: i32| [code, code + 10, code + 20].iter().all(|c| entity.number(*c).is_some());
    let corner = |code: i32| entity.point(code).filter(|_| whole(code));
    let (Some(a), Some(b), Some(c)) = (corner(10), corner(11), corner(12)) else {
        return Vec::new();
    };
    match corner(13) {
        Some(d) if d != c && d != a => vec![[a, b, c], [a, c, d]],
        _ => vec![[a, b, c]],
    }
}

/// Vertices first, then records with the numbers of three or four of them (negative: the edge is not drawn).
fn polyface(entity: &Entity) -> Vec<[DVec3; 3]> {
    let (mut places, mut out) = (Vec::new(), Vec::new());
    for vertex in &entity.vertices {
        let flags = vertex.integer(70).unwrap_or(0);
        if flags & 64 != 0 {
            places.push(vertex.point(10).unwrap_or(DVec3::NAN));
        } else if flags & 128 != 0 {
            let at = |code: i32| {
                let number = vertex.integer(code)?.unsigned_abs() as usize;
                places.get(number.checked_sub(1)?).copied().filter(|p| p.is_finite())
            };
            let corners: Vec<DVec3> = (71..=74).filter_map(at).collect();
            fan(&corners, &mut out);
        }
    }
    out
}

/// M × N vertices, the last row or column joined with the first when closed; of a smooth one the fitted vertices.
fn polygon_mesh(entity: &Entity, flags: i64) -> Vec<[DVec3; 3]> {
    let smooth = entity.integer(75).unwrap_or(0) != 0;
    let codes = if smooth { [73, 74] } else { [71, 72] };
    let size = codes.map(|c| entity.integer(c).and_then(|n| usize::try_from(n).ok()).unwrap_or(0));
    let control = |v: &&Entity| v.integer(70).unwrap_or(0) & 16 == 0;
    let places: Vec<DVec3> = entity
        .vertices
        .iter()
        .filter(|v| !smooth || control(v))
        .map(|v| v.point(10).unwrap_or(DVec3::NAN))
        .collect();
    let [m, n] = size;
    if m < 2 || n < 2 || m.checked_mul(n) != Some(places.len()) {
        return Vec::new();
    }
    let rows = if flags & 1 != 0 { m } else { m - 1 };
    let columns = if flags & 32 != 0 { n } else { n - 1 };
    let mut out = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let at = |i: usize, j: usize| places[i % m * n + j % n];
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if corners.iter().all(|p| p.is_finite()) {
                fan(&corners, &mut out);
            }
        }
    }
    out
}

/// Counted lists one after another: vertices (92), faces (93: count and corners of each), edges.
fn mesh(entity: &Entity) -> Vec<[DVec3; 3]> {
    let (mut places, mut list) = (Vec::<DVec3>::new(), Vec::new());
    let (mut in_faces, mut left) = (false, 0);
    for (code, value) in entity.groups() {
        let number = || value.parse::<f64>().unwrap_or(f64::NAN);
        match code {
            10 => places.push(DVec3::new(number(), f64::NAN, 0.0)),
            20 | 30 => {
                if let Some(last) = places.last_mut() {
                    last[if code == 20 { 1 } else { 2 }] = number();
                }
            }
            93 => {
                left = value.parse().unwrap_or(0_usize);
                in_faces = true;
            }
            90 if in_faces && left > 0 => {
                list.push(value.parse().unwrap_or(usize::MAX));
                left -= 1;
            }
            94 => in_faces = false,
            _ => {}
        }
    }
    let (mut out, mut at) = (Vec::new(), 0);
    while let Some(&count) = list.get(at) {
        let Some(numbers) = list.get(at + 1..(at + 1).saturating_add(count)) else { break };
        let corners: Vec<DVec3> = numbers
            .iter()
            .filter_map(|&i| places.get(i).copied())
            .filter(|p| p.is_finite())
            .collect();
        if corners.len() == count {
            fan(&corners, &mut out);
        }
        at += 1 + count;
    }
    out
}

fn fan(corners: &[DVec3], out: &mut Vec<[DVec3; 3]>) {
    for i in 2..corners.len() {
        out.push([corners[0], corners[i - 1], corners[i]]);
    }
}
