//! Guided insertion: where nothing can be lowered straight down and stays, the crane carries a block sideways and turns it (ours).
//!
//! In: a window that lacks volume and got no block. Out: a block that rests there by all rules of the planner, with the path it is
//! carried along. Two ways lead to it. A block that is let go where it touches first, or from any free pose in the window, comes to a rest
//! from which no shake moves it; the path there is searched backwards, out of the pile. Or it is led downhill from where it touches first. Both go by small moves of
//! which each is checked: the hulls against pile, ground and walls at steps so small that nothing is jumped over, and the sling, a
//! plumb line above the centre of mass, against the surface. At last the block is carried along the path in physics, let go, judged and
//! shaken like any other.

use crate::{
    Settings, acceptance, attitudes, carried, rounds, search,
    silhouette::{self, lowered_height_m},
    site::TypeToPlace,
    stack::Stack,
    windows::Window,
};
use geom::{Bounds, Pose, Quat, SeedTree, Vec2, Vec3};
use rand::{Rng, RngExt};
use scene::{BlockModel, Placement, PlacementState};
use sim::{Passage, World};

/// Poses that touch first from which a block is let roll. Free choice.
const STARTS: u32 = 24;
/// Poses drawn anywhere in the window, and most of them that are free and let go: rests that nothing rolls to from above.
const SAMPLES: u32 = 1500;
const FREE: usize = 48;
/// Places of rest to which a way is searched.
const TARGETS: usize = 8;
/// Moves tried on the way out.
const MOVES: u32 = 360;
/// First touching poses that are led downhill, and moves tried from each.
const LED: usize = 6;
const LED_MOVES: u32 = 120;
/// Gain in depth, in d_box, below which a move downhill is not worth making.
const WORTH: f32 = 0.005;
/// A block settles this much, in d_box, below where it is let go.
const SETTLES: f32 = 0.05;
/// Nudges tried to come clear of what it lies on.
const NUDGES: u32 = 60;
/// A block keeps this part of d_box to everything on its way: with steps of twice that nothing is touched between two of them.
const GAP: f32 = 0.005;
/// Largest move sideways, in d_box, and turn; moves are drawn from that down to a quarter of it.
const SHIFT: f32 = 0.2;
const TURN_RAD: f32 = 0.35;
/// Farthest from where it is lowered to where it is let go, in d_box, and most turned: what a slewing crane and two tag lines do.
const FARTHEST: f32 = 1.0;
const MOST_TURNED_RAD: f32 = 0.8;
/// Cells by which a pose of rest is raised before it is asked whether it is reached straight from above.
const RASTER: f32 = 1.0;
/// Half the width of the sling and its hook block, in d_box.
const SLING: f32 = 0.05;

/// Tries to place one block of a type in a window along a path; what is kept.
pub(crate) fn placed(
    kind: &TypeToPlace,
    stack: &Stack,
    window: &Window,
    round: u32,
    seed: SeedTree,
) -> Vec<Placement> {
    let starts = touching(kind, stack, window);
    let guide = Guide::new(kind, stack, window);
    let mut rng = seed.child("guided", 0).rng();
    let free = guide.free_poses(window, &starts, (SAMPLES, FREE), &mut rng);
    let let_go: Vec<Pose> = starts.iter().map(|s| s.pose).chain(free).collect();
    let rests = rests(kind, stack, &let_go, window, round);
    let rolled = rests.iter().take(TARGETS).find_map(|rest| {
        let path = guide.way_to(rest, &mut rng)?;
        guide.verdict(kind, &path, round)
    });
    let kept = rolled.or_else(|| {
        let first = starts.iter().take(LED);
        let mut led: Vec<Led> = first.filter_map(|s| guide.led(&s.pose, &mut rng)).collect();
        led.sort_by(|a, b| a.above_m.total_cmp(&b.above_m));
        led.iter().find_map(|end| guide.verdict(kind, &end.path, round))
    });
    kept.into_iter().collect()
}

/// Poses that touch first in a window, those that touch too high included.
pub(crate) fn touching(
    kind: &TypeToPlace,
    stack: &Stack,
    window: &Window,
) -> Vec<search::Candidate> {
    let Some(attitudes) = &kind.guided else { return Vec::new() };
    let mut high = kind.settings.clone();
    (high.overflow_m, high.search.verify) = (kind.settings.window_m, STARTS);
    attitudes.candidates(stack, &high, kind.model, window)
}

