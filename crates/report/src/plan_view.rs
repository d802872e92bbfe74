//! The plan view: blocks from straight above as the z-buffer sees them, outlines, placing order, site coordinates.

use crate::chart::Chart;
use crate::colour::{ADDED, NOT_JUDGED, Rgb, css, diverging, of_type};
use crate::text::{Text, escape, t};
use crate::{Camera, MapLayer, ReportError, ReportInput, StillMesh, still};
use base64::Engine;
use geom::{Bounds, Vec3};
use std::fmt::Write;

/// The map and the heat maps beside it.
pub(crate) fn plan_view(input: &ReportInput) -> Result<String, ReportError> {
    let bounds = extent(input);
    if bounds.is_empty() {
        return Ok(String::new());
    }
    let mut html =
        format!("<section id=\"map\"><h2>{}</h2><div class=\"maps\">", t("Plan view", "平面図"));
    html += &block_map(input, &bounds)?;
    for layer in &input.maps {
        html += &heat_map(input, layer, &bounds)?;
    }
    Ok(html + "</div></section>")
}

/// Blocks, placements and outlines, with a margin.
fn extent(input: &ReportInput) -> Bounds {
    let found =
        input.recognised.iter().filter_map(|r| r.fit()).map(|f| (f.model, f.site_from_block));
    let added = input.plan.iter().flat_map(|p| &p.placements).map(|p| (p.model, p.rest));
    let blocks = found.chain(added).flat_map(|(model, pose)| {
        let m = input.catalog.get(model);
        let (centre, r) = (pose.transform_point(m.centre), Vec3::splat(m.d_max_m));
        [centre - r, centre + r]
    });
    let around = Bounds::of(blocks);
    let around = if around.is_empty() { input.survey.cloud.bounds() } else { around };
    if around.is_empty() { around } else { around.grown(around.size().max_element() * 0.02) }
}

/// A chart over the box in site coordinates.
fn chart(input: &ReportInput, bounds: &Bounds, width: f64) -> Chart {
    let site = |v: f32, axis: usize| input.survey.frame.origin[axis] + f64::from(v);
    Chart::true_to_scale(
        width,
        [site(bounds.min.x, 0), site(bounds.max.x, 0)],
        [site(bounds.min.y, 1), site(bounds.max.y, 1)],
    )
}

fn axes(input: &ReportInput, chart: &Chart) -> String {
    let local = input.survey.frame.crs.is_empty();
    let name = |en: &str, ja: &str| {
        if local {
            Text::from(format!(
                "{} (m)",
                en.chars().next().map_or('x', |c| if c == 'e' { 'x' } else { 'y' })
            ))
        } else {
            Text::new(format!("{en} (m)"), format!("{ja} (m)"))
        }
    };
    chart.axes(&name("east", "東"), &name("north", "北"))
}

fn block_map(input: &ReportInput, bounds: &Bounds) -> Result<String, ReportError> {
    let chart = chart(input, bounds, 860.0);
    let (w, h) = (chart.width - chart.left - chart.right, chart.height - chart.top - chart.bottom);
    let colour =
        |r: &scene::Recognised| r.stated().map_or(NOT_JUDGED, |fit| soft(of_type(fit.model.0)));
    let mut meshes: Vec<StillMesh> = input
        .recognised
        .iter()
        .filter_map(|r| Some((r, r.fit()?)))
        .map(|(r, fit)| StillMesh {
            mesh: &input.catalog.get(fit.model).mesh,
            pose: fit.site_from_block,
            colour: colour(r),
        })
        .collect();
    let added = || input.plan.iter().flat_map(|p| &p.placements);
    meshes.extend(added().map(|p| StillMesh {
        mesh: &input.catalog.get(p.model).mesh,
        pose: p.rest,
        colour: ADDED,
    }));
    let picture =
        still((w * 1.5) as usize, (h * 1.5) as usize, &Camera::plan(bounds), &meshes, &[]);

    let mut svg = chart.open("chart map", "plan view");
    svg += &image(&picture, &chart)?;
    svg += &axes(input, &chart);
    svg += &outlines(input, &chart);
    for p in added() {
        let at = p.rest.transform_point(input.catalog.get(p.model).centre);
        let (x, y) = pixel(input, &chart, at);
        let _ = write!(
            svg,
            "<text class=\"order\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>",
            y + 4.0,
            p.order
        );
    }
    svg += "</svg>";

    let mut legend = String::from("<p class=\"legend\">");
    for (id, m) in input.catalog.iter() {
        if scene::stated(input.recognised).any(|(_, fit)| fit.model == id) {
            let _ = write!(
                legend,
                "<span><i style=\"background:{}\"></i>{} {}</span>",
                css(of_type(id.0)),
                escape(&m.name),
                t("(recognised)", "(認識)")
            );
        }
    }
    if input.recognised.iter().any(|r| !r.is_stated()) {
        let _ = write!(
            legend,
            "<span><i style=\"background:{}\"></i>{}</span>",
            css(NOT_JUDGED),
            t("not judged", "判定不能")
        );
    }
    if added().next().is_some() {
        let _ = write!(
            legend,
            "<span><i style=\"background:{}\"></i>{}</span>",
            css(ADDED),
            t("to place, with its order", "据付 (番号は順序)")
        );
    }
    let caption = t("Blocks from above", "ブロック平面図");
    Ok(format!(
        "<figure class=\"wide\"><figcaption>{caption}</figcaption>{svg}{legend}</p></figure>"
    ))
}

