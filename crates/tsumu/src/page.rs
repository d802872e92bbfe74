//! Puts a run's values into the report. Labels are in both languages of the page.

use crate::drawings::Drawings;
use crate::error::OrBadInput;
use crate::planning::Planned;
use crate::ratings::WeightRecord;
use crate::recognition::Recognition;
use crate::review::ReviewRecord;
use crate::summary::{PlannedSummary, RecogniseSummary};
use crate::unfilled::why;
use crate::{Result, Site, sheet_font};
use geom::{DVec3, Stage, Vec2, Warning};
use io::manifest::Manifest;
use metrics::Split;
use report::{
    Alignment, Count, Figure, Histogram, MapLayer, Outline, Rating, RatingPlace, RatingWeight,
    ReportInput, Section, SectionLine, SectionLineKind, SheetSet, Surfaces, Text, UnfilledWindow,
};
use scene::{Catalog, Recognised, Review, SiteFrame, Survey};
use std::path::Path;

/// Everything a report is made of.
pub(crate) struct PageInput<'a> {
    /// Survey, catalogue, design.
    pub site: &'a Site,
    /// Its blocks.
    pub recognition: &'a Recognition,
    /// The plan with its surfaces and sections; `None`: an inventory.
    pub planned: Option<(&'a Planned, &'a Drawings)>,
    /// The review that the blocks follow.
    pub review: Option<&'a Review>,
    /// What identifies the run.
    pub manifest: Option<&'a Manifest>,
    /// What was warned of.
    pub warnings: Vec<String>,
}

/// A page and the picture for its cover.
pub struct Page {
    /// The whole report.
    pub html: String,
    /// PNG of the site with its recognised and planned blocks.
    pub png: Vec<u8>,
    /// The drawings on paper, PDF.
    pub sheets: Vec<u8>,
}

impl Page {
    /// Writes the page, whole or not at all. Errors: a file of another kind is there.
    pub fn write_html(&self, file: &Path) -> Result<()> {
        io::atomic::write_over_own_kind(file, self.html.as_bytes()).or_bad_input()
    }
}

/// Size of the picture.
const PICTURE: (usize, usize) = (1400, 800);

/// PNG of a survey and the blocks recognised in it.
pub(crate) fn picture(
    survey: &Survey,
    catalog: &Catalog,
    blocks: &[Recognised],
) -> Result<Vec<u8>> {
    let mut page = ReportInput::new("", survey, catalog);
    page.recognised = blocks;
    cover(&page)
}

fn cover(page: &ReportInput) -> Result<Vec<u8>> {
    Ok(report::site_picture(page, PICTURE.0, PICTURE.1).on([246, 248, 250]).png()?)
}

/// The page, its picture and its sheets.
pub(crate) fn page(input: &PageInput) -> Result<Page> {
    let PageInput { site, recognition, .. } = *input;
    let recognised = RecogniseSummary::of(&site.survey, recognition, &site.catalog);
    let fit =
        metrics::point_fit_m(&site.survey.cloud.position_m, &recognition.blocks, &site.catalog);
    let mut page = ReportInput::new(&site.name, &site.survey, &site.catalog);
    page.survey_date = site.survey_date.clone();
    page.point_fit_m = &fit;
    page.program = format!("tsumu {}", crate::version::STAMP);
    page.recognised = &recognition.blocks;
    page.review = input.review;
    page.histograms = block_histograms(&recognition.blocks);
    page.assumptions = survey_assumptions(site);
    page.assumptions.extend(site.size_sentence(recognition).map(|said| {
        Text::new(
            format!("Size of the blocks as the survey shows it: {said}."),
            format!("測量から推定した寸法：{said}"),
        )
    }));
    page.warnings =
        input.warnings.iter().map(|w| Warning { stage: Stage::Run, message: w.clone() }).collect();
    page.provenance = input.manifest.map(provenance).unwrap_or_default();
    let Some((planned, drawings)) = input.planned else {
        page.figures =
            [found_figures(&recognised), survey_figures(&recognised), check_figures(&recognised)]
                .concat();
        return shown(&page);
    };
    let works = site.works(&recognition.blocks, site.needed_design()?);
    let distance = pipeline::point_deficits_m(&works, &planned.pile, &planned.plan);
    let summary = planned.summary();
    page.plan = Some(&planned.plan);
    page.point_distance_m = &distance;
    page.count = Some(count(planned));
    page.figures = [
        found_figures(&recognised),
        plan_figures(&summary),
        survey_figures(&recognised),
        check_figures(&recognised),
    ]
    .concat();
    page.assumptions.extend(plan_assumptions(site));
    page.outlines = drawings.design_lines.iter().map(outline).collect();
    page.alignment = alignment(drawings, &site.survey.frame);
    page.surfaces = Some(Surfaces {
        design: Some(&drawings.surfaces.design),
        surveyed: Some(&drawings.surfaces.as_surveyed),
        planned: Some(&drawings.surfaces.planned),
        ground: Some(&drawings.bed),
    });
    page.unfilled = planned.unfilled.iter().map(unfilled).collect();
    page.rating = rating(site, &works, planned)?;
    page.maps = maps(drawings);
    page.sections = sections(drawings);
    page.histograms.push(Histogram {
        label: Text::new(
            "Missing to the design after the plan (above is negative)",
            "計画後の計画面までの不足（負は計画面より上）",
        ),
        unit: "m".into(),
        values: drawings.deficit_after.z_m.clone(),
    });
    shown(&page)
}

