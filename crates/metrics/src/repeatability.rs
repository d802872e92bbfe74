//! How well a recognition repeats itself on a survey nobody has the truth of.
//!
//! In: a survey, a way to recognise. Out: how far two halves of the survey agree — which blocks both find, how far their poses
//! are apart, and what confidence those had that only one half finds. Halves by survey line where the file tells lines (they
//! err apart, as two surveys do), else point by point (which shows noise alone: the halves share every bias).

use geom::{Bounds, Vec3};
use scene::{Catalog, Fit, PlacedBlock, PoseLimits, Recognised, Survey};

/// How a survey was split.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// Every other survey line.
    Lines,
    /// Every other point.
    Points,
}

/// A stated block and its confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedBlock {
    /// Type and pose.
    pub placed: PlacedBlock,
    /// Probability that it is right.
    pub confidence: f32,
}

impl StatedBlock {
    /// The stated blocks of a result; confidence 0 where none was worked out.
    pub fn of(recognised: &[Recognised]) -> Vec<Self> {
        let one = |r: &Recognised| {
            let confidence = r.stated().and_then(|fit: &Fit| fit.confidence).unwrap_or(0.0);
            Some(Self { placed: r.placed()?, confidence })
        };
        recognised.iter().filter_map(one).collect()
    }
}

/// Agreement of two halves. Figures over matched blocks are `None` where none match.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Repeatability {
    /// How the survey was split.
    pub split: Split,
    /// Points of each half.
    pub points: [usize; 2],
    /// Blocks each half states.
    pub stated: [usize; 2],
    /// Blocks both state at one place and turn, within the limits of a true positive.
    pub matched: usize,
    /// Of these, blocks of another type in the other half.
    pub other_type: usize,
    /// Shift that all matched blocks have in common, east north up, metres.
    pub common_shift_m: Option<[f32; 3]>,
    /// Median displacement about the common shift, metres.
    pub median_displacement_m: Option<f32>,
    /// Displacement about the common shift that 95 % of the blocks keep, metres.
    pub p95_displacement_m: Option<f32>,
    /// The same of turns, radians.
    pub median_turn_rad: Option<f32>,
    /// The same of turns, radians.
    pub p95_turn_rad: Option<f32>,
    /// Standard deviation of one half's place an axis, metres: displacements over √2.
    pub place_sd_m: Option<f32>,
    /// Mean confidence of matched blocks.
    pub confidence_matched: Option<f32>,
    /// Mean confidence of blocks that the other half does not state there.
    pub confidence_alone: Option<f32>,
}

impl Repeatability {
    /// Share of the statements that the other half makes too; `None` without statements.
    pub fn agreement(&self) -> Option<f32> {
        let all = self.stated[0] + self.stated[1];
        (all > 0).then(|| 2.0 * self.matched as f32 / all as f32)
    }

    /// What a person is told, a line each.
    pub fn lines(&self) -> [String; 3] {
        let by = match self.split {
            Split::Lines => "every other survey line",
            Split::Points => "every other point",
        };
        let [first, second] = self.stated;
        let told = |v: Option<f32>, f: &dyn Fn(f32) -> String| v.map_or("–".into(), f);
        let percent = |v| told(v, &|v| format!("{:.1} %", v * 100.0));
        let apart = |v| told(v, &|v| format!("{:.1} mm", v * 1000.0));
        let degrees = |v| told(v, &|v: f32| format!("{:.2}°", v.to_degrees()));
        let sure = |v| told(v, &|v| format!("{v:.2}"));
        [
            format!(
                "self-check by {by}: {first} and {second} blocks stated, {} by both ({} agree)",
                self.matched,
                percent(self.agreement())
            ),
            format!(
                "  they lie {} apart in the median, 95 % within {}; turned by {}, 95 % within {}",
                apart(self.median_displacement_m),
                apart(self.p95_displacement_m),
                degrees(self.median_turn_rad),
                degrees(self.p95_turn_rad)
            ),
            format!(
                "  mean confidence {} of those both state, {} of those one states alone",
                sure(self.confidence_matched),
                sure(self.confidence_alone)
            ),
        ]
    }
}

/// Edge of the cells whose points are dealt out in turn, in mean spacings.
const CELL: f32 = 3.0;
/// The smaller half holds at least this share, or lines are no way to split.
const LEAST_HALF: f32 = 0.25;

/// Splits the survey, recognises both halves and compares. Errors: those of `recognise`.
pub fn repeatability<E>(
    survey: &Survey,
    catalog: &Catalog,
    mut recognise: impl FnMut(&Survey) -> Result<Vec<StatedBlock>, E>,
) -> Result<Repeatability, E> {
    let (split, index) = halves(survey);
    let first = recognise(&part(survey, &index[0]))?;
    let second = recognise(&part(survey, &index[1]))?;
    Ok(compare(split, index.map(|i| i.len()), &first, &second, catalog))
}

