//! Whether the blocks are as large as the catalogue says: a free scale fitted to the blocks held best.
//!
//! In: a survey, blocks at their poses, the catalogue. Out, a type at a time: the size that fits, with its standard error.
//! Each block is fitted with its pose and a scale free together. Two kinds of observation hold the
//! scale: points near the surface, and, because a larger flat face fits the points of a smaller one as well, surface that
//! should have been seen beyond the last measured point. What one block says is rough; what a pile agrees on is not, and the
//! spread between blocks is the standard error.

use crate::fit::{CentredPose, FitPoint, agreement};
use crate::measured::{facing, to_sensor};
use crate::sight::{Seen, Sight};
use crate::viewpoint::Viewpoint;
use geom::{DistanceField, MeshError, PointGrid, Pose, SeedTree, Vec3, thin_from_lowest};
use rayon::prelude::*;
use scene::{BlockModel, Catalog, ModelId, Survey};

/// A deviation from here on, when it is significant, is worth a warning.
pub const WARNED_FROM: f32 = 0.015;
/// A deviation from here on, when it is significant, and no block may be stated.
pub const REFUSED_FROM: f32 = 0.04;
/// So many standard errors make a deviation significant.
pub(crate) const SIGNIFICANT: f32 = 3.0;
/// Least standard error: meshes and surveys err in common by about this share.
const LEAST_ERROR: f32 = 0.001;
/// Working points a block, at most.
const MOST_POINTS: usize = 1500;
/// Fewest points a scale is fitted to.
const FEWEST_POINTS: usize = 40;
/// Surface samples of each block.
const SAMPLES: usize = 600;
/// Gauss-Newton steps, of which the first take points from far.
const ROUNDS: usize = 14;
const WIDE_ROUNDS: usize = 4;
/// Free parameters: pose, offset and scale.
const FREE: usize = 8;
/// Place of the scale among them.
const SCALE: usize = 7;
/// By how much surfaces are moved outwards all over (an echo sounder fattens them), standard deviation in that of a point: a
/// block may look thicker than its mesh and be no larger.
const OFFSET: f32 = 0.5;
/// Surface may reach past the last point by so many spacings: the outermost points lie inside an edge.
const GAP: f32 = 1.0;
/// What surface nobody measured at all counts against surface that was looked through.
const UNKNOWN: f32 = 0.3;

/// What the survey says of one length of a type, as a factor on the catalogue's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// What the catalogue's length must be multiplied by.
    pub factor: f32,
    /// Its standard error.
    pub factor_sd: f32,
    /// How many blocks say so.
    pub blocks: usize,
}

impl Scale {
    /// How far the factor is from 1, where that is significant; else 0.
    pub fn deviation(&self) -> f32 {
        let off = (self.factor - 1.0).abs();
        if off > SIGNIFICANT * self.factor_sd { off } else { 0.0 }
    }
}

/// The size of each type that `blocks` (type and pose, site from block) hold, as a factor on the catalogue's, in its order; types
/// that the survey tells nothing of are left out.
///
/// `noise_sd_m` is the standard deviation of a point. Errors: a mesh that is not closed.
pub fn check_sizes(
    survey: &Survey,
    blocks: &[(ModelId, Pose)],
    catalog: &Catalog,
    noise_sd_m: f32,
    seed: SeedTree,
) -> Result<Vec<(ModelId, Scale)>, MeshError> {
    let mut found = Vec::new();
    for (id, model) in catalog.iter() {
        if !blocks.iter().any(|b| b.0 == id) {
            continue;
        }
        let target = Target::new(model, seed.child("size", u64::from(id.0)))?;
        let work = Work::new(survey, model.d_max_m, noise_sd_m);
        let own: Vec<usize> = (0..blocks.len()).filter(|&i| blocks[i].0 == id).collect();
        let sees = |i: usize| {
            let at = CentredPose::of(&blocks[i].1, model.centre);
            let near = work.points_of(i, blocks, catalog, &target);
            (near.len() >= FEWEST_POINTS)
                .then(|| work.fit(&target, &near, at, noise_sd_m))
                .flatten()
        };
        let single: Vec<Held> = own.par_iter().filter_map(|&i| sees(i)).collect();
        // Where blocks differ from the mesh by more than points scatter, the size has no sharper meaning than that.
        let mut misfit: Vec<f32> = single.iter().map(|h| h.misfit).collect();
        misfit.sort_by(f32::total_cmp);
        let misfit = misfit.get(misfit.len() / 2).copied().unwrap_or(0.0);
        let told = agreed(single.iter().map(|h| (h.scale, h.scale_sd)));
        found.extend(told.map(|s| (id, Scale { factor_sd: s.factor_sd.hypot(misfit), ..s })));
    }
    Ok(found)
}

