//! The proper symmetry group of any solid mesh, found from its surface.
//!
//! A rotation is a symmetry when it carries the surface onto itself within a tolerance. Axes are searched over
//! the hemisphere on a distance field, refined on the mesh, sorted into one of the few kinds of finite groups
//! (cyclic, dihedral, tetrahedral, octahedral, icosahedral), and every element of the ideal group is
//! checked on the mesh before it counts. A body of revolution is sampled and flagged.

use crate::rotation_group::closure;
use geom::{Mat3, MeshError, MeshQuery, Quat, SeedTree, TriMesh, Vec3};
use rayon::prelude::*;
use scene::SymmetryGroup;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What counts as a symmetry. Lengths are shares of d_max.
#[derive(Clone, Debug, PartialEq)]
pub struct SymmetryConfig {
    /// Root mean square distance between the turned and the original surface.
    pub rms_tolerance: f32,
    /// Largest distance.
    pub max_tolerance: f32,
    /// Points compared: the outermost vertices and as many drawn over the surface.
    pub samples: usize,
    /// Spacing of the axes tried first.
    pub axis_step_rad: f32,
    /// Highest order of an axis looked for; rounder bodies are bodies of revolution.
    pub max_order: u32,
    /// Turns that stand for a body of revolution.
    pub revolution_steps: u32,
}

impl Default for SymmetryConfig {
    fn default() -> Self {
        Self {
            rms_tolerance: 0.008,
            max_tolerance: 0.03,
            samples: 500,
            axis_step_rad: 0.05,
            max_order: 12,
            revolution_steps: 36,
        }
    }
}

/// The group of a solid about its centre of mass. Errors: the mesh is no solid.
pub fn find_symmetry(mesh: &TriMesh, config: &SymmetryConfig) -> Result<SymmetryGroup, MeshError> {
    let centre = mesh.moments().centroid;
    let d_max = mesh.vertices.iter().map(|v| (*v - centre).length()).fold(0.0, f32::max);
    let unit = mesh.map(|v| (v - centre) / d_max);
    let surface = Surface::new(&unit, config)?;
    let axes = axes(&surface, config);

    let round: Vec<&Axis> = axes.iter().filter(|a| a.order == Order::Any).collect();
    if let Some(first) = round.first() {
        if round.iter().any(|a| a.direction.dot(first.direction).abs() < 0.9) {
            // A ball: the largest rotation group of a polyhedron samples it evenly.
            let ball = icosahedral(Vec3::Z, Vec3::X);
            return Ok(SymmetryGroup::new(centre, ball));
        }
        let turn = turn(first.direction, config.revolution_steps);
        let across = axes.iter().find(|a| a.direction.dot(first.direction).abs() < 0.1);
        let ends = across.map(|a| {
            (a.direction - first.direction * a.direction.dot(first.direction)).normalize()
        });
        let generators: Vec<Quat> =
            [turn].into_iter().chain(ends.map(|e| Quat::from_axis_angle(e, PI))).collect();
        let rotations = closure(&generators, 2 * config.revolution_steps as usize);
        return Ok(SymmetryGroup::new(centre, rotations).about_axis(first.direction));
    }
    let rotations = candidates(&axes)
        .into_iter()
        .find(|group| group.iter().all(|&q| surface.is_symmetry(q)))
        .unwrap_or_else(|| vec![Quat::IDENTITY]);
    Ok(SymmetryGroup::new(centre, rotations))
}

/// How often the body repeats in a full turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Order {
    Fold(u32),
    Any,
}

#[derive(Clone, Copy, Debug)]
struct Axis {
    direction: Vec3,
    order: Order,
}

fn turn(axis: Vec3, fold: u32) -> Quat {
    Quat::from_axis_angle(axis, TAU / fold as f32)
}

