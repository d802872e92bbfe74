//! Probability that pose and type are right, from the features the verification leaves.
//!
//! A logistic function of a few features. The features are pure numbers, so that one function serves blocks of all
//! sizes; half of them compare a block with its neighbours and rivals, the others say how good it is by itself, because a
//! fault that all blocks of a survey share shows in no comparison. The weights are fitted by the example
//! `fit_pose_confidence` to piles of several shapes and sensors and to scenes without any of the blocks looked for.

use std::sync::LazyLock;

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
    /// Mean distance of its points over the survey's noise.
    pub noisy: f32,
    /// Share of the points of a shell of several reaches that lie on it.
    pub shell: f32,
    /// Mean distance of the points on it, over d_max.
    pub off: f32,
    /// How far whole pieces of its surface are off together, over d_max.
    pub bias: f32,
    /// Share of the surface that ought to be seen and has points at it.
    pub covered: f32,
    /// Share of its inside that a sensor looked through.
    pub hollow: f32,
    /// By how much another size would fit it better, the logarithm's amount.
    pub scale: f32,
    /// Share of the points around it that blocks explain, those of the bed aside.
    pub around: f32,
    /// The same of the whole survey.
    pub explained: f32,
    /// Its points lie in a plane that goes on beside it, and better than on the block: they say nothing of a block.
    pub in_a_plane: bool,
    /// Points of surface that goes on beyond its edges and is no other block's, over its own.
    pub goes_on: f32,
    /// The block is made of a few flat faces, which stairs, walls and slabs imitate; other shapes are imitated by little.
    pub flat_faces: bool,
}

/// Numbers of [`Features::terms`].
pub const TERMS: usize = 21;

/// Their names, as `fitted/confidence.txt` calls them.
pub const NAMES: [&str; TERMS] = [
    "constant",
    "ln-area",
    "fit",
    "own",
    "agreement",
    "against",
    "shared",
    "ln-sd",
    "ln-rough",
    "rival",
    "ln-noisy",
    "shell",
    "ln-off",
    "ln-bias",
    "covered",
    "hollow",
    "scale",
    "around",
    "explained",
    "in-a-plane",
    "goes-on",
];

/// Weights for blocks of flat faces and for others, as fitted by the example `fit_pose_confidence` (`cargo xtask fit pose-confidence`); the
/// file says to what.
const FITTED: &str = include_str!("../fitted/confidence.txt");
/// Other poses explain this much of most well held blocks' points too.
const RIVAL_FREE: f32 = 0.5;
/// Beside narrow joints the next face begins within the strip that is looked at: so many points go on beside right blocks.
const EDGE_FREE: f32 = 0.012;
/// How much of a nat of type margin is a fact (points err together, sensors have biases), and by how much more a nat says
/// for every nat there is already (small margins come from one edge, large ones from many); the file says to what both were fitted.
const FITTED_TYPES: &str = include_str!("../fitted/type-confidence.txt");
const TYPE_NAMES: [&str; 2] = ["slope", "growth"];

/// What the blocks around say of one, for blocks of flat faces and for others; the file says to what it was fitted.
const FITTED_AMONG: &str = include_str!("../fitted/among-confidence.txt");
/// Numbers of [`among_terms`], as `fitted/among-confidence.txt` calls them.
pub const AMONG_NAMES: [&str; 3] = ["constant", "slope", "sure"];
/// Where the blocks around are this sure on average, they lie in a pile: more says no more. Tried were 0.2 to 1; 0.3 to 0.4 predicts
/// the other seed best.
const IN_A_PILE: f32 = 0.4;
/// Blocks this near are around a block, in units of the largest d_max: the scenes of the fit reach about as far.
pub const AROUND_BLOCKS: f32 = 4.0;

/// What the probability among others is the logistic function of, in the order of [`AMONG_NAMES`]: `alone` is the probability by the
/// block's own features, `others` the mean of that of the blocks around it.
pub fn among_terms(alone: f32, others: f32) -> [f32; 3] {
    let p = alone.clamp(1e-6, 1.0 - 1e-6);
    [1.0, (p / (1.0 - p)).ln(), (others / IN_A_PILE).min(1.0)]
}

