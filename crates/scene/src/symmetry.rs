//! Proper rotations that map a block onto itself.

use geom::{Pose, Quat, Vec3};

/// A finite group of rotations about a fixed centre. Always holds the identity, first.
///
/// A body of revolution has infinitely many; its group is the finite part (the identity, or a half turn that
/// swaps its ends) sampled about the [`SymmetryGroup::axis`], and angles about that axis never count as errors.
#[derive(Clone, Debug, PartialEq)]
pub struct SymmetryGroup {
    centre: Vec3,
    rotations: Vec<Quat>,
    axis: Option<Vec3>,
}

impl SymmetryGroup {
    /// The group with the identity alone.
    pub fn trivial(centre: Vec3) -> Self {
        Self { centre, rotations: vec![Quat::IDENTITY], axis: None }
    }

    /// A group from its elements about `centre`; the identity is added in front when missing.
    /// The caller answers for closure ([`SymmetryGroup::is_closed`] checks it).
    pub fn new(centre: Vec3, mut rotations: Vec<Quat>) -> Self {
        let identity = rotations.iter().position(|q| q.angle_between(Quat::IDENTITY) < 1e-4);
        match identity {
            Some(i) => rotations.swap(0, i),
            None => rotations.insert(0, Quat::IDENTITY),
        }
        rotations[0] = Quat::IDENTITY;
        Self { centre, rotations, axis: None }
    }

    /// The same samples of a group that is continuous about `axis` (a body of revolution).
    pub fn about_axis(mut self, axis: Vec3) -> Self {
        self.axis = Some(axis.normalize());
        self
    }

    /// The group of the same block in `factor` times as large coordinates.
    pub fn scaled(&self, factor: f32) -> Self {
        Self { centre: self.centre * factor, ..self.clone() }
    }

    /// The axis of a body of revolution, block coordinates; `None` for a finite group.
    pub fn axis(&self) -> Option<Vec3> {
        self.axis
    }

    /// Number of rotations, at least 1.
    pub fn order(&self) -> usize {
        self.rotations.len()
    }

    /// The rotations about [`SymmetryGroup::centre`].
    pub fn rotations(&self) -> &[Quat] {
        &self.rotations
    }

    /// The fixed point, block coordinates.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Element `i` as a transform of block coordinates.
    pub fn element(&self, i: usize) -> Pose {
        let rotation = self.rotations[i];
        Pose::from_parts(self.centre - rotation * self.centre, rotation)
    }

    /// Whether every product of two elements is an element, to `tolerance_rad`.
    pub fn is_closed(&self, tolerance_rad: f32) -> bool {
        self.rotations.iter().all(|a| {
            self.rotations.iter().all(|b| {
                self.rotations.iter().any(|c| (*a * *b).angle_between(*c) <= tolerance_rad)
            })
        })
    }

    /// Smallest rotation between two poses of the block over the group, radians (Eq. 3.13, estimate against R̄G).
    pub fn rotation_error_rad(&self, estimate: Quat, truth: Quat) -> f32 {
        let error = |g: &Quat| match self.axis {
            None => quat_angle(estimate, truth * *g),
            Some(axis) => (estimate * axis).angle_between(truth * (*g * axis)),
        };
        self.rotations.iter().map(error).fold(f32::INFINITY, f32::min)
    }

    /// The same physical pose written one way: of all `pose ∘ g` the one whose quaternion
    /// (with w ≥ 0) is nearest the identity, ties broken by x, then y, then z.
    pub fn canonical(&self, pose: &Pose) -> Pose {
        let key = |q: Quat| {
            let q = positive(q);
            // Rounded so that two estimates a hair apart break a tie the same way.
            let r = |v: f32| (v * 1e4).round() as i64;
            [r(q.w), r(q.x), r(q.y), r(q.z)]
        };
        let mut best: Option<([i64; 4], Pose)> = None;
        for i in 0..self.order() {
            let mut candidate = *pose * self.element(i);
            if let Some(axis) = self.axis {
                // The turn about the axis that brings the quaternion nearest the identity.
                let q = candidate.rotation;
                let back = Quat::from_axis_angle(axis, -2.0 * q.xyz().dot(axis).atan2(q.w));
                let fixed = candidate.transform_point(self.centre);
                candidate.rotation = q * back;
                candidate.translation = fixed - candidate.rotation * self.centre;
            }
            let k = key(candidate.rotation);
            if best.is_none_or(|(b, _)| k > b) {
                best = Some((k, candidate));
            }
        }
        let mut pose = best.expect("a group has at least the identity").1;
        pose.rotation = positive(pose.rotation).normalize();
        pose
    }
}

/// The quaternion of the same rotation with w ≥ 0.
fn positive(q: Quat) -> Quat {
    if q.w < 0.0 { -q } else { q }
}

/// Angle between two rotations in f64: near zero, f32 `acos` loses half its digits.
fn quat_angle(a: Quat, b: Quat) -> f32 {
    let d = (a.as_dquat().inverse() * b.as_dquat()).normalize();
    (2.0 * d.xyz().length().atan2(d.w.abs())) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_about_the_axis_of_a_body_of_revolution_are_no_error() {
        let group = SymmetryGroup::new(
            Vec3::new(1.0, 2.0, 3.0),
            vec![Quat::from_rotation_x(std::f32::consts::PI)],
        )
        .about_axis(Vec3::Z);
        let truth =
            Quat::from_rotation_x(0.4) * Quat::from_rotation_y(-0.3) * Quat::from_rotation_z(1.1);
        let estimate =
            truth * Quat::from_rotation_z(0.777) * Quat::from_rotation_x(std::f32::consts::PI);
        assert!(group.rotation_error_rad(estimate, truth) < 1e-3);
        let tilted = estimate * Quat::from_rotation_y(0.05);
        assert!((group.rotation_error_rad(tilted, truth) - 0.05).abs() < 1e-3);

        let pose = Pose::from_parts(Vec3::new(5.0, 6.0, 7.0), truth);
        let about_centre =
            |turn: Quat| Pose::from_parts(group.centre() - turn * group.centre(), turn);
        let same = pose * about_centre(Quat::from_rotation_z(2.5));
        let (a, b) = (group.canonical(&pose), group.canonical(&same));
        assert!((a.translation - b.translation).length() < 1e-5);
        assert!(a.rotation.angle_between(b.rotation) < 1e-3);
    }
}
