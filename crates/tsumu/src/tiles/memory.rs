//! How much memory working on a tile needs: asked before anything is paid for.

use scene::MemoryBound;

/// Memory of the program with its weights before the first point, bytes.
const PROGRAM_BYTES: f64 = 0.35e9;
/// Bytes a point costs while a tile is worked on.
const BYTES_A_POINT: f64 = 160.0;

/// What working on a tile that reads so many points needs, bytes.
pub(crate) fn of_tile(points: u64) -> u64 {
    (PROGRAM_BYTES + points as f64 * BYTES_A_POINT).ceil() as u64
}

/// Most points a tile may read within this memory.
pub(crate) fn points_within(memory: MemoryBound) -> u64 {
    ((memory.bytes() as f64 - PROGRAM_BYTES).max(0.0) / BYTES_A_POINT) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_within_fits() {
        let memory: MemoryBound = "2GB".parse().unwrap();
        assert!(of_tile(points_within(memory)) <= memory.bytes());
        assert!(of_tile(points_within(memory) + 1000) > memory.bytes());
        assert_eq!(points_within("300MB".parse().unwrap()), 0);
    }
}
