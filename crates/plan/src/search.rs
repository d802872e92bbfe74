//! Policy `search`: many poses laid onto the height map, the best few verified by physics (ours).
//!
//! For each attitude × position the height at which the lowered block first touches is exact on the raster. Scored by
//! how deep the centroid gets, how much void stays trapped under it, what protrudes above the design, and whether
//! the cells near contact surround the centre of mass. The best few that differ are dropped in local worlds; the one that
//! really rests deepest and closest wins.

use crate::{
    Settings, acceptance, attitudes, rounds, signs,
    silhouette::{self, Silhouette},
    site::TypeToPlace,
    stack::Stack,
    windows::Window,
};
use geom::{Pose, SeedTree, Vec2, Vec3};
use scene::{BlockModel, ModelId, Placement, PlacementState};
use std::ops::RangeInclusive;

/// A block settles this much, in d_box, below where it first touches: so much more overflow is let through to the drop.
const SETTLES: f32 = 0.05;
/// Lowest poses scored in full for each that is verified. Free choice: bounds the sorting.
const SCORED_FOR_EACH: usize = 64;
/// Candidates nearer than this, in d_box,
const SAME_PLACE: f32 = 0.1;
/// and turned by less against each other are one. Free choices: they would come to rest alike.
const SAME_TURN_RAD: f32 = 0.5;
/// Height above first contact from which a verified candidate falls, in d_box: the raster's own error.
const CLEARANCE: f32 = 0.005;
/// A gap below this, in d_box, is contact. Free choice: somewhat less than a raster cell for blocks of 2 m.
const CONTACT: f32 = 0.04;
/// What a pose that will tip over is charged, in d_box of height. Free choice.
const TIPS: f32 = 0.15;
/// Widest gap between the directions of its contacts on which a block stands: a little less than half a turn.
const WIDEST_GAP_RAD: f32 = 0.95 * std::f32::consts::PI;

/// Attitudes prepared once for the block and the raster.
pub(crate) struct Attitudes {
    silhouettes: Vec<Silhouette>,
}

impl Attitudes {
    /// The set is turned as a whole by the seed, so that the spread of plans over seeds shows what it decides.
    pub fn new(model: &BlockModel, settings: &Settings, seed: SeedTree) -> Self {
        let turn = attitudes::random(&mut seed.rng());
        let set = attitudes::spread(settings.search.attitudes as usize, &model.symmetry);
        Self {
            silhouettes: set
                .into_iter()
                .map(|q| Silhouette::new(model, turn * q, settings.cell_m))
                .collect(),
        }
    }
}

/// A pose with its geometric score; lower is better.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub pose: Pose,
    pub score_m: f32,
    centre: Vec3,
    attitude: usize,
}

/// The surface and the design around a window, with a border no block may enter.
struct Patch {
    side: usize,
    x0: isize,
    y0: isize,
    surface: Vec<f32>,
    design: Vec<f32>,
}

/// Positions at which an attitude is laid onto the surface, in cells from the window's lower corner.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub x: RangeInclusive<usize>,
    pub y: RangeInclusive<usize>,
    pub step: usize,
}

/// Cells from a window's middle to its edge.
pub(crate) fn reach_cells(settings: &Settings) -> usize {
    (0.5 * settings.window_m / settings.cell_m).ceil() as usize
}

impl Attitudes {
    /// The best poses of a window among every attitude at every position.
    pub fn candidates(
        &self,
        stack: &Stack,
        settings: &Settings,
        model: ModelId,
        window: &Window,
    ) -> Vec<Candidate> {
        let reach = reach_cells(settings);
        let everywhere = Places {
            x: 0..=2 * reach,
            y: 0..=2 * reach,
            step: settings.search.step_cells as usize,
        };
        let verify = settings.search.verify as usize;
        candidates(
            stack,
            settings,
            model,
            &self.silhouettes,
            |_| everywhere.clone(),
            verify,
            window,
        )
    }
}

