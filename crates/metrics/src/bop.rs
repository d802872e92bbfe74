//! Pose scores of the BOP benchmark (Hodaň et al., "BOP Challenge 2020", 2020), beside ours: MSSD, and VSD where the depth
//! camera is known. MSPD is left out: it judges projections for images without depth.
//!
//! MSSD: the largest way a corner of the mesh has between two poses, least over the symmetries. VSD: the share of the
//! visible surface, of estimate and truth together, whose distances from the camera differ by more than a tolerance. Recall
//! is averaged over ten limits as the benchmark has them, .05 to .50 of the diameter (MSSD) or of the cost (VSD).

use crate::TrueBlock;
use geom::{DVec3, Pose, Quat, TriMesh, Vec3, hull_corners};
use scene::{Catalog, Fit, PlacedBlock, Recognised, SymmetryGroup};

/// Limits of a benchmark: .05, .10 … .50.
pub fn limits() -> [f64; 10] {
    std::array::from_fn(|i| 0.05 * (i + 1) as f64)
}

/// Steps of a turn about the axis of a body of revolution; the public toolkit's default, one in a hundred of the diameter's
/// half-circle.
const AXIS_STEPS: usize = 315;

/// The corners of a mesh's convex hull. Nothing of the mesh lies farther from another part of it, nor moves farther between two
/// poses, than these do.
pub fn outline(mesh: &TriMesh) -> Vec<Vec3> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|v| v.as_dvec3()).collect();
    match hull_corners(&points) {
        Some(corners) => corners.into_iter().map(|i| mesh.vertices[i]).collect(),
        None => mesh.vertices.clone(),
    }
}

/// Largest distance between two corners, metres.
pub fn diameter_m(outline: &[Vec3]) -> f64 {
    let mut longest = 0.0_f32;
    for (i, a) in outline.iter().enumerate() {
        for b in &outline[..i] {
            longest = longest.max((*a - *b).length_squared());
        }
    }
    f64::from(longest).sqrt()
}

/// Maximum symmetry-aware surface distance between two poses of a block with this outline, metres.
pub fn mssd_m(group: &SymmetryGroup, outline: &[Vec3], estimate: &Pose, truth: &Pose) -> f64 {
    let mut best = f32::INFINITY;
    for k in 0..group.order() {
        let element = group.element(k);
        let turns = if group.axis().is_some() { AXIS_STEPS } else { 1 };
        for turn in 0..turns {
            let same = match group.axis() {
                None => *truth * element,
                Some(axis) => {
                    let angle = turn as f32 / turns as f32 * std::f32::consts::TAU;
                    let about = Quat::from_axis_angle(axis, angle);
                    let centre = group.centre();
                    *truth * Pose::from_parts(centre - about * centre, about) * element
                }
            };
            let way = |v: &Vec3| (*estimate * *v - same * *v).length();
            // Once one corner is farther than the best so far, this symmetry is not the one.
            let mut most = 0.0_f32;
            for v in outline {
                most = most.max(way(v));
                if most >= best {
                    break;
                }
            }
            best = best.min(most);
        }
    }
    best.into()
}

/// A pinhole camera: x right, y down, z away from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Focal lengths, pixels.
    pub focal_px: [f32; 2],
    /// Where the axis meets the image, pixels; the middle of the first pixel is (0, 0).
    pub principal_px: [f32; 2],
}

impl Pinhole {
    /// Distances (not depths) from the camera to a mesh; 0 where it is not met.
    pub fn distances_m(&self, mesh: &TriMesh, camera_from_block: &Pose) -> Vec<f32> {
        let [columns, rows] = self.size;
        let mut out = vec![0.0_f32; columns * rows];
        let ray = |u: usize, v: usize| {
            let x = (u as f32 - self.principal_px[0]) / self.focal_px[0];
            let y = (v as f32 - self.principal_px[1]) / self.focal_px[1];
            Vec3::new(x, y, 1.0)
        };
        for t in 0..mesh.triangles.len() {
            let corners = mesh.corners(t).map(|c| *camera_from_block * c);
            if corners.iter().any(|c| c.z <= 1e-6) {
                continue;
            }
            let at = |axis: usize| {
                corners.map(|c| c[axis] / c.z * self.focal_px[axis] + self.principal_px[axis])
            };
            let span = |axis: usize| {
                let v = at(axis);
                let low = v[0].min(v[1]).min(v[2]).ceil().max(0.0) as usize;
                let high = v[0].max(v[1]).max(v[2]).floor().min(self.size[axis] as f32 - 1.0);
                low..(high + 1.0).max(0.0) as usize
            };
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            for v in span(1) {
                for u in span(0) {
                    let ray = ray(u, v);
                    let along = normal.dot(ray);
                    if along.abs() < 1e-20 {
                        continue;
                    }
                    let hit = ray * (normal.dot(a) / along);
                    let side = |p: Vec3, q: Vec3| normal.dot((q - p).cross(hit - p)) >= -1e-12;
                    if hit.z > 0.0 && side(a, b) && side(b, c) && side(c, a) {
                        let (cell, distance) = (v * columns + u, hit.length());
                        if out[cell] == 0.0 || distance < out[cell] {
                            out[cell] = distance;
                        }
                    }
                }
            }
        }
        out
    }
}

