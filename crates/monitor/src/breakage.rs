//! Surface of a matched block that the earlier epoch showed and the later one sees through.
//!
//! In: the same block in both epochs, each at its own pose. Out: the area of the largest connected patch that is gone. The
//! rest of the block must still be where its pose says, or the pose is wrong and not the block.

use crate::body::Body;
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
            least_patch_blocks2: 0.02,
            least_rest: 0.7,
            least_cos: 0.35,
            times_usual: 2.0,
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
    let model = catalog.get(earlier.model);
    let samples = of(samples, earlier.model);
    let patch = |body: &Body, view: &View| -> Option<usize> {
        let at: Vec<(Vec3, Vec3)> = samples.posed(body.pose(model)).collect();
        let looks: Vec<Look> =
            at.iter().map(|(p, n)| view.look_strictly(*p, *n, config.least_cos)).collect();
        let places = looks.iter().zip(&samples.position);
        let through: Vec<Vec3> =
            places.filter(|(l, _)| **l == Look::Through).map(|(_, p)| *p).collect();
        let patch = largest_patch(&through, 2.0 * samples.area_m2.sqrt());
        let seen = looks.iter().filter(|l| **l == Look::Seen).count();
        let rest = seen + through.len() - patch;
        (seen as f64 >= config.least_rest * rest as f64 && seen > patch).then_some(patch)
    };
    match (patch(earlier, views[0]), patch(later, views[1])) {
        (Some(before), Some(after)) => {
            f64::from(after.saturating_sub(before) as f32 * samples.area_m2)
        }
        _ => 0.0,
    }
}

/// Area from which on a patch counts, in squares of the block length, after the patches of all pairs in that unit.
pub(crate) fn limit_blocks2(patches: &[f64], config: &BreakageConfig) -> f64 {
    let mut sorted = patches.to_vec();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0);
    f64::from(config.least_patch_blocks2).max(config.times_usual * usual)
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
        let least = f64::from(config.least_patch_blocks2);
        assert_eq!(limit_blocks2(&[], &config), least);
        assert_eq!(limit_blocks2(&[0.0; 20], &config), least);
        // Surveys that leave holes everywhere: a hole is no breakage.
        let holes: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-3).collect();
        assert_eq!(limit_blocks2(&holes, &config), 2.0 * holes[90]);
    }

    #[test]
    fn the_largest_of_two_groups_counts() {
        let line = |start: f32, n: usize| (0..n).map(move |i| Vec3::X * (start + i as f32 * 0.1));
        let places: Vec<Vec3> = line(0.0, 5).chain(line(9.0, 8)).collect();
        assert_eq!(largest_patch(&places, 0.15), 8);
        assert_eq!(largest_patch(&[], 0.15), 0);
    }
}
