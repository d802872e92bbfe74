//! Hidden-point removal on bare points (Katz, Tal, Basri 2007): which points of a cloud a viewpoint sees.
//!
//! Points are flipped to the outside of a large sphere about the viewpoint, p ↦ p̂·(2R − |p|); those on the convex
//! hull of the flipped points and the viewpoint are visible. Seen from the viewpoint that hull is the lower hull of
//! (x/z, y/z, 1/z): the same corners, well conditioned however far away the viewpoint is.

use crate::Vec3;
use crate::hull_corners::hull_corners;
use glamx::DVec3;

/// Radius of the sphere over the largest distance: larger shows more. This one agrees with exact visibility for a pile seen
/// from some ten times its height, as a survey sees it.
pub const RADIUS_FACTOR: f32 = 1500.0;

/// Half-angle of the cone that must hold all points.
const WIDEST_RAD: f64 = 1.4;
/// Height of the point that stands for the viewpoint, far above everything in normalised coordinates.
const APEX: f64 = 1e3;

/// Why hidden points cannot be told.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HiddenPointsError {
    /// The viewpoint does not look at the cloud from outside.
    #[error(
        "the viewpoint {viewpoint} is not outside the cloud: point {point} lies more than 80° off its middle; move it away"
    )]
    NotOutside {
        /// The viewpoint.
        viewpoint: Vec3,
        /// Number of the point, from 0.
        point: usize,
    },
    /// All points lie on one line of sight or one plane through the viewpoint.
    #[error("the points lie in one plane with the viewpoint; nothing hides anything")]
    Flat,
}

/// Indices of the visible points, ascending; `radius_factor` above 1, e.g. [`RADIUS_FACTOR`].
pub fn visible(
    points: &[Vec3],
    viewpoint: Vec3,
    radius_factor: f32,
) -> Result<Vec<usize>, HiddenPointsError> {
    if points.len() < 4 {
        return Ok((0..points.len()).collect());
    }
    let away: Vec<DVec3> = points.iter().map(|p| p.as_dvec3() - viewpoint.as_dvec3()).collect();
    let forward = away.iter().map(|d| d.normalize_or_zero()).sum::<DVec3>().normalize_or_zero();
    let right = forward.any_orthonormal_vector();
    let up = right.cross(forward);
    let farthest = away.iter().map(|d| d.length()).fold(0.0, f64::max);
    let radius = farthest * f64::from(radius_factor.max(1.0));
    let mut flipped = Vec::with_capacity(points.len());
    for (point, d) in away.iter().enumerate() {
        let distance = d.length();
        let depth = d.dot(forward);
        if !(depth > distance * WIDEST_RAD.cos()) {
            return Err(HiddenPointsError::NotOutside { viewpoint, point });
        }
        let z = depth / distance * (2.0 * radius - distance);
        flipped.push(DVec3::new(d.dot(right) / depth, d.dot(up) / depth, 1.0 / z));
    }
    let (low, high) =
        flipped.iter().fold((flipped[0], flipped[0]), |(l, h), p| (l.min(*p), h.max(*p)));
    let size = (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
    let mut unit: Vec<DVec3> = flipped.iter().map(|p| (*p - low) / size - 0.5).collect();
    unit.push(DVec3::new(0.0, 0.0, APEX));
    let mut seen = hull_corners(&unit).ok_or(HiddenPointsError::Flat)?;
    seen.retain(|&i| i < points.len());
    Ok(seen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeedTree;
    use rand::RngExt;

    fn sphere(count: usize) -> Vec<Vec3> {
        let mut rng = SeedTree::new(3).rng();
        let point = |_| loop {
            let p: Vec3 = Vec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
            if (0.1..1.0).contains(&p.length()) {
                return p.normalize();
            }
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn half_a_sphere_is_seen() {
        let points = sphere(20_000);
        let from = Vec3::new(3.0, -20.0, 40.0);
        let seen = visible(&points, from, RADIUS_FACTOR).unwrap();
        // From a distance D the cap with cos > 1/D shows.
        let faces = |p: &Vec3| p.dot(from.normalize()) > 1.0 / from.length();
        let right = seen.iter().filter(|&&i| faces(&points[i])).count();
        let all = points.iter().filter(|p| faces(p)).count();
        assert!(right as f32 > 0.97 * all as f32, "{right} of {all}");
        assert!(
            (seen.len() - right) as f32 <= 0.05 * all as f32,
            "{} too many",
            seen.len() - right
        );
    }

    #[test]
    fn a_viewpoint_inside_is_named() {
        assert!(matches!(
            visible(&sphere(500), Vec3::ZERO, 100.0),
            Err(HiddenPointsError::NotOutside { .. })
        ));
    }
}
