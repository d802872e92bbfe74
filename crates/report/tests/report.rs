//! The page as a whole: what a browser gets, and that nobody can put code into it.

use base64::Engine;
use geom::{HeightMap, PointCloud, Pose, Quat, SeedTree, Stage, Vec2, Vec3, Warning};
use report::*;
use scene::*;
use std::io::Read;

const EVIL: &str = "</script><script>alert(\"1\")</script>{{json}}&'<!--";

struct Fixture {
    survey: Survey,
    catalog: Catalog,
    recognised: Vec<Recognised>,
    plan: Plan,
    distance: Vec<f32>,
    fit: Vec<f32>,
    map: HeightMap,
}

fn fixture() -> Fixture {
    let shapes = [("Tetrapod", Shape::Tetrapod { size: 2.0 }), (EVIL, Shape::Cube { size: 1.5 })];
    let models = shapes.map(|(name, s)| blocks::shape_model(name, s, 2300.0).unwrap());
    let catalog = Catalog::new(models.to_vec());
    let mut rng = SeedTree::new(1).rng();
    let (mut recognised, mut positions) = (Vec::new(), Vec::new());
    for k in 0..6_u32 {
        let pose = Pose::from_parts(
            Vec3::new(2.5 * k as f32, 0.3 * k as f32, 1.0),
            Quat::from_rotation_x(k as f32),
        );
        let model = ModelId(u16::from(k == 2));
        let start = positions.len() as u32;
        positions.extend(
            catalog
                .get(model)
                .mesh
                .sample_surface(400, &mut rng)
                .iter()
                .map(|(p, _)| pose.transform_point(*p)),
        );
        let fit = Fit {
            confidence: Some(0.9),
            fitness_m: Some(0.012),
            runner_up: Some((ModelId(1), 0.05)),
            occlusion: Some(0.25),
            ..Fit::of_pose(model, pose)
        };
        recognised.push(Recognised {
            block: InstanceId(k + 1),
            points: (start..positions.len() as u32).collect(),
            verdict: match k {
                5 => Verdict::NotJudged(Guess::Fit(fit)),
                _ => Verdict::Stated(fit),
            },
        });
    }
    let at = |x: f32| Pose::from_parts(Vec3::new(x, 0.0, 3.0), Quat::IDENTITY);
    let placement = |order, x, state| Placement {
        order,
        round: order,
        model: ModelId(0),
        drop: at(x),
        rest: at(x),
        filled_m3: 1.5,
        contacts: 3,
        state,
        handling: scene::Handling::default(),
    };
    let plan = Plan {
        placements: vec![
            placement(1, 2.0, PlacementState::Kept),
            placement(2, 6.0, PlacementState::Kept),
        ],
        removed: vec![placement(3, 9.0, PlacementState::Overflow)],
        summary: PlanSummary::default(),
    };
    let distance =
        positions.iter().map(|p| if p.x > 10.0 { f32::NAN } else { 2.0 - p.z }).collect();
    let mut map = HeightMap::empty(Vec2::new(0.0, -1.0), Vec2::new(12.0, 3.0), 0.5);
    map.fill_with(|x, y| if y > 2.0 { f32::NAN } else { x / 12.0 - 0.5 });
    let frame = SiteFrame {
        origin: [-62334.5, -42211.25, 0.5],
        crs: "EPSG:6679".into(),
        vertical_datum: EVIL.into(),
    };
    let survey =
        Survey { cloud: PointCloud::from_positions(positions), frame, ..Survey::default() };
    let fit = (0..survey.cloud.len())
        .map(|i| if i % 3 == 0 { f32::NAN } else { i as f32 * 1e-5 })
        .collect();
    Fixture { survey, catalog, recognised, plan, distance, fit, map }
}

