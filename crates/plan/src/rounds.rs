//! The loop: detect windows, place a block in each, until no window is left (METHOD §6).
//!
//! Windows are served largest deficit first. Those too far apart to see each other run at the same time; the result is
//! that of serving them one by one. What has settled is fixed for the rounds to come.

use crate::{
    Insertion, PlanError, Policy, acceptance, batches, guided, network_pose, pattern, random_pose,
    search,
    site::{Poses, Site, TypeToPlace},
    stack::Stack,
    trial::Drop,
    windows::{self, Window},
};
use geom::{Event, Observer, Pose, SeedTree, Stage, Vec2, Vec3, Warning};
use rayon::prelude::*;
use scene::{Handling, InstanceId, PlacedBlock, Placement, PlacementState};

/// Windows whose middles are nearer than this part of a window stand for one place: a failure in one closes the other. Free choice
/// just below one half, where they begin to share most of their area.
const SAME_WINDOW: f32 = 0.45;

/// A window in which nothing could be placed while its surroundings were as they were at `tick`.
struct Failure {
    place: Vec2,
    tick: u32,
    deficit_m3: f32,
}

/// Whose turn it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    /// The type whose windows are served, by its place in the list; smaller ones may be placed in them too.
    pub scale: usize,
    pub round: u32,
    pub insertion: Insertion,
}

/// What the rounds did.
#[derive(Default)]
pub(crate) struct Filled {
    /// Every block tried, with the deficit of its window; kept ones are in the stack.
    pub tried: Vec<(Placement, f32)>,
    /// Windows in which nothing could be lowered straight down when the first blocks were guided, and those of them that got one.
    pub shut: u32,
    pub opened: u32,
    /// Deficit from and to which a failure kept a larger window closed: with a minimum volume in between it would not have.
    closed: Vec<(f32, f32)>,
}

impl Filled {
    /// Whether the same rounds with a larger minimum volume would have kept the same blocks. Windows are served largest
    /// deficit first, so smaller ones matter to larger ones only by a block they got or a failure that closed one.
    pub fn holds_for(&self, minimum_volume_m3: f32) -> bool {
        let v = minimum_volume_m3;
        self.tried.iter().all(|(p, deficit_m3)| p.state != PlacementState::Kept || *deficit_m3 > v)
            && self.closed.iter().all(|(from, to)| v < *from || v >= *to)
    }
}

