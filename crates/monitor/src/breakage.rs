//! Whether a matched block lost a piece: surface that the later epoch sees through, and the face where it broke off.
//!
//! In: the same block in both epochs, each at its own pose. Out: the area of the largest connected patch that is gone, and of the
//! face that shows where the block should be solid. The rest of it must still be where its pose says, or the pose is wrong and
//! not the block.

use crate::body::Body;
use crate::change::{Change, Class};
use crate::single::{Solids, solid};
use crate::surface_samples::{Samples, of};
use crate::view::{Look, View};
use geom::{PointGrid, Vec3};
use scene::Catalog;
use serde::{Deserialize, Serialize};

/// When surface counts as gone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BreakageConfig {
    /// Samples of a block's surface.
    pub samples: usize,
    /// Smallest connected patch, in squares of the block length.
    pub least_patch_blocks2: f32,
    /// Smallest area that shows inside the block, in the same unit.
    pub least_face_blocks2: f32,
    /// Share of the rest that must be seen.
    pub least_rest: f64,
    /// Cosine of the slant under which the later sensor must look at a place whose absence counts: a face seen at a slant has few
    /// points, and none is no wonder.
    pub least_cos: f32,
    /// A patch counts when it is so many times as large as what nine of ten pairs of these surveys show without being broken.
    pub times_usual: f64,
}

impl Default for BreakageConfig {
    fn default() -> Self {
        Self {
            samples: 900,
            least_patch_blocks2: 0.0225,
            least_face_blocks2: 0.00375,
            least_rest: 0.7,
            least_cos: 0.35,
            times_usual: 1.5,
        }
    }
}

/// Area of the largest patch that is seen through, m²; 0 when none is, or when the rest does not fit. `own` are the earlier points the block explains, where they are
/// known: a neighbour's points would show surface that was never seen.
pub(crate) fn gone_m2(
    earlier: &Body,
    later: &Body,
    catalog: &Catalog,
    samples: &[Samples],
    own: &[Vec3],
    views: [&View; 2],
    config: &BreakageConfig,
) -> f64 {
    let model = catalog.get(earlier.model);
    let samples = of(samples, earlier.model);
    let before = samples.posed(earlier.pose(model));
    let after = same_reading(earlier, later, catalog);
    let near_m = views[0].near_m;
    let grid = (!own.is_empty()).then(|| PointGrid::new(own, near_m));
    let shows = |p: Vec3| match &grid {
        Some(grid) => grid.nearest_within(p, near_m).is_some(),
        None => views[0].has_point(p),
    };
    let shown: Vec<usize> =
        before.enumerate().filter(|(_, (p, _))| shows(*p)).map(|(i, _)| i).collect();
    let at: Vec<(Vec3, Vec3)> = samples.posed(after.pose(model)).collect();
    let looks: Vec<Look> =
        shown.iter().map(|&i| views[1].look_strictly(at[i].0, at[i].1, config.least_cos)).collect();
    let through: Vec<Vec3> = shown
        .iter()
        .zip(&looks)
        .filter(|(_, l)| **l == Look::Through)
        .map(|(&i, _)| samples.position[i])
        .collect();
    let patch = largest_patch(&through, 2.0 * samples.area_m2.sqrt());
    let seen = looks.iter().filter(|l| **l == Look::Seen).count();
    let rest = shown.len() - patch;
    let fits = seen as f64 >= config.least_rest * rest as f64 && rest > patch;
    if fits { f64::from(patch as f32 * samples.area_m2) } else { 0.0 }
}

/// The same of a block that rolled, whose symmetry does not tell which place is which: the largest patch that its own epoch sees through, wherever
/// on the block it is, less that of the earlier epoch. The block of one epoch alone: the surface is all of it.
pub(crate) fn gone_by_itself_m2(
    earlier: &Body,
    later: &Body,
    catalog: &Catalog,
    samples: &[Samples],
    views: [&View; 2],
    config: &BreakageConfig,
) -> f64 {
    let area_m2 = of(samples, earlier.model).area_m2;
    let patch = |body: &Body, view: &View| own_patch(body, catalog, samples, view, config);
    match (patch(earlier, views[0]), patch(later, views[1])) {
        (Some(before), Some(after)) => f64::from(after.saturating_sub(before) as f32 * area_m2),
        _ => 0.0,
    }
}

/// Places of the largest patch of a block that its own epoch sees through; `None` where the rest of it does not fit.
fn own_patch(
    body: &Body,
    catalog: &Catalog,
    samples: &[Samples],
    view: &View,
    config: &BreakageConfig,
) -> Option<usize> {
    let samples = of(samples, body.model);
    let looks: Vec<Look> = samples
        .posed(body.pose(catalog.get(body.model)))
        .map(|(p, n)| view.look_strictly(p, n, config.least_cos))
        .collect();
    let places = looks.iter().zip(&samples.position);
    let through: Vec<Vec3> =
        places.filter(|(l, _)| **l == Look::Through).map(|(_, p)| *p).collect();
    let patch = largest_patch(&through, 2.0 * samples.area_m2.sqrt());
    let seen = looks.iter().filter(|l| **l == Look::Seen).count();
    let rest = seen + through.len() - patch;
    (seen as f64 >= config.least_rest * rest as f64 && seen > patch).then_some(patch)
}

