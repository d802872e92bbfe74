//! Whether the blocks lie there mirrored.
//!
//! A mesh whose file has an axis turned round, or coordinates that are left-handed, fit none of the blocks and much of each.
//! The mirror image of a block fits points as well as the block fits their mirror image: a block's own points are mirrored
//! and its pose is fitted to them anew. A block that is its own mirror image fits both alike.

use crate::finish::Accepted;
use crate::fit::{CentredPose, FitPoint, fit};
use crate::measured::Measured;
use crate::rivals::some_points;
use crate::rotation_grid::rotation_grid;
use crate::template::Template;
use geom::{Quat, Vec3};
use rayon::prelude::*;

/// Blocks lie mirrored when the mirror image fits half of them this much better and hardly any of them worse. Of blocks that are
/// not, it fits a quarter clearly worse, also where the rest show too little to tell.
const BETTER: f32 = 1.02;
const HARDLY_WORSE: f32 = 0.99;
/// Fewest blocks that tell.
const FEWEST: usize = 3;
/// Blocks that are asked, the best supported first.
const ASKED: usize = 16;
/// A block whose whole surface its mirror image fits this well is its own mirror image.
const ITS_OWN: f32 = 0.97;
/// Points of the surface looked at for that.
const SURFACE: usize = 240;
/// Turns tried: so far apart, at most so many; the best of them are fitted in full.
const SPACING_RAD: f32 = 0.45;
const MOST_TURNS: usize = 900;
const FITTED: usize = 24;
/// Reach of the last steps of a fit, in d_max, where noise asks for no more.
const FINE: f32 = 0.03;

/// Whether the blocks for which `counts` holds fit their mirror image better than themselves. `points` are each block's own.
pub fn mirrored(
    blocks: &[Accepted],
    points: &[Vec<u32>],
    counts: impl Fn(usize) -> bool,
    templates: &[Template],
    measured: &Measured,
) -> bool {
    let asked: Vec<usize> = (0..blocks.len())
        .filter(|&entry| counts(entry) && is_handed(&templates[blocks[entry].template]))
        .take(ASKED)
        .collect();
    let mut told: Vec<f32> = asked
        .into_par_iter()
        .filter_map(|entry| {
            let (block, template) = (&blocks[entry], &templates[blocks[entry].template]);
            let own = some_points(measured, &measured.working(&points[entry]))?;
            let fine_m = (2.5 * measured.noise_sd_m).max(FINE * template.model.d_max_m);
            Some(advantage(&block.at, &own, template, fine_m))
        })
        .collect();
    told.sort_by(f32::total_cmp);
    told.len() >= FEWEST && told[told.len() / 2] > BETTER && told[told.len() / 4] > HARDLY_WORSE
}

/// Whether a block and its mirror image are two shapes.
fn is_handed(template: &Template) -> bool {
    let asked = || {
        let stride = template.surface.len().div_ceil(SURFACE).max(1);
        let sampled = template.surface.iter().step_by(stride);
        let point =
            |&(position, normal): &(Vec3, Vec3)| FitPoint { position, normal, to_sensor: normal };
        let whole: Vec<FitPoint> = sampled.map(point).collect();
        let at = CentredPose { rotation: Quat::IDENTITY, centre: template.model.centre };
        advantage(&at, &whole, template, FINE * template.model.d_max_m) < ITS_OWN
    };
    *template.handed.get_or_init(asked)
}

