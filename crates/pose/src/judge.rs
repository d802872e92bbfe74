//! Blocks compared with each other and with the survey, and what may be said of each.

use crate::absolute::CommonSize;
use crate::acceptance::Candidate;
use crate::confidence::{AROUND_BLOCKS, Features};
use crate::evidence::reach_m;
use crate::features::Context;
use crate::finish::{self, statement};
use crate::ground::Ground;
use crate::handed::mirrored;
use crate::hypotheses::Found;
use crate::limbs::{Limb, judge_limbs};
use crate::pile_facts::PileFacts;
use crate::prepare::Prepared;
use crate::recognise::Outcome;
use crate::search::Task;
use crate::unjudged::{LEAST_CONFIDENCE, may_hold_a_block};
use crate::verdict::{PileVerdict, is_wrong};
use crate::{EvidenceConfig, thesis};
use geom::{Event, Observer, Vec3, Warning};
use rayon::prelude::*;
use scene::{Fit, Guess, InstanceId, Recognised, Verdict};

/// Blocks at least so sure tell the common size.
const LIKELY: f32 = 0.3;

/// A block with the features its confidence is made of.
type Judged = (Recognised, Option<Features>);

impl Prepared<'_> {
    /// States the blocks found. What a person should be told of the survey as a whole goes to the observer too.
    pub fn judge(&self, found: Found, observer: &dyn Observer) -> Outcome {
        let outcome = self.judge_part(&found, &|_| true);
        for message in outcome.pile.warnings() {
            observer.event(Event::Warned(Warning { stage: geom::Stage::Pose, message }));
        }
        for message in outcome.pile.notes() {
            observer.event(Event::Noted { stage: geom::Stage::Pose, message });
        }
        outcome
    }

    /// The same where only places for which `owns` holds count, without a word to anybody.
    pub(crate) fn judge_part(&self, found: &Found, owns: &dyn Fn(Vec3) -> bool) -> Outcome {
        let mut outcome = self.stated(found, owns);
        outcome.blocks.iter_mut().for_each(|(block, _)| self.canonical.given(&mut block.points));
        outcome
    }

    fn stated(&self, found: &Found, owns: &dyn Fn(Vec3) -> bool) -> Outcome {
        let config = &self.config.evidence;
        let (templates, measured) = (&self.templates[..], &self.measured);
        let pool: Vec<Candidate> = found.candidates.iter().map(|c| c.1.clone()).collect();
        let (survey, bed) = (self.survey(), found.bed.as_ref());
        let context = Context::new(
            survey,
            &found.blocks,
            &found.points,
            &pool,
            templates,
            measured,
            bed,
            config,
            self.facts,
        );
        let state = |(block, points): (_, &Vec<u32>)| {
            let (block, features) =
                statement(survey, block, points.clone(), &context, templates, measured, config);
            (block, Some(features))
        };
        let mut blocks: Vec<Judged> =
            found.blocks.par_iter().enumerate().zip(&found.points).map(state).collect();
        let largest_m = templates.iter().map(|t| t.model.d_max_m).fold(0.0, f32::max);
        finish::judge(&mut blocks, AROUND_BLOCKS * largest_m, config);
        // Of the blocks that are likely to be some: junk has any size.
        let confidence = |entry: usize| blocks[entry].0.fit().and_then(|f| f.confidence);
        let likely = |entry: usize| confidence(entry).is_some_and(|c| c >= LIKELY);
        let own_size = || context.size_of(likely);
        let size = self.facts.map_or_else(own_size, |facts| facts.size);
        let own_hand = || mirrored(&found.blocks, &found.points, likely, templates, measured);
        let mirrored = self.facts.map_or_else(own_hand, |facts| facts.mirrored);
        let none = mirrored || size.as_ref().is_some_and(is_wrong);
        finish::state(&mut blocks, none, config);
        let (explained, standing) =
            context.explained_where(|entry| blocks[entry].0.is_stated(), owns);
        let facts = self.facts_of(found, context.of_the_pile(), size, mirrored);
        let pile = PileVerdict {
            explained: explained as f32 / (standing as f32).max(1.0),
            stated: blocks.iter().filter(|f| f.0.is_stated()).count(),
            size,
            mirrored,
            not_a_block: 0,
            viewpoint: measured.viewpoint.clone(),
        };
        let limbs = self.limbs(found, &blocks);
        let (open, closed) = self.not_judged(found, &blocks, owns);
        let dropped = blocks.iter().zip(&found.blocks).filter(|((block, _), accepted)| {
            !may_be_one(block, config) && owns(accepted.at.centre)
        });
        let pile = PileVerdict { not_a_block: closed + dropped.count(), ..pile };
        Outcome { facts, standing, ..numbered(blocks, open, limbs, pile, config) }
    }

    /// Facts as given, or as these blocks show them.
    fn facts_of(
        &self,
        found: &Found,
        (typical_m, explained): (f32, f32),
        size: Option<CommonSize>,
        mirrored: bool,
    ) -> PileFacts {
        let (measured, any) = (&self.measured, !found.blocks.is_empty());
        self.facts.cloned().unwrap_or_else(|| PileFacts {
            lines: None,
            noise_sd_m: measured.noise_sd_m,
            point_area_m2: measured.point_area_m2,
            survey_spacing_m: measured.survey_spacing_m,
            viewpoint: measured.viewpoint.clone(),
            fattening: found.fattening.clone(),
            typical_m: any.then_some(typical_m),
            explained: any.then_some(explained),
            size,
            mirrored,
        })
    }

    /// The legs of the stated blocks that have any, by the block's entry.
    fn limbs(&self, found: &Found, blocks: &[Judged]) -> Vec<(usize, Vec<Limb>)> {
        let of = |entry: usize| {
            let block = &found.blocks[entry];
            let template = &self.templates[block.template];
            let reach_m = reach_m(&self.measured, template, &self.config.evidence);
            (entry, judge_limbs(block, template, &self.measured, reach_m))
        };
        let stated = (0..blocks.len()).filter(|&entry| blocks[entry].0.is_stated());
        stated.map(of).filter(|(_, limbs)| !limbs.is_empty()).collect()
    }

    fn not_judged(
        &self,
        found: &Found,
        judged: &[Judged],
        owns: &dyn Fn(Vec3) -> bool,
    ) -> (Vec<Recognised>, usize) {
        let mut taken = vec![false; self.survey().cloud.len()];
        for (block, _) in judged {
            for &i in &block.points {
                taken[i as usize] = true;
            }
        }
        let open = |task: &Task| {
            let survey_point = |&w: &u32| self.measured.thinned.kept[w as usize];
            let free: Vec<u32> =
                task.points.iter().map(survey_point).filter(|&i| !taken[i as usize]).collect();
            (free.len() * 2 > task.points.len() && !free.is_empty()).then_some(free)
        };
        let ground: Option<&Ground> = found.bed.as_ref();
        let (mut blocks, mut closed) = (Vec::new(), 0);
        for (t, task) in found.tasks.iter().enumerate().filter(|(_, t)| t.is_segment) {
            let Some(points) = open(task) else { continue };
            let own = found.candidates.iter().filter(|c| c.0 == Some(t)).map(|c| &c.1);
            let best = own.max_by(|a, b| a.evidence.score().total_cmp(&b.evidence.score()));
            // Without verification every segment gets its answer.
            if !self.config.verification || may_hold_a_block(task, best, ground, &self.measured) {
                blocks.push(self.without_verdict(task, best, points));
            } else {
                closed += usize::from(owns(task.centre));
            }
        }
        (blocks, closed)
    }

    fn without_verdict(
        &self,
        task: &Task,
        best: Option<&Candidate>,
        points: Vec<u32>,
    ) -> Recognised {
        let guess = best.map_or(Guess::Place(task.centre), |best| {
            let (template, at) = (&self.templates[best.template], best.at);
            let (model, pose) = (template.model, at.pose(template.model.centre));
            let fitness_m = thesis::fitness_m(&task.points, template, &at, &self.measured);
            Guess::Fit(Fit {
                type_judged: self.templates.len() == 1,
                fitness_m: Some(fitness_m),
                ..Fit::of_pose(template.id, model.symmetry.canonical(&pose))
            })
        });
        Recognised { block: InstanceId(0), points, verdict: Verdict::NotJudged(guess) }
    }
}

