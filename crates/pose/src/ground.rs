//! The bed under a pile: a hypothesis that competes with the blocks for the points, never a fact.
//!
//! The lowest points of a survey lie on a bed, or on the lowest blocks of a pile whose bed nobody measured. A plane
//! through them is good enough to tell where blocks need not be looked for. Whether it is a bed is known only after a
//! first recognition: it may have what no well-held block explains, where that is level; and what lies below it is
//! hidden, not solid. Once a plane invented from the lowest blocks cost a third of
//! the blocks of piles without a bed.

use crate::EvidenceConfig;
use crate::acceptance::{Acceptance, Candidate};
use crate::evidence::reach_m;
use crate::fit::{FitPoint, covariance};
use crate::measured::Measured;
use crate::template::Template;
use geom::{Bounds, Plane, SeedTree, Vec3, find_plane};

/// A bed: stones stand out of its plane and gaps reach below.
#[derive(Clone, Copy, Debug)]
pub struct Bed {
    /// Its middle.
    pub plane: Plane,
    /// How far it reaches above and below the plane, metres.
    pub relief_m: f32,
}

impl Bed {
    /// How far from the plane points are still the bed's, metres.
    fn depth_m(&self, reach_m: f32) -> f32 {
        self.relief_m + reach_m
    }
}

/// Where a bed shows itself: which working points it may have.
#[derive(Clone, Debug)]
pub struct Ground {
    /// How well it explains each working point, in [0, 1].
    pub explained: Vec<f32>,
    /// Working points where no block is looked for: the bed's own and, on a bed that shows itself, all that are as low.
    pub skipped: Vec<bool>,
    /// Whether most points at its height lie on level pieces: of a plane through blocks hardly any do.
    pub seen: bool,
    /// Area it was measured on, m².
    pub area_m2: f32,
}

/// A bed steeper than this is a wall, radians.
const STEEPEST_RAD: f32 = 0.6;
/// Part of the low points a bed holds at least.
const FEWEST_ON_IT: usize = 10;
/// One in so many points may lie below a bed.
const BELOW: usize = 50;
/// A bed has points for so many blocks' lengths squared at least.
const SMALLEST_AREA: f32 = 1.0;
/// What a well-held block adds at least, in halves of its surface.
const HELD_GAIN: f32 = 0.12;
/// Share of its surface that ought to be seen and is.
const HELD_AGREEMENT: f32 = 0.85;
/// Standard deviation of its place and turn at most, over a true positive's limits.
const HELD_SD: f32 = 0.5;
/// Mean distance of its points over the noise, beside a hundredth of d_max: stones lie farther off.
const HELD_OFF: f32 = 1.5;

/// The plane the lowest points lie on, if they do: a bed or a floor has nothing but outliers below it. Rubble of
/// stones up to a quarter of a block still counts as a plane with relief.
pub fn lowest_plane(position: &[Vec3], d_max_m: f32, noise_sd_m: f32) -> Option<Bed> {
    let bounds = Bounds::of(position.iter().copied());
    if bounds.is_empty() {
        return None;
    }
    // Low points: near the lowest of their column one block wide.
    let cell = 0.75 * d_max_m;
    let nx = (bounds.size().x / cell) as usize + 1;
    let ny = (bounds.size().y / cell) as usize + 1;
    let column = |p: Vec3| {
        let at = (p - bounds.min) / cell;
        (at.y as usize).min(ny - 1) * nx + (at.x as usize).min(nx - 1)
    };
    let mut lowest = vec![f32::INFINITY; nx * ny];
    for &p in position {
        let low = &mut lowest[column(p)];
        *low = low.min(p.z);
    }
    let thickness_m = (3.0 * noise_sd_m).max(0.08 * d_max_m);
    let low: Vec<Vec3> =
        position.iter().copied().filter(|&p| p.z < lowest[column(p)] + 3.0 * thickness_m).collect();
    // The same plane whatever the user's seed: chance has no say in what is found.
    let seed = SeedTree::new(0).child("bed", 0);
    let (plane, inliers) = find_plane(&low, thickness_m, Some(STEEPEST_RAD), seed)?;
    let below = position.iter().filter(|&&p| plane.distance_m(p) < -3.0 * thickness_m).count();
    if inliers * FEWEST_ON_IT < low.len() || below * BELOW > position.len() {
        return None;
    }
    let square: f32 = low
        .iter()
        .map(|&p| plane.distance_m(p))
        .filter(|d| d.abs() <= thickness_m)
        .map(|d| d * d)
        .sum();
    Some(Bed { plane, relief_m: 2.0 * (square / inliers as f32).sqrt() })
}

