//! What must hold of a second epoch: every block accounted for once, what nothing was done to stays to the last bit.

use geom::{Pose, Quat, SeedTree, Vec3};
use scene::{BlockSpec, Catalog, CatalogSpec, ModelId, Placement, PlacementState, Plan, Shape};
use synth::then::{Datum, NextEpoch, Sinking, Storm, Then, What, Works, then};
use synth::{Recipe, SynthScene};

fn tetrapods() -> Catalog {
    let block = vec![BlockSpec {
        name: "tetrapod".into(),
        shape: Some(Shape::Tetrapod { size: 2.0 }),
        mesh: None,
        unit: None,
        density_kg_m3: 2300.0,
    }];
    blocks::catalog(&CatalogSpec { block }, &|_| Err("no files in tests".into())).unwrap()
}

fn recipe() -> Recipe {
    Recipe::parse(
        "name = \"test\"\ndensity_per_m2 = 150\ncount = [16, 16]\nsite = { kind = \"pen\", side_blocks = 3.4 }\n\
         bed = { stone_blocks = 0.0 }\n[sensor]\nkind = \"gaussian\"\n",
    )
    .unwrap()
}

fn before() -> SynthScene {
    synth::scene(&recipe(), &tetrapods(), SeedTree::new(4)).unwrap()
}

fn next(scene: &SynthScene, happens: &Then, plan: Option<&Plan>) -> NextEpoch {
    then(&recipe(), &tetrapods(), &scene.scene, happens, plan, SeedTree::new(9)).unwrap()
}

#[test]
fn every_block_is_accounted_for_once() {
    let before = before();
    let storm = Storm { missing: 0.13, broken: 0.13, rolled: 0.13, added: 0.1, ..Storm::default() };
    let after = next(&before, &Then::Storm(storm), None);
    let count = |what: What| after.changes.iter().filter(|c| c.what == what).count();
    assert_eq!(
        [count(What::Missing), count(What::Broken), count(What::Rolled), count(What::Added)],
        [2; 4]
    );
    let mut earlier: Vec<u32> =
        after.changes.iter().filter_map(|c| c.earlier.map(|b| b.0)).collect();
    earlier.sort_unstable();
    assert_eq!(earlier, (1..=16).collect::<Vec<_>>());
    let mut later: Vec<u32> = after.changes.iter().filter_map(|c| c.later.map(|b| b.0)).collect();
    later.sort_unstable();
    assert_eq!(later, (1..=16).collect::<Vec<_>>());
    assert!(after.scene.scene.blocks.iter().all(|b| b.model == ModelId(0)));
    // The same seed gives the same epoch.
    let again = next(
        &before,
        &Then::Storm(Storm {
            missing: 0.13,
            broken: 0.13,
            rolled: 0.13,
            added: 0.1,
            ..Storm::default()
        }),
        None,
    );
    assert_eq!(again.changes, after.changes);
    assert_eq!(again.scene.survey.cloud, after.scene.survey.cloud);
}

#[test]
fn where_nothing_happens_nothing_changes_but_the_survey() {
    let before = before();
    let calm = Storm {
        kicked: 0.0,
        turned: 0.0,
        missing: 0.0,
        broken: 0.0,
        rolled: 0.0,
        added: 0.0,
        datum: Datum { shift_m: [0.0, 0.0, 5.0], ..Datum::default() },
        ..Storm::default()
    };
    let after = next(&before, &Then::Storm(calm), None);
    assert_eq!(after.scene.scene.blocks, before.scene.blocks);
    assert!(after.changes.iter().all(|c| c.shift_m == Vec3::ZERO && c.turn_rad < 1e-6));
    assert_ne!(after.scene.survey.cloud, before.survey.cloud);
    let lift = after.scene.survey.cloud.bounds().min.z - before.survey.cloud.bounds().min.z;
    assert!((lift - 5.0).abs() < 0.2, "{lift}");
}

#[test]
fn a_hollow_takes_its_blocks_down() {
    let before = before();
    let sinking = Sinking { middle_m: [0.0, 0.0], radius_m: 50.0, depth_m: 0.2, flat: 0.9 };
    let calm = Storm {
        kicked: 0.0,
        turned: 0.0,
        missing: 0.0,
        broken: 0.0,
        rolled: 0.0,
        added: 0.0,
        sinking: Some(sinking),
        ..Storm::default()
    };
    let after = next(&before, &Then::Storm(calm), None);
    let mut down: Vec<f32> = after.changes.iter().map(|c| c.shift_m.z).collect();
    down.sort_by(f32::total_cmp);
    assert!((down[8] + 0.2).abs() < 0.02, "{down:?}");
    assert!(after.changes.iter().all(|c| c.what == What::Sunk));
}

#[test]
fn works_place_the_plan_about_where_it_says() {
    let before = before();
    let catalog = tetrapods();
    let top = before.survey.cloud.bounds().max.z;
    let placement = |order: u32, x: f32| {
        let pose = Pose::from_parts(Vec3::new(x, 0.0, top + 1.5), Quat::IDENTITY);
        Placement {
            order,
            round: 1,
            model: ModelId(0),
            drop: pose,
            rest: pose,
            filled_m3: 1.0,
            contacts: 3,
            state: PlacementState::Kept,
            handling: scene::Handling::default(),
        }
    };
    let plan = Plan { placements: vec![placement(1, -1.5), placement(2, 1.5)], ..Plan::default() };
    let works = Works { skipped: 0.0, extra: 0.0, ..Works::default() };
    let after = next(&before, &Then::Works(works), Some(&plan));
    assert_eq!(after.scene.scene.blocks.len(), 18);
    let placed: Vec<_> = after.changes.iter().filter(|c| c.what == What::Placed).collect();
    assert_eq!(placed.iter().filter_map(|c| c.planned).collect::<Vec<_>>(), [1, 2]);
    // It fell onto the pile from the height of the plan.
    assert!(placed.iter().all(|c| c.shift_m.z < 0.5), "{:?}", placed[0].shift_m);
    let none = Works { skipped: 1.0, extra: 0.0, ..Works::default() };
    let idle = next(&before, &Then::Works(none), Some(&plan));
    assert_eq!(idle.changes.iter().filter(|c| c.what == What::Skipped).count(), 2);
    let all = Works::default();
    let refused =
        then(&recipe(), &catalog, &before.scene, &Then::Works(all), None, SeedTree::new(1));
    assert!(refused.unwrap_err().to_string().contains("none was given"));
}

#[test]
fn what_happens_is_read_and_checked() {
    let storm =
        Then::parse("kind = \"storm\"\nkicked = 0.1\n[datum]\nshift_m = [0.0, 0.0, 0.05]\n")
            .unwrap();
    let Then::Storm(storm) = storm else { panic!("a storm") };
    assert_eq!((storm.kicked, storm.datum.shift_m[2]), (0.1, 0.05));
    let wrong = |text: &str| Then::parse(text).and_then(|t| t.check()).unwrap_err().to_string();
    assert!(wrong("kind = \"storm\"\nkikced = 0.1\n").contains("kikced"));
    assert!(wrong("kind = \"storm\"\nkicked = 0.9\nmissing = 0.5\n").contains("add up to 1"));
    assert!(wrong("kind = \"works\"\nskipped = 1.5\n").contains("skipped = 1.5"));
    assert!(wrong("kind = \"flood\"\n").contains("flood"));
}