/// From a node of a tree of moves to its root.
fn way_back(tree: &[(Pose, usize)], from: usize) -> Vec<Pose> {
    let (mut way, mut at) = (vec![tree[from].0], from);
    while at != 0 {
        at = tree[at].1;
        way.push(tree[at].0);
    }
    way
}

/// A way downhill.
struct Led {
    path: Vec<Pose>,
    /// The centre of mass above the design at its end.
    above_m: f32,
}

/// Where blocks that are let go come to rest in a window by all rules but that of sideways movement, cheapest first.
fn rests(
    kind: &TypeToPlace,
    stack: &Stack,
    starts: &[Pose],
    window: &Window,
    round: u32,
) -> Vec<Pose> {
    let (settings, centre) = (&kind.settings, stack.catalog.get(kind.model).centre);
    let mut found: Vec<(f32, Pose)> = Vec::new();
    for start in starts {
        let dropped = rounds::dropped(kind, stack, start, settings.roam_m, round);
        let rest = dropped.placement.rest;
        let away = ((rest * centre).truncate() - window.centre).abs().max_element();
        if dropped.placement.state != PlacementState::Kept || away > 0.5 * settings.window_m {
            continue;
        }
        let cost = search::cost(kind, stack, &dropped);
        if dropped.shaken(kind).state == PlacementState::Kept {
            found.push((cost, rest));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, rest)| rest).collect()
}

/// A window with everything that stands in the way.
pub(crate) struct Guide<'g, 's> {
    stack: &'g Stack<'s>,
    kind: &'g TypeToPlace<'g>,
    settings: &'g Settings,
    block: &'g BlockModel,
    model: scene::ModelId,
    passage: Passage,
    gap_m: f32,
}

impl<'g, 's> Guide<'g, 's> {
    pub(crate) fn new(kind: &'g TypeToPlace<'g>, stack: &'g Stack<'s>, window: &Window) -> Self {
        let (settings, model) = (&kind.settings, kind.model);
        let block = stack.catalog.get(model);
        let middle = window.centre;
        let radius_m = 2.0 * stack.catalog.d_max_m() + (0.75 + FARTHEST) * block.d_box_m;
        let at = middle.extend(stack.surface_m(middle));
        let mut world = World::new(&settings.physics);
        world.add_ground(stack.ground, &Bounds { min: at, max: at }.grown(radius_m));
        for (point, normal) in &stack.walls {
            world.add_wall(*point, *normal);
        }
        for i in stack.near(middle.x, middle.y, radius_m) {
            let near = &stack.blocks[i];
            world.add_fixed(&stack.shapes[near.model.0 as usize], &near.site_from_block);
        }
        let passage = world.passage(&stack.shapes[model.0 as usize]);
        Self { stack, kind, settings, block, model, passage, gap_m: GAP * block.d_box_m }
    }

    /// A pose of rest raised by what the raster rounds away.
    pub(crate) fn above(&self, rest: &Pose) -> Pose {
        let up = Vec3::Z * (RASTER * self.stack.surface.cell_m);
        Pose::from_parts(rest.translation + up, rest.rotation)
    }

    /// Free poses of a window, at most `most` of `samples` drawn, however they are shut in: every second anywhere between the highest
    /// allowed and a block's length below, the others under and beside what touches first, turned a little.
    pub(crate) fn free_poses(
        &self,
        window: &Window,
        touching: &[search::Candidate],
        (samples, most): (u32, usize),
        rng: &mut impl Rng,
    ) -> Vec<Pose> {
        let mut found = Vec::new();
        for k in 0..samples as usize {
            let near = touching.get(k / 2 % touching.len().max(1)).filter(|_| k % 2 == 1);
            let pose = match near {
                Some(start) => {
                    let size = rng.random::<f32>() / SHIFT * 0.5;
                    let mut pose = self.moved(&start.pose, size.min(1.0), rng);
                    pose.translation.z -= 0.5 * rng.random::<f32>() * self.block.d_box_m;
                    pose
                }
                None => self.anywhere(window, rng),
            };
            let centre = pose * self.block.centre;
            let high_m = highest_m(self.kind, self.stack, centre.truncate());
            if centre.z <= high_m
                && self.stack.is_inside(self.model, &pose, self.settings.inside)
                && self.passage.is_clear(&pose, self.gap_m)
            {
                found.push(pose);
                if found.len() == most {
                    break;
                }
            }
        }
        found
    }

