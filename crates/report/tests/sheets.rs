//! The sheets: what a printer gets.

use flate2::read::ZlibDecoder;
use geom::{Pose, Vec2, Vec3};
use report::*;
use scene::*;
use std::io::Read;

const EVIL: &str = "積む) Tj \\ (\u{7}<&\n工事";

struct Site {
    survey: Survey,
    catalog: Catalog,
    recognised: Vec<Recognised>,
    plan: Plan,
}

/// A row of cubes, one a metre and a half, every other one to be placed.
fn site(blocks: u32) -> Site {
    let model = blocks::shape_model(EVIL, Shape::Cube { size: 1.0 }, 2300.0).unwrap();
    let pose = |k: u32| Pose::from_translation(Vec3::new(k as f32 * 1.5, 0.0, 0.5));
    let placed = |k: u32| Placement {
        order: k / 2 + 1,
        round: 1,
        model: ModelId(0),
        drop: pose(k),
        rest: pose(k),
        filled_m3: 1.0,
        contacts: 1,
        state: PlacementState::Kept,
        handling: scene::Handling::default(),
    };
    let found =
        |k| Recognised::of_fit(InstanceId(k + 1), vec![], Fit::of_pose(ModelId(0), pose(k)));
    let frame = SiteFrame {
        origin: [1000.0, 2000.0, 0.0],
        crs: "EPSG:6679".into(),
        vertical_datum: "T.P.".into(),
    };
    Site {
        survey: Survey { frame, ..Survey::default() },
        catalog: Catalog::new(vec![model]),
        recognised: (0..blocks).filter(|k| k % 2 == 0).map(found).collect(),
        plan: Plan {
            placements: (0..blocks).filter(|k| k % 2 == 1).map(placed).collect(),
            ..Plan::default()
        },
    }
}

fn input(site: &Site) -> ReportInput<'_> {
    let mut input = ReportInput::new(EVIL, &site.survey, &site.catalog);
    input.recognised = &site.recognised;
    input.plan = Some(&site.plan);
    input.survey_date = "2026-11-30".into();
    let line = |kind, z: f32| SectionLine {
        kind,
        points: vec![[-5.0, z], [0.0, f32::NAN], [1.0, z], [5.0, z + 2.0]],
    };
    let section = |k: u8| Section {
        label: Text::new(format!("No.{k}"), ""),
        from: Vec2::ZERO,
        to: Vec2::Y,
        lines: vec![line(SectionLineKind::Design, 3.0), line(SectionLineKind::AsIs, 1.0)],
    };
    input.sections = (0..8).map(section).collect();
    input
}

/// The drawing instructions of each page.
fn pages(pdf: &[u8]) -> Vec<String> {
    let find = |from: usize, what: &[u8]| {
        pdf[from..].windows(what.len()).position(|w| w == what).map(|i| from + i)
    };
    let (mut at, mut pages) = (0, Vec::new());
    while let Some(start) = find(at, b"stream\n") {
        let end = find(start, b"\nendstream").unwrap();
        let mut text = Vec::new();
        ZlibDecoder::new(&pdf[start + 7..end]).read_to_end(&mut text).unwrap();
        pages.push(text.iter().map(|b| char::from(*b)).collect());
        at = end + 10;
    }
    pages
}

#[test]
fn every_sheet_has_its_title_block_and_counts_itself() {
    let site = site(20);
    let pdf = sheets(&input(&site), &SheetSet::default()).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.") && pdf.ends_with(b"%%EOF"));
    let pages = pages(&pdf);
    // Summary, one stretch of 28 m, eight sections on two, schedule, annex.
    assert_eq!(pages.len(), 6);
    for (i, page) in pages.iter().enumerate() {
        assert!(page.contains(&format!("({} / 6) Tj", i + 1)), "sheet {}", i + 1);
        assert!(page.contains("(2026-11-30) Tj") && page.contains("Approved"));
    }
    assert!(pages[1].contains("(1:") && pages[1].contains("(N) Tj") && pages[1].contains(" m) Tj"));
    // Order numbers of the plan on its sheet and in the schedule.
    assert!(pages[1].contains("(10) Tj") && pages[4].contains("(10) Tj"));
    // Placed at 1000 + 1.5 east, 2000 north.
    assert!(pages[4].contains("(2,000.000) Tj") && pages[4].contains("(1,001.500) Tj"));
}

#[test]
fn long_works_take_more_sheets_and_short_ones_none_too_many() {
    let count = |blocks| pages(&sheets(&input(&site(blocks)), &SheetSet::default()).unwrap()).len();
    assert!(count(400) > count(20), "{} {}", count(400), count(20));
    assert!(count(62) <= 12);
    let survey = Survey::default();
    let empty = sheets(&ReportInput::new("", &survey, &Catalog::default()), &SheetSet::default());
    assert_eq!(pages(&empty.unwrap()).len(), 2);
}

#[test]
fn what_a_user_writes_stays_text() {
    let site = site(4);
    let pdf =
        sheets(&input(&site), &SheetSet { author: EVIL.into(), ..SheetSet::default() }).unwrap();
    for page in pages(&pdf) {
        // Brackets and backslashes of the name are escaped; control characters are gone.
        assert!(page.contains(r"(\) Tj \\ \(<&) Tj"), "{page}");
        assert!(!page.contains('\u{7}'));
    }
}

#[test]
fn the_same_input_gives_the_same_sheets_and_a_file_that_is_no_font_the_standard_ones() {
    let site = site(8);
    let set = SheetSet::default();
    let first = sheets(&input(&site), &set).unwrap();
    assert_eq!(first, sheets(&input(&site), &set).unwrap());
    let broken = SheetSet { font: Some(SheetFont { data: vec![0; 200], index: 3 }), ..set };
    assert_eq!(first, sheets(&input(&site), &broken).unwrap());
}
