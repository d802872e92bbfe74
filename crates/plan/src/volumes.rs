//! Plans for several minimum volumes v, made together: one that can be shown to be the same is not made again.
//!
//! Windows are served largest deficit first and nothing a small window does reaches a larger one of its round. So the plan
//! of a larger v is that of a smaller one without its small windows, unless one of those got a block or a failure in
//! one kept a larger window closed. The rounds remember both; where neither happened the plan is taken over, bit for bit
//! what planning it would give.

use crate::{
    Insertion, PlanConfig, PlanError, PlanInput, Policy, bettered, finished, first_blocks,
    improve::Effort, rounds, site, summary,
};
use geom::{Event, Observer, SeedTree, Stage};
use scene::Plan;

/// The plan of one minimum volume.
#[derive(Clone, Debug)]
pub struct OfVolume {
    /// Minimum volume v, as given.
    pub minimum_volume_m3: f32,
    /// The plan.
    pub plan: Plan,
    /// Whether it was made by itself; if not, it was taken over from that of a smaller v.
    pub made: bool,
}

/// The plans of all the volumes, in their order, each equal to [`plan()`](crate::plan()) with that minimum volume.
pub fn plans_over_volumes(
    input: &PlanInput,
    config: &PlanConfig,
    volumes_m3: &[f32],
    seed: SeedTree,
    observer: &dyn Observer,
) -> Result<Vec<OfVolume>, PlanError> {
    let mut ascending: Vec<usize> = (0..volumes_m3.len()).collect();
    ascending.sort_by(|&a, &b| volumes_m3[a].total_cmp(&volumes_m3[b]));
    let mut plans: Vec<Option<OfVolume>> = vec![None; volumes_m3.len()];
    let mut left = ascending.as_slice();
    while let Some(&first) = left.first() {
        let config = PlanConfig { minimum_volume_m3: Some(volumes_m3[first]), ..config.clone() };
        let mut site = site::prepare(input, &config, seed, observer)?;
        let before = summary::before(&site.stack(input));
        let reset = first_blocks(&mut site, input, &Plan::default(), seed, observer)?;
        let mut stack = site.stack_with(input, &reset);
        let filled = rounds::fill(&site, &mut stack, seed, observer)?;
        // Windows of several scales see each other's blocks, and improving sees everything.
        let settings = &site.main().settings;
        let one_scale = site.types.len() == 1
            && settings.search.improve <= 0.0
            && settings.insertion == Insertion::Straight
            && settings.policy != Policy::Pattern
            && config.reset == 0;
        let holds = |i: usize| one_scale && filled.holds_for(volumes_m3[i]);
        let same = left.iter().skip(1).take_while(|&&i| holds(i)).count();
        let (now, later) = left.split_at(1 + same);
        for &i in now {
            let minimum_volume_m3 = volumes_m3[i];
            let larger = filled.tried.iter().filter(|(_, d)| !one_scale || *d > minimum_volume_m3);
            let tried: Vec<_> =
                reset.iter().cloned().chain(larger.map(|(p, _)| p.clone())).collect();
            let plan = match one_scale {
                true => finished(&site, &stack, &before, tried),
                false => {
                    let effort = Effort::of(&site.main().settings, reset.len());
                    let from = site.stack_with(input, &tried);
                    let (stack, tried) =
                        bettered((&site, input), from, tried, &effort, seed, observer)?;
                    finished(&site, &stack, &before, tried)
                }
            };
            plans[i] = Some(OfVolume { minimum_volume_m3, plan, made: i == first });
        }
        left = later;
        observer.event(Event::Finished { stage: Stage::Plan });
    }
    Ok(plans.into_iter().map(|p| p.expect("every volume was served")).collect())
}
