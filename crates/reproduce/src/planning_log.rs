//! Plans already made, one line each beside the page: a table of hundreds of plans goes on where it was stopped.
//!
//! The first line says what the plans were made of; a file of another site, seed or version is begun anew.

use crate::planning_site::{Span, settings};
use crate::{Bench, ReproduceError};
use geom::SeedTree;
use plan::{PlanConfig, Policy};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What a table says of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Figures {
    pub blocks: f64,
    pub mean_distance_m: f64,
    /// The thesis': mean distance of the added blocks' surface, where it is seen from above, to the design; 0 without a block.
    pub surface_distance_m: f64,
    pub void_after_m3: f64,
    pub void_filled_m3: f64,
    pub porosity: f64,
    pub protruding: f64,
    /// Wall time of the plan; 0 for one that was shown to be the same as that of a smaller v.
    pub seconds: f64,
}

/// Plans of a table that differ in v alone: overflow threshold f, `None` for the method's, and the number of the seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    pub policy: (&'static str, Policy),
    pub overflow_m: Option<f32>,
    pub repeat: u64,
    /// Trials a block after the rounds, and the temperature they start at.
    pub improve: [f32; 2],
}

impl Trial {
    fn name(&self, minimum_volume_m3: f32) -> String {
        let f = self.overflow_m.map_or("method".into(), |f| f.to_string());
        format!("{},{minimum_volume_m3},{f},{}", self.policy.0, self.repeat)
    }
}

const HEAD: &str = "policy,minimum_volume_m3,overflow_m,repeat,blocks,mean_distance_m,surface_distance_m,void_after_m3,void_filled_m3,porosity,protruding,seconds";

/// What an earlier run left; nothing where there is no such file. One that is there and cannot be read now would be written over.
pub(crate) fn kept_text(file: &Path) -> Result<String, ReproduceError> {
    match std::fs::read_to_string(file) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(String::new()),
        read => {
            read.map_err(|source| ReproduceError::File { file: file.display().to_string(), source })
        }
    }
}

/// The file of one table.
pub(crate) struct PlanningLog {
    file: PathBuf,
    stamp: String,
    known: BTreeMap<String, Figures>,
}

impl PlanningLog {
    /// Reads what an earlier run left, if it was of the same plans.
    pub fn open(file: PathBuf, stamp: String) -> Result<Self, ReproduceError> {
        let text = kept_text(&file)?;
        let same = text.lines().next().is_some_and(|l| l == stamp);
        let known =
            if same { text.lines().skip(2).filter_map(parsed).collect() } else { BTreeMap::new() };
        Ok(Self { file, stamp, known })
    }

    /// The figures of the plans of each v: as kept, or planned now and kept.
    pub fn figures(
        &mut self,
        bench: &Bench,
        span: &Span,
        trial: &Trial,
        volumes_m3: &[f32],
    ) -> Result<Vec<Figures>, ReproduceError> {
        let missing: Vec<f32> = volumes_m3
            .iter()
            .copied()
            .filter(|&v| !self.known.contains_key(&trial.name(v)))
            .collect();
        if !missing.is_empty() {
            let mut config =
                PlanConfig { overflow_m: trial.overflow_m, ..settings(trial.policy.1) };
            [config.search.improve, config.search.temperature] = trial.improve;
            let seed = SeedTree::new(bench.settings.seed).child("plan", trial.repeat);
            let start = (bench.clock)();
            let plans = span.plans(&config, &missing, seed, bench.observer)?;
            let made = plans.iter().filter(|p| p.made).count();
            let seconds = ((bench.clock)() - start) / made as f64;
            for of in plans {
                let surface_distance_m = span.surface_distance_m(&of.plan);
                let plan = of.plan.summary;
                let figures = Figures {
                    blocks: f64::from(plan.blocks),
                    mean_distance_m: f64::from(plan.mean_distance_m),
                    surface_distance_m,
                    void_after_m3: f64::from(plan.void_after_m3),
                    void_filled_m3: f64::from(plan.void_before_m3 - plan.void_after_m3),
                    porosity: f64::from(plan.porosity),
                    protruding: f64::from(plan.protruding),
                    seconds: if of.made { seconds } else { 0.0 },
                };
                self.known.insert(trial.name(of.minimum_volume_m3), figures);
            }
            self.write()?;
        }
        Ok(volumes_m3.iter().map(|&v| self.known[&trial.name(v)]).collect())
    }

    fn write(&self) -> Result<(), ReproduceError> {
        let mut text = format!("{}\n{HEAD}\n", self.stamp);
        for (name, f) in &self.known {
            writeln!(
                text,
                "{name},{},{},{},{},{},{},{},{:.3}",
                f.blocks,
                f.mean_distance_m,
                f.surface_distance_m,
                f.void_after_m3,
                f.void_filled_m3,
                f.porosity,
                f.protruding,
                f.seconds
            )
            .expect("a string takes all text");
        }
        let beside = self.file.with_extension("tmp");
        let failed =
            |source| ReproduceError::File { file: self.file.display().to_string(), source };
        std::fs::write(&beside, text).map_err(failed)?;
        std::fs::rename(&beside, &self.file).map_err(failed)
    }
}

/// A line of the file; one that is damaged is planned again.
fn parsed(line: &str) -> Option<(String, Figures)> {
    let cells: Vec<&str> = line.split(',').collect();
    let [policy, v, f, repeat, numbers @ ..] = cells.as_slice() else { return None };
    let numbers: Vec<f64> = numbers.iter().map(|n| n.parse()).collect::<Result<_, _>>().ok()?;
    let [
        blocks,
        mean_distance_m,
        surface_distance_m,
        void_after_m3,
        void_filled_m3,
        porosity,
        protruding,
        seconds,
    ] = numbers.try_into().ok()?;
    let figures = Figures {
        blocks,
        mean_distance_m,
        surface_distance_m,
        void_after_m3,
        void_filled_m3,
        porosity,
        protruding,
        seconds,
    };
    Some((format!("{policy},{v},{f},{repeat}"), figures))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_read_back_unless_the_stamp_differs() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("plans.csv");
        let mut log = PlanningLog::open(file.clone(), "site one".into()).unwrap();
        let figures = Figures {
            blocks: 81.0,
            mean_distance_m: 0.25,
            surface_distance_m: 0.375,
            void_after_m3: 3.5,
            void_filled_m3: 9.5,
            porosity: 0.5,
            protruding: 7.0,
            seconds: 1.25,
        };
        let trial = Trial {
            policy: ("search", Policy::Search),
            overflow_m: None,
            repeat: 2,
            improve: [0.0; 2],
        };
        log.known.insert(trial.name(0.4), figures);
        log.write().unwrap();
        let again = PlanningLog::open(file.clone(), "site one".into()).unwrap();
        assert_eq!(again.known.get("search,0.4,method,2"), Some(&figures));
        assert!(PlanningLog::open(file, "site two".into()).unwrap().known.is_empty());
    }
}
