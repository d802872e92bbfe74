//! What is true of a survey as a whole, so that it can be worked on in parts and give what the whole gives.
//!
//! Noise, errors of survey lines, an echo sounder's fattening, how far points usually lie from blocks, how much the blocks explain
//! and which size fits them: the stage measures these on what it is given. Measured on every part alone they would differ from part
//! to part, and a block would change with the cut. In: a part of the survey that stands for all of it. Out: [`PileFacts`], which
//! every part is then recognised with.

use crate::absolute::CommonSize;
use crate::fattening::Fattening;
use crate::levelling::level;
use crate::viewpoint::Viewpoint;
use geom::Vec3;
use scene::Survey;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Facts of a whole survey.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PileFacts {
    /// How far each survey line is off; `None`: the lines are not told apart.
    pub lines: Option<LineShifts>,
    /// Standard deviation of a point, metres.
    pub noise_sd_m: f32,
    /// Area a working point stands for, m².
    pub point_area_m2: f32,
    /// Typical distance between the survey's points, metres.
    pub survey_spacing_m: f32,
    /// From where it was measured, when no sensor position is known.
    pub viewpoint: Option<Viewpoint>,
    /// How much too near slanted faces look to an echo sounder; `None` where too few blocks tell.
    pub fattening: Option<Fattening>,
    /// How far points usually lie from the blocks, metres; `None`: there was none.
    pub typical_m: Option<f32>,
    /// Share of the points that blocks explain, those of the bed aside; `None`: there was none.
    pub explained: Option<f32>,
    /// The size that fits the blocks best over the catalogue's; `None` where too few blocks tell.
    pub size: Option<CommonSize>,
    /// Whether the blocks fit the mirror image of the catalogue's better.
    #[serde(default)]
    pub mirrored: bool,
}

/// How far survey lines are off what all of them measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LineShifts {
    /// Shift of each line by its number, metres: what is taken out.
    pub shift_m: BTreeMap<u16, [f32; 3]>,
    /// How far one line's points scatter about the local surface afterwards, metres.
    pub scatter_m: f32,
}

impl LineShifts {
    /// Of the lines in a survey, for blocks of the given smallest d_max; `None` when there are no lines to lay onto each other.
    pub fn of(survey: &Survey, d_max_m: f32, noise_sd_m: f32) -> Option<Self> {
        let levelled = level(&survey.cloud.position_m, &survey.line, d_max_m, noise_sd_m)?;
        let shift_m = levelled.shifts.iter().map(|(line, s)| (*line, s.to_array())).collect();
        Some(Self { shift_m, scatter_m: levelled.scatter_m })
    }

    /// The survey with the shifts taken out and its lines forgotten.
    pub fn taken_out_of(&self, survey: &Survey) -> Survey {
        let mut out = survey.clone();
        for (p, line) in out.cloud.position_m.iter_mut().zip(&survey.line) {
            if let Some(shift) = self.shift_m.get(line) {
                *p -= Vec3::from_array(*shift);
            }
        }
        out.line = Vec::new();
        out
    }
}

/// A part of a survey that is recognised by itself.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// Facts of the whole.
    pub facts: &'a PileFacts,
    /// Which places are the part's own; what lies beyond is there to be seen only, and no count has it.
    pub owns: &'a (dyn Fn(Vec3) -> bool + Sync),
}
