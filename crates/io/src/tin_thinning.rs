//! A grid of heights as few triangles that stay within a tolerance of every cell.
//!
//! Right-triangulated irregular networks (Evans, Kirkpatrick & Townsend 2001): squares of 256 cells are halved along
//! diagonals as long as a triangle strays from a cell inside it. Two triangles on one edge share the decision to
//! split it, so that the surface has no cracks, also between squares. Holes keep the edge the cells give them.

use crate::raster::Raster;
use crate::tin::Tin;
use geom::DVec3;
use std::collections::HashMap;

/// Edge of a square in cells, and how often its two halves can be halved.
const SQUARE: usize = 256;
const DEPTH: u32 = 16;

type Node = [usize; 2];

/// Halves of squares with what leaving them whole would cost.
pub struct TinThinning<'a> {
    raster: &'a Raster,
    /// Nodes along east, of whole squares.
    columns: usize,
    squares: [usize; 2],
    /// By the node in the middle of the longest side: how far the triangles on that side, and their parts, stray from
    /// the grid; infinite where they hold both heights and holes.
    error_m: Vec<f32>,
}

impl<'a> TinThinning<'a> {
    /// Measures every triangle that may be used.
    pub fn new(raster: &'a Raster) -> Self {
        let squares =
            [raster.columns, raster.rows()].map(|n| n.saturating_sub(1).div_ceil(SQUARE).max(1));
        let columns = squares[0] * SQUARE + 1;
        let error_m = vec![0.0; columns * (squares[1] * SQUARE + 1)];
        let mut thinning = Self { raster, columns, squares, error_m };
        for depth in (0..DEPTH).rev() {
            for [a, b, c] in thinning.halves() {
                thinning.measure(a, b, c, DEPTH - depth, depth);
            }
        }
        thinning
    }

    /// The least triangles that stay within `tolerance_m`.
    pub fn tin(&self, tolerance_m: f32) -> Tin {
        let mut found = Found::default();
        for [a, b, c] in self.halves() {
            self.collect(a, b, c, 0, tolerance_m, &mut found);
        }
        found.tin
    }

    /// Both halves of every square, longest side first, counter-clockwise.
    fn halves(&self) -> Vec<[Node; 3]> {
        let mut halves = Vec::new();
        for y in (0..self.squares[1]).map(|y| y * SQUARE) {
            for x in (0..self.squares[0]).map(|x| x * SQUARE) {
                let (far_x, far_y) = (x + SQUARE, y + SQUARE);
                halves.push([[far_x, far_y], [x, y], [far_x, y]]);
                halves.push([[x, y], [far_x, far_y], [x, far_y]]);
            }
        }
        halves
    }

    /// Goes down to the triangles of one depth; `left` says how far a triangle is from the smallest.
    fn measure(&mut self, a: Node, b: Node, c: Node, left: u32, down: u32) {
        let m = middle(a, b);
        if down > 0 {
            self.measure(c, a, m, left, down - 1);
            self.measure(b, c, m, left, down - 1);
            return;
        }
        let mut error = self.strays_m(a, b, c);
        if left > 1 {
            for part in [middle(c, a), middle(b, c)] {
                error = error.max(self.error_m[self.number(part)]);
            }
        }
        let number = self.number(m);
        self.error_m[number] = self.error_m[number].max(error);
    }

    /// Largest distance in height between the triangle and the cells in it.
    fn strays_m(&self, a: Node, b: Node, c: Node) -> f32 {
        let heights = [a, b, c].map(|n| self.height_m(n));
        let signed = |p: Node, q: Node, r: Node| {
            let d = |i: usize, p: Node, q: Node| q[i] as f64 - p[i] as f64;
            d(0, p, q) * d(1, p, r) - d(1, p, q) * d(0, p, r)
        };
        let area = signed(a, b, c);
        let (mut worst, mut with_height, mut holes) = (0.0_f32, false, false);
        let span = |i: usize| a[i].min(b[i]).min(c[i])..=a[i].max(b[i]).max(c[i]);
        for y in span(1) {
            for x in span(0) {
                let (wa, wb) = (signed([x, y], b, c) / area, signed(a, [x, y], c) / area);
                if wa < 0.0 || wb < 0.0 || wa + wb > 1.0 {
                    continue;
                }
                let z = self.height_m([x, y]);
                if z.is_finite() {
                    with_height = true;
                    let wc = 1.0 - wa - wb;
                    let level = wa * f64::from(heights[0])
                        + wb * f64::from(heights[1])
                        + wc * f64::from(heights[2]);
                    worst = worst.max((level - f64::from(z)).abs() as f32);
                } else {
                    holes = true;
                }
            }
        }
        if with_height && holes { f32::INFINITY } else { worst }
    }

    fn collect(&self, a: Node, b: Node, c: Node, depth: u32, tolerance_m: f32, found: &mut Found) {
        let m = middle(a, b);
        if depth < DEPTH && self.error_m[self.number(m)] > tolerance_m {
            self.collect(c, a, m, depth + 1, tolerance_m, found);
            self.collect(b, c, m, depth + 1, tolerance_m, found);
        } else if [a, b, c].iter().all(|&n| self.height_m(n).is_finite()) {
            let corners = [a, b, c].map(|n| found.vertex(n, self.raster));
            found.tin.triangles.push(corners);
        }
    }

    fn number(&self, node: Node) -> usize {
        node[1] * self.columns + node[0]
    }

