//! A report of a made-up breakwater of any size: how large the page gets and how quickly it opens.
//!
//! `cargo run --release -p report --example breakwater -- OUT.html [blocks] [placements] [points]`
//!
//! Blocks lie on a regular mound with random turns; nothing is simulated, recognised or planned.

use geom::{HeightMap, PointCloud, Pose, Quat, SeedTree, Vec2, Vec3};
use rand::{Rng, RngExt};
use report::*;
use scene::*;

const CREST_M: f32 = 6.0;
const HALF_CREST_M: f32 = 4.0;
const SLOPE: f32 = 4.0 / 3.0;

/// Height of the finished works over the toe.
fn design_m(y: f32) -> f32 {
    (CREST_M - (y.abs() - HALF_CREST_M).max(0.0) / SLOPE).max(0.0)
}

fn turn(rng: &mut impl Rng) -> Quat {
    let mut v = || rng.random_range(-1.0_f32..1.0);
    let (axis, angle) = (Vec3::new(v(), v(), v() + 0.01).normalize(), 3.0 * v());
    Quat::from_axis_angle(axis, angle)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.first().expect("usage: breakwater OUT.html [blocks] [placements] [points]");
    let number = |i: usize, default: usize| {
        arguments.get(i).map_or(default, |a| a.parse().expect("a whole number"))
    };
    let (blocks, placements, points) = (number(1, 5_000), number(2, 2_000), number(3, 2_000_000));
    let site = Site::made(blocks, placements, points);
    let page = html(&site.input()).expect("the values belong together");
    std::fs::write(out, &page).expect("the file can be written");
    let pdf = std::path::Path::new(out).with_extension("pdf");
    let font = std::env::var("SHEET_FONT")
        .ok()
        .map(|path| SheetFont { data: std::fs::read(path).expect("a font"), index: 0 });
    let set = SheetSet { author: "Example".into(), drawing: "P-1".into(), font };
    std::fs::write(pdf, sheets(&site.input(), &set).expect("the values belong together"))
        .expect("the file can be written");
    println!(
        "{out}: {} blocks, {} placements, {} bytes",
        site.recognised.len(),
        site.plan.placements.len(),
        page.len()
    );
}

struct Site {
    survey: Survey,
    catalog: Catalog,
    recognised: Vec<Recognised>,
    plan: Plan,
    fit: Vec<f32>,
    distance: Vec<f32>,
    design: HeightMap,
    surveyed: HeightMap,
    planned: HeightMap,
    before: HeightMap,
    after: HeightMap,
    long_m: f32,
}