/// How well the mirror image fits points over how well the block does at its pose.
fn advantage(at: &CentredPose, own: &[FitPoint], template: &Template, fine_m: f32) -> f32 {
    let (model, d) = (template.fit_model(), template.model.d_max_m);
    // Any mirror will do: the others follow from it by a turn.
    let mirror = |p: &FitPoint| FitPoint {
        position: at.centre - (p.position - at.centre),
        normal: -p.normal,
        to_sensor: -p.to_sensor,
    };
    let mirrored: Vec<FitPoint> = own.iter().map(mirror).collect();
    let turns = rotation_grid(&template.model.symmetry, SPACING_RAD, MOST_TURNS);
    let mut coarse: Vec<(f32, CentredPose)> = turns
        .into_iter()
        .map(|rotation| {
            let start = CentredPose { rotation, centre: at.centre };
            let (found, score) = fit(&model, &mirrored, start, &[0.3 * d, 0.15 * d]);
            (score, found)
        })
        .collect();
    coarse.sort_by(|a, b| b.0.total_cmp(&a.0));
    let steps = [0.1 * d, 0.06 * d, fine_m, fine_m];
    let score = |points: &[FitPoint], start: CentredPose| {
        let (found, _) = fit(&model, points, start, &steps);
        fit(&model, points, found, &[fine_m]).1
    };
    let best = coarse.iter().take(FITTED).map(|c| score(&mirrored, c.1)).fold(0.0, f32::max);
    best / score(own, *at).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::template::templates;
    use crate::{PoseConfig, recognise_pile};
    use geom::{PointCloud, SeedTree, Silent, TriMesh};
    use scene::{BlockModel, Catalog, Segmentation, SensorKind, Shape, Survey};

    /// A corner of a box with three different edges.
    fn corner(mirrored: bool) -> BlockModel {
        let side = if mirrored { -1.0 } else { 1.0 };
        let vertices =
            [[0.0; 3], [2.0 * side, 0.0, 0.0], [0.0, 1.3, 0.0], [0.0, 0.0, 0.8]].map(Vec3::from);
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = TriMesh { vertices: vertices.to_vec(), triangles };
        blocks::mesh_model("corner", &mesh, 2300.0).unwrap()
    }

    #[test]
    fn a_block_that_is_its_own_mirror_image_is_not_asked() {
        let of = |shape: Shape| blocks::shape_model(&format!("{shape:?}"), shape, 2300.0).unwrap();
        let without_symmetry = ["corner", "HookPlate { size: 0.1 }", "Bracket { size: 0.1 }"];
        let own = [
            Shape::Tetrapod { size: 2.0 },
            Shape::Dolos { size: 2.0 },
            Shape::Cube { size: 2.0 },
            Shape::Antifer { size: 2.0 },
            Shape::CoreLocLike { size: 2.0 },
            Shape::XblocLike { size: 2.0 },
            Shape::AccropodeLike { size: 2.0 },
            Shape::SixLegLike { size: 2.0 },
            Shape::HollowTetrahedronLike { size: 2.0 },
            Shape::EyeBolt { size: 0.1 },
            Shape::GearShaft { size: 0.1 },
            Shape::HoledPlate { size: 0.1 },
            Shape::HookPlate { size: 0.1 },
            Shape::Bracket { size: 0.1 },
        ];
        let models: Vec<BlockModel> =
            own.map(of).into_iter().chain([corner(false), corner(true)]).collect();
        let catalog = Catalog::new(models);
        let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
        let handed = |t: &Template| (t.model.name.clone(), is_handed(t));
        for (name, handed) in templates.iter().map(handed) {
            assert_eq!(handed, without_symmetry.contains(&name.as_str()), "{name}");
        }
    }

    /// Five blocks apart from each other, all of their surface measured.
    fn survey(of: &BlockModel) -> Survey {
        let mut points = Vec::new();
        for k in 0..5 {
            let turn = Quat::from_rotation_z(k as f32) * Quat::from_rotation_x(0.7 * k as f32);
            let place = Vec3::new(4.0 * k as f32, 0.0, 1.5);
            let surface = of.mesh.sample_surface(2500, &mut SeedTree::new(k).rng());
            points.extend(surface.iter().map(|(p, _)| place + turn * (*p - of.centre)));
        }
        let cloud = PointCloud::from_positions(points);
        Survey { cloud, sensor: SensorKind::DepthCamera, ..Survey::default() }
    }

    #[test]
    fn mirrored_blocks_are_told_and_none_is_stated() {
        let catalog = Catalog::new(vec![corner(false)]);
        let found = |survey: &Survey| {
            let nothing = Segmentation::of_nothing(survey.cloud.len());
            let config = PoseConfig { noise_sd_m: Some(0.01), ..Default::default() };
            recognise_pile(survey, &nothing, &catalog, &config, &Silent).unwrap().pile
        };
        let right = found(&survey(&corner(false)));
        assert!(right.stated >= 3 && !right.mirrored, "{right:?}");
        let wrong = found(&survey(&corner(true)));
        assert!(wrong.stated == 0 && wrong.mirrored, "{wrong:?}");
        assert!(wrong.warnings()[0].contains("mirror image"), "{wrong:?}");
    }
}
