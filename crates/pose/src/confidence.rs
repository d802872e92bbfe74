//! Probability that pose and type are right, from the features the verification leaves.
//!
//! A logistic function of a few features, fitted by `tools/oracle/fit_confidence.py` on piles of several shapes, sensors
//! and kinds of segmentation, and checked on other piles (docs/bench/poses.md). The features are pure numbers, so that one
//! function serves blocks of all sizes: what decides is how well the pose is held, how much of what ought to be seen
//! is seen and how near the points lie, hardly how many they are.

/// What the verification knows of an accepted block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Area of its own points in halves of its surface.
    pub area: f32,
    /// Mean weight of its own points: how near and how well aligned, in [0, 1].
    pub fit: f32,
    /// Share of the points within reach that are its own and not a neighbour's.
    pub own: f32,
    /// Share of the surface that ought to be seen and is.
    pub agreement: f32,
    /// Evidence against it over evidence for it.
    pub against: f32,
    /// Share of its inside within a neighbour that was accepted before it.
    pub shared: f32,
    /// Largest standard deviation of the place over a true positive's limit.
    pub shift_sd: f32,
    /// Largest standard deviation of a turn over a true positive's limit.
    pub turn_sd: f32,
    /// Mean distance of its points over what is usual in this survey, nearer to 1 where they are few.
    pub rough: f32,
    /// How well another pose explains its own points, over how well this one does.
    pub rival: f32,
    /// By how many nats the type beats the next; infinite with one type.
    pub type_margin: f32,
    /// Its points lie in a plane that goes on beside it, and better than on the block: they say nothing of a block.
    pub in_a_plane: bool,
}

/// Numbers of [`Features::terms`].
pub const TERMS: usize = 10;

/// Fitted weights of the features; the first is the constant's.
const WEIGHTS: [f32; TERMS] =
    [-13.959, 0.096, 5.110, 5.317, 9.649, -0.499, -8.375, -0.919, -15.760, -6.235];
/// Other poses explain this much of most well held blocks' points too.
const RIVAL_FREE: f32 = 0.5;
/// Share of right blocks among those the weights were fitted to.
const FITTED_SHARE: f32 = 0.9;
/// So many blocks' worth is the fitted share believed against a pile's own.
const PRIOR_BLOCKS: f32 = 10.0;
/// Bound of the shift.
const MOST_SHIFT: f32 = 2.5;
/// Rounds of expectation maximisation.
const PRIOR_ROUNDS: usize = 100;
/// How much of a nat of type margin is a fact: points err together, sensors have biases. Fitted by hand to cubes and
/// tetrapods 6 % apart: of 31 cubes below 10 nats 17 had the right type, of 24 from 10 to 20 18, of 110 above all.
const TYPE_SLOPE: f32 = 0.1;
/// By how much more a nat is worth for every nat there is already: small margins come from one edge, large ones from many.
const TYPE_GROWTH: f32 = 0.0025;

impl Features {
    /// What the logistic function is linear in.
    pub fn terms(&self) -> [f32; TERMS] {
        [
            1.0,
            self.area.max(0.01).ln().min(-1.0),
            self.fit,
            self.own,
            self.agreement,
            self.against.clamp(0.0, 2.0),
            self.shared.clamp(0.0, 0.5),
            self.turn_sd.max(self.shift_sd).max(0.02).ln().clamp(-3.0, 1.0),
            self.rough.max(1e-3).ln().clamp(0.0, 1.5),
            (self.rival - RIVAL_FREE).clamp(0.0, 0.7),
        ]
    }
}

/// How sure one may be of a block of this pile before looking at its features: in a pile of nothing but catalogue blocks
/// surer than among foreign blocks. Found from the features of all blocks by expectation maximisation: the share of right
/// blocks is the mean of the probabilities that it leads to (Saerens, Latinne, Decaestecker 2002).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilePrior {
    /// By how much the log-odds of every block move.
    shift: f32,
}