/// Tolerance of the visibility masks in the benchmark, metres.
pub const VISIBLE_M: f32 = 0.015;

/// Visible surface discrepancy in [0, 1] for each tolerance `taus_m`. The three images hold distances from the camera, 0 for
/// none: what was measured, and the mesh at the true and at the estimated pose. A measured image without a value shows nothing
/// against a pose.
pub fn vsd(
    measured: &[f32],
    truth: &[f32],
    estimate: &[f32],
    visible_m: f32,
    taus_m: &[f64],
) -> Vec<f64> {
    let mut shared = Vec::new();
    let mut either = 0_usize;
    for ((&scene, &t), &e) in measured.iter().zip(truth).zip(estimate) {
        let shows = |d: f32| d > 0.0 && (scene <= 0.0 || d - scene <= visible_m);
        let sees_truth = shows(t);
        // What is seen of the truth cannot be hidden from the estimate.
        let sees_estimate = shows(e) || (sees_truth && e > 0.0);
        either += usize::from(sees_truth || sees_estimate);
        if sees_truth && sees_estimate {
            shared.push(f64::from((t - e).abs()));
        }
    }
    let apart = (either - shared.len()) as f64;
    taus_m
        .iter()
        .map(|tau| {
            let wrong = shared.iter().filter(|d| **d >= *tau).count() as f64;
            if either == 0 { 1.0 } else { (wrong + apart) / either as f64 }
        })
        .collect()
}

/// Average recall of one scene over `limits`: `error(e, t)` is the error of estimate `e`, best first, against truth `t`.
/// Each estimate takes the nearest free truth below the limit. `None` without truths.
pub fn average_recall(
    estimates: usize,
    truths: usize,
    error: impl Fn(usize, usize) -> f64,
    limits: &[f64],
) -> Option<f64> {
    let errors: Vec<Vec<f64>> =
        (0..estimates).map(|e| (0..truths).map(|t| error(e, t)).collect()).collect();
    let found = |limit: f64| {
        let mut taken = vec![false; truths];
        for row in &errors {
            let free = (0..truths).filter(|&t| !taken[t] && row[t] < limit);
            if let Some(t) = free.min_by(|&a, &b| row[a].total_cmp(&row[b])) {
                taken[t] = true;
            }
        }
        taken.iter().filter(|t| **t).count()
    };
    let all: usize = limits.iter().map(|&l| found(l)).sum();
    (truths > 0 && !limits.is_empty()).then(|| all as f64 / (truths * limits.len()) as f64)
}

/// Truths of a type found by MSSD, summed over the benchmark's ten limits, and how many there could have been.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MssdScore {
    /// Truths found, each counted once a limit.
    pub found: usize,
    /// Truths that are scored, times the limits.
    pub possible: usize,
}

impl MssdScore {
    /// AR_MSSD; `None` without truths.
    pub fn average_recall(&self) -> Option<f64> {
        (self.possible > 0).then(|| self.found as f64 / self.possible as f64)
    }

    /// Both scenes pooled.
    pub fn plus(&self, other: &Self) -> Self {
        Self { found: self.found + other.found, possible: self.possible + other.possible }
    }
}