/// What shows where a block should be solid: the face where a piece of it broke off. Whichever way it rolled, no whole block has any.
pub(crate) struct Faces<'a> {
    pub catalog: &'a Catalog,
    pub samples: &'a [Samples],
    pub solids: &'a Solids,
    pub views: [&'a View; 2],
    /// Points of each epoch that none of its blocks explains.
    pub unexplained: [&'a PointGrid; 2],
    pub config: &'a BreakageConfig,
}

impl Faces<'_> {
    /// Area that shows inside the later block beyond what shows inside the earlier one, m²; 0 where the rest of it does not fit.
    pub fn area_m2(&self, earlier: &Body, later: &Body) -> f64 {
        let fits = |body: &Body, epoch: usize| {
            own_patch(body, self.catalog, self.samples, self.views[epoch], self.config).is_some()
        };
        let more = self.inside_m2(later, 1) - self.inside_m2(earlier, 0);
        if more > 0.0 && fits(later, 1) && fits(earlier, 0) { f64::from(more) } else { 0.0 }
    }

    fn inside_m2(&self, body: &Body, epoch: usize) -> f32 {
        let Some(solid) = solid(self.solids, self.catalog, body.model) else { return 0.0 };
        let (model, view) = (self.catalog.get(body.model), self.views[epoch]);
        let pose = body.pose(model);
        let depth_m = FACE_NOISES * view.noise_sd_m() + FACE_BLOCKS * model.d_box_m;
        let mut count = 0_u32;
        self.unexplained[epoch].for_each_within(body.centre.as_vec3(), model.d_max_m, |_, p, _| {
            let depth = -solid.distance_m(pose.inverse_transform_point(p));
            count += u32::from(depth > depth_m);
        });
        count as f32 * view.spacing_m().powi(2)
    }
}

/// How deep inside a block points show a face: standard deviations of the sensor's noise and block lengths.
const FACE_NOISES: f32 = 2.5;
const FACE_BLOCKS: f32 = 0.015;

/// Area from which on a patch or a face counts, in squares of the block length, after those of all pairs in that unit.
fn limit_blocks2(patches: &[f64], least: f32, config: &BreakageConfig) -> f64 {
    let mut sorted = patches.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0);
    f64::from(least).max(config.times_usual * usual)
}

/// Calls those broken of whose surface more is gone, or inside which more shows, than of the others.
pub(crate) fn broken(changes: &mut [Change], catalog: &Catalog, config: &BreakageConfig) {
    let asked = |c: &&Change| c.earlier_id.is_some() && c.later_id.is_some();
    let blocks2 =
        |c: &Change, area_m2: f64| area_m2 / f64::from(catalog.get(c.model).d_box_m).powi(2);
    let limit = |area_m2: fn(&Change) -> f64, least: f32| {
        let all: Vec<f64> = changes.iter().filter(asked).map(|c| blocks2(c, area_m2(c))).collect();
        limit_blocks2(&all, least, config)
    };
    let patch = limit(|c| c.gone_m2, config.least_patch_blocks2);
    let face = limit(|c| c.face_m2, config.least_face_blocks2);
    for change in changes {
        // A patch that is gone and the face where it was speak for the same piece.
        let evidence =
            blocks2(change, change.gone_m2) / patch + blocks2(change, change.face_m2) / face;
        if evidence >= 1.0 {
            let was = change.class.word();
            let said =
                [("of its surface is gone", change.gone_m2), ("shows inside it", change.face_m2)];
            let least_m2 = 0.05 * change.gone_m2.max(change.face_m2);
            let said = said.iter().filter(|(_, m2)| *m2 > least_m2);
            let said: Vec<String> = said.map(|(what, m2)| format!("{m2:.2} m² {what}")).collect();
            change.say(&format!("{}; otherwise {was}", said.join(", ")));
            change.class = Class::PossiblyBroken;
        } else {
            (change.gone_m2, change.face_m2) = (0.0, 0.0);
        }
    }
}

/// The later block with the rotation, of all that its symmetry allows, nearest the earlier one: then a sample is the same place
/// of the concrete in both epochs.
fn same_reading(earlier: &Body, later: &Body, catalog: &Catalog) -> Body {
    let turn = crate::body::difference(earlier, later, catalog).turn();
    let rotation = geom::DQuat::from_scaled_axis(turn) * earlier.rotation;
    Body { rotation, ..later.clone() }
}

/// Number of places in the largest group connected by steps of at most `step_m`.
fn largest_patch(places: &[Vec3], step_m: f32) -> usize {
    let grid = PointGrid::new(places, step_m);
    let mut seen = vec![false; places.len()];
    let mut largest = 0;
    for start in 0..places.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let (mut open, mut count) = (vec![start], 0);
        while let Some(i) = open.pop() {
            count += 1;
            grid.for_each_within(places[i], step_m, |j, _, _| {
                if !std::mem::replace(&mut seen[j as usize], true) {
                    open.push(j as usize);
                }
            });
        }
        largest = largest.max(count);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_must_stand_out_among_the_others() {
        let config = BreakageConfig::default();
        let least = config.least_patch_blocks2;
        assert_eq!(limit_blocks2(&[], least, &config), f64::from(least));
        assert_eq!(limit_blocks2(&[0.0; 20], least, &config), f64::from(least));
        // Surveys that leave holes everywhere: a hole is no breakage.
        let holes: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-3).collect();
        assert_eq!(limit_blocks2(&holes, least, &config), config.times_usual * holes[90]);
    }

    #[test]
    fn the_largest_of_two_groups_counts() {
        let line = |start: f32, n: usize| (0..n).map(move |i| Vec3::X * (start + i as f32 * 0.1));
        let places: Vec<Vec3> = line(0.0, 5).chain(line(9.0, 8)).collect();
        assert_eq!(largest_patch(&places, 0.15), 8);
        assert_eq!(largest_patch(&[], 0.15), 0);
    }
}
