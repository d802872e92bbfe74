//! Names of what a job does: its stages, and the parts it is kept in.
//!
//! Events, warnings and files say them by their words; code by these types, so that a name nobody knows does not compile.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Who tells of progress, or warns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Stage {
    /// A site looked at before it is worked on.
    Check,
    /// Files read.
    Read,
    /// The catalogue's blocks made.
    Catalogue,
    /// The size of the blocks asked of the survey.
    Size,
    /// Which point belongs to which block.
    Segment,
    /// Pose and type of every block.
    Pose,
    /// Corrections by hand.
    Review,
    /// Blocks to add.
    Plan,
    /// Drops tried in every window.
    Generate,
    /// A plan improved.
    Improve,
    /// Plans with other seeds and thresholds.
    Uncertainty,
    /// What was learned from ratings.
    Ratings,
    /// The next block to place.
    Next,
    /// Two surveys compared.
    Compare,
    /// The whole run.
    Run,
    /// Synthetic scenes made.
    Synth,
    /// A network trained.
    Train,
    /// A network's answers fitted to the truth.
    Calibrate,
}

impl Stage {
    /// Its word in events and warnings.
    pub fn word(self) -> &'static str {
        match self {
            Self::Check => "check",
            Self::Read => "read",
            Self::Catalogue => "catalogue",
            Self::Size => "size",
            Self::Segment => "segment",
            Self::Pose => "pose",
            Self::Review => "review",
            Self::Plan => "plan",
            Self::Generate => "generate",
            Self::Improve => "improve",
            Self::Uncertainty => "uncertainty",
            Self::Ratings => "ratings",
            Self::Next => "next",
            Self::Compare => "compare",
            Self::Run => "run",
            Self::Synth => "synth",
            Self::Train => "train",
            Self::Calibrate => "calibrate",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// A part of a job that is timed, and kept where a job that was killed goes on from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[non_exhaustive]
pub enum JobPart {
    /// The site, read.
    #[serde(rename = "read")]
    Read,
    /// Instances.
    #[serde(rename = "segment")]
    Segment,
    /// Recognised blocks.
    #[serde(rename = "recognise")]
    Recognise,
    /// Blocks of both halves of the surveys.
    #[serde(rename = "self-check")]
    SelfCheck,
    /// The files of recognition.
    #[serde(rename = "write recognise")]
    WriteRecognise,
    /// Blocks to add.
    #[serde(rename = "plan")]
    Plan,
    /// The range of their count.
    #[serde(rename = "range")]
    Range,
    /// Tiles of a site that is worked on in tiles.
    #[serde(rename = "tiles")]
    Tiles,
    /// Files for other programs.
    #[serde(rename = "exports")]
    Exports,
    /// The report.
    #[serde(rename = "report")]
    Report,
    /// The manifest.
    #[serde(rename = "manifest")]
    Manifest,
}

impl JobPart {
    /// Its word in events, and the name of the file that keeps it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Segment => "segment",
            Self::Recognise => "recognise",
            Self::SelfCheck => "self-check",
            Self::WriteRecognise => "write recognise",
            Self::Plan => "plan",
            Self::Range => "range",
            Self::Tiles => "tiles",
            Self::Exports => "exports",
            Self::Report => "report",
            Self::Manifest => "manifest",
        }
    }
}

impl fmt::Display for JobPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}
