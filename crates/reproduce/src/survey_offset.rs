//! What a synthetic survey as a whole is off by, its sensor's own errors included.
//!
//! In: a scene with its truth, a place of each measured point without the datum's error. Out: the one shift by which the points of whole
//! blocks lie best on the true surfaces (point to plane, least squares), its lines laid onto each other as recognition lays them. A drone's drift and a sounder's roll, heave and position are
//! errors of the survey as its datum's are: no comparison can tell them apart, and a registration takes them all out.

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
    let mut offset = Vec3::ZERO;
    for _ in 0..ROUNDS {
        let (mut a, mut b) = (geom::DMat3::ZERO, geom::DVec3::ZERO);
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
            let left = normal.dot((pose.rotation * (local - near.point)).as_dvec3());
            a += geom::DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
            b += normal * left;
        }
        if a.determinant().abs() < 1e-9 {
            break;
        }
        offset += (a.inverse() * b).as_vec3();
    }
    offset
}
