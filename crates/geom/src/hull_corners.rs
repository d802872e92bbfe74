//! Corners of a convex hull in f64: quickhull, for point sets whose relief f32 cannot hold.
//!
//! parry's hull is f32 and rescales its input; of the flat bowls of [`crate::hidden_points`] it keeps a handful.

use glamx::DVec3;
use std::collections::HashMap;

struct Facet {
    corners: [usize; 3],
    normal: DVec3,
    offset: f64,
    /// Facet beyond the edge from corner i to corner i + 1.
    beyond: [usize; 3],
    /// Points in front, each kept by one facet only.
    outside: Vec<usize>,
    alive: bool,
}

/// A point this far in front of a facet, in coordinates of order 1, is outside the hull.
const EPSILON: f64 = 1e-13;

/// Indices of the points that are corners of the hull, ascending; `None` when all points lie in one plane.
pub fn hull_corners(points: &[DVec3]) -> Option<Vec<usize>> {
    let mut facets = first_tetrahedron(points)?;
    let mut waiting: Vec<usize> = (0..facets.len()).collect();
    while let Some(f) = waiting.pop() {
        if !facets[f].alive || facets[f].outside.is_empty() {
            continue;
        }
        let height = |p: usize| facets[f].normal.dot(points[p]) - facets[f].offset;
        let tip =
            facets[f].outside.iter().copied().max_by(|a, b| height(*a).total_cmp(&height(*b)))?;
        let (seen, horizon) = seen_from(&facets, f, points[tip]);
        let mut loose = Vec::new();
        for &s in &seen {
            facets[s].alive = false;
            loose.append(&mut facets[s].outside);
        }
        let first = facets.len();
        let mut starting: HashMap<usize, usize> = HashMap::with_capacity(horizon.len());
        for (k, &(a, b, neighbour, edge)) in horizon.iter().enumerate() {
            let mut facet = Facet::new(points, [a, b, tip]);
            facet.beyond[0] = neighbour;
            facets[neighbour].beyond[edge] = first + k;
            facets.push(facet);
            starting.insert(a, first + k);
        }
        for (k, &(_, b, ..)) in horizon.iter().enumerate() {
            let next = *starting.get(&b)?;
            facets[first + k].beyond[1] = next;
            facets[next].beyond[2] = first + k;
        }
        let last = facets.len();
        share(points, loose.into_iter().filter(|&p| p != tip), &mut facets[first..last]);
        waiting.extend(first..last);
    }
    let mut corners: Vec<usize> =
        facets.iter().filter(|f| f.alive).flat_map(|f| f.corners).collect();
    corners.sort_unstable();
    corners.dedup();
    Some(corners)
}

impl Facet {
    fn new(points: &[DVec3], corners: [usize; 3]) -> Self {
        let [a, b, c] = corners.map(|i| points[i]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Self {
            corners,
            normal,
            offset: normal.dot(a),
            beyond: [usize::MAX; 3],
            outside: Vec::new(),
            alive: true,
        }
    }

    fn sees(&self, p: DVec3) -> bool {
        self.normal.dot(p) - self.offset > EPSILON
    }
}

/// Gives every point to the first facet it is in front of; the rest is inside the hull.
fn share(points: &[DVec3], loose: impl Iterator<Item = usize>, facets: &mut [Facet]) {
    for p in loose {
        if let Some(facet) = facets.iter_mut().find(|f| f.sees(points[p])) {
            facet.outside.push(p);
        }
    }
}

/// An edge of the horizon: its corners and the facet (with its edge) that stays beyond it.
type HorizonEdge = (usize, usize, usize, usize);

/// Facets that a point sees, starting at one of them, and the edges around them.
fn seen_from(facets: &[Facet], start: usize, p: DVec3) -> (Vec<usize>, Vec<HorizonEdge>) {
    let (mut seen, mut horizon) = (vec![start], Vec::new());
    let mut known: HashMap<usize, bool> = HashMap::from([(start, true)]);
    let mut next = 0;
    while next < seen.len() {
        let f = seen[next];
        next += 1;
        for edge in 0..3 {
            let g = facets[f].beyond[edge];
            let new = !known.contains_key(&g);
            let visible = *known.entry(g).or_insert_with(|| facets[g].sees(p));
            let (a, b) = (facets[f].corners[edge], facets[f].corners[(edge + 1) % 3]);
            if !visible {
                let back = facets[g].beyond.iter().position(|&h| h == f).unwrap_or(0);
                horizon.push((a, b, g, back));
            } else if new {
                seen.push(g);
            }
        }
    }
    (seen, horizon)
}

fn first_tetrahedron(points: &[DVec3]) -> Option<Vec<Facet>> {
    let farthest = |value: &dyn Fn(DVec3) -> f64| {
        let best =
            (0..points.len()).max_by(|&a, &b| value(points[a]).total_cmp(&value(points[b])))?;
        (value(points[best]) > EPSILON).then_some(best)
    };
    let a = (0..points.len()).min_by(|&i, &j| points[i].x.total_cmp(&points[j].x))?;
    let b = farthest(&|p| p.distance(points[a]))?;
    let line = (points[b] - points[a]).normalize_or_zero();
    let c = farthest(&|p| (p - points[a]).cross(line).length())?;
    let normal = (points[b] - points[a]).cross(points[c] - points[a]).normalize_or_zero();
    let d = farthest(&|p| normal.dot(p - points[a]).abs())?;
    // Outward corners: d must lie behind the first facet.
    let (b, c) = if normal.dot(points[d] - points[a]) > 0.0 { (c, b) } else { (b, c) };
    let mut facets: Vec<Facet> = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]]
        .map(|corners| Facet::new(points, corners))
        .into();
    for f in 0..4 {
        for edge in 0..3 {
            let (from, to) = (facets[f].corners[edge], facets[f].corners[(edge + 1) % 3]);
            let beyond = (0..4).find(|&g| {
                g != f
                    && (0..3).any(|e| {
                        facets[g].corners[e] == to && facets[g].corners[(e + 1) % 3] == from
                    })
            })?;
            facets[f].beyond[edge] = beyond;
        }
    }
    share(points, (0..points.len()).filter(|p| ![a, b, c, d].contains(p)), &mut facets);
    Some(facets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeedTree;
    use rand::RngExt;

    #[test]
    fn a_filled_cube_has_eight_corners() {
        let mut rng = SeedTree::new(1).rng();
        let mut points: Vec<DVec3> = (0..2000)
            .map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(0.01..0.99))))
            .collect();
        points.extend(
            (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))),
        );
        assert_eq!(hull_corners(&points), Some((2000..2008).collect()));
    }

    #[test]
    fn every_point_of_a_sphere_is_a_corner_and_a_plane_has_none() {
        let mut rng = SeedTree::new(2).rng();
        let sphere: Vec<DVec3> = (0..5000)
            .map(|_| {
                DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0_f64)))
                    .normalize_or(DVec3::X)
            })
            .collect();
        assert_eq!(hull_corners(&sphere).map(|c| c.len()), Some(5000));
        let plane: Vec<DVec3> = sphere.iter().map(|p| DVec3::new(p.x, p.y, 0.5)).collect();
        assert_eq!(hull_corners(&plane), None);
    }
}
