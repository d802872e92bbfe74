//! Points that lie so far from all others that no grid should reach for them: birds, multipath, (0, 0, 0), −9999.
//!
//! Space is cut into cubes as large as the bulk of the cloud; cubes that touch belong together. What is not connected with
//! the largest part and is small, or stands at one single height like a no-data mark, is a stray.

use crate::DVec3;
use std::collections::HashMap;

/// A part with fewer points than this share of the cloud is small.
const SMALL: f64 = 0.01;
/// Points from which the size of the bulk is taken.
const SAMPLE: usize = 100_000;

/// Strays that lie together.
#[derive(Clone, Debug, PartialEq)]
pub struct StrayGroup {
    /// How many.
    pub count: usize,
    /// One of them.
    pub place: DVec3,
    /// Distance from the bulk's box, in the cloud's unit.
    pub away: f64,
}

/// What lies far from the bulk of a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strays {
    /// Indices of the strays, ascending.
    pub index: Vec<usize>,
    /// The same by place, nearest first.
    pub groups: Vec<StrayGroup>,
}

impl Strays {
    /// `3 points far from all others: 2 near (…), 1 near (…)`; at most four places are named.
    pub fn describe(&self) -> String {
        const NAMED: usize = 4;
        let group = |g: &StrayGroup| {
            let DVec3 { x, y, z } = g.place;
            format!("{} near ({x:.1}, {y:.1}, {z:.1})", g.count)
        };
        let mut places: Vec<String> = self.groups.iter().take(NAMED).map(group).collect();
        if self.groups.len() > NAMED {
            places.push(format!("… {} places more", self.groups.len() - NAMED));
        }
        let (n, are) = (self.index.len(), if self.index.len() == 1 { "point" } else { "points" });
        format!("{n} {are} far from all others: {}", places.join(", "))
    }
}

/// One connected part of the cloud.
struct Part {
    cubes: Vec<[i64; 3]>,
    count: usize,
    low: DVec3,
    high: DVec3,
}

struct Cube {
    count: usize,
    low: DVec3,
    high: DVec3,
    part: usize,
}

/// Finds the strays; none in a cloud of fewer than ten points, or without extent.
pub fn strays(points: &[DVec3]) -> Strays {
    let Some((edge, origin)) = bulk(points) else { return Strays::default() };
    let key = |p: DVec3| ((p - origin) / edge).floor().to_array().map(|v| v as i64);
    let mut cubes: HashMap<[i64; 3], Cube> = HashMap::new();
    for &p in points {
        let new = || Cube { count: 0, low: p, high: p, part: usize::MAX };
        let cube = cubes.entry(key(p)).or_insert_with(new);
        cube.count += 1;
        (cube.low, cube.high) = (cube.low.min(p), cube.high.max(p));
    }
    let parts = connected(&mut cubes);
    let Some(main) = (0..parts.len()).max_by_key(|&i| (parts[i].count, std::cmp::Reverse(i)))
    else {
        return Strays::default();
    };
    let is_stray = |part: &Part| {
        let small = (part.count as f64) < SMALL * points.len() as f64;
        let one_height =
            part.count >= 3 && part.low.z == part.high.z && 2 * part.count < points.len();
        small || one_height
    };
    let stray: Vec<bool> = (0..parts.len()).map(|i| i != main && is_stray(&parts[i])).collect();
    let mut out = Strays::default();
    if stray.iter().all(|s| !s) {
        return out;
    }
    out.index = (0..points.len()).filter(|&i| stray[cubes[&key(points[i])].part]).collect();
    out.groups = parts
        .iter()
        .zip(&stray)
        .filter(|(_, s)| **s)
        .map(|(part, _)| {
            let gap = (part.low - parts[main].high).max(parts[main].low - part.high);
            StrayGroup { count: part.count, place: part.low, away: gap.max(DVec3::ZERO).length() }
        })
        .collect();
    out.groups.sort_by(|a, b| a.away.total_cmp(&b.away));
    out
}

