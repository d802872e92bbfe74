//! Three plans of the same works to choose from: fewest blocks, fullest, most stable.
//!
//! In: what [`plan()`](crate::plan()) takes. Out: a plan for each aim, all bettered from the same rounds by the weights of the aim.

use crate::{
    ObjectiveConfig, PlanConfig, PlanError, PlanInput, bettered, finished, first_blocks,
    improve::Effort, rounds, site, summary,
};
use geom::{Observer, SeedTree};
use scene::Plan;

/// What a plan is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// Fewest blocks that reach the design.
    Fewest,
    /// As much void filled as can be.
    Fullest,
    /// Blocks that touch many others.
    MostStable,
}

impl Aim {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Fewest, Self::Fullest, Self::MostStable];

    /// The word in `choices.csv`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Fewest => "fewest",
            Self::Fullest => "fullest",
            Self::MostStable => "most-stable",
        }
    }

    /// Its weights.
    pub fn objective(self) -> ObjectiveConfig {
        match self {
            Self::Fewest => ObjectiveConfig::fewest(),
            Self::Fullest => ObjectiveConfig::fullest(),
            Self::MostStable => ObjectiveConfig::most_stable(),
        }
    }
}

/// Trials a block where the settings ask for none.
const PASSES: f32 = 1.0;

/// A plan for each aim. Errors are those of [`plan()`](crate::plan()), and a policy that cannot be improved.
pub fn choices(
    input: &PlanInput,
    config: &PlanConfig,
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<(Aim, Plan)>, PlanError> {
    let mut config = config.clone();
    if config.search.improve <= 0.0 {
        config.search.improve = PASSES;
    }
    let mut site = site::prepare(input, &config, seed, observer)?;
    let before = summary::before(&site.stack(input));
    let mut tried = first_blocks(&mut site, input, &Plan::default(), seed, observer)?;
    let (mut stack, fixed) = (site.stack_with(input, &tried), tried.len());
    let filled = rounds::fill(&site, &mut stack, seed, observer)?;
    tried.extend(filled.tried.into_iter().map(|(p, _)| p));
    let of = |aim: Aim| {
        let settings = &site.main().settings;
        let effort = Effort { objective: aim.objective(), ..Effort::of(settings, fixed) };
        let (stack, tried) =
            bettered((&site, input), site.stack(input), tried.clone(), &effort, seed, observer)?;
        Ok((aim, finished(&site, &stack, &before, tried)))
    };
    Aim::ALL.into_iter().map(of).collect()
}