/// All blocks numbered from 1: those that may be one, then the places that stay open.
fn numbered(
    mut found: Vec<Judged>,
    open: Vec<Recognised>,
    limbs: Vec<(usize, Vec<Limb>)>,
    pile: PileVerdict,
    config: &EvidenceConfig,
) -> Outcome {
    let kept: Vec<bool> = found.iter().map(|(block, _)| may_be_one(block, config)).collect();
    // Stated blocks are kept, so that those before one decide its number.
    let number = |entry: usize| kept[..=entry].iter().filter(|k| **k).count() as u32;
    let limbs = limbs.into_iter().map(|(entry, l)| (InstanceId(number(entry)), l)).collect();
    found.retain(|(block, _)| may_be_one(block, config));
    found.extend(open.into_iter().map(|block| (block, None)));
    for (n, (block, _)) in found.iter_mut().enumerate() {
        block.block = InstanceId(n as u32 + 1);
    }
    Outcome { blocks: found, pile, limbs, ..Outcome::default() }
}

/// Whether a person should look at an accepted block: it is stated or likely enough.
fn may_be_one(block: &Recognised, config: &EvidenceConfig) -> bool {
    let least = LEAST_CONFIDENCE.min(config.min_confidence);
    block.is_stated() || block.fit().and_then(|f| f.confidence).is_none_or(|c| c >= least)
}
