//! Thinning on the fly: of the points in each cube of a grid, the one nearest its middle.
//!
//! Memory grows with the cubes that hold points, not with the file. The result is in the order in which the
//! cubes were first met, so that it depends on the file alone.

use crate::RawCloud;
use geom::DVec3;
use std::collections::HashMap;

/// Collects batches of a cloud.
pub struct Thinning {
    cell_m: f64,
    cubes: HashMap<[i64; 3], u32>,
    kept: RawCloud,
    /// Distance² of the kept point from its cube's middle, in cells.
    distance2: Vec<f32>,
    seen: u64,
}

impl Thinning {
    /// Cubes of this edge, in the file's unit; it must be above 0.
    pub fn new(cell_m: f64) -> Self {
        assert!(cell_m > 0.0, "a cube needs an edge above 0");
        Self {
            cell_m,
            cubes: HashMap::new(),
            kept: RawCloud::default(),
            distance2: Vec::new(),
            seen: 0,
        }
    }

    /// Adds the points of a batch.
    pub fn add(&mut self, batch: &RawCloud) {
        self.seen += batch.len() as u64;
        let mut fresh = Vec::new();
        for (i, &p) in batch.position.iter().enumerate() {
            let cell = p / self.cell_m;
            let low = cell.floor();
            let d = (cell - low - DVec3::splat(0.5)).length_squared() as f32;
            let key = low.to_array().map(|v| v as i64);
            let next = (self.kept.len() + fresh.len()) as u32;
            let slot = *self.cubes.entry(key).or_insert(next);
            if slot == next {
                fresh.push(i);
                self.distance2.push(d);
            } else if d < self.distance2[slot as usize] {
                self.distance2[slot as usize] = d;
                match (slot as usize).checked_sub(self.kept.len()) {
                    Some(k) => fresh[k] = i,
                    None => self.replace(slot as usize, batch, i),
                }
            }
        }
        self.kept.append(batch.select(&fresh));
    }

    fn replace(&mut self, slot: usize, batch: &RawCloud, i: usize) {
        fn copy<T: Copy>(to: &mut Option<Vec<T>>, from: &Option<Vec<T>>, slot: usize, i: usize) {
            if let (Some(to), Some(from)) = (to, from) {
                to[slot] = from[i];
            }
        }
        self.kept.position[slot] = batch.position[i];
        copy(&mut self.kept.instance, &batch.instance, slot, i);
        copy(&mut self.kept.model, &batch.model, slot, i);
        copy(&mut self.kept.confidence, &batch.confidence, slot, i);
        copy(&mut self.kept.line, &batch.line, slot, i);
        copy(&mut self.kept.normal, &batch.normal, slot, i);
        copy(&mut self.kept.record, &batch.record, slot, i);
    }

    /// Points seen so far.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// The thinned cloud.
    pub fn finish(self) -> RawCloud {
        self.kept
    }
}