fn shown(page: &ReportInput) -> Result<Page> {
    let set = SheetSet { font: sheet_font::japanese()?, ..SheetSet::default() };
    let sheets = report::sheets(page, &set)?;
    Ok(Page { html: report::html(page)?, png: cover(page)?, sheets })
}

fn outline((closed, points): &(bool, Vec<geom::Vec3>)) -> Outline {
    Outline { label: Text::new("Design", "計画線"), points: points.clone(), closed: *closed }
}

/// Pairs the page asks to choose from.
const PAIRS: usize = 6;

/// What people who build may rate: plans of policy `search`, whose signs these are.
fn rating<'a>(
    site: &'a Site,
    works: &pipeline::Works,
    planned: &Planned,
) -> Result<Option<Rating<'a>>> {
    let (pile, plan) = (&planned.pile, &planned.plan);
    if site.config.plan.policy != plan::Policy::Search || plan.placements.is_empty() {
        return Ok(None);
    }
    let (config, seed) = (&site.config, geom::SeedTree::new(site.seed));
    let asked = (&site.posterior(), PAIRS);
    let pairs = pipeline::pairs_to_choose(works, pile, config, asked, seed)?;
    let place = |c: &plan::Candidate| RatingPlace {
        model: c.placement.model,
        pose: c.placement.rest,
        signs: c.signs,
    };
    let weight = |w: &WeightRecord| RatingWeight {
        sign: w.sign.clone(),
        today: w.today,
        learned: [w.learned, w.sd],
        moved_by: [w.raised_by, w.lowered_by],
    };
    Ok(Some(Rating {
        site: &site.name,
        signs: pipeline::signs_of_plan(works, pile, plan, config)?,
        pairs: pairs.iter().map(|p| [place(&p.a), place(&p.b)]).collect(),
        given: site.ratings.as_ref(),
        weights: site.learned.iter().flat_map(|l| l.weights.iter().map(weight)).collect(),
    }))
}

/// The line sections stand on; `None` where the works have none.
fn alignment(drawings: &Drawings, frame: &SiteFrame) -> Option<Alignment> {
    let local = |p: &[f64; 2]| frame.local_from_site(DVec3::new(p[0], p[1], 0.0)).truncate();
    let line: Vec<Vec2> = drawings.line.iter().map(local).collect();
    let reach_m = drawings.reach_m.map(|reach| reach as f32);
    (line.len() > 1).then_some(Alignment { line, reach_m, spacing_m: None })
}

fn unfilled(window: &plan::Unfilled) -> UnfilledWindow {
    UnfilledWindow {
        centre: window.centre,
        half_m: window.half_m,
        void_m3: window.void_m3,
        reason: why(window.reason),
    }
}

