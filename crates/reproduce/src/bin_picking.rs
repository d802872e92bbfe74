//! Chapter 2 from one command: FPCC, FPCCv2 and the peers on five parts in bins (Tables 2.1 to 2.5, Fig. 2.12).
//!
//! Every training and every row is kept beside the page; the command goes on where it was stopped.

use crate::bin_data::{BinData, foreign_row};
use crate::bin_kept::{RowResult, RowsOnDisk};
use crate::bin_parts::{BinPart, bin_parts};
use crate::bin_rows::{Course, Net, Reading, Row, Trained, rows};
use crate::markdown::percent;
use crate::{Bench, Experiment, ReproduceError, Table};
use segment::loss::PairLossConfig;
use segment::tile::ThinScene;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;
use synth::SynthScene;

pub const EXPERIMENT: Experiment = Experiment {
    name: "bin-picking",
    about: "five parts in bins: FPCC, FPCCv2, the peers (Tables 2.1–2.5, Fig. 2.12)",
    body,
};

/// γ of Table 2.3.
const GAMMAS: [f32; 4] = [0.5, 0.8, 1.0, 1.2];
/// Parts in the crowds of Fig. 2.12.
const CROWDS: [u32; 4] = [10, 20, 40, 60];
/// Repetitions of Table 2.4.
const REPEATS: u64 = 3;

/// How much of it is made.
struct Extent {
    parts: usize,
    steps: u64,
    training_scenes: u64,
    scenes: u64,
    repeats: u64,
    crowds: usize,
}

impl Extent {
    fn of(bench: &Bench) -> Self {
        let s = bench.settings;
        if s.quick {
            let (steps, scenes) = (s.steps.min(10), 1);
            return Self { parts: 2, steps, training_scenes: 4, scenes, repeats: 1, crowds: 2 };
        }
        let repeats = REPEATS.min(s.repeats);
        Self {
            parts: 5,
            steps: s.steps,
            training_scenes: 40,
            scenes: s.scenes,
            repeats,
            crowds: CROWDS.len(),
        }
    }
}

/// A part with everything its rows need; scenes are made when the first row asks for them.
struct Bin<'a> {
    part: &'a BinPart,
    disk: RowsOnDisk,
    extent: &'a Extent,
    training_scenes: OnceCell<Vec<ThinScene>>,
    scenes: OnceCell<Vec<SynthScene>>,
    /// Networks by the name of their training: ending a training fits its confidence, which is done once.
    networks: RefCell<BTreeMap<String, Ready>>,
}

/// A network and its steps.
type Ready = Rc<(Trained, u64)>;

impl<'a> Bin<'a> {
    fn new(bench: &Bench, part: &'a BinPart, extent: &'a Extent) -> Result<Self, ReproduceError> {
        let folder = bench.folder.join("bin-picking").join(part.name);
        let trainings = format!(
            "seed {} steps {} lessons {} mesh {} {}",
            bench.settings.seed,
            extent.steps,
            extent.training_scenes,
            part.mesh_digits(),
            env!("CARGO_PKG_VERSION")
        );
        let settings = format!("{trainings} scenes {}", extent.scenes);
        let disk = RowsOnDisk::at(&folder, settings, trainings)?;
        let (training_scenes, scenes) = Default::default();
        Ok(Self { part, disk, extent, training_scenes, scenes, networks: Default::default() })
    }

    fn training_scenes(&self, bench: &Bench) -> Result<&[ThinScene], ReproduceError> {
        if self.training_scenes.get().is_none() {
            let made = self.part.thin_training_scenes(bench, self.extent.training_scenes)?;
            let _ = self.training_scenes.set(made);
        }
        Ok(self.training_scenes.get().map_or(&[], |l| l))
    }

    fn scenes(&self, bench: &Bench) -> Result<&[SynthScene], ReproduceError> {
        if self.scenes.get().is_none() {
            let made = self.part.held_out(bench, self.extent.scenes)?;
            let _ = self.scenes.set(made);
        }
        Ok(self.scenes.get().map_or(&[], |s| s))
    }

