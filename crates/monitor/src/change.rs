//! What happened to a block.

use geom::Vec3;
use scene::ModelId;
use serde::Serialize;

/// The classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Nothing beyond the level of detection.
    Unchanged,
    /// Its centre moved.
    Moved,
    /// It turned where it is.
    Turned,
    /// It went down, hardly sideways.
    Sunk,
    /// It is gone: the later survey sees through where it was.
    Missing,
    /// It was not there: the earlier survey sees through where it is.
    New,
    /// One epoch does not show the place well enough to say.
    Hidden,
    /// Surface that ought to be seen is gone while the rest fits.
    PossiblyBroken,
    /// The evidence contradicts itself.
    Doubtful,
}

impl Class {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 9] = [
        Self::Unchanged,
        Self::Moved,
        Self::Turned,
        Self::Sunk,
        Self::Missing,
        Self::New,
        Self::Hidden,
        Self::PossiblyBroken,
        Self::Doubtful,
    ];

    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Unchanged => "unchanged",
            Self::Moved => "moved",
            Self::Turned => "turned",
            Self::Sunk => "sunk",
            Self::Missing => "missing",
            Self::New => "new",
            Self::Hidden => "hidden",
            Self::PossiblyBroken => "possibly broken",
            Self::Doubtful => "doubtful",
        }
    }
}

/// One block of either epoch. Lengths in metres, angles in radians, places in the earlier epoch's local frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Number of the block in the comparison: the earlier epoch's, or one after its last for blocks seen later only.
    pub block_id: u32,
    /// Number in the earlier epoch.
    pub earlier_id: Option<u32>,
    /// Number in the later epoch.
    pub later_id: Option<u32>,
    /// Type.
    pub model: ModelId,
    /// What happened.
    pub class: Class,
    /// Shift of the centre, later less earlier.
    pub shift_m: [f64; 3],
    /// Its length.
    pub distance_m: f64,
    /// The least turn over the block's symmetry.
    pub turn_rad: f64,
    /// Unit axis of the turn; zero without a turn.
    pub axis: [f64; 3],
    /// Level of detection of a movement in the direction of the shift: 1.96 standard deviations.
    pub level_m: f64,
    /// The same along east, north and up.
    pub level_axes_m: [f64; 3],
    /// Level of detection of a turn about its axis.
    pub level_rad: f64,
    /// Probability of a difference at least this large without any change; 1 where it does not apply.
    pub significance: f64,
    /// Probability that the class is right as far as poses (pairs) or the view (single blocks) can tell.
    pub confidence: f64,
    /// Share of the surface hidden in the earlier epoch.
    pub occlusion_earlier: Option<f64>,
    /// The same in the later epoch.
    pub occlusion_later: Option<f64>,
    /// Centre in the earlier epoch.
    pub centre_earlier: Option<Vec3>,
    /// Centre in the later epoch, registered.
    pub centre_later: Option<Vec3>,
    /// Readings of the turn that the shift allows; more than 1: the block may have rolled by a symmetry of its own.
    pub readings: usize,
    /// Surface that is gone, m²; 0 where none is.
    pub gone_m2: f64,
    /// Surface that the later epoch shows inside it, m²; 0 where none is.
    pub face_m2: f64,
    /// What a reader should know.
    pub note: String,
}

impl Change {
    /// One without figures of a movement, of no epoch yet.
    pub(crate) fn blank(model: ModelId, class: Class, note: String) -> Self {
        Self {
            block_id: 0,
            earlier_id: None,
            later_id: None,
            model,
            class,
            shift_m: [0.0; 3],
            distance_m: 0.0,
            turn_rad: 0.0,
            axis: [0.0; 3],
            level_m: 0.0,
            level_axes_m: [0.0; 3],
            level_rad: 0.0,
            significance: 1.0,
            confidence: 0.0,
            occlusion_earlier: None,
            occlusion_later: None,
            centre_earlier: None,
            centre_later: None,
            readings: 1,
            gone_m2: 0.0,
            face_m2: 0.0,
            note,
        }
    }
}