impl Site {
    fn made(blocks: usize, placements: usize, points: usize) -> Self {
        let model = blocks::shape_model("tetrapod-5t", Shape::Tetrapod { size: 2.0 }, 2300.0);
        let catalog = Catalog::new(vec![model.expect("a tetrapod of 2 m")]);
        let mesh = &catalog.get(ModelId(0)).mesh;
        let mut rng = SeedTree::new(1).rng();
        // Across the mound stand about fifteen blocks; the length follows. In so many of 24 rows the seaward half is missing that
        // both numbers are reached, if not on the same row.
        let (pitch, across) = (1.75_f32, 15_usize);
        let share = 2.0 * placements as f32 / (blocks + placements).max(1) as f32;
        let missing_rows = (24.0 * share).round().min(24.0) as usize;
        let rows = (blocks + placements).div_ceil(across).max(4) + 48;
        let mut places: Vec<(Vec3, bool)> = Vec::new();
        for row in 0..rows {
            for column in 0..across {
                let mut jitter = || rng.random_range(-0.3_f32..0.3);
                let (x, y) =
                    (row as f32 * pitch + jitter(), (column as f32 - 7.0) * pitch + jitter());
                let missing = row % 24 >= 24 - missing_rows && y < 0.0;
                places.push((Vec3::new(x, y, design_m(y) - 0.9 + jitter()), missing));
            }
        }
        let mut recognised: Vec<Recognised> = Vec::new();
        let mut kept: Vec<Placement> = Vec::new();
        let mut long_m = 4.0 * pitch;
        for (at, missing) in places {
            let full = if missing { kept.len() == placements } else { recognised.len() == blocks };
            if full {
                continue;
            }
            long_m = long_m.max(at.x + pitch / 2.0);
            let pose = Pose::from_parts(at, turn(&mut rng));
            if missing {
                kept.push(placement(kept.len() as u32 + 1, pose, &mut rng));
            } else {
                recognised.push(block(recognised.len() as u32 + 1, pose, &mut rng));
            }
        }
        let each = (points / 2 / recognised.len().max(1)).max(1);
        let (mut position, mut fit) = (Vec::new(), Vec::new());
        for r in &mut recognised {
            let start = position.len() as u32;
            let noise = if r.is_stated() { 0.012_f32 } else { 0.05 };
            let pose = r.fit().expect("every block has a pose").site_from_block;
            for (p, normal) in mesh.sample_surface(each * 2, &mut rng) {
                let outward = pose.transform_vector(normal);
                if outward.z > -0.1 && fit.len() < points {
                    let off =
                        noise * (rng.random_range(-1.0_f32..1.0) + rng.random_range(-1.0_f32..1.0));
                    position.push(pose.transform_point(p) + outward * off);
                    fit.push(off.abs());
                }
            }
            r.points = (start..position.len() as u32).collect();
        }
        while position.len() < points {
            let (x, y) = (rng.random_range(-5.0..long_m + 5.0), rng.random_range(-22.0_f32..22.0));
            position.push(Vec3::new(x, y, design_m(y) - 2.4 + rng.random_range(-0.06_f32..0.06)));
            fit.push(f32::NAN);
        }
        let mut design =
            HeightMap::empty(Vec2::new(-2.0, -14.0), Vec2::new(long_m + 2.0, 14.0), 0.1);
        let mut surveyed = design.clone();
        design.fill_with(|x, y| if x < 0.0 || x > long_m { f32::NAN } else { design_m(y) });
        surveyed.fill_with(|_, y| design_m(y) - 2.4);
        for fit in recognised.iter().filter_map(|r| r.fit()) {
            surveyed.raise(mesh, &fit.site_from_block);
        }
        let mut planned = surveyed.clone();
        for p in &kept {
            planned.raise(mesh, &p.rest);
        }
        let minus = |b: &HeightMap| {
            let mut map = design.clone();
            map.z_m.iter_mut().zip(&b.z_m).for_each(|(d, z)| *d -= z);
            map
        };
        let (before, after) = (minus(&surveyed), minus(&planned));
        let distance = position.iter().map(|p| design_m(p.y) - p.z).collect();
        let volume =
            |m: &HeightMap| m.z_m.iter().filter(|z| **z > 0.0).sum::<f32>() * m.cell_m * m.cell_m;
        let summary = PlanSummary {
            void_before_m3: volume(&before),
            void_after_m3: volume(&after),
            protruding: 17,
            mass_kg: f64::from(catalog.get(ModelId(0)).mass_kg()) * kept.len() as f64,
            ..PlanSummary::default()
        };
        let removed = (0..kept.len() / 2)
            .map(|i| Placement {
                state: [PlacementState::Overflow, PlacementState::Unstable][i % 2],
                handling: scene::Handling::default(),
                ..kept[i].clone()
            })
            .collect();
        let frame = SiteFrame {
            origin: [-62_334.5, -42_211.25, 0.5],
            crs: "EPSG:6679".into(),
            vertical_datum: "T.P.".into(),
        };
        let survey =
            Survey { cloud: PointCloud::from_positions(position), frame, ..Survey::default() };
        let plan = Plan { placements: kept, removed, summary };
        Self {
            survey,
            catalog,
            recognised,
            plan,
            fit,
            distance,
            design,
            surveyed,
            planned,
            before,
            after,
            long_m,
        }
    }

