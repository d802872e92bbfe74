//! What the 3D view needs, as JSON beside one packed blob of columns.
//!
//! Points are put on a 16-bit grid and sorted along a space-filling curve: neighbours then differ little,
//! which packs well, and every n-th point of the order is an even thinning.

use crate::blob::{Blob, Span};
use crate::{ReportError, ReportInput};
use geom::{Pose, Vec3};
use scene::{Fit, ModelId, Recognised, Review};
use serde::Serialize;

#[derive(Serialize)]
pub(crate) struct ViewData<'a> {
    points: Points,
    models: Vec<Model>,
    found: Vec<Found>,
    added: Vec<Added>,
    outlines: Vec<Line>,
    origin: [f64; 3],
    rounds: u32,
    review: Option<&'a Review>,
}

#[derive(Serialize)]
struct Points {
    total: usize,
    shown: usize,
    min: [f32; 3],
    size: [f32; 3],
    xyz: [Span; 3],
    /// Position in `found`, from 1; 0 = none.
    instance: Span,
    /// Distance to the design on ±`reach` metres, 0 = none; absent without a design.
    distance: Option<Span>,
    reach: f32,
}

#[derive(Serialize)]
struct Model {
    name: String,
    vertices: Span,
    triangles: Span,
    centre: [f32; 3],
    radius: f32,
}

#[derive(Serialize)]
struct Found {
    id: u32,
    model: u16,
    pose: [f32; 7],
    confidence: Option<f32>,
    fitness_m: Option<f32>,
    occlusion: Option<f32>,
    judged: bool,
}

#[derive(Serialize)]
struct Added {
    order: u32,
    round: u32,
    model: u16,
    pose: [f32; 7],
}

#[derive(Serialize)]
struct Line {
    closed: bool,
    points: Vec<[f32; 3]>,
}

/// Blocks nobody placed are shown out of the found ones; distances beyond this are one colour.
const REACH_M: f32 = 2.0;

/// Blocks the view shows: all that have a pose, stated or not.
fn shown<'a>(input: &ReportInput<'a>) -> impl Iterator<Item = (&'a Recognised, &'a Fit)> {
    input.recognised.iter().filter_map(|r| Some((r, r.fit()?)))
}

/// JSON and packed columns.
pub(crate) fn view_data(input: &ReportInput) -> Result<(String, String), ReportError> {
    let mut blob = Blob::default();
    let points = points(input, &mut blob)?;
    let models = input.catalog.iter().map(|(_, m)| Model {
        name: m.name.clone(),
        vertices: blob.f32s(m.mesh.vertices.iter().flat_map(|v| v.to_array())),
        triangles: blob.u32s(m.mesh.triangles.iter().flatten().copied()),
        centre: m.centre.to_array(),
        radius: m.d_max_m,
    });
    let models = models.collect();
    let found = shown(input).map(|(r, fit)| Found {
        id: r.block.0,
        model: fit.model.0,
        pose: numbers(&fit.site_from_block),
        confidence: fit.confidence,
        fitness_m: fit.fitness_m,
        occlusion: fit.occlusion,
        judged: r.is_stated(),
    });
    let added = input.plan.iter().flat_map(|p| &p.placements).map(|p| Added {
        order: p.order,
        round: p.round,
        model: p.model.0,
        pose: numbers(&p.rest),
    });
    let data = ViewData {
        points,
        models,
        found: found.collect(),
        added: added.collect(),
        outlines: input
            .outlines
            .iter()
            .map(|o| Line {
                closed: o.closed,
                points: o.points.iter().map(|p| p.to_array()).collect(),
            })
            .collect(),
        origin: input.survey.frame.origin,
        review: input.review,
        rounds: input.plan.map_or(0, |p| p.placements.iter().map(|p| p.round).max().unwrap_or(0)),
    };
    let json = serde_json::to_string(&data).map_err(|e| ReportError::Pack(e.to_string()))?;
    // Inside <script>, a name could otherwise end the element.
    Ok((json.replace('<', "\\u003c"), blob.packed()?))
}

