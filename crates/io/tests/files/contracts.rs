//! The tables and the manifest that other people's scripts rely on.

use geom::Pose;
use io::blocks_csv::{self, BlockRow};
use io::manifest::{self, Difference, Manifest};
use io::placements_csv::{self, HandlingRow, PlacementRow};
use io::{Input, SitePose};
use proptest::prelude::*;
use scene::{PatternNode, PlacementState, SiteFrame};
use std::fs;
use std::path::Path;

fn unit(q: [f64; 4]) -> [f64; 4] {
    let n = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    q.map(|v| v / n)
}

fn a_pose() -> impl Strategy<Value = SitePose> {
    let q = [0.01..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0];
    ([-1e6..1e6_f64, -1e6..1e6, -100.0..100.0], q)
        .prop_map(|(position_m, q)| SitePose { position_m, rotation_wxyz: unit(q) })
}

proptest! {
    #[test]
    fn blocks_come_back_to_the_last_digit(
        rows in prop::collection::vec((a_pose(), "[a-zA-Z][a-zA-Z0-9 ,\"_-]{0,10}[a-z]", prop::option::of(0.0..1.0_f64), prop::option::of(0.0..1.0_f64)), 0..20)
    ) {
        let rows: Vec<BlockRow> = rows.into_iter().enumerate().map(|(i, (pose, model, occlusion, fitness_m))| BlockRow {
            block_id: i as u32 + 1, model: model.clone(), pose, occlusion, confidence: occlusion, fitness_m,
            runner_up: fitness_m.map(|_| model), runner_up_fitness_m: fitness_m, type_judged: fitness_m.map(|f| f > 0.5),
            legs: fitness_m.filter(|f| *f > 0.3).map(|f| scene::Legs { seen: (f * 9.0) as u8, hidden: 1, missing: 0 }),
        }).collect();
        let text = blocks_csv::blocks_text(&rows);
        let back = blocks_csv::read_from(&mut Input::of_bytes(Path::new("blocks.csv"), text.as_bytes())).unwrap();
        prop_assert_eq!(&back, &rows);
        let truth = blocks_csv::truth_text(&rows);
        let back = blocks_csv::read_from(&mut Input::of_bytes(Path::new("truth.csv"), truth.as_bytes())).unwrap();
        prop_assert!(back.iter().zip(&rows).all(|(a, b)| a.pose == b.pose && a.occlusion == b.occlusion && a.confidence.is_none()));
    }

    #[test]
    fn placements_come_back(rows in prop::collection::vec((a_pose(), a_pose(), 0..5_usize, -1.0..5.0_f64), 0..20)) {
        let states = [PlacementState::Kept, PlacementState::Overflow, PlacementState::Unsettled, PlacementState::Outside, PlacementState::Unstable];
        let rows: Vec<_> = rows.into_iter().enumerate().map(|(i, (drop, rest, state, filled_m3))| PlacementRow {
            handling: match i % 3 {
                0 => HandlingRow { node: Some(PatternNode { layer: 1, row: -2, column: 13 }), ..Default::default() },
                1 => HandlingRow { reset: Some((7, drop)), path: vec![rest, drop], ..Default::default() },
                _ => HandlingRow::default(),
            },
            order: i as u32 + 1, round: 1, model: "tetrapod-2m".into(), drop, rest, filled_m3, contacts: 3, state: states[state],
        }).collect();
        let text = placements_csv::text(&rows);
        let back = placements_csv::read_from(&mut Input::of_bytes(Path::new("placements.csv"), text.as_bytes())).unwrap();
        prop_assert_eq!(back, rows);
    }
}