/// Ideal groups the axes suggest, the largest first.
fn candidates(axes: &[Axis]) -> Vec<Vec<Quat>> {
    let of =
        |fold: u32| axes.iter().filter(move |a| matches!(a.order, Order::Fold(n) if n % fold == 0));
    let mut groups = Vec::new();
    // Two axes of the same kind at the right angle make a polyhedral group.
    let pair = |fold: u32, angle: f32| {
        let mut pairs =
            of(fold).enumerate().flat_map(|(i, a)| of(fold).skip(i + 1).map(move |b| (a, b)));
        pairs.find_map(|(a, b)| {
            let along = a.direction.dot(b.direction);
            let b = if along < 0.0 { -b.direction } else { b.direction };
            let off = (along.abs().clamp(0.0, 1.0).acos() - angle).abs();
            let across = (b - a.direction * a.direction.dot(b)).normalize_or_zero();
            (off < 0.1).then_some((a.direction, a.direction * angle.cos() + across * angle.sin()))
        })
    };
    if let Some((a, b)) = pair(5, 2.0_f32.atan()) {
        groups.push(closure(&[turn(a, 5), turn(b, 5)], 60));
    }
    if let Some((a, b)) = pair(4, FRAC_PI_2) {
        groups.push(closure(&[turn(a, 4), turn(b, 4)], 24));
    }
    if let Some((a, b)) = pair(3, (1.0_f32 / 3.0).acos()) {
        groups.push(closure(&[turn(a, 3), turn(b, 3)], 12));
    }
    for axis in axes {
        let Order::Fold(n) = axis.order else { continue };
        let across = |b: &&Axis| {
            matches!(b.order, Order::Fold(m) if m % 2 == 0)
                && b.direction.dot(axis.direction).abs() < 0.1
        };
        for b in axes.iter().filter(across) {
            let b = (b.direction - axis.direction * b.direction.dot(axis.direction)).normalize();
            groups.push(closure(&[turn(axis.direction, n), turn(b, 2)], 2 * n as usize));
        }
        groups.push(closure(&[turn(axis.direction, n)], n as usize));
    }
    groups.sort_by_key(|g| std::cmp::Reverse(g.len()));
    groups
}

/// The 60 rotations of an icosahedron with a five-fold axis along `a` and another towards `b` ⟂ `a`.
fn icosahedral(a: Vec3, b: Vec3) -> Vec<Quat> {
    let angle = 2.0_f32.atan();
    closure(&[turn(a, 5), turn(a * angle.cos() + b * angle.sin(), 5)], 60)
}

/// Every symmetry axis, the highest order first.
fn axes(surface: &Surface, config: &SymmetryConfig) -> Vec<Axis> {
    let tried = hemisphere(config.axis_step_rad);
    let mut found: Vec<Axis> = Vec::new();
    // Prime orders find every axis; its full order is tested afterwards.
    for fold in [2, 3, 5, 7, 11] {
        let angle = TAU / fold as f32;
        let coarse: Vec<f32> = tried
            .par_iter()
            .map(|&a| surface.coarse_distance(Quat::from_axis_angle(a, angle)))
            .collect();
        let mut order: Vec<usize> = (0..tried.len()).filter(|&i| coarse[i] < 0.07).collect();
        order.sort_by(|&a, &b| coarse[a].total_cmp(&coarse[b]).then(a.cmp(&b)));
        let mut seeds: Vec<Vec3> = Vec::new();
        for i in order {
            if seeds.len() < 40 && seeds.iter().all(|s| s.dot(tried[i]).abs() < 0.99) {
                seeds.push(tried[i]);
            }
        }
        let refined: Vec<Option<Axis>> = seeds
            .par_iter()
            .map(|&seed| {
                let direction = surface.refine(seed, angle)?;
                surface.is_symmetry(Quat::from_axis_angle(direction, angle)).then(|| Axis {
                    direction,
                    order: surface.order_about(direction, config.max_order),
                })
            })
            .collect();
        for axis in refined.into_iter().flatten() {
            if found.iter().all(|f| f.direction.dot(axis.direction).abs() < 0.998) {
                found.push(axis);
            }
        }
    }
    found.sort_by_key(|a| std::cmp::Reverse(a.order));
    found
}

