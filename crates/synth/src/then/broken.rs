//! A block whose leg has lost its end.

use geom::{DVec3, Plane, Vec3};
use rand::{Rng, RngExt};
use scene::{BlockModel, ConvexPart, SymmetryGroup};

/// The plane across one of the block's legs, block coordinates, `share` of the way from the tip to the centre. The farthest parts
/// of a block's surface are its tips.
pub(super) fn cut(model: &BlockModel, share: f32, rng: &mut impl Rng) -> Plane {
    let tips = tips(model);
    let tip = tips[rng.random_range(0..tips.len())];
    let normal = tip.normalize();
    Plane { normal, offset_m: normal.dot(model.centre + tip * (1.0 - share)) }
}

/// The block without what lies beyond the plane. Centre and name stay those of the whole block.
pub(super) fn broken(model: &BlockModel, cut: &Plane) -> BlockModel {
    let outside = |p: Vec3| cut.distance_m(p);
    let parts = model.parts.iter().filter_map(|part| clipped_part(part, outside)).collect();
    let mesh = clipped_mesh(&model.mesh, outside);
    let volume_m3 = mesh.moments().volume_m3;
    BlockModel {
        mesh,
        parts,
        volume_m3,
        symmetry: SymmetryGroup::trivial(model.centre),
        ..model.clone()
    }
}

/// Directions with lengths from the centre to the tips: surface patches at least nine tenths as far as the farthest.
fn tips(model: &BlockModel) -> Vec<Vec3> {
    let from_centre: Vec<Vec3> = model.mesh.vertices.iter().map(|v| *v - model.centre).collect();
    let farthest = from_centre.iter().map(|v| v.length()).fold(0.0, f32::max);
    let mut groups: Vec<(Vec3, f32)> = Vec::new();
    for v in from_centre.into_iter().filter(|v| v.length() > 0.9 * farthest) {
        let near = |g: &&mut (Vec3, f32)| (g.0 / g.1).normalize().dot(v.normalize()) > 0.8;
        match groups.iter_mut().find(near) {
            Some(group) => {
                group.0 += v;
                group.1 += 1.0;
            }
            None => groups.push((v, 1.0)),
        }
    }
    groups.into_iter().map(|(sum, n)| sum / n).collect()
}

/// The corners inside and where edges between inside and outside cross the plane; `None` when hardly anything is left.
fn clipped_part(part: &ConvexPart, outside: impl Fn(Vec3) -> f32) -> Option<ConvexPart> {
    let (inside, beyond): (Vec<Vec3>, Vec<Vec3>) =
        part.corners.iter().partition(|c| outside(**c) <= 0.0);
    if beyond.is_empty() {
        return Some(part.clone());
    }
    let crossing = |a: &Vec3, b: &Vec3| {
        let (da, db) = (outside(*a), outside(*b));
        a.lerp(*b, da / (da - db))
    };
    let mut corners = inside.clone();
    corners.extend(inside.iter().flat_map(|a| beyond.iter().map(|b| crossing(a, b))));
    let solid = geom::ConvexSolid::from_corners(&corners)?;
    let mut hull: Vec<Vec3> = solid.faces.iter().flatten().map(|p: &DVec3| p.as_vec3()).collect();
    hull.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    hull.dedup_by(|a, b| (*a - *b).length() < 1e-5 * solid.size_m as f32);
    (hull.len() >= 4 && solid.volume_m3() > 0.0).then_some(ConvexPart { corners: hull })
}

/// The mesh inside the plane, closed by a fan over the cut.
fn clipped_mesh(mesh: &geom::TriMesh, outside: impl Fn(Vec3) -> f32) -> geom::TriMesh {
    let mut out = geom::TriMesh::default();
    let mut cut: Vec<[Vec3; 2]> = Vec::new();
    let mut add = |corners: [Vec3; 3]| {
        let first = out.vertices.len() as u32;
        out.vertices.extend(corners);
        out.triangles.push([first, first + 1, first + 2]);
    };
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        let mut polygon: Vec<Vec3> = Vec::with_capacity(4);
        let mut border: Vec<Vec3> = Vec::new();
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let (da, db) = (outside(a), outside(b));
            if da <= 0.0 {
                polygon.push(a);
            }
            if (da <= 0.0) != (db <= 0.0) {
                let p = a.lerp(b, da / (da - db));
                polygon.push(p);
                border.push(p);
            }
        }
        for i in 2..polygon.len() {
            add([polygon[0], polygon[i - 1], polygon[i]]);
        }
        if let [p, q] = border[..] {
            // The polygon runs along the cut from the corner where it leaves to the one where it comes back.
            let leaves = outside(corners[0]) <= 0.0;
            cut.push(if leaves { [p, q] } else { [q, p] });
        }
    }
    if !cut.is_empty() {
        let middle = cut.iter().flatten().sum::<Vec3>() / (2 * cut.len()) as f32;
        cut.iter().for_each(|[p, q]| add([middle, *q, *p]));
    }
    out.welded(1e-5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;

    #[test]
    fn a_broken_tetrapod_is_closed_and_lighter() {
        let spec = toml::from_str::<scene::CatalogSpec>(
            "[[block]]\nname = \"t\"\nshape = { kind = \"tetrapod\", size = 2.0 }\n",
        )
        .unwrap();
        let catalog = blocks::catalog(&spec, &|_| Err("built-in".into())).unwrap();
        let whole = catalog.get(scene::ModelId(0));
        assert_eq!(tips(whole).len(), 4);
        let cut = cut(whole, 0.4, &mut SeedTree::new(3).rng());
        let part = broken(whole, &cut);
        assert!(part.mesh.check_solid().is_ok(), "{:?}", part.mesh.check_solid());
        let lost = 1.0 - part.volume_m3 / whole.volume_m3;
        assert!((0.02..0.2).contains(&lost), "{lost}");
        let solids: Vec<_> = part
            .parts
            .iter()
            .map(|p| geom::ConvexSolid::from_corners(&p.corners).unwrap())
            .collect();
        let volume = geom::union_volume_m3(&solids, 200) as f32;
        assert!((volume / part.volume_m3 - 1.0).abs() < 0.03, "{volume} {}", part.volume_m3);
    }
}