fn block_histograms(blocks: &[Recognised]) -> Vec<Histogram> {
    let fits = || scene::stated(blocks).map(|(_, fit)| fit);
    vec![
        Histogram {
            label: Text::new("Fitting error of each block", "各ブロックの当てはめ誤差"),
            unit: "mm".into(),
            values: fits().filter_map(|fit| Some(fit.fitness_m? * 1000.0)).collect(),
        },
        Histogram {
            label: Text::new("Confidence of each block", "各ブロックの信頼度"),
            unit: "%".into(),
            values: fits().filter_map(|fit| Some(fit.confidence? * 100.0)).collect(),
        },
    ]
}

fn maps(drawings: &Drawings) -> Vec<MapLayer<'_>> {
    vec![
        MapLayer {
            label: Text::new("Missing before", "不足高さ（現況）"),
            unit: "m".into(),
            values: &drawings.deficit_before,
        },
        MapLayer {
            label: Text::new("Missing after", "不足高さ（計画後）"),
            unit: "m".into(),
            values: &drawings.deficit_after,
        },
    ]
}

/// What identifies a run on its report.
fn provenance(manifest: &Manifest) -> Vec<(Text, String)> {
    let weights = manifest.notes.get("weights").and_then(|v| v.as_str()).unwrap_or("–");
    let mut rows = vec![
        (Text::new("Program", "プログラム"), format!("tsumu {}", manifest.version)),
        (Text::new("Seed", "乱数の種"), manifest.seed.to_string()),
        (Text::new("Network weights", "ネットワークの重み"), weights.to_string()),
    ];
    rows.extend(ReviewRecord::of(manifest).map(|r| r.provenance()));
    for (name, entry) in &manifest.inputs {
        let label = Text::new(format!("Input {name}"), format!("入力 {name}"));
        let hash = entry.blake3.get(..16).unwrap_or_default();
        rows.push((label, format!("{} bytes, BLAKE3 {hash}…", entry.bytes)));
    }
    rows
}

/// The count with the range that other seeds give, when it was computed.
fn count(planned: &Planned) -> Count {
    let bound = |v: f32| f64::from(v).round() as u32;
    // One plan is no range.
    let range = planned.range.as_ref().filter(|r| r.plans > 1);
    let basis = match range {
        Some(range) => {
            let (varied, varied_ja) = match range.varied() {
                true => (", minimum volumes and overflow thresholds", "・最小体積・許容突出量"),
                false => ("", ""),
            };
            let (built, built_ja) = match range.built {
                true => (", each built with the crane's errors", "を据付誤差込みで施工した場合"),
                false => ("", ""),
            };
            let plans = range.plans;
            Text::new(
                format!(
                    "P10 to P90 of {plans} simulated plans with different seeds{varied}{built}"
                ),
                format!(
                    "乱数の種{varied_ja}を変えた{plans}回の計画{built_ja}の10～90パーセンタイル"
                ),
            )
        }
        None => Text::new(
            "one simulated plan; another seed gives another count",
            "一回のシミュレーションの結果。乱数の種を変えると個数も変わる",
        ),
    };
    let p10_p90 = range.map(|r| (bound(r.p10), bound(r.p90)));
    Count { blocks: planned.plan.summary.blocks, p10_p90, basis }
}

fn fixed(value: Option<f64>, digits: usize, scale: f64) -> String {
    let finite = value.filter(|v| v.is_finite());
    finite.map_or("–".to_string(), |v| format!("{:.digits$}", v * scale))
}

fn found_figures(r: &RecogniseSummary) -> Vec<Figure> {
    let mut figures = vec![
        Figure::new(
            Text::new("Blocks recognised", "認識したブロック"),
            r.recognised_blocks.to_string(),
            "",
        ),
        Figure::new(
            Text::new("Not judged", "判定できないもの"),
            r.not_judged_blocks.to_string(),
            "",
        ),
    ];
    if r.damaged_blocks > 0 {
        let label = Text::new("Blocks that lack a leg", "脚の欠けたブロック");
        figures.push(Figure::new(label, r.damaged_blocks.to_string(), "").with_note(Text::new(
            "stated blocks of which a sensor looked through a leg",
            "脚の位置をセンサーが素通ししたもの",
        )));
    }
    figures
}

