//! A physics world: what is in it, how it moves, when it rests.
//!
//! Inside, lengths are in [`PhysicsConfig::length_unit_m`] and times in its square root, so that every world looks to
//! the engine like one of 2 m blocks; metres and seconds begin at this wall.

use crate::{BlockShape, FrictionRule, PhysicsConfig, ground};
use geom::{Bounds, Pose, Vec3};
use rapier3d::prelude::{
    CoefficientCombineRule, ColliderBuilder, FrictionModel, IntegrationParameters, PhysicsWorld,
    QueryFilter, Ray, RigidBodyBuilder, RigidBodyHandle, RigidBodyType, SharedShape,
};
use scene::Ground;
use std::sync::Arc;

/// A block in a [`World`]; numbers are given in order from 0 and never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(pub u32);

/// What a block or a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Touched {
    /// Another block.
    Block(BodyId),
    /// The ground.
    Ground,
    /// A wall.
    Wall,
}

/// How [`World::settle`] ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Whether nothing moves any more; not resting is a result, not an error.
    pub at_rest: bool,
    /// Simulated time, seconds.
    pub time_s: f32,
}

pub(crate) struct Body {
    pub(crate) handle: RigidBodyHandle,
    pub(crate) hulls: Arc<[SharedShape]>,
    /// Centre of mass, block coordinates, engine units.
    pub(crate) centre: Vec3,
    /// Largest distance from it to the surface, engine units.
    pub(crate) reach: f32,
    /// Whether the block has ever been free to move.
    pub(crate) placed: bool,
    fixed: bool,
}

/// Blocks, ground and walls under gravity. z points up.
pub struct World {
    pub(crate) physics: PhysicsWorld,
    pub(crate) config: PhysicsConfig,
    pub(crate) bodies: Vec<Option<Body>>,
    /// Whether bodies came or went since the last step, so that rays would miss them.
    stale: bool,
}

const GROUND: u128 = u128::MAX;
const WALL: u128 = u128::MAX - 1;

