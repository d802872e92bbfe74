//! Where a survey is cut: square cells that lie still in the world, and tiles of 1, 4, 16 … of them.
//!
//! In: how many points lie where. Out: tiles small enough to be worked on one at a time. Cells are multiples of their edge in site
//! coordinates, not places in this survey: two surveys of one works are cut alike, and so is one of which a part was measured.

use geom::{DVec2, DVec3};
use scene::Catalog;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Edge of a cell in d_box of the largest block. Free choice: small enough to be cut to any size, large enough for few files.
const CELL: f64 = 8.0;
/// A cell is counted in so many squares along each side, each about as large as a block.
pub(crate) const SQUARES: usize = 8;
/// Largest tile, in cells along a side.
const LARGEST: i32 = 64;

/// A square cell by its place among all cells of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(crate) struct Cell {
    pub north: i32,
    pub east: i32,
}

/// The cells of a catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grid {
    /// Edge of a cell, metres.
    pub edge_m: f64,
}

/// How many points lie in a cell, and where in it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Count {
    /// Points of each of its squares, rows from the south.
    pub squares: [u32; SQUARES * SQUARES],
}

/// The square of cells a tile owns, half open: south and west edges are its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Core {
    /// Its south-west cell.
    pub corner: Cell,
    /// Cells along a side.
    pub cells: i32,
}

/// A core with what is in and around it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cut {
    pub core: Core,
    /// Squares with points: about as many blocks lie there at most.
    pub blocks: u64,
    pub points: u64,
    /// Points of the core and its halo.
    pub read: u64,
}

/// How large a tile may be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Most {
    pub blocks: u64,
    pub read: u64,
}

impl Grid {
    /// Cells of eight largest blocks, the edge rounded up to two digits.
    pub fn of(catalog: &Catalog) -> Self {
        let d_box_m = catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max);
        let edge_m = (CELL * d_box_m).max(f64::MIN_POSITIVE);
        let digit = 10_f64.powf(edge_m.log10().floor() - 1.0);
        Self { edge_m: (edge_m / digit).ceil() * digit }
    }

    /// The cell of a place, site coordinates.
    pub fn cell(&self, p: DVec3) -> Cell {
        let at = |v: f64| (v / self.edge_m).floor() as i32;
        Cell { north: at(p.y), east: at(p.x) }
    }

    /// South-west corner of a cell, site coordinates.
    pub fn corner(&self, cell: Cell) -> DVec2 {
        DVec2::new(f64::from(cell.east), f64::from(cell.north)) * self.edge_m
    }

    /// Lower and upper corner of a core with `halo_m` around it.
    pub fn bounds(&self, core: Core, halo_m: f64) -> [DVec2; 2] {
        let low = self.corner(core.corner);
        [low - halo_m, low + f64::from(core.cells) * self.edge_m + halo_m]
    }

    /// Whether a core holds a place.
    pub fn holds(&self, core: Core, p: DVec2) -> bool {
        let cell = self.cell(p.extend(0.0));
        let within =
            |v: i32, low: i32| v >= low && i64::from(v) < i64::from(low) + i64::from(core.cells);
        within(cell.north, core.corner.north) && within(cell.east, core.corner.east)
    }

    /// Square of a cell that a place lies in.
    pub fn square(&self, cell: Cell, p: DVec3) -> usize {
        let at = (p.truncate() - self.corner(cell)) / self.edge_m * SQUARES as f64;
        let one = |v: f64| (v as usize).min(SQUARES - 1);
        one(at.y) * SQUARES + one(at.x)
    }

    /// Cuts what was counted into tiles, south to north and west to east.
    pub fn cut(&self, counts: &BTreeMap<Cell, Count>, halo_m: f64, most: Most) -> Vec<Cut> {
        let mut open: BTreeSet<Core> = counts.keys().map(|c| root(*c)).collect();
        let mut done = Vec::new();
        while let Some(core) = open.pop_last() {
            let cut = self.count(counts, core, halo_m);
            if cut.points == 0 {
                continue;
            }
            if core.cells == 1 || cut.blocks <= most.blocks && cut.read <= most.read {
                done.push(cut);
            } else {
                open.extend(quarters(core));
            }
        }
        done.sort_by_key(|c| c.core);
        done
    }

    fn count(&self, counts: &BTreeMap<Cell, Count>, core: Core, halo_m: f64) -> Cut {
        let square_m = self.edge_m / SQUARES as f64;
        let beyond = (halo_m / square_m).ceil() as i64;
        let side = i64::from(core.cells) * SQUARES as i64;
        let mut cut = Cut { core, blocks: 0, points: 0, read: 0 };
        for (cell, count) in around(counts, core) {
            let first = |at: i32, low: i32| (i64::from(at) - i64::from(low)) * SQUARES as i64;
            let (row, column) =
                (first(cell.north, core.corner.north), first(cell.east, core.corner.east));
            for (i, &points) in count.squares.iter().enumerate().filter(|(_, n)| **n > 0) {
                let (y, x) = (row + (i / SQUARES) as i64, column + (i % SQUARES) as i64);
                let within = |by: i64| [x, y].iter().all(|v| (-by..side + by).contains(v));
                if within(0) {
                    cut.blocks += 1;
                    cut.points += u64::from(points);
                }
                if within(beyond) {
                    cut.read += u64::from(points);
                }
            }
        }
        cut
    }
}

