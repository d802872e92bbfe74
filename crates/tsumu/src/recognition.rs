//! The first half: from a site to its blocks.

use crate::resume::Parts;
use crate::review::{self, ReviewRecord};
use crate::weights::{self, Chosen, WeightsOrigin};
use crate::{Job, Result, Site};
use geom::{JobPart, SeedTree};
use metrics::Repeatability;
use pipeline::{PileVerdict, Recogniser};
use scene::{Recognised, Segmentation};
use std::path::PathBuf;

/// What recognition may be told beside the site's settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecogniseOptions {
    /// A weights file, a training's folder, or shipped weights by name; `None`: the shipped ones that suit the catalogue.
    pub weights: Option<PathBuf>,
    /// Also recognise both halves of the survey and tell how far they agree; takes twice as long.
    pub self_check: bool,
}

/// Which block every point belongs to, and the blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recognition {
    /// What the network says of every point.
    pub segments: Segments,
    /// Blocks, stated and not judged.
    pub blocks: Vec<Recognised>,
    /// What is said of the survey as a whole.
    pub pile: PileVerdict,
    /// The weights it used.
    pub weights: WeightsOrigin,
    /// The review that the blocks follow, with what it changed.
    pub review: Option<ReviewRecord>,
    /// How far both halves of the survey agree, where that was asked for.
    pub self_check: Option<Repeatability>,
}

/// Labels of a survey's points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Segments {
    /// Instance of each point, from 1; 0 for none.
    pub instance: Vec<u32>,
    /// Confidence of each label, in [0, 1].
    pub confidence: Vec<f32>,
    /// Instances.
    pub instances: usize,
    /// Places where a block's centre may be, with or without an instance.
    pub centre_hypotheses: usize,
}

impl Segments {
    /// Points that belong to an instance.
    pub fn labelled(&self) -> usize {
        self.instance.iter().filter(|&&i| i > 0).count()
    }
}

impl From<Segmentation> for Segments {
    fn from(found: Segmentation) -> Self {
        Self {
            instance: found.instance,
            confidence: found.confidence,
            instances: found.instances,
            centre_hypotheses: found.hypotheses.len(),
        }
    }
}

impl Site {
    /// Recognises the blocks of the site's surveys; the site's review stands.
    pub fn recognise(&self, options: &RecogniseOptions, job: &Job) -> Result<Recognition> {
        let chosen = weights::choose(options.weights.as_deref(), &self.catalog, job)?;
        job.install(|| self.recognise_in_parts(&chosen, options, &Parts::none(job)))
    }

    /// Labels every point with the block it belongs to, and the weights that said so.
    pub fn segment(
        &self,
        options: &RecogniseOptions,
        job: &Job,
    ) -> Result<(Segments, WeightsOrigin)> {
        let (found, origin) = self.segmentation(options, job)?;
        Ok((found.into(), origin))
    }

    /// The same with all the network says: the places where a block's centre may be, each with its points.
    pub fn segmentation(
        &self,
        options: &RecogniseOptions,
        job: &Job,
    ) -> Result<(Segmentation, WeightsOrigin)> {
        let chosen = weights::choose(options.weights.as_deref(), &self.catalog, job)?;
        let found = job.install(|| self.recogniser(&chosen, job).segments(&self.survey))?;
        Ok((found, chosen.origin))
    }

    /// The same in parts that an interrupted run keeps.
    pub(crate) fn recognise_in_parts(
        &self,
        chosen: &Chosen,
        options: &RecogniseOptions,
        parts: &Parts,
    ) -> Result<Recognition> {
        let job = parts.job();
        let recogniser = self.recogniser(chosen, job);
        let segments =
            parts.part(JobPart::Segment, || recogniser.foreground_segments(&self.survey))?;
        let mut found =
            parts.part(JobPart::Recognise, || recogniser.blocks(&self.survey, segments))?;
        let check = || parts.part(JobPart::SelfCheck, || self.self_check(chosen, job));
        let self_check = options.self_check.then(check).transpose()?;
        let review = review::apply(
            self.review.as_ref(),
            &self.catalog,
            &self.survey.frame,
            &mut found.blocks,
            job,
        )?;
        Ok(Recognition {
            segments: found.segmentation.into(),
            blocks: found.blocks,
            pile: found.pile,
            weights: chosen.origin.clone(),
            review,
            self_check,
        })
    }

    pub(crate) fn recogniser<'a>(&'a self, chosen: &'a Chosen, job: &'a Job) -> Recogniser<'a> {
        Recogniser {
            catalog: &self.catalog,
            model: &chosen.model,
            config: &self.config,
            seed: SeedTree::new(self.seed),
            observer: job,
        }
    }
}