/// What several blocks agree on: a mean weighted by what each knows, outliers left out, its error from their spread.
fn agreed(told: impl Iterator<Item = (f32, f32)>) -> Option<Scale> {
    let mut told: Vec<(f32, f32)> = told.filter(|t| t.0.is_finite() && t.1 < 0.05).collect();
    if told.is_empty() {
        return None;
    }
    told.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = told[told.len() / 2].0;
    let mut off: Vec<f32> = told.iter().map(|t| (t.0 - median).abs()).collect();
    off.sort_by(f32::total_cmp);
    let spread = 1.48 * off[off.len() / 2];
    let gate = (3.0 * spread).max(0.004);
    let kept: Vec<(f32, f32)> =
        told.into_iter().filter(|t| (t.0 - median).abs() <= gate.max(3.0 * t.1)).collect();
    // A block's own error says how blocks compare, the spread between them how far all of them err.
    let weight = |sd: f32| 1.0 / (sd * sd + spread * spread + 1e-6);
    let total: f32 = kept.iter().map(|t| weight(t.1)).sum();
    let factor = kept.iter().map(|t| t.0 * weight(t.1)).sum::<f32>() / total;
    let n = kept.len() as f32;
    let about = kept.iter().map(|t| (t.0 - factor).powi(2)).sum::<f32>() / (n - 1.0).max(1.0);
    let between = if kept.len() > 2 { (about / n).sqrt() } else { 0.0 };
    let factor_sd = between.max(total.recip().sqrt()).max(LEAST_ERROR);
    Some(Scale { factor, factor_sd, blocks: kept.len() })
}

/// A type ready to be fitted.
pub(crate) struct Target<'a> {
    model: &'a BlockModel,
    field: DistanceField,
    samples: Vec<(Vec3, Vec3)>,
    sample_area_m2: f32,
    /// All faces along the axes of the mesh: its edges hold its size.
    is_box: bool,
}

impl<'a> Target<'a> {
    pub(crate) fn new(model: &'a BlockModel, seed: SeedTree) -> Result<Self, MeshError> {
        let field = DistanceField::new(&model.mesh, 72, 0.3 * model.d_max_m)?;
        let samples = model.mesh.sample_surface(SAMPLES, &mut seed.rng());
        let along = |n: Vec3| n.abs().max_element() > 0.9999;
        let is_box = (0..model.mesh.triangles.len()).all(|t| along(model.mesh.triangle_normal(t)));
        let sample_area_m2 = model.mesh.area_m2() / SAMPLES as f32;
        Ok(Self { model, field, samples, sample_area_m2, is_box })
    }
}

/// The survey as the fits see it: thinned, with normals and what the sensor saw.
pub(crate) struct Work {
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    to_sensor: Vec<Vec3>,
    grid: PointGrid,
    sight: Sight,
    spacing_m: f32,
}

/// Pose and scale of one block.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    /// The pose at which the scale holds.
    pub at: CentredPose,
    /// Factor on all lengths.
    pub scale: f32,
    /// Its standard deviation.
    pub scale_sd: f32,
    /// How far points are off beyond their scatter, in d_max.
    pub misfit: f32,
    /// How far the surface lies outside of the scaled mesh, metres.
    pub offset_m: f32,
}

impl CentredPose {
    /// From a pose of the mesh file's frame.
    pub(crate) fn of(pose: &Pose, block_centre: Vec3) -> Self {
        Self { rotation: pose.rotation, centre: *pose * block_centre }
    }
}

