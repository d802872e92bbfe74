//! One drop in a small world of its own.
//!
//! In: the stack, a block and the pose in which the crane lets go. Out: where it came to rest, on what, and whether a
//! small shake moves it. A fresh world per trial is parallel and history-free: a reused one is not bit-identical
//! (measured), and a trial costs a millisecond. Everything already in the pile is fixed, so blocks that overlap in
//! the input cannot push each other apart; blocks of the plan itself may be left loose (`frozen = false`).

use crate::{Settings, carried, stack::Stack};
use geom::{Bounds, Pose, Vec3};
use scene::ModelId;
use sim::{BodyId, Touched, World};

/// Speed at which a block is carried, window edges a second (of a 2 m block: 0.5 m/s).
const CARRIED: f32 = 0.25;
/// A carried block this part of a window's edge beside its path has met something: four times what steering leaves.
const OFF_PATH: f32 = 0.01;

/// How a drop ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trial {
    pub rest: Pose,
    /// Whether it came to rest within the time limit.
    pub at_rest: bool,
    /// Largest sideways distance of its centre from the place of the drop while watched.
    pub displaced_m: f32,
    /// Blocks touched at rest, plus one for the ground.
    pub contacts: u32,
    pub on_ground: bool,
    /// Farthest that a loose neighbour moved.
    pub pushed_m: f32,
}

/// A drop in progress: the world is kept for the shake.
pub(crate) struct Drop<'a> {
    world: World,
    body: BodyId,
    /// Placed blocks that are free to move, with their centres of mass in block and site coordinates.
    loose: Vec<(BodyId, Vec3, Vec3)>,
    settings: &'a Settings,
    centre: Vec3,
    reach_m: f32,
    mass_kg: f32,
}

impl<'a> Drop<'a> {
    /// Builds the local world around the pose of the drop.
    pub fn new(stack: &Stack, settings: &'a Settings, model: ModelId, drop: &Pose) -> Self {
        let block = stack.catalog.get(model);
        let at = *drop * block.centre;
        let mut world = World::new(&settings.physics);
        let bounds = Bounds { min: at, max: at }.grown(settings.local_radius_m);
        world.add_ground(stack.ground, &bounds);
        for (point, normal) in &stack.walls {
            world.add_wall(*point, *normal);
        }
        let mut loose = Vec::new();
        for i in stack.near(at.x, at.y, settings.local_radius_m) {
            let near = &stack.blocks[i];
            let shape = &stack.shapes[near.model.0 as usize];
            let place = stack.centre(i);
            if i >= stack.existing && (place - at).truncate().length() < settings.loose_radius_m {
                let id = world.add_moving(shape, &near.site_from_block);
                loose.push((id, stack.catalog.get(near.model).centre, place));
            } else {
                world.add_fixed(shape, &near.site_from_block);
            }
        }
        let body = world.add_moving(&stack.shapes[model.0 as usize], drop);
        let (centre, reach_m, mass_kg) = (block.centre, block.d_max_m, block.mass_kg());
        Self { world, body, loose, settings, centre, reach_m, mass_kg }
    }

    /// Carries the block along a path to where it is let go; whether it got there without being pushed off it.
    pub fn carry(&mut self, path: &[Pose], drop: &Pose) -> bool {
        let legs = path.iter().zip(path.iter().skip(1).chain([drop]));
        let step_m = CARRIED * self.settings.window_m * self.world.step_s() / self.time_scale();
        let off_m = OFF_PATH * self.settings.window_m;
        self.world.set_pose(self.body, &path[0]);
        for (from, to) in legs {
            for pose in carried::between(self.centre, self.reach_m, from, to, step_m) {
                self.world.steer(self.body, &pose);
                self.world.step(1);
                let away_m = (self.pose() * self.centre - pose * self.centre).length();
                let turned = self.pose().rotation.angle_between(pose.rotation);
                if !(away_m + turned * self.reach_m <= off_m) {
                    return false;
                }
            }
        }
        self.world.halt(self.body);
        true
    }

    /// Lets go; gives up as soon as the centre has moved sideways by more than `limit_m` or is `lost`.
    pub fn settle(&mut self, limit_m: f32, lost: &dyn Fn(Vec3) -> bool) -> Trial {
        let start = self.pose() * self.centre;
        let (at_rest, displaced_m) = self.run(self.settings.drop_time_s, start, limit_m, lost);
        let (contacts, on_ground) = if at_rest { self.contacts() } else { (0, false) };
        Trial {
            rest: self.pose(),
            at_rest,
            displaced_m,
            contacts,
            on_ground,
            pushed_m: self.pushed_m(),
        }
    }

    /// Pushes the resting block three ways; the largest distance its centre moves from where it rested.
    pub fn shake(&mut self) -> f32 {
        if self.settings.shake_m_s <= 0.0 {
            return 0.0;
        }
        let start = self.pose() * self.centre;
        let mut moved_m = 0.0_f32;
        for third in 0..3 {
            let (sin, cos) = (third as f32 * std::f32::consts::TAU / 3.0).sin_cos();
            let push = Vec3::new(cos, sin, 0.0) * (self.mass_kg * self.settings.shake_m_s);
            self.world.apply_impulse(self.body, push);
            let time_s = 2.0 * self.settings.physics.rest_time_s * self.time_scale();
            self.run(time_s, start, self.settings.shake_limit_m, &|_| false);
            moved_m = moved_m.max((self.pose() * self.centre - start).length());
            if moved_m > self.settings.shake_limit_m {
                break;
            }
        }
        moved_m
    }

    /// Steps until rest, the time limit or the distance limit.
    fn run(
        &mut self,
        time_s: f32,
        start: Vec3,
        limit_m: f32,
        lost: &dyn Fn(Vec3) -> bool,
    ) -> (bool, f32) {
        let step_s = self.world.step_s();
        let rest_steps =
            (self.settings.physics.rest_time_s * self.time_scale() / step_s).ceil() as u32;
        let rest_speed = self.settings.physics.rest_speed_m_s * self.time_scale();
        let (mut still, mut displaced_m) = (0, 0.0_f32);
        for _ in 0..(time_s / step_s).ceil() as u32 {
            self.world.step(1);
            let centre = self.pose() * self.centre;
            displaced_m = displaced_m.max((centre - start).truncate().length());
            if !(displaced_m <= limit_m) || lost(centre) {
                return (false, displaced_m);
            }
            still = if self.world.speed_m_s(self.body) < rest_speed { still + 1 } else { 0 };
            if still > rest_steps {
                return (true, displaced_m);
            }
        }
        (false, displaced_m)
    }

    fn pushed_m(&self) -> f32 {
        let moved = |(id, centre, before): &(BodyId, Vec3, Vec3)| {
            self.world.pose(*id).map_or(f32::INFINITY, |pose| (pose * *centre - *before).length())
        };
        self.loose.iter().map(moved).fold(0.0, f32::max)
    }

    fn contacts(&self) -> (u32, bool) {
        let mut touched: Vec<Touched> =
            self.world.contacts(self.body).iter().map(|c| c.other).collect();
        touched.sort_unstable();
        touched.dedup();
        let count = touched.iter().filter(|t| **t != Touched::Wall).count() as u32;
        (count, touched.contains(&Touched::Ground))
    }

    fn pose(&self) -> Pose {
        self.world.pose(self.body).unwrap_or(Pose::IDENTITY)
    }

    fn time_scale(&self) -> f32 {
        self.settings.physics.length_unit_m.sqrt()
    }
}
