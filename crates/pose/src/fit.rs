//! Robust Gauss-Newton of a block's pose on its signed distance field.
//!
//! In: points with normals and directions to the sensor, a starting pose, a scale. Out: a better pose. Every point
//! pulls the surface towards it with the weight of Geman and McClure at the given scale, so that annealing the scale
//! from a quarter of the block to the noise leads from a guess to the noise floor while foreign points lose their
//! say. A point is never explained by a face the sensor could not have seen, nor by one its normal contradicts.

use geom::{DistanceField, Mat3, Pose, Quat, Vec3};

/// A point of a segment.
#[derive(Clone, Copy, Debug)]
pub struct FitPoint {
    /// Position.
    pub position: Vec3,
    /// Unit normal, or zero.
    pub normal: Vec3,
    /// Unit direction to the sensor.
    pub to_sensor: Vec3,
}

/// Pose of a block by rotation and the place of its centre: both move independently.
#[derive(Clone, Copy, Debug)]
pub struct CentredPose {
    /// Rotation, block to site.
    pub rotation: Quat,
    /// The block's centre, site.
    pub centre: Vec3,
}

impl CentredPose {
    /// As a pose of the mesh file's frame.
    pub fn pose(&self, block_centre: Vec3) -> Pose {
        Pose::from_parts(self.centre - self.rotation * block_centre, self.rotation)
    }
}

/// The target of a fit.
#[derive(Clone, Copy)]
pub struct FitModel<'a> {
    /// Distance field, block coordinates.
    pub field: &'a DistanceField,
    /// The block's centre, block coordinates.
    pub centre: Vec3,
    /// Largest centre-to-surface distance, metres; makes turns and shifts comparable.
    pub d_max_m: f32,
}

/// How much a face with outward normal `face` can be what was measured as `point`: 0 to 1.
#[inline]
pub fn agreement(face: Vec3, point: &FitPoint) -> f32 {
    if face.dot(point.to_sensor) < -0.25 {
        return 0.0;
    }
    if point.normal == Vec3::ZERO {
        return 0.6;
    }
    let along = face.dot(point.normal);
    // The sign of a normal across the view is a guess.
    let along = if point.normal.dot(point.to_sensor).abs() < 0.3 { along.abs() } else { along };
    0.05 + 0.95 * along.max(0.0)
}

/// The normal equations of one step.
struct Normal {
    a: [[f32; 6]; 6],
    b: [f32; 6],
    /// Sum of 1 − ρ(d) over the points, times their agreement.
    score: f32,
}

fn assemble(model: &FitModel, points: &[FitPoint], at: &CentredPose, scale_m: f32) -> Normal {
    let site_from_block = Mat3::from_quat(at.rotation);
    let block_from_site = site_from_block.transpose();
    let s2 = scale_m * scale_m;
    let turn = model.d_max_m.recip();
    let mut a = [[0.0_f32; 6]; 6];
    let mut b = [0.0_f32; 6];
    let mut score = 0.0;
    for point in points {
        let x = point.position - at.centre;
        let (d, g) = model.field.at(block_from_site * x + model.centre);
        let g = site_from_block * g;
        let agree = agreement(g, point);
        let keep = s2 / (s2 + d * d);
        score += agree * keep;
        let w = agree * keep * keep;
        if w < 1e-5 {
            continue;
        }
        // d moves by −g·t − ω·(x × g) when the block moves by t and turns by ω about its centre.
        let r = x.cross(g) * turn;
        let j = [g.x, g.y, g.z, r.x, r.y, r.z];
        for i in 0..6 {
            let wj = w * j[i];
            b[i] += wj * d;
            for k in 0..=i {
                a[i][k] += wj * j[k];
            }
        }
    }
    Normal { a, b, score }
}

