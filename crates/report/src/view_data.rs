//! What the page's script needs, as JSON beside one packed blob of columns.

use crate::blob::{Blob, Span};
use crate::grid::{Grid, grid};
use crate::points::{Points, high_end, points};
use crate::{ReportError, ReportInput, SectionLineKind, Text};
use geom::{HeightMap, Pose};
use scene::{Fit, ModelId, Placement, Ratings, Recognised, Review, SIGNS};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct ViewData<'a> {
    /// Names this very run in the browser's memory.
    run: String,
    crs: &'a str,
    points: Points,
    models: Vec<Model>,
    found: Vec<Found>,
    places: Vec<Place>,
    added: Vec<Placed>,
    removed: Vec<Placed>,
    outlines: Vec<Line>,
    surfaces: BTreeMap<&'static str, Grid>,
    maps: Vec<Map<'a>>,
    sections: Vec<Cut<'a>>,
    works: Option<Works>,
    windows: Vec<Window<'a>>,
    origin: [f64; 3],
    rounds: u32,
    /// Fitting error at the end of its colour scale, metres.
    error_reach: f32,
    review: Option<&'a Review>,
    rating: Option<Rating<'a>>,
}

#[derive(Serialize)]
struct Rating<'a> {
    site: &'a str,
    names: [&'static str; SIGNS.len()],
    signs: Vec<[f32; SIGNS.len()]>,
    pairs: Vec<[Rated; 2]>,
    given: Option<&'a Ratings>,
    weights: Vec<Weight<'a>>,
}

#[derive(Serialize)]
struct Rated {
    model: u16,
    pose: [f32; 7],
    signs: [f32; SIGNS.len()],
}

#[derive(Serialize)]
struct Weight<'a> {
    sign: &'a str,
    today: f32,
    learned: [f32; 2],
    #[serde(rename = "movedBy")]
    moved_by: [u32; 2],
}

#[derive(Serialize)]
struct Model {
    name: String,
    vertices: Span,
    triangles: Span,
    centre: [f32; 3],
    radius: f32,
    mass_t: f32,
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
    #[serde(rename = "typeJudged")]
    type_judged: bool,
    /// Legs seen, hidden and looked through.
    legs: Option<[u8; 3]>,
    second: Option<u16>,
    #[serde(rename = "secondFit_m")]
    second_fit_m: Option<f32>,
}

#[derive(Serialize)]
struct Place {
    id: u32,
    centre: [f32; 3],
}

#[derive(Serialize)]
struct Placed {
    order: u32,
    round: u32,
    model: u16,
    pose: [f32; 7],
    /// Height of the centre of mass where the crane lets go, local frame.
    drop_m: f32,
    /// Handling: node, lifted block, ways it is carried.
    #[serde(skip_serializing_if = "String::is_empty")]
    handling: String,
    filled_m3: f32,
    contacts: u32,
    state: &'static str,
}

#[derive(Serialize)]
struct Line {
    closed: bool,
    points: Vec<[f32; 3]>,
}

#[derive(Serialize)]
struct Words<'a> {
    en: &'a str,
    ja: &'a str,
}

#[derive(Serialize)]
struct Map<'a> {
    label: Words<'a>,
    unit: &'a str,
    grid: Grid,
}

#[derive(Serialize)]
struct Cut<'a> {
    label: Words<'a>,
    from: [f32; 2],
    to: [f32; 2],
    lines: Vec<CutLine>,
}

#[derive(Serialize)]
struct CutLine {
    kind: &'static str,
    /// Offset and level in the site's datum, millimetres kept; no level where the line breaks.
    points: Vec<(f64, Option<f64>)>,
}

#[derive(Serialize)]
struct Works {
    line: Vec<[f32; 2]>,
    reach_m: [f32; 2],
    spacing_m: Option<f32>,
}

#[derive(Serialize)]
struct Window<'a> {
    x: f32,
    y: f32,
    half_m: f32,
    void_m3: f32,
    reason: Words<'a>,
}

