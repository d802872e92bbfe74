//! The survey's points as columns.
//!
//! Points are put on a 16-bit grid and sorted along a space-filling curve: neighbours then differ little,
//! which packs well, and every n-th point of the order is an even thinning.

use crate::ReportInput;
use crate::blob::{Blob, Span};
use crate::view_data::shown;
use geom::Vec3;
use serde::Serialize;

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Points {
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
    /// Distance to the block's surface on 0 … `fit_reach` metres, 0 = none; absent when nobody measured it.
    fit: Option<Span>,
    fit_reach: f32,
}

/// Distances beyond this are one colour.
const REACH_M: f32 = 2.0;
/// Steps of the two distances: what a colour can show, and little to pack.
const DISTANCE_STEPS: f32 = 400.0;
const FIT_STEPS: f32 = 200.0;

pub(crate) fn points(input: &ReportInput, blob: &mut Blob) -> Points {
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
    let column = |blob: &mut Blob, of: &dyn Fn(usize) -> u16| {
        blob.u16_deltas(kept.iter().map(|(.., i)| of(*i as usize)))
    };
    let instance = column(blob, &|i| instance[i] as u16);
    let distance = (!input.point_distance_m.is_empty()).then(|| {
        column(blob, &|i| match input.point_distance_m[i] {
            d if d.is_nan() => 0,
            d => {
                let share = (d / REACH_M).clamp(-1.0, 1.0) * 0.5 + 0.5;
                1 + ((share * DISTANCE_STEPS).round() / DISTANCE_STEPS * 65534.0) as u16
            }
        })
    });
    let fit_reach = high_end(input.point_fit_m);
    let fit = (!input.point_fit_m.is_empty()).then(|| {
        column(blob, &|i| match input.point_fit_m[i] {
            d if d.is_nan() => 0,
            d => {
                let share = (d / fit_reach).clamp(0.0, 1.0);
                1 + ((share * FIT_STEPS).round() / FIT_STEPS * 65534.0) as u16
            }
        })
    });
    Points {
        total: cloud.len(),
        shown,
        min: min.to_array(),
        size: size.to_array(),
        xyz,
        instance,
        distance,
        reach: REACH_M,
        fit,
        fit_reach,
    }
}

/// The value that 98 of 100 do not exceed: the end of a scale that one outlier does not stretch.
pub(crate) fn high_end(values: &[f32]) -> f32 {
    let mut known: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    known.sort_by(f32::total_cmp);
    known.get(known.len().saturating_sub(1) * 98 / 100).copied().unwrap_or(0.0).max(1e-6)
}

/// Bits of the three coordinates in turn.
fn morton(g: [u16; 3]) -> u64 {
    let spread = |v: u16| (0..16).fold(0_u64, |m, bit| m | (u64::from(v >> bit & 1) << (3 * bit)));
    spread(g[0]) | spread(g[1]) << 1 | spread(g[2]) << 2
}
