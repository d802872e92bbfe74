//! What a synthetic survey as a whole is off by, its sensor's own errors included.
//!
//! In: a scene with its truth, a place of each measured point without the datum's error. Out: the one shift by which the points of whole
//! blocks lie best on the true surfaces (point to plane, least squares), its lines laid onto each other as recognition lays them. A drone's drift and a sounder's roll, heave and position are
//! errors of the survey as its datum's are: no comparison can tell them apart, and a registration takes them all out.
//!
//! A sounder's footprint takes the nearest of a slanted face, so its points lie outside such faces, the more the steeper, and on level ones
//! truly. That is no shift, and since all faces seen look upwards it would look like one of 8 mm up: it is a fourth unknown beside the
//! shift.

use geom::{MeshQuery, Vec3};
use pose::LineShifts;
use scene::Catalog;
use synth::SynthScene;

/// Points asked, and the distance beyond which a point is none of a surface, in block lengths.
const POINTS: usize = 12_000;
const REACH_BLOCKS: f32 = 0.1;
const ROUNDS: usize = 4;

/// The shift of the survey's points against the true surfaces. `true_place` undoes the datum's error; blocks that `is_whole`
/// denies are left out.
pub(crate) fn survey_offset_m(
    scene: &SynthScene,
    catalog: &Catalog,
    true_place: impl Fn(Vec3) -> Vec3,
    is_whole: impl Fn(scene::InstanceId) -> bool,
) -> Vec3 {
    let solids: Vec<Option<MeshQuery>> =
        catalog.iter().map(|(_, m)| MeshQuery::new(&m.mesh).ok()).collect();
    let blocks = &scene.scene.blocks;
    let place: std::collections::HashMap<u32, usize> = blocks
        .iter()
        .enumerate()
        .filter(|(_, b)| is_whole(b.block))
        .map(|(i, b)| (b.block.0, i))
        .collect();
    let size_m = catalog.iter().map(|(_, m)| m.d_max_m).fold(f32::INFINITY, f32::min);
    let sensor = scene.survey.sensor;
    let lines = LineShifts::of(&scene.survey, size_m, sensor.noise_sd_m(size_m));
    let levelled = lines.map(|l| l.taken_out_of(&scene.survey));
    let cloud = &levelled.as_ref().unwrap_or(&scene.survey).cloud.position_m;
    let labelled: Vec<(Vec3, usize)> = cloud
        .iter()
        .zip(&scene.instance)
        .step_by(cloud.len().div_ceil(POINTS).max(1))
        .filter_map(|(p, id)| Some((true_place(*p), *place.get(id)?)))
        .collect();
    let (mut offset, mut outside) = (Vec3::ZERO, 0.0);
    for _ in 0..ROUNDS {
        let (mut a, mut b) = (geom::DMat4::ZERO, geom::DVec4::ZERO);
        for &(p, i) in &labelled {
            let block = &blocks[i];
            let model = catalog.get(block.model);
            let Some(solid) = &solids[usize::from(block.model.0)] else { continue };
            let pose = block.site_from_block;
            let local = pose.inverse_transform_point(p - offset);
            let near = solid.nearest_signed(local);
            if near.distance_m.abs() > REACH_BLOCKS * model.d_box_m {
                continue;
            }
            let [u, v, w] = model.mesh.corners(near.triangle as usize);
            let normal = (pose.rotation * (v - u).cross(w - u).normalize_or_zero()).as_dvec3();
            let left = normal.dot((pose.rotation * (local - near.point)).as_dvec3())
                - outside * steepness(normal);
            let row = normal.extend(steepness(normal));
            a += geom::DMat4::from_cols(row * row.x, row * row.y, row * row.z, row);
            b += row * left;
        }
        if a.determinant().abs() < 1e-9 {
            break;
        }
        let step = a.inverse() * b;
        offset += step.truncate().as_vec3();
        outside += step.w;
    }
    offset
}

/// Sine of a face's slant: 0 on a level one, 1 on an upright one. Of a sounder that is nowhere off, points lie outside by 5 mm at 18°, 12 at 41°
/// and 20 at 70°.
fn steepness(normal: geom::DVec3) -> f64 {
    (1.0 - normal.z * normal.z).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SiteSet;

    #[test]
    fn a_sounder_that_is_nowhere_off_is_off_by_nothing() {
        let text = r#"
            name = "sounded"
            count = [12, 12]
            density_per_m2 = 260
            [site]
            kind = "strip"
            length_m = 5.0
            width_m = 5.0
            [sensor]
            kind = "mbes"
            roll_bias_sd_deg = 0.0
            heave_bias_sd_m = 0.0
            position_bias_sd_m = 0.0
            [[catalog.block]]
            name = "tetrapod-2.0m"
            shape = { kind = "tetrapod", size = 2.0 }
        "#;
        let set = SiteSet::parse("sounded", text).unwrap();
        let scene = set.scene(41, 0).unwrap();
        let off = survey_offset_m(&scene, &set.catalog, |p| p, |_| true);
        // Its footprint, taken for a shift, would be 8 mm.
        assert!(off.length() < 0.004, "{off:?}");
        let moved = Vec3::new(0.03, -0.02, 0.05);
        let shifted = survey_offset_m(&scene, &set.catalog, |p| p + moved, |_| true);
        assert!((shifted - off - moved).length() < 0.002, "{shifted:?}");
    }
}
