//! A block on the hook: the poses between two poses of its path.

use geom::{Pose, Vec3};

/// Poses from one to another, both not included but the last, so close that no point of the block moves farther than `step_m` from
/// one to the next. `centre`: the block's, block coordinates; `reach_m`: the farthest point from it.
pub(crate) fn between(
    centre: Vec3,
    reach_m: f32,
    from: &Pose,
    to: &Pose,
    step_m: f32,
) -> impl Iterator<Item = Pose> {
    let (start, end) = (*from * centre, *to * centre);
    let (first, mut last) = (from.rotation, to.rotation);
    if first.dot(last) < 0.0 {
        last = -last;
    }
    let far_m = (end - start).length() + first.angle_between(last) * reach_m;
    let steps = (far_m / step_m).ceil().max(1.0) as u32;
    (1..=steps).map(move |k| {
        let part = k as f32 / steps as f32;
        let rotation = first.slerp(last, part);
        Pose::from_parts(start.lerp(end, part) - rotation * centre, rotation)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Quat;

    #[test]
    fn no_point_moves_farther_than_a_step() {
        let centre = Vec3::new(0.1, -0.2, 0.3);
        let from = Pose::from_parts(Vec3::new(1.0, 2.0, 3.0), Quat::from_rotation_x(0.3));
        let to = Pose::from_parts(Vec3::new(1.4, 2.0, 2.5), Quat::from_rotation_y(0.8));
        let poses: Vec<Pose> = between(centre, 1.2, &from, &to, 0.05).collect();
        assert!((poses[poses.len() - 1].translation - to.translation).length() < 1e-5);
        let mut before = from;
        for pose in poses {
            for corner in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
                let point = centre + 1.2 * corner;
                assert!((pose * point - before * point).length() <= 0.05 + 1e-5);
            }
            before = pose;
        }
    }
}