impl Work {
    pub(crate) fn new(survey: &Survey, d_max_m: f32, noise_sd_m: f32) -> Self {
        let all = &survey.cloud.position_m;
        let cell_m = d_max_m / 32.0;
        let kept = thin_from_lowest(all, cell_m).kept;
        let position: Vec<Vec3> = kept.iter().map(|&i| all[i as usize]).collect();
        let grid = PointGrid::new(&position, 2.0 * cell_m);
        let spacing_m = spacing_m(&position, &grid, cell_m);
        let sensors = &survey.sensor_positions;
        let far = sensors.is_empty().then(|| Viewpoint::likeliest(&position, spacing_m, d_max_m));
        let to_sensor = to_sensor(survey, far.as_ref(), &position, spacing_m, d_max_m);
        let radius_m = (2.6 * cell_m.max(spacing_m)).max(3.5 * noise_sd_m).min(0.3 * d_max_m);
        let normal = facing(geom::normals(&position, radius_m, &|_| Vec3::Z), &to_sensor);
        let sight = match &far {
            Some(far) => Sight::from_afar(&position, &far.toward, spacing_m),
            None => Sight::new(&position, sensors, spacing_m),
        };
        Self { position, normal, to_sensor, grid, sight, spacing_m }
    }

    /// Points that may be of block `i`: near its surface and nearer to no other block.
    fn points_of(
        &self,
        i: usize,
        blocks: &[(ModelId, Pose)],
        catalog: &Catalog,
        target: &Target,
    ) -> Vec<FitPoint> {
        let d_max = target.model.d_max_m;
        let shell = 0.1 * d_max;
        let at = CentredPose::of(&blocks[i].1, target.model.centre);
        let block_from_site = blocks[i].1.inverse();
        let rivals: Vec<(Vec3, f32)> = blocks
            .iter()
            .enumerate()
            .filter(|&(k, _)| k != i)
            .map(|(_, b)| (b.1 * catalog.get(b.0).centre, catalog.get(b.0).d_max_m))
            .filter(|(c, r)| (*c - at.centre).length() < d_max + shell + r)
            .collect();
        let same: Vec<Pose> = blocks
            .iter()
            .enumerate()
            .filter(|&(k, b)| k != i && b.0 == target_id(blocks, i))
            .map(|(_, b)| b.1.inverse())
            .collect();
        let mut near = Vec::new();
        self.grid.for_each_within(at.centre, d_max + shell, |k, p, _| {
            let d = target.field.distance_m(block_from_site * p).abs();
            if d > shell {
                return;
            }
            let contested = rivals.iter().any(|(c, r)| (p - *c).length() < *r + shell)
                && same.iter().any(|q| target.field.distance_m(*q * p).abs() < d);
            if !contested {
                near.push(k);
            }
        });
        near.sort_unstable();
        let stride = near.len().div_ceil(MOST_POINTS).max(1);
        near.into_iter().step_by(stride).map(|k| self.fit_point(k as usize)).collect()
    }

    fn fit_point(&self, k: usize) -> FitPoint {
        FitPoint {
            position: self.position[k],
            normal: self.normal[k],
            to_sensor: self.to_sensor[k],
        }
    }

    /// Pose and scale together; `None` when the points do not hold the scale.
    pub(crate) fn fit(
        &self,
        target: &Target,
        points: &[FitPoint],
        start: CentredPose,
        noise_sd_m: f32,
    ) -> Option<Held> {
        let d = target.model.d_max_m;
        let sd = noise_sd_m.max(0.3 * target.field.cell_m());
        let mut fine = 2.0 * sd;
        let mut held =
            Held { at: start, scale: 1.0, scale_sd: f32::INFINITY, misfit: 0.0, offset_m: 0.0 };
        let wide = (0.06 * d).max(fine);
        for round in 0..ROUNDS {
            if round == WIDE_ROUNDS {
                // What the survey makes of edges and faces is wider than the noise of its points.
                fine = (2.5 * typical_m(target, points, &held)).clamp(fine, wide);
            }
            let width = if round < WIDE_ROUNDS { wide } else { fine };
            let mut system = System::new();
            for point in points {
                system.add_point(target, point, &held, width);
            }
            self.add_unseen(&mut system, target, &held, points.len(), width);
            system.hold_offset(&held, 0.4 * width, OFFSET * noise_sd_m);
            let step = system.solve()?;
            held.apply(&step, d);
            if round > WIDE_ROUNDS && step.iter().all(|s| s.abs() < 1e-4 * d) {
                break;
            }
        }
        let mut system = System::new();
        points.iter().for_each(|p| system.add_point(target, p, &held, fine));
        self.add_unseen(&mut system, target, &held, points.len(), fine);
        system.hold_offset(&held, 0.4 * fine, OFFSET * noise_sd_m);
        // A few neighbouring points err together and count as one.
        let variance = system.variance()?;
        held.scale_sd = (variance[SCALE] * 4.0).sqrt() * (0.4 * fine) / d;
        let typical = typical_m(target, points, &held);
        held.misfit = (typical * typical - sd * sd).max(0.0).sqrt() / d;
        let sane = (0.6..1.6).contains(&held.scale);
        (sane && system.kept > 0.25 * points.len() as f32).then_some(held)
    }

