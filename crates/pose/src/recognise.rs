//! The stage: hypotheses in, judged blocks out.
//!
//! Three steps, each a call of its own where a caller needs more than the whole: [`prepare`](crate::prepare) makes of the
//! survey what belongs to it alone, [`Prepared::recognise`](crate::Prepared::recognise) finds and refines the blocks,
//! [`Prepared::judge`](crate::Prepared::judge) compares them with each other and states them.

use crate::confidence::Features;
use crate::limbs::Limb;
use crate::pile_facts::{Part, PileFacts};
use crate::prepare::{Templates, prepare, prepare_ready, prepare_with};
use crate::verdict::PileVerdict;
use crate::{PoseConfig, PoseError};
use geom::{Observer, SeedTree};
use scene::{Catalog, InstanceId, Recognised, Segmentation, Survey};

/// Recognises the blocks of a survey from its segmentation. The same points and blocks give the same result in whatever
/// order points, lines, hypotheses and catalogue entries come, and whatever the seed, of which only callers' signatures
/// remember the use. Blocks come in the order in which they were
/// accepted, the best supported first, numbered from 1; segments without a verdict follow as *not judged*.
/// Errors: [`PoseError`]; a place where nothing is found is not an error.
pub fn recognise(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<Recognised>, PoseError> {
    let found = recognise_with_features(survey, segmentation, catalog, config, seed, observer)?;
    Ok(found.into_iter().map(|f| f.0).collect())
}

/// [`recognise`] with the features each confidence was made of (`None` for segments without a verdict), for fitting them.
pub fn recognise_with_features(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    _seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<(Recognised, Option<Features>)>, PoseError> {
    Ok(recognise_pile(survey, segmentation, catalog, config, observer)?.blocks)
}

/// Blocks and what is said of the survey as a whole.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Blocks as [`recognise`] gives them, with the features each confidence was made of.
    pub blocks: Vec<(Recognised, Option<Features>)>,
    /// What is said of the survey as a whole.
    pub pile: PileVerdict,
    /// The legs of the stated blocks that have any, with the number of the block.
    pub limbs: Vec<(InstanceId, Vec<Limb>)>,
    /// What was measured on the whole of it, or given.
    pub facts: PileFacts,
    /// Working points that stand above the bed, of which [`PileVerdict::explained`] is a share.
    pub standing: usize,
}

/// [`recognise`] with everything it knows. What a person should be told also goes to the observer.
pub fn recognise_pile(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    observer: &dyn Observer,
) -> Result<Outcome, PoseError> {
    let Some(prepared) = prepare(survey, segmentation, catalog, config, observer)? else {
        return Ok(Outcome::default());
    };
    let found = prepared.recognise(observer)?;
    Ok(prepared.judge(found, observer))
}

/// [`recognise_pile`] with block types that are ready.
pub fn recognise_with(
    survey: &Survey,
    segmentation: &Segmentation,
    ready: &Templates,
    observer: &dyn Observer,
) -> Result<Outcome, PoseError> {
    let Some(prepared) = prepare_ready(survey, segmentation, ready, observer)? else {
        return Ok(Outcome::default());
    };
    let found = prepared.recognise(observer)?;
    Ok(prepared.judge(found, observer))
}

/// [`recognise_pile`] of a part of a larger survey, with facts of the whole. What a person should be told of the whole is not said.
pub fn recognise_part(
    survey: &Survey,
    segmentation: &Segmentation,
    catalog: &Catalog,
    config: &PoseConfig,
    part: &Part,
    observer: &dyn Observer,
) -> Result<Outcome, PoseError> {
    let facts = Some(part.facts);
    let Some(prepared) = prepare_with(survey, segmentation, catalog, config, facts, observer)?
    else {
        return Ok(Outcome::default());
    };
    let found = prepared.recognise(observer)?;
    Ok(prepared.judge_part(&found, part.owns))
}
