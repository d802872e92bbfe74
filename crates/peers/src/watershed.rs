//! Instances of a depth image by watershed: a stand-in for SD-Mask, named as one.
//!
//! SD-Mask (Danielczuk et al., ICRA 2019) is a Mask R-CNN trained on depth images for masks of no class. What stands here in
//! its place needs no training: the image as the sensor above sees it, outlines where the depth steps, the distance of every
//! pixel from the next outline, and a watershed of that distance in which shallow basins join their neighbours.

use crate::grouping::Group;
use geom::{Bounds, Vec3};

/// Settings, lengths in d_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WatershedConfig {
    /// Edge of a pixel.
    pub pixel: f32,
    /// Step of depth between neighbouring pixels that is an outline.
    pub step: f32,
    /// How much deeper than its border a basin must be to stay, in pixels.
    pub depth_px: f32,
    /// Fewest points of an instance.
    pub least_points: usize,
}

impl Default for WatershedConfig {
    fn default() -> Self {
        Self { pixel: 0.06, step: 0.08, depth_px: 1.5, least_points: 20 }
    }
}

/// Groups among points seen from above, d_max; largest basin first.
pub fn watershed(position: &[Vec3], config: &WatershedConfig) -> Vec<Group> {
    let bounds = Bounds::of(position.iter().copied());
    if position.is_empty() || !bounds.size().is_finite() {
        return Vec::new();
    }
    let size = (bounds.size() / config.pixel).floor();
    let (columns, rows) = (size.x as usize + 3, size.y as usize + 3);
    if columns.saturating_mul(rows) > 1 << 26 {
        return Vec::new();
    }
    // A frame of empty pixels around the image.
    let cell = |p: &Vec3| {
        let at = (*p - bounds.min) / config.pixel;
        (at.y as usize + 1) * columns + at.x as usize + 1
    };
    let mut top = vec![f32::NEG_INFINITY; columns * rows];
    for p in position {
        let t = &mut top[cell(p)];
        *t = t.max(p.z);
    }
    close_gaps(&mut top, columns);
    let distance = to_outline(&top, columns, config.step);
    let basin = basins(&distance, columns, config.depth_px);
    let mut groups: Vec<Group> = Vec::new();
    let mut number = std::collections::BTreeMap::new();
    for (i, p) in position.iter().enumerate() {
        let at = cell(p);
        // What lies below the surface that is seen belongs to something else.
        if let Some(b) = basin[at]
            && top[at] - p.z <= config.step
        {
            let g = *number.entry(b).or_insert_with(|| {
                groups.push(Group { score: 1.0, ..Group::default() });
                groups.len() - 1
            });
            groups[g].points.push(i as u32);
        }
    }
    groups.retain(|g| g.points.len() >= config.least_points);
    groups.sort_by_key(|g| std::cmp::Reverse(g.points.len()));
    let largest = groups.first().map_or(1, |g| g.points.len()) as f32;
    for g in &mut groups {
        g.score = g.points.len() as f32 / largest;
    }
    groups
}

/// A pixel without depth between pixels with depth takes their mean.
fn close_gaps(top: &mut [f32], columns: usize) {
    let before = top.to_vec();
    for at in columns + 1..top.len() - columns - 1 {
        if before[at].is_finite() {
            continue;
        }
        let around = [at - 1, at + 1, at - columns, at + columns].map(|i| before[i]);
        let known: Vec<f32> = around.into_iter().filter(|z| z.is_finite()).collect();
        if known.len() >= 3 {
            top[at] = known.iter().sum::<f32>() / known.len() as f32;
        }
    }
}

