//! Conditions that surveys come in: each recipe key makes what it says.

use geom::{Lattice, SeedTree, Vec3};
use scene::{BlockSpec, Catalog, CatalogSpec, Shape};
use synth::{Recipe, SynthScene, scene};

fn catalog(name: &str, shape: Shape) -> Catalog {
    let spec = BlockSpec {
        name: name.into(),
        shape: Some(shape),
        mesh: None,
        unit: None,
        density_kg_m3: 2300.0,
    };
    blocks::catalog(&CatalogSpec { block: vec![spec] }, &|_| Err("no files in tests".into()))
        .unwrap()
}

const PILE: &str =
    "density_per_m2 = 150\ncount = [10, 12]\n[site]\nkind = \"pen\"\nside_blocks = 3.2\n";
const QUIET: &str = "[sensor]\nkind = \"gaussian\"\nnoise_sd_m = 0.0\n";

fn make(head: &str, tables: &str) -> SynthScene {
    let recipe = Recipe::parse(&format!("name = \"t\"\n{head}{tables}")).unwrap();
    let tetrapods = catalog("tetrapod", Shape::Tetrapod { size: 2.0 });
    scene(&recipe, &tetrapods, SeedTree::new(5)).unwrap()
}

fn pile(tables: &str) -> SynthScene {
    make(PILE, &format!("{tables}{QUIET}"))
}

fn of_blocks(made: &SynthScene) -> impl Iterator<Item = Vec3> {
    let points = made.survey.cloud.position_m.iter().zip(&made.instance);
    points.filter(|p| *p.1 > 0).map(|p| *p.0)
}

#[test]
fn sand_hides_what_lies_under_it() {
    let bare = pile("[bed]\nstone_blocks = 0.0\n");
    let sanded = pile("[bed]\nstone_blocks = 0.0\n[around]\nsand_blocks = 0.3\n");
    assert_eq!(bare.scene.blocks, sanded.scene.blocks, "sand comes after the drop");
    // The sand lies over the plane of the bed, its ripples a hundredth of a block. Outlines are wrong by a cell at most.
    let level = 0.3 * 2.45;
    let under = |made: &SynthScene| of_blocks(made).filter(|p| p.z < level - 0.06).count();
    let (before, after) = (under(&bare), under(&sanded));
    assert!(before > 50 && after * 5 < before, "{before} {after}");
    assert!(sanded.occlusion.iter().zip(&bare.occlusion).all(|(s, b)| *s > b - 0.03));
}

#[test]
fn a_wedge_of_sand_buries_the_toe_alone() {
    let slope = "[bed]\nstone_blocks = 0.0\nslope_m = 1.5\nfalls_towards_deg = 90.0\n";
    let bare = pile(slope);
    let wedge = pile(&format!("{slope}[around]\nsand_blocks = 0.6\nsand_wedge = true\n"));
    // What the toe's blocks lose, those above the wedge keep.
    let lost = |low: bool| {
        let seen = |made: &SynthScene| -> f32 {
            let blocks = made.scene.blocks.iter().zip(&made.occlusion);
            blocks
                .filter(|(b, _)| (b.site_from_block.translation.y > 2.0) == low)
                .map(|(_, occlusion)| 1.0 - occlusion)
                .sum()
        };
        1.0 - seen(&wedge) / seen(&bare)
    };
    assert!(lost(true) > 0.02 && lost(false) < 0.5 * lost(true), "{} {}", lost(true), lost(false));
}

#[test]
fn a_slope_ends_at_its_toe() {
    let toe = pile(
        "[bed]\nstone_blocks = 0.0\nslope_m = 2.0\nfalls_towards_deg = 0.0\ntoe_blocks = 0.5\n",
    );
    let at = |x: f32| toe.scene.ground.height_m(x, 0.0);
    let toe_m = 0.5 * 2.454;
    assert!((at(3.0) - at(2.0)).abs() < 0.02, "level beyond the toe");
    assert!((at(-2.0) - at(-1.0) - 0.5).abs() < 0.02 && (at(3.0) + toe_m / 2.0).abs() < 0.08);
}

#[test]
fn a_wall_and_a_deck_stand_where_they_should() {
    let made = pile("[bed]\nstone_blocks = 0.0\n[around]\nwall_blocks = 1.5\ndeck_blocks = 1.0\n");
    let none = made.survey.cloud.position_m.iter().zip(&made.instance).filter(|p| *p.1 == 0);
    let half = 0.5 * 3.2 * 2.454;
    let (mut wall, mut deck) = (0, 0);
    let top = of_blocks(&made).map(|p| p.z).fold(0.0, f32::max);
    for (p, _) in none {
        wall += usize::from(p.y < -half && p.z > 1.0);
        deck += usize::from(p.z > top + 0.5);
    }
    assert!(wall > 30 && deck > 100, "{wall} {deck}");
}

