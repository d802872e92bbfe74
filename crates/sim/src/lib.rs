//! The wall around the physics engine: worlds, drop, settle, rest.