#[test]
fn the_header_lines_are_the_contract() {
    assert_eq!(
        blocks_csv::blocks_text(&[]),
        "block_id,model,x_m,y_m,z_m,qw,qx,qy,qz,occlusion,confidence,fitness_m,runner_up,runner_up_fitness_m,type_judged,legs_seen,legs_hidden,legs_missing\n"
    );
    assert_eq!(blocks_csv::truth_text(&[]), "block_id,model,x_m,y_m,z_m,qw,qx,qy,qz,occlusion\n");
    assert_eq!(
        placements_csv::text(&[]),
        "order,round,model,drop_x_m,drop_y_m,drop_z_m,drop_qw,drop_qx,drop_qy,drop_qz,rest_x_m,rest_y_m,rest_z_m,rest_qw,rest_qx,rest_qy,rest_qz,filled_m3,contacts,state\n"
    );
}

fn blocks(text: &str) -> Result<Vec<BlockRow>, String> {
    blocks_csv::read_from(&mut Input::of_bytes(Path::new("b.csv"), text.as_bytes()))
        .map_err(|e| e.to_string())
}

#[test]
fn columns_may_come_in_any_order_and_with_others() {
    let rows = blocks(
        "\u{feff}who, qz,qy,qx,qw,z_m,y_m,x_m,model,block_id\r\nme,0,0,0,1,3.5,-12345.678901234567,-35000.1,cube,7\r\n",
    )
    .unwrap();
    assert_eq!(rows[0].block_id, 7);
    assert_eq!(rows[0].pose.position_m, [-35000.1, -12_345.678_901_234_567, 3.5]);
    assert_eq!(rows[0].occlusion, None);
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let head = "block_id,model,x_m,y_m,z_m,qw,qx,qy,qz\n";
    for (text, parts) in [
        ("block_id,model,x_m\n1,a,2\n".to_string(), vec!["b.csv", "`y_m`"]),
        (
            format!("{head}1,a,0,0,0,1,0,0,0\n2,a,zero,0,0,1,0,0,0\n"),
            vec!["line 3", "`x_m`", "zero"],
        ),
        (format!("{head}1,a,NaN,0,0,1,0,0,0\n"), vec!["line 2", "finite"]),
        (format!("{head}1,a,0,0,0,1,1,0,0\n"), vec!["line 2", "length 1.4142"]),
        (format!("{head}1,a,0,0\n"), vec!["line 2", "`z_m`"]),
        (format!("{head}-1,a,0,0,0,1,0,0,0\n"), vec!["line 2", "`block_id`"]),
        (format!("{head}1,,0,0,0,1,0,0,0\n"), vec!["line 2", "`model`"]),
        (format!("{head}1,a,0,0,0,1,0,0,0\n1,a,0,0,0,1,0,0,0\n"), vec!["appears twice"]),
    ] {
        let error = blocks(&text).unwrap_err();
        assert!(parts.iter().all(|p| error.contains(p)), "{error}");
    }
}

#[test]
fn a_pose_goes_to_site_coordinates_and_back() {
    let frame = SiteFrame { origin: [-35_600.0, -12_300.0, 2.0], ..SiteFrame::default() };
    let rotation = geom::Quat::from_rotation_z(0.3);
    let pose = Pose::from_parts(geom::Vec3::new(12.3456, -7.25, 0.125), rotation);
    let site = SitePose::of(&pose, &frame);
    assert_eq!(site.position_m[1], -12_307.25);
    let back = site.local(&frame);
    assert_eq!(back.translation, pose.translation);
    assert!(back.rotation.angle_between(pose.rotation) < 1e-6);
}