/// Cells with points in a core and beside it.
pub(crate) fn around<T>(of: &BTreeMap<Cell, T>, core: Core) -> impl Iterator<Item = (&Cell, &T)> {
    let (south, west, n) = (core.corner.north, core.corner.east, core.cells);
    (south - 1..=south + n).flat_map(move |north| {
        of.range(Cell { north, east: west - 1 }..=Cell { north, east: west + n })
    })
}

impl Core {
    /// Name of the tile: its cells' place in the world and how many they are along a side.
    pub fn key(&self) -> String {
        format!("e{}n{}s{}", self.corner.east, self.corner.north, self.cells)
    }
}

impl Default for Count {
    fn default() -> Self {
        Self { squares: [0; SQUARES * SQUARES] }
    }
}

impl Count {
    /// Squares with points.
    pub fn blocks(&self) -> u64 {
        self.squares.iter().filter(|n| **n > 0).count() as u64
    }

    /// Points.
    pub fn points(&self) -> u64 {
        self.squares.iter().map(|n| u64::from(*n)).sum()
    }
}

fn root(cell: Cell) -> Core {
    let at = |v: i32| v.div_euclid(LARGEST) * LARGEST;
    Core { corner: Cell { north: at(cell.north), east: at(cell.east) }, cells: LARGEST }
}

fn quarters(core: Core) -> [Core; 4] {
    let half = core.cells / 2;
    [(0, 0), (0, half), (half, 0), (half, half)].map(|(north, east)| Core {
        corner: Cell { north: core.corner.north + north, east: core.corner.east + east },
        cells: half,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(cells: i32, per_square: u32) -> BTreeMap<Cell, Count> {
        let count = Count { squares: [per_square; SQUARES * SQUARES] };
        (0..cells).map(|i| (Cell { north: -3, east: i - 5 }, count.clone())).collect()
    }

    #[test]
    fn every_place_has_one_owner_whatever_the_limit() {
        let grid = Grid { edge_m: 17.0 };
        let counts = strip(13, 100);
        for blocks in [64, 200, 1000, 1_000_000] {
            let cuts = grid.cut(&counts, 5.0, Most { blocks, read: u64::MAX });
            assert_eq!(cuts.iter().map(|c| c.points).sum::<u64>(), 13 * 6400);
            for cut in &cuts {
                assert!(cut.blocks <= blocks && cut.read >= cut.points, "{cut:?}");
            }
            for i in 0..400 {
                // Edges too.
                let p = DVec2::new(
                    f64::from(i - 160) * 0.53125 - 0.5,
                    -3.0 * 17.0 + f64::from(i % 32) * 0.53125,
                );
                let owners = cuts.iter().filter(|c| grid.holds(c.core, p)).count();
                let inside = counts.contains_key(&grid.cell(p.extend(0.0)));
                assert!(owners == 1 || !inside && owners <= 1, "{p}: {owners}");
            }
        }
    }

    #[test]
    fn tiles_lie_still_in_the_world() {
        let grid = Grid { edge_m: 17.0 };
        let keys = |counts: &BTreeMap<Cell, Count>| -> Vec<String> {
            let most = Most { blocks: 64, read: u64::MAX };
            grid.cut(counts, 5.0, most).iter().map(|c| c.core.key()).collect()
        };
        let mut counts = strip(13, 100);
        let all = keys(&counts);
        // Half of it, cut where squares of every size end.
        counts.retain(|cell, _| cell.east >= 0);
        assert!(keys(&counts).iter().all(|key| all.contains(key)));
        assert_eq!(all[0], "e-8n-4s4");
    }

    #[test]
    fn a_tile_that_would_need_too_much_is_cut_smaller() {
        let grid = Grid { edge_m: 17.0 };
        let counts = strip(13, 1000);
        let cuts = grid.cut(&counts, 5.0, Most { blocks: 10_000, read: 200_000 });
        assert!(cuts.iter().all(|c| c.read <= 200_000) && cuts.len() >= 5, "{cuts:?}");
    }
}