fn numbers(pose: &Pose) -> [f32; 7] {
    let (q, t) = (pose.rotation, pose.translation);
    [q.x, q.y, q.z, q.w, t.x, t.y, t.z]
}

/// Every block and placement must be of a known type and somewhere.
pub(crate) fn check(input: &ReportInput) -> Result<(), ReportError> {
    let known = |model: ModelId| {
        let count = input.catalog.len();
        if (model.0 as usize) < count {
            Ok(())
        } else {
            Err(ReportError::UnknownModel { model: model.0, count })
        }
    };
    let finite = |what, number, pose: &Pose| {
        let ok = numbers(pose).iter().all(|v| v.is_finite());
        if ok { Ok(()) } else { Err(ReportError::NotFinite { what, number }) }
    };
    for (i, r) in input.recognised.iter().enumerate() {
        let Some(fit) = r.fit() else { continue };
        known(fit.model)?;
        finite("block", i, &fit.site_from_block)?;
    }
    let placements = input.plan.iter().flat_map(|p| p.placements.iter().chain(&p.removed));
    for (i, p) in placements.enumerate() {
        known(p.model)?;
        finite("placement", i, &p.rest)?;
    }
    let need = input.survey.cloud.len();
    let found = input.point_distance_m.len();
    if found != 0 && found != need {
        return Err(ReportError::Column { column: "point_distance_m", found, need });
    }
    match input.survey.cloud.position_m.iter().position(|p| !p.is_finite()) {
        Some(number) => Err(ReportError::NotFinite { what: "point", number }),
        None => Ok(()),
    }
}

fn points(input: &ReportInput, blob: &mut Blob) -> Result<Points, ReportError> {
    let cloud = &input.survey.cloud;
    let bounds = cloud.bounds();
    let (min, size) = if bounds.is_empty() {
        (Vec3::ZERO, Vec3::ONE)
    } else {
        (bounds.min, bounds.size().max(Vec3::splat(1e-6)))
    };
    let mut instance = vec![0_u32; cloud.len()];
    for (number, (r, _)) in shown(input).enumerate() {
        for &i in &r.points {
            if let Some(slot) = instance.get_mut(i as usize) {
                *slot = number as u32 + 1;
            }
        }
    }
    let grid = |p: Vec3| ((p - min) / size * 65535.0).round().to_array().map(|v| v as u16);
    let mut order: Vec<(u64, [u16; 3], u32)> = cloud
        .position_m
        .iter()
        .enumerate()
        .map(|(i, p)| (morton(grid(*p)), grid(*p), i as u32))
        .collect();
    order.sort_unstable();
    let shown = order.len().min(input.max_points.max(1));
    let kept: Vec<_> = (0..shown).map(|k| order[k * order.len() / shown]).collect();
    let xyz = [0, 1, 2].map(|axis| blob.u16_deltas(kept.iter().map(|(_, g, _)| g[axis])));
    let instance = blob.u16_deltas(kept.iter().map(|(.., i)| instance[*i as usize] as u16));
    let distance = (!input.point_distance_m.is_empty()).then(|| {
        blob.u16_deltas(kept.iter().map(|(.., i)| match input.point_distance_m[*i as usize] {
            d if d.is_nan() => 0,
            d => (32768.0 + (d / REACH_M).clamp(-1.0, 1.0) * 32767.0) as u16,
        }))
    });
    Ok(Points {
        total: cloud.len(),
        shown,
        min: min.to_array(),
        size: size.to_array(),
        xyz,
        instance,
        distance,
        reach: REACH_M,
    })
}

/// Bits of the three coordinates in turn.
fn morton(g: [u16; 3]) -> u64 {
    let spread = |v: u16| (0..16).fold(0_u64, |m, bit| m | (u64::from(v >> bit & 1) << (3 * bit)));
    spread(g[0]) | spread(g[1]) << 1 | spread(g[2]) << 2
}