/// Indices of both halves, ascending. Points at one position stay together: copies agree with themselves.
pub fn halves(survey: &Survey) -> (Split, [Vec<u32>; 2]) {
    if let Some(index) = by_line(&survey.line, survey.cloud.len()) {
        return (Split::Lines, index);
    }
    let points = &survey.cloud.position_m;
    if points.is_empty() {
        return (Split::Points, [Vec::new(), Vec::new()]);
    }
    let bounds = Bounds::of(points.iter().copied());
    let size = bounds.size();
    let cell_m = CELL * (size.x * size.y / points.len() as f32).sqrt();
    let cell_m = if cell_m > 0.0 { cell_m } else { 1.0 };
    let key = |p: Vec3| ((p - bounds.min) / cell_m).to_array().map(|v| v as i32);
    let bits = |p: Vec3| p.to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_unstable_by_key(|&i| {
        let p = points[i as usize];
        (key(p), mixed(bits(p)), bits(p), i)
    });
    let mut index = [Vec::new(), Vec::new()];
    let mut turn = 0;
    for (n, &i) in order.iter().enumerate() {
        let same = n > 0 && bits(points[i as usize]) == bits(points[order[n - 1] as usize]);
        if !same {
            turn = 1 - turn;
        }
        index[turn].push(i);
    }
    index.iter_mut().for_each(|half| half.sort_unstable());
    (Split::Points, index)
}

/// Bits in an order that has nothing to do with the place: neighbours along an axis fall into both halves.
fn mixed(bits: [u32; 3]) -> u64 {
    bits.iter().fold(0x9e37_79b9_7f4a_7c15, |h: u64, &b| {
        (h ^ u64::from(b)).wrapping_mul(0xff51_afd7_ed55_8ccd).rotate_left(31)
    })
}

/// Every other line by number; `None` where lines are unknown or one of them is nearly everything.
fn by_line(line: &[u16], points: usize) -> Option<[Vec<u32>; 2]> {
    if line.len() != points || line.contains(&0) {
        return None;
    }
    let mut known: Vec<u16> = line.to_vec();
    known.sort_unstable();
    known.dedup();
    let mut index = [Vec::new(), Vec::new()];
    for (i, l) in line.iter().enumerate() {
        let rank = known.binary_search(l).expect("the list was made of these lines");
        index[rank % 2].push(i as u32);
    }
    let smaller = index[0].len().min(index[1].len()) as f32;
    (smaller >= LEAST_HALF * points as f32 && points > 0).then_some(index)
}

/// The survey of these points.
fn part(survey: &Survey, index: &[u32]) -> Survey {
    let select: Vec<usize> = index.iter().map(|&i| i as usize).collect();
    let line = if survey.line.is_empty() {
        Vec::new()
    } else {
        select.iter().map(|&i| survey.line[i]).collect()
    };
    Survey { cloud: survey.cloud.select(&select), line, ..survey.clone() }
}