/// Distance of each pixel from the next outline or hole, pixels (chamfer 3-4, over 3).
fn to_outline(top: &[f32], columns: usize, step: f32) -> Vec<f32> {
    let is_outline = |at: usize| {
        let z = top[at];
        let inner = at > columns && at + columns + 1 < top.len();
        !z.is_finite()
            || !inner
            || [at - 1, at + 1, at - columns, at + columns]
                .into_iter()
                .any(|n| !top[n].is_finite() || top[n] - z > step)
    };
    let mut d: Vec<f32> = (0..top.len()).map(|at| if is_outline(at) { 0.0 } else { 1e9 }).collect();
    let inner = columns + 1..top.len() - columns - 1;
    for at in inner.clone() {
        let near = (d[at - 1].min(d[at - columns]) + 1.0)
            .min(d[at - columns - 1].min(d[at - columns + 1]) + 4.0 / 3.0);
        d[at] = d[at].min(near);
    }
    for at in inner.rev() {
        let near = (d[at + 1].min(d[at + columns]) + 1.0)
            .min(d[at + columns + 1].min(d[at + columns - 1]) + 4.0 / 3.0);
        d[at] = d[at].min(near);
    }
    for (d, z) in d.iter_mut().zip(top) {
        if !z.is_finite() {
            *d = -1.0;
        }
    }
    d
}

/// Basins of the distance, deepest pixel first; where two meet, one less than `least` deeper than the pass joins the other.
fn basins(distance: &[f32], columns: usize, least: f32) -> Vec<Option<usize>> {
    let mut order: Vec<usize> = (0..distance.len()).filter(|&i| distance[i] >= 0.0).collect();
    order.sort_by(|&a, &b| distance[b].total_cmp(&distance[a]).then(a.cmp(&b)));
    let mut label: Vec<Option<usize>> = vec![None; distance.len()];
    let mut parent: Vec<usize> = Vec::new();
    let mut deepest: Vec<f32> = Vec::new();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for at in order {
        let around = [at.wrapping_sub(1), at + 1, at.wrapping_sub(columns), at + columns];
        let mut near: Vec<usize> = around
            .into_iter()
            .filter_map(|n| label.get(n).copied().flatten())
            .map(|l| root(&mut parent, l))
            .collect();
        near.sort_by(|&a, &b| deepest[b].total_cmp(&deepest[a]).then(a.cmp(&b)));
        near.dedup();
        match near.first() {
            None => {
                label[at] = Some(parent.len());
                parent.push(parent.len());
                deepest.push(distance[at]);
            }
            Some(&best) => {
                label[at] = Some(best);
                for &other in &near[1..] {
                    if deepest[other] - distance[at] < least {
                        parent[other] = best;
                    }
                }
            }
        }
    }
    label.into_iter().map(|l| l.map(|l| root(&mut parent, l))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flat squares of 1 d_max at heights, their corners given.
    fn plates(at: &[(f32, f32, f32)]) -> Vec<Vec3> {
        at.iter()
            .flat_map(|&(x, y, z)| {
                (0..625).map(move |i| {
                    Vec3::new(x + (i % 25) as f32 * 0.04, y + (i / 25) as f32 * 0.04, z)
                })
            })
            .collect()
    }

    #[test]
    fn plates_apart_or_one_above_the_other_are_told_apart() {
        let points = plates(&[(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (0.0, 1.0, 0.4)]);
        let groups = watershed(&points, &WatershedConfig::default());
        assert_eq!(groups.len(), 3);
        // The rim of the plate below may go to the one above; nine points of ten are of one plate, each plate once.
        let mut plates: Vec<u32> = groups
            .iter()
            .map(|g| {
                let of = |k: u32| g.points.iter().filter(|p| **p / 625 == k).count();
                let most = (0..3).max_by_key(|k| of(*k)).unwrap();
                assert!(of(most) * 10 > g.points.len() * 9);
                most
            })
            .collect();
        plates.sort_unstable();
        assert_eq!(plates, [0, 1, 2]);
    }

    #[test]
    fn nothing_and_a_stray_are_nothing() {
        assert!(watershed(&[], &WatershedConfig::default()).is_empty());
        let far = [Vec3::ZERO, Vec3::splat(1e7)];
        assert!(watershed(&far, &WatershedConfig::default()).is_empty());
    }
}
