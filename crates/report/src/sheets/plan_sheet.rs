//! Plan sheets: 20 to 30 m of the works each, blocks as they lie, order numbers, alignment with chainage.

use super::Sheet;
use super::frame::{FIELD, HAIR, INK, SOFT, THIN};
use super::paper::{Align, Paper, Pen};
use super::view::{View, scale_bar, scale_for};
use crate::colour::{ADDED, NOT_JUDGED, Rgb};
use crate::{ReportInput, Text};
use geom::{Pose, Vec2, silhouette};
use scene::ModelId;

/// As much of the works as a sheet shows at least; more where its scale leaves room.
const SHEET_M: f32 = 25.0;
const FOUND: Rgb = [205, 217, 228];
const DESIGN: Pen = Pen { width_mm: 0.35, colour: [176, 0, 32], dash_mm: [4.0, 1.5] };

/// The line chainages run along, or the long way of the blocks.
pub(super) fn line_of(input: &ReportInput) -> Option<(Vec<Vec2>, [f32; 2])> {
    if let Some(a) = &input.alignment {
        return Some((a.line.clone(), a.reach_m));
    }
    let places: Vec<Vec2> = outlines_of(input).map(|b| b.centre).collect();
    let low = places.iter().copied().reduce(Vec2::min)?;
    let high = places.iter().copied().reduce(Vec2::max)?;
    let reach = input.catalog.iter().map(|(_, m)| m.d_max_m).fold(0.0, f32::max);
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0 + reach);
    let (along, across) = if half.x >= half.y { (Vec2::X, half.y) } else { (Vec2::Y, half.x) };
    let long = half.dot(along);
    Some((vec![middle - along * long, middle + along * long], [across, across]))
}

struct Block {
    model: ModelId,
    pose: Pose,
    centre: Vec2,
    height: f32,
    fill: Rgb,
    order: Option<u32>,
}

/// Recognised blocks, then those to place.
fn outlines_of<'a>(input: &'a ReportInput) -> impl Iterator<Item = Block> + 'a {
    let block = |model: ModelId, pose: Pose, fill, order| {
        let c = pose.transform_point(input.catalog.get(model).centre);
        Block { model, pose, centre: c.truncate(), height: c.z, fill, order }
    };
    let found = input.recognised.iter().filter_map(move |r| {
        let fit = r.fit()?;
        Some(block(
            fit.model,
            fit.site_from_block,
            if r.is_stated() { FOUND } else { NOT_JUDGED },
            None,
        ))
    });
    let added = input.plan.iter().flat_map(|p| &p.placements);
    found.chain(added.map(move |p| block(p.model, p.rest, ADDED, Some(p.order))))
}

/// One sheet a stretch.
pub(super) fn sheets<'a>(input: &'a ReportInput<'a>) -> Vec<Sheet<'a>> {
    let Some((line, reach)) = line_of(input) else { return Vec::new() };
    let length: f32 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
    let margin = input.catalog.iter().map(|(_, m)| m.d_max_m).fold(0.0, f32::max);
    let room = [FIELD[2] - FIELD[0], FIELD[3] - FIELD[1] - 12.0];
    let across = reach[0] + reach[1] + 2.0 * margin;
    let scale = scale_for([length.min(SHEET_M) + 2.0 * margin, across], room);
    let holds = (room[0] * scale / 1000.0 - 2.0 * margin).max(SHEET_M);
    let count = (length / holds).ceil().max(1.0) as usize;
    let part = length / count as f32;
    let one = |k: usize| {
        let (from, to) = (k as f32 * part, (k + 1) as f32 * part);
        let (line, title) = (
            line.clone(),
            Text::new(
                format!("Plan {:.0}–{:.0} m", from, to),
                format!("平面図 {from:.0}～{to:.0} m"),
            ),
        );
        let draw = move |paper: &mut Paper| stretch(paper, input, &line, [from, to], reach, scale);
        Sheet { title, scale: format!("1:{scale:.0}"), draw: Box::new(draw) }
    };
    (0..count).map(one).collect()
}

/// Where a distance along a line lies, and the direction there.
pub(super) fn place_on(line: &[Vec2], distance: f32) -> (Vec2, Vec2) {
    let mut left = distance;
    for (i, w) in line.windows(2).enumerate() {
        let long = w[0].distance(w[1]);
        if left <= long || i + 2 == line.len() {
            let along = (w[1] - w[0]).normalize_or(Vec2::X);
            return (w[0] + along * left, along);
        }
        left -= long;
    }
    (line[0], Vec2::X)
}