/// Less likely than this, what lies beside a block is another thing and says nothing of it: a part among unlike parts is as sure as it is
/// by itself. Tried were 0 to 0.1: from 0.003 on more waves are stated.
const NOTHING: f32 = 0.001;

/// Whether something this likely by itself speaks for or against the blocks around it. Beside flat faces everything does: of a flight of
/// stairs most steps are next to nothing.
pub fn speaks(alone: f32, flat_faces: bool) -> bool {
    flat_faces || alone >= NOTHING
}

/// The probability that a pose is right among other blocks. Bumps of smooth ground each look a little like a block and none
/// surely does, while most blocks of a pile are sure; a block without any other around it stays as sure as it is by itself.
pub fn among(alone: f32, others: Option<f32>, flat_faces: bool) -> f32 {
    static WEIGHTS: LazyLock<[[f32; 3]; 2]> = LazyLock::new(|| {
        weights(FITTED_AMONG, AMONG_NAMES)
            .expect("the file is part of the program and a test reads it")
    });
    let Some(others) = others else { return alone };
    let weights = &WEIGHTS[usize::from(!flat_faces)];
    logistic(among_terms(alone, others).iter().zip(weights).map(|(f, w)| f * w).sum())
}

impl Features {
    /// What the logistic function is linear in, in the order of [`NAMES`]. Good is good enough: beyond where
    /// right blocks of poor surveys lie (under sand, smoothed, hidden to most) better features say nothing more.
    pub fn terms(&self) -> [f32; TERMS] {
        [
            1.0,
            self.area.max(0.01).ln().min(-1.0),
            self.fit.min(0.85),
            self.own,
            self.agreement.min(0.9),
            self.against.clamp(0.0, 2.0),
            self.shared.clamp(0.0, 0.5),
            self.turn_sd.max(self.shift_sd).max(0.02).ln().clamp(-2.0, 1.0),
            self.rough.max(1e-3).ln().clamp(0.0, 1.5),
            (self.rival - RIVAL_FREE).clamp(0.3, 0.7),
            self.noisy.max(1e-3).ln().clamp(0.25, 1.5),
            self.shell.min(0.85),
            self.off.max(1e-4).ln().clamp(-4.4, -3.0),
            self.bias.max(1e-4).ln().clamp(-5.0, -3.0),
            self.covered.min(0.9),
            self.hollow.min(0.3),
            self.scale.clamp(0.02, 0.1),
            self.around.min(0.6),
            self.explained.min(0.15),
            f32::from(u8::from(self.in_a_plane)),
            (self.goes_on - EDGE_FREE).clamp(0.0, 0.05),
        ]
    }

    /// The probability that the pose is right, in [0, 1].
    pub fn confidence(&self) -> f32 {
        static WEIGHTS: LazyLock<[[f32; TERMS]; 2]> = LazyLock::new(|| {
            weights(FITTED, NAMES).expect("the file is part of the program and a test reads it")
        });
        let weights = &WEIGHTS[usize::from(!self.flat_faces)];
        logistic(self.terms().iter().zip(weights).map(|(f, w)| f * w).sum())
    }
}

/// The weights a fitted file gives: a name and K numbers a line, `#` begins a remark. The error says which line is wrong.
fn weights<const N: usize, const K: usize>(
    text: &str,
    names: [&str; N],
) -> Result<[[f32; N]; K], String> {
    let lines =
        text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let mut found = [[0.0; N]; K];
    let mut count = 0;
    for (n, line) in lines {
        let wrong =
            || format!("line {}: `{line}` should give a feature and {K} of its weights", n + 1);
        let mut words = line.split_whitespace();
        let name = words.next().ok_or_else(wrong)?;
        if names.get(count) != Some(&name) {
            return Err(format!("{}: expected `{}`", wrong(), names.get(count).unwrap_or(&"end")));
        }
        for column in &mut found {
            column[count] = words.next().and_then(|w| w.parse().ok()).ok_or_else(wrong)?;
        }
        if words.next().is_some() {
            return Err(wrong());
        }
        count += 1;
    }
    if count == N { Ok(found) } else { Err(format!("{count} of {N} weights")) }
}

