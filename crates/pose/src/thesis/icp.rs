//! Iterative closest point between a segment and the model's sampled surface (METHOD §4).

use crate::IcpError;
use crate::fit::{CentredPose, FitPoint, agreement, solve};
use crate::template::Template;
use geom::Vec3;

/// Iterations; the pairing radius shrinks over them.
const ITERATIONS: usize = 20;
/// Points used at most.
const MOST_POINTS: usize = 800;

/// Refines a pose: pairs each point with the nearest model point that could have been seen, moves the block to make
/// the pairs' distances (to the point or to its plane) small, repeats.
pub fn refine(
    points: &[FitPoint],
    template: &Template,
    start: CentredPose,
    error: IcpError,
    radius_m: f32,
) -> CentredPose {
    let Some(cloud) = &template.cloud else { return start };
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    let d_max = template.model.d_max_m;
    let mut at = start;
    for k in 0..ITERATIONS {
        let radius = radius_m * (2.0 - 1.5 * k as f32 / ITERATIONS as f32);
        let site_from_block = at.pose(template.model.centre);
        let block_from_site = site_from_block.inverse();
        let mut a = [[0.0_f32; 6]; 6];
        let mut b = [0.0_f32; 6];
        for point in points.iter().step_by(stride) {
            let Some((i, _)) = cloud.grid.nearest_within(block_from_site * point.position, radius)
            else {
                continue;
            };
            let (q, n) = cloud.points[i as usize];
            let (q, n) = (site_from_block * q, site_from_block.rotation * n);
            if agreement(n, point) <= 0.05 {
                continue;
            }
            let along: &[Vec3] = match error {
                IcpError::PointToPlane => &[n],
                IcpError::PointToPoint => &[Vec3::X, Vec3::Y, Vec3::Z],
            };
            for &g in along {
                // The model point moves by t + ω × (q − centre); its distance along g to the point shrinks by that.
                let turn = (q - at.centre).cross(g) / d_max;
                let row = [g.x, g.y, g.z, turn.x, turn.y, turn.z];
                let off = g.dot(point.position - q);
                for r in 0..6 {
                    b[r] += row[r] * off;
                    for c in 0..=r {
                        a[r][c] += row[r] * row[c];
                    }
                }
            }
        }
        let Some(step) = solve(&a, &b, 1e-5) else { break };
        let shift = Vec3::new(step[0], step[1], step[2]).clamp_length_max(0.3 * d_max);
        let turn = (Vec3::new(step[3], step[4], step[5]) / d_max).clamp_length_max(0.5);
        at.centre += shift;
        at.rotation = (geom::Quat::from_scaled_axis(turn) * at.rotation).normalize();
        if shift.length() < 1e-5 * d_max && turn.length() < 1e-5 {
            break;
        }
    }
    at
}
