//! Turning a stored depth image about its middle and cutting out what the network looks at.
//!
//! A window turned about the vertical is as good a window, and its answers turn with it: training never shows the
//! same image twice. Stored images are so much larger than the network's that no turn leaves them.

use plan::DepthView;

/// The stored image behind a network's: same pixels, edge longer by √2.
pub fn stored_view(view: &DepthView) -> DepthView {
    let pixels = (view.pixels as f32 * std::f32::consts::SQRT_2).ceil() as u32;
    DepthView { pixels, edge: view.edge * pixels as f32 / view.pixels as f32 }
}

/// The network's image of a stored one turned by `turn_rad` (counter-clockwise from above).
pub(crate) fn turned(stored: &[f32], from: &DepthView, to: &DepthView, turn_rad: f32) -> Vec<f32> {
    let (sin, cos) = turn_rad.sin_cos();
    let n = to.pixels as usize;
    let per_unit = from.pixels as f32 / from.edge;
    let middle = 0.5 * from.pixels as f32 - 0.5;
    let at = |i: usize, j: usize| {
        let (x, y) = (to.offset(i), to.offset(j));
        // What stands here now stood there before the turn.
        let (px, py) =
            ((cos * x + sin * y) * per_unit + middle, (cos * y - sin * x) * per_unit + middle);
        sample(stored, from.pixels as usize, px, py)
    };
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect()
}

/// Bilinear, the border continued.
fn sample(image: &[f32], n: usize, x: f32, y: f32) -> f32 {
    let last = (n - 1) as f32;
    let (x, y) = (x.clamp(0.0, last), y.clamp(0.0, last));
    let (i, j) = ((x as usize).min(n.saturating_sub(2)), (y as usize).min(n.saturating_sub(2)));
    let (u, v) = (x - i as f32, y - j as f32);
    let at = |i: usize, j: usize| image[j.min(n - 1) * n + i.min(n - 1)];
    let below = at(i, j) * (1.0 - u) + at(i + 1, j) * u;
    let above = at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u;
    below * (1.0 - v) + above * v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_carries_east_to_north_and_no_turn_cuts_the_middle() {
        let view = DepthView { pixels: 16, edge: 1.6 };
        let stored = stored_view(&view);
        let n = stored.pixels as usize;
        // Deep in the east.
        let image: Vec<f32> = (0..n * n).map(|k| stored.offset(k % n)).collect();
        let plain = turned(&image, &stored, &view, 0.0);
        let quarter = turned(&image, &stored, &view, std::f32::consts::FRAC_PI_2);
        for j in 0..16 {
            for i in 0..16 {
                assert!((plain[j * 16 + i] - view.offset(i)).abs() < 1e-4);
                assert!((quarter[j * 16 + i] - view.offset(j)).abs() < 1e-4);
            }
        }
    }
}
