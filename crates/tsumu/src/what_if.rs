//! What the plan would be with another crest, slope, block or overflow: a table, kept row by row.

use crate::error::OrBadInput;
use crate::lock::FolderLock;
use crate::run_folder::outside_of_runs;
use crate::{Error, Job, Recognition, Result, Site, outputs, version};
use anyhow::anyhow;
use geom::SeedTree;
use io::what_if_csv::{self, WhatIfRow};
use pipeline::Config;
use scene::{DesignSurface, Plan};
use serde_json::{Value, json};
use std::path::Path;

/// Plans of a table beyond which it is a slip of the keyboard.
const MOST: usize = 1_000;

/// What is varied; an empty list leaves it as the site has it. Every combination is planned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WhatIf {
    /// How much higher the design is, metres; of a section its crest alone.
    pub raise_m: Vec<f64>,
    /// Slope, 1 vertical to so much horizontal, on both sides.
    pub slope_m: Vec<f64>,
    /// Type to place.
    pub block: Vec<String>,
    /// Overflow threshold f, metres.
    pub overflow_m: Vec<f32>,
}

/// One combination.
#[derive(Clone, Debug)]
struct Assumed {
    raise_m: Option<f64>,
    slope_m: Option<f64>,
    block: Option<String>,
    overflow_m: Option<f32>,
}

impl WhatIf {
    fn combinations(&self) -> Result<Vec<Assumed>> {
        fn each<T: Clone>(list: &[T]) -> Vec<Option<T>> {
            if list.is_empty() { vec![None] } else { list.iter().cloned().map(Some).collect() }
        }
        let mut all = Vec::new();
        for raise_m in each(&self.raise_m) {
            for slope_m in each(&self.slope_m) {
                for block in each(&self.block) {
                    for overflow_m in each(&self.overflow_m) {
                        all.push(Assumed { raise_m, slope_m, block: block.clone(), overflow_m });
                    }
                }
            }
        }
        match all.len() {
            1 if self == &Self::default() => {
                Err(Error::bad_input(anyhow!("nothing is varied; say at least one list")))
            }
            n if n > MOST => Err(Error::bad_input(anyhow!(
                "{n} combinations are more than {MOST}; shorten a list"
            ))),
            _ => Ok(all),
        }
    }
}

impl Assumed {
    fn text(&self) -> [String; 4] {
        let number = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
        [
            number(self.raise_m),
            number(self.slope_m),
            self.block.clone().unwrap_or_default(),
            self.overflow_m.map_or(String::new(), |v| v.to_string()),
        ]
    }

    fn design(&self, design: &DesignSurface) -> Result<DesignSurface> {
        let raised = design.clone().raised(self.raise_m.unwrap_or(0.0));
        let Some(slope_m) = self.slope_m else { return Ok(raised) };
        let sloped = raised.with_slope(slope_m).ok_or_else(|| {
            Error::bad_input(anyhow!("this design has no slope to vary: it is a level or a grid"))
        })?;
        sloped.check().map_err(Error::bad_input)?;
        Ok(sloped)
    }

    fn config(&self, config: &Config) -> Config {
        let mut config = config.clone();
        if self.block.is_some() {
            (config.plan.block, config.plan.blocks) = (self.block.clone(), Vec::new());
        }
        config.plan.overflow_m = self.overflow_m.or(config.plan.overflow_m);
        config
    }
}

impl Site {
    /// Plans every combination and keeps `what_if.csv` in `folder`; rows of an earlier call for the same blocks, settings and program are
    /// taken over. `told` hears each row, with whether it was there already.
    pub fn what_if(
        &self,
        recognition: &Recognition,
        what_if: &WhatIf,
        folder: &Path,
        job: &Job,
        mut told: impl FnMut(&WhatIfRow, bool),
    ) -> Result<()> {
        let combinations = what_if.combinations()?;
        self.refuse_inputs_below(folder)?;
        let file = folder.join("what_if.csv");
        outside_of_runs(&file)?;
        let _lock = FolderLock::take(folder)?;
        let stamp = self.stamp(recognition)?;
        let mut rows = kept(&file, &folder.join("what_if.json"), &stamp)?;
        outputs::write_json(&folder.join("what_if.json"), &stamp)?;
        for assumed in combinations {
            let text = assumed.text();
            if let Some(row) = rows.iter().find(|r| r.assumed == text) {
                told(row, true);
                continue;
            }
            let plan = job.install(|| self.assumed_plan(recognition, &assumed, job))?;
            rows.push(WhatIfRow { assumed: text, figures: figures(&plan) });
            what_if_csv::write(&file, &rows)?;
            told(rows.last().expect("it was just put there"), false);
        }
        Ok(())
    }

    fn assumed_plan(
        &self,
        recognition: &Recognition,
        assumed: &Assumed,
        job: &Job,
    ) -> Result<Plan> {
        let design = assumed.design(self.needed_design()?)?;
        let works = self.works(&recognition.blocks, &design);
        let config = assumed.config(&self.config);
        Ok(pipeline::plan_works(&works, &config, SeedTree::new(self.seed), job)?.1)
    }

    /// What the rows follow from.
    fn stamp(&self, recognition: &Recognition) -> Result<Value> {
        let poses: Vec<[f32; 7]> = pipeline::placed_blocks(&recognition.blocks)
            .iter()
            .map(|b| {
                let (q, t) = (b.site_from_block.rotation, b.site_from_block.translation);
                [q.x, q.y, q.z, q.w, t.x, t.y, t.z]
            })
            .collect();
        let blocks: Vec<u8> = poses.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        Ok(json!({
            "version": version::STAMP,
            "seed": self.seed,
            "config": outputs::json_value(&self.config)?,
            "inputs": self.inputs,
            "blocks": io::manifest::hash(&blocks).map(|b| format!("{b:02x}")).concat(),
        }))
    }
}

/// Rows of an earlier call, if they follow from the same.
fn kept(file: &Path, stamp_file: &Path, stamp: &Value) -> Result<Vec<WhatIfRow>> {
    let earlier = std::fs::read_to_string(stamp_file).ok();
    let earlier: Option<Value> = earlier.and_then(|text| serde_json::from_str(&text).ok());
    if earlier.as_ref() != Some(stamp) || !file.exists() {
        return Ok(Vec::new());
    }
    what_if_csv::read(file).or_bad_input()
}

fn figures(plan: &Plan) -> [f64; 8] {
    let s = &plan.summary;
    [
        f64::from(s.blocks),
        s.mass_kg / 1000.0,
        f64::from(s.concrete_m3),
        f64::from(s.void_before_m3 - s.void_after_m3),
        f64::from(s.void_after_m3),
        f64::from(s.mean_distance_m),
        f64::from(s.porosity),
        f64::from(s.protruding),
    ]
}
