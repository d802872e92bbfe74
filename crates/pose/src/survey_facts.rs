//! What the survey itself says of its making: spacing, noise, grid, unit; and whether blocks of a catalogue can be judged in it.
//!
//! In: a survey, a catalogue. Out: [`SurveyFacts`], asked before any work begins. What a sensor of some kind usually does is no
//! substitute: the same drone gives 5 mm on one site and 5 cm on the next, and a terrain model of 20 cm cells is no cloud.

use geom::{Bounds, CellRule, Lattice, PointGrid, Scatter, Vec3, thin_from_lowest};
use scene::{BlockModel, Catalog, Survey};

/// Fewest points on the half of a block that one side sees.
pub const FEWEST_POINTS_A_BLOCK: f32 = 40.0;
/// Most noise, in lengths of the block's longest edge.
pub const MOST_NOISE: f32 = 0.05;
/// Largest cell of a grid, in lengths of the block's longest edge.
pub const LARGEST_CELL: f32 = 0.105;
/// Points farther apart than this part of a block show no shape.
const WIDEST_SPACING: f32 = 0.25;
/// Largest share of a survey's extent to a block's length in a site.
const LONGEST_SITE: f32 = 5e3;
/// Spacing in d_max up to which scatter is noise alone.
const CLOSE: f32 = 0.12;
/// Points asked for their neighbours.
const ASKED: usize = 500;

/// What a survey says of its own making.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyFacts {
    /// Points.
    pub points: usize,
    /// Share of points that lie exactly on another.
    pub duplicates: f32,
    /// Typical distance between points on the surface, metres.
    pub spacing_m: f32,
    /// Spacing where points are sparse over spacing where they are dense (upper over lower tenth).
    pub unevenness: f32,
    /// How far points scatter about the surface, by region.
    pub scatter: Scatter,
    /// The grid, for surveys that are one.
    pub lattice: Option<Lattice>,
    /// Largest side of the box around all points, metres.
    pub extent_m: f32,
}

/// Why blocks cannot be judged, or only with doubt.
#[derive(Clone, Debug, PartialEq)]
pub enum Limit {
    /// Too few points fall on a block.
    Points {
        /// On the half that one side sees.
        a_block: f32,
    },
    /// The noise hides the shape.
    Noise {
        /// Standard deviation in lengths of the block.
        of_block: f32,
    },
    /// The cells of a grid are too large.
    Cell {
        /// In lengths of the block.
        of_block: f32,
    },
    /// Points or extent speak for another unit.
    Unit(UnitGuess),
}

/// A unit in which the numbers of the cloud would make sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitGuess {
    /// Its name.
    pub name: &'static str,
    /// Metres in one.
    pub metres: f32,
}

const UNITS: [UnitGuess; 4] = [
    UnitGuess { name: "millimetres", metres: 0.001 },
    UnitGuess { name: "centimetres", metres: 0.01 },
    UnitGuess { name: "inches", metres: 0.0254 },
    UnitGuess { name: "feet", metres: 0.3048 },
];

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Points { a_block } => write!(
                f,
                "some {a_block:.0} points fall on what is seen of a block; at least {FEWEST_POINTS_A_BLOCK:.0} are needed"
            ),
            Self::Noise { of_block } => write!(
                f,
                "points scatter by {:.1} % of a block's length; {:.0} % is the most that leaves a shape",
                100.0 * of_block,
                100.0 * MOST_NOISE
            ),
            Self::Cell { of_block } => write!(
                f,
                "cells of the grid are {:.1} % of a block's length; up to {:.0} % blocks can be told",
                100.0 * of_block,
                100.0 * LARGEST_CELL
            ),
            Self::Unit(unit) => write!(
                f,
                "the cloud does not fit blocks of this size; its numbers look like {}: multiply them by {}",
                unit.name, unit.metres
            ),
        }
    }
}

impl SurveyFacts {
    /// Asks the survey; `d_max_m` is the smallest block's, which decides how wide regions and patches are.
    pub fn of(survey: &Survey, d_max_m: f32) -> Self {
        let all = &survey.cloud.position_m;
        let distinct = distinct(all);
        let duplicates = 1.0 - distinct.len() as f32 / all.len().max(1) as f32;
        let spacing = spacings(&distinct);
        let at = |q: f32| spacing.get((q * spacing.len() as f32) as usize).copied();
        let spacing_m = at(0.5).unwrap_or(0.0);
        let unevenness = match (at(0.1), at(0.9)) {
            (Some(low), Some(high)) if low > 0.0 => high / low,
            _ => 1.0,
        };
        let lattice = Lattice::of(&distinct);
        let scatter = match &lattice {
            // A cell's height scatters about the surface it stands for, not about its neighbours' middles.
            Some(lattice) => {
                let held: Vec<Vec3> = lattice
                    .surface(&distinct)
                    .into_iter()
                    .filter(|s| s.holds)
                    .map(|s| s.position)
                    .collect();
                geom::scatter(&held, spacing_m, 4.0 * d_max_m)
            }
            None => geom::scatter(&distinct, spacing_m, 4.0 * d_max_m),
        };
        let extent_m =
            if all.is_empty() { 0.0 } else { Bounds::of(all.iter().copied()).size().max_element() };
        Self { points: all.len(), duplicates, spacing_m, unevenness, scatter, lattice, extent_m }
    }