/// JSON and packed columns.
pub(crate) fn view_data(input: &ReportInput) -> Result<(String, String), ReportError> {
    let mut blob = Blob::default();
    let points = points(input, &mut blob);
    let models = input.catalog.iter().map(|(_, m)| Model {
        name: m.name.clone(),
        vertices: blob.f32s(m.mesh.vertices.iter().flat_map(|v| v.to_array())),
        triangles: blob.u32s(m.mesh.triangles.iter().flatten().copied()),
        centre: m.centre.to_array(),
        radius: m.d_max_m,
        mass_t: m.mass_kg() / 1000.0,
    });
    let models = models.collect();
    let surfaces = surfaces(input, &mut blob);
    let maps = input.maps.iter().map(|m| Map {
        label: words(&m.label),
        unit: &m.unit,
        grid: grid(m.values, &mut blob),
    });
    let maps = maps.collect();
    let placed = |list: &[Placement]| list.iter().map(|p| placed(input, p)).collect();
    let fits: Vec<f32> = shown(input).filter_map(|(_, fit)| fit.fitness_m).collect();
    let blob = blob.packed()?;
    let data = ViewData {
        run: run_name(input, &blob),
        crs: &input.survey.frame.crs,
        points,
        models,
        found: found(input),
        places: places(input),
        added: input.plan.map_or(Vec::new(), |p| placed(&p.placements)),
        removed: input.plan.map_or(Vec::new(), |p| placed(&p.removed)),
        outlines: outlines(input),
        surfaces,
        maps,
        sections: input.sections.iter().map(cut).collect(),
        works: input.alignment.as_ref().map(|a| Works {
            line: a.line.iter().map(|p| p.to_array()).collect(),
            reach_m: a.reach_m,
            spacing_m: a.spacing_m,
        }),
        windows: input.unfilled.iter().map(window).collect(),
        origin: input.survey.frame.origin,
        rounds: input.plan.map_or(0, |p| p.placements.iter().map(|p| p.round).max().unwrap_or(0)),
        error_reach: high_end(&fits),
        review: input.review,
        rating: input.rating.as_ref().map(rating),
    };
    let json = serde_json::to_string(&data).map_err(|e| ReportError::Pack(e.to_string()))?;
    // Inside <script>, a name could otherwise end the element.
    Ok((json.replace('<', "\\u003c"), blob))
}

/// The same for the same points, blocks and maps under the same title.
fn run_name(input: &ReportInput, blob: &str) -> String {
    let mut hash = Sha256::new();
    hash.update(input.title.as_bytes());
    hash.update(blob.as_bytes());
    for (r, fit) in shown(input) {
        hash.update(r.block.0.to_le_bytes());
        numbers(&fit.site_from_block).iter().for_each(|v| hash.update(v.to_le_bytes()));
    }
    hash.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect()
}

fn surfaces(input: &ReportInput, blob: &mut Blob) -> BTreeMap<&'static str, Grid> {
    let Some(s) = &input.surfaces else { return BTreeMap::new() };
    let all: [(&str, Option<&HeightMap>); 4] = [
        ("design", s.design),
        ("surveyed", s.surveyed),
        ("planned", s.planned),
        ("ground", s.ground),
    ];
    all.into_iter().filter_map(|(name, map)| map.map(|m| (name, grid(m, blob)))).collect()
}

/// Blocks the view shows: all that have a pose, stated or not.
pub(crate) fn shown<'a>(
    input: &ReportInput<'a>,
) -> impl Iterator<Item = (&'a Recognised, &'a Fit)> {
    input.recognised.iter().filter_map(|r| Some((r, r.fit()?)))
}

fn found(input: &ReportInput) -> Vec<Found> {
    let one = |(r, fit): (&Recognised, &Fit)| Found {
        id: r.block.0,
        model: fit.model.0,
        pose: numbers(&fit.site_from_block),
        confidence: fit.confidence,
        fitness_m: fit.fitness_m,
        occlusion: fit.occlusion,
        judged: r.is_stated(),
        type_judged: fit.type_judged,
        legs: fit.legs.map(|l| [l.seen, l.hidden, l.missing]),
        second: fit.runner_up.map(|(m, _)| m.0),
        second_fit_m: fit.runner_up.map(|(_, fit)| fit),
    };
    shown(input).map(one).collect()
}

