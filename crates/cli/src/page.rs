//! Puts a run's values into the report. Labels are in both languages of the page.

use crate::drawings::Drawings;
use geom::Warning;
use pipeline::Works;
use report::{
    Count, Figure, Histogram, MapLayer, Outline, ReportInput, Section, SectionLine,
    SectionLineKind, Text,
};
use scene::{Catalog, Plan, Recognised, Review, Scene, Survey};
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
    /// Its surfaces and sections.
    pub drawings: &'a Drawings,
    /// `recognise/summary.json`.
    pub recognised: &'a Value,
    /// `plan/summary.json`.
    pub planned: &'a Value,
    /// The review that the blocks honour.
    pub review: Option<&'a Review>,
    /// Names and values that identify the run.
    pub provenance: Vec<(Text, String)>,
    /// What was warned of.
    pub warnings: Vec<String>,
}

/// A page and the picture for its cover.
pub struct Page {
    /// The whole report.
    pub html: String,
    /// PNG of the site with its recognised and planned blocks.
    pub png: Vec<u8>,
}

/// Size of the picture.
const PICTURE: (usize, usize) = (1400, 800);

/// PNG of a survey and the blocks recognised in it.
pub fn picture(
    survey: &Survey,
    catalog: &Catalog,
    blocks: &[Recognised],
) -> Result<Vec<u8>, report::ReportError> {
    let mut page = ReportInput::new("", survey, catalog);
    page.recognised = blocks;
    cover(&page)
}

fn cover(page: &ReportInput) -> Result<Vec<u8>, report::ReportError> {
    report::site_picture(page, PICTURE.0, PICTURE.1).on([246, 248, 250]).png()
}

/// The page and its picture.
pub fn page(input: &PageInput) -> Result<Page, report::ReportError> {
    let works = input.works;
    let drawings = input.drawings;
    let distance = pipeline::point_deficits_m(works, input.pile, input.plan);

    let mut page = ReportInput::new(input.title, works.survey, works.catalog);
    page.program = format!("tsumu {}", crate::version::STAMP);
    page.recognised = works.blocks;
    page.review = input.review;
    page.plan = Some(input.plan);
    page.point_distance_m = &distance;
    page.count = Some(count(input));
    page.figures = figures(input);
    page.outlines = pipeline::design_lines(works)
        .into_iter()
        .map(|(closed, points)| Outline { label: Text::new("Design", "計画線"), points, closed })
        .collect();
    page.maps = vec![
        MapLayer {
            label: Text::new("Deficit before", "不足高さ(現況)"),
            unit: "m".into(),
            values: &drawings.deficit_before,
        },
        MapLayer {
            label: Text::new("Deficit after", "不足高さ(計画後)"),
            unit: "m".into(),
            values: &drawings.deficit_after,
        },
    ];
    page.sections = sections(drawings);
    let fits = || scene::stated(works.blocks).map(|(_, fit)| fit);
    page.histograms = vec![
        Histogram {
            label: Text::new("Fit error of each block", "各ブロックの当てはめ誤差"),
            unit: "mm".into(),
            values: fits().filter_map(|fit| Some(fit.fitness_m? * 1000.0)).collect(),
        },
        Histogram {
            label: Text::new("Confidence of each block", "各ブロックの確信度"),
            unit: "%".into(),
            values: fits().filter_map(|fit| Some(fit.confidence? * 100.0)).collect(),
        },
        Histogram {
            label: Text::new(
                "Distance of the planned surface below the design",
                "計画後の面と計画面との差",
            ),
            unit: "m".into(),
            values: drawings.deficit_after.z_m.clone(),
        },
    ];
    page.assumptions = assumptions(works);
    page.warnings =
        input.warnings.iter().map(|w| Warning { stage: "run", message: w.clone() }).collect();
    page.provenance = input.provenance.clone();
    Ok(Page { html: report::html(&page)?, png: cover(&page)? })
}

/// The count with the range that other seeds give, when it was computed.
fn count(input: &PageInput) -> Count {
    let range = &input.planned["count_range"];
    let bound = |key: &str| range[key].as_f64().map(|v| v.round() as u32);
    let p10_p90 = bound("p10").zip(bound("p90"));
    let varied = range["by_thresholds"].as_array().is_some_and(|t| t.len() > 1);
    let basis = match (p10_p90, range["plans"].as_u64()) {
        (Some(_), Some(n)) if varied => Text::new(
            format!(
                "P10 to P90 of {n} simulated plans with different seeds, minimum volumes and overflow thresholds"
            ),
            format!("乱数の種・最小体積・許容突出量を変えた{n}回の計画の10～90パーセンタイル"),
        ),
        (Some(_), Some(n)) => Text::new(
            format!("P10 to P90 of {n} simulated plans with different seeds"),
            format!("乱数の種を変えた{n}回の計画の10～90パーセンタイル"),
        ),
        _ => Text::new(
            "one simulated plan; another seed gives another count",
            "一回のシミュレーションの結果。乱数の種を変えると個数も変わる",
        ),
    };
    Count { blocks: input.plan.placements.len() as u32, p10_p90, basis }
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
        Figure::new(
            Text::new("Void below the design, before", "不足量(現況)"),
            fixed(&p["void_before_m3"], 1, 1.0),
            "m³",
        ),
        Figure::new(
            Text::new("Void below the design, after", "不足量(計画後)"),
            fixed(&p["void_after_m3"], 1, 1.0),
            "m³",
        ),
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
        Figure::new(Text::new("Protruding blocks", "突出ブロック"), whole(&p["protruding"]), "").with_note(Text::new(
            "some part, say a leg's tip, above the design by more than the overflow threshold; the plan limits centres of mass",
            "脚の先端など一部でも許容突出量を超えて計画面から出るもの（計画の制限は重心に対する）",
        )),
        Figure::new(Text::new("Porosity of the new layer", "新しい層の空隙率"), fixed(&p["porosity"], 1, 100.0), "%"),
        Figure::new(
            Text::new("Blocks by N = φ·A·V^(−2/3)", "N = φ·A·V^(−2/3) による個数"),
            fixed(&p["count_range"]["by_layers"], 0, 1.0),
            "",
        ),
        Figure::new(
            Text::new("Blocks by void · (1 − porosity) / V", "不足量・(1−空隙率)/V による個数"),
            fixed(&p["count_range"]["by_volume"], 0, 1.0),
            "",
        ),
        Figure::new(Text::new("Survey points", "測量点数"), whole(&r["points"]), ""),
        Figure::new(Text::new("Fitting error", "当てはめ誤差"), fixed(&r["fitting_error_m"], 1, 1000.0), "mm"),
        Figure::new(Text::new("Matching rate", "一致率"), fixed(&r["matching_rate"], 1, 100.0), "%"),
    ]
}

fn sections(drawings: &Drawings) -> Vec<Section> {
    let line = |kind, points: &[[f32; 2]]| SectionLine { kind, points: points.to_vec() };
    drawings
        .sections
        .iter()
        .map(|cut| Section {
            label: Text::new(
                format!("Chainage {:.1} m", cut.chainage_m),
                format!("距離 {:.1} m", cut.chainage_m),
            ),
            from: cut.from,
            to: cut.to,
            lines: vec![
                line(SectionLineKind::Ground, &cut.ground),
                line(SectionLineKind::AsIs, &cut.as_surveyed),
                line(SectionLineKind::Planned, &cut.planned),
                line(SectionLineKind::Design, &cut.design),
            ],
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
