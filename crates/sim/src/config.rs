//! Physics settings. `Default` holds the method's values (METHOD §6) where the engine has them.

use crate::SimError;
use serde::{Deserialize, Serialize};

/// How the friction (and restitution) of two touching bodies combine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionRule {
    /// The mean of both: 0.8 on 0.8 acts as 0.8.
    #[default]
    Average,
    /// The product, as Bullet does it: 0.8 on 0.8 acts as 0.64.
    Multiply,
    /// The smaller.
    Min,
    /// The larger.
    Max,
}

/// How a [`crate::World`] behaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhysicsConfig {
    /// Gravity, downwards.
    pub gravity_m_s2: f32,
    /// Coulomb friction coefficient of every surface.
    pub friction: f32,
    /// How two coefficients combine.
    pub friction_rule: FrictionRule,
    /// Restitution of every surface, in [0, 1].
    pub restitution: f32,
    /// Time step for blocks of about 2 m; smaller blocks get a shorter one (× √unit).
    pub step_s: f32,
    /// Time after which [`crate::World::settle`] gives up.
    pub max_time_s: f32,
    /// A block moves while its fastest point is faster than this (× √unit) …
    pub rest_speed_m_s: f32,
    /// … and everything rests once nothing has moved for this long (× √unit).
    pub rest_time_s: f32,
    /// Length that the engine takes for 1, about half a block: a 5 cm part then settles as a 2 m block does, while in
    /// metres the engine's fixed tolerances let it sink in. Follows from the catalogue
    /// ([`PhysicsConfig::for_block_size`]), so files do not hold it.
    #[serde(skip)]
    pub length_unit_m: f32,
    /// Contact solver iterations a step.
    pub solver_iterations: usize,
    /// Stabilisation passes in each iteration; with 1, some piles of tetrapods never come to rest.
    pub stabilization_iterations: usize,
}

impl Default for PhysicsConfig {
    fn default() -> Self {
        Self {
            gravity_m_s2: 9.81,
            friction: 0.8,
            friction_rule: FrictionRule::Average,
            restitution: 0.0,
            step_s: 1.0 / 120.0,
            max_time_s: 30.0,
            rest_speed_m_s: 0.05,
            rest_time_s: 0.5,
            length_unit_m: 1.0,
            solver_iterations: 4,
            stabilization_iterations: 2,
        }
    }
}

impl PhysicsConfig {
    /// The same settings for blocks whose largest box edge is `d_box_m`.
    pub fn for_block_size(self, d_box_m: f32) -> Self {
        Self { length_unit_m: unit_for(d_box_m), ..self }
    }

    /// Checks every range.
    pub fn check(&self) -> Result<(), SimError> {
        let range = |key, value: f32, low: f32, high: f32, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SimError::BadSetting { key, value, why })
            }
        };
        range("gravity_m_s2", self.gravity_m_s2, 0.1, 100.0, "0.1 to 100 m/s²")?;
        range("friction", self.friction, 0.0, 10.0, "0 to 10")?;
        range("restitution", self.restitution, 0.0, 1.0, "0 to 1")?;
        range(
            "step_s",
            self.step_s,
            1e-4,
            1.0 / 30.0,
            "0.0001 to 0.0333 s; longer steps let blocks sink into each other",
        )?;
        range("max_time_s", self.max_time_s, 0.0, 3600.0, "0 to 3600 s")?;
        range("rest_speed_m_s", self.rest_speed_m_s, 1e-4, 1.0, "0.0001 to 1 m/s")?;
        range("rest_time_s", self.rest_time_s, 0.0, 60.0, "0 to 60 s")?;
        range("length_unit_m", self.length_unit_m, 1e-4, 100.0, "0.0001 to 100 m")?;
        range("solver_iterations", self.solver_iterations as f32, 1.0, 64.0, "1 to 64")?;
        range(
            "stabilization_iterations",
            self.stabilization_iterations as f32,
            1.0,
            16.0,
            "1 to 16",
        )
    }

    /// Seconds in one second of the engine: √unit, so that g keeps its number.
    pub(crate) fn time_unit_s(&self) -> f32 {
        self.length_unit_m.sqrt()
    }
}

/// The power of two nearest to half the size: scaling by it loses no bit.
pub(crate) fn unit_for(d_box_m: f32) -> f32 {
    (d_box_m / 2.0).log2().round().exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_named() {
        assert_eq!(PhysicsConfig::default().check(), Ok(()));
        let bad = PhysicsConfig { step_s: 0.5, ..Default::default() };
        assert!(matches!(bad.check(), Err(SimError::BadSetting { key: "step_s", .. })));
        let nan = PhysicsConfig { friction: f32::NAN, ..Default::default() };
        assert!(nan.check().is_err());
    }
}