    /// Surface the sensor should have seen and did not, pulled to the nearest measured point along the face.
    fn add_unseen(
        &self,
        system: &mut System,
        target: &Target,
        held: &Held,
        points: usize,
        width: f32,
    ) {
        // Round surfaces hold their size without; at their outlines the pull would be noise.
        if !target.is_box {
            return;
        }
        let d = target.model.d_max_m;
        let gap = GAP * self.spacing_m;
        let reach = 0.12 * d;
        // One sample stands for as many points as lie on its area.
        let worth = (target.sample_area_m2 / (self.spacing_m * self.spacing_m))
            .min(points as f32 / SAMPLES as f32 * 4.0);
        for &(p, n) in &target.samples {
            let x = held.site(p - target.model.centre);
            let n = held.at.rotation * n;
            let at = held.at.centre + x;
            let worth = match self.sight.of_surface(at, n, width) {
                Some(Seen::Through | Seen::Here) => worth,
                Some(Seen::Unknown) => UNKNOWN * worth,
                _ => continue,
            };
            let Some((nearest, _)) = self.grid.nearest_within(at, reach) else { continue };
            let off = self.position[nearest as usize] - at;
            let along = off - n * off.dot(n);
            let length = along.length();
            if length <= gap || off.dot(n).abs() > 0.5 * reach {
                continue;
            }
            let toward = along / length;
            // The surface must move by `length − gap` along `toward`.
            system.add(target, x, toward, length - gap, worth, 2.0 * width);
        }
    }
}

/// Median distance of the nearer half of the points from the surface, metres, as a standard deviation.
fn typical_m(target: &Target, points: &[FitPoint], held: &Held) -> f32 {
    let block_from_site = held.at.rotation.inverse();
    let mut off: Vec<f32> = points
        .iter()
        .map(|p| {
            let own = block_from_site * (p.position - held.at.centre) / held.scale;
            target.field.distance_m(own + target.model.centre).abs()
        })
        .collect();
    off.sort_by(f32::total_cmp);
    1.4826 * off.get(off.len() * 45 / 100).copied().unwrap_or(0.0)
}

fn target_id(blocks: &[(ModelId, Pose)], i: usize) -> ModelId {
    blocks[i].0
}

impl Held {
    /// Offset from the centre, site axes, of a place of the unscaled block.
    fn site(&self, from_centre: Vec3) -> Vec3 {
        self.at.rotation * (from_centre * self.scale)
    }

    fn apply(&mut self, step: &[f32; FREE], d_max_m: f32) {
        let shift = Vec3::new(step[0], step[1], step[2]).clamp_length_max(0.1 * d_max_m);
        let turn = Vec3::new(step[3], step[4], step[5]).clamp_length_max(0.1 * d_max_m) / d_max_m;
        self.at.centre += shift;
        self.at.rotation = (geom::Quat::from_scaled_axis(turn) * self.at.rotation).normalize();
        self.offset_m += step[6].clamp(-0.02 * d_max_m, 0.02 * d_max_m);
        self.scale *= (step[SCALE] / d_max_m).clamp(-0.05, 0.05).exp();
    }
}

/// Weighted normal equations of pose, offset and scale.
struct System {
    a: [[f64; FREE]; FREE],
    b: [f64; FREE],
    kept: f32,
}

impl System {
    fn new() -> Self {
        Self { a: [[0.0; FREE]; FREE], b: [0.0; FREE], kept: 0.0 }
    }

