//! From a survey to blocks, whole or in halves.
//!
//! In: a survey. Out: which point belongs to which block, and the blocks. The bin goes, points are segmented, segments
//! become blocks; indices and labels that leave this room are those of the whole survey.

use crate::{Config, PipelineError, survey};
use geom::{Observer, SeedTree, Silent};
use pose::Templates;
use scene::{Catalog, Recognised, Segmentation, Survey};
use segment::{Foreground, SegmentModel};
use serde::{Deserialize, Serialize};

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

impl Recogniser<'_> {
    /// From a survey to blocks.
    pub fn recognise(&self, survey: &Survey) -> Result<Recognition, PipelineError> {
        self.blocks(survey, self.foreground_segments(survey)?)
    }

    /// The first half of [`recognise`](Self::recognise), apart so that a long job can be kept after it: instances of the
    /// part of the survey that can hold blocks; labels and indices are those of that part.
    pub fn foreground_segments(&self, survey: &Survey) -> Result<Segmentation, PipelineError> {
        Ok(self.segmented(survey)?.1)
    }

    /// The second half: segments become blocks. `segments` are those of [`foreground_segments`](Self::foreground_segments)
    /// with the same seed.
    pub fn blocks(
        &self,
        survey: &Survey,
        segments: Segmentation,
    ) -> Result<Recognition, PipelineError> {
        let ready = Templates::new(self.catalog, &self.config.pose)?;
        self.judged(self.foreground(survey, &Silent), segments, &ready)
    }

    /// [`recognise`](Self::recognise) with block types that are ready, for surveys that come one after the other.
    pub fn recognise_with(
        &self,
        survey: &Survey,
        ready: &Templates,
    ) -> Result<Recognition, PipelineError> {
        let (foreground, segments) = self.segmented(survey)?;
        self.judged(foreground, segments, ready)
    }

    fn judged(
        &self,
        foreground: Foreground,
        segments: Segmentation,
        ready: &Templates,
    ) -> Result<Recognition, PipelineError> {
        let found = pose::recognise_with(&foreground.survey, &segments, ready, self.observer)?;
        let mut blocks: Vec<Recognised> = found.blocks.into_iter().map(|b| b.0).collect();
        blocks.iter_mut().for_each(|b| foreground.whole_points(&mut b.points));
        let segmentation = foreground.whole_segmentation(segments);
        Ok(Recognition { segmentation, blocks, pile: found.pile })
    }

    /// The first room alone: which point belongs to which block.
    pub fn segments(&self, survey: &Survey) -> Result<Segmentation, PipelineError> {
        let (foreground, segments) = self.segmented(survey)?;
        Ok(foreground.whole_segmentation(segments))
    }

    fn segmented<'s>(
        &self,
        survey: &'s Survey,
    ) -> Result<(Foreground<'s>, Segmentation), PipelineError> {
        survey::check_scale(survey, self.catalog)?;
        survey::check_facts(survey, self.catalog, self.observer)?;
        let foreground = self.foreground(survey, self.observer);
        let (cloud, seed) = (&foreground.survey.cloud, self.seed.child("segment", 0));
        let segments = segment::segment(
            cloud,
            self.catalog,
            self.model,
            &self.config.segment,
            seed,
            self.observer,
        )?;
        Ok((foreground, segments))
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