/// Directions of half the sphere about `step_rad` apart, the coordinate axes among them.
fn hemisphere(step_rad: f32) -> Vec<Vec3> {
    let count = (TAU / (step_rad * step_rad)) as usize;
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let spiral = (0..count).map(|i| {
        let z = (i as f32 + 0.5) / count as f32;
        let r = (1.0 - z * z).sqrt();
        let (sin, cos) = (golden * i as f32).sin_cos();
        Vec3::new(r * cos, r * sin, z)
    });
    [Vec3::X, Vec3::Y, Vec3::Z].into_iter().chain(spiral).collect()
}

/// Nodes of the distance field along one axis.
const FIELD: usize = 40;
/// Half the edge of the field; the body has radius 1.
const REACH: f32 = 1.05;

/// A surface of radius 1 about the origin, with what is needed to ask how well a rotation keeps it.
struct Surface {
    query: MeshQuery,
    mesh_normals: Vec<Vec3>,
    /// Covariance of the solid; a symmetry keeps it.
    covariance: Mat3,
    points: Vec<Vec3>,
    field: Vec<f32>,
    rms_tolerance: f32,
    max_tolerance: f32,
}

impl Surface {
    fn new(mesh: &TriMesh, config: &SymmetryConfig) -> Result<Self, MeshError> {
        let query = MeshQuery::new(mesh)?;
        // Corners tell rotations apart best: the outermost vertices, then points all over.
        let mut outer = mesh.vertices.clone();
        outer.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
        outer.truncate(config.samples / 2);
        let mut rng = SeedTree::new(0).child("symmetry", 0).rng();
        let spread = mesh.sample_surface(config.samples / 2, &mut rng);
        // Alternating, so that every prefix is a fair choice of both.
        let mut points = Vec::with_capacity(config.samples);
        for i in 0..config.samples {
            points.extend(outer.get(i).copied());
            points.extend(spread.get(i).map(|(p, _)| *p));
        }
        let node = |i: usize| (i as f32 / (FIELD - 1) as f32 * 2.0 - 1.0) * REACH;
        let field = (0..FIELD * FIELD * FIELD)
            .into_par_iter()
            .map(|i| {
                let p =
                    Vec3::new(node(i % FIELD), node(i / FIELD % FIELD), node(i / FIELD / FIELD));
                (query.nearest(p).0 - p).length()
            })
            .collect();
        let mesh_normals = (0..mesh.triangles.len()).map(|t| mesh.triangle_normal(t)).collect();
        let (rms_tolerance, max_tolerance) = (config.rms_tolerance, config.max_tolerance);
        let covariance = mesh.moments().covariance_m5;
        Ok(Self { query, mesh_normals, covariance, points, field, rms_tolerance, max_tolerance })
    }

    /// Mean distance of some turned points from the surface, by interpolation.
    fn coarse_distance(&self, turn: Quat) -> f32 {
        if !self.keeps_covariance(turn) {
            return f32::INFINITY;
        }
        let used = &self.points[..self.points.len().min(160)];
        used.iter().map(|&p| self.field_at(turn * p)).sum::<f32>() / used.len() as f32
    }

    /// A cheap necessary condition, loose enough for an axis half a step off.
    fn keeps_covariance(&self, turn: Quat) -> bool {
        let r = Mat3::from_quat(turn);
        let turned = r * self.covariance * r.transpose();
        let norm = |m: Mat3| m.to_cols_array().iter().map(|v| v * v).sum::<f32>().sqrt();
        norm(turned - self.covariance) <= 0.15 * norm(self.covariance)
    }

