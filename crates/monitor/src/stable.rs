//! The ground that does not move, and the registration on it.

use crate::motion::Motion;
use crate::registration::{Basis, Patches, Registration, on_ground};
use crate::{Epoch, MonitorError};
use geom::{DVec3, Vec3, normals, thin_from_lowest};
use serde::{Deserialize, Serialize};

/// Ground that the site names as stable: polygons in site coordinates (east, north), such as the crown wall. Empty: none is named.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StableGround {
    /// Corners of each part, at least three.
    pub polygons: Vec<Vec<[f64; 2]>>,
}

impl StableGround {
    /// Refuses named ground that a survey hardly shows: without it no movement would be absolute, and nobody would know.
    pub(crate) fn check(&self, earlier: &Epoch, later: &Epoch) -> Result<(), MonitorError> {
        if self.polygons.is_empty() {
            return Ok(());
        }
        for (epoch, name) in [(earlier, "earlier"), (later, "later")] {
            let frame = &epoch.survey.frame;
            let within = |p: &&Vec3| self.contains(frame.site_from_local(**p));
            let points = epoch.survey.cloud.position_m.iter().filter(within).take(LEAST_POINTS);
            let points = points.count();
            if points < LEAST_POINTS {
                return Err(MonitorError::NoStableGround {
                    epoch: name,
                    points,
                    least: LEAST_POINTS,
                });
            }
        }
        Ok(())
    }

    fn contains(&self, p: DVec3) -> bool {
        self.polygons.iter().any(|corners| inside(corners, p.x, p.y))
    }
}

/// Even-odd rule.
fn inside(polygon: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut odd = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
            odd = !odd;
        }
    }
    odd
}

/// Cell in which points are thinned to one, radius of a normal and reach of a match, in block lengths.
const CELL: f64 = 0.06;
const NORMAL: f64 = 0.2;
const REACH: f64 = 0.15;
/// Fewest points of ground.
const LEAST_POINTS: usize = 50;

/// The later survey on the earlier one's ground: that named as stable, else whatever no block explains. `points` are
/// the later survey's in the earlier frame. `None`: too little ground, or it does not agree with itself.
pub(crate) fn registered(
    epochs: [&Epoch; 2],
    points: &[Vec3],
    stable: &StableGround,
    size_m: f64,
    start: Motion,
    cluster_m: f64,
) -> Option<Registration> {
    let [earlier, later] = epochs;
    let named = !stable.polygons.is_empty();
    let keep = |epoch: &Epoch| -> Vec<usize> {
        let mut open = vec![true; epoch.survey.cloud.len()];
        if !named {
            for i in epoch.blocks.iter().flat_map(|b| &b.points) {
                if let Some(o) = open.get_mut(*i as usize) {
                    *o = false;
                }
            }
        }
        let frame = &epoch.survey.frame;
        let cloud = &epoch.survey.cloud.position_m;
        let kept =
            |i: &usize| open[*i] && (!named || stable.contains(frame.site_from_local(cloud[*i])));
        (0..cloud.len()).filter(kept).collect()
    };
    if !named && epochs.iter().any(|e| e.blocks.iter().all(|b| b.points.is_empty())) {
        // Nobody says which points are blocks.
        return None;
    }
    let thinned = |points: Vec<Vec3>| -> Vec<Vec3> {
        let kept = thin_from_lowest(&points, (CELL * size_m) as f32).kept;
        kept.iter().map(|&i| points[i as usize]).collect()
    };
    let own = &earlier.survey.cloud.position_m;
    let position = thinned(keep(earlier).into_iter().map(|i| own[i]).collect());
    let moving = thinned(keep(later).into_iter().map(|i| points[i]).collect());
    if position.len() < LEAST_POINTS || moving.len() < LEAST_POINTS {
        return None;
    }
    let normal = normals(&position, (NORMAL * size_m) as f32, &|_| Vec3::Z);
    let noise = |e: &Epoch| f64::from(e.survey.sensor.noise_sd_m(0.5 * size_m as f32));
    let noise_sd_m = noise(earlier).hypot(noise(later));
    let basis = if named { Basis::StableGround } else { Basis::UnexplainedGround };
    let reach_m = (REACH * size_m) as f32;
    let patches = Patches { position, normal };
    on_ground(basis, &patches, &moving, reach_m, noise_sd_m, start, cluster_m)
}
