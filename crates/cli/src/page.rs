//! Puts a run's values into the report. Labels are in both languages of the page.

use crate::surfaces::Surfaces;
use geom::{Vec2, Vec3, Warning};
use pipeline::Works;
use report::{Count, Figure, Histogram, MapLayer, Outline, ReportInput, Section, SectionLine, SectionLineKind, Text};
use scene::{DesignSurface, Judgement, Plan, Scene};
use serde_json::Value;

/// Everything a report is made of.
pub struct PageInput<'a> {
    /// Name of the site.
    pub title: &'a str,
    /// Survey, catalogue, blocks, design.
    pub works: &'a Works<'a>,
    /// The pile planning started from.
    pub pile: &'a Scene,
    /// The plan.
    pub plan: &'a Plan,
    /// `recognise/summary.json`.
    pub recognised: &'a Value,
    /// `plan/summary.json`.
    pub planned: &'a Value,
    /// Names and values that identify the run.
    pub provenance: Vec<(Text, String)>,
    /// What was warned of.
    pub warnings: Vec<String>,
}

/// The page as HTML.
pub fn html(input: &PageInput) -> Result<String, report::ReportError> {
    let works = input.works;
    let surfaces = Surfaces::of(works, input.pile, input.plan);
    let before = surfaces.deficit(&surfaces.as_is);
    let after = surfaces.deficit(&surfaces.planned);
    let distance: Vec<f32> = works.survey.cloud.position_m.iter().map(|&p| design_distance_m(works, p)).collect();

    let mut page = ReportInput::new(input.title, works.survey, works.catalog);
    page.program = format!("tsumu {}", env!("CARGO_PKG_VERSION"));
    page.recognised = works.blocks;
    page.plan = Some(input.plan);
    page.point_distance_m = &distance;
    page.count = Some(Count {
        blocks: input.plan.placements.len() as u32,
        p10_p90: None,
        basis: Text::new(
            "one simulated plan; another seed gives another count",
            "一回のシミュレーションの結果。乱数の種を変えると個数も変わる",
        ),
    });
    page.figures = figures(input);
    page.outlines = vec![outline(works)];
    page.maps = vec![
        MapLayer { label: Text::new("Deficit before", "不足高さ(現況)"), unit: "m".into(), values: &before },
        MapLayer { label: Text::new("Deficit after", "不足高さ(計画後)"), unit: "m".into(), values: &after },
    ];
    page.sections = sections(works, &surfaces);
    let accepted = || works.blocks.iter().filter(|b| b.judgement == Judgement::Accepted);
    page.histograms = vec![
        Histogram {
            label: Text::new("Fit error of each block", "各ブロックの当てはめ誤差"),
            unit: "mm".into(),
            values: accepted().map(|b| b.fitness_m * 1000.0).collect(),
        },
        Histogram {
            label: Text::new("Confidence of each block", "各ブロックの確信度"),
            unit: "%".into(),
            values: accepted().map(|b| b.confidence * 100.0).collect(),
        },
        Histogram {
            label: Text::new("Distance of the planned surface below the design", "計画後の面と計画面との差"),
            unit: "m".into(),
            values: Surfaces::known(&after),
        },
    ];
    page.assumptions = assumptions(works);
    page.warnings = input.warnings.iter().map(|w| Warning { stage: "run", message: w.clone() }).collect();
    page.provenance = input.provenance.clone();
    report::html(&page)
}

/// Distance of a point below the design surface; NaN outside the works.
fn design_distance_m(works: &Works, p: Vec3) -> f32 {
    let site = works.survey.frame.site_from_local(p);
    works.design.level_at(site.x, site.y).map_or(f32::NAN, |level| (level - site.z) as f32)
}

