//! Clouds that are grids: one height a cell, as echo sounders' and photogrammetry's terrain models are delivered.
//!
//! In: positions. Out: the lattice they lie on (cell, direction, how a cell's height was made), or nothing; and the grid
//! turned back into points of a surface. A cell's height is not a measurement at the cell's middle: the highest of a cell
//! on a slope lies at its uphill corner, the mean of a cell across an edge on no surface at all.

use crate::{Vec2, Vec3};
use std::collections::BTreeMap;

/// How the height of a cell was made of the points in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellRule {
    /// Their mean: heights across an edge lie between both sides.
    Mean,
    /// The highest: edges stay sharp, and slopes are lifted.
    Highest,
}

/// A lattice in plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Edge of a cell, metres.
    pub cell_m: f32,
    /// Angle of its rows from +x, radians, in [0, π/2).
    pub turn_rad: f32,
    /// One of its nodes.
    pub node: Vec2,
    /// How heights were made; `None` where too few edges tell.
    pub rule: Option<CellRule>,
}

/// A point of the surface behind a cell's height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where the surface is.
    pub position: Vec3,
    /// How far it may be off, metres, beside the sensor's own noise.
    pub error_m: f32,
    /// On the surface; otherwise across an edge, where a cell's height says nothing.
    pub holds: bool,
}

/// Fewest points of a grid.
const FEWEST: usize = 60;
/// Points whose nearest neighbours show the lattice.
const ASKED: usize = 400;
/// How far nodes may be off, in cells.
const OFF: f32 = 0.04;
/// Share of the points that lie on the nodes of a lattice, one a node.
const ON_NODES: f32 = 0.98;
/// A step in height is an edge from this many cells on.
const EDGE: f32 = 1.5;
/// Edges that tell the rule.
const FEWEST_EDGES: usize = 40;
/// Share of heights in the lower middle of edges from which the rule is the mean: 0.27 to 0.35 there for means of cells of
/// 10 to 25 cm over tetrapods of 2 m, 0.06 to 0.08 for the highest.
const BETWEEN: f32 = 0.16;

