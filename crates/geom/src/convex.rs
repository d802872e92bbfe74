//! A convex solid as the half-spaces and faces of its corners' hull.
//!
//! In: corner points. Out: outward planes (f64, so that clipping against them stays exact enough to weld)
//! and one polygon per plane, counter-clockwise seen from outside.

use crate::{DVec3, Vec3};
use parry3d::transformation::try_convex_hull;

/// A half-space `normal · p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward unit normal.
    pub normal: DVec3,
    /// Distance of the border from the origin along the normal, metres.
    pub offset_m: f64,
}

impl HalfSpace {
    /// Signed distance of a point, positive outside.
    pub fn distance_m(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset_m
    }
}

/// A convex polyhedron.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexSolid {
    /// Its half-spaces.
    pub planes: Vec<HalfSpace>,
    /// The face on each plane, in the order of `planes`.
    pub faces: Vec<Vec<DVec3>>,
    /// Largest extent, metres: what tolerances are measured in.
    pub size_m: f64,
}

/// Corners closer than this share of the solid's size to a plane lie on it (f32 corners resolve 1e-7).
pub(crate) const FLATNESS: f64 = 3e-6;

impl ConvexSolid {
    /// The hull of the corners; `None` when they lie in a plane or are not finite.
    pub fn from_corners(corners: &[Vec3]) -> Option<Self> {
        if corners.len() < 4 || corners.iter().any(|c| !c.is_finite()) {
            return None;
        }
        let (points, triangles) = try_convex_hull(corners).ok()?;
        let points: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
        let low = points.iter().copied().reduce(DVec3::min)?;
        let high = points.iter().copied().reduce(DVec3::max)?;
        let size_m = (high - low).max_element();
        let flat = size_m * FLATNESS;

        // Large triangles first: slivers have no normal worth the name and join a plane already found.
        let mut cross: Vec<DVec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| points[i as usize]);
                (b - a).cross(c - a)
            })
            .collect();
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        order.sort_by(|&a, &b| {
            cross[b].length_squared().total_cmp(&cross[a].length_squared()).then(a.cmp(&b))
        });
        let mut planes: Vec<HalfSpace> = Vec::new();
        for t in order {
            let corners = triangles[t].map(|i| points[i as usize]);
            let known =
                planes.iter().any(|p| corners.iter().all(|&c| p.distance_m(c).abs() <= flat));
            if known || cross[t].length() <= flat * flat {
                continue;
            }
            cross[t] = cross[t].normalize();
            let normal = cross[t];
            // The farthest corner decides, so that no corner stands outside.
            let offset_m = points.iter().map(|p| normal.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
            planes.push(HalfSpace { normal, offset_m });
        }
        let faces: Vec<Vec<DVec3>> =
            planes.iter().map(|plane| face_on(plane, &points, flat)).collect();
        let whole = planes.len() >= 4 && faces.iter().all(|f| f.len() >= 3);
        whole.then_some(Self { planes, faces, size_m })
    }

    /// Signed distance to the nearest plane's border, positive outside; exact inside, a lower bound outside.
    pub fn depth_m(&self, p: DVec3) -> f64 {
        self.planes.iter().map(|plane| plane.distance_m(p)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Volume, m³.
    pub fn volume_m3(&self) -> f64 {
        let inside = self.faces[0][0];
        let pyramid = |(plane, face): (&HalfSpace, &Vec<DVec3>)| {
            let area: DVec3 =
                (2..face.len()).map(|i| (face[i - 1] - face[0]).cross(face[i] - face[0])).sum();
            area.length() / 6.0 * -plane.distance_m(inside)
        };
        self.planes.iter().zip(&self.faces).map(pyramid).sum()
    }

    /// Where the line `origin + t * direction` runs inside: `(enter, leave)`.
    pub fn chord(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for plane in &self.planes {
            let (toward, distance) = (plane.normal.dot(direction), plane.distance_m(origin));
            if toward.abs() < 1e-12 {
                if distance > 0.0 {
                    return None;
                }
            } else if toward < 0.0 {
                enter = enter.max(-distance / toward);
            } else {
                leave = leave.min(-distance / toward);
            }
        }
        (enter < leave).then_some((enter, leave))
    }
}

/// The corners on a plane, in counter-clockwise order seen from outside.
fn face_on(plane: &HalfSpace, points: &[DVec3], flat: f64) -> Vec<DVec3> {
    let mut on: Vec<DVec3> =
        points.iter().copied().filter(|p| plane.distance_m(*p).abs() <= 2.0 * flat).collect();
    if on.is_empty() {
        return on;
    }
    let middle = on.iter().copied().sum::<DVec3>() / on.len() as f64;
    let u = plane.normal.any_orthonormal_vector();
    let v = plane.normal.cross(u);
    let angle = |p: &DVec3| v.dot(*p - middle).atan2(u.dot(*p - middle));
    on.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    on
}

/// Volume of the union of convex solids: exact chords along x through `rows` × `rows` stratified lines.
pub fn union_volume_m3(solids: &[ConvexSolid], rows: usize) -> f64 {
    let corners = || solids.iter().flat_map(|s| s.faces.iter().flatten().copied());
    let (Some(low), Some(high)) = (corners().reduce(DVec3::min), corners().reduce(DVec3::max))
    else {
        return 0.0;
    };
    let (dy, dz) = ((high.y - low.y) / rows as f64, (high.z - low.z) / rows as f64);
    let mut length = 0.0;
    let mut chords: Vec<(f64, f64)> = Vec::new();
    for iz in 0..rows {
        for iy in 0..rows {
            // A golden-ratio shift along each row keeps lines off faces that run along the axes.
            let shift = (iz as f64 * 0.618_033_988_75).fract();
            let origin =
                DVec3::new(low.x, low.y + (iy as f64 + shift) * dy, low.z + (iz as f64 + 0.5) * dz);
            chords.clear();
            chords.extend(solids.iter().filter_map(|s| s.chord(origin, DVec3::X)));
            chords.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut reached = f64::NEG_INFINITY;
            for &(enter, leave) in &chords {
                length += (leave - enter.max(reached)).max(0.0);
                reached = reached.max(leave);
            }
        }
    }
    length * dy * dz
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(low: f32, edge: f32) -> Vec<Vec3> {
        (0..8)
            .map(|i| {
                Vec3::splat(low)
                    + Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * edge
            })
            .collect()
    }

    #[test]
    fn a_cube_has_six_square_faces() {
        let solid = ConvexSolid::from_corners(&cube(-0.5, 1.0)).unwrap();
        assert_eq!(solid.planes.len(), 6);
        assert!(solid.faces.iter().all(|f| f.len() == 4));
        assert!((solid.volume_m3() - 1.0).abs() < 1e-9);
        assert!((solid.depth_m(DVec3::new(0.1, 0.0, 0.0)) + 0.4).abs() < 1e-9);
    }

    #[test]
    fn a_flat_set_is_no_solid() {
        let square: Vec<Vec3> = cube(0.0, 1.0).into_iter().filter(|c| c.z == 0.0).collect();
        assert_eq!(ConvexSolid::from_corners(&square), None);
    }

    #[test]
    fn overlapping_cubes_count_once() {
        let solids =
            [cube(0.0, 1.0), cube(0.5, 1.0)].map(|c| ConvexSolid::from_corners(&c).unwrap());
        let volume = union_volume_m3(&solids, 96);
        assert!((volume - 1.875).abs() < 0.005, "{volume}");
    }
}
