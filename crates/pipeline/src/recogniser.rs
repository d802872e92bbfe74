//! From a survey to blocks, whole or in halves.
//!
//! In: a survey. Out: which point belongs to which block, and the blocks. The bin goes, points are segmented, segments
//! become blocks; indices and labels that leave this room are those of the whole survey.

use crate::{Config, PipelineError, survey};
use geom::{Observer, PointCloud, SeedTree, Silent};
use pose::{Cells, Limb, LimbState, Templates};
use scene::{Catalog, InstanceId, Legs, Recognised, Segmentation, Survey, Verdict};
use segment::{Foreground, SegmentModel};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What recognition works with, the same for all its parts.
#[derive(Clone, Copy)]
pub struct Recogniser<'a> {
    /// The site's block types.
    pub catalog: &'a Catalog,
    /// The segmentation network.
    pub model: &'a SegmentModel,
    /// Settings of all stages.
    pub config: &'a Config,
    /// Root of all random choices.
    pub seed: SeedTree,
    /// Hears how far it is.
    pub observer: &'a dyn Observer,
}

/// What recognition leaves. Indices and labels are those of the whole survey.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Recognition {
    /// Instances and centre hypotheses.
    pub segmentation: Segmentation,
    /// Blocks, accepted and not judged.
    pub blocks: Vec<Recognised>,
    /// What is said of the survey as a whole.
    pub pile: pose::PileVerdict,
}

/// What recognition of a part of a survey leaves. Indices and labels are those of the part.
#[derive(Clone, Debug)]
pub struct PartRecognition {
    /// Instances and centre hypotheses.
    pub segmentation: Segmentation,
    /// Blocks, accepted and not judged, also those beyond what the part owns.
    pub blocks: Vec<Recognised>,
    /// What is said of what the part owns.
    pub pile: pose::PileVerdict,
    /// Points that stand above the bed there, of which the blocks explain a share.
    pub standing: usize,
    /// Facts of the whole: as given, or as this part shows them.
    pub facts: pose::PileFacts,
}

/// What was seen of the legs joins what is stated of their blocks.
fn note_legs(blocks: &mut [Recognised], limbs: &[(InstanceId, Vec<Limb>)]) {
    let limbs: BTreeMap<InstanceId, &Vec<Limb>> = limbs.iter().map(|(b, l)| (*b, l)).collect();
    for block in blocks {
        let Some(own) = limbs.get(&block.block) else { continue };
        let count = |state| own.iter().filter(|l| l.state == state).count().min(255) as u8;
        if let Verdict::Stated(fit) = &mut block.verdict {
            fit.legs = Some(Legs {
                seen: count(LimbState::Seen),
                hidden: count(LimbState::Hidden),
                missing: count(LimbState::Missing),
            });
        }
    }
}