fn input(f: &Fixture) -> ReportInput<'_> {
    let mut input = ReportInput::new(EVIL, &f.survey, &f.catalog);
    input.program = "tsumu 0.1.0".into();
    input.recognised = &f.recognised;
    input.plan = Some(&f.plan);
    input.point_distance_m = &f.distance;
    input.point_fit_m = &f.fit;
    input.surfaces = Some(Surfaces {
        design: Some(&f.map),
        surveyed: Some(&f.map),
        planned: None,
        ground: None,
    });
    input.alignment = Some(Alignment {
        line: vec![Vec2::ZERO, Vec2::X * 9.0],
        reach_m: [2.0, 3.0],
        spacing_m: None,
    });
    input.unfilled = vec![UnfilledWindow {
        centre: Vec2::new(3.0, 1.0),
        half_m: 0.5,
        void_m3: 0.75,
        reason: Text::new(EVIL, EVIL),
    }];
    input.survey_date = EVIL.into();
    input.count = Some(Count { blocks: 2, p10_p90: Some((1, 3)), basis: Text::new(EVIL, EVIL) });
    input.figures = vec![Figure::new(Text::new("Void", "空隙"), EVIL, EVIL)];
    input.outlines = vec![Outline {
        label: EVIL.into(),
        points: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        closed: true,
    }];
    input.maps = vec![MapLayer { label: EVIL.into(), unit: EVIL.into(), values: &f.map }];
    let line = |kind, z: f32| SectionLine {
        kind,
        points: vec![[0.0, z], [1.0, f32::NAN], [2.0, z], [4.0, z + 1.0]],
    };
    input.sections = vec![Section {
        label: EVIL.into(),
        from: Vec2::ZERO,
        to: Vec2::new(4.0, 0.0),
        lines: vec![
            line(SectionLineKind::Design, 3.0),
            line(SectionLineKind::AsIs, 1.0),
            line(SectionLineKind::Planned, 2.0),
        ],
    }];
    input.histograms = vec![Histogram {
        label: EVIL.into(),
        unit: EVIL.into(),
        values: vec![1.0, 2.0, 2.5, f32::NAN],
    }];
    input.assumptions = vec![EVIL.into()];
    input.warnings = vec![Warning { stage: Stage::Pose, message: EVIL.into() }];
    input.provenance = vec![(EVIL.into(), EVIL.into())];
    input
}

/// What stands in the element with this id.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("id=\"{id}\">")).unwrap();
    rest.split_once("</script>").unwrap().0
}

fn json(page: &str) -> serde_json::Value {
    serde_json::from_str(element(page, "view-data")).unwrap()
}

fn blob(page: &str) -> Vec<u8> {
    let packed =
        base64::engine::general_purpose::STANDARD.decode(element(page, "view-blob")).unwrap();
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
    bytes
}

/// A column as the page's script reads it.
fn undelta(bytes: &[u8], span: &serde_json::Value) -> Vec<u16> {
    let at = |i: usize| span[i].as_u64().unwrap() as usize;
    let (start, n) = (at(0), at(1));
    let mut value = 0_u16;
    (0..n)
        .map(|i| {
            let z = u16::from(bytes[start + i]) | u16::from(bytes[start + n + i]) << 8;
            value = value.wrapping_add((z >> 1) ^ (z & 1).wrapping_neg());
            value
        })
        .collect()
}

#[test]
fn the_page_asks_nobody_for_anything() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    for word in
        ["http:", "https:", "//cdn", "@import", "url(", "<link", "import(", "fetch(", " src="]
    {
        let found = page.find(word).map(|i| &page[i..page.len().min(i + 60)]);
        assert!(found.is_none_or(|at| at.starts_with("url(#")), "{word}: {found:?}");
    }
    assert!(page.contains("default-src 'none'"));
    assert!(!page.contains("href=\""));
}

#[test]
fn nothing_a_user_writes_becomes_markup() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    assert!(!page.contains("alert(\"1\")"));
    assert!(!page.contains("<script>alert"));
    // The page's own three script elements, and the braces of the name stay a name.
    assert_eq!((page.matches("<script").count(), page.matches("</script>").count()), (3, 3));
    assert!(page.contains("{{json}}"));
    assert_eq!(json(&page)["models"][1]["name"], EVIL);
}