    fn add_point(&mut self, target: &Target, point: &FitPoint, held: &Held, width: f32) {
        let x = point.position - held.at.centre;
        let own = held.at.rotation.inverse() * x / held.scale;
        let (d, g) = target.field.at(own + target.model.centre);
        // Distance in site metres to first order: the surface moves with the scale.
        let slope = (g / held.scale).length().recip();
        let face = held.at.rotation * (g / held.scale).normalize_or_zero();
        let agree = agreement(face, point);
        let d = d * slope - held.offset_m;
        self.kept += agree * width * width / (width * width + d * d);
        self.add(target, x, face, d, agree, width);
    }

    /// One observation: the surface at `x` from the centre must move by `d` along `along`.
    #[allow(clippy::too_many_arguments)]
    fn add(&mut self, target: &Target, x: Vec3, along: Vec3, d: f32, weight: f32, width: f32) {
        let keep = width * width / (width * width + d * d);
        let w = f64::from(weight * keep * keep);
        if w < 1e-6 {
            return;
        }
        let unit = target.model.d_max_m;
        let r = x.cross(along) / unit;
        // A place of the surface moves by its own offset for each unit of the logarithm of the scale.
        let grown = x.dot(along) / unit;
        let j = [along.x, along.y, along.z, r.x, r.y, r.z, 1.0, grown];
        for i in 0..FREE {
            self.b[i] += w * f64::from(j[i]) * f64::from(d);
            for k in 0..FREE {
                self.a[i][k] += w * f64::from(j[i]) * f64::from(j[k]);
            }
        }
    }

    /// What is known of the offset beforehand, against observations of the given standard deviation.
    fn hold_offset(&mut self, held: &Held, sd_m: f32, offset_sd_m: f32) {
        // Observations come with weight 1 and count a quarter each.
        let weight = f64::from(4.0 * (sd_m / offset_sd_m.max(1e-4 * sd_m)).powi(2));
        self.a[6][6] += weight;
        self.b[6] -= weight * f64::from(held.offset_m);
    }

    fn solve(&self) -> Option<[f32; FREE]> {
        let l = self.cholesky(1e-6)?;
        let x = self.substitute(&l, &self.b);
        Some(x.map(|v| v as f32))
    }

    /// Diagonal of the inverse.
    fn variance(&self) -> Option<[f32; FREE]> {
        let l = self.cholesky(1e-9)?;
        let mut out = [f32::INFINITY; FREE];
        for (k, out) in out.iter_mut().enumerate() {
            let mut unit = [0.0; FREE];
            unit[k] = 1.0;
            *out = self.substitute(&l, &unit)[k] as f32;
        }
        Some(out)
    }

    fn cholesky(&self, damping: f64) -> Option<[[f64; FREE]; FREE]> {
        let trace: f64 = (0..FREE).map(|i| self.a[i][i]).sum();
        if !(trace.is_finite() && trace > 1e-9) {
            return None;
        }
        let mut l = self.a;
        for i in 0..FREE {
            l[i][i] += damping * trace;
            for k in 0..=i {
                let sum = l[i][k] - (0..k).map(|m| l[i][m] * l[k][m]).sum::<f64>();
                l[i][k] = if i == k {
                    if sum <= 0.0 {
                        return None;
                    }
                    sum.sqrt()
                } else {
                    sum / l[k][k]
                };
            }
        }
        Some(l)
    }

