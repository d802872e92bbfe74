//! Grades of a span, a (worst) to d (sound), by rules the user can set.
//!
//! The defaults follow the order of thought of port inspection (a section lost by a whole layer of blocks is worst, single blocks
//! that moved are the mildest finding), in numbers of our own; they are not the wording of any guideline.

use serde::{Deserialize, Serialize};

/// The grade.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// Worst.
    A,
    /// Bad.
    B,
    /// Slight.
    C,
    /// Sound.
    D,
}

impl Grade {
    /// The letter in files.
    pub fn letter(self) -> char {
        match self {
            Self::A => 'a',
            Self::B => 'b',
            Self::C => 'c',
            Self::D => 'd',
        }
    }
}

/// Values above which a figure earns a grade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Grade a.
    pub a: f64,
    /// Grade b.
    pub b: f64,
    /// Grade c.
    pub c: f64,
}

/// Limits of every figure; the worst grade counts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GradeRules {
    /// Section lost, in layers of blocks (Dn) over the span's plan.
    pub lost_layers: Limits,
    /// Share of the blocks that is missing or possibly broken.
    pub gone_share: Limits,
    /// Share of the blocks that moved, turned or sank.
    pub moved_share: Limits,
    /// Sinking of the span's blocks, in Dn.
    pub sinking_layers: Limits,
}

impl Default for GradeRules {
    fn default() -> Self {
        Self {
            lost_layers: Limits { a: 1.0, b: 0.25, c: 0.05 },
            gone_share: Limits { a: 0.25, b: 0.05, c: 0.0 },
            moved_share: Limits { a: 0.5, b: 0.2, c: 0.0 },
            sinking_layers: Limits { a: 1.0, b: 0.25, c: 0.05 },
        }
    }
}

/// What is graded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Indicators {
    pub lost_layers: f64,
    pub gone_share: f64,
    pub moved_share: f64,
    pub sinking_layers: f64,
}

impl GradeRules {
    /// The worst grade and the figure that gave it.
    pub(crate) fn grade(&self, of: &Indicators) -> (Grade, String) {
        let figures = [
            ("layers of section lost", of.lost_layers, self.lost_layers),
            ("of the blocks missing or possibly broken", of.gone_share, self.gone_share),
            ("of the blocks moved, turned or sunk", of.moved_share, self.moved_share),
            ("layers of sinking", of.sinking_layers, self.sinking_layers),
        ];
        let one = |(what, value, limits): (&str, f64, Limits)| {
            let grade = match value {
                v if v > limits.a => Grade::A,
                v if v > limits.b => Grade::B,
                v if v > limits.c => Grade::C,
                _ => Grade::D,
            };
            (grade, format!("{value:.2} {what}"))
        };
        let worst = figures.into_iter().map(one).min_by_key(|g| g.0).expect("four figures");
        if worst.0 == Grade::D { (Grade::D, String::new()) } else { worst }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_figure_gives_the_grade() {
        let sound =
            Indicators { lost_layers: 0.0, gone_share: 0.0, moved_share: 0.0, sinking_layers: 0.0 };
        let rules = GradeRules::default();
        assert_eq!(rules.grade(&sound), (Grade::D, String::new()));
        let one_moved = Indicators { moved_share: 0.02, ..sound };
        assert_eq!(rules.grade(&one_moved).0, Grade::C);
        let layer_gone = Indicators { lost_layers: 1.2, ..one_moved };
        let (grade, why) = rules.grade(&layer_gone);
        assert_eq!((grade, why.as_str()), (Grade::A, "1.20 layers of section lost"));
    }
}
