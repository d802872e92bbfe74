//! The size of the blocks, asked of a survey before anything is recognised.
//!
//! In: a survey, shapes whose sizes do not matter. Out: sizes that fit, best first. A large survey is asked in a few windows,
//! those with much relief and those with less: blocks of one size lie in all of them.

use crate::gridded::Gridded;
use crate::size_search::{SizeProposal, SizeSearch, fit_block_size};
use crate::survey_facts::SurveyFacts;
use crate::{PoseConfig, PoseError};
use geom::{Bounds, Observer, SeedTree, Vec2, Vec3};
use scene::{Catalog, Survey};

/// Points a size is sought in, at most.
const MOST_POINTS: usize = 300_000;
/// Windows of a survey that has more.
const WINDOWS: usize = 4;
/// Cells with the most relief hold walls and trees rather than blocks: the windows are those at these shares of all cells.
const RANKS: [f32; WINDOWS] = [0.95, 0.85, 0.7, 0.5];
/// Blocks are at least about so large for noise to be told from shape, metres.
const GUESS_M: f32 = 0.6;

/// Sizes of the catalogue's shapes that fit the survey, best first; empty when nothing fits.
///
/// Errors: a mesh that makes no template, or the user asked to stop.
pub fn fit_sizes(
    survey: &Survey,
    catalog: &Catalog,
    search: &SizeSearch,
    config: &PoseConfig,
    observer: &dyn Observer,
) -> Result<Vec<SizeProposal>, PoseError> {
    if survey.cloud.is_empty() {
        return Ok(Vec::new());
    }
    let part = windows(survey, MOST_POINTS);
    let facts = SurveyFacts::of(&part, GUESS_M);
    let gridded = facts.lattice.as_ref().map(|lattice| Gridded::new(&part, lattice));
    let noise_m = config.noise_sd_m.unwrap_or_else(|| facts.noise_sd_m(&part, GUESS_M));
    let (part, noise_m) = match &gridded {
        Some(gridded) => (&gridded.survey, noise_m.hypot(gridded.error_rms_m())),
        None => (&part, noise_m),
    };
    // Chance has no say in what is proposed.
    let seed = SeedTree::new(0).child("sizes", 0);
    fit_block_size(part, catalog, noise_m, search, config, seed, observer)
}

/// The survey itself, or so many of its points in a few windows, each at the survey's own density.
pub fn windows(survey: &Survey, most: usize) -> Survey {
    let points = &survey.cloud.position_m;
    if points.len() <= most {
        return survey.clone();
    }
    let bounds = Bounds::of(points.iter().copied());
    let size = bounds.size();
    let share = most as f32 / WINDOWS as f32 / points.len() as f32;
    let side_m = (size.x * size.y * share).sqrt().max(f32::MIN_POSITIVE);
    let across = (size.x / side_m).ceil().max(1.0) as usize;
    let cell = |p: Vec3| {
        let at = (p - bounds.min).truncate() / side_m;
        at.y as usize * (across + 1) + at.x as usize
    };
    let chosen = chosen(points, cell, side_m);
    let own = |c: usize| chosen.iter().position(|k| *k == c);
    let mut of: Vec<Vec<usize>> = vec![Vec::new(); chosen.len()];
    for (i, p) in points.iter().enumerate() {
        own(cell(*p)).into_iter().for_each(|k| of[k].push(i));
    }
    // A window denser than the mean is cut to its middle, so that its density stays.
    let mut select: Vec<usize> =
        of.into_iter().flat_map(|window| middle(points, window, most / WINDOWS)).collect();
    select.sort_unstable();
    let line = if survey.line.is_empty() {
        Vec::new()
    } else {
        select.iter().map(|&i| survey.line[i]).collect()
    };
    Survey { cloud: survey.cloud.select(&select), line, ..survey.clone() }
}

/// Cells whose relief has the ranks wanted, each once.
fn chosen(points: &[Vec3], cell: impl Fn(Vec3) -> usize, side_m: f32) -> Vec<usize> {
    let mut of: std::collections::BTreeMap<usize, Vec<Vec3>> = Default::default();
    // Every tenth point tells the relief.
    for p in points.iter().step_by(10) {
        of.entry(cell(*p)).or_default().push(*p);
    }
    let full = of.values().map(Vec::len).max().unwrap_or(0);
    let mut cells: Vec<(f32, usize)> = of
        .into_iter()
        .filter(|(_, p)| 4 * p.len() >= full)
        .map(|(cell, p)| (relief_m(&p, side_m), cell))
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let last = cells.len().saturating_sub(1) as f32;
    let mut chosen: Vec<usize> =
        RANKS.iter().filter_map(|r| Some(cells.get((r * last).round() as usize)?.1)).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

/// Spread of the heights about their own plane, metres: tenth to ninth tenth.
pub fn relief_m(points: &[Vec3], side_m: f32) -> f32 {
    let mean = points.iter().copied().sum::<Vec3>() / points.len().max(1) as f32;
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let d = *p - mean;
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
        (xz, yz) = (xz + d.x * d.z, yz + d.y * d.z);
    }
    let least = 1e-4 * side_m * side_m * points.len() as f32;
    let determinant = (xx * yy - xy * xy).max(least * least);
    let (a, b) = ((xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant);
    let off = |p: &Vec3| p.z - mean.z - a * (p.x - mean.x) - b * (p.y - mean.y);
    let mut height: Vec<f32> = points.iter().map(off).collect();
    height.sort_by(f32::total_cmp);
    let at = |q: f32| height.get((q * height.len() as f32) as usize).copied().unwrap_or(0.0);
    at(0.9) - at(0.1)
}

/// So many of these points that lie nearest to their middle in plan.
fn middle(points: &[Vec3], mut of: Vec<usize>, most: usize) -> Vec<usize> {
    if of.len() <= most {
        return of;
    }
    let mean = of.iter().map(|&i| points[i].truncate()).sum::<Vec2>() / of.len() as f32;
    let away = |i: &usize| (points[*i].truncate() - mean).abs().max_element();
    of.sort_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
    of.truncate(most);
    of
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Silent};

    #[test]
    fn windows_keep_the_density_and_prefer_relief() {
        let mut points = Vec::new();
        for j in 0..400 {
            for i in 0..400 {
                let (x, y) = (0.1 * i as f32, 0.1 * j as f32);
                // Waves on the western half of a slope.
                let z = 0.2 * y + if x < 20.0 { (3.0 * x).sin() } else { 0.0 };
                points.push(Vec3::new(x, y, z));
            }
        }
        let survey = Survey { cloud: PointCloud::from_positions(points), ..Survey::default() };
        let part = windows(&survey, 16_000);
        let kept = &part.cloud.position_m;
        assert!((8_000..=16_000).contains(&kept.len()), "{}", kept.len());
        let west = kept.iter().filter(|p| p.x < 20.0).count();
        assert!(west * 10 > kept.len() * 7, "{west} of {}", kept.len());
        let first = kept[0];
        let nearest = kept[1..].iter().map(|p| (*p - first).truncate().length());
        assert!(nearest.fold(f32::INFINITY, f32::min) < 0.11);
        assert_eq!(windows(&survey, 200_000).cloud.len(), 160_000);
    }

    #[test]
    fn an_empty_survey_fits_nothing() {
        let found = fit_sizes(
            &Survey::default(),
            &Catalog::new(Vec::new()),
            &SizeSearch::default(),
            &PoseConfig::default(),
            &Silent,
        );
        assert!(found.is_ok_and(|f| f.is_empty()));
    }
}