#[test]
fn verify_names_what_changed() {
    let (run, site) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (run, site) = (run.path(), site.path());
    let written = ["a.csv", "sub/b.csv", "c.csv"].map(Path::new);
    for name in ["a.csv", "sub/b.csv", "c.csv"] {
        io::atomic::write_bytes(&run.join(name), name.as_bytes()).unwrap();
    }
    fs::write(site.join("site.toml"), "x").unwrap();
    let mut manifest = Manifest::new("0.1.0", 7, serde_json::json!({"plan": {"rounds": 20}}));
    manifest.add_input(Path::new("site.toml"), &site.join("site.toml")).unwrap();
    manifest.seal(run, written).unwrap();
    let first = fs::read(run.join(manifest::FILE)).unwrap();
    assert_eq!(manifest::verify(run, Some(site)).unwrap(), []);
    assert_eq!(Manifest::load(run).unwrap(), manifest);
    manifest.seal(run, written).unwrap();
    assert_eq!(
        fs::read(run.join(manifest::FILE)).unwrap(),
        first,
        "sealing twice gives the same bytes"
    );

    fs::write(run.join("sub/b.csv"), "other").unwrap();
    fs::remove_file(run.join("c.csv")).unwrap();
    fs::write(run.join("d.csv"), "new").unwrap();
    fs::write(site.join("site.toml"), "y").unwrap();
    let differences = manifest::verify(run, Some(site)).unwrap();
    let expected = [
        Difference::Missing(run.join("c.csv")),
        Difference::Changed(run.join("sub/b.csv")),
        Difference::Changed(site.join("site.toml")),
        Difference::Unlisted(run.join("d.csv")),
    ];
    assert_eq!(differences, expected);
}

/// Files that lay in the folder before the run once became its outputs, with hashes, and names like `.tsumu-x` and empty
/// folders were never told.
#[test]
fn a_manifest_vouches_for_what_the_run_wrote_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path();
    fs::create_dir_all(run.join("exports")).unwrap();
    fs::write(run.join("exports/theirs.tif"), "x").unwrap();
    fs::write(run.join("own.csv"), "x").unwrap();
    let mut manifest = Manifest::new("0.1.0", 7, serde_json::Value::Null);
    manifest.seal(run, [Path::new("own.csv")]).unwrap();
    assert_eq!(manifest.outputs.keys().collect::<Vec<_>>(), ["own.csv"]);
    fs::write(run.join(".tsumu-hidden"), "x").unwrap();
    fs::create_dir(run.join("empty")).unwrap();
    let unlisted = [".tsumu-hidden", "empty", "exports/theirs.tif"]
        .map(|name| Difference::Unlisted(run.join(name)));
    assert_eq!(manifest::verify(run, None).unwrap(), unlisted);
}

#[test]
fn a_manifest_of_another_layout_is_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path();
    Manifest::new("0.1.0", 7, serde_json::Value::Null).seal(run, []).unwrap();
    let path = run.join(manifest::FILE);
    let text = fs::read_to_string(&path).unwrap().replace("\"format\": 2", "\"format\": 99");
    fs::write(&path, text).unwrap();
    let message = manifest::verify(run, None).unwrap_err().to_string();
    assert!(message.contains("99") && message.contains("reads 1"), "{message}");
    Manifest::invalidate(run).unwrap();
    Manifest::invalidate(run).unwrap();
    let message = Manifest::load(run).unwrap_err().to_string();
    assert!(message.contains("not finished"), "{message}");
}

/// A pipe in the place of a survey was once waited for, for ever.
#[cfg(unix)]
#[test]
fn a_pipe_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("survey.laz");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let message = io::Input::open(&pipe).err().unwrap().to_string();
    assert!(message.contains("survey.laz") && message.contains("pipe"), "{message}");
    assert!(manifest::entry(&pipe).is_err());
    assert!(io::read_bytes(&pipe, 10).is_err());
}

#[test]
fn a_manifest_that_names_files_elsewhere_is_refused() {
    let run = tempfile::tempdir().unwrap();
    let mut manifest = Manifest::new("0.1.0", 7, serde_json::Value::Null);
    manifest.seal(run.path(), []).unwrap();
    let text = fs::read_to_string(run.path().join(manifest::FILE)).unwrap();
    // As an earlier version wrote it, without a hash of itself.
    let own = manifest.own_blake3.clone().unwrap();
    let hostile = text
        .replace(&format!("\"own_blake3\": \"{own}\",\n  \"format\": 2"), "\"format\": 1")
        .replace("\"outputs\": {}", "\"outputs\": {\"../x\": {\"bytes\": 0, \"blake3\": \"\"}}");
    assert_ne!(text, hostile);
    fs::write(run.path().join(manifest::FILE), hostile).unwrap();
    assert!(manifest::verify(run.path(), None).unwrap_err().to_string().contains("../x"));
}