fn logistic(z: f32) -> f32 {
    1.0 / (1.0 + (-z).exp())
}

/// The probability that the type is right if the pose is, in [0, 1].
pub fn type_confidence(features: &Features) -> f32 {
    static WEIGHTS: LazyLock<[[f32; 2]; 1]> = LazyLock::new(|| {
        weights(FITTED_TYPES, TYPE_NAMES)
            .expect("the file is part of the program and a test reads it")
    });
    let [[slope, growth]] = *WEIGHTS;
    logistic(features.type_margin * (slope + growth * features.type_margin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fitted_file_names_every_feature() {
        let [flat, other] = weights::<TERMS, 2>(FITTED, NAMES).unwrap();
        assert!(flat.iter().any(|w| *w != 0.0) && other.iter().any(|w| *w != 0.0));
        let read = |text| weights::<TERMS, 2>(text, NAMES).unwrap_err();
        assert!(read("constant 1 2\narea 2 3").contains("line 2"));
        assert!(read("constant 1").contains("line 1"));
        assert!(read("constant 1 2 3").contains("line 1"));
        assert!(read("constant 1 2").contains("1 of"));
        let among = weights::<3, 2>(FITTED_AMONG, AMONG_NAMES).unwrap();
        assert!(among.iter().all(|[_, slope, sure]| *slope > 0.0 && *sure >= 0.0));
        assert!(weights::<2, 1>(FITTED_TYPES, TYPE_NAMES).unwrap()[0].iter().all(|w| *w >= 0.0));
    }

    /// Of seven bumps of smooth ground one was once stated; twenty of twenty blocks of piles by echo sounder were not, and were right.
    #[test]
    fn a_pile_speaks_for_a_block_and_doubtful_neighbours_speak_against_it() {
        for flat in [false, true] {
            let among = |others| among(0.6, others, flat);
            assert_eq!(among(None), 0.6);
            assert!(among(Some(0.05)) < 0.4, "flat {flat}");
            assert!(among(Some(0.9)) > 0.6, "flat {flat}");
            assert_eq!(among(Some(0.9)), among(Some(0.5)));
        }
    }

    #[test]
    fn better_features_never_lower_it() {
        let plain = Features {
            area: 0.2,
            fit: 0.7,
            own: 0.9,
            agreement: 0.8,
            against: 0.1,
            shared: 0.01,
            shift_sd: 0.05,
            turn_sd: 0.5,
            rough: 1.3,
            rival: 0.8,
            type_margin: 5.0,
            noisy: 1.3,
            shell: 0.7,
            off: 0.012,
            bias: 0.01,
            covered: 0.85,
            hollow: 0.05,
            scale: 0.03,
            around: 0.7,
            explained: 0.7,
            in_a_plane: false,
            goes_on: 0.05,
            flat_faces: true,
        };
        for plain in [plain, Features { flat_faces: false, ..plain }] {
            no_better_feature_lowers(plain);
        }
        assert!(type_confidence(&Features { type_margin: 9.0, ..plain }) > type_confidence(&plain));
        assert_eq!(type_confidence(&Features { type_margin: f32::INFINITY, ..plain }), 1.0);
        let free = Features { turn_sd: f32::INFINITY, ..plain };
        assert!((0.0..=1.0).contains(&free.confidence()));
    }

    fn no_better_feature_lowers(plain: Features) {
        let base = plain.confidence();
        for better in [
            Features { area: 0.3, ..plain },
            Features { fit: 0.8, ..plain },
            Features { agreement: 0.87, ..plain },
            Features { shared: 0.0, ..plain },
            Features { turn_sd: 0.3, ..plain },
            Features { rival: 0.55, ..plain },
            Features { shell: 0.95, ..plain },
            Features { bias: 0.005, ..plain },
            Features { covered: 0.95, ..plain },
            Features { hollow: 0.0, ..plain },
            Features { scale: 0.0, ..plain },
            Features { around: 0.9, ..plain },
            Features { goes_on: 0.0, ..plain },
        ] {
            assert!(better.confidence() >= base, "{better:?}");
        }
    }
}
