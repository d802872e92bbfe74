//! Heights for the empty cells of a map, in time that grows with the map and not with its holes.
//!
//! Between known cells of a row or a column heights are interpolated. What lies beyond takes the mean of its known neighbours, ring by
//! ring. While no row and no column has a gap only the ring is looked at: a works of a kilometre of which one end was surveyed
//! once took longer than anybody waited.

use crate::HeightMap;

/// Fills every empty cell; a map without any height stays empty.
pub(crate) fn fill(map: &mut HeightMap) {
    let mut known = Known::of(map);
    if known.count == 0 {
        return;
    }
    let mut ring: Option<Vec<usize>> = None;
    while known.count < map.z_m.len() {
        if known.has_gap() {
            for (cell, z) in between_known(map) {
                known.set(map, cell, z);
            }
            ring = None;
            continue;
        }
        let empty = ring.take().unwrap_or_else(|| beside_known(map));
        let filled: Vec<(usize, f32)> =
            empty.iter().map(|&cell| (cell, mean_of_neighbours(map, cell))).collect();
        filled.iter().for_each(|&(cell, z)| known.set(map, cell, z));
        let mut next: Vec<usize> = empty
            .iter()
            .flat_map(|&cell| neighbours(map, cell))
            .filter(|&cell| map.z_m[cell].is_nan())
            .collect();
        next.sort_unstable();
        next.dedup();
        ring = Some(next);
    }
}

/// Known cells of each row and column: how many, the first and the last.
struct Known {
    count: usize,
    row: Vec<(usize, usize, usize)>,
    column: Vec<(usize, usize, usize)>,
    /// Rows and columns with an empty cell between known ones.
    gaps: usize,
}

impl Known {
    fn of(map: &HeightMap) -> Self {
        let none = (0, usize::MAX, 0);
        let (row, column) = (vec![none; map.ny], vec![none; map.nx]);
        let mut known = Self { count: 0, row, column, gaps: 0 };
        for cell in (0..map.z_m.len()).filter(|&cell| !map.z_m[cell].is_nan()) {
            known.add(cell % map.nx, cell / map.nx);
        }
        known
    }

    fn add(&mut self, ix: usize, iy: usize) {
        self.count += 1;
        for (line, at) in [(&mut self.row[iy], ix), (&mut self.column[ix], iy)] {
            let before = usize::from(is_broken(line));
            *line = (line.0 + 1, line.1.min(at), line.2.max(at));
            self.gaps = self.gaps + usize::from(is_broken(line)) - before;
        }
    }

    fn set(&mut self, map: &mut HeightMap, cell: usize, z: f32) {
        map.z_m[cell] = z;
        self.add(cell % map.nx, cell / map.nx);
    }

    fn has_gap(&self) -> bool {
        self.gaps > 0
    }
}

fn is_broken(line: &(usize, usize, usize)) -> bool {
    line.0 > 0 && line.2 - line.1 + 1 > line.0
}

/// Empty cells between known ones of their row or column, with their heights.
fn between_known(map: &HeightMap) -> Vec<(usize, f32)> {
    let (nx, ny) = (map.nx, map.ny);
    // Of each cell: the height interpolated along its row, and the weight of it.
    let mut along_row: Vec<(f32, f32)> = vec![(0.0, 0.0); map.z_m.len()];
    for iy in 0..ny {
        interpolate(map, iy * nx, 1, nx, |cell, found| along_row[cell] = found);
    }
    let mut filled = Vec::new();
    let mut along_column: Vec<(f32, f32)> = vec![(0.0, 0.0); ny];
    for ix in 0..nx {
        along_column.fill((0.0, 0.0));
        interpolate(map, ix, nx, ny, |cell, found| along_column[cell / nx] = found);
        for (iy, &(b, wb)) in along_column.iter().enumerate() {
            let cell = iy * nx + ix;
            let (a, wa) = along_row[cell];
            match (wa > 0.0, wb > 0.0) {
                (true, true) => filled.push((cell, (a * wa + b * wb) / (wa + wb))),
                (true, false) => filled.push((cell, a)),
                (false, true) => filled.push((cell, b)),
                (false, false) => {}
            }
        }
    }
    filled
}