impl Lattice {
    /// The lattice of a cloud; `None` for points that are no grid.
    pub fn of(points: &[Vec3]) -> Option<Self> {
        if points.len() < FEWEST {
            return None;
        }
        let plan: Vec<Vec2> = points.iter().map(|p| p.truncate()).collect();
        let step = nearest_steps(&plan);
        let mut length: Vec<f32> = step.iter().map(|s| s.length()).collect();
        length.sort_by(f32::total_cmp);
        let rough_m = length[length.len() / 2];
        if !(rough_m > 0.0) {
            return None;
        }
        let even = step.iter().filter(|s| (s.length() / rough_m - 1.0).abs() < OFF).count();
        if (even as f32) < 0.7 * step.len() as f32 {
            return None;
        }
        let turn_rad = common_turn(&step, rough_m);
        let mut lattice = Self { cell_m: rough_m, turn_rad, node: plan[0], rule: None };
        lattice.refine(&plan);
        let mut nodes: Vec<[i64; 2]> = Vec::with_capacity(plan.len());
        for &p in &plan {
            let at = lattice.along(p);
            let near = [at.x.round(), at.y.round()];
            if (at.x - near[0]).abs().max((at.y - near[1]).abs()) < 0.1 {
                nodes.push(near.map(|v| v as i64));
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
        if (nodes.len() as f32) < ON_NODES * points.len() as f32 {
            return None;
        }
        lattice.rule = lattice.rule_of(points);
        Some(lattice)
    }

    /// Plan position in cells from the node, along the rows and across them.
    fn along(&self, p: Vec2) -> Vec2 {
        let (sin, cos) = self.turn_rad.sin_cos();
        let d = (p - self.node) / self.cell_m;
        Vec2::new(cos * d.x + sin * d.y, cos * d.y - sin * d.x)
    }

    /// A direction along rows and columns, in plan.
    fn out(&self, v: Vec2) -> Vec2 {
        let (sin, cos) = self.turn_rad.sin_cos();
        Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
    }

    /// Cell and node from all points: a line through the positions of the nodes, axis by axis, in growing circles so that
    /// the count of nodes from the first is never in doubt.
    fn refine(&mut self, plan: &[Vec2]) {
        let middle = plan.iter().copied().sum::<Vec2>() / plan.len() as f32;
        let first = plan.iter().copied().min_by(|a, b| {
            (*a - middle).length_squared().total_cmp(&(*b - middle).length_squared())
        });
        self.node = first.unwrap_or(self.node);
        let mut reach = 6.0_f32;
        let farthest = plan.iter().map(|p| self.along(*p).length()).fold(0.0, f32::max);
        loop {
            self.fit(plan, reach);
            if reach > farthest {
                break;
            }
            reach *= 2.0;
        }
    }

    /// Least squares of `p = node + R (cell · k)` over the nodes `k` within `reach` cells.
    fn fit(&mut self, plan: &[Vec2], reach: f32) {
        // Complex numbers: p = node + z k with z = cell · e^(i turn).
        let (mut n, mut sp, mut sk) = (0.0_f64, [0.0_f64; 2], [0.0_f64; 2]);
        let (mut kk, mut kp) = (0.0_f64, [0.0_f64; 2]);
        for &p in plan {
            let at = self.along(p);
            if at.length() > reach {
                continue;
            }
            let k = [f64::from(at.x.round()), f64::from(at.y.round())];
            let q = [f64::from(p.x - self.node.x), f64::from(p.y - self.node.y)];
            n += 1.0;
            for axis in 0..2 {
                sp[axis] += q[axis];
                sk[axis] += k[axis];
            }
            kk += k[0] * k[0] + k[1] * k[1];
            // conj(k) · q
            kp[0] += k[0] * q[0] + k[1] * q[1];
            kp[1] += k[0] * q[1] - k[1] * q[0];
        }
        let spread = kk - (sk[0] * sk[0] + sk[1] * sk[1]) / n;
        if n < 8.0 || spread <= 0.0 {
            return;
        }
        let z = [
            (kp[0] - (sk[0] * sp[0] + sk[1] * sp[1]) / n) / spread,
            (kp[1] - (sk[0] * sp[1] - sk[1] * sp[0]) / n) / spread,
        ];
        let offset = [
            (sp[0] - (z[0] * sk[0] - z[1] * sk[1])) / n,
            (sp[1] - (z[0] * sk[1] + z[1] * sk[0])) / n,
        ];
        self.node += Vec2::new(offset[0] as f32, offset[1] as f32);
        self.cell_m = z[0].hypot(z[1]) as f32;
        self.turn_rad = z[1].atan2(z[0]) as f32;
    }

    /// Heights by node.
    fn heights(&self, points: &[Vec3]) -> BTreeMap<[i32; 2], f32> {
        points.iter().map(|&p| (self.key(p), p.z)).collect()
    }

    fn key(&self, p: Vec3) -> [i32; 2] {
        let at = self.along(p.truncate());
        [at.x.round() as i32, at.y.round() as i32]
    }

    /// From the cells across edges: the highest of such a cell lies near the upper side, or it is all lower side; a mean may
    /// lie anywhere between.
    fn rule_of(&self, points: &[Vec3]) -> Option<CellRule> {
        let height = self.heights(points);
        let (mut edges, mut between) = (0, 0);
        for (&[i, j], &z) in &height {
            for step in [[1, 0], [0, 1]] {
                let at = |k: i32| height.get(&[i + k * step[0], j + k * step[1]]).copied();
                let (Some(a), Some(b), Some(before), Some(after)) = (at(-1), at(1), at(-2), at(2))
                else {
                    continue;
                };
                let rise = b - a;
                let flat = (a - before).abs().max((after - b).abs()) < 0.35 * rise.abs();
                if rise.abs() > EDGE * self.cell_m && flat {
                    let low = a.min(b);
                    edges += 1;
                    between += usize::from((0.2..0.5).contains(&((z - low) / rise.abs())));
                }
            }
        }
        let rule = if between as f32 > BETWEEN * edges as f32 {
            CellRule::Mean
        } else {
            CellRule::Highest
        };
        (edges >= FEWEST_EDGES).then_some(rule)
    }

    /// The surface behind the heights, point by point. Slopes come from the neighbouring cells on the side where the surface
    /// goes on evenly; cells whose neighbours on both sides are far off hold nothing.
    pub fn surface(&self, points: &[Vec3]) -> Vec<SurfacePoint> {
        let height = self.heights(points);
        points
            .iter()
            .map(|&p| {
                let [i, j] = self.key(p);
                let along = |step: [i32; 2]| {
                    let at = |k: i32| height.get(&[i + k * step[0], j + k * step[1]]).copied();
                    slope(p.z, at(-1), at(1), self.cell_m)
                };
                let (x, y) = (along([1, 0]), along([0, 1]));
                let steep = x.rise.abs() + y.rise.abs();
                let holds = x.even && y.even;
                // A highest point lies uphill of the middle; half a cell in each direction where the surface is a plane.
                let (position, error_m) = match self.rule {
                    Some(CellRule::Highest) => {
                        let toward = Vec2::new(signed(x.rise), signed(y.rise)) * 0.5 * self.cell_m;
                        (p + self.out(toward).extend(0.0), 0.15 * self.cell_m * steep)
                    }
                    Some(CellRule::Mean) => (p, 0.12 * self.cell_m * steep),
                    None => (p, 0.3 * self.cell_m * steep),
                };
                let bend = (x.bend.abs() + y.bend.abs()) * 0.25;
                SurfacePoint {
                    position,
                    error_m: error_m.min(self.cell_m) + bend.min(self.cell_m),
                    holds,
                }
            })
            .collect()
    }
}

/// −1, 0 or 1, softly: a slope within the noise of heights has no uphill side.
fn signed(rise: f32) -> f32 {
    (rise / 0.15).clamp(-1.0, 1.0)
}

/// The surface along one axis.
struct Slope {
    /// Rise over run.
    rise: f32,
    /// Second difference, metres.
    bend: f32,
    even: bool,
}

/// The steepness on the smoother side; uneven where both sides step by more than an edge.
fn slope(z: f32, before: Option<f32>, after: Option<f32>, cell_m: f32) -> Slope {
    let edge = EDGE * cell_m;
    match (before.map(|b| z - b), after.map(|a| a - z)) {
        (Some(b), Some(a)) if b.abs() < edge && a.abs() < edge => {
            Slope { rise: 0.5 * (a + b) / cell_m, bend: a - b, even: true }
        }
        (b, a) => {
            let b = b.filter(|v| v.abs() < edge);
            let a = a.filter(|v| v.abs() < edge);
            match b.or(a) {
                Some(rise) => Slope { rise: rise / cell_m, bend: 0.0, even: true },
                None => Slope { rise: 0.0, bend: 0.0, even: false },
            }
        }
    }
}

/// From each of a few points to its nearest neighbour in plan.
fn nearest_steps(plan: &[Vec2]) -> Vec<Vec2> {
    let flat: Vec<Vec3> = plan.iter().map(|p| p.extend(0.0)).collect();
    let table = crate::knn(&flat, 2);
    let stride = plan.len().div_ceil(ASKED).max(1);
    (0..plan.len())
        .step_by(stride)
        .map(|i| {
            let other = table.row(i).iter().find(|&&k| k as usize != i).copied();
            plan[other.map_or(i, |k| k as usize)] - plan[i]
        })
        .collect()
}

/// The direction that the steps share up to quarter turns.
fn common_turn(step: &[Vec2], cell_m: f32) -> f32 {
    let (mut sin, mut cos) = (0.0, 0.0);
    for s in step.iter().filter(|s| (s.length() / cell_m - 1.0).abs() < OFF) {
        let (a, b) = (4.0 * s.y.atan2(s.x)).sin_cos();
        sin += a;
        cos += b;
    }
    sin.atan2(cos) / 4.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeedTree;
    use rand::RngExt;

    /// Two levels with a sloping part, 400 points a square metre, gridded by the rule.
    fn gridded(cell_m: f32, rule: CellRule, turn_rad: f32) -> Vec<Vec3> {
        let mut rng = SeedTree::new(7).rng();
        let mut cells: BTreeMap<[i32; 2], Vec<f32>> = BTreeMap::new();
        for _ in 0..80_000 {
            let p = Vec2::new(rng.random::<f32>() * 14.0, rng.random::<f32>() * 14.0);
            let step = if (p.x / 2.37) as i32 % 2 == 0 { 1.3 } else { 0.0 };
            let z = step + 0.5 * p.y;
            cells.entry([(p.x / cell_m) as i32, (p.y / cell_m) as i32]).or_default().push(z);
        }
        let (sin, cos) = turn_rad.sin_cos();
        cells
            .into_iter()
            .map(|([i, j], z)| {
                let height = match rule {
                    CellRule::Mean => z.iter().sum::<f32>() / z.len() as f32,
                    CellRule::Highest => z.iter().copied().fold(f32::NEG_INFINITY, f32::max),
                };
                let (x, y) = ((i as f32 + 0.5) * cell_m, (j as f32 + 0.5) * cell_m);
                Vec3::new(cos * x - sin * y + 30.0, sin * x + cos * y - 8.0, height)
            })
            .collect()
    }

    #[test]
    fn cell_turn_and_rule_of_a_grid_come_back() {
        for (cell_m, rule, turn) in [
            (0.1, CellRule::Mean, 0.0),
            (0.25, CellRule::Highest, 0.0),
            (0.2, CellRule::Mean, 0.6),
            (0.15, CellRule::Highest, 0.3),
        ] {
            let found = Lattice::of(&gridded(cell_m, rule, turn)).unwrap();
            assert!((found.cell_m / cell_m - 1.0).abs() < 1e-3, "{found:?}");
            assert!((found.turn_rad - turn).abs() < 1e-3, "{found:?}");
            assert_eq!(found.rule, Some(rule));
        }
    }

    #[test]
    fn points_of_a_scanner_are_no_grid() {
        let mut rng = SeedTree::new(3).rng();
        let free: Vec<Vec3> =
            (0..5000).map(|_| Vec3::new(rng.random(), rng.random(), rng.random()) * 9.0).collect();
        assert_eq!(Lattice::of(&free), None);
        // A grid in three dimensions has several heights a node.
        let cube: Vec<Vec3> = (0..1000)
            .map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32))
            .collect();
        assert_eq!(Lattice::of(&cube), None);
        assert_eq!(Lattice::of(&free[..20]), None);
    }

    #[test]
    fn heights_go_back_to_the_surface_they_were_made_of() {
        for rule in [CellRule::Mean, CellRule::Highest] {
            let points = gridded(0.2, rule, 0.0);
            let lattice = Lattice::of(&points).unwrap();
            let mut off: Vec<f32> = Vec::new();
            for s in lattice.surface(&points).iter().filter(|s| s.holds) {
                let p = s.position - Vec3::new(30.0, -8.0, 0.0);
                let level = 0.5 * p.y;
                off.push((p.z - level).abs().min((p.z - level - 1.3).abs()));
            }
            off.sort_by(f32::total_cmp);
            assert!(off.len() * 10 > points.len() * 8);
            // Half a cell of 0.2 m on a slope of 1 : 2 would be 50 mm.
            let typical = off[off.len() / 2];
            assert!(typical < 0.012, "{rule:?}: {typical}");
        }
    }
}