    /// NaN in holes and beyond the grid.
    fn height_m(&self, [x, y]: Node) -> f32 {
        let inside = x < self.raster.columns && y < self.raster.rows();
        if inside { self.raster.value[y * self.raster.columns + x] } else { f32::NAN }
    }
}

#[derive(Default)]
struct Found {
    tin: Tin,
    number: HashMap<Node, u32>,
}

impl Found {
    fn vertex(&mut self, node: Node, raster: &Raster) -> u32 {
        let vertices = &mut self.tin.vertices;
        *self.number.entry(node).or_insert_with(|| {
            let at = |i: usize| raster.origin[i] + node[i] as f64 * raster.cell_m;
            let z = raster.value[node[1] * raster.columns + node[0]];
            vertices.push(DVec3::new(at(0), at(1), f64::from(z)));
            vertices.len() as u32 - 1
        })
    }
}

fn middle(a: Node, b: Node) -> Node {
    [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use scene::DesignSurface;

    fn raster(columns: usize, rows: usize, height: impl Fn(f64, f64) -> f64) -> Raster {
        let at = |i: usize| height((i % columns) as f64, (i / columns) as f64) as f32;
        Raster {
            origin: [1000.0, -500.0],
            cell_m: 0.5,
            columns,
            value: (0..columns * rows).map(at).collect(),
        }
    }

    /// The surface at one node of its grid; NaN outside.
    fn level_m(surface: &DesignSurface, east: f64, north: f64) -> f64 {
        let DesignSurface::Grid { origin, cell_m, columns, level_m } = surface else {
            panic!("not a grid")
        };
        let [i, j] =
            [(east - origin[0]) / cell_m, (north - origin[1]) / cell_m].map(|n| n.round() as usize);
        if i < *columns {
            level_m.get(j * columns + i).copied().unwrap_or(f64::NAN)
        } else {
            f64::NAN
        }
    }

    #[test]
    fn a_plane_needs_few_triangles_and_a_ridge_stays() {
        let plane = raster(513, 257, |x, y| 3.0 - 0.25 * x + 0.125 * y);
        assert_eq!(TinThinning::new(&plane).tin(0.001).triangles.len(), 4);
        let roof = raster(257, 257, |x, _| -(x - 128.0).abs());
        let tin = TinThinning::new(&roof).tin(0.001);
        assert!(tin.triangles.len() <= 16, "{}", tin.triangles.len());
        assert!(tin.vertices.iter().any(|v| v.z == 0.0));
    }

    #[test]
    fn without_tolerance_every_cell_and_every_hole_stays() {
        let mut rough = raster(5, 4, |x, y| (x * 3.7 + y * 9.1).sin() * 2.0);
        rough.value[7] = f32::NAN; // column 2, row 1
        let tin = TinThinning::new(&rough).tin(0.0);
        assert_eq!(tin.vertices.len(), 19);
        let surface = tin.on_grid(0.5).unwrap();
        assert!(level_m(&surface, 1001.0, -499.5).is_nan());
        for (i, &z) in rough.value.iter().enumerate().filter(|(_, z)| z.is_finite()) {
            let level =
                level_m(&surface, 1000.0 + (i % 5) as f64 * 0.5, -500.0 + (i / 5) as f64 * 0.5);
            assert!((level - f64::from(z)).abs() < 1e-6, "{i}: {level} instead of {z}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn every_cell_is_within_tolerance_and_no_edge_is_open(
            columns in 20_usize..300, rows in 20_usize..60, wave in 3.0_f64..40.0, tolerance in 0.01_f32..0.5,
        ) {
            let hole = |x: f64, y: f64| (x - 12.0).powi(2) + (y - 9.0).powi(2) < 20.0;
            let height = |x: f64, y: f64| if hole(x, y) { f64::NAN } else { (x / wave).sin() + (y / wave).cos() };
            let grid = raster(columns, rows, height);
            let tin = TinThinning::new(&grid).tin(tolerance);
            let surface = tin.on_grid(0.5).unwrap();
            let mut covered = 0;
            for (i, &z) in grid.value.iter().enumerate().filter(|(_, z)| z.is_finite()) {
                let (x, y) = ((i % columns) as f64 * 0.5, (i / columns) as f64 * 0.5);
                let level = level_m(&surface, 1000.0 + x, -500.0 + y);
                // A cell with a hole on every side is in no triangle.
                prop_assert!(level.is_nan() || (level - f64::from(z)).abs() <= f64::from(tolerance) + 1e-5);
                covered += usize::from(!level.is_nan());
            }
            prop_assert!(covered + 40 >= grid.value.iter().filter(|z| z.is_finite()).count());
            // A crack would be a vertex in the middle of another triangle's side.
            let mut sides = HashMap::new();
            for t in &tin.triangles {
                for i in 0..3 {
                    *sides.entry((t[i], t[(i + 1) % 3])).or_insert(0) += 1;
                }
            }
            let number: HashMap<_, _> =
                tin.vertices.iter().enumerate().map(|(i, v)| ((v.truncate() * 4.0).to_array().map(|c| c as i64), i)).collect();
            for (&(a, b), &n) in &sides {
                prop_assert_eq!(n, 1);
                if !sides.contains_key(&(b, a)) {
                    let m = (tin.vertices[a as usize] + tin.vertices[b as usize]).truncate() * 2.0;
                    prop_assert!(!number.contains_key(&m.to_array().map(|c| c as i64)), "a crack");
                }
            }
        }
    }
}