    /// A network of a name; rows that share one share its training.
    fn trained(
        &self,
        bench: &Bench,
        net: &Net,
        name: &str,
        repeat: u64,
    ) -> Result<Ready, ReproduceError> {
        if let Some(ready) = self.networks.borrow().get(name) {
            return Ok(ready.clone());
        }
        let training_scenes = self.training_scenes(bench)?;
        let course = Course {
            part: self.part,
            training_scenes,
            disk: &self.disk,
            steps: self.extent.steps,
            repeat,
        };
        let ready = Rc::new(net.train(bench, &course, name)?);
        self.networks.borrow_mut().insert(name.into(), ready.clone());
        Ok(ready)
    }

    fn row(&self, bench: &Bench, row: &Row) -> Result<RowResult, ReproduceError> {
        self.held_out(bench, row, row.0, 1.0)
    }

    /// A row on the scenes that are judged on.
    fn held_out(
        &self,
        bench: &Bench,
        (name, net, reading): &Row,
        kept_as: &str,
        gamma: f32,
    ) -> Result<RowResult, ReproduceError> {
        self.disk.row(kept_as, || {
            let ready = self.trained(bench, net, training_name(name, net), 0)?;
            let (trained, steps) = &*ready;
            trained.judged(bench, self.part, self.scenes(bench)?, *reading, gamma, *steps)
        })
    }
}

/// The three readings of FPCCv2 are of one training.
fn training_name<'a>(row: &'a str, net: &Net) -> &'a str {
    match net {
        Net::V2 { from_any_shape: true } => "FPCCv2",
        _ => row,
    }
}

fn body(bench: &Bench) -> Result<String, ReproduceError> {
    let data = bench.data.map(BinData::of).transpose()?;
    let own = |name: &str| data.as_ref().map_or(Ok(None), |d| d.model(name));
    let parts = bin_parts(&own)?;
    let extent = Extent::of(bench);
    let bins: Vec<Bin> = parts[..extent.parts]
        .iter()
        .map(|part| Bin::new(bench, part, &extent))
        .collect::<Result<_, _>>()?;
    let mut found: BTreeMap<(usize, usize), RowResult> = BTreeMap::new();
    for (b, bin) in bins.iter().enumerate() {
        for (r, row) in rows().iter().enumerate() {
            found.insert((b, r), bin.row(bench, row)?);
        }
    }
    let gear = &bins[1];
    let mut page = words(&extent, data.is_some());
    page += &main_table(&bins, &found);
    page += &precision_table(&bins, &found);
    page += &gamma_table(bench, gear)?;
    page += &loss_table(bench, gear)?;
    page += &time_table(&bins, &found);
    page += &crowd_table(bench, gear)?;
    page += &seen_table(bench, &bins)?;
    if let Some(data) = &data {
        page += &foreign_table(bench, &bins, data)?;
    }
    Ok(page)
}

fn words(extent: &Extent, with_data: bool) -> String {
    let Extent { steps, training_scenes, scenes, .. } = extent;
    let whose = if with_data { "Meshes and scenes of the folder given take part. " } else { "" };
    format!(
        "Parts of our own design that stand for the thesis' (in brackets), in a bin under a structured-light camera; floor and walls \
         are cut away, as the method has it. {steps} steps a network on up to {training_scenes} simulated bins of the part, judged on {scenes} \
         others; parts hidden to 80 % or more are not scored. FPCC begins with the shipped tetrapod weights and FPCCv2 with those for \
         any shape where the row does not say otherwise; U-Net and peers begin from nothing. The depth-image watershed stands for \
         SD-Mask and is no reproduction of it. {whose}\n\n"
    )
}

fn heads(bins: &[Bin]) -> Vec<String> {
    let head = |b: &Bin| format!("{} ({})", b.part.name, b.part.stands_for);
    std::iter::once("method".to_string()).chain(bins.iter().map(head)).collect()
}

/// One row a method, one column a part.
fn by_part(
    bins: &[Bin],
    found: &BTreeMap<(usize, usize), RowResult>,
    chosen: impl Fn(&Row) -> bool,
    cell: impl Fn(&RowResult) -> String,
) -> Table {
    let heads = heads(bins);
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for (r, row) in rows().iter().enumerate().filter(|(_, row)| chosen(row)) {
        let cells = (0..bins.len()).map(|b| cell(&found[&(b, r)]));
        table.row(std::iter::once(row.0.to_string()).chain(cells));
    }
    table
}