    /// Standard deviation of a point, metres: as measured, else what the sensor's kind usually does.
    pub fn noise_sd_m(&self, survey: &Survey, d_max_m: f32) -> f32 {
        // Where points lie far apart against the block, what is no plane between them is shape as much as noise.
        let told = self.scatter.overall_m.filter(|_| self.spacing_m < CLOSE * d_max_m);
        // Below a tenth of a per cent of a block nothing gets better, and a simulated plane has none at all.
        told.map_or_else(|| survey.sensor.noise_sd_m(d_max_m), |sd| sd.max(1e-3 * d_max_m))
    }

    /// What keeps blocks of this type from being judged; empty when nothing does.
    pub fn limits(&self, model: &BlockModel) -> Vec<Limit> {
        let mut limits = Vec::new();
        if self.points == 0 || !(self.spacing_m > 0.0) {
            return vec![Limit::Points { a_block: 0.0 }];
        }
        if let Some(unit) = self.unit_for(model) {
            return vec![Limit::Unit(unit)];
        }
        let a_block = 0.5 * model.mesh.area_m2() / (self.spacing_m * self.spacing_m);
        if a_block < FEWEST_POINTS_A_BLOCK {
            limits.push(Limit::Points { a_block });
        }
        let of_block = self.scatter.overall_m.unwrap_or(0.0) / model.d_box_m;
        if of_block > MOST_NOISE {
            limits.push(Limit::Noise { of_block });
        }
        if let Some(lattice) = &self.lattice {
            let of_block = lattice.cell_m / model.d_box_m;
            if of_block > LARGEST_CELL {
                limits.push(Limit::Cell { of_block });
            }
        }
        limits
    }

    /// The unit in which the cloud fits the block, when metres do not and another does.
    fn unit_for(&self, model: &BlockModel) -> Option<UnitGuess> {
        let fits = |metres: f32| {
            let (spacing, extent) = (self.spacing_m * metres, self.extent_m * metres);
            spacing < WIDEST_SPACING * model.d_box_m
                && extent > 0.5 * model.d_box_m
                && extent < LONGEST_SITE * model.d_box_m
        };
        if fits(1.0) {
            return None;
        }
        UNITS.into_iter().filter(|u| fits(u.metres)).min_by(|a, b| {
            // Most surveys have some 30 points along a block.
            let off = |u: &UnitGuess| (30.0 * self.spacing_m * u.metres / model.d_box_m).ln().abs();
            off(a).total_cmp(&off(b))
        })
    }

    /// One line for a person.
    pub fn sentence(&self) -> String {
        let grid = self.lattice.as_ref().map_or(String::new(), |l| {
            let rule = match l.rule {
                Some(CellRule::Mean) => ", means of their cells",
                Some(CellRule::Highest) => ", highest of their cells",
                None => "",
            };
            format!("; heights on a grid of {:.0} mm{rule}", 1e3 * l.cell_m)
        });
        let noise =
            self.scatter.overall_m.map_or("unknown".into(), |sd| format!("{:.0} mm", 1e3 * sd));
        format!(
            "{} points, {:.0} mm apart, scatter {noise}{grid}",
            self.points,
            1e3 * self.spacing_m
        )
    }
}

/// A unit that explains a factor between the catalogue's size and the one that fits, within 3 %.
pub fn unit_of_factor(factor: f32) -> Option<UnitGuess> {
    UNITS.into_iter().find(|u| (factor * u.metres).ln().abs() < 0.03)
}

/// The types of a catalogue that cannot be judged in this survey, each with what stands in the way.
pub fn not_judgeable<'a>(
    facts: &SurveyFacts,
    catalog: &'a Catalog,
) -> Vec<(&'a BlockModel, Vec<Limit>)> {
    let asked = catalog.iter().map(|(_, model)| (model, facts.limits(model)));
    asked.filter(|(_, limits)| !limits.is_empty()).collect()
}

/// Each position once.
fn distinct(points: &[Vec3]) -> Vec<Vec3> {
    let bits = |p: &Vec3| p.to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|&i| (bits(&points[i as usize]), i));
    order.dedup_by_key(|i| bits(&points[*i as usize]));
    order.sort_unstable();
    order.into_iter().map(|i| points[i as usize]).collect()
}

