//! The baseline without segmentation (§3.7): square windows slide over the plan, each searched for one block.

use crate::measured::Measured;
use crate::search::{FEWEST_POINTS, Task};
use geom::{Bounds, Vec3};

/// One task a window of edge `window_m`, every `window_m / 2`, over everything above the bed.
pub fn windows(measured: &Measured, window_m: f32) -> Vec<Task> {
    let bounds = Bounds::of(measured.position.iter().copied());
    if bounds.is_empty() {
        return Vec::new();
    }
    let stride = 0.5 * window_m;
    let count = |size: f32| ((size / stride).ceil() as usize).max(1);
    let mut tasks = Vec::new();
    for iy in 0..count(bounds.size().y) {
        for ix in 0..count(bounds.size().x) {
            let low = bounds.min + Vec3::new(ix as f32 * stride, iy as f32 * stride, 0.0);
            let middle = low + Vec3::new(0.5 * window_m, 0.5 * window_m, 0.0);
            let inside = |p: Vec3| {
                (p - middle).abs().x <= 0.5 * window_m && (p - middle).abs().y <= 0.5 * window_m
            };
            let points: Vec<u32> = (0..measured.position.len() as u32)
                .filter(|&i| inside(measured.position[i as usize]))
                .collect();
            if points.len() >= FEWEST_POINTS {
                let mean = points.iter().map(|&i| measured.position[i as usize]).sum::<Vec3>()
                    / points.len() as f32;
                tasks.push(Task {
                    centre: mean,
                    points,
                    centre_sd_m: 0.5 * window_m,
                    is_segment: false,
                });
            }
        }
    }
    tasks
}
