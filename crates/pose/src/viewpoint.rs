//! From which side a survey was measured that does not say so.
//!
//! A sensor hides what lies behind what it sees. Of several directions the one is believed from which the measured
//! surface hides least of itself: nothing measured can have been hidden. From above is what most surveys are and
//! is left only for a side that is clearly better.

use geom::{Bounds, Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// A direction from which a survey may have been measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// Unit vector to the far sensor.
    pub toward: Vec3,
    /// Share of the measured points that lie behind others.
    pub hidden: f32,
}

/// Directions around, and heights above the horizon at which a scanner on a crest or a boat looks, degrees.
const AROUND: usize = 12;
const HEIGHTS_DEG: [f32; 3] = [12.0, 28.0, 50.0];
/// Points looked at.
const POINTS: usize = 40_000;
/// A side must hide less than this part of what the view from above hides, and that be more than [`CLEARLY`].
const BETTER: f32 = 0.5;
const CLEARLY: f32 = 0.03;

impl Viewpoint {
    /// In words.
    pub fn name(&self) -> String {
        if self.toward.z > 0.99 {
            return "from above".into();
        }
        const SIDES: [&str; 8] = [
            "east",
            "north-east",
            "north",
            "north-west",
            "west",
            "south-west",
            "south",
            "south-east",
        ];
        let turn = self.toward.y.atan2(self.toward.x).rem_euclid(std::f32::consts::TAU);
        let side = (turn / std::f32::consts::FRAC_PI_4).round() as usize % SIDES.len();
        let height_deg = self.toward.z.asin().to_degrees();
        format!("from the {}, {height_deg:.0}° above the horizon", SIDES[side])
    }
}

/// The likeliest direction for points this far apart and blocks of this size.
pub fn likeliest(points: &[Vec3], spacing_m: f32, d_max_m: f32) -> Viewpoint {
    let step = points.len().div_ceil(POINTS).max(1);
    let sample: Vec<Vec3> = points.iter().copied().step_by(step).collect();
    let pixel_m = (1.6 * spacing_m * (step as f32).sqrt()).max(f32::MIN_POSITIVE);
    let look =
        |toward: Vec3| Viewpoint { toward, hidden: hidden(&sample, toward, pixel_m, d_max_m) };
    let above = look(Vec3::Z);
    if above.hidden < CLEARLY {
        return above;
    }
    let mut best = Viewpoint { hidden: BETTER * above.hidden, ..above };
    for height in HEIGHTS_DEG {
        let (z, flat) = height.to_radians().sin_cos();
        for k in 0..AROUND {
            let (s, c) = (std::f32::consts::TAU * k as f32 / AROUND as f32).sin_cos();
            let side = look(Vec3::new(flat * c, flat * s, z));
            if side.hidden < best.hidden {
                best = side;
            }
        }
    }
    if best.toward == Vec3::Z { above } else { best }
}

/// Share of the points behind others, more than a quarter of d_max deep, along parallel rays.
fn hidden(points: &[Vec3], toward: Vec3, pixel_m: f32, d_max_m: f32) -> f32 {
    let right = toward.any_orthonormal_vector();
    let view = Mat3::from_cols(right, toward.cross(right), toward).transpose();
    let seen: Vec<Vec3> = points.iter().map(|&p| view * p).collect();
    let bounds = Bounds::of(seen.iter().copied());
    if bounds.is_empty() {
        return 0.0;
    }
    let pixel_m = pixel_m.max(bounds.size().max_element() / 2048.0);
    let width = (bounds.size().x / pixel_m) as usize + 1;
    let height = (bounds.size().y / pixel_m) as usize + 1;
    let pixel = |p: &Vec3| {
        let at = (*p - bounds.min) / pixel_m;
        (at.y as usize).min(height - 1) * width + (at.x as usize).min(width - 1)
    };
    let mut nearest = vec![f32::NEG_INFINITY; width * height];
    for p in &seen {
        let at = pixel(p);
        nearest[at] = nearest[at].max(p.z);
    }
    let behind = seen.iter().filter(|p| p.z < nearest[pixel(p)] - 0.25 * d_max_m).count();
    behind as f32 / seen.len() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor with a hill, and a slab above it where `covered`.
    fn floor(covered: bool) -> Vec<Vec3> {
        let mut points = Vec::new();
        for i in 0..40 * 40 {
            let (x, y) = ((i % 40) as f32 * 0.05, (i / 40) as f32 * 0.05);
            points.push(Vec3::new(x, y, 0.2 * x));
            if covered {
                points.push(Vec3::new(x, y, 2.0));
            }
        }
        points
    }

    #[test]
    fn from_above_unless_a_side_hides_clearly_less() {
        assert_eq!(likeliest(&floor(false), 0.05, 1.0).toward, Vec3::Z);
        assert_eq!(likeliest(&[], 0.1, 1.0).toward, Vec3::Z);
        let side = likeliest(&floor(true), 0.05, 1.0);
        assert!(side.toward.z < 0.8 && side.hidden < 0.05, "{side:?}");
        assert!(side.name().contains("above the horizon"), "{}", side.name());
    }
}