fn figures(input: &PageInput) -> Vec<Figure> {
    let (r, p) = (input.recognised, input.planned);
    let fixed = |v: &Value, digits: usize, scale: f64| {
        v.as_f64().map_or("–".to_string(), |v| format!("{:.digits$}", v * scale))
    };
    let whole = |v: &Value| v.to_string();
    vec![
        Figure::new(Text::new("Blocks recognised", "認識したブロック"), whole(&r["recognised_blocks"]), ""),
        Figure::new(Text::new("Not judged", "判定できないもの"), whole(&r["not_judged_blocks"]), ""),
        Figure::new(Text::new("Blocks to add", "追加するブロック"), whole(&p["blocks"]), ""),
        Figure::new(Text::new("Concrete to add", "追加コンクリート"), fixed(&p["concrete_m3"], 1, 1.0), "m³"),
        Figure::new(Text::new("Mass to add", "追加質量"), fixed(&p["mass_kg"], 1, 1e-3), "t"),
        Figure::new(Text::new("Void below the design, before", "不足量(現況)"), fixed(&p["void_before_m3"], 1, 1.0), "m³"),
        Figure::new(Text::new("Void below the design, after", "不足量(計画後)"), fixed(&p["void_after_m3"], 1, 1.0), "m³"),
        Figure::new(
            Text::new("Mean distance to the design, after", "計画面との平均距離"),
            fixed(&p["mean_distance_m"], 2, 1.0),
            "m",
        ),
        Figure::new(
            Text::new("Largest distance to the design, after", "計画面との最大距離"),
            fixed(&p["max_distance_m"], 2, 1.0),
            "m",
        ),
        Figure::new(Text::new("Protruding blocks", "突出ブロック"), whole(&p["protruding"]), ""),
        Figure::new(Text::new("Porosity of the new layer", "新しい層の空隙率"), fixed(&p["porosity"], 1, 100.0), "%"),
        Figure::new(Text::new("Survey points", "測量点数"), whole(&r["points"]), ""),
        Figure::new(Text::new("Fitting error", "当てはめ誤差"), fixed(&r["fitting_error_m"], 1, 1000.0), "mm"),
        Figure::new(Text::new("Matching rate", "一致率"), fixed(&r["matching_rate"], 1, 100.0), "%"),
    ]
}

fn outline(works: &Works) -> Outline {
    let frame = &works.survey.frame;
    let corners: Vec<[f64; 2]> = match works.design {
        DesignSurface::Level { boundary, .. } | DesignSurface::Planes { boundary, .. } => boundary.clone(),
        DesignSurface::Section { alignment, .. } => alignment.clone(),
        DesignSurface::Grid { .. } => {
            let [low, high] = works.design.extent();
            vec![low, [high[0], low[1]], high, [low[0], high[1]]]
        }
    };
    let closed = !matches!(works.design, DesignSurface::Section { .. });
    let points = corners
        .iter()
        .map(|&[east, north]| {
            let level = works.design.level_at(east, north).unwrap_or(frame.origin[2]);
            frame.local_from_site(geom::DVec3::new(east, north, level))
        })
        .collect();
    let label = if closed { Text::new("Boundary", "施工範囲") } else { Text::new("Alignment", "法線") };
    Outline { label, points, closed }
}

/// Cuts across the works, a block's length apart but nine at the most, square to their longer side.
fn sections(works: &Works, surfaces: &Surfaces) -> Vec<Section> {
    let map = &surfaces.design;
    let size = Vec2::new(map.nx as f32, map.ny as f32) * map.cell_m;
    let start = Vec2::from_array(map.origin);
    let (along, across, length_m) = if size.x >= size.y { (Vec2::X, Vec2::Y, size.x) } else { (Vec2::Y, Vec2::X, size.y) };
    let count = ((length_m / (4.0 * works.catalog.d_max_m())).floor() as usize).clamp(1, 9);
    let datum_m = works.survey.frame.origin[2];
    (1..=count)
        .map(|i| {
            let chainage_m = length_m * i as f32 / (count + 1) as f32;
            let from = start + along * chainage_m;
            let to = from + across * size.dot(across);
            let line = |kind, map| SectionLine { kind, points: Surfaces::cut(map, from, to, datum_m) };
            Section {
                label: Text::new(format!("Section {i}, chainage {chainage_m:.1} m"), format!("断面{i} 距離{chainage_m:.1} m")),
                from,
                to,
                lines: vec![
                    line(SectionLineKind::Ground, &surfaces.ground),
                    line(SectionLineKind::AsIs, &surfaces.as_is),
                    line(SectionLineKind::Planned, &surfaces.planned),
                    line(SectionLineKind::Design, &surfaces.design),
                ],
            }
        })
        .collect()
}

fn assumptions(works: &Works) -> Vec<Text> {
    let mut list = Vec::new();
    if works.survey.sensor_positions.is_empty() {
        list.push(Text::new(
            "The sensor's position is unknown: the survey is taken as seen from straight above.",
            "センサー位置が不明のため、真上から測量したものとして扱った。",
        ));
    }
    if works.ground.is_none() {
        list.push(Text::new(
            "The bed below the blocks is estimated from survey points that no block explains.",
            "ブロックの下の地盤は、どのブロックにも属さない測量点から推定した。",
        ));
    }
    list.push(Text::new(
        "Blocks are rigid and whole; waves and settlement of the bed are not simulated.",
        "ブロックは剛体で破損がないものとし、波浪と地盤の沈下は考慮していない。",
    ));
    list
}