impl Recogniser<'_> {
    /// A part of a larger survey, with facts of the whole; without them it stands for the whole, and tells them. Nothing is said of
    /// what a part alone cannot know: whether the survey suits the blocks. A bin is never a part.
    pub fn recognise_part(
        &self,
        survey: &Survey,
        part: Option<&pose::Part>,
    ) -> Result<PartRecognition, PipelineError> {
        let cells = Cells::of(survey);
        let segmentation = self.segment_cloud(&cells.survey().cloud)?;
        let (given, catalog, heard) = (cells.survey(), self.catalog, self.observer);
        let found = match part {
            Some(part) => {
                let config = &self.config.pose;
                pose::recognise_part(given, &segmentation, catalog, config, part, heard)?
            }
            None => {
                let config = cells.settings(catalog, &self.config.pose);
                pose::recognise_pile(given, &segmentation, catalog, &config, heard)?
            }
        };
        let mut blocks: Vec<Recognised> = found.blocks.into_iter().map(|b| b.0).collect();
        note_legs(&mut blocks, &found.limbs);
        blocks.iter_mut().for_each(|block| cells.whole_points(&mut block.points));
        Ok(PartRecognition {
            segmentation: cells.whole_segmentation(segmentation),
            blocks,
            pile: found.pile,
            standing: found.standing,
            facts: found.facts,
        })
    }

    /// From a survey to blocks.
    pub fn recognise(&self, survey: &Survey) -> Result<Recognition, PipelineError> {
        self.blocks(survey, self.foreground_segments(survey)?)
    }

    /// The first half of [`recognise`](Self::recognise), apart so that a long job can be kept after it: instances of the
    /// part of the survey that can hold blocks; labels and indices are those of that part.
    pub fn foreground_segments(&self, survey: &Survey) -> Result<Segmentation, PipelineError> {
        self.check(survey)?;
        Ok(self.segmented(Cells::of(survey).survey())?.1)
    }

    /// The second half: segments become blocks. `segments` are those of [`foreground_segments`](Self::foreground_segments)
    /// with the same seed.
    pub fn blocks(
        &self,
        survey: &Survey,
        segments: Segmentation,
    ) -> Result<Recognition, PipelineError> {
        self.blocks_with(survey, segments, None)
    }

    /// The same with block types that are ready, for surveys that come one after the other; a survey that asks for settings of
    /// its own makes its own.
    pub fn blocks_with(
        &self,
        survey: &Survey,
        segments: Segmentation,
        ready: Option<&Templates>,
    ) -> Result<Recognition, PipelineError> {
        let cells = Cells::of(survey);
        let foreground = self.foreground(cells.survey(), &Silent);
        let config = cells.settings(self.catalog, &self.config.pose);
        let (own, observer) = (&foreground.survey, self.observer);
        let found = match ready.filter(|ready| ready.are_of(&config)) {
            Some(ready) => pose::recognise_with(own, &segments, ready, observer)?,
            None => pose::recognise_pile(own, &segments, self.catalog, &config, observer)?,
        };
        let mut blocks: Vec<Recognised> = found.blocks.into_iter().map(|b| b.0).collect();
        note_legs(&mut blocks, &found.limbs);
        for block in &mut blocks {
            foreground.whole_points(&mut block.points);
            cells.whole_points(&mut block.points);
        }
        let segmentation = cells.whole_segmentation(foreground.whole_segmentation(segments));
        Ok(Recognition { segmentation, blocks, pile: found.pile })
    }

    /// The first room alone: which point belongs to which block.
    pub fn segments(&self, survey: &Survey) -> Result<Segmentation, PipelineError> {
        self.check(survey)?;
        let cells = Cells::of(survey);
        let (foreground, segments) = self.segmented(cells.survey())?;
        Ok(cells.whole_segmentation(foreground.whole_segmentation(segments)))
    }

    /// Whether blocks can be told in this survey at all.
    fn check(&self, survey: &Survey) -> Result<(), PipelineError> {
        survey::check_scale(survey, self.catalog)?;
        survey::check_facts(survey, self.catalog, self.observer)
    }

    fn segmented<'s>(
        &self,
        survey: &'s Survey,
    ) -> Result<(Foreground<'s>, Segmentation), PipelineError> {
        let foreground = self.foreground(survey, self.observer);
        let segments = self.segment_cloud(&foreground.survey.cloud)?;
        Ok((foreground, segments))
    }

    fn segment_cloud(&self, cloud: &PointCloud) -> Result<Segmentation, PipelineError> {
        let (seed, config) = (self.seed.child("segment", 0), &self.config.segment);
        Ok(segment::segment(cloud, self.catalog, self.model, config, seed, self.observer)?)
    }

    /// The part of a survey that can hold blocks.
    fn foreground<'s>(&self, survey: &'s Survey, observer: &dyn Observer) -> Foreground<'s> {
        Foreground::of(
            survey,
            self.catalog,
            &self.config.background,
            self.seed.child("background", 0),
            observer,
        )
    }
}

/// A survey as points on surfaces, and settings that know how far its cells may be off; no grid: both as they are.
pub fn as_points(survey: &Survey, catalog: &Catalog, config: &Config) -> (Survey, Config) {
    let cells = Cells::of(survey);
    let pose = cells.settings(catalog, &config.pose);
    (cells.survey().clone(), Config { pose, ..config.clone() })
}