#[test]
fn every_element_is_closed() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    let body = page.split_once("<main>").unwrap().1.split_once("</main>").unwrap().0;
    let mut open: Vec<&str> = Vec::new();
    for tag in body.split('<').skip(1) {
        let inside = tag.split_once('>').expect("every tag ends").0;
        let name = inside.trim_start_matches('/').split([' ', '/']).next().unwrap();
        match inside {
            _ if inside.starts_with('/') => {
                assert_eq!(open.pop(), Some(name), "{}", &tag[..tag.len().min(60)])
            }
            _ if inside.ends_with('/') || name == "input" => {}
            _ => open.push(name),
        }
    }
    assert_eq!(open, Vec::<&str>::new());
    let ids: Vec<&str> =
        page.split(" id=\"").skip(1).map(|s| s.split('"').next().unwrap()).collect();
    let unique: std::collections::BTreeSet<_> = ids.iter().collect();
    assert_eq!(unique.len(), ids.len());
}

#[test]
fn points_and_blocks_come_back_as_they_went_in() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    let (data, bytes) = (json(&page), blob(&page));
    let p = &data["points"];
    assert_eq!((p["shown"].as_u64(), p["total"].as_u64()), (Some(2400), Some(2400)));
    let columns: Vec<Vec<u16>> = (0..3).map(|a| undelta(&bytes, &p["xyz"][a])).collect();
    let (instance, distance) = (undelta(&bytes, &p["instance"]), undelta(&bytes, &p["distance"]));
    let number = |key: &str, a: usize| p[key][a].as_f64().unwrap() as f32;
    let mut error = 0.0_f32;
    for i in 0..2400 {
        let place =
            Vec3::from_array([0, 1, 2].map(|a| {
                number("min", a) + f32::from(columns[a][i]) / 65535.0 * number("size", a)
            }));
        let (k, off) = f
            .survey
            .cloud
            .position_m
            .iter()
            .map(|q| (*q - place).length())
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap();
        error = error.max(off);
        assert_eq!(usize::from(instance[i]), k / 400 + 1);
        match f.distance[k] {
            d if d.is_nan() => assert_eq!(distance[i], 0),
            d => assert!(
                ((f32::from(distance[i]) - 32768.0) / 32767.0 * 2.0 - d.clamp(-2.0, 2.0)).abs()
                    < 6e-3
            ),
        }
    }
    assert!(error < 2e-4, "{error}");

    let vertices = &data["models"][0]["vertices"];
    let start = vertices[0].as_u64().unwrap() as usize;
    let x = f32::from_le_bytes(bytes[start..start + 4].try_into().unwrap());
    assert_eq!(x, f.catalog.get(ModelId(0)).mesh.vertices[0].x);
    let t = f.recognised[3].fit().unwrap().site_from_block.translation;
    assert_eq!(data["found"][3]["pose"][4].as_f64().unwrap() as f32, t.x);
    assert_eq!(data["added"].as_array().unwrap().len(), 2);
}

#[test]
fn the_tables_hold_site_coordinates() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    // A tetrapod's centre is its origin: 2.5 − 62334.5, 0.3 − 42211.25, 1.0 + 0.5.
    let data = json(&page);
    let pose = |kind: &str, i: usize| -> Vec<f64> {
        let pose = data[kind][i]["pose"].as_array().unwrap();
        pose[4..]
            .iter()
            .zip(0..)
            .map(|(v, k)| v.as_f64().unwrap() + data["origin"][k].as_f64().unwrap())
            .collect()
    };
    let close = |a: Vec<f64>, b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
    assert!(close(pose("found", 1), [-62332.0, -42210.95, 1.5]));
    assert!(close(pose("added", 1), [-62328.5, -42211.25, 3.5]));
    let count = |kind: &str| data[kind].as_array().unwrap().len();
    assert_eq!((count("found"), count("added"), count("removed"), count("windows")), (6, 2, 1, 1));
    assert_eq!(data["removed"][0]["state"], "overflow");
}