/// Whether a candidate is beyond doubt by itself: held in every direction by points as near as the noise.
fn well_held(candidate: &Candidate, gain: f32, template: &Template, measured: &Measured) -> bool {
    if gain < HELD_GAIN || candidate.evidence.agreement < HELD_AGREEMENT {
        return false;
    }
    let points: Vec<FitPoint> =
        candidate.evidence.explained.iter().map(|e| measured.fit_point(e.0)).collect();
    let off_m = crate::finish::distance_m(template, &candidate.at, &points);
    if off_m > HELD_OFF * measured.noise_sd_m + 0.01 * template.model.d_max_m {
        return false;
    }
    let Some(covariance) =
        covariance(&template.fit_model(), &points, &candidate.at, measured.noise_sd_m)
    else {
        return false;
    };
    let (shift, turn) = crate::finish::largest_sd(&covariance, template.model);
    shift.max(turn) < HELD_SD
}

/// The bed that is left when the well-held blocks have their points; `None` when that is none.
pub fn after_recognition(
    measured: &Measured,
    pool: &[Candidate],
    acceptance: &Acceptance,
    templates: &[Template],
    config: &EvidenceConfig,
) -> Option<Ground> {
    let held: Vec<&Candidate> = acceptance
        .accepted
        .iter()
        .filter(|a| {
            let c = &pool[a.0];
            well_held(c, a.1, &templates[c.template], measured)
        })
        .map(|a| &pool[a.0])
        .collect();
    let free = unexplained_by(&held, measured, templates, config);
    let position: Vec<Vec3> = free.iter().map(|&i| measured.position[i as usize]).collect();
    let smallest = templates.iter().map(|t| t.model.d_max_m).fold(f32::INFINITY, f32::min);
    let bed = match measured.stated_bed {
        Some(stated) => stated,
        None => lowest_plane(&position, smallest, measured.noise_sd_m)?,
    };
    let ground = ground(bed, &free, measured, reach_m(measured, &templates[0], config));
    let large = ground.area_m2 > SMALLEST_AREA * smallest * smallest;
    (measured.stated_bed.is_some() || ground.seen && large).then_some(ground)
}

/// A first guess: whatever is as low as the plane through the lowest points is not searched at first.
pub fn guess(bed: Bed, measured: &Measured, reach_m: f32) -> Ground {
    let all: Vec<u32> = (0..measured.position.len() as u32).collect();
    let mut ground = ground(bed, &all, measured, reach_m);
    for (skipped, &p) in ground.skipped.iter_mut().zip(&measured.position) {
        *skipped |= bed.plane.distance_m(p) < bed.depth_m(reach_m);
    }
    ground
}