/// Distances between points on the surface at a few places, ascending: from the number of neighbours on a disc.
fn spacings(points: &[Vec3]) -> Vec<f32> {
    let bounds = Bounds::of(points.iter().copied());
    if points.len() < 8 {
        return Vec::new();
    }
    let size = bounds.size();
    let plan = (size.x * size.y).max(size.max_element().powi(2) * 1e-4);
    let guess_m = (plan / points.len() as f32).sqrt().max(f32::MIN_POSITIVE);
    let grid = PointGrid::new(points, 3.0 * guess_m);
    let mut places = thin_from_lowest(points, 2.0 * guess_m).kept;
    let stride = places.len().div_ceil(ASKED).max(1);
    places = places.into_iter().step_by(stride).collect();
    let mut spacing: Vec<f32> = places
        .into_iter()
        .map(|i| {
            let (mut n, mut radius) = (0.0_f32, 1.5 * guess_m);
            for _ in 0..12 {
                n = 0.0;
                grid.for_each_within(points[i as usize], radius, |_, _, _| n += 1.0);
                if (8.0..80.0).contains(&n) {
                    break;
                }
                radius *= if n < 8.0 { 1.5 } else { 0.6 };
            }
            (std::f32::consts::PI * radius * radius / n.max(1.0)).sqrt()
        })
        .collect();
    spacing.sort_by(f32::total_cmp);
    spacing
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, SeedTree};
    use rand::RngExt;
    use scene::{SensorKind, Shape};

    /// A rolling surface, `per_m2` points, noise across it.
    fn survey(per_m2: f32, noise_m: f32, unit: f32, seed: u64) -> Survey {
        let mut rng = SeedTree::new(seed).rng();
        let points = (0..(100.0 * per_m2) as usize)
            .map(|_| {
                let (x, y) = (rng.random::<f32>() * 10.0, rng.random::<f32>() * 10.0);
                let normal: f32 = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                Vec3::new(x, y, 0.4 * (1.3 * x).sin() + 0.3 * y + noise_m * normal) * unit
            })
            .collect();
        Survey { cloud: PointCloud::from_positions(points), ..Survey::default() }
    }

    fn tetrapod(size: f32) -> BlockModel {
        blocks::shape_model("t", Shape::Tetrapod { size }, 2300.0).unwrap()
    }

    #[test]
    fn noise_and_spacing_come_from_the_points_not_from_the_sensor() {
        for (per_m2, noise_m) in [(300.0, 0.01), (300.0, 0.05), (2000.0, 0.03)] {
            let mut survey = survey(per_m2, noise_m, 1.0, 5);
            survey.sensor = SensorKind::Mbes;
            let facts = SurveyFacts::of(&survey, 1.2);
            let noise = facts.noise_sd_m(&survey, 1.2);
            assert!((0.7..1.4).contains(&(noise / noise_m)), "{noise_m}: {noise}");
            let spacing_m = 1.0 / per_m2.sqrt();
            assert!((0.6..1.6).contains(&(facts.spacing_m / spacing_m)), "{}", facts.spacing_m);
            assert!(facts.lattice.is_none() && facts.limits(&tetrapod(2.0)).is_empty());
        }
    }

    #[test]
    fn a_cloud_in_millimetres_is_named() {
        let facts = SurveyFacts::of(&survey(300.0, 0.01, 1000.0, 6), 1.2);
        let Some(Limit::Unit(unit)) = facts.limits(&tetrapod(2.0)).pop() else {
            panic!("{facts:?}")
        };
        assert_eq!(unit.name, "millimetres");
        assert_eq!(unit_of_factor(3.27).map(|u| u.name), Some("feet"));
        assert_eq!(unit_of_factor(1.4), None);
    }

    #[test]
    fn too_sparse_and_too_noisy_surveys_are_refused_and_duplicates_counted() {
        let sparse = SurveyFacts::of(&survey(3.0, 0.0, 1.0, 7), 1.2);
        assert!(matches!(sparse.limits(&tetrapod(2.0))[..], [Limit::Points { .. }]));
        let noisy = SurveyFacts::of(&survey(900.0, 0.1, 1.0, 8), 0.6);
        assert!(
            noisy.limits(&tetrapod(1.0)).iter().any(|l| matches!(l, Limit::Noise { .. })),
            "{noisy:?}"
        );
        let mut twice = survey(300.0, 0.01, 1.0, 9);
        let again = twice.cloud.position_m.clone();
        twice.cloud.position_m.extend(again);
        assert!((SurveyFacts::of(&twice, 1.2).duplicates - 0.5).abs() < 0.01);
        let empty = Survey::default();
        assert!(!SurveyFacts::of(&empty, 1.2).limits(&tetrapod(2.0)).is_empty());
    }
}