/// Cholesky solution of the damped equations; `None` when they say nothing at all.
pub fn solve(a: &[[f32; 6]; 6], b: &[f32; 6], damping: f32) -> Option<[f32; 6]> {
    let trace: f32 = (0..6).map(|i| a[i][i]).sum();
    if !(trace.is_finite() && trace > 1e-9) {
        return None;
    }
    let mut l = *a;
    for (i, row) in l.iter_mut().enumerate() {
        row[i] += damping * trace / 6.0;
    }
    for i in 0..6 {
        for k in 0..=i {
            let mut sum = l[i][k];
            for m in 0..k {
                sum -= l[i][m] * l[k][m];
            }
            if i == k {
                l[i][i] = sum.max(1e-12 * trace).sqrt();
            } else {
                l[i][k] = sum / l[k][k];
            }
        }
    }
    let mut x = *b;
    for i in 0..6 {
        for k in 0..i {
            x[i] -= l[i][k] * x[k];
        }
        x[i] /= l[i][i];
    }
    for i in (0..6).rev() {
        for k in i + 1..6 {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Gauss-Newton steps, one for each scale; returns the pose and its score at the last scale before the last step.
pub fn fit(
    model: &FitModel,
    points: &[FitPoint],
    start: CentredPose,
    scales_m: &[f32],
) -> (CentredPose, f32) {
    let mut at = start;
    let mut score = 0.0;
    for &scale_m in scales_m {
        let normal = assemble(model, points, &at, scale_m);
        score = normal.score;
        let Some(step) = solve(&normal.a, &normal.b, 1e-3) else { break };
        let shift = Vec3::new(step[0], step[1], step[2]);
        let turn = Vec3::new(step[3], step[4], step[5]) / model.d_max_m;
        // Half a block or a radian is as far as the linear model can be trusted.
        let shift = shift.clamp_length_max(0.5 * model.d_max_m);
        let turn = turn.clamp_length_max(0.7);
        at.centre += shift;
        at.rotation = (Quat::from_scaled_axis(turn) * at.rotation).normalize();
    }
    (at, score)
}

/// A piece of a block whose points err together is this part of d_max wide.
const PIECE: f32 = 0.4;
/// How far whole pieces are off by what no survey shows of itself (roughness of the block, registration): this part of
/// the noise and this part of d_max.
const PIECE_NOISE: f32 = 0.25;
const PIECE_D_MAX: f32 = 0.001;

/// Covariance of a fitted pose — (tx, ty, tz, rx, ry, rz) about the block's centre, site axes, row-major — from the
/// curvature at the solution and the residuals; `None` when the points leave a direction free.
///
/// Points of one piece of surface err together, so that residuals are summed piece by piece before they are squared
/// (the cluster-robust covariance of Liang and Zeger 1986). Counting every point for itself gave standard deviations
/// that were a sixth to a twentieth of the errors.
pub fn covariance(
    model: &FitModel,
    points: &[FitPoint],
    at: &CentredPose,
    noise_sd_m: f32,
) -> Option<[f32; 36]> {
    let scale_m = 2.0 * noise_sd_m;
    let normal = assemble(model, points, at, scale_m);
    let trace: f32 = (0..6).map(|i| normal.a[i][i]).sum();
    if !(trace.is_finite() && trace > 0.0) {
        return None;
    }
    let middle = spread(model, points, at, scale_m, noise_sd_m);
    let mut columns = [[0.0_f32; 6]; 6];
    for (k, column) in columns.iter_mut().enumerate() {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        *column = solve(&normal.a, &unit, 1e-7)?;
    }
    let mut out = [0.0_f32; 36];
    for i in 0..6 {
        for k in 0..6 {
            let turns = i32::from(i >= 3) + i32::from(k >= 3);
            let mut sum = 0.0;
            for m in 0..6 {
                for n in 0..6 {
                    sum += columns[i][m] * middle[m][n] * columns[k][n];
                }
            }
            out[i * 6 + k] = sum * model.d_max_m.powi(-turns);
        }
    }
    let free = (0..6).any(|i| !out[i * 7].is_finite() || out[i * 7] < 0.0);
    (!free).then_some(out)
}

/// How the right side of the normal equations scatters: piece by piece, with what pieces and points err at least.
fn spread(
    model: &FitModel,
    points: &[FitPoint],
    at: &CentredPose,
    scale_m: f32,
    noise_sd_m: f32,
) -> [[f32; 6]; 6] {
    let site_from_block = Mat3::from_quat(at.rotation);
    let block_from_site = site_from_block.transpose();
    let piece_m = PIECE * model.d_max_m;
    let mut rows: Vec<([i32; 3], [f32; 6], f32)> = points
        .iter()
        .filter_map(|point| {
            let x = point.position - at.centre;
            let local = block_from_site * x;
            let (d, g) = model.field.at(local + model.centre);
            let g = site_from_block * g;
            let keep = scale_m * scale_m / (scale_m * scale_m + d * d);
            let w = agreement(g, point) * keep * keep;
            let r = x.cross(g) / model.d_max_m;
            let j = [g.x, g.y, g.z, r.x, r.y, r.z].map(|v| v * w);
            let piece = (local / piece_m).floor().to_array().map(|v| v as i32);
            (w >= 1e-5).then_some((piece, j, d))
        })
        .collect();
    rows.sort_by_key(|row| row.0);
    let own = (PIECE_NOISE * noise_sd_m).powi(2) + (PIECE_D_MAX * model.d_max_m).powi(2);
    let mut middle = [[0.0_f32; 6]; 6];
    let mut add = |v: &[f32; 6], weight: f32| {
        for i in 0..6 {
            for k in 0..6 {
                middle[i][k] += weight * v[i] * v[k];
            }
        }
    };
    for piece in rows.chunk_by(|a, b| a.0 == b.0) {
        let (mut residual, mut all) = ([0.0_f32; 6], [0.0_f32; 6]);
        for (_, j, d) in piece {
            add(j, noise_sd_m * noise_sd_m);
            for i in 0..6 {
                residual[i] += j[i] * d;
                all[i] += j[i];
            }
        }
        add(&residual, 1.0);
        add(&all, own);
    }
    middle
}