impl World {
    /// An empty world; `config` must pass [`PhysicsConfig::check`].
    pub fn new(config: &PhysicsConfig) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vec3::new(0.0, 0.0, -config.gravity_m_s2);
        physics.integration_parameters = integration(config);
        Self { physics, config: *config, bodies: Vec::new(), stale: false }
    }

    /// Adds the ground under `bounds` and 20 unit lengths around; of a grid, the part under `bounds`, on a solid floor
    /// two unit lengths below its lowest node.
    pub fn add_ground(&mut self, ground: &Ground, bounds: &Bounds) {
        for collider in ground::colliders(ground, bounds, self.config.length_unit_m) {
            self.add_static(collider, GROUND);
        }
    }

    /// Adds a plane wall, 20 unit lengths thick, that reaches 250 to each side of `point`.
    pub fn add_wall(&mut self, point: Vec3, inward_normal: Vec3) {
        self.add_static(ground::wall(point / self.config.length_unit_m, inward_normal), WALL);
    }

    /// Adds a block that never moves; fixed blocks may overlap each other.
    pub fn add_fixed(&mut self, shape: &BlockShape, site_from_block: &Pose) -> BodyId {
        self.add(shape, RigidBodyBuilder::fixed().pose(self.inside(site_from_block)), true)
    }

    /// Adds a block that falls.
    pub fn add_moving(&mut self, shape: &BlockShape, site_from_block: &Pose) -> BodyId {
        let mass = shape.mass_in(self.config.length_unit_m);
        let body = RigidBodyBuilder::dynamic()
            .pose(self.inside(site_from_block))
            .additional_mass_properties(mass);
        self.add(shape, body, false)
    }

    /// Makes a block fixed where it is. Unknown blocks are ignored.
    pub fn freeze(&mut self, id: BodyId) {
        let Some(body) = self.bodies.get_mut(id.0 as usize).and_then(Option::as_mut) else {
            return;
        };
        body.fixed = true;
        if let Some(rigid) = self.physics.bodies.get_mut(body.handle) {
            rigid.set_linvel(Vec3::ZERO, false);
            rigid.set_angvel(Vec3::ZERO, false);
            rigid.set_body_type(RigidBodyType::Fixed, false);
        }
    }

    /// Takes a block out. Unknown blocks are ignored.
    pub fn remove(&mut self, id: BodyId) {
        if let Some(body) = self.bodies.get_mut(id.0 as usize).and_then(Option::take) {
            self.physics.remove_body(body.handle);
            self.stale = true;
        }
    }

    /// Blocks in the world, in order.
    pub fn ids(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.bodies.iter().enumerate().filter(|(_, b)| b.is_some()).map(|(i, _)| BodyId(i as u32))
    }

    /// `count` time steps.
    pub fn step(&mut self, count: usize) {
        for _ in 0..count {
            self.physics.step();
        }
        self.stale = self.stale && count == 0;
    }

    /// Length of one time step, seconds.
    pub fn step_s(&self) -> f32 {
        self.config.step_s * self.config.time_unit_s()
    }

    /// Steps until no moving block has moved for [`PhysicsConfig::rest_time_s`], at most `max_time_s`.
    pub fn settle(&mut self, max_time_s: f32) -> Settled {
        let dt = self.step_s();
        let rest_steps = (self.config.rest_time_s / self.config.step_s).ceil() as usize;
        let max_steps = (max_time_s / dt).ceil() as usize;
        let rest_speed = self.config.rest_speed_m_s * self.config.time_unit_s();
        let mut still = 0;
        for steps in 0..max_steps {
            if still > rest_steps {
                return Settled { at_rest: true, time_s: steps as f32 * dt };
            }
            self.step(1);
            still = if self.fastest_m_s() < rest_speed { still + 1 } else { 0 };
        }
        Settled { at_rest: still > rest_steps, time_s: max_steps as f32 * dt }
    }

    /// Speed of the fastest moving block, m/s; 0 without moving blocks, infinite when a state is not a number.
    pub fn fastest_m_s(&self) -> f32 {
        self.ids().map(|id| self.speed_m_s(id)).fold(0.0, f32::max)
    }

    /// Pose of a block's coordinates; `None` for a removed or unknown block.
    pub fn pose(&self, id: BodyId) -> Option<Pose> {
        let inside = self.physics.bodies.get(self.body(id)?.handle)?.position();
        Some(Pose::from_parts(inside.translation * self.config.length_unit_m, inside.rotation))
    }

    /// Speed of the block's fastest point (bound: |v| + |ω|·reach), m/s; 0 when fixed, asleep or unknown.
    pub fn speed_m_s(&self, id: BodyId) -> f32 {
        let Some(body) = self.body(id) else { return 0.0 };
        let Some(rigid) = self.physics.bodies.get(body.handle) else { return 0.0 };
        if body.fixed || rigid.is_sleeping() {
            return 0.0;
        }
        let speed = rigid.linvel().length() + rigid.angvel().length() * body.reach;
        // unit / √unit = √unit
        if speed.is_finite() { speed * self.config.time_unit_s() } else { f32::INFINITY }
    }

    /// A push at the centre of mass, N·s; wakes the block.
    pub fn apply_impulse(&mut self, id: BodyId, impulse_n_s: Vec3) {
        let Some(handle) = self.body(id).map(|b| b.handle) else { return };
        if let Some(rigid) = self.physics.bodies.get_mut(handle) {
            rigid.apply_impulse(impulse_n_s / self.config.time_unit_s(), true);
        }
    }

    /// Gives a moving block the speed and turn with which it is in a pose after one step; its weight is carried meanwhile.
    /// What stands in the way still stops it.
    pub fn steer(&mut self, id: BodyId, site_from_block: &Pose) {
        let Some(body) = self.body(id) else { return };
        let (handle, centre, target) = (body.handle, body.centre, self.inside(site_from_block));
        let (dt, gravity) = (self.config.step_s, self.physics.gravity);
        if let Some(rigid) = self.physics.bodies.get_mut(handle) {
            let now = *rigid.position();
            let mut turn = target.rotation * now.rotation.inverse();
            if turn.w < 0.0 {
                turn = -turn;
            }
            rigid.set_linvel((target * centre - now * centre) / dt - gravity * dt, true);
            rigid.set_angvel(turn.to_scaled_axis() / dt, true);
        }
    }

    /// Puts a moving block into a pose, at rest.
    pub fn set_pose(&mut self, id: BodyId, site_from_block: &Pose) {
        let Some(handle) = self.body(id).map(|b| b.handle) else { return };
        let inside = self.inside(site_from_block);
        if let Some(rigid) = self.physics.bodies.get_mut(handle) {
            rigid.set_position(inside, true);
        }
        self.halt(id);
    }

    /// Takes a block's speed and turn away.
    pub fn halt(&mut self, id: BodyId) {
        let Some(handle) = self.body(id).map(|b| b.handle) else { return };
        if let Some(rigid) = self.physics.bodies.get_mut(handle) {
            rigid.set_linvel(Vec3::ZERO, true);
            rigid.set_angvel(Vec3::ZERO, true);
        }
    }

    /// First thing on the ray within `max_m` and its distance; `direction` must be a unit vector.
    pub fn cast_ray(
        &mut self,
        origin: Vec3,
        direction: Vec3,
        max_m: f32,
    ) -> Option<(Touched, f32)> {
        if self.stale {
            self.physics.detect_collisions(&(), &());
            self.stale = false;
        }
        let unit_m = self.config.length_unit_m;
        let ray = Ray::new(origin / unit_m, direction);
        let (collider, distance) =
            self.physics.cast_ray(&ray, max_m / unit_m, true, QueryFilter::default())?;
        Some((touched(self.physics.colliders.get(collider)?.user_data), distance * unit_m))
    }

    pub(crate) fn body(&self, id: BodyId) -> Option<&Body> {
        self.bodies.get(id.0 as usize)?.as_ref()
    }

    fn add(&mut self, shape: &BlockShape, body: RigidBodyBuilder, fixed: bool) -> BodyId {
        let id = self.bodies.len() as u32;
        let handle = self.physics.insert_body(body.user_data(u128::from(id)).build());
        if let Some(rigid) = self.physics.bodies.get_mut(handle) {
            rigid.activation_mut().normalized_linear_threshold = self.config.rest_speed_m_s;
            rigid.activation_mut().time_until_sleep = self.config.rest_time_s;
        }
        let unit_m = self.config.length_unit_m;
        let hulls = shape.hulls_in(unit_m);
        for hull in hulls.iter() {
            // Hulls carry no mass: the body has that of the true solid. One collider a hull, not a compound, which often never rests.
            let collider = self
                .surface(ColliderBuilder::new(hull.clone()).density(0.0))
                .user_data(u128::from(id));
            self.physics.insert_collider(collider, Some(handle));
        }
        let (centre, reach) = (shape.centre() / unit_m, shape.reach_m() / unit_m);
        self.bodies.push(Some(Body { handle, hulls, centre, reach, placed: !fixed, fixed }));
        self.stale = true;
        BodyId(id)
    }

    /// A pose in engine units.
    fn inside(&self, site_from_block: &Pose) -> Pose {
        Pose::from_parts(
            site_from_block.translation / self.config.length_unit_m,
            site_from_block.rotation,
        )
    }

    fn add_static(&mut self, collider: ColliderBuilder, user_data: u128) {
        let collider = self.surface(collider).user_data(user_data);
        self.physics.insert_collider(collider, None);
        self.stale = true;
    }

    fn surface(&self, collider: ColliderBuilder) -> ColliderBuilder {
        let rule = match self.config.friction_rule {
            FrictionRule::Average => CoefficientCombineRule::Average,
            FrictionRule::Multiply => CoefficientCombineRule::Multiply,
            FrictionRule::Min => CoefficientCombineRule::Min,
            FrictionRule::Max => CoefficientCombineRule::Max,
        };
        collider
            .friction(self.config.friction)
            .friction_combine_rule(rule)
            .restitution(self.config.restitution)
    }
}

/// What a collider's user data stands for.
pub(crate) fn touched(user_data: u128) -> Touched {
    match user_data {
        GROUND => Touched::Ground,
        WALL => Touched::Wall,
        id => Touched::Block(BodyId(id as u32)),
    }
}

fn integration(config: &PhysicsConfig) -> IntegrationParameters {
    IntegrationParameters {
        dt: config.step_s,
        num_solver_iterations: config.solver_iterations,
        num_internal_stabilization_iterations: config.stabilization_iterations,
        friction_model: FrictionModel::Simplified,
        // With friction in the bias pass piles never come to rest.
        friction_in_bias_pass: false,
        ..Default::default()
    }
}