fn main_table(bins: &[Bin], found: &BTreeMap<(usize, usize), RowResult>) -> String {
    let cell = |r: &RowResult| format!("{}/{}", percent(r.precision()), percent(r.recall()));
    let mut table = by_part(bins, found, |_| true, cell);
    let thesis = bins.iter().map(|b| format!("{:.1}/{:.1}", b.part.thesis[0], b.part.thesis[1]));
    table.row(std::iter::once("*thesis, FPCC, its own data*".to_string()).chain(thesis));
    format!("## Table 2.2: precision/recall at IoU .5, %\n\n{}\n", table.finish())
}

fn precision_table(bins: &[Bin], found: &BTreeMap<(usize, usize), RowResult>) -> String {
    let cell = |r: &RowResult| format!("{} ({})", percent(r.ap50), percent(r.ap));
    let table = by_part(bins, found, |_| true, cell);
    format!(
        "## Table 2.1: AP at IoU .5 (and mean over .5 to .9), %\n\n{}\nThe thesis, FPCC: ring screw 63.2, gear shaft 60.9.\n\n",
        table.finish()
    )
}

fn gamma_table(bench: &Bench, bin: &Bin) -> Result<String, ReproduceError> {
    let all = rows();
    let mut table = Table::new(&["γ", "FPCC P/R %", "FPCCv2, Algorithm 1 P/R %"]);
    for gamma in GAMMAS {
        let mut cells = vec![format!("{gamma}")];
        for at in [0, 2] {
            let row = &all[at];
            let result = bin.held_out(bench, row, &format!("{} gamma {gamma}", row.0), gamma)?;
            cells.push(format!("{}/{}", percent(result.precision()), percent(result.recall())));
        }
        table.row(cells);
    }
    Ok(format!("## Table 2.3: radius of Algorithm 1, {}\n\n{}\n", bin.part.name, table.finish()))
}

fn loss_table(bench: &Bench, bin: &Bin) -> Result<String, ReproduceError> {
    let mut table = Table::new(&["pair loss", "P %", "R %", "AP50 %"]);
    for (name, valid_distance, attention) in [
        ("none", false, false),
        ("valid distance", true, false),
        ("attention", false, true),
        ("both", true, true),
    ] {
        let pair = PairLossConfig { valid_distance, attention, ..Default::default() };
        let net = Net::Fpcc(pair);
        let mut results = Vec::new();
        for repeat in 0..bin.extent.repeats {
            let row = format!("matrices {name} {repeat}");
            results.push(bin.disk.row(&row, || {
                let ready = bin.trained(bench, &net, &row, repeat)?;
                let (trained, steps) = &*ready;
                trained.judged(bench, bin.part, bin.scenes(bench)?, Reading::Own, 1.0, *steps)
            })?);
        }
        let spread = |f: fn(&RowResult) -> Option<f64>| {
            mean_and_spread(&results.iter().filter_map(f).collect::<Vec<_>>())
        };
        table.row([
            name.to_string(),
            spread(RowResult::precision),
            spread(RowResult::recall),
            spread(|r| r.ap50),
        ]);
    }
    Ok(format!(
        "## Table 2.4: valid-distance and attention matrix, FPCC, {}\n\nMean and standard deviation over {} trainings that differ in \
         tiles and in nothing else.\n\n{}\nThe thesis, gear shaft: none 40.9/23.7, both 54.3/69.5.\n\n",
        bin.part.name,
        bin.extent.repeats,
        table.finish()
    ))
}

/// `mean ± sd` in percent; a dash for nothing.
fn mean_and_spread(shares: &[f64]) -> String {
    if shares.is_empty() {
        return "–".into();
    }
    let n = shares.len() as f64;
    let mean = shares.iter().sum::<f64>() / n;
    if shares.len() == 1 {
        return format!("{:.1}", mean * 100.0);
    }
    let variance = shares.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (n - 1.0);
    format!("{:.1} ± {:.1}", mean * 100.0, variance.sqrt() * 100.0)
}

fn time_table(bins: &[Bin], found: &BTreeMap<(usize, usize), RowResult>) -> String {
    let table = by_part(bins, found, |_| true, |r| format!("{:.2}", r.seconds));
    let cost = |r: &RowResult| {
        let seconds = r.seconds_for_100_000().map_or("–".into(), |s| format!("{s:.2}"));
        format!("{seconds} s, {}", r.peak_mb.map_or("–".into(), |mb| format!("{mb:.0} MB")))
    };
    let costs = by_part(bins, found, |_| true, cost);
    format!(
        "## Table 2.5: seconds a scene\n\n{}\nThe thesis, GTX 1080: 0.55 to 1.78 s.\n\nFor 100,000 points of the cloud, and the most memory a \
         scene took beyond what was held before:\n\n{}\n",
        table.finish(),
        costs.finish()
    )
}