    fn field_at(&self, p: Vec3) -> f32 {
        let scaled = ((p / REACH + 1.0) * 0.5 * (FIELD - 1) as f32)
            .clamp(Vec3::ZERO, Vec3::splat(FIELD as f32 - 1.001));
        let base = scaled.floor();
        let f = scaled - base;
        let at = |dx: usize, dy: usize, dz: usize| {
            self.field[((base.z as usize + dz) * FIELD + base.y as usize + dy) * FIELD
                + base.x as usize
                + dx]
        };
        let along = |dy, dz| at(0, dy, dz) * (1.0 - f.x) + at(1, dy, dz) * f.x;
        let plane = |dz| along(0, dz) * (1.0 - f.y) + along(1, dz) * f.y;
        plane(0) * (1.0 - f.z) + plane(1) * f.z
    }

    /// The axis near `seed` whose turn by `angle` keeps the surface best: Gauss-Newton on the point-to-plane
    /// distances over the axis' two tilts. `None` when that leads nowhere.
    fn refine(&self, seed: Vec3, angle: f32) -> Option<Vec3> {
        const STEP: f32 = 1e-3;
        let mut axis = seed;
        for round in 0..12 {
            let (u, v) = axis.any_orthonormal_pair();
            let tilted = |d: Vec3| Quat::from_axis_angle((axis + d).normalize(), angle);
            let here = Quat::from_axis_angle(axis, angle);
            let (left, right) =
                ([tilted(u * -STEP), tilted(v * -STEP)], [tilted(u * STEP), tilted(v * STEP)]);
            let (mut a, mut b) = ([[0.0_f32; 2]; 2], [0.0_f32; 2]);
            let mut off = 0.0;
            for &p in self.points.iter().take(150) {
                let q = here * p;
                let (near, triangle) = self.query.nearest(q);
                let normal = self.mesh_normals[triangle as usize];
                let residual = normal.dot(q - near);
                off += (q - near).length() / 150.0;
                let weight = 1.0 / (1.0 + (residual / 0.05).powi(2));
                let j = [0, 1].map(|k| normal.dot(right[k] * p - left[k] * p) / (2.0 * STEP));
                for r in 0..2 {
                    b[r] -= weight * j[r] * residual;
                    for c in 0..2 {
                        a[r][c] += weight * j[r] * j[c];
                    }
                }
            }
            if round == 5 && off > 4.0 * self.rms_tolerance {
                return None;
            }
            let ridge = 1e-6 * (a[0][0] + a[1][1]) + 1e-12;
            let (a00, a11) = (a[0][0] + ridge, a[1][1] + ridge);
            let determinant = a00 * a11 - a[0][1] * a[1][0];
            let step = [
                (b[0] * a11 - b[1] * a[0][1]) / determinant,
                (b[1] * a00 - b[0] * a[1][0]) / determinant,
            ];
            let shift = (u * step[0] + v * step[1]).clamp_length_max(0.1);
            axis = (axis + shift).normalize();
            if shift.length() < 1e-6 {
                break;
            }
        }
        Some(axis)
    }

    fn is_symmetry(&self, turn: Quat) -> bool {
        let (mut sum, mut n) = (0.0, 0.0);
        for &p in &self.points {
            let q = turn * p;
            let distance = (self.query.nearest(q).0 - q).length();
            if distance > self.max_tolerance {
                return false;
            }
            sum += distance * distance;
            n += 1.0;
        }
        (sum / n).sqrt() <= self.rms_tolerance
    }

    fn order_about(&self, axis: Vec3, max_order: u32) -> Order {
        // Angles with no common divisor: only a body of revolution keeps them all.
        let round =
            (1..=12).all(|k| self.is_symmetry(Quat::from_axis_angle(axis, k as f32 * 2.399_963)));
        if round {
            return Order::Any;
        }
        Order::Fold((2..=max_order).rev().find(|&n| self.is_symmetry(turn(axis, n))).unwrap_or(1))
    }
}