/// Places that no type fits: a block may be there, and nothing of it can be shown.
fn places(input: &ReportInput) -> Vec<Place> {
    let open = input.recognised.iter().filter(|r| r.fit().is_none());
    open.map(|r| Place { id: r.block.0, centre: r.centre(input.catalog).to_array() }).collect()
}

fn placed(input: &ReportInput, p: &Placement) -> Placed {
    Placed {
        order: p.order,
        round: p.round,
        model: p.model.0,
        pose: numbers(&p.rest),
        drop_m: p.drop.transform_point(input.catalog.get(p.model).centre).z,
        filled_m3: p.filled_m3,
        contacts: p.contacts,
        state: p.state.word(),
        handling: handling(p),
    }
}

/// What is said of a block that is no new one lowered straight down; signs that need no language.
fn handling(p: &Placement) -> String {
    let reset = p.handling.reset.map(|r| format!("#{} ↷", r.block.0));
    let ways = p.handling.path.len();
    let guided = (ways > 0).then(|| format!("↘ {ways}"));
    let node = p.handling.node.map(|n| n.to_string());
    let all: Vec<String> = [node, reset, guided].into_iter().flatten().collect();
    all.join(" · ")
}

fn rating<'a>(r: &'a crate::Rating) -> Rating<'a> {
    let place =
        |p: &crate::RatingPlace| Rated { model: p.model.0, pose: numbers(&p.pose), signs: p.signs };
    let weight = |w: &'a crate::RatingWeight| Weight {
        sign: &w.sign,
        today: w.today,
        learned: w.learned,
        moved_by: w.moved_by,
    };
    Rating {
        site: r.site,
        names: SIGNS,
        signs: r.signs.clone(),
        pairs: r.pairs.iter().map(|[a, b]| [place(a), place(b)]).collect(),
        given: r.given,
        weights: r.weights.iter().map(weight).collect(),
    }
}

fn outlines(input: &ReportInput) -> Vec<Line> {
    let one = |o: &crate::Outline| Line {
        closed: o.closed,
        points: o.points.iter().map(|p| p.to_array()).collect(),
    };
    input.outlines.iter().map(one).collect()
}

fn words(text: &Text) -> Words<'_> {
    Words { en: &text.en, ja: &text.ja }
}

fn window(w: &crate::UnfilledWindow) -> Window<'_> {
    Window {
        x: w.centre.x,
        y: w.centre.y,
        half_m: w.half_m,
        void_m3: w.void_m3,
        reason: words(&w.reason),
    }
}

fn cut(s: &crate::Section) -> Cut<'_> {
    let kind = |kind| match kind {
        SectionLineKind::Design => "design",
        SectionLineKind::AsIs => "surveyed",
        SectionLineKind::Planned => "planned",
        SectionLineKind::Ground => "ground",
    };
    let mm = |v: f32| (f64::from(v) * 1000.0).round() / 1000.0;
    let point = |p: &[f32; 2]| (mm(p[0]), p[1].is_finite().then(|| mm(p[1])));
    let lines = s.lines.iter().map(|l| CutLine {
        kind: kind(l.kind),
        points: l.points.iter().filter(|p| p[0].is_finite()).map(point).collect(),
    });
    Cut {
        label: words(&s.label),
        from: s.from.to_array(),
        to: s.to.to_array(),
        lines: lines.collect(),
    }
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
    let found = input.point_fit_m.len();
    if found != 0 && found != need {
        return Err(ReportError::Column { column: "point_fit_m", found, need });
    }
    if input.alignment.as_ref().is_some_and(|a| a.line.len() < 2) {
        return Err(ReportError::Line);
    }
    match input.survey.cloud.position_m.iter().position(|p| !p.is_finite()) {
        Some(number) => Err(ReportError::NotFinite { what: "point", number }),
        None => Ok(()),
    }
}