    fn input(&self) -> ReportInput<'_> {
        let mut input = ReportInput::new("Made-up breakwater", &self.survey, &self.catalog);
        let blocks = self.plan.placements.len() as u32;
        input.program = format!("example of tsumu {}", env!("CARGO_PKG_VERSION"));
        input.recognised = &self.recognised;
        input.plan = Some(&self.plan);
        input.point_fit_m = &self.fit;
        input.point_distance_m = &self.distance;
        input.survey_date = "2026-11-30".into();
        let basis = Text::new("10 made-up plans", "架空の計画 10 回");
        input.count = Some(Count {
            blocks,
            p10_p90: Some((blocks - blocks / 20, blocks + blocks / 15)),
            basis,
        });
        input.surfaces = Some(Surfaces {
            design: Some(&self.design),
            surveyed: Some(&self.surveyed),
            planned: Some(&self.planned),
            ground: None,
        });
        let line = vec![Vec2::ZERO, Vec2::new(self.long_m, 0.0)];
        input.alignment = Some(Alignment { line, reach_m: [13.0, 13.0], spacing_m: None });
        input.outlines = [-12.0, -HALF_CREST_M, HALF_CREST_M, 12.0]
            .map(|y| Outline {
                label: Text::new("Design", "計画線"),
                points: vec![
                    Vec3::new(0.0, y, design_m(y)),
                    Vec3::new(self.long_m, y, design_m(y)),
                ],
                closed: false,
            })
            .to_vec();
        input.maps = [
            ("Missing before", "不足高さ（現況）", &self.before),
            ("Missing after", "不足高さ（計画後）", &self.after),
        ]
        .map(|(en, ja, values)| MapLayer { label: Text::new(en, ja), unit: "m".into(), values })
        .to_vec();
        input.unfilled = (0..self.recognised.len() / 40)
            .map(|i| UnfilledWindow {
                centre: Vec2::new((i * 7) as f32 % self.long_m, (i % 9) as f32 * 2.0 - 8.0),
                half_m: 0.8,
                void_m3: 0.7 + (i % 5) as f32 * 0.3,
                reason: [
                    Text::new("too shallow for a block", "ブロックには浅すぎる"),
                    Text::new("every trial stood above the design", "試行がすべて計画面を超過"),
                ][i % 2]
                    .clone(),
            })
            .collect();
        input.sections = (1..9)
            .map(|k| {
                let x = self.long_m * k as f32 / 9.0;
                let line = |kind, map: &HeightMap| SectionLine {
                    kind,
                    points: (-130..=130)
                        .map(|i| i as f32 / 10.0)
                        .map(|o| [o, map.sample_m(x, -o).map_or(f32::NAN, |z| z + 0.5)])
                        .collect(),
                };
                Section {
                    label: Text::new(format!("Chainage {x:.1} m"), format!("距離 {x:.1} m")),
                    from: Vec2::new(x, 13.0),
                    to: Vec2::new(x, -13.0),
                    lines: vec![
                        line(SectionLineKind::AsIs, &self.surveyed),
                        line(SectionLineKind::Planned, &self.planned),
                        line(SectionLineKind::Design, &self.design),
                    ],
                }
            })
            .collect();
        input.figures = vec![Figure::new(
            Text::new("Survey points", "測量点数"),
            self.survey.cloud.len().to_string(),
            "",
        )];
        input.histograms = vec![Histogram {
            label: Text::new("Fitting error of each block", "各ブロックの当てはめ誤差"),
            unit: "mm".into(),
            values: self
                .recognised
                .iter()
                .filter_map(|r| r.fit()?.fitness_m)
                .map(|v| v * 1000.0)
                .collect(),
        }];
        input
    }
}

fn block(id: u32, pose: Pose, rng: &mut impl Rng) -> Recognised {
    let doubtful = id.is_multiple_of(23);
    let mut some = |low: f32, high: f32| Some(rng.random_range(low..high));
    let fit = Fit {
        confidence: if doubtful { Some(0.4) } else { some(0.0, 0.35).map(|v| 1.0 - v * v) },
        fitness_m: if doubtful { Some(0.05) } else { some(0.012, 0.022) },
        occlusion: some(0.3, 0.7),
        ..Fit::of_pose(ModelId(0), pose)
    };
    let verdict = if doubtful { Verdict::NotJudged(Guess::Fit(fit)) } else { Verdict::Stated(fit) };
    Recognised { block: InstanceId(id), points: Vec::new(), verdict }
}

fn placement(order: u32, rest: Pose, rng: &mut impl Rng) -> Placement {
    Placement {
        order,
        round: 1 + (order - 1) % 4,
        model: ModelId(0),
        drop: Pose::from_parts(rest.translation + Vec3::Z * 0.8, rest.rotation),
        rest,
        filled_m3: rng.random_range(0.6..1.9),
        contacts: rng.random_range(3..6),
        state: PlacementState::Kept,
        handling: scene::Handling::default(),
    }
}