/// Where the plane shows among these working points: on level pieces half a block wide and more.
fn ground(bed: Bed, of: &[u32], measured: &Measured, reach_m: f32) -> Ground {
    let depth_m = bed.depth_m(reach_m);
    let d_max_m = measured.smallest_d_max_m;
    let stones_m = depth_m.max(STONES * d_max_m);
    let position: Vec<Vec3> = of.iter().map(|&i| measured.position[i as usize]).collect();
    let level = Level::new(&bed.plane, stones_m, &position, d_max_m);
    let mut explained = vec![0.0; measured.position.len()];
    let mut low = vec![false; measured.position.len()];
    let (mut on, mut level_on) = (0, 0);
    for &i in of {
        let p = measured.position[i as usize];
        let height_m = bed.plane.distance_m(p);
        let off = height_m / depth_m;
        let normal = measured.normal[i as usize];
        let facing = if normal == Vec3::ZERO { 0.6 } else { normal.dot(bed.plane.normal) };
        if off >= 1.0 {
            continue;
        }
        low[i as usize] = true;
        if off > -1.0 && facing > 0.0 {
            on += 1;
            if level.at(p) {
                explained[i as usize] = (1.0 - off * off) * facing;
                level_on += 1;
            }
        }
    }
    // Stones and gaps belong to a bed that is seen; under blocks seen from above nothing is level.
    let seen = level_on as f32 > SEEN_SHARE * on as f32;
    let skipped = (0..low.len()).map(|i| explained[i] > 0.0 || seen && low[i]).collect();
    Ground { explained, skipped, seen, area_m2: level_on as f32 * measured.point_area_m2 }
}

/// Columns over the plan: where nearly all points lie on the plane.
struct Level {
    low: Vec3,
    cell_m: f32,
    count: [usize; 2],
    is_level: Vec<bool>,
}

/// Of the points at its height so many lie on level pieces of a bed that is seen.
const SEEN_SHARE: f32 = 0.4;
/// Stones of a bed stand out of it by so much of d_max.
const STONES: f32 = 0.2;
/// A level piece is this wide, in cells of a fifth of d_max: half a block to each side.
const LEVEL_CELLS: usize = 2;
/// Of the points over a level piece so many lie on the plane.
const LEVEL_SHARE: f32 = 0.8;

impl Level {
    fn new(plane: &Plane, depth_m: f32, points: &[Vec3], d_max_m: f32) -> Self {
        let bounds = Bounds::of(points.iter().copied());
        let cell_m = (0.2 * d_max_m).max(bounds.size().max_element() / 4096.0);
        let count = [bounds.size().x, bounds.size().y].map(|s| (s / cell_m) as usize + 1);
        let mut level =
            Self { low: bounds.min, cell_m, count, is_level: vec![false; count[0] * count[1]] };
        let mut on = vec![0.0_f32; level.is_level.len()];
        let mut all = on.clone();
        for &p in points {
            let column = level.column(p);
            all[column] += 1.0;
            on[column] += f32::from(u8::from(plane.distance_m(p).abs() < depth_m));
        }
        for y in 0..count[1] {
            for x in 0..count[0] {
                let (mut here, mut total) = (0.0, 0.0);
                for j in y.saturating_sub(LEVEL_CELLS)..(y + LEVEL_CELLS + 1).min(count[1]) {
                    for i in x.saturating_sub(LEVEL_CELLS)..(x + LEVEL_CELLS + 1).min(count[0]) {
                        here += on[j * count[0] + i];
                        total += all[j * count[0] + i];
                    }
                }
                level.is_level[y * count[0] + x] = here > LEVEL_SHARE * total;
            }
        }
        level
    }

    fn column(&self, p: Vec3) -> usize {
        let at = (p - self.low) / self.cell_m;
        (at.y as usize).min(self.count[1] - 1) * self.count[0]
            + (at.x as usize).min(self.count[0] - 1)
    }

    fn at(&self, p: Vec3) -> bool {
        self.is_level[self.column(p)]
    }
}

/// Working points away from the surfaces of these blocks, ascending.
fn unexplained_by(
    blocks: &[&Candidate],
    measured: &Measured,
    templates: &[Template],
    config: &EvidenceConfig,
) -> Vec<u32> {
    let mut open = vec![true; measured.position.len()];
    for block in blocks {
        let template = &templates[block.template];
        let reach = 2.0 * reach_m(measured, template, config);
        let block_from_site = block.at.pose(template.model.centre).inverse();
        let far_m = template.model.d_max_m + reach;
        measured.grid.for_each_within(block.at.centre, far_m, |i, p, _| {
            if template.field.distance_m(block_from_site * p) < reach {
                open[i as usize] = false;
            }
        });
    }
    (0..open.len() as u32).filter(|&i| open[i as usize]).collect()
}