fn crowd_table(bench: &Bench, bin: &Bin) -> Result<String, ReproduceError> {
    let chosen = [0, 3, 6, 11, 12];
    let all = rows();
    let heads: Vec<&str> =
        ["parts in the bin"].into_iter().chain(chosen.iter().map(|&r| all[r].0)).collect();
    let mut table = Table::new(&heads);
    for parts in &CROWDS[..bin.extent.crowds] {
        let scene = OnceCell::new();
        let mut cells = vec![parts.to_string()];
        for &r in &chosen {
            let (name, net, reading) = &all[r];
            let result = bin.disk.row(&format!("{name} crowd {parts}"), || {
                if scene.get().is_none() {
                    let _ = scene.set(bin.part.crowd(bench, *parts)?);
                }
                let scene = scene.get().into_iter().cloned().collect::<Vec<_>>();
                let ready = bin.trained(bench, net, training_name(name, net), 0)?;
                let (trained, steps) = &*ready;
                trained.judged(bench, bin.part, &scene, *reading, 1.0, *steps)
            })?;
            cells.push(format!("{:.2}", result.seconds));
        }
        table.row(cells);
    }
    Ok(format!(
        "## Fig. 2.12: seconds against parts in the bin, {}\n\n{}\n",
        bin.part.name,
        table.finish()
    ))
}

/// Beyond the thesis: the bin stays in the cloud, and the network tells parts from it.
fn seen_table(bench: &Bench, bins: &[Bin]) -> Result<String, ReproduceError> {
    let mut table = Table::new(&["part, bin in view", "votes P/R %", "votes and poses P/R %"]);
    let net = Net::V2 { from_any_shape: true };
    for bin in bins {
        let mut cells = vec![bin.part.name.to_string()];
        for reading in [Reading::Votes, Reading::Poses] {
            let result = bin.disk.row(&format!("seen {reading:?}"), || {
                let ready = bin.trained(bench, &net, "FPCCv2", 0)?;
                let (trained, steps) = &*ready;
                let scene = bin.part.seen_bin(bench, 0)?;
                trained.judged(bench, bin.part, &[scene], reading, 1.0, *steps)
            })?;
            cells.push(format!("{}/{}", percent(result.precision()), percent(result.recall())));
        }
        table.row(cells);
    }
    Ok(format!("## The bin in view, FPCCv2\n\nOne scene a part.\n\n{}\n", table.finish()))
}

/// The authors' scenes under weights trained on our look-alikes; nothing where no scene of the folder shows one of the parts.
fn foreign_table(bench: &Bench, bins: &[Bin], data: &BinData) -> Result<String, ReproduceError> {
    let mut table = Table::new(&["scene", "network", "P %", "R %", "AP50 %", "coverage %"]);
    let mut rows_made = 0;
    for bin in bins {
        let Some(scene) = data.scene(bin.part.name, bench.observer)? else { continue };
        for (name, net, reading) in [&rows()[0], &rows()[3]] {
            let ready = bin.trained(bench, net, training_name(name, net), 0)?;
            let Trained::Model(model) = &ready.0 else { continue };
            let figures = scene.segmented(bench, bin.part, model, *reading)?;
            table.row(foreign_row(bin.part.stands_for, name, &figures));
            rows_made += 1;
        }
    }
    if rows_made == 0 {
        return Ok(String::new());
    }
    Ok(format!("## The authors' scenes, weights from our look-alikes\n\n{}\n", table.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_of_nothing_one_and_some() {
        assert_eq!(mean_and_spread(&[]), "–");
        assert_eq!(mean_and_spread(&[0.5]), "50.0");
        assert_eq!(mean_and_spread(&[0.4, 0.6]), "50.0 ± 14.1");
    }

    #[test]
    fn readings_of_one_network_share_its_training() {
        let names: Vec<&str> = rows().iter().map(|(n, net, _)| training_name(n, net)).collect();
        assert_eq!(names.iter().filter(|n| **n == "FPCCv2").count(), 3);
    }
}