/// Runs the rounds.
pub(crate) fn fill(
    site: &Site,
    stack: &mut Stack,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Filled, PlanError> {
    if let Poses::Pattern(pattern) = &site.main().poses {
        return pattern::fill(site, pattern, stack, observer);
    }
    let void_m3 = windows::void_m3(&stack.surface, &stack.design);
    let expected = void_m3 * 0.5 / stack.catalog.get(site.main().model).volume_m3;
    observer.event(Event::Started { stage: Stage::Plan, total: expected.ceil() as u64 });
    let mut filling = Filling::new(site, stack);
    for round in 1..=site.main().settings.rounds {
        let mut windows = 0;
        // The largest type's windows first: smaller ones fill what they leave.
        for scale in 0..site.types.len() {
            let turn = Turn { scale, round, insertion: Insertion::Straight };
            windows += filling.round(stack, &turn, seed, observer)?;
        }
        if windows == 0 && filling.guided(stack, round, seed, observer)? > 0 {
            continue;
        }
        if windows == 0 {
            if round == 1 {
                let message = nothing_to_do(site, stack);
                observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
            }
            break;
        }
    }
    filling.warn(stack, observer);
    Ok(filling.filled)
}

/// The rounds so far.
struct Filling<'s, 'a> {
    site: &'s Site<'a>,
    filled: Filled,
    /// Of the windows of each type's size.
    failures: Vec<Vec<Failure>>,
    /// The same where a block was guided.
    shut: Vec<Vec<Failure>>,
    /// Whether a window of each type's size was ever found.
    found: Vec<bool>,
    /// What is left of each type.
    stock: Vec<Option<u32>>,
    tick: u32,
    kept: u64,
    /// Nobody reads or writes farther than this from a window's centre.
    apart_m: f32,
}

impl<'s, 'a> Filling<'s, 'a> {
    fn new(site: &'s Site<'a>, stack: &Stack) -> Self {
        let apart = |t: &TypeToPlace| {
            2.0 * (t.settings.local_radius_m + t.settings.jitter_m.max(t.settings.window_m))
        };
        let placed = |t: &TypeToPlace| {
            stack.blocks[stack.existing..].iter().filter(|b| b.model == t.model).count() as u32
        };
        Self {
            site,
            filled: Filled::default(),
            failures: site.types.iter().map(|_| Vec::new()).collect(),
            shut: site.types.iter().map(|_| Vec::new()).collect(),
            found: vec![false; site.types.len()],
            stock: site
                .types
                .iter()
                .map(|t| t.stock.map(|s| s.saturating_sub(placed(t))))
                .collect(),
            tick: 0,
            kept: 0,
            apart_m: site.types.iter().map(apart).fold(0.0, f32::max),
        }
    }

    /// One round over the windows in which nothing could be lowered straight down; how many got a block.
    fn guided(
        &mut self,
        stack: &mut Stack,
        round: u32,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Result<usize, PlanError> {
        if self.site.main().settings.insertion == Insertion::Straight {
            return Ok(0);
        }
        let before = self.kept;
        let first = self.filled.shut == 0;
        for scale in 0..self.site.types.len() {
            let turn = Turn { scale, round, insertion: Insertion::Guided };
            let windows = self.round(stack, &turn, seed, observer)?;
            if first {
                self.filled.shut += windows as u32;
            }
        }
        let opened = (self.kept - before) as usize;
        if first {
            self.filled.opened = opened as u32;
        }
        Ok(opened)
    }

    /// One round over the windows of one type's size; how many there were.
    fn round(
        &mut self,
        stack: &mut Stack,
        turn: &Turn,
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Result<usize, PlanError> {
        let Turn { scale, round, insertion } = *turn;
        if self.stock[scale] == Some(0) {
            return Ok(0);
        }
        let windows = self.windows(stack, turn);
        self.found[scale] |= !windows.is_empty();
        let places: Vec<Vec2> = windows.iter().map(|w| w.centre).collect();
        let seed = seed.child("round", u64::from(round));
        let seed = if insertion == Insertion::Guided { seed.child("guided", 0) } else { seed };
        let seed = if scale == 0 { seed } else { seed.child("scale", scale as u64) };
        for batch in batches::independent(&places, self.apart_m) {
            let mut left = batch.as_slice();
            while !left.is_empty() {
                if observer.cancelled() {
                    return Err(PlanError::Cancelled);
                }
                let (now, later) = left.split_at(left.len().min(self.at_once()));
                self.serve(stack, turn, &windows, now, seed);
                left = later;
            }
            observer.event(Event::Advanced { stage: Stage::Plan, done: self.kept });
        }
        Ok(windows.len())
    }

    /// Windows of one scale that are worth a trial.
    fn windows(&mut self, stack: &Stack, turn: &Turn) -> Vec<Window> {
        let scale = turn.scale;
        let kind = &self.site.types[scale];
        let (settings, block) = (&kind.settings, stack.catalog.get(kind.model));
        let failures = match turn.insertion {
            Insertion::Straight => &mut self.failures[scale],
            Insertion::Guided => &mut self.shut[scale],
        };
        failures.retain(|f| {
            stack.last_change(f.place.x, f.place.y, settings.window_m + block.d_max_m) <= f.tick
        });
        let mut closed = Vec::new();
        let open = |w: &Window| {
            if !kind.allowed.covers(w.centre) {
                return false;
            }
            let near = failures
                .iter()
                .filter(|f| (f.place - w.centre).length() < SAME_WINDOW * settings.window_m);
            let Some(largest_m3) = near.map(|f| f.deficit_m3).reduce(f32::max) else { return true };
            if largest_m3 < w.deficit_m3 {
                closed.push((largest_m3, w.deficit_m3));
            }
            false
        };
        let windows = windows::detect(&stack.surface, &stack.design, settings, open);
        self.filled.closed.append(&mut closed);
        windows
    }

    /// Windows that may be served at the same time without using more of a type than there is.
    fn at_once(&self) -> usize {
        let left = self.stock.iter().flatten().filter(|&&n| n > 0).min();
        left.map_or(usize::MAX, |&n| n as usize)
    }

    /// Serves windows that do not see each other.
    fn serve(
        &mut self,
        stack: &mut Stack,
        turn: &Turn,
        windows: &[Window],
        now: &[usize],
        seed: SeedTree,
    ) {
        self.tick += 1;
        let scale = turn.scale;
        let (site, stock) = (self.site, &self.stock);
        let serve = |&w: &usize| {
            let seed = seed.child("window", w as u64);
            serve(&site.types, stock, stack, turn, &windows[w], seed)
        };
        let results: Vec<Vec<Placement>> = now.par_iter().map(serve).collect();
        for (&w, placements) in now.iter().zip(results) {
            let deficit_m3 = windows[w].deficit_m3;
            let settings = &site.types[scale].settings;
            if let Some(p) = placements.iter().find(|p| p.state == PlacementState::Kept) {
                self.keep(stack, p);
            } else if settings.policy != Policy::Random || settings.random.drops > 1 {
                let (place, tick) = (windows[w].centre, self.tick);
                let failures = match turn.insertion {
                    Insertion::Straight => &mut self.failures,
                    Insertion::Guided => &mut self.shut,
                };
                failures[scale].push(Failure { place, tick, deficit_m3 });
            }
            self.filled.tried.extend(placements.into_iter().map(|p| (p, deficit_m3)));
        }
    }

    fn keep(&mut self, stack: &mut Stack, p: &Placement) {
        let block = InstanceId(stack.blocks.len() as u32 + 1);
        stack.add(PlacedBlock { block, model: p.model, site_from_block: p.rest }, self.tick);
        self.kept += 1;
        let of = self.site.types.iter().position(|t| t.model == p.model);
        if let Some(left) = of.and_then(|t| self.stock[t].as_mut()) {
            *left = left.saturating_sub(1);
        }
    }

    /// Says which types were never of use, and which ran out.
    fn warn(&self, stack: &Stack, observer: &dyn Observer) {
        let warn = |message: String| {
            observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
        };
        for (t, kind) in self.site.types.iter().enumerate() {
            let name = &stack.catalog.get(kind.model).name;
            let (v, total) = (kind.settings.minimum_volume_m3, kind.stock.unwrap_or(0));
            let new = &stack.blocks[stack.existing..];
            if self.stock[t] == Some(0) {
                warn(format!("all {total} blocks of \"{name}\" in stock are used"));
            } else if new.iter().any(|b| b.model == kind.model) {
                continue;
            } else if !self.found[t] && self.site.types.len() > 1 {
                warn(format!(
                    "\"{name}\" fits no window: none of its size lacks its minimum volume of {v:.2} m³ where it may lie; take it out of plan.blocks or reduce plan.minimum_volume_m3"
                ));
            } else if self.found[t] {
                warn(self.fits_nowhere(name, kind));
            }
        }
    }

    /// What became of a type of which every block was removed.
    fn fits_nowhere(&self, name: &str, kind: &TypeToPlace) -> String {
        let of = |state: PlacementState| {
            let own = |(p, _): &&(Placement, f32)| p.model == kind.model && p.state == state;
            self.filled.tried.iter().filter(own).count()
        };
        let (high, off) = (of(PlacementState::Overflow), of(PlacementState::Outside));
        let loose = of(PlacementState::Unstable) + of(PlacementState::Unsettled);
        if high + off + loose == 0 {
            return format!(
                "no block of \"{name}\" is in the plan: windows lack its minimum volume, but it stands above the design by more than plan.overflow_m = {:.2} m in all of them, \
                 or another type serves them better; a smaller type may fit",
                kind.settings.overflow_m
            );
        }
        format!(
            "no block of \"{name}\" fits a window: of those tried {high} stood above the design by more than plan.overflow_m = {:.2} m, {loose} did not stay, {off} came to rest \
             outside the works or the crane's reach; a smaller type may fit",
            kind.settings.overflow_m
        )
    }
}

/// Why the first round found no window.
fn nothing_to_do(site: &Site, stack: &Stack) -> String {
    let kind = site.types.last().unwrap_or(site.main());
    let minimum_volume_m3 = kind.settings.minimum_volume_m3;
    let design = &stack.design;
    let places = (0..design.ny).flat_map(|y| (0..design.nx).map(move |x| (x, y)));
    let reached = places
        .filter(|&(x, y)| design.at(x, y).is_finite())
        .any(|(x, y)| site.types.iter().any(|t| t.allowed.within_reach(design.centre(x, y))));
    if windows::void_m3(&stack.surface, design) <= 0.0 {
        "the design lies below the present surface everywhere: nothing is to be added, the plan has 0 blocks".into()
    } else if !reached {
        "the crane reaches no part of the works: the plan has 0 blocks".into()
    } else {
        format!(
            "no window lacks the minimum volume of {minimum_volume_m3:.2} m³ within the crane's reach: the plan has 0 blocks; \
             reduce plan.minimum_volume_m3 to fill smaller gaps"
        )
    }
}

/// Tries every type of this scale and below that is left; at most one block is kept. What lies ready goes before what must be
/// made, then the most void filled for its cost.
pub(crate) fn serve(
    types: &[TypeToPlace],
    stock: &[Option<u32>],
    stack: &Stack,
    turn: &Turn,
    window: &Window,
    seed: SeedTree,
) -> Vec<Placement> {
    let Turn { scale, round, insertion } = *turn;
    let (mut best, mut failed): (Option<(bool, f32, Placement)>, Vec<Placement>) =
        (None, Vec::new());
    for (t, kind) in types.iter().enumerate().skip(scale) {
        if stock[t] == Some(0) || !kind.allowed.covers(window.centre) {
            continue;
        }
        let seed = if t == scale { seed } else { seed.child("type", t as u64) };
        let tried = match insertion {
            Insertion::Straight => serve_type(kind, stack, window, round, seed),
            Insertion::Guided => guided::placed(kind, stack, window, round, seed),
        };
        let Some(kept) = tried.iter().find(|p| p.state == PlacementState::Kept) else {
            failed.extend(tried);
            continue;
        };
        let (ready, worth) = (kind.stock.is_some(), kept.filled_m3 / kind.cost);
        if best.as_ref().is_none_or(|(r, w, _)| (ready, worth) > (*r, *w)) {
            best = Some((ready, worth, kept.clone()));
        }
    }
    best.map_or(failed, |(_, _, kept)| vec![kept])
}

/// Tries to place one block of a type in a window; of what was tried at most one is kept.
pub(crate) fn serve_type(
    kind: &TypeToPlace,
    stack: &Stack,
    window: &Window,
    round: u32,
    seed: SeedTree,
) -> Vec<Placement> {
    match &kind.poses {
        Poses::Random => random_pose::placed(kind, stack, window, round, seed),
        _ => search::best(kind, stack, &poses(kind, stack, window), round),
    }
}

/// The poses worth a drop in a window, best first; policy `random` looks at none before it drops.
pub(crate) fn poses(kind: &TypeToPlace, stack: &Stack, window: &Window) -> Vec<search::Candidate> {
    let (settings, model) = (&kind.settings, kind.model);
    match &kind.poses {
        Poses::Random => Vec::new(),
        Poses::Network(proposer, turn_rad) => {
            network_pose::candidates(stack, settings, model, (*proposer, *turn_rad), window)
        }
        Poses::Pattern(pattern) => pattern.near(stack, kind, window),
        Poses::Search(attitudes) => attitudes.candidates(stack, settings, model, window),
    }
}

/// A block that was dropped and judged, but not yet shaken.
pub(crate) struct Dropped<'a> {
    world: Drop<'a>,
    /// Kept: if it stands the shake.
    pub placement: Placement,
    pub impact: acceptance::Impact,
}

/// Drops a block and judges it.
pub(crate) fn attempt(
    kind: &TypeToPlace,
    stack: &Stack,
    drop: &Pose,
    limit_m: f32,
    round: u32,
) -> Placement {
    dropped(kind, stack, drop, limit_m, round).shaken(kind)
}

/// Drops a block and judges all but the shake, which costs as much as the drop.
pub(crate) fn dropped<'a>(
    kind: &'a TypeToPlace,
    stack: &Stack,
    drop: &Pose,
    limit_m: f32,
    round: u32,
) -> Dropped<'a> {
    carried(kind, stack, (&[], drop), limit_m, round).expect("nothing lies in the way of no path")
}