fn stretch(
    paper: &mut Paper,
    input: &ReportInput,
    line: &[Vec2],
    [from, to]: [f32; 2],
    reach: [f32; 2],
    scale: f32,
) {
    let (start, _) = place_on(line, from);
    let (end, _) = place_on(line, to);
    let along = (end - start).normalize_or(Vec2::X);
    let left = along.perp();
    let middle = (start + end) / 2.0 + left * (reach[0] - reach[1]) / 2.0;
    let at = [(FIELD[0] + FIELD[2]) / 2.0, (FIELD[1] + FIELD[3] - 10.0) / 2.0];
    let view = View { middle, along, scale, at };
    let size = [FIELD[2] - FIELD[0], FIELD[3] - FIELD[1] - 10.0];
    paper.clip([FIELD[0], FIELD[1]], size);
    crosses(paper, input, &view, size);
    blocks(paper, input, &view, size, true);
    for o in &input.outlines {
        let ring = o.points.iter().chain(o.points.first().filter(|_| o.closed));
        let points: Vec<[f32; 2]> = ring.map(|p| view.on(p.truncate())).collect();
        paper.line(&points, DESIGN);
    }
    alignment(paper, line, [from, to], &view);
    paper.unclip();
    view.north(paper, [FIELD[2] - 12.0, FIELD[3] - 16.0]);
    scale_bar(paper, [FIELD[0] + 4.0, FIELD[3] - 6.0], scale);
    legend(paper, input, [FIELD[0] + 70.0, FIELD[3] - 6.0]);
}

/// The whole works in a window of the sheet, without numbers.
pub(super) fn overview(paper: &mut Paper, input: &ReportInput, low: [f32; 2], size: [f32; 2]) {
    let Some((line, reach)) = line_of(input) else { return };
    let (Some(first), Some(last)) = (line.first(), line.last()) else { return };
    let along = (*last - *first).normalize_or(Vec2::X);
    let left = along.perp();
    let corners: Vec<Vec2> =
        line.iter().flat_map(|p| [*p + left * reach[0], *p - left * reach[1]]).collect();
    let range = |axis: Vec2| {
        corners
            .iter()
            .map(|p| p.dot(axis))
            .fold([f32::MAX, f32::MIN], |[l, h], v| [l.min(v), h.max(v)])
    };
    let ([u0, u1], [v0, v1]) = (range(along), range(left));
    let middle = along * (u0 + u1) / 2.0 + left * (v0 + v1) / 2.0;
    let scale = scale_for([u1 - u0 + 4.0, v1 - v0 + 4.0], [size[0] - 10.0, size[1] - 16.0]);
    let at = [low[0] + size[0] / 2.0, low[1] + size[1] / 2.0 - 4.0];
    let view = View { middle, along, scale, at };
    paper.rect(low, size, None, Some(HAIR));
    paper.clip(low, size);
    blocks(paper, input, &view, size, false);
    for o in &input.outlines {
        let ring = o.points.iter().chain(o.points.first().filter(|_| o.closed));
        let points: Vec<[f32; 2]> = ring.map(|p| view.on(p.truncate())).collect();
        paper.line(&points, DESIGN);
    }
    paper.unclip();
    view.north(paper, [low[0] + size[0] - 10.0, low[1] + size[1] - 18.0]);
    scale_bar(paper, [low[0] + 6.0, low[1] + size[1] - 8.0], scale);
    legend(paper, input, [low[0] + 70.0, low[1] + size[1] - 8.0]);
}

/// More blocks than this are drawn as discs in the overview, where their legs would be ink.
const OUTLINED: usize = 1_500;

fn blocks(paper: &mut Paper, input: &ReportInput, view: &View, size: [f32; 2], numbers: bool) {
    let edge = Pen::solid(0.13, [70, 80, 92]);
    let mut shown: Vec<Block> = outlines_of(input)
        .filter(|b| {
            let d = view.on(b.centre);
            (d[0] - view.at[0]).abs() < size[0] / 2.0 + 30.0
                && (d[1] - view.at[1]).abs() < size[1] / 2.0 + 30.0
        })
        .collect();
    // What lies higher hides what lies lower, as from above.
    shown.sort_by(|a, b| a.height.total_cmp(&b.height));
    let radius_mm = |b: &Block| input.catalog.get(b.model).d_max_m * 1000.0 / view.scale;
    let discs = !numbers && shown.len() > OUTLINED;
    for b in &shown {
        if discs {
            let ([x, y], r) = (view.on(b.centre), radius_mm(b) * 0.7);
            let corner = |k: i32| {
                [x + r * (k as f32).to_radians().cos(), y + r * (k as f32).to_radians().sin()]
            };
            paper.rings(&[(0..6).map(|k| corner(k * 60)).collect()], Some(b.fill), None);
            continue;
        }
        let rings = silhouette(&input.catalog.get(b.model).mesh, &b.pose);
        let on: Vec<Vec<[f32; 2]>> =
            rings.iter().map(|r| r.iter().map(|p| view.on(*p)).collect()).collect();
        paper.rings(&on, Some(b.fill), Some(edge));
    }
    for b in shown.iter().filter(|_| numbers) {
        if let Some(order) = b.order {
            let size = (radius_mm(b) * 0.42).clamp(1.6, 4.0);
            let [x, y] = view.on(b.centre);
            let text = order.to_string();
            let wide = paper.width(&text) * size + size * 0.5;
            let halo = Some([255, 246, 236]);
            paper.rect([x - wide / 2.0, y - size * 0.6], [wide, size * 1.2], halo, None);
            paper.words([x, y - size * 0.36], size, Align::Middle, &text, INK);
        }
    }
}