/// The best `verify` poses of a window, best first, all different; none when nothing fits under the design.
pub(crate) fn candidates(
    stack: &Stack,
    settings: &Settings,
    model: ModelId,
    silhouettes: &[Silhouette],
    places: impl Fn(usize) -> Places,
    verify: usize,
    window: &Window,
) -> Vec<Candidate> {
    let block = stack.catalog.get(model);
    let Some(half) = silhouettes.first().map(|s| s.half) else { return Vec::new() };
    let reach = reach_cells(settings);
    let Some(patch) = Patch::around(stack, settings, window.centre, half + reach) else {
        return Vec::new();
    };
    let allowed_m = settings.overflow_m + SETTLES * block.d_box_m;
    let mut lowest = Lowest::new(SCORED_FOR_EACH * verify, allowed_m);
    for (a, silhouette) in silhouettes.iter().enumerate() {
        let places = places(a);
        for py in places.y.step_by(places.step) {
            for px in places.x.clone().step_by(places.step) {
                let design = patch.design[(py + half) * patch.side + px + half];
                if let Some(z) = patch.contact_m(silhouette, px, py, design + lowest.limit_m) {
                    lowest.offer(Laid { above_m: z - design, attitude: a, px, py, z });
                }
            }
        }
    }
    let mut scored: Vec<Candidate> = lowest
        .into_sorted()
        .into_iter()
        .map(|l| {
            let silhouette = &silhouettes[l.attitude];
            let centre = patch.place(stack, l.px + half, l.py + half, l.z);
            let score_m = l.above_m + patch.penalty_m(silhouette, l.px, l.py, l.z, block, settings);
            let pose = silhouette::pose_at(block, silhouette.rotation, centre);
            Candidate { pose, score_m, centre, attitude: l.attitude }
        })
        .collect();
    // Stable, on an order that is the same every time.
    scored.sort_by(|x, y| x.score_m.total_cmp(&y.score_m));
    distinct(scored, block, silhouettes, verify)
}

/// A silhouette laid onto the patch.
#[derive(Clone, Copy)]
struct Laid {
    /// Centroid above the design.
    above_m: f32,
    attitude: usize,
    px: usize,
    py: usize,
    z: f32,
}

impl Laid {
    fn rank(&self) -> (u32, usize, usize, usize) {
        // Order-preserving bits of a finite float.
        let bits = self.above_m.to_bits();
        let key = if bits >> 31 == 1 { !bits } else { bits | 0x8000_0000 };
        (key, self.attitude, self.py, self.px)
    }
}

/// The `count` deepest so far; `limit_m` tightens as better ones come, so that most need not be laid to the end.
struct Lowest {
    count: usize,
    limit_m: f32,
    held: Vec<Laid>,
}

impl Lowest {
    fn new(count: usize, limit_m: f32) -> Self {
        Self { count, limit_m, held: Vec::with_capacity(2 * count) }
    }

    fn offer(&mut self, laid: Laid) {
        self.held.push(laid);
        if self.held.len() >= 2 * self.count {
            self.cut();
        }
    }

    fn cut(&mut self) {
        if self.held.len() > self.count {
            self.held.select_nth_unstable_by_key(self.count - 1, Laid::rank);
            self.held.truncate(self.count);
            self.limit_m = self.held[self.count - 1].above_m;
        }
    }

    fn into_sorted(mut self) -> Vec<Laid> {
        self.cut();
        self.held.sort_unstable_by_key(Laid::rank);
        self.held
    }
}

/// The first few that differ from all before them by a position or an attitude.
fn distinct(
    scored: Vec<Candidate>,
    block: &BlockModel,
    silhouettes: &[Silhouette],
    verify: usize,
) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in scored {
        let differs = kept.iter().all(|k| {
            (k.centre - candidate.centre).length() > SAME_PLACE * block.d_box_m
                || block.symmetry.rotation_error_rad(
                    silhouettes[k.attitude].rotation,
                    silhouettes[candidate.attitude].rotation,
                ) > SAME_TURN_RAD
        });
        if differs {
            kept.push(candidate);
            if kept.len() == verify {
                break;
            }
        }
    }
    kept
}