/// Edge of the cubes and a corner of the bulk, from quantiles of a sample.
fn bulk(points: &[DVec3]) -> Option<(f64, DVec3)> {
    if points.len() < 10 {
        return None;
    }
    let stride = points.len().div_ceil(SAMPLE);
    let axis = |k: usize| {
        let mut values: Vec<f64> = points.iter().step_by(stride).map(|p| p[k]).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        (at(0.1), at(0.9))
    };
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let spread = (x.1 - x.0).max(y.1 - y.0);
    let edge = if spread > 0.0 { spread } else { z.1 - z.0 };
    // A line or a single place has no size of its own.
    (edge > 0.0 && edge.is_finite()).then(|| (edge, DVec3::new(x.0, y.0, z.0)))
}

/// Parts of touching cubes, in an order that depends on the places alone.
fn connected(cubes: &mut HashMap<[i64; 3], Cube>) -> Vec<Part> {
    let mut keys: Vec<[i64; 3]> = cubes.keys().copied().collect();
    keys.sort_unstable();
    let mut parts = Vec::new();
    for start in keys {
        if cubes[&start].part != usize::MAX {
            continue;
        }
        let number = parts.len();
        let mut part =
            Part { cubes: vec![start], count: 0, low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        cubes.get_mut(&start).expect("the key is of this map").part = number;
        let mut next = 0;
        while next < part.cubes.len() {
            let [x, y, z] = part.cubes[next];
            next += 1;
            let cube = &cubes[&[x, y, z]];
            part.count += cube.count;
            (part.low, part.high) = (part.low.min(cube.low), part.high.max(cube.high));
            for step in 0..27_i64 {
                let (i, j, k) = (step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1);
                let near = [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)];
                if let Some(cube) = cubes.get_mut(&near).filter(|c| c.part == usize::MAX) {
                    cube.part = number;
                    part.cubes.push(near);
                }
            }
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pile(n: usize) -> Vec<DVec3> {
        let at = |i: usize| {
            let t = i as f64;
            DVec3::new(
                41_250.0 + (t * 0.37).sin() * 4.0,
                -98_760.0 + (t * 0.61).cos() * 4.0,
                2.0 + (t * 0.11).sin(),
            )
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn far_points_are_named_with_their_place() {
        for far in [
            DVec3::new(42_250.0, -98_760.0, 2.0),
            DVec3::new(41_250.0, -78_760.0, 2.0),
            DVec3::ZERO,
            DVec3::new(41_250.0, -98_760.0, -9999.0),
            DVec3::new(41_250.0, -98_760.0, 1e30),
        ] {
            let mut points = pile(3000);
            points.insert(1234, far);
            let found = strays(&points);
            assert_eq!(found.index, [1234], "{far}");
            assert_eq!(found.groups[0].place, far);
            assert!(found.describe().starts_with("1 point far"), "{}", found.describe());
        }
        assert!(strays(&pile(3000)).index.is_empty());
    }

    #[test]
    fn a_no_data_height_is_stray_however_common() {
        let mut points = pile(2000);
        (0..points.len()).step_by(4).for_each(|i| points[i].z = -9999.0);
        assert_eq!(strays(&points).index.len(), 500);
    }

    #[test]
    fn what_is_connected_or_large_stays() {
        // A breakwater of 300 m with a pile at its end, and a second pile 2 km away with a tenth of the points.
        let mut points = pile(4000);
        points.extend((0..300).map(|i| DVec3::new(41_250.0 + f64::from(i), -98_760.0, 1.0)));
        points.extend(pile(450).iter().map(|p| *p + DVec3::new(0.0, 2000.0, 0.0)));
        assert!(strays(&points).index.is_empty());
        // Noise a few metres above the pile is no stray.
        points.push(DVec3::new(41_250.0, -98_760.0, 9.0));
        assert!(strays(&points).index.is_empty());
    }

    #[test]
    fn clouds_without_extent_have_none() {
        assert!(strays(&[DVec3::ONE; 50]).index.is_empty());
        assert!(strays(&pile(5)).index.is_empty());
    }
}
