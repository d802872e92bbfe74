//! The survey in an order that its points alone decide.
//!
//! Means, samples and ties depend on the order in which points, hypotheses and types come. A survey whose files are
//! named in another order, or whose points were shuffled by an editor, is the same survey: here it becomes the same
//! input. In: a survey and its segmentation. Out: both sorted along a space-filling curve, and the way back.

use geom::{Bounds, PointCloud, Vec3};
use rayon::prelude::*;
use scene::{CentreHypothesis, Segmentation, Survey};

/// A survey and its segmentation in their own order.
pub struct Canonical {
    /// The survey, points along a Morton curve.
    pub survey: Survey,
    /// The segmentation: hypotheses by their places, segments first.
    pub segmentation: Segmentation,
    /// Index in the given survey of each point here.
    given: Vec<u32>,
}

impl Canonical {
    /// Sorts. The segmentation must name points of the survey only.
    pub fn new(survey: &Survey, segmentation: &Segmentation) -> Self {
        let position = &survey.cloud.position_m;
        let line = |i: u32| survey.line.get(i as usize).copied().unwrap_or(0);
        let bounds = Bounds::of(position.iter().copied());
        let mut keyed: Vec<(u64, u32)> = (0..position.len() as u32)
            .into_par_iter()
            .map(|i| (morton(position[i as usize], &bounds), i))
            .collect();
        keyed.par_sort_unstable_by(|a, b| {
            let (p, q) = (position[a.1 as usize], position[b.1 as usize]);
            a.0.cmp(&b.0)
                .then(p.x.total_cmp(&q.x))
                .then(p.y.total_cmp(&q.y))
                .then(p.z.total_cmp(&q.z))
                .then(line(a.1).cmp(&line(b.1)))
                .then(a.1.cmp(&b.1))
        });
        let given: Vec<u32> = keyed.into_iter().map(|k| k.1).collect();
        let select: Vec<usize> = given.iter().map(|&i| i as usize).collect();
        let cloud: PointCloud = survey.cloud.select(&select);
        let line = if survey.line.len() == position.len() {
            let line: Vec<u32> = select.iter().map(|&i| u32::from(survey.line[i])).collect();
            renumbered(&line).into_iter().map(|l| l as u16).collect()
        } else {
            Vec::new()
        };
        let segmentation = sorted(segmentation, &given);
        let mut sensor_positions = survey.sensor_positions.clone();
        sensor_positions.sort_by(by_place);
        let survey = Survey { cloud, line, sensor_positions, ..survey.clone() };
        Self { survey, segmentation, given }
    }

    /// Points of the given survey, ascending, from points of this one.
    pub fn given(&self, points: &mut [u32]) {
        points.iter_mut().for_each(|p| *p = self.given[*p as usize]);
        points.sort_unstable();
    }
}

fn by_place(a: &Vec3, b: &Vec3) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

/// Place along a curve through 2²¹ cells an axis: neighbours in space are neighbours in memory.
fn morton(p: Vec3, bounds: &Bounds) -> u64 {
    const CELLS: f32 = 2_097_151.0;
    let edge = bounds.size().max_element().max(f32::MIN_POSITIVE);
    let cell = ((p - bounds.min) / edge * CELLS).to_array().map(|v| spread_bits(v as u64));
    cell[0] | cell[1] << 1 | cell[2] << 2
}

/// Two zeros between any two of the lowest 21 bits.
fn spread_bits(v: u64) -> u64 {
    let mut v = v & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        v = (v | v << shift) & mask;
    }
    v
}

/// Numbers from 1 in the order of first appearance; 0 stays 0.
fn renumbered(labels: &[u32]) -> Vec<u32> {
    let most = labels.iter().copied().max().unwrap_or(0) as usize;
    let mut number = vec![0_u32; most + 1];
    let mut next = 0;
    labels
        .iter()
        .map(|&l| {
            if l > 0 && number[l as usize] == 0 {
                next += 1;
                number[l as usize] = next;
            }
            number[l as usize]
        })
        .collect()
}

fn sorted(segmentation: &Segmentation, given: &[u32]) -> Segmentation {
    let mut here = vec![0_u32; given.len()];
    for (i, &g) in given.iter().enumerate() {
        here[g as usize] = i as u32;
    }
    let mut hypotheses: Vec<(bool, CentreHypothesis)> = segmentation
        .hypotheses
        .iter()
        .enumerate()
        .map(|(n, h)| {
            let mut points: Vec<u32> = h.points.iter().map(|&p| here[p as usize]).collect();
            points.sort_unstable();
            (n >= segmentation.instances, CentreHypothesis { points, ..h.clone() })
        })
        .collect();
    hypotheses.sort_by(|a, b| {
        let place = by_place(&a.1.centre, &b.1.centre);
        a.0.cmp(&b.0).then(place).then_with(|| a.1.points.cmp(&b.1.points))
    });
    let confidence = |&g: &u32| segmentation.confidence.get(g as usize).copied().unwrap_or(0.0);
    // Labels that are not a dense numbering of the points' instances are left to the caller's check.
    let dense = segmentation.instance.iter().all(|&l| l as usize <= segmentation.instance.len());
    let label: Vec<u32> = given.iter().map(|&g| segmentation.instance[g as usize]).collect();
    Segmentation {
        instance: if dense { renumbered(&label) } else { label },
        confidence: given.iter().map(confidence).collect(),
        hypotheses: hypotheses.into_iter().map(|h| h.1).collect(),
        instances: segmentation.instances,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Any order of points, lines and hypotheses is the same survey.
        #[test]
        fn an_order_of_its_own(
            points in prop::collection::vec(prop::array::uniform3(-5.0_f32..5.0), 2..60),
            seed in any::<u64>(),
        ) {
            let n = points.len();
            let position: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
            let mut order: Vec<usize> = (0..n).collect();
            order.sort_by_key(|&i| (i as u64 ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let survey = |order: &[usize]| Survey {
                cloud: PointCloud::from_positions(order.iter().map(|&i| position[i]).collect()),
                line: order.iter().map(|&i| (i % 3) as u16).collect(),
                ..Default::default()
            };
            let segmentation = |order: &[usize]| {
                let place = |i: usize| order.iter().position(|&o| o == i).unwrap() as u32;
                let mut hypotheses: Vec<CentreHypothesis> = (0..n / 2)
                    .map(|k| CentreHypothesis { centre: position[k], score: 1.0, points: vec![place(k), place(n - 1 - k)] })
                    .collect();
                if order[0] != 0 {
                    hypotheses.reverse();
                }
                Segmentation {
                    instance: order.iter().map(|&i| (i % 4) as u32).collect(),
                    confidence: vec![1.0; n],
                    hypotheses,
                    instances: 0,
                }
            };
            let plain: Vec<usize> = (0..n).collect();
            let a = Canonical::new(&survey(&plain), &segmentation(&plain));
            let b = Canonical::new(&survey(&order), &segmentation(&order));
            prop_assert_eq!(&a.survey.cloud.position_m, &b.survey.cloud.position_m);
            prop_assert_eq!(&a.survey.line, &b.survey.line);
            prop_assert_eq!(&a.segmentation, &b.segmentation);
            let mut all: Vec<u32> = (0..n as u32).collect();
            b.given(&mut all);
            prop_assert_eq!(all, (0..n as u32).collect::<Vec<_>>());
        }
    }
}
