//! The wall around the physics engine: worlds, drop, settle, rest.
//!
//! A [`World`] holds a ground, walls, fixed blocks and moving blocks; it steps until everything rests and
//! answers questions about poses, contacts and rays. No type of the engine appears outside this crate, and the
//! same calls in the same order give the same bits at any thread count.
//!
//! What the engine does not model: rolling and spinning friction (the thesis sets them; their effect on the
//! height of a pile was not detectable), and coefficients combine by [`FrictionRule`] instead of Bullet's product.

mod block_shape;
mod config;
mod contacts;
mod error;
mod ground;
mod passage;
mod world;

pub use block_shape::BlockShape;
pub use config::{FrictionRule, PhysicsConfig};
pub use contacts::Contact;
pub use error::SimError;
pub use passage::Passage;
pub use world::{BodyId, Settled, Touched, World};
