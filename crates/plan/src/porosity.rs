//! Concrete in a layer, the second way: by raster columns through the posed meshes, overlaps counted once.
//!
//! The first way adds the blocks' analytic volumes. The two agree unless a mesh is not closed, a pose is wrong or
//! blocks interpenetrate, so their difference is a check of the whole plan.

use geom::{Pose, TriMesh, Vec3};
use std::collections::BTreeMap;

/// Volume of the union of posed meshes, m³, from vertical columns `cell_m` apart.
pub fn rasterised_volume_m3<'a>(
    solids: impl IntoIterator<Item = (&'a TriMesh, Pose)>,
    cell_m: f32,
) -> f64 {
    let mut columns: BTreeMap<(i32, i32), Vec<(f32, i32)>> = BTreeMap::new();
    for (mesh, pose) in solids {
        let vertices: Vec<Vec3> = mesh.vertices.iter().map(|&v| pose * v).collect();
        for t in &mesh.triangles {
            cross(t.map(|i| vertices[i as usize]), cell_m, &mut columns);
        }
    }
    let area = f64::from(cell_m) * f64::from(cell_m);
    columns.into_values().map(|crossings| solid_length_m(crossings) * area).sum()
}

/// Where the column through each cell's centre passes the triangle: +1 into the solid from below, −1 out of it.
fn cross(corners: [Vec3; 3], cell_m: f32, columns: &mut BTreeMap<(i32, i32), Vec<(f32, i32)>>) {
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    let (ab, ac) = ((b - a).truncate(), (c - a).truncate());
    let twice = ab.perp_dot(ac);
    if twice.abs() < 1e-14 {
        return;
    }
    let cell = f64::from(cell_m);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // Columns stand a little off the round numbers, where edges of regular meshes like to lie.
    let offset = 0.500_123;
    let range =
        |l: f64, h: f64| ((l / cell - offset).ceil() as i32, (h / cell - offset).floor() as i32);
    let ((x0, x1), (y0, y1)) = (range(low.x, high.x), range(low.y, high.y));
    for iy in y0..=y1 {
        for ix in x0..=x1 {
            let p = glam_at(ix, iy, offset, cell) - a.truncate();
            let (v, w) = (p.perp_dot(ac) / twice, ab.perp_dot(p) / twice);
            if v >= 0.0 && w >= 0.0 && v + w < 1.0 {
                let z = a.z + v * (b.z - a.z) + w * (c.z - a.z);
                // Counter-clockwise from above: the top of the solid.
                columns
                    .entry((ix, iy))
                    .or_default()
                    .push((z as f32, if twice > 0.0 { -1 } else { 1 }));
            }
        }
    }
}

fn glam_at(ix: i32, iy: i32, offset: f64, cell: f64) -> geom::DVec2 {
    geom::DVec2::new((f64::from(ix) + offset) * cell, (f64::from(iy) + offset) * cell)
}

/// Length of a column inside at least one solid.
fn solid_length_m(mut crossings: Vec<(f32, i32)>) -> f64 {
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut depth, mut length) = (0, 0.0);
    for pair in crossings.windows(2) {
        depth += pair[0].1;
        if depth > 0 {
            length += f64::from(pair[1].0 - pair[0].0);
        }
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Quat, SeedTree};
    use rand::RngExt;

    #[test]
    fn scattered_blocks_have_their_analytic_volume_and_overlaps_count_once() {
        let shape = scene::Shape::Tetrapod { size: 2.0 };
        let block = blocks::shape_model("t", shape, 2300.0).unwrap();
        let mut rng = SeedTree::new(2).rng();
        let poses: Vec<Pose> = (0..30)
            .map(|i| {
                let turn = Quat::from_rotation_x(rng.random::<f32>() * 6.0)
                    * Quat::from_rotation_z(rng.random::<f32>());
                Pose::from_parts(Vec3::new(3.0 * i as f32, rng.random::<f32>(), 0.0), turn)
            })
            .collect();
        let volume = rasterised_volume_m3(poses.iter().map(|p| (&block.mesh, *p)), 0.1);
        assert!((volume / (30.0 * f64::from(block.volume_m3)) - 1.0).abs() < 0.01);
        let twice =
            rasterised_volume_m3(poses.iter().chain(&poses).map(|p| (&block.mesh, *p)), 0.1);
        assert!((twice / volume - 1.0).abs() < 1e-6);
    }
}
