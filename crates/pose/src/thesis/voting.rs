//! Votes for (model point, α) of each reference point, and clusters of the poses they stand for (Eqs. 3.8, 3.9).

use super::hash_table::{PairTable, alpha, feature, onto_x, seen_together};
use crate::PpfConfig;
use crate::fit::{CentredPose, FitPoint};
use crate::template::Template;
use geom::{Pose, Quat, Vec3};

/// Bins of α over a full turn.
const ALPHA_BINS: usize = 30;

/// A pose with the votes it got.
#[derive(Clone, Copy, Debug)]
pub struct Voted {
    votes: u32,
    at: CentredPose,
}

/// The best pose of every reference point, most votes first.
pub fn vote(
    scene: &[FitPoint],
    table: &PairTable,
    template: &Template,
    config: &PpfConfig,
) -> Vec<Voted> {
    let mut accumulator = vec![0_u32; table.points.len() * ALPHA_BINS];
    let mut voted = Vec::new();
    for (i, point) in scene.iter().enumerate().step_by(config.reference_stride) {
        accumulator.fill(0);
        let reference = (point.position, point.normal);
        for (j, other) in scene.iter().enumerate() {
            let partner = (other.position, other.normal);
            if i == j || !seen_together(reference, partner) {
                continue;
            }
            let Some(feature) = feature(reference, partner) else { continue };
            let own = alpha(reference, partner.0);
            for pair in table.similar(&feature) {
                let turn =
                    (pair.alpha - own).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU;
                let bin = ((turn * ALPHA_BINS as f32) as usize).min(ALPHA_BINS - 1);
                accumulator[pair.reference as usize * ALPHA_BINS + bin] += 1;
            }
        }
        // The first of equal peaks: deterministic.
        let (best, &votes) = accumulator
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.cmp(b.1).then(b.0.cmp(&a.0)))
            .expect("the model has points");
        if votes > 0 {
            let turn =
                ((best % ALPHA_BINS) as f32 + 0.5) * std::f32::consts::TAU / ALPHA_BINS as f32;
            let pose = motion(reference, table.points[best / ALPHA_BINS], turn);
            let at = CentredPose { rotation: pose.rotation, centre: pose * template.model.centre };
            voted.push(Voted { votes, at });
        }
    }
    voted.sort_by_key(|v| std::cmp::Reverse(v.votes));
    voted
}

/// T_s⁻¹ R_x(α) T_m (Eq. 3.9): the pose that lays the model point on the scene point, normals alike, turned by `turn`.
pub fn motion(scene: (Vec3, Vec3), model: (Vec3, Vec3), turn: f32) -> Pose {
    let rotation = onto_x(scene.1).inverse() * Quat::from_rotation_x(turn) * onto_x(model.1);
    let rotation = rotation.normalize();
    Pose::from_parts(scene.0 - rotation * model.0, rotation)
}

/// Poses above the vote threshold, clustered modulo symmetry; the means of the clusters, most members first.
pub fn clusters(voted: Vec<Voted>, template: &Template, config: &PpfConfig) -> Vec<CentredPose> {
    let best = voted.first().map_or(0, |v| v.votes);
    let threshold = (config.vote_threshold * best as f32) as u32;
    let displacement_m = config.cluster_displacement * template.model.d_max_m;
    let mut clusters: Vec<(u32, Vec<CentredPose>)> = Vec::new();
    for pose in voted.into_iter().filter(|v| v.votes >= threshold) {
        let fits = |c: &&mut (u32, Vec<CentredPose>)| {
            template.same(&c.1[0], &pose.at, displacement_m, config.cluster_rotation_rad)
        };
        match clusters.iter_mut().find(fits) {
            Some(cluster) => {
                cluster.0 += pose.votes;
                cluster.1.push(pose.at);
            }
            None => clusters.push((pose.votes, vec![pose.at])),
        }
    }
    clusters.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then(b.0.cmp(&a.0)));
    clusters.into_iter().map(|(_, members)| mean(&members, template)).collect()
}

/// Mean of poses that are one modulo symmetry: each turned to the equivalent nearest the first.
fn mean(members: &[CentredPose], template: &Template) -> CentredPose {
    let first = members[0].rotation;
    let mut sum = geom::DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    for m in members {
        let near = template
            .model
            .symmetry
            .rotations()
            .iter()
            .map(|&g| m.rotation * g)
            .max_by(|a, b| a.dot(first).abs().total_cmp(&b.dot(first).abs()))
            .expect("a group has at least the identity");
        let near = if near.dot(first) < 0.0 { -near } else { near };
        sum += near.as_dquat();
    }
    let centre = members.iter().map(|m| m.centre).sum::<Vec3>() / members.len() as f32;
    CentredPose { rotation: sum.normalize().as_quat(), centre }
}