/// Drops the candidates and keeps the best that passes; the others count as tried only when none does. The shake costs as
/// much as the drop: it is asked from the best on, and mostly once.
pub(crate) fn best(
    kind: &TypeToPlace,
    stack: &Stack,
    found: &[Candidate],
    round: u32,
) -> Vec<Placement> {
    let (resting, mut failed) = resting(kind, stack, found, round);
    for r in resting {
        let placement = r.dropped.shaken(kind);
        if placement.state == PlacementState::Kept {
            return vec![placement];
        }
        failed.push((r.number, placement));
    }
    failed.sort_by_key(|(number, _)| *number);
    failed.into_iter().map(|(_, placement)| placement).collect()
}

/// A candidate that came to rest within the rules, but for the shake.
pub(crate) struct Resting<'a> {
    cost: f32,
    number: usize,
    pub dropped: rounds::Dropped<'a>,
}

/// Those that came to rest, cheapest first, and those that were removed.
pub(crate) fn resting<'a>(
    kind: &'a TypeToPlace,
    stack: &Stack,
    found: &[Candidate],
    round: u32,
) -> (Vec<Resting<'a>>, Vec<(usize, Placement)>) {
    let clearance_m = CLEARANCE * stack.catalog.get(kind.model).d_box_m;
    let (mut failed, mut resting): (Vec<(usize, Placement)>, Vec<Resting>) = Default::default();
    for (number, candidate) in found.iter().enumerate() {
        let drop = Pose::from_parts(
            candidate.pose.translation + Vec3::Z * clearance_m,
            candidate.pose.rotation,
        );
        let dropped =
            rounds::dropped(kind, stack, &drop, kind.settings.displacement_limit_m, round);
        if dropped.placement.state == PlacementState::Kept {
            let cost = cost(kind, stack, &dropped);
            resting.push(Resting { cost, number, dropped });
        } else {
            failed.push((number, dropped.placement));
        }
    }
    resting.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.number.cmp(&b.number)));
    (resting, failed)
}

/// What speaks against a block that rests.
pub(crate) fn cost(kind: &TypeToPlace, stack: &Stack, dropped: &rounds::Dropped) -> f32 {
    let (weights, impact, p) = (&kind.settings.search, dropped.impact, &dropped.placement);
    if let Some(objective) = &kind.by_worth {
        return -objective.among(kind, stack, p);
    }
    if let Some(learned) = &weights.weights {
        return learned.cost(&signs::signs_of(kind, stack, p, &impact));
    }
    let block = stack.catalog.get(kind.model);
    let area = block.volume_m3.powf(2.0 / 3.0);
    acceptance::above_design_m(stack, p.rest * block.centre)
        + (weights.trapped_weight * impact.raised_m3
            + weights.protrusion_weight * impact.protruding_m3)
            / area
}

impl Patch {
    fn around(stack: &Stack, settings: &Settings, centre: Vec2, half: usize) -> Option<Self> {
        let (cx, cy) = stack.surface.cell_of(centre.x, centre.y)?;
        let (x0, y0) = (cx as isize - half as isize, cy as isize - half as isize);
        let side = 2 * half + 1;
        let mut surface = vec![f32::INFINITY; side * side];
        let mut design = vec![f32::NAN; side * side];
        for j in 0..side {
            for i in 0..side {
                let (x, y) = (x0 + i as isize, y0 + j as isize);
                if x < 0
                    || y < 0
                    || x >= stack.surface.nx as isize
                    || y >= stack.surface.ny as isize
                {
                    continue;
                }
                let level = stack.design.at(x as usize, y as usize);
                design[j * side + i] = level;
                if settings.inside == crate::Inside::Centre || level.is_finite() {
                    surface[j * side + i] = stack.surface.at(x as usize, y as usize);
                }
            }
        }
        Some(Self { side, x0, y0, surface, design })
    }

