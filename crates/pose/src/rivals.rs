//! Poses a block must beat, whether the search came across them or not.
//!
//! A cube of which one face is seen fits as well half a block further along; the tip of one leg fits at any roll. The
//! stated pose is slid along the direction in which it is held least and along its own axes, turned about the axis of
//! what is seen of it, and turned over about its principal axes, as a plate may lie on either face; each start takes a few steps on the block's own points. What ends elsewhere and explains
//! them as well shows that the points do not decide.

use crate::finish::Accepted;
use crate::fit::{CentredPose, FitPoint, fit};
use crate::measured::Measured;
use crate::template::Template;
use geom::{Plane, Quat, Vec2, Vec3};

/// Points of a block that rivals are fitted to.
const POINTS: usize = 120;
/// Rivals whose case is looked at.
const BEST: usize = 3;
/// Slides along the block's axes and along the least-held direction, in lengths of the block.
const SLIDES: [f32; 3] = [0.15, 0.3, 0.5];
/// Turns about the axis of what is seen, degrees.
const TURNS_DEG: [f32; 9] = [-120.0, -90.0, -60.0, -30.0, -15.0, 30.0, 60.0, 90.0, 180.0];

/// The rivals that explain the block's own points best; none is the stated pose within `shift_m` and `turn_rad`.
pub fn forced(
    block: &Accepted,
    own: &[u32],
    covariance: Option<&[f32; 36]>,
    template: &Template,
    measured: &Measured,
    (shift_m, turn_rad): (f32, f32),
) -> Vec<CentredPose> {
    let Some(points) = some_points(measured, own) else { return Vec::new() };
    let model = template.fit_model();
    let d = template.model.d_max_m;
    let fine = (2.5 * measured.noise_sd_m).max(0.03 * d);
    let mut ranked: Vec<(f32, CentredPose)> = starts(block, &points, covariance, template)
        .into_iter()
        .map(|start| {
            let (at, _) = fit(&model, &points, start, &[0.08 * d, 0.06 * d, fine, fine]);
            let (_, score) = fit(&model, &points, at, &[fine]);
            (score, at)
        })
        .filter(|(_, at)| !template.same(at, &block.at, shift_m, turn_rad))
        .collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<CentredPose> = Vec::new();
    for (_, at) in ranked {
        if kept.len() < BEST && kept.iter().all(|k| !template.same(k, &at, shift_m, turn_rad)) {
            kept.push(at);
        }
    }
    kept
}

/// An even part of a block's own working points; `None` where they are too few to fit a pose to.
pub fn some_points(measured: &Measured, own: &[u32]) -> Option<Vec<FitPoint>> {
    let stride = own.len().div_ceil(POINTS).max(1);
    let points: Vec<FitPoint> =
        own.iter().step_by(stride).map(|&i| measured.fit_point(i)).collect();
    (points.len() >= crate::search::FEWEST_POINTS).then_some(points)
}

fn starts(
    block: &Accepted,
    points: &[FitPoint],
    covariance: Option<&[f32; 36]>,
    template: &Template,
) -> Vec<CentredPose> {
    let at = block.at;
    let mut starts = Vec::new();
    let facing = points.iter().map(|p| p.normal).sum::<Vec3>().normalize_or(Vec3::Z);
    let mut along: Vec<Vec3> = [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .map(|axis| at.rotation * axis)
        // A slide into the view is no rival: the points hold it.
        .filter(|axis| axis.dot(facing).abs() < 0.7)
        .collect();
    along.extend(covariance.and_then(|c| least_held(c, 0)));
    for axis in along {
        for slide in SLIDES {
            for sign in [-1.0, 1.0] {
                let centre = at.centre + axis * (sign * slide * template.model.d_box_m);
                starts.push(CentredPose { centre, ..at });
            }
        }
    }
    let middle = points.iter().map(|p| p.position).sum::<Vec3>() / points.len() as f32;
    let mut about: Vec<Vec3> = (middle - at.centre).try_normalize().into_iter().collect();
    about.extend(covariance.and_then(|c| least_held(c, 3)));
    for axis in about {
        for turn in TURNS_DEG {
            let rotation =
                (Quat::from_axis_angle(axis, turn.to_radians()) * at.rotation).normalize();
            // About the middle of what is seen as well as about the centre: a leg stays where it is.
            starts.push(CentredPose { rotation, centre: at.centre });
        }
    }
    for axis in principal_axes(template) {
        let over = Quat::from_axis_angle(at.rotation * axis, std::f32::consts::PI);
        let rotation = (over * at.rotation).normalize();
        starts.push(CentredPose { rotation, centre: at.centre });
    }
    starts
}

/// Axes about which a block turned over fills much the same room; none of a surface without a thinnest way.
fn principal_axes(template: &Template) -> Vec<Vec3> {
    let surface: Vec<Vec3> =
        template.surface.iter().map(|(p, _)| *p - template.model.centre).collect();
    let Some(plane) = Plane::through(&surface) else { return Vec::new() };
    let across = surface.iter().map(|p| p.reject_from(plane.normal));
    // The longest way in the plane: where the doubled angles of what lies there point to.
    let u = plane.normal.any_orthonormal_vector();
    let v = plane.normal.cross(u);
    let doubled = across.map(|p| {
        let (x, y) = (p.dot(u), p.dot(v));
        Vec2::new(x * x - y * y, 2.0 * x * y)
    });
    let angle = 0.5 * doubled.sum::<Vec2>().to_angle();
    let long = u * angle.cos() + v * angle.sin();
    vec![plane.normal, long, plane.normal.cross(long)]
}

/// Unit eigenvector of the largest variance in the 3 × 3 block of a covariance at `first`.
fn least_held(covariance: &[f32; 36], first: usize) -> Option<Vec3> {
    let row = |i: usize, v: Vec3| {
        (0..3).map(|k| covariance[(first + i) * 6 + first + k] * v[k]).sum::<f32>()
    };
    let mut v = Vec3::new(0.6, 0.5, 0.62);
    for _ in 0..30 {
        v = Vec3::new(row(0, v), row(1, v), row(2, v)).try_normalize()?;
    }
    v.is_finite().then_some(v)
}
