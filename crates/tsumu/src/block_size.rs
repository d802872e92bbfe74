//! How large the blocks of a survey are, and which entry that is: nothing need be known of them.

use crate::surveys::{Clouds, Joined};
use crate::{Error, Job, Result, Settings, catalogue};
use anyhow::anyhow;
use pipeline::PipelineError;
use pipeline::sizes::{SizeProposal, SizeSearch, fit_sizes};
use scene::{BlockModel, BlockSpec, Catalog, CatalogSpec, NominalBlock, nominal_blocks};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Where sizes are sought.
#[derive(Clone, Debug, PartialEq)]
pub struct FitOptions {
    /// Shapes: `None`: one of each built-in kind, or those of [`kinds`](Self::kinds).
    pub catalog: Option<PathBuf>,
    /// Built-in kinds; empty: all of them.
    pub kinds: Vec<String>,
    /// Smallest longest edge, metres.
    pub least_m: f32,
    /// Largest longest edge, metres.
    pub most_m: f32,
}

impl Default for FitOptions {
    fn default() -> Self {
        let SizeSearch { least_m, most_m, .. } = SizeSearch::default();
        Self { catalog: None, kinds: Vec::new(), least_m, most_m }
    }
}

/// A shape and size that fit a survey.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockFit {
    /// Kind of built-in block, or entry of the catalogue.
    pub block: String,
    /// The measure that its catalogue entry states (a mesh: its longest edge), metres.
    pub size_m: f32,
    /// Its standard error, metres.
    pub size_sd_m: f32,
    /// What the catalogue says, metres; `None` for built-in kinds.
    pub catalogue_m: Option<f32>,
    /// Share of the surface looked at that blocks of this size explain.
    pub explained: f32,
    /// Blocks found in the places looked at.
    pub found: usize,
    /// The listed block nearest to this size.
    pub nominal: Option<String>,
    /// Its size, metres.
    pub nominal_m: Option<f32>,
}

impl BlockFit {
    /// What is known of blocks beside it: the catalogue's size, or the nearest listed block; empty where nothing is.
    pub fn beside(&self) -> String {
        match (self.catalogue_m, &self.nominal, self.nominal_m) {
            (Some(catalogue_m), _, _) => format!("the catalogue says {catalogue_m:.3} m"),
            (None, Some(name), Some(m)) => {
                format!("{name} of {m:.3} m ({:+.1} %)", 100.0 * (m / self.size_m - 1.0))
            }
            _ => String::new(),
        }
    }

    /// The size and its standard error, m, to a millimetre and finer.
    pub fn size_text(&self) -> String {
        let decimals = decimals(self.size_m).max(3);
        format!("{:.decimals$} ± {:.decimals$}", self.size_m, self.size_sd_m)
    }

    /// What to write in the catalogue, or to hold against it.
    pub fn proposal(&self) -> String {
        match self.catalogue_m {
            None => format!(
                "best: shape = \"{} {}m\" in catalog.toml; hold it against the drawings",
                self.block,
                length_text(self.size_m, self.size_m)
            ),
            Some(catalogue_m) => format!(
                "best: `{}` fits {} ± {} m; the catalogue says {}",
                self.block,
                length_text(self.size_m, self.size_m),
                length_text(self.size_sd_m, self.size_m),
                length_text(catalogue_m, self.size_m)
            ),
        }
    }
}

/// Shape and size from nothing but surveys: best first. Errors: a file that cannot be read, a kind there is not, a range that is
/// none; nothing fits.
pub fn fit_blocks(clouds: &Clouds, options: &FitOptions, job: &Job) -> Result<Vec<BlockFit>> {
    let FitOptions { least_m, most_m, .. } = *options;
    if !(least_m > 0.0 && most_m > least_m && most_m.is_finite()) {
        return Err(Error::bad_input(anyhow!(
            "--from {least_m} --to {most_m}: give two sizes in metres, the smaller first"
        )));
    }
    let (catalog, own) = shapes(options, job)?;
    let Joined { survey, .. } = clouds.survey(job)?;
    let search = SizeSearch { least_m, most_m, ..SizeSearch::default() };
    let config = Settings::default().alone()?;
    let found = job.install(|| fit_sizes(&survey, &catalog, &search, &config.pose, job));
    let found = found.map_err(PipelineError::from)?;
    let fits: Vec<BlockFit> = found.iter().map(|p| fit(p, &catalog, own.as_ref())).collect();
    if fits.is_empty() {
        return Err(Error::failed(anyhow!(
            "no size from {least_m} to {most_m} m fits: no block of these shapes was found in {} points",
            survey.cloud.len()
        )));
    }
    Ok(fits)
}