    /// Height at which the silhouette with its corner at (px, py) stops; `None` above `limit_m` or over the boundary.
    fn contact_m(
        &self,
        silhouette: &Silhouette,
        px: usize,
        py: usize,
        limit_m: f32,
    ) -> Option<f32> {
        let mut z = f32::NEG_INFINITY;
        // A quarter of the rows nearly always shows that a pose is too high.
        for first in [0, 2, 1, 3] {
            z = z.max(self.contact_of_rows_m(silhouette, px, py, first));
            if !(z <= limit_m) {
                return None;
            }
        }
        z.is_finite().then_some(z)
    }

    /// The same for every fourth row from `first`.
    fn contact_of_rows_m(
        &self,
        silhouette: &Silhouette,
        px: usize,
        py: usize,
        first: usize,
    ) -> f32 {
        let side = silhouette.side();
        let mut highest = [f32::NEG_INFINITY; 4];
        for (j, &(start, end)) in silhouette.rows.iter().enumerate().skip(first).step_by(4) {
            let from = (py + j) * self.side + px;
            let (surface4, surface_rest) = self.surface[from + start..from + end].as_chunks::<4>();
            let (under4, under_rest) =
                silhouette.under[j * side + start..j * side + end].as_chunks::<4>();
            for (s, u) in surface4.iter().zip(under4) {
                for lane in 0..4 {
                    let gap = s[lane] - u[lane];
                    highest[lane] = if gap > highest[lane] { gap } else { highest[lane] };
                }
            }
            for (s, u) in surface_rest.iter().zip(under_rest) {
                highest[0] = highest[0].max(s - u);
            }
        }
        highest.into_iter().fold(f32::NEG_INFINITY, f32::max)
    }

    fn place(&self, stack: &Stack, i: usize, j: usize, z: f32) -> Vec3 {
        let map = &stack.surface;
        let x = map.origin[0] + (self.x0 + i as isize) as f32 * map.cell_m;
        let y = map.origin[1] + (self.y0 + j as isize) as f32 * map.cell_m;
        Vec3::new(x, y, z)
    }

    /// What speaks against a pose besides its height, as a height.
    fn penalty_m(
        &self,
        silhouette: &Silhouette,
        px: usize,
        py: usize,
        z: f32,
        block: &BlockModel,
        settings: &Settings,
    ) -> f32 {
        let side = silhouette.side();
        let near_m = CONTACT * block.d_box_m;
        let (mut trapped, mut protruding) = (0.0_f32, 0.0_f32);
        let mut contacts: Vec<Vec2> = Vec::new();
        for (j, &(first, end)) in silhouette.rows.iter().enumerate() {
            for i in first..end {
                let (under, top) = (silhouette.under[j * side + i], silhouette.top[j * side + i]);
                if under == f32::INFINITY {
                    continue;
                }
                let at = (py + j) * self.side + px + i;
                let gap = z + under - self.surface[at];
                trapped += gap;
                let design = self.design[at];
                if design.is_finite() {
                    protruding += (z + top - design.max(self.surface[at])).max(0.0);
                }
                if gap < near_m {
                    contacts.push(Vec2::new(
                        i as f32 - silhouette.half as f32,
                        j as f32 - silhouette.half as f32,
                    ));
                }
            }
        }
        let area = settings.cell_m * settings.cell_m / block.volume_m3.powf(2.0 / 3.0);
        let tips = if surrounds(&contacts) { 0.0 } else { TIPS * block.d_box_m };
        settings.search.trapped_weight * trapped * area
            + settings.search.protrusion_weight * protruding * area
            + tips
    }
}

/// Whether the points surround the origin: no half-plane through it is free of them.
fn surrounds(points: &[Vec2]) -> bool {
    let mut angles: Vec<f32> =
        points.iter().filter(|p| p.length_squared() > 1.0).map(|p| p.y.atan2(p.x)).collect();
    angles.sort_by(f32::total_cmp);
    let Some((&first, &last)) = angles.first().zip(angles.last()) else { return false };
    let widest =
        angles.windows(2).map(|w| w[1] - w[0]).fold(first + std::f32::consts::TAU - last, f32::max);
    widest < WIDEST_GAP_RAD
}
