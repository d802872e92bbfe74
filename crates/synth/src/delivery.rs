//! What becomes of a survey between the sensor and the one who gets it: thinned unevenly, holed, cropped, doubled, gridded.
//!
//! In: the points of a scan with their blocks. Out: those handed over. A grid keeps one height a cell and with it the block of
//! the cell's highest point.

use crate::SynthError;
use crate::recipe::Resolved;
use crate::sensor::{Scan, within};
use geom::{CellRule, SeedTree, Vec2, Vec3};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What is done to the points, in this order; the default does nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Delivery {
    /// Density in the west over density in the east; 1: even.
    pub uneven: f32,
    /// Round holes in plan.
    pub holes: u32,
    /// Their radius, in lengths of the largest block.
    pub hole_blocks: f32,
    /// Share of the sides of the site that is handed over, about its middle; 1: all.
    pub crop: f32,
    /// White noise added, standard deviation an axis.
    pub noise_sd_m: f32,
    /// Share of the points that come twice.
    pub duplicates: f32,
    /// Cell of the grid the heights are brought to; 0: none.
    pub cell_m: f32,
    /// How a cell's height is made.
    pub rule: Rule,
}

/// How a cell's height is made of the points in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Their mean.
    #[default]
    Mean,
    /// The highest.
    Highest,
}

impl From<Rule> for CellRule {
    fn from(rule: Rule) -> Self {
        match rule {
            Rule::Mean => Self::Mean,
            Rule::Highest => Self::Highest,
        }
    }
}

impl Default for Delivery {
    fn default() -> Self {
        Self {
            uneven: 1.0,
            holes: 0,
            hole_blocks: 0.25,
            crop: 1.0,
            noise_sd_m: 0.0,
            duplicates: 0.0,
            cell_m: 0.0,
            rule: Rule::Mean,
        }
    }
}

impl Delivery {
    pub(crate) fn check(&self) -> Result<(), SynthError> {
        within("delivery.uneven", self.uneven, [1.0, 1000.0], "1 (even) to 1000")?;
        within("delivery.holes", self.holes as f32, [0.0, 10_000.0], "0 to 10000")?;
        within(
            "delivery.hole_blocks",
            self.hole_blocks,
            [0.01, 100.0],
            "0.01 to 100 block lengths",
        )?;
        within("delivery.crop", self.crop, [0.05, 1.0], "0.05 to 1 of the sides")?;
        within("delivery.noise_sd_m", self.noise_sd_m, [0.0, 10.0], "0 to 10 m")?;
        within("delivery.duplicates", self.duplicates, [0.0, 1.0], "0 to 1")?;
        within("delivery.cell_m", self.cell_m, [0.0, 100.0], "0 (no grid) to 100 m")
    }

    /// What is handed over of a scan; occlusions grow by what holes and crops take of a block's points.
    pub(crate) fn of(&self, scan: &mut Scan, resolved: &Resolved, seed: SeedTree) {
        if *self == Self::default() {
            return;
        }
        let mut rng = seed.child("uneven", 0).rng();
        let half = resolved.size_m[0] / 2.0;
        let keep: Vec<bool> = scan
            .points
            .iter()
            .map(|(p, _)| {
                let east = ((p.x + half) / (2.0 * half)).clamp(0.0, 1.0);
                self.uneven <= 1.0 || rng.random::<f32>() < self.uneven.powf(-east)
            })
            .collect();
        retain(scan, &keep);
        self.cut(scan, resolved, seed.child("holes", 0));
        let mut rng = seed.child("noise", 0).rng();
        if self.noise_sd_m > 0.0 {
            for (p, _) in &mut scan.points {
                let white: [f32; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
                *p += Vec3::from_array(white) * self.noise_sd_m;
            }
        }
        for i in 0..scan.points.len() {
            if self.duplicates > 0.0 && rng.random::<f32>() < self.duplicates {
                scan.points.push(scan.points[i]);
                if let Some(&line) = scan.line.get(i) {
                    scan.line.push(line);
                }
            }
        }
        if self.cell_m > 0.0 {
            self.grid(scan);
        }
    }

    /// Holes and the crop.
    fn cut(&self, scan: &mut Scan, resolved: &Resolved, seed: SeedTree) {
        let [x, y] = resolved.size_m.map(|s| s / 2.0);
        let mut rng = seed.rng();
        let radius_m = self.hole_blocks * resolved.largest_m;
        let hole: Vec<(Vec2, f32)> = (0..self.holes)
            .map(|_| {
                let at = Vec2::new(rng.random_range(-x..x), rng.random_range(-y..y));
                (at, radius_m * rng.random_range(0.6..1.4_f32))
            })
            .collect();
        let keep: Vec<bool> = scan
            .points
            .iter()
            .map(|(p, _)| {
                let plan = p.truncate();
                let cropped = self.crop < 1.0
                    && (plan.x.abs() > self.crop * x || plan.y.abs() > self.crop * y);
                !cropped && hole.iter().all(|(at, r)| (plan - *at).length() > *r)
            })
            .collect();
        let blocks = scan.occlusion.len();
        let (mut all, mut left) = (vec![0.0_f32; blocks + 1], vec![0.0_f32; blocks + 1]);
        for ((_, block), keep) in scan.points.iter().zip(&keep) {
            all[*block as usize] += 1.0;
            left[*block as usize] += f32::from(u8::from(*keep));
        }
        for (k, occlusion) in scan.occlusion.iter_mut().enumerate() {
            if all[k + 1] > 0.0 {
                *occlusion = 1.0 - (1.0 - *occlusion) * left[k + 1] / all[k + 1];
            }
        }
        retain(scan, &keep);
    }

    /// One point a cell, at its middle.
    fn grid(&self, scan: &mut Scan) {
        // Sum, count, highest and its block.
        let mut cells: BTreeMap<[i32; 2], (f64, u32, f32, u32)> = BTreeMap::new();
        for &(p, block) in &scan.points {
            let key = [p.y, p.x].map(|v| (v / self.cell_m).floor() as i32);
            let cell = cells.entry(key).or_insert((0.0, 0, f32::NEG_INFINITY, 0));
            cell.0 += f64::from(p.z);
            cell.1 += 1;
            if p.z > cell.2 {
                (cell.2, cell.3) = (p.z, block);
            }
        }
        scan.line.clear();
        scan.points = cells
            .into_iter()
            .map(|([j, i], (sum, count, highest, block))| {
                let z = match self.rule {
                    Rule::Mean => (sum / f64::from(count)) as f32,
                    Rule::Highest => highest,
                };
                let middle = Vec2::new(i as f32 + 0.5, j as f32 + 0.5) * self.cell_m;
                (middle.extend(z), block)
            })
            .collect();
    }
}

fn retain(scan: &mut Scan, keep: &[bool]) {
    let mut it = keep.iter();
    scan.points.retain(|_| *it.next().expect("one verdict a point"));
    if !scan.line.is_empty() {
        let mut it = keep.iter();
        scan.line.retain(|_| *it.next().expect("one verdict a point"));
    }
}
