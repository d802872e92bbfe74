//! Probability that pose and type are right, from the signs the verification leaves.
//!
//! A logistic function of few signs, fitted on synthetic scenes (docs/bench/poses.md); of blocks given 0.9 about
//! nine in ten are right.

/// What the verification knows of an accepted block.
#[derive(Clone, Copy, Debug)]
pub struct Signs {
    /// What it added when it was accepted, in halves of its surface.
    pub gain: f32,
    /// Share of the surface that ought to be seen and is.
    pub agreement: f32,
    /// Best rival's share of its score.
    pub rival: f32,
    /// Share of the surface with points on it.
    pub visible: f32,
    /// By how many nats the type beats the next; infinite with one type.
    pub type_margin: f32,
}

/// The probability, in [0, 1].
pub fn confidence(signs: &Signs) -> f32 {
    let z = -4.0 + 8.0 * signs.gain.min(0.6) + 4.0 * (signs.agreement - 0.5) - 3.0 * (signs.rival - 0.7).max(0.0)
        + 4.0 * signs.visible.min(0.4);
    let pose = 1.0 / (1.0 + (-z).exp());
    let kind = 1.0 / (1.0 + (-signs.type_margin).exp());
    pose * kind
}