#[test]
fn rows_keep_their_joints() {
    let recipe = "name = \"t\"\ndensity_per_m2 = 150\ncount = [12, 12]\nsite = { kind = \"pen\", side_blocks = 5.0 }\n\
        [bed]\nstone_blocks = 0.0\n[drop]\nrows_joint_m = 0.06\n";
    let recipe = Recipe::parse(&format!("{recipe}{QUIET}")).unwrap();
    let cubes = catalog("cube", Shape::Cube { size: 1.6 });
    let made = scene(&recipe, &cubes, SeedTree::new(2)).unwrap();
    assert_eq!(made.scene.blocks.len(), 12);
    for (i, a) in made.scene.blocks.iter().enumerate() {
        let nearest =
            made.scene.blocks.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, b)| {
                (b.site_from_block.translation - a.site_from_block.translation).length()
            });
        let gap = nearest.fold(f32::INFINITY, f32::min) - 1.6;
        assert!((0.03..0.09).contains(&gap), "{gap}");
    }
}

#[test]
fn a_grid_is_a_grid_and_keeps_its_labels() {
    for rule in ["mean", "highest"] {
        let made = pile(&format!("[delivery]\ncell_m = 0.2\nrule = \"{rule}\"\n"));
        let lattice = Lattice::of(&made.survey.cloud.position_m).unwrap();
        assert!((lattice.cell_m - 0.2).abs() < 1e-3);
        assert_eq!(made.instance.len(), made.survey.cloud.len());
        assert!(of_blocks(&made).count() > 200);
    }
}

#[test]
fn uneven_holes_crops_and_copies() {
    let whole = pile("");
    let half = 0.5 * 3.2 * 2.454;
    let share = |made: &SynthScene, east: bool| {
        made.survey.cloud.position_m.iter().filter(|p| (p.x > 0.0) == east).count() as f32
    };
    let uneven = pile("[delivery]\nuneven = 10.0\n");
    let ratio = share(&uneven, false) / share(&uneven, true);
    assert!(ratio > 2.0 * share(&whole, false) / share(&whole, true), "{ratio}");
    let cropped = pile("[delivery]\ncrop = 0.6\n");
    assert!(cropped.survey.cloud.position_m.iter().all(|p| p.x.abs() <= 0.61 * half));
    assert!(cropped.occlusion.iter().zip(&whole.occlusion).any(|(c, w)| *c > w + 0.3));
    let holed = pile("[delivery]\nholes = 6\n");
    assert!(holed.survey.cloud.len() < whole.survey.cloud.len());
    let doubled = pile("[delivery]\nduplicates = 0.5\n");
    let more = doubled.survey.cloud.len() as f32 / whole.survey.cloud.len() as f32;
    assert!((1.4..1.6).contains(&more), "{more}");
}

#[test]
fn a_scanner_sees_one_side_and_near_parts_densely() {
    let made = make(PILE, "[sensor]\nkind = \"scanner\"\n");
    let half = 0.5 * 3.2 * 2.454;
    assert!((made.survey.sensor_positions[0] - Vec3::new(0.0, -half - 4.0, 6.0)).length() < 1e-3);
    let near = made.survey.cloud.position_m.iter().filter(|p| p.y < 0.0).count();
    assert!(near as f32 > 0.6 * made.survey.cloud.len() as f32);
    let flown = pile("");
    let mean = |made: &SynthScene| made.occlusion.iter().sum::<f32>() / made.occlusion.len() as f32;
    assert!(mean(&made) > mean(&flown));
    let quiet = make(PILE, "[sensor]\nkind = \"scanner\"\ntold = false\n");
    assert!(quiet.survey.sensor_positions.is_empty());
}

#[test]
fn keys_out_of_range_are_named() {
    for (tables, key) in [
        ("[around]\nsand_blocks = -1.0\n", "around.sand_blocks"),
        ("[delivery]\ncrop = 0.0\n", "delivery.crop"),
        ("[delivery]\nuneven = 0.5\n", "delivery.uneven"),
        ("[drop]\nrows_joint_m = -0.1\n", "drop.rows_joint_m"),
        ("[bed]\ntoe_blocks = 1e9\n", "bed.toe_blocks"),
    ] {
        let recipe = Recipe::parse(&format!("name = \"t\"\n{PILE}{tables}{QUIET}")).unwrap();
        let said = recipe.check().unwrap_err().to_string();
        assert!(said.contains(key), "{said}");
    }
}