/// Walks along a line of cells and tells of every empty one between known ones: the height interpolated between these, with
/// weight 1 / distance between them.
fn interpolate(
    map: &HeightMap,
    first: usize,
    step: usize,
    count: usize,
    mut found: impl FnMut(usize, (f32, f32)),
) {
    let mut last: Option<usize> = None;
    for k in 0..count {
        let z = map.z_m[first + k * step];
        if z.is_nan() {
            continue;
        }
        if let Some(from) = last {
            let a = map.z_m[first + from * step];
            for at in from + 1..k {
                let (left, right) = ((at - from) as f32, (k - at) as f32);
                let height = (a * right + z * left) / (left + right);
                found(first + at * step, (height, 1.0 / (left + right)));
            }
        }
        last = Some(k);
    }
}

/// Empty cells with a known neighbour.
fn beside_known(map: &HeightMap) -> Vec<usize> {
    let known = |cell: usize| !map.z_m[cell].is_nan();
    let empty = (0..map.z_m.len()).filter(|&cell| !known(cell));
    empty.filter(|&cell| neighbours(map, cell).any(known)).collect()
}

fn mean_of_neighbours(map: &HeightMap, cell: usize) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for z in neighbours(map, cell).map(|near| map.z_m[near]).filter(|z| !z.is_nan()) {
        (sum, count) = (sum + z, count + 1);
    }
    sum / count as f32
}

/// West, east, south and north of a cell, where there are any.
fn neighbours(map: &HeightMap, cell: usize) -> impl Iterator<Item = usize> + use<> {
    let (nx, ny) = (map.nx, map.ny);
    let (ix, iy) = (cell % nx, cell / nx);
    let west = (ix > 0).then(|| cell - 1);
    let east = (ix + 1 < nx).then_some(cell + 1);
    let south = (iy > 0).then(|| cell - nx);
    let north = (iy + 1 < ny).then_some(cell + nx);
    [west, east, south, north].into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec2;
    use proptest::prelude::*;

    /// The same, cell by cell and pass by pass, as it is defined.
    fn by_definition(map: &mut HeightMap) {
        if map.z_m.iter().all(|z| z.is_nan()) {
            return;
        }
        while map.z_m.iter().any(|z| z.is_nan()) {
            let before = map.clone();
            let filled = between_known(&before);
            if filled.is_empty() {
                for cell in beside_known(&before) {
                    map.z_m[cell] = mean_of_neighbours(&before, cell);
                }
            }
            filled.into_iter().for_each(|(cell, z)| map.z_m[cell] = z);
        }
    }

    proptest! {
        #[test]
        fn rings_are_what_whole_passes_give(
            known in prop::collection::vec((0_usize..17, 0_usize..13, -5.0_f32..5.0), 0..25),
        ) {
            let mut map = HeightMap::empty(Vec2::ZERO, Vec2::new(17.0, 13.0), 1.0);
            for (ix, iy, z) in known {
                map.z_m[iy * 17 + ix] = z;
            }
            let mut other = map.clone();
            fill(&mut map);
            by_definition(&mut other);
            let bits = |map: &HeightMap| map.z_m.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&map), bits(&other));
        }
    }

    /// One cell of four million: every pass over all of them, ring by ring, was never done.
    #[test]
    fn a_far_corner_is_reached() {
        let mut map = HeightMap::empty(Vec2::ZERO, Vec2::splat(2000.0), 1.0);
        map.z_m[0] = 2.5;
        fill(&mut map);
        assert!(map.z_m.iter().all(|z| *z == 2.5));
    }
}
