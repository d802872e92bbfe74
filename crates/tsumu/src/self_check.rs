//! A survey's own repeatability: both halves of it recognised, and how far they agree.

use crate::weights::Chosen;
use crate::{Job, Result, Site};
use geom::{Event, Observer};
use metrics::{Repeatability, StatedBlock, repeatability};
use pipeline::Recogniser;

/// Passes on progress alone: what halves of a survey warn of is said of the whole already.
struct Quietly<'a>(&'a Job<'a>);

impl Observer for Quietly<'_> {
    fn event(&self, event: Event) {
        if matches!(event, Event::Started { .. } | Event::Advanced { .. } | Event::Finished { .. })
        {
            self.0.event(event);
        }
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl Site {
    /// Recognises both halves of the surveys and compares them.
    pub(crate) fn self_check(&self, chosen: &Chosen, job: &Job) -> Result<Repeatability> {
        let quietly = Quietly(job);
        // A grid is split as points on surfaces: half of its cells would be no grid.
        let (points, config) = pipeline::as_points(&self.survey, &self.catalog, &self.config);
        let recogniser =
            Recogniser { config: &config, observer: &quietly, ..self.recogniser(chosen, job) };
        Ok(repeatability(&points, &self.catalog, |half| {
            let found = recogniser.recognise(half)?;
            Ok::<_, pipeline::PipelineError>(StatedBlock::of(&found.blocks))
        })?)
    }
}