#[test]
fn the_head_is_one_sentence_with_its_range_and_no_count_where_nothing_was_recognised() {
    let f = fixture();
    let mut plan = f.plan.clone();
    plan.summary = PlanSummary {
        void_before_m3: 200.0,
        void_after_m3: 90.0,
        mass_kg: 10_300.0,
        protruding: 1,
        ..PlanSummary::default()
    };
    let mut whole = input(&f);
    whole.plan = Some(&plan);
    let head = |input: &ReportInput| {
        let page = html(input).unwrap();
        let h1 = page.split_once("<h1>").unwrap().1.split_once("</h1>").unwrap().0.to_string();
        (h1, page.matches("class=\"light ").count())
    };
    let (sentence, lights) = head(&whole);
    assert!(
        sentence.contains("Order 3 × Tetrapod (this plan 2 = 10 t, range 1–3). Fills 55 % of the void; 1 stands above the design."),
        "{sentence}"
    );
    assert_eq!(lights, 4);
    // Nothing recognised: the plan's number must not be taken for an answer, unless bare ground was asked for.
    whole.recognised = &[];
    let (sentence, _) = head(&whole);
    assert!(sentence.contains("No plan") && !sentence.contains("Order"), "{sentence}");
    whole.bare_ground = true;
    assert!(head(&whole).0.contains("Order 3"));
    // Lights of the caller stand in place of the page's own.
    whole.lights = vec![Light { name: "a".into(), state: LightState::Bad, reason: "b".into() }];
    assert_eq!(head(&whole).1, 1);
}

#[test]
fn lights_go_out_with_the_evidence() {
    let f = fixture();
    let states =
        |input: &ReportInput| lights::lights(input).iter().map(|l| l.state).collect::<Vec<_>>();
    let page = input(&f);
    // Five of six stated at 0.9; a quarter hidden; no void stated; range of 1 to 3 for 2.
    use LightState::{Bad, Fair, Good, Unknown};
    assert_eq!(states(&page), [Fair, Good, Unknown, Bad]);
    let mut hidden = f.recognised.clone();
    for r in &mut hidden {
        if let Verdict::Stated(fit) = &mut r.verdict {
            (fit.occlusion, fit.confidence) = (Some(0.9), Some(0.5));
        }
    }
    let mut strangers = input(&f);
    strangers.recognised = &hidden;
    assert_eq!(states(&strangers)[..2], [Bad, Bad]);
    strangers.recognised = &hidden[5..];
    assert_eq!(states(&strangers)[..2], [Bad, Unknown]);
}

#[test]
fn a_map_comes_back_from_its_columns() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    let (data, bytes) = (json(&page), blob(&page));
    let grid = &data["surfaces"]["design"];
    let number = |key: &str| grid[key].as_f64().unwrap();
    assert_eq!((number("nx"), number("ny")), (f.map.nx as f64, f.map.ny as f64));
    let values = undelta(&bytes, &grid["z"]);
    for (v, z) in values.iter().zip(&f.map.z_m) {
        if *v == 0 {
            assert!(z.is_nan());
        } else {
            let back = number("low") + f64::from(v - 1) * number("step");
            assert!((back - f64::from(*z)).abs() < 1e-3, "{back} {z}");
        }
    }
}

#[test]
fn the_policy_names_the_very_script_and_style() {
    let f = fixture();
    let page = html(&input(&f)).unwrap();
    use sha2::{Digest, Sha256};
    let between =
        |open: &str, close: &str| page.split_once(open).unwrap().1.split_once(close).unwrap().0;
    for (open, close, directive) in [
        ("<script type=\"module\">", "</script>", "script-src"),
        ("<style>", "</style>", "style-src"),
    ] {
        let hash =
            base64::engine::general_purpose::STANDARD.encode(Sha256::digest(between(open, close)));
        assert!(page.contains(&format!("{directive} 'sha256-{hash}'")), "{directive}");
    }
    assert!(
        !page.contains("unsafe-inline")
            && !page.contains(" style=\"")
            && !page.contains(" onclick")
    );
}

