//! Normals of measured points: the plane through each point's neighbours, facing the sensor.
//!
//! In: positions, where the sensor was, how far neighbours reach. Out: a unit normal a point; zero where fewer than
//! four neighbours are found or they lie on a line, because there is no plane to speak of.

use crate::point_grid::PointGrid;
use crate::{Mat3, Vec3};
use rayon::prelude::*;

/// Normal of every point from the neighbours within `radius_m`, turned towards `sensor(point)` — the unit direction
/// from a point to the sensor that saw it.
pub fn normals(
    points: &[Vec3],
    radius_m: f32,
    sensor: &(dyn Fn(Vec3) -> Vec3 + Sync),
) -> Vec<Vec3> {
    let grid = PointGrid::new(points, radius_m * 0.5);
    points
        .par_iter()
        .map(|&p| {
            let (mut n, mut sum) = (0.0_f32, Vec3::ZERO);
            let mut moment = [0.0_f32; 6];
            grid.for_each_within(p, radius_m, |_, q, _| {
                let d = q - p;
                n += 1.0;
                sum += d;
                let products = [d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z];
                for (m, v) in moment.iter_mut().zip(products) {
                    *m += v;
                }
            });
            if n < 4.0 {
                return Vec3::ZERO;
            }
            let c = sum / n;
            let [xx, yy, zz, xy, xz, yz] = moment.map(|m| m / n);
            let covariance = Mat3::from_cols(
                Vec3::new(xx - c.x * c.x, xy - c.x * c.y, xz - c.x * c.z),
                Vec3::new(xy - c.x * c.y, yy - c.y * c.y, yz - c.y * c.z),
                Vec3::new(xz - c.x * c.z, yz - c.y * c.z, zz - c.z * c.z),
            );
            match smallest_direction(&covariance) {
                Some(normal) if normal.dot(sensor(p)) < 0.0 => -normal,
                Some(normal) => normal,
                None => Vec3::ZERO,
            }
        })
        .collect()
}

/// Unit eigenvector of the smallest eigenvalue of a symmetric matrix; `None` when the two smallest coincide.
pub fn smallest_direction(m: &Mat3) -> Option<Vec3> {
    let trace = m.x_axis.x + m.y_axis.y + m.z_axis.z;
    if !(trace.is_finite() && trace > 0.0) {
        return None;
    }
    // Scaled so that small parts and large blocks meet the same tolerances.
    let m = *m * trace.recip();
    let (a, b, c) = (m.x_axis, m.y_axis, m.z_axis);
    let q = (a.x + b.y + c.z) / 3.0;
    let off = a.y * a.y + a.z * a.z + b.z * b.z;
    let p2 = (a.x - q).powi(2) + (b.y - q).powi(2) + (c.z - q).powi(2) + 2.0 * off;
    if p2 < 1e-10 {
        return None;
    }
    let p = (p2 / 6.0).sqrt();
    let shifted = (m - Mat3::from_diagonal(Vec3::splat(q))) * p.recip();
    let half = (shifted.determinant() / 2.0).clamp(-1.0, 1.0);
    let phi = half.acos() / 3.0;
    let largest = q + 2.0 * p * phi.cos();
    let smallest = q + 2.0 * p * (phi + std::f32::consts::TAU / 3.0).cos();
    let middle = 3.0 * q - largest - smallest;
    if middle - smallest < 1e-4 {
        return None;
    }
    // Rows of (m − λI) span the plane across the eigenvector: the longest cross product is the safest.
    let r = m - Mat3::from_diagonal(Vec3::splat(smallest));
    let crosses = [r.x_axis.cross(r.y_axis), r.y_axis.cross(r.z_axis), r.z_axis.cross(r.x_axis)];
    let best = crosses
        .into_iter()
        .fold(Vec3::ZERO, |b, v| if v.length_squared() > b.length_squared() { v } else { b });
    best.try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Quat;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_plane_has_its_normal_facing_the_sensor(axis in prop::array::uniform3(-1.0_f32..1.0), angle in -3.0_f32..3.0) {
            let axis = Vec3::from_array(axis).try_normalize().unwrap_or(Vec3::X);
            let turn = Quat::from_axis_angle(axis, angle);
            let points: Vec<Vec3> =
                (0..100).map(|i| turn * Vec3::new((i % 10) as f32 * 0.1, (i / 10) as f32 * 0.1, 0.0)).collect();
            let found = normals(&points, 0.25, &|_| turn * Vec3::Z);
            for n in found {
                prop_assert!(n.dot(turn * Vec3::Z) > 0.999, "{}", n);
            }
        }
    }

    #[test]
    fn a_line_and_a_lone_point_have_none() {
        let mut points: Vec<Vec3> = (0..20).map(|i| Vec3::new(i as f32 * 0.1, 0.0, 0.0)).collect();
        points.push(Vec3::new(50.0, 0.0, 0.0));
        assert!(normals(&points, 0.5, &|_| Vec3::Z).iter().all(|n| *n == Vec3::ZERO));
    }
}