/// Matches the nearest first, each block once, within the limits of a right pose.
fn compare(
    split: Split,
    points: [usize; 2],
    first: &[StatedBlock],
    second: &[StatedBlock],
    catalog: &Catalog,
) -> Repeatability {
    let mut pairs = Vec::new();
    for (i, a) in first.iter().enumerate() {
        for (j, b) in second.iter().enumerate() {
            let (p, q) = (a.placed.posed(catalog), b.placed.posed(catalog));
            let error = p.error(&q);
            if PoseLimits::right(q.model).hold(error) {
                pairs.push((error, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| {
        a.0.displacement_m.total_cmp(&b.0.displacement_m).then((a.1, a.2).cmp(&(b.1, b.2)))
    });
    let (mut met_first, mut met_second) = (vec![false; first.len()], vec![false; second.len()]);
    let (mut shift, mut turn, mut other_type, mut sure) = (Vec::new(), Vec::new(), 0, Vec::new());
    for (error, i, j) in pairs {
        if met_first[i] || met_second[j] {
            continue;
        }
        (met_first[i], met_second[j]) = (true, true);
        let centre =
            |b: &StatedBlock| b.placed.site_from_block * catalog.get(b.placed.model).centre;
        shift.push(centre(&second[j]) - centre(&first[i]));
        turn.push(error.rotation_rad);
        other_type += usize::from(first[i].placed.model != second[j].placed.model);
        sure.extend([first[i].confidence, second[j].confidence]);
    }
    let alone: Vec<f32> = first
        .iter()
        .zip(&met_first)
        .chain(second.iter().zip(&met_second))
        .filter(|(_, met)| !**met)
        .map(|(b, _)| b.confidence)
        .collect();
    let common = median_each(&shift);
    let mut about: Vec<f32> =
        shift.iter().map(|s| (*s - common.unwrap_or(Vec3::ZERO)).length()).collect();
    about.sort_by(f32::total_cmp);
    turn.sort_by(f32::total_cmp);
    let median = quantile(&about, 0.5);
    Repeatability {
        split,
        points,
        stated: [first.len(), second.len()],
        matched: shift.len(),
        other_type,
        common_shift_m: common.map(|c| c.to_array()),
        median_displacement_m: median,
        p95_displacement_m: quantile(&about, 0.95),
        median_turn_rad: quantile(&turn, 0.5),
        p95_turn_rad: quantile(&turn, 0.95),
        // The length of a vector of three even errors has its median at 1.54 of their standard deviation.
        place_sd_m: median.map(|m| m / 1.538 / 2.0_f32.sqrt()),
        confidence_matched: mean(&sure),
        confidence_alone: mean(&alone),
    }
}

fn quantile(ascending: &[f32], q: f32) -> Option<f32> {
    let last = ascending.len().checked_sub(1)?;
    Some(ascending[(q * last as f32).round() as usize])
}

fn mean(values: &[f32]) -> Option<f32> {
    (!values.is_empty()).then(|| values.iter().sum::<f32>() / values.len() as f32)
}

fn median_each(shift: &[Vec3]) -> Option<Vec3> {
    let axis = |k: usize| {
        let mut v: Vec<f32> = shift.iter().map(|s| s[k]).collect();
        v.sort_by(f32::total_cmp);
        quantile(&v, 0.5)
    };
    Some(Vec3::new(axis(0)?, axis(1)?, axis(2)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{PointCloud, Pose, Quat, TriMesh};
    use scene::{BlockModel, InstanceId, ModelId, SymmetryGroup};
    use std::convert::Infallible;

    fn catalog() -> Catalog {
        Catalog::new(vec![BlockModel {
            name: "c".into(),
            mesh: TriMesh::default(),
            parts: Vec::new(),
            parts_volume_ratio: 1.0,
            volume_m3: 1.0,
            density_kg_m3: 2300.0,
            centre: Vec3::ZERO,
            symmetry: SymmetryGroup::new(Vec3::ZERO, vec![Quat::IDENTITY]),
            d_max_m: 0.87,
            d_box_m: 1.0,
        }])
    }

    fn survey(points: usize) -> Survey {
        let position = (0..points)
            .map(|i| Vec3::new((i % 50) as f32 * 0.1, (i / 50) as f32 * 0.1, 0.01 * (i % 7) as f32))
            .collect();
        Survey { cloud: PointCloud::from_positions(position), ..Survey::default() }
    }

    fn block(at: Vec3, confidence: f32) -> StatedBlock {
        let placed = PlacedBlock {
            block: InstanceId(1),
            model: ModelId(0),
            site_from_block: Pose::from_parts(at, Quat::IDENTITY),
        };
        StatedBlock { placed, confidence }
    }

    #[test]
    fn halves_are_even_everywhere_and_copies_stay_together() {
        let mut survey = survey(5000);
        let again = survey.cloud.position_m.clone();
        survey.cloud.position_m.extend(again);
        let (split, [a, b]) = halves(&survey);
        assert_eq!(split, Split::Points);
        assert_eq!(a.len() + b.len(), 10_000);
        assert!(a.len().abs_diff(b.len()) < 100);
        let of_first: std::collections::BTreeSet<_> = a.iter().map(|i| i % 5000).collect();
        assert!(b.iter().all(|i| !of_first.contains(&(i % 5000))));
        let west = |half: &[u32]| {
            half.iter().filter(|&&i| survey.cloud.position_m[i as usize].x < 1.0).count() as f32
        };
        assert!((west(&a) / west(&b) - 1.0).abs() < 0.1);
    }

    #[test]
    fn lines_split_by_line_unless_one_is_everything() {
        let mut survey = survey(4000);
        survey.line = (0..4000).map(|i| 3 + (i / 1000) as u16).collect();
        let (split, [a, b]) = halves(&survey);
        assert_eq!((split, a.len(), b.len()), (Split::Lines, 2000, 2000));
        survey.line = (0..4000).map(|i| if i < 3900 { 1 } else { 2 }).collect();
        assert_eq!(halves(&survey).0, Split::Points);
    }

    #[test]
    fn agreement_shift_and_what_stands_alone_are_told() {
        let catalog = catalog();
        let mut call = 0;
        let found = repeatability(&survey(400), &catalog, |_| {
            call += 1;
            let off = if call == 1 { Vec3::ZERO } else { Vec3::new(0.02, 0.0, 0.0) };
            let mut blocks: Vec<StatedBlock> = (0..5)
                .map(|i| block(Vec3::X * 2.0 * i as f32 + off + Vec3::Y * 0.001 * i as f32, 0.99))
                .collect();
            if call == 2 {
                blocks.push(block(Vec3::Y * 8.0, 0.72));
            }
            Ok::<_, Infallible>(blocks)
        })
        .unwrap();
        assert_eq!((found.stated, found.matched, found.other_type), ([5, 6], 5, 0));
        assert!((found.common_shift_m.unwrap()[0] - 0.02).abs() < 1e-5);
        assert!(found.p95_displacement_m.unwrap() < 1e-4);
        assert!((found.confidence_alone.unwrap() - 0.72).abs() < 1e-6);
        assert!((found.agreement().unwrap() - 10.0 / 11.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_found_is_an_answer() {
        let found =
            repeatability(&survey(10), &catalog(), |_| Ok::<_, Infallible>(Vec::new())).unwrap();
        assert_eq!((found.matched, found.agreement(), found.median_turn_rad), (0, None, None));
    }
}