#[test]
fn a_large_cloud_is_thinned_and_says_so() {
    let f = fixture();
    let mut few = input(&f);
    few.max_points = 100;
    let data = json(&html(&few).unwrap());
    assert_eq!(
        (data["points"]["shown"].as_u64(), data["points"]["total"].as_u64()),
        (Some(100), Some(2400))
    );
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let f = fixture();
    assert_eq!(html(&input(&f)).unwrap(), html(&input(&f)).unwrap());
}

#[test]
fn a_survey_alone_is_a_report() {
    let survey = Survey::default();
    let catalog = Catalog::default();
    let page = html(&ReportInput::new("empty", &survey, &catalog)).unwrap();
    assert!(page.contains("<b>empty</b>") && page.contains("No plan"));
}

#[test]
fn what_does_not_fit_is_named() {
    let f = fixture();
    let mut point = input(&f);
    point.alignment =
        Some(Alignment { line: vec![Vec2::ZERO], reach_m: [1.0, 1.0], spacing_m: None });
    assert!(html(&point).unwrap_err().to_string().contains("at least two points"));
    let mut short = input(&f);
    short.point_distance_m = &f.distance[1..];
    assert_eq!(
        html(&short).unwrap_err().to_string(),
        "report: `point_distance_m` has 2399 values for 2400 points"
    );
    let mut strange = f.recognised.clone();
    let with = |model, y| {
        let pose = Pose::from_parts(Vec3::new(0.0, y, 0.0), Quat::IDENTITY);
        Verdict::Stated(Fit::of_pose(ModelId(model), pose))
    };
    strange[1].verdict = with(7, 0.0);
    let mut unknown = input(&f);
    unknown.recognised = &strange;
    assert!(html(&unknown).unwrap_err().to_string().contains("block type 7"));
    strange[1].verdict = with(0, f32::NAN);
    let mut nowhere = input(&f);
    nowhere.recognised = &strange;
    assert!(html(&nowhere).unwrap_err().to_string().contains("block 1 has a coordinate"));
}

#[test]
fn a_still_shows_the_nearer_of_two_cubes() {
    let cube = blocks::shape_model("cube", Shape::Cube { size: 1.0 }, 2300.0).unwrap().mesh;
    let at = |z: f32| Pose::from_parts(Vec3::new(0.0, 0.0, z), Quat::IDENTITY);
    let red = StillMesh { mesh: &cube, pose: at(2.0), colour: [255, 0, 0] };
    let blue = StillMesh { mesh: &cube, pose: at(0.0), colour: [0, 0, 255] };
    let bounds = geom::Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };
    let image = still(40, 40, &Camera::plan(&bounds), &[red, blue], &[]);
    let at = |x: usize, y: usize| &image.rgba[(y * 40 + x) * 4..][..4];
    assert!(at(20, 20)[0] > 150 && at(20, 20)[2] == 0 && at(20, 20)[3] == 255);
    assert_eq!(at(2, 2)[3], 0);
    assert_eq!(&image.png().unwrap()[1..4], b"PNG");
}

#[test]
fn a_site_is_a_picture_of_its_blocks() {
    let f = fixture();
    let image = site_picture(&input(&f), 120, 80);
    let drawn = image.rgba.chunks(4).filter(|p| p[3] == 255).count();
    assert!((800..8000).contains(&drawn), "{drawn}");
    let orange = image
        .rgba
        .chunks(4)
        .filter(|p| p[3] == 255 && p[0] > 2 * p[2].max(1) && p[0] > 100)
        .count();
    assert!(orange > 50, "{orange}");
    assert!(image.on([255, 255, 255]).rgba.chunks(4).all(|p| p[3] == 255));
    let empty = ReportInput::new("", &f.survey, &f.catalog);
    assert!(site_picture(&empty, 60, 40).rgba.chunks(4).any(|p| p[3] > 0));
    assert_eq!(pile_picture(&[], &f.catalog, 60, 40).width, 60);
}