/// The same after it was carried along a path; `None` where something stops it on the way.
pub(crate) fn carried<'a>(
    kind: &'a TypeToPlace,
    stack: &Stack,
    (path, drop): (&[Pose], &Pose),
    limit_m: f32,
    round: u32,
) -> Option<Dropped<'a>> {
    let mut falling = Drop::new(stack, &kind.settings, kind.model, drop);
    if !path.is_empty() && !falling.carry(path, drop) {
        return None;
    }
    // What has rolled over the boundary does not roll back.
    let lost = |centre: Vec3| !stack.design_level_m(centre.x, centre.y).is_finite();
    let trial = falling.settle(limit_m, &lost);
    let (state, impact) =
        acceptance::judge(stack, &kind.settings, &kind.allowed, kind.model, limit_m, &trial);
    let placement = Placement {
        order: 0,
        round,
        model: kind.model,
        drop: *drop,
        rest: trial.rest,
        filled_m3: impact.filled_m3,
        contacts: trial.contacts,
        state,
        handling: Handling { path: path.to_vec(), ..Handling::default() },
    };
    Some(Dropped { world: falling, placement, impact })
}

impl Dropped<'_> {
    /// The verdict with the shake, which only what has passed everything else is asked.
    pub fn shaken(mut self, kind: &TypeToPlace) -> Placement {
        if self.placement.state == PlacementState::Kept
            && self.world.shake() > kind.settings.shake_limit_m
        {
            self.placement.state = PlacementState::Unstable;
        }
        self.placement
    }
}