    fn anywhere(&self, window: &Window, rng: &mut impl Rng) -> Pose {
        let mut even = || rng.random::<f32>() - 0.5;
        let place = window.centre + Vec2::new(even(), even()) * self.settings.window_m;
        let highest_m = highest_m(self.kind, self.stack, place);
        let below_m = rng.random::<f32>() * self.block.d_box_m;
        let rotation = attitudes::random(rng);
        silhouette::pose_at(self.block, rotation, place.extend(highest_m - below_m))
    }

    /// The poses of a way to a place of rest, from the one to which a block is lowered straight down to the one in which it is let go:
    /// a tree of free moves that grows out of the pile, mostly where it is highest.
    fn way_to(&self, rest: &Pose, rng: &mut impl Rng) -> Option<Vec<Pose>> {
        let end = self.clear_of(rest, rng)?;
        let mut tree = vec![(end, 0)];
        let mut highest = 0;
        for k in 0..MOVES {
            if self.is_straight(&tree[highest].0) {
                return Some(self.shortest(way_back(&tree, highest)));
            }
            let from = if k % 3 == 2 { rng.random_range(0..tree.len()) } else { highest };
            let here = tree[from].0;
            let to = self.moved(&here, [1.0, 0.5, 0.25][k as usize / 3 % 3], rng);
            if self.may_be(&end, &to) && self.is_way(&here, &to) {
                tree.push((to, from));
                let high = self.raised(&to);
                if self.level_m(&high) > self.level_m(&to) {
                    tree.push((high, tree.len() - 1));
                }
                let last = tree.len() - 1;
                if self.level_m(&tree[last].0) > self.level_m(&tree[highest].0) {
                    highest = last;
                }
            }
        }
        None
    }

    /// Leads a block downhill from where it touches first; `None` where that does not bring it below the design.
    fn led(&self, first: &Pose, rng: &mut impl Rng) -> Option<Led> {
        let up = |k: u32| Vec3::Z * (self.gap_m * k as f32);
        let start = (1..16)
            .map(|k| Pose::from_parts(first.translation + up(k), first.rotation))
            .find(|pose| self.is_free(pose))?;
        let (mut way, mut here) = (vec![start], start);
        for k in 0..LED_MOVES {
            let to = self.moved(&here, [1.0, 0.5, 0.25][k as usize % 3], rng);
            if !self.may_be(&start, &to) || !self.is_way(&here, &to) {
                continue;
            }
            let low = self.lowered(&to);
            let gain_m = self.above_m(&here) - self.above_m(&low);
            let wedged = || acceptance::impact(self.stack, self.model, &low).wedged;
            if gain_m > WORTH * self.block.d_box_m && wedged() <= self.settings.wedge_limit {
                way.extend([to, low]);
                here = low;
            }
        }
        let above_m = self.above_m(&here);
        let allowed_m = self.settings.overflow_m + SETTLES * self.block.d_box_m;
        let deep = way.len() > 1 && above_m <= allowed_m;
        deep.then(|| Led { path: self.shortest(way), above_m })
    }

    /// As deep as it goes straight down.
    fn lowered(&self, from: &Pose) -> Pose {
        let down = Vec3::Z * (2.0 * self.gap_m);
        let mut pose = *from;
        for _ in 0..(0.5 / GAP) as u32 {
            let next = Pose::from_parts(pose.translation - down, pose.rotation);
            if !self.is_free(&next) {
                break;
            }
            pose = next;
        }
        pose
    }

    fn above_m(&self, pose: &Pose) -> f32 {
        acceptance::above_design_m(self.stack, *pose * self.block.centre)
    }

    /// The pose nearest to one of rest in which nothing is touched.
    fn clear_of(&self, rest: &Pose, rng: &mut impl Rng) -> Option<Pose> {
        for k in 0..NUDGES {
            let up = self.gap_m * (1.0 + k as f32 / 6.0);
            let mut pose = self.moved(rest, 0.2 * k as f32 / NUDGES as f32, rng);
            pose.translation.z += up;
            if self.is_free(&pose) {
                return Some(pose);
            }
        }
        None
    }