impl PilePrior {
    /// From the features of all accepted blocks of a pile.
    pub fn of(features: &[Features]) -> Self {
        let log_odds: Vec<f32> = features.iter().map(log_odds).collect();
        let mut shift = 0.0_f32;
        for _ in 0..PRIOR_ROUNDS {
            let right: f32 = log_odds.iter().map(|z| logistic(z + shift)).sum();
            let share =
                (right + PRIOR_BLOCKS * FITTED_SHARE) / (log_odds.len() as f32 + PRIOR_BLOCKS);
            shift = (logit(share) - logit(FITTED_SHARE)).clamp(-MOST_SHIFT, MOST_SHIFT);
        }
        Self { shift }
    }

    /// The probability that the pose is right, in [0, 1].
    pub fn confidence(&self, features: &Features) -> f32 {
        logistic(log_odds(features) + self.shift)
    }
}

fn log_odds(features: &Features) -> f32 {
    features.terms().iter().zip(WEIGHTS).map(|(f, w)| f * w).sum()
}

fn logistic(z: f32) -> f32 {
    1.0 / (1.0 + (-z).exp())
}

fn logit(p: f32) -> f32 {
    (p / (1.0 - p)).ln()
}

/// The probability that the type is right if the pose is, in [0, 1].
pub fn type_confidence(features: &Features) -> f32 {
    logistic(features.type_margin * (TYPE_SLOPE + TYPE_GROWTH * features.type_margin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_signs_never_lower_it() {
        let plain = Features {
            area: 0.2,
            fit: 0.7,
            own: 0.9,
            agreement: 0.8,
            against: 0.2,
            shared: 0.05,
            shift_sd: 0.1,
            turn_sd: 0.5,
            rough: 1.5,
            rival: 0.8,
            type_margin: 5.0,
            in_a_plane: false,
        };
        let confidence = |features: &Features| PilePrior { shift: 0.0 }.confidence(features);
        let base = confidence(&plain);
        for better in [
            Features { area: 0.3, ..plain },
            Features { fit: 0.8, ..plain },
            Features { own: 1.0, ..plain },
            Features { agreement: 0.9, ..plain },
            Features { against: 0.1, ..plain },
            Features { shared: 0.0, ..plain },
            Features { turn_sd: 0.3, ..plain },
            Features { rough: 1.2, ..plain },
            Features { rival: 0.55, ..plain },
        ] {
            assert!(confidence(&better) > base, "{better:?}");
        }
        assert!(type_confidence(&Features { type_margin: 9.0, ..plain }) > type_confidence(&plain));
        assert_eq!(type_confidence(&Features { type_margin: f32::INFINITY, ..plain }), 1.0);
        assert!((0.0..=1.0).contains(&confidence(&Features { turn_sd: f32::INFINITY, ..plain })));
    }

    #[test]
    fn a_doubtful_block_is_believed_among_good_ones_and_not_among_strangers() {
        let good = Features {
            area: 0.5,
            fit: 0.95,
            own: 1.0,
            agreement: 0.97,
            shift_sd: 0.01,
            turn_sd: 0.05,
            rough: 1.0,
            rival: 0.4,
            ..Features::default()
        };
        let foreign = Features { rough: 4.0, rival: 0.95, agreement: 0.7, fit: 0.6, ..good };
        let doubtful =
            Features { rough: 1.25, agreement: 0.85, fit: 0.8, turn_sd: 0.2, rival: 0.8, ..good };
        let pile = |of: &Features| {
            let mut features = vec![*of; 40];
            features.push(doubtful);
            PilePrior::of(&features).confidence(&doubtful)
        };
        let alone = PilePrior::of(&[doubtful]).confidence(&doubtful);
        assert!(
            pile(&good) > alone && alone > pile(&foreign),
            "{} {alone} {}",
            pile(&good),
            pile(&foreign)
        );
        assert!(PilePrior::of(&[]).shift.abs() < 1e-5);
    }
}
