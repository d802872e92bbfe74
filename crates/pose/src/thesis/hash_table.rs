//! All oriented point pairs of a model under their quantised feature (Eq. 3.7).

use crate::PpfConfig;
use geom::{Quat, Vec3};

/// A model pair: its reference point and the angle of its partner about the reference normal.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Reference point, entry in the table's points.
    pub reference: u32,
    /// α of the partner once the reference normal lies along x, radians.
    pub alpha: f32,
}

/// The model's points and their pairs by key.
pub struct PairTable {
    /// Reference points with outward normals, block coordinates.
    pub points: Vec<(Vec3, Vec3)>,
    distance_step_m: f32,
    angle_step_rad: f32,
    angles: usize,
    distances: usize,
    /// Start of each key's pairs; one entry more than keys.
    start: Vec<u32>,
    pair: Vec<Pair>,
}

/// PPF (Eq. 3.7): ‖d‖, ∠(n₁,d), ∠(n₂,d), ∠(n₁,n₂); `None` for coincident points.
pub fn feature(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> Option<[f32; 4]> {
    let d = b.0 - a.0;
    let length = d.length();
    let u = d.try_normalize()?;
    Some([length, angle(a.1, u), angle(b.1, u), angle(a.1, b.1)])
}

fn angle(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b))
}

/// The rotation that lays a normal along x: T of Eq. 3.8 without its shift.
pub fn onto_x(normal: Vec3) -> Quat {
    Quat::from_rotation_arc(normal, Vec3::X)
}

/// Angle of a partner about x, in the frame of its reference point.
pub fn alpha(reference: (Vec3, Vec3), partner: Vec3) -> f32 {
    let q = onto_x(reference.1) * (partner - reference.0);
    (-q.z).atan2(q.y)
}

impl PairTable {
    /// Pairs of the model's surface samples.
    pub fn new(points: Vec<(Vec3, Vec3)>, diameter_m: f32, config: &PpfConfig) -> Self {
        let distance_step_m = config.distance_step * diameter_m;
        let angles = (std::f32::consts::PI / config.angle_step_rad).ceil() as usize + 1;
        let distances = (1.05 / config.distance_step).ceil() as usize + 1;
        let mut table = Self {
            points: Vec::new(),
            distance_step_m,
            angle_step_rad: config.angle_step_rad,
            angles,
            distances,
            start: vec![0; distances * angles * angles * angles + 1],
            pair: Vec::new(),
        };
        let mut keyed: Vec<(u32, Pair)> = Vec::new();
        for (i, &a) in points.iter().enumerate() {
            for (j, &b) in points.iter().enumerate() {
                if i == j || !seen_together(a, b) {
                    continue;
                }
                let Some(key) = feature(a, b).and_then(|f| table.key(&f)) else { continue };
                keyed.push((key, Pair { reference: i as u32, alpha: alpha(a, b.0) }));
            }
        }
        // Stable: pairs of one key stay in the order of the points.
        keyed.sort_by_key(|k| k.0);
        for (key, _) in &keyed {
            table.start[*key as usize + 1] += 1;
        }
        for k in 1..table.start.len() {
            table.start[k] += table.start[k - 1];
        }
        table.pair = keyed.into_iter().map(|k| k.1).collect();
        table.points = points;
        table
    }

    /// Width of a distance bin, metres; also the resolution scene points are thinned to.
    pub fn distance_step_m(&self) -> f32 {
        self.distance_step_m
    }

    /// Model pairs with about this feature.
    pub fn similar(&self, feature: &[f32; 4]) -> &[Pair] {
        match self.key(feature) {
            Some(k) => {
                &self.pair[self.start[k as usize] as usize..self.start[k as usize + 1] as usize]
            }
            None => &[],
        }
    }

    /// Key of a feature; `None` beyond the model's diameter.
    fn key(&self, feature: &[f32; 4]) -> Option<u32> {
        let d = (feature[0] / self.distance_step_m) as usize;
        if d >= self.distances {
            return None;
        }
        let bin = |v: f32| ((v / self.angle_step_rad) as usize).min(self.angles - 1);
        let [a, b, c] = [bin(feature[1]), bin(feature[2]), bin(feature[3])];
        Some((((d * self.angles + a) * self.angles + b) * self.angles + c) as u32)
    }
}

/// Whether one sensor can see both points and the pair says more than "a plane".
pub fn seen_together(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> bool {
    let cos = a.1.dot(b.1);
    let out_of_plane = (b.0 - a.0).normalize_or_zero().dot(a.1).abs();
    cos > -0.85 && !(cos > 0.99 && out_of_plane < 0.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Pose;
    use proptest::prelude::*;

    fn unit(v: [f32; 3]) -> Vec3 {
        Vec3::from_array(v).try_normalize().unwrap_or(Vec3::Y)
    }

    proptest! {
        /// The feature does not change under rigid motion, and α recovers it (Eq. 3.8): the pose made of the two
        /// frames and the difference of the angles maps the model pair onto the scene pair.
        #[test]
        fn a_pair_gives_back_its_motion(
            p in prop::array::uniform3(-1.0_f32..1.0), q in prop::array::uniform3(1.5_f32..3.0),
            n in prop::array::uniform3(-1.0_f32..1.0), m in prop::array::uniform3(-1.0_f32..1.0),
            axis in prop::array::uniform3(-1.0_f32..1.0), turn in -3.0_f32..3.0, shift in prop::array::uniform3(-5.0_f32..5.0),
        ) {
            let model = [(Vec3::from_array(p), unit(n)), (Vec3::from_array(q), unit(m))];
            let motion = Pose::from_parts(Vec3::from_array(shift), Quat::from_axis_angle(unit(axis), turn));
            let scene = model.map(|(p, n)| (motion * p, motion.rotation * n));
            let (f, g) = (feature(model[0], model[1]).unwrap(), feature(scene[0], scene[1]).unwrap());
            for k in 0..4 {
                prop_assert!((f[k] - g[k]).abs() < 2e-3, "{:?} {:?}", f, g);
            }
            let along = (model[1].0 - model[0].0).normalize().dot(model[0].1).abs();
            prop_assume!(along < 0.98);
            let found = crate::thesis::voting::motion(scene[0], model[0], alpha(model[0], model[1].0) - alpha(scene[0], scene[1].0));
            prop_assert!((found * model[1].0 - scene[1].0).length() < 2e-2);
            prop_assert!((found.rotation * model[0].1 - scene[0].1).length() < 1e-2);
        }
    }
}