    /// A pose a small move away, on the same level.
    fn moved(&self, from: &Pose, size: f32, rng: &mut impl Rng) -> Pose {
        let mut even = || 2.0 * rng.random::<f32>() - 1.0;
        let shift = Vec2::new(even(), even()) * (SHIFT * size * self.block.d_box_m);
        // Every second move is sideways alone.
        let turn = if even() > 0.0 { even() } else { 0.0 };
        let angle = TURN_RAD * size * turn;
        let axis = attitudes::random(rng) * Vec3::X;
        let rotation = (Quat::from_axis_angle(axis, angle) * from.rotation).normalize();
        silhouette::pose_at(self.block, rotation, *from * self.block.centre + shift.extend(0.0))
    }

    /// Whether crane and tag lines bring it from there to its end, all of it inside the works.
    fn may_be(&self, end: &Pose, pose: &Pose) -> bool {
        let away = *pose * self.block.centre - *end * self.block.centre;
        away.truncate().length() <= FARTHEST * self.block.d_box_m
            && end.rotation.angle_between(pose.rotation) <= MOST_TURNED_RAD
            && self.stack.is_inside(self.model, pose, self.settings.inside)
    }

    /// As high as it goes straight up, at most a block's length.
    fn raised(&self, from: &Pose) -> Pose {
        let mut pose = *from;
        for _ in 0..(0.5 / GAP) as u32 {
            let up = Vec3::Z * (2.0 * self.gap_m);
            let next = Pose::from_parts(pose.translation + up, pose.rotation);
            if !self.is_free(&next) {
                break;
            }
            pose = next;
            if self.is_straight(&pose) {
                break;
            }
        }
        pose
    }

    /// Whether block and sling have room.
    fn is_free(&self, pose: &Pose) -> bool {
        self.sling_hangs(*pose * self.block.centre) && self.passage.is_clear(pose, self.gap_m)
    }

    /// Whether nothing reaches over the block's centre.
    fn sling_hangs(&self, centre: Vec3) -> bool {
        let surface = &self.stack.surface;
        let cells = surface.rect_around(centre.x, centre.y, SLING * self.block.d_box_m);
        (cells.y0..cells.y1).all(|y| (cells.x0..cells.x1).all(|x| surface.at(x, y) <= centre.z))
    }

    /// Whether the way between two free poses is free.
    fn is_way(&self, from: &Pose, to: &Pose) -> bool {
        let (centre, reach_m) = (self.block.centre, self.block.d_max_m);
        let mut on_it = carried::between(centre, reach_m, from, to, 2.0 * self.gap_m);
        on_it.all(|pose| self.is_free(&pose))
    }

    /// The same ends with as few poses between as a free way allows.
    fn shortest(&self, poses: Vec<Pose>) -> Vec<Pose> {
        let mut short = vec![poses[0]];
        let mut at = 0;
        while at + 1 < poses.len() {
            let far = (at + 2..poses.len()).rev().find(|&j| self.is_way(&poses[at], &poses[j]));
            at = far.unwrap_or(at + 1);
            short.push(poses[at]);
        }
        short
    }

    /// Whether it can be lowered there straight down from above.
    pub(crate) fn is_straight(&self, pose: &Pose) -> bool {
        let at = *pose * self.block.centre;
        let surface = &self.stack.surface;
        lowered_height_m(surface, self.block, pose.rotation, at.x, at.y).is_some_and(|z| z <= at.z)
    }

    fn level_m(&self, pose: &Pose) -> f32 {
        (*pose * self.block.centre).z
    }

    /// Carries the block along in physics, lets go, judges and shakes; what is kept.
    fn verdict(&self, kind: &TypeToPlace, path: &[Pose], round: u32) -> Option<Placement> {
        let (drop, way) = path.split_last()?;
        // What can be lowered straight to its end needs no path.
        let way = if self.is_straight(drop) { &[] } else { way };
        let limit_m = kind.settings.displacement_limit_m;
        let dropped = rounds::carried(kind, self.stack, (way, drop), limit_m, round)?;
        let placement = dropped.shaken(kind);
        (placement.state == PlacementState::Kept).then_some(placement)
    }
}

/// Highest centre of mass a block may be let go at, above the design.
fn highest_m(kind: &TypeToPlace, stack: &Stack, place: Vec2) -> f32 {
    let block = stack.catalog.get(kind.model);
    kind.settings.overflow_m + 0.25 * block.d_box_m
        - acceptance::above_design_m(stack, place.extend(0.0))
}