/// The shapes to try; with a catalogue its entries as written.
fn shapes(options: &FitOptions, job: &Job) -> Result<(Catalog, Option<CatalogSpec>)> {
    if let Some(file) = &options.catalog {
        let spec = crate::error::OrBadInput::or_bad_input(io::site::load_catalog(file))?;
        return Ok((catalogue::models(&spec, file, job)?, Some(spec)));
    }
    let mut all = nominal_blocks();
    all.dedup_by_key(|b| b.kind);
    for kind in &options.kinds {
        if !all.iter().any(|b| b.kind == kind) {
            let known: Vec<&str> = all.iter().map(|b| b.kind).collect();
            return Err(Error::bad_input(anyhow!(
                "--kind {kind}: is no built-in block; there are {}",
                known.join(", ")
            )));
        }
    }
    all.retain(|b| options.kinds.is_empty() || options.kinds.iter().any(|k| k == b.kind));
    let block = |b: &NominalBlock| BlockSpec {
        name: b.kind.into(),
        shape: Some(b.shape),
        mesh: None,
        unit: None,
        density_kg_m3: 2300.0,
    };
    let spec = CatalogSpec { block: all.iter().map(block).collect() };
    Ok((catalogue::models(&spec, Path::new("built-in blocks"), job)?, None))
}

fn fit(found: &SizeProposal, catalog: &Catalog, own: Option<&CatalogSpec>) -> BlockFit {
    let model = catalog.get(found.model);
    let entry_m = entry_size_m(model, found.model.0, own);
    let size_m = entry_m * found.scale.factor;
    let nominal = nominal_blocks()
        .into_iter()
        .filter(|b| own.is_none() && b.kind == model.name)
        .min_by(|a, b| off(a.size_m, size_m).total_cmp(&off(b.size_m, size_m)));
    BlockFit {
        block: model.name.clone(),
        size_m,
        size_sd_m: entry_m * found.scale.factor_sd,
        catalogue_m: own.is_some().then_some(entry_m),
        explained: found.explained,
        found: found.found,
        nominal: nominal.map(|b| b.name()),
        nominal_m: nominal.map(|b| b.size_m),
    }
}

/// How far one size is from another, as a ratio.
fn off(a_m: f32, b_m: f32) -> f32 {
    (a_m / b_m).ln().abs()
}

/// The measure that each entry of a catalogue states, in its order, metres.
pub(crate) fn entry_sizes_m(spec: &CatalogSpec, catalog: &Catalog) -> Vec<f32> {
    catalog.iter().map(|(id, model)| entry_size_m(model, id.0, Some(spec))).collect()
}

/// The measure an entry states: a shape's `size`, a mesh's longest edge.
fn entry_size_m(model: &BlockModel, entry: u16, own: Option<&CatalogSpec>) -> f32 {
    let listed = || nominal_blocks().into_iter().find(|b| b.kind == model.name).map(|b| b.shape);
    let shape = match own {
        Some(spec) => spec.block.get(usize::from(entry)).and_then(|b| b.shape),
        None => listed(),
    };
    shape.map_or(model.d_box_m, |s| s.size_m())
}

/// A length in metres with the decimals that a block of `size_m` needs: a hundredth of a metre is a tenth of a part in a bin.
pub(crate) fn length_text(length_m: f32, size_m: f32) -> String {
    format!("{length_m:.0$}", decimals(size_m))
}

fn decimals(size_m: f32) -> usize {
    match size_m {
        s if s >= 1.0 => 2,
        s if s >= 0.1 => 3,
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_blocks_are_said_to_a_tenth_of_a_millimetre() {
        assert_eq!(length_text(0.091_26, 0.091), "0.0913");
        assert_eq!(length_text(0.002, 0.5), "0.002");
        assert_eq!(length_text(2.004, 2.0), "2.00");
    }
}