fn heat_map(input: &ReportInput, layer: &MapLayer, bounds: &Bounds) -> Result<String, ReportError> {
    let map = layer.values;
    let most = map.z_m.iter().filter(|v| v.is_finite()).fold(0.0_f32, |m, v| m.max(v.abs()));
    let chart = chart(input, bounds, 560.0);
    let (w, h) = (map.nx.max(1), map.ny.max(1));
    let rgba = (0..w * h).flat_map(|i| {
        let v = map.z_m[(h - 1 - i / w) * w + i % w];
        let [r, g, b] = diverging(v / most.max(1e-6));
        [r, g, b, if v.is_finite() { 255 } else { 0 }]
    });
    let picture = crate::Image { width: w, height: h, rgba: rgba.collect() };
    let origin = input.survey.frame.origin;
    let (east, north) =
        (origin[0] + f64::from(map.origin[0]), origin[1] + f64::from(map.origin[1]));
    let (x0, x1) = (chart.px(east), chart.px(east + f64::from(map.cell_m) * w as f64));
    let (y0, y1) = (chart.py(north + f64::from(map.cell_m) * h as f64), chart.py(north));
    let mut svg = chart.open("chart map", &layer.label.en);
    let clip = [
        chart.left,
        chart.top,
        chart.width - chart.left - chart.right,
        chart.height - chart.top - chart.bottom,
    ];
    let _ = write!(
        svg,
        "<svg x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" viewBox=\"{:.1} {:.1} {:.1} {:.1}\">\
         <image class=\"crisp\" preserveAspectRatio=\"none\" x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\" href=\"{}\"/></svg>",
        clip[0],
        clip[1],
        clip[2],
        clip[3],
        clip[0],
        clip[1],
        clip[2],
        clip[3],
        x1 - x0,
        y1 - y0,
        data_url(&picture)?
    );
    svg += &axes(input, &chart);
    svg += &outlines(input, &chart);
    let stops: String = (0..=8)
        .map(|k| {
            format!(
                "<stop offset=\"{}%\" stop-color=\"{}\"/>",
                k as f32 * 12.5,
                css(diverging(k as f32 / 4.0 - 1.0))
            )
        })
        .collect();
    let unit = escape(&layer.unit);
    let bar = format!(
        "<p class=\"legend\"><span>−{most:.2} {unit}</span><svg class=\"bar\" viewBox=\"0 0 160 12\"><defs><linearGradient id=\"diverging\">{stops}</linearGradient></defs>\
         <rect width=\"160\" height=\"12\" fill=\"url(#diverging)\"/></svg><span>+{most:.2} {unit}</span></p>"
    );
    Ok(format!("<figure><figcaption>{}</figcaption>{svg}</svg>{bar}</figure>", layer.label.html()))
}

fn outlines(input: &ReportInput, chart: &Chart) -> String {
    let mut svg = String::new();
    for o in &input.outlines {
        let ring = o.points.iter().chain(o.points.first().filter(|_| o.closed));
        let site = |p: &Vec3| {
            let s = input.survey.frame.site_from_local(*p);
            [s.x, s.y]
        };
        let _ = write!(
            svg,
            "<path class=\"outline\" d=\"{}\"><title>{}</title></path>",
            chart.path(ring.map(site)),
            escape(&o.label.en)
        );
    }
    for s in &input.sections {
        let (ax, ay) = pixel(input, chart, s.from.extend(0.0));
        let (bx, by) = pixel(input, chart, s.to.extend(0.0));
        let _ = write!(svg, "<path class=\"cut\" d=\"M{ax:.1} {ay:.1}L{bx:.1} {by:.1}\"/>");
        // Along the cut, so that the names of near cuts stand side by side.
        let turn = (by - ay).atan2(bx - ax).to_degrees();
        let (turn, anchor) =
            if turn > 90.0 || turn <= -90.0 { (turn + 180.0, "start") } else { (turn, "end") };
        let (x, y) = (bx + (ax - bx) * 0.02, by + (ay - by) * 0.02);
        let at = format!(
            "class=\"cutname\" transform=\"translate({x:.1} {y:.1}) rotate({turn:.1})\" dy=\"-3\" text-anchor=\"{anchor}\""
        );
        svg += &s.label.svg(&at);
    }
    svg
}

fn pixel(input: &ReportInput, chart: &Chart, p: Vec3) -> (f64, f64) {
    let s = input.survey.frame.site_from_local(p);
    (chart.px(s.x), chart.py(s.y))
}

fn image(picture: &crate::Image, chart: &Chart) -> Result<String, ReportError> {
    Ok(format!(
        "<image x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" href=\"{}\"/>",
        chart.left,
        chart.top,
        chart.width - chart.left - chart.right,
        chart.height - chart.top - chart.bottom,
        data_url(picture)?
    ))
}

fn data_url(picture: &crate::Image) -> Result<String, ReportError> {
    Ok(format!(
        "data:image/png;base64,{}",
        base64::engine::general_purpose::STANDARD.encode(picture.png()?)
    ))
}

/// Lighter, so that what is added stands out.
fn soft(c: Rgb) -> Rgb {
    c.map(|v| (u16::from(v) / 2 + 105) as u8)
}