fn alignment(paper: &mut Paper, line: &[Vec2], [from, to]: [f32; 2], view: &View) {
    let pen = Pen { width_mm: 0.3, colour: INK, dash_mm: [8.0, 1.5] };
    let on: Vec<[f32; 2]> = line.iter().map(|p| view.on(*p)).collect();
    paper.line(&on, pen);
    let first = (from / 5.0).ceil() as i32;
    for k in first..=(to / 5.0).floor() as i32 {
        let chainage = k as f32 * 5.0;
        let (p, along) = place_on(line, chainage);
        let [x, y] = view.on(p);
        let across = along.perp() * (view.scale / 1000.0) * 2.0;
        paper.line(&[view.on(p - across), view.on(p + across)], Pen::solid(0.3, INK));
        let name = station(chainage);
        let wide = paper.width(&name) * 2.6;
        paper.rect([x - wide / 2.0 - 0.5, y + 2.2], [wide + 1.0, 3.4], Some([255, 255, 255]), None);
        paper.words([x, y + 3.0], 2.6, Align::Middle, &name, INK);
    }
}

/// `No.3+12`: stations of 20 m.
pub(super) fn station(metres: f32) -> String {
    let number = (metres / 20.0 + 1e-4).floor();
    let rest = metres - number * 20.0;
    match rest {
        r if r < 0.005 => format!("No.{number:.0}"),
        r if (r - r.round()).abs() < 0.005 => format!("No.{number:.0}+{r:.0}"),
        r => format!("No.{number:.0}+{r:.2}"),
    }
}

/// Crosses at round coordinates, with their values at the lower and left edge.
fn crosses(paper: &mut Paper, input: &ReportInput, view: &View, size: [f32; 2]) {
    let [east, north, _] = input.survey.frame.origin;
    let step = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0]
        .into_iter()
        .find(|s| s * 1000.0 / f64::from(view.scale) >= 60.0)
        .unwrap_or(500.0);
    let half = Vec2::from_array(size).length() / 2.0 * view.scale / 1000.0;
    let first = |c: f64| ((c - f64::from(half)) / step).ceil() as i64;
    let last = |c: f64| ((c + f64::from(half)) / step).floor() as i64;
    let (cx, cy) = (east + f64::from(view.middle.x), north + f64::from(view.middle.y));
    for i in first(cx)..=last(cx) {
        for j in first(cy)..=last(cy) {
            let (x, y) = (i as f64 * step, j as f64 * step);
            let [u, v] = view.on(Vec2::new((x - east) as f32, (y - north) as f32));
            let inside = |a: f32, low: f32, wide: f32| a > low + 4.0 && a < low + wide - 4.0;
            if inside(u, FIELD[0], size[0]) && inside(v, FIELD[1], size[1]) {
                paper.line(&[[u - 2.0, v], [u + 2.0, v]], HAIR);
                paper.line(&[[u, v - 2.0], [u, v + 2.0]], HAIR);
                let text = if input.survey.frame.crs.is_empty() {
                    format!("x {x} y {y}")
                } else {
                    // Japanese plane coordinates call north X.
                    format!("X(N) {y}  Y(E) {x}")
                };
                paper.words([u + 1.2, v + 1.0], 1.8, Align::Left, &text, SOFT);
            }
        }
    }
}

fn legend(paper: &mut Paper, input: &ReportInput, at: [f32; 2]) {
    let mut x = at[0];
    let entries = [
        (FOUND, Text::new("recognised", "認識"), input.recognised.iter().any(|r| r.is_stated())),
        (
            NOT_JUDGED,
            Text::new("not judged", "判定不能"),
            input.recognised.iter().any(|r| !r.is_stated()),
        ),
        (ADDED, Text::new("to place (order)", "据付（順序）"), input.plan.is_some()),
    ];
    for (colour, words, there) in entries {
        if there {
            paper.rect([x, at[1]], [5.0, 3.0], Some(colour), Some(THIN));
            x += 7.0 + paper.label([x + 6.5, at[1] + 0.3], 2.8, Align::Left, &words, INK) + 6.0;
        }
    }
}