/// MSSD of the stated blocks of a scene, the surest first, against the true blocks less hidden than `occlusion_limit`; each type
/// by itself, as the benchmark has it.
pub fn score_mssd(
    estimates: &[Recognised],
    truths: &[TrueBlock],
    catalog: &Catalog,
    occlusion_limit: f32,
) -> MssdScore {
    let limits = limits();
    let mut score = MssdScore::default();
    for (id, model) in catalog.iter() {
        let mut stated: Vec<&Fit> =
            scene::stated(estimates).map(|(_, fit)| fit).filter(|fit| fit.model == id).collect();
        stated.sort_by(|a, b| b.confidence.unwrap_or(1.0).total_cmp(&a.confidence.unwrap_or(1.0)));
        let truths: Vec<&PlacedBlock> = truths
            .iter()
            .filter(|t| t.occlusion < occlusion_limit && t.placed.model == id)
            .map(|t| &t.placed)
            .collect();
        let corners = outline(&model.mesh);
        let diameter = diameter_m(&corners);
        let error = |e: usize, t: usize| {
            let (estimate, truth) = (&stated[e].site_from_block, &truths[t].site_from_block);
            // Centres that lie so far apart cannot be within the widest limit.
            let centre = |pose: &Pose| *pose * model.centre;
            if f64::from((centre(estimate) - centre(truth)).length()) > diameter {
                return f64::INFINITY;
            }
            mssd_m(&model.symmetry, &corners, estimate, truth) / diameter
        };
        if let Some(recall) = average_recall(stated.len(), truths.len(), error, &limits) {
            let possible = truths.len() * limits.len();
            score.found += (recall * possible as f64).round() as usize;
            score.possible += possible;
        }
    }
    score
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{BlockModel, ConvexPart};

    /// A flat box 0.1 × 0.06 × 0.02 m whose half turn about z changes nothing.
    fn slab() -> BlockModel {
        let half = Vec3::new(0.05, 0.03, 0.01);
        let vertices: Vec<Vec3> =
            (0..8).map(|i| half * Vec3::new(sign(i & 1), sign(i >> 1 & 1), sign(i >> 2))).collect();
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles =
            quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        let mesh = TriMesh { vertices: vertices.clone(), triangles };
        let rotations = vec![Quat::IDENTITY, Quat::from_rotation_z(std::f32::consts::PI)];
        BlockModel {
            name: "slab".into(),
            mesh,
            parts: vec![ConvexPart { corners: vertices }],
            parts_volume_ratio: 1.0,
            symmetry: SymmetryGroup::new(Vec3::ZERO, rotations),
            volume_m3: 1.2e-4,
            density_kg_m3: 7850.0,
            centre: Vec3::ZERO,
            d_max_m: half.length(),
            d_box_m: 0.1,
        }
    }

    fn sign(bit: i32) -> f32 {
        if bit == 0 { -1.0 } else { 1.0 }
    }

    fn pose(t: [f32; 3], z_rad: f32, x_rad: f32) -> Pose {
        let turn = Quat::from_rotation_z(z_rad) * Quat::from_rotation_x(x_rad);
        Pose::from_parts(Vec3::from_array(t), turn)
    }

    /// Values of `tools/oracle/bop_scores.py`, which follows the benchmark's formulas on its own in NumPy.
    #[test]
    fn agrees_with_the_oracle() {
        let slab = slab();
        let truth = pose([0.01, -0.02, 0.6], 0.3, 0.2);
        let cases = [
            (pose([0.012, -0.02, 0.603], 0.3, 0.2), MSSD[0], VSD[0]),
            (pose([0.01, -0.02, 0.6], 0.3 + 3.2, 0.2), MSSD[1], VSD[1]),
            (pose([0.03, -0.01, 0.61], 0.9, 0.5), MSSD[2], VSD[2]),
        ];
        let camera =
            Pinhole { size: [80, 60], focal_px: [300.0, 310.0], principal_px: [39.5, 29.5] };
        let seen = camera.distances_m(&slab.mesh, &truth);
        // A wall in front of the left part of the image hides what lies there; one row was not measured.
        let measured: Vec<f32> = (0..80 * 60)
            .map(|i| {
                if i / 80 == 30 {
                    0.0
                } else if i % 80 < 34 {
                    0.5
                } else {
                    seen[i]
                }
            })
            .collect();
        let corners = outline(&slab.mesh);
        assert_eq!(corners.len(), 8);
        let taus = [0.1 * diameter_m(&corners), 0.02 * diameter_m(&corners)];
        for (estimate, distance, discrepancy) in cases {
            let got = mssd_m(&slab.symmetry, &corners, &estimate, &truth);
            assert!((got - distance).abs() < 1e-6, "{got} {distance}");
            let image = camera.distances_m(&slab.mesh, &estimate);
            let got = vsd(&measured, &seen, &image, VISIBLE_M, &taus);
            for (g, w) in got.iter().zip(discrepancy) {
                // A pixel on an outline may fall either way in f32.
                assert!((g - w).abs() < 5e-3, "{got:?} {discrepancy:?}");
            }
        }
    }

    const MSSD: [f64; 3] =
        [0.003_605_551_275_463_992_6, 0.013_875_634_468_633_46, 0.051_927_292_126_707_186];
    const VSD: [[f64; 2]; 3] = [
        [0.035_685_320_356_853_206, 0.960_259_529_602_595_3],
        [0.036_585_365_853_658_534, 0.801_626_016_260_162_6],
        [0.624_028_690_974_297_8, 0.937_836_222_355_048_6],
    ];

    #[test]
    fn recall_is_averaged_over_limits_and_a_truth_is_found_once() {
        let error = |e: usize, t: usize| if t == 0 { [0.02, 0.01, 0.12][e] } else { 0.31 };
        let ar = average_recall(3, 2, error, &limits()).unwrap();
        // Truth 0 below every limit; truth 1 from .35 up, by the second estimate.
        assert!((ar - (10.0 + 4.0) / 20.0).abs() < 1e-12, "{ar}");
        assert_eq!(average_recall(0, 1, error, &limits()), Some(0.0));
        assert_eq!(average_recall(3, 0, error, &limits()), None);
    }

    #[test]
    fn nothing_to_see_is_a_complete_miss() {
        assert_eq!(vsd(&[0.0], &[0.0], &[0.0], VISIBLE_M, &[0.1]), [1.0]);
        assert_eq!(vsd(&[1.0], &[1.0], &[0.0], VISIBLE_M, &[0.1]), [1.0]);
        assert_eq!(vsd(&[1.0], &[1.0], &[1.001], VISIBLE_M, &[0.1]), [0.0]);
    }
}