    fn substitute(&self, l: &[[f64; FREE]; FREE], b: &[f64; FREE]) -> [f64; FREE] {
        let mut x = *b;
        for i in 0..FREE {
            x[i] = (x[i] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
        }
        for i in (0..FREE).rev() {
            x[i] = (x[i] - (i + 1..FREE).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
        }
        x
    }
}

/// Typical distance between points from the area of discs, metres.
fn spacing_m(position: &[Vec3], grid: &PointGrid, cell_m: f32) -> f32 {
    let step = position.len().div_ceil(400).max(1);
    let mut area: Vec<f32> = position
        .iter()
        .step_by(step)
        .map(|&p| {
            let (mut n, mut radius) = (0.0_f32, 3.0 * cell_m);
            for _ in 0..5 {
                n = 0.0;
                grid.for_each_within(p, radius, |_, _, _| n += 1.0);
                if n >= 8.0 {
                    break;
                }
                radius *= 1.6;
            }
            std::f32::consts::PI * radius * radius / n.max(1.0)
        })
        .collect();
    area.sort_by(f32::total_cmp);
    area.get(area.len() / 2).map_or(cell_m, |a| a.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gauss::normal;
    use geom::{PointCloud, Quat};
    use rand::{Rng, RngExt};
    use scene::Shape;

    /// Gaussian numbers without another dependency: the sum of twelve even ones.
    mod gauss {
        use rand::{Rng, RngExt};

        pub fn normal(rng: &mut impl Rng) -> f32 {
            (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0
        }
    }

    fn model(shape: Shape) -> BlockModel {
        blocks::shape_model("block", shape, 2300.0).unwrap()
    }

    fn turn(rng: &mut impl Rng) -> Quat {
        let q: [f32; 4] = std::array::from_fn(|_| normal(rng));
        Quat::from_array(q).normalize()
    }

    /// Blocks of `true_model` apart from each other, their upper sides scanned; poses as a fit with another size leaves them:
    /// a little off.
    fn scene(true_model: &BlockModel, noise_m: f32, seed: u64) -> (Survey, Vec<(ModelId, Pose)>) {
        let mut rng = SeedTree::new(seed).rng();
        let query = geom::MeshQuery::new(&true_model.mesh).unwrap();
        let (mut points, mut blocks) = (Vec::new(), Vec::new());
        for k in 0..8 {
            let at = Vec3::new(4.0 * (k % 4) as f32, 4.0 * (k / 4) as f32, 1.0);
            let pose = Pose::from_parts(at, turn(&mut rng));
            let up = pose.rotation.inverse() * Vec3::Z;
            let samples = true_model.mesh.sample_surface(5000, &mut rng);
            for (p, n) in samples {
                if (pose.rotation * n).z > 0.1 && query.cast_ray(p + n * 1e-3, up, 10.0).is_none() {
                    let off = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
                    points.push(pose * p + off * noise_m);
                }
            }
            let off = Vec3::new(rng.random(), rng.random(), rng.random()) - Vec3::splat(0.5);
            let moved = Pose::from_parts(at + off * 0.02, pose.rotation);
            blocks.push((ModelId(0), moved));
        }
        (Survey { cloud: PointCloud::from_positions(points), ..Survey::default() }, blocks)
    }

    fn check(true_model: &BlockModel, stated: &BlockModel, noise_m: f32, seed: u64) -> Scale {
        let (survey, blocks) = scene(true_model, noise_m, seed);
        let catalog = Catalog::new(vec![stated.clone()]);
        check_sizes(&survey, &blocks, &catalog, noise_m, SeedTree::new(1)).unwrap()[0].1
    }

    /// A catalogue wrong by 5 % was once silent, its poses 44 mm off.
    #[test]
    fn the_size_comes_back_whatever_the_catalogue_says() {
        let shapes = [Shape::Tetrapod { size: 2.0 }, Shape::Dolos { size: 2.2 }];
        for (n, shape) in shapes.into_iter().enumerate() {
            let true_model = model(shape);
            for factor in [1.0, 0.95, 1.05, 0.975] {
                let stated = true_model.scaled(factor);
                let check = check(&true_model, &stated, 0.01, 40 + n as u64);
                let found = check.factor * factor;
                assert!((found - 1.0).abs() < 0.01, "{shape:?} × {factor}: {check:?}");
                // A wrong size is told from a right one by its own standard error.
                assert_eq!(
                    check.deviation() > WARNED_FROM,
                    factor != 1.0,
                    "{shape:?} × {factor}: {check:?}"
                );
            }
        }
    }

    /// One side of a box holds its size by the ends of its faces alone: within 2 %, not 1.
    #[test]
    fn the_size_of_a_box_comes_back_from_its_edges() {
        let cube = model(Shape::Cube { size: 1.6 });
        for factor in [1.0, 0.95, 1.05] {
            let check = check(&cube, &cube.scaled(factor), 0.01, 77);
            assert!((check.factor * factor - 1.0).abs() < 0.02, "× {factor}: {check:?}");
        }
    }

    #[test]
    fn nothing_is_said_of_types_nobody_found() {
        let catalog = Catalog::new(vec![model(Shape::Cube { size: 1.0 })]);
        let none = check_sizes(&Survey::default(), &[], &catalog, 0.01, SeedTree::new(1)).unwrap();
        assert!(none.is_empty());
    }
}
