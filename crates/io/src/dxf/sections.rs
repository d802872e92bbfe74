//! Cross-sections laid out below the plan, true to scale, with levels, offsets and their station.

use super::groups::Groups;
use crate::details::{Details, station};
use crate::drawing::{Drawing, SectionLine};
use crate::landxml::offset_m;
use geom::DVec3;

const LAYER: &str = "SECTIONS_LAID_OUT";

/// Draws them from left to right, as many rows as the plan is wide; returns how far down they reach.
pub(crate) fn laid_out(
    out: &mut Groups,
    drawing: &Drawing,
    details: &Details,
    [low, high]: [DVec3; 2],
    letter_m: f64,
) -> f64 {
    let mut chainages: Vec<f64> = drawing.sections.iter().map(|s| s.chainage_m).collect();
    chainages.sort_by(f64::total_cmp);
    chainages.dedup();
    let gap = letter_m * 8.0;
    let (mut x, mut top, mut deepest) = (low.x, low.y - gap, low.y - gap);
    for chainage in chainages {
        let lines: Vec<&SectionLine> =
            drawing.sections.iter().filter(|s| s.chainage_m == chainage).collect();
        let flat: Vec<Vec<[f64; 2]>> = flattened(&lines, details);
        let all = || flat.iter().flatten();
        let range =
            |k: usize| all().fold([f64::MAX, f64::MIN], |[l, h], p| [l.min(p[k]), h.max(p[k])]);
        let ([o0, o1], [z0, z1]) = (range(0), range(1));
        if o1 < o0 {
            continue;
        }
        let wide = o1 - o0 + gap;
        if x > low.x && x + wide > high.x.max(low.x + wide * 2.0) {
            (x, top) = (low.x, deepest - gap);
        }
        let levels = [z0.floor(), z1.ceil()];
        let place = |o: f64, z: f64| {
            DVec3::new(x + letter_m * 5.0 + o - o0, top - letter_m * 3.0 - (levels[1] - z), 0.0)
        };
        frame(out, &place, [o0, o1], levels, letter_m);
        for (line, points) in lines.iter().zip(&flat) {
            let points: Vec<DVec3> = points.iter().map(|p| place(p[0], p[1])).collect();
            out.polyline(&super::write::section_layer(&line.surface), &points, false);
        }
        let at = place((o0 + o1) / 2.0, levels[1]) + DVec3::Y * letter_m;
        out.text(LAYER, at, letter_m * 1.2, 0.0, 1, &station(chainage));
        deepest = deepest.min(place(o0, levels[0]).y - letter_m * 3.0);
        x += wide + letter_m * 5.0;
    }
    deepest
}

/// Offset from the alignment (or from where the section begins) and level.
fn flattened(lines: &[&SectionLine], details: &Details) -> Vec<Vec<[f64; 2]>> {
    let first = lines.iter().find_map(|l| l.points.first()).copied().unwrap_or_default();
    let offset = |p: &[f64; 3]| {
        if details.alignment.len() > 1 {
            offset_m(&details.alignment, [p[0], p[1]])
        } else {
            (p[0] - first[0]).hypot(p[1] - first[1])
        }
    };
    lines.iter().map(|l| l.points.iter().map(|p| [offset(p), p[2]]).collect()).collect()
}

/// A line every metre of level, with its value; offsets at the foot.
fn frame(
    out: &mut Groups,
    place: &dyn Fn(f64, f64) -> DVec3,
    [o0, o1]: [f64; 2],
    [z0, z1]: [f64; 2],
    letter_m: f64,
) {
    let step = |range: f64| {
        [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0].into_iter().find(|s| range / s <= 12.0).unwrap_or(20.0)
    };
    let rise = step(z1 - z0);
    for k in (z0 / rise).ceil() as i64..=(z1 / rise).floor() as i64 {
        let z = k as f64 * rise;
        out.line(LAYER, place(o0, z), place(o1, z));
        let at = place(o0, z) - DVec3::new(letter_m * 0.4, letter_m * 0.3, 0.0);
        out.text(LAYER, at, letter_m * 0.6, 0.0, 2, &format!("{z:.1}"));
    }
    let wide = step(o1 - o0);
    for k in (o0 / wide).ceil() as i64..=(o1 / wide).floor() as i64 {
        let o = k as f64 * wide;
        out.line(LAYER, place(o, z0), place(o, z0) - DVec3::Y * letter_m * 0.4);
        out.text(
            LAYER,
            place(o, z0) - DVec3::Y * letter_m * 1.3,
            letter_m * 0.6,
            0.0,
            1,
            &format!("{o:.1}"),
        );
    }
    // Where the alignment passes.
    if o0 < 0.0 && o1 > 0.0 {
        out.line("ALIGNMENT", place(0.0, z0), place(0.0, z1));
    }
}
