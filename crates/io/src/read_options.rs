//! Which points of a file are left out while it is read, and what is passed over.

use std::collections::BTreeMap;

/// What a reader of clouds is told.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Points to leave out by class and flag.
    pub leave_out: LeaveOut,
    /// Read the columns `instance`, `model` and `confidence`; a survey's are not used, so that strange ones do no harm.
    pub labels: bool,
    /// Points far from all others are left out.
    pub without_strays: bool,
    /// What −1 in a column of instances is read as; the largest number stands for every number below 0. Without: 0 in a column `label`, refused in a column `instance`.
    pub minus_one: Option<u32>,
    /// A table of places in plan: heights are not needed, and not read.
    pub plane: bool,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            leave_out: LeaveOut::default(),
            labels: true,
            without_strays: false,
            minus_one: None,
            plane: false,
        }
    }
}

impl ReadOptions {
    /// For a survey: labels are passed over, strays left out.
    pub fn survey() -> Self {
        Self { labels: false, without_strays: true, ..Self::default() }
    }

    /// The same with what a site says of a survey.
    pub fn of_survey(spec: &scene::SurveySpec) -> Self {
        Self { leave_out: LeaveOut::with(&spec.leave_out, &spec.keep), ..Self::survey() }
    }

    /// For a labelled cloud that is compared point by point with another: nothing is left out.
    pub fn every_point() -> Self {
        Self { leave_out: LeaveOut::nothing(), ..Self::default() }
    }

    /// The same where −1 must be told from 0: it becomes the largest number.
    pub fn every_label() -> Self {
        Self { minus_one: Some(u32::MAX), ..Self::every_point() }
    }
}

/// Classes and flags whose points are left out. The default leaves out what its surveyor has marked as no surface: withheld
/// points, noise (classes 7 and 18) and water (9).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeaveOut {
    classes: Vec<u8>,
    flags: u8,
}

/// Bits of the flags, as LAS 1.4 has them.
pub(crate) const SYNTHETIC: u8 = 1;
pub(crate) const WITHHELD: u8 = 4;
pub(crate) const OVERLAP: u8 = 8;

impl Default for LeaveOut {
    fn default() -> Self {
        Self { classes: vec![7, 9, 18], flags: WITHHELD }
    }
}

impl LeaveOut {
    /// Every point is read.
    pub fn nothing() -> Self {
        Self { classes: Vec::new(), flags: 0 }
    }

    /// The default, with these left out too and those kept.
    pub fn with(leave_out: &[scene::PointMark], keep: &[scene::PointMark]) -> Self {
        let mut out = Self::default();
        leave_out.iter().for_each(|m| out.set(*m, true));
        keep.iter().for_each(|m| out.set(*m, false));
        out
    }

    fn set(&mut self, mark: scene::PointMark, out: bool) {
        use scene::PointMark::{Class, Flag};
        let bit = match mark {
            Class(class) => {
                self.classes.retain(|c| *c != class);
                self.classes.extend(out.then_some(class));
                return;
            }
            Flag(scene::PointFlag::Withheld) => WITHHELD,
            Flag(scene::PointFlag::Synthetic) => SYNTHETIC,
            Flag(scene::PointFlag::Overlap) => OVERLAP,
        };
        self.flags = if out { self.flags | bit } else { self.flags & !bit };
    }

    /// Why a point of this class and these flags is left out; `None`: it is read.
    #[inline]
    pub fn reason(&self, class: u8, flags: u8) -> Option<Reason> {
        if flags & self.flags != 0 {
            let bit = flags & self.flags;
            return Some(Reason::Flag(bit & bit.wrapping_neg()));
        }
        self.classes.contains(&class).then_some(Reason::Class(class))
    }
}

/// Points of a file with a column of classes: how many of each class there are, and how many are left out.
#[derive(Debug, Default)]
pub(crate) struct ByClass {
    /// Of each class, those left out included.
    pub classes: BTreeMap<u8, u64>,
    /// Those left out.
    pub left_out: LeftOut,
}

impl ByClass {
    /// Counts a point, and tells whether it is left out. What is no class of LAS says nothing.
    pub fn leaves_out(&mut self, class: f64, leave_out: &LeaveOut) -> bool {
        if !(0.0..=255.0).contains(&class) || class.fract() != 0.0 {
            return false;
        }
        let class = class as u8;
        *self.classes.entry(class).or_default() += 1;
        let reason = leave_out.reason(class, 0);
        reason.iter().for_each(|reason| *self.left_out.entry(*reason).or_default() += 1);
        reason.is_some()
    }
}

/// Why points were left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// The format's own mark for "nothing measured".
    Invalid,
    /// A flag: its bit in LAS 1.4.
    Flag(u8),
    /// A class of LAS.
    Class(u8),
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Invalid => f.write_str("marked as invalid"),
            Self::Flag(WITHHELD) => f.write_str("withheld"),
            Self::Flag(SYNTHETIC) => f.write_str("synthetic"),
            Self::Flag(_) => f.write_str("overlap"),
            Self::Class(7) => f.write_str("of class 7 (noise)"),
            Self::Class(18) => f.write_str("of class 18 (high noise)"),
            Self::Class(9) => f.write_str("of class 9 (water)"),
            Self::Class(class) => write!(f, "of class {class}"),
        }
    }
}

/// How many points were left out, by reason.
pub type LeftOut = BTreeMap<Reason, u64>;

/// `12 of class 7 (noise), 3 withheld`.
pub fn describe(left_out: &LeftOut) -> String {
    left_out.iter().map(|(reason, n)| format!("{n} {reason}")).collect::<Vec<_>>().join(", ")
}