fn survey_figures(r: &RecogniseSummary) -> Vec<Figure> {
    vec![
        Figure::new(Text::new("Survey points", "測量点数"), r.points.to_string(), ""),
        Figure::new(
            Text::new("Fitting error", "当てはめ誤差"),
            fixed(r.fitting_error_m, 1, 1000.0),
            "mm",
        ),
        Figure::new(Text::new("Matching rate", "一致率"), fixed(r.matching_rate, 1, 100.0), "%"),
    ]
}

/// How far both halves of the survey agree.
fn check_figures(r: &RecogniseSummary) -> Vec<Figure> {
    let Some(check) = &r.self_check else { return Vec::new() };
    let (en, ja) = match check.split {
        Split::Lines => ("every other survey line", "測線を一本おきに分割"),
        Split::Points => ("every other point", "点を一点おきに分割"),
    };
    let wide = |v: Option<f32>| v.map(f64::from);
    vec![
        Figure::new(
            Text::new("Self-check: agreement of halves", "自己点検：半分どうしの一致率"),
            fixed(wide(check.agreement()), 1, 100.0),
            "%",
        )
        .with_note(Text::new(
            format!(
                "{en}; {} and {} blocks stated, {} by both",
                check.stated[0], check.stated[1], check.matched
            ),
            format!("{ja}；各{}・{}個、一致{}個", check.stated[0], check.stated[1], check.matched),
        )),
        Figure::new(
            Text::new("Self-check: places apart, median", "自己点検：位置の差（中央値）"),
            fixed(wide(check.median_displacement_m), 1, 1000.0),
            "mm",
        ),
        Figure::new(
            Text::new("Self-check: places apart, 95 %", "自己点検：位置の差（95 %）"),
            fixed(wide(check.p95_displacement_m), 1, 1000.0),
            "mm",
        ),
        Figure::new(
            Text::new("Self-check: turns apart, 95 %", "自己点検：回転の差（95 %）"),
            fixed(wide(check.p95_turn_rad), 2, 180.0 / std::f64::consts::PI),
            "°",
        ),
    ]
}

fn plan_figures(summary: &PlannedSummary) -> Vec<Figure> {
    let p = &summary.plan;
    let metres = |v: f32, digits| fixed(Some(short(v)), digits, 1.0);
    vec![
        Figure::new(Text::new("Concrete to add", "追加コンクリート"), metres(p.concrete_m3, 1), "m³"),
        Figure::new(Text::new("Mass to add", "追加質量"), fixed(Some(p.mass_kg), 1, 1e-3), "t"),
        Figure::new(
            Text::new("Void below the design, before", "不足量（現況）"),
            metres(p.void_before_m3, 1),
            "m³",
        ),
        Figure::new(
            Text::new("Void below the design, after", "不足量（計画後）"),
            metres(p.void_after_m3, 1),
            "m³",
        ),
        Figure::new(
            Text::new("Mean distance to the design, after", "計画面との平均距離"),
            metres(p.mean_distance_m, 2),
            "m",
        ),
        Figure::new(
            Text::new("Largest distance to the design, after", "計画面との最大距離"),
            metres(p.max_distance_m, 2),
            "m",
        ),
        Figure::new(Text::new("Protruding blocks", "突出ブロック"), p.protruding.to_string(), "").with_note(Text::new(
            "some part, say a leg's tip, above the design by more than the overflow threshold; the plan limits centres of mass",
            "脚の先端など一部でも許容突出量を超えて計画面から出るもの（計画の制限は重心に対する）",
        )),
        Figure::new(
            Text::new("Porosity of the new layer", "新しい層の空隙率"),
            fixed(Some(short(p.porosity)), 1, 100.0),
            "%",
        ),
    ]
}

/// The f64 with the f32's own shortest digits, which is what files say: 0.1 stays 0.1.
fn short(v: f32) -> f64 {
    v.to_string().parse().unwrap_or(f64::NAN)
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

fn survey_assumptions(site: &Site) -> Vec<Text> {
    let from_above = Text::new(
        "The sensor's position is unknown: the survey is taken as seen from straight above.",
        "センサー位置が不明のため、真上から測量したものとして扱った。",
    );
    if site.survey.sensor_positions.is_empty() { vec![from_above] } else { Vec::new() }
}

fn plan_assumptions(site: &Site) -> Vec<Text> {
    let mut list = Vec::new();
    if site.ground.is_none() {
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
