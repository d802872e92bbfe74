//! What must hold of every comparison, whatever the pile.

use crate::pile::{STEP_M, catalog, moved, pile, seen, survey, tetrapods};
use geom::{Pose, Quat, Silent, Vec3};
use monitor::{Change, Class, CompareConfig, Comparison, Epoch, SeenBlock, StableGround, compare};
use proptest::prelude::*;
use scene::{Catalog, ModelId, Shape, SiteFrame, Survey};

fn run(a: &Epoch, b: &Epoch, catalog: &Catalog) -> Comparison {
    compare(a, b, catalog, &StableGround::default(), &CompareConfig::default(), &Silent).unwrap()
}

fn of(found: &Comparison, earlier: u32) -> &Change {
    found.changes.iter().find(|c| c.earlier_id == Some(earlier)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// The same survey twice: nothing happened, and nothing is any distance away.
    #[test]
    fn the_same_survey_twice_is_unchanged(seed in 0_u64..1000) {
        let catalog = tetrapods();
        let poses = pile(&catalog, 25, seed);
        let survey = survey(&catalog, &poses, poses.len(), seed);
        let epoch = Epoch { survey: &survey, blocks: seen(&catalog, &poses, seed) };
        let found = run(&epoch, &epoch, &catalog);
        prop_assert_eq!(found.changes.len(), 25);
        for c in &found.changes {
            prop_assert_eq!(c.class, Class::Unchanged);
            prop_assert!(c.distance_m < 1e-5 && c.turn_rad < 1e-5, "{} {}", c.distance_m, c.turn_rad);
            prop_assert_eq!(c.earlier_id, c.later_id);
        }
    }

    /// Two surveys of a pile that did not change: no block is said to have moved; swapping them mirrors every shift.
    #[test]
    fn swapping_the_epochs_mirrors(seed in 0_u64..1000, step in prop::array::uniform3(-0.05_f32..0.05)) {
        let catalog = tetrapods();
        let poses = pile(&catalog, 30, seed);
        let mut after = poses.clone();
        after[3] = moved(&catalog, &poses[3], Vec3::new(0.3, 0.1, 0.0), Quat::from_rotation_z(0.2));
        after[7] = moved(&catalog, &poses[7], Vec3::NEG_Z * 0.2, Quat::IDENTITY);
        let step = Vec3::from_array(step);
        let later: Vec<Pose> = after.iter().map(|p| Pose::from_parts(p.translation + step, p.rotation)).collect();
        let (s1, s2) = (survey(&catalog, &poses, poses.len(), seed), survey(&catalog, &later, later.len(), seed + 1));
        let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, seed) };
        let b = Epoch { survey: &s2, blocks: seen(&catalog, &later, seed + 1) };
        let (there, back) = (run(&a, &b, &catalog), run(&b, &a, &catalog));
        let shift = there.reference.motion.shift().as_vec3();
        // The survey's step comes out, and none of it is taken for movement: five standard deviations of the mean of 28 pairs
        // of poses that are sure to 6 mm.
        prop_assert!((shift + step).length() < 0.008, "{} {}", shift, step);
        let mut borderline = Vec::new();
        for c in &there.changes {
            let mirror = back.changes.iter().find(|m| m.later_id == c.earlier_id).unwrap();
            for i in 0..3 {
                prop_assert!((c.shift_m[i] + mirror.shift_m[i]).abs() < 1e-3, "{:?} {:?}", c.shift_m, mirror.shift_m);
            }
            prop_assert!((c.turn_rad - mirror.turn_rad).abs() < 1e-4);
            // What sank has risen in the mirror, which is a movement like any other.
            let word = |c: Class| if c == Class::Sunk { Class::Moved } else { c };
            if word(c.class) != word(mirror.class) {
                borderline.push((c.clone(), mirror.class));
            }
        }
        prop_assert!(borderline.len() <= 1, "{:#?}", borderline);
        prop_assert_eq!(of(&there, 4).class, Class::Moved);
        prop_assert_eq!(of(&there, 8).class, Class::Sunk);
        let others = there.changes.iter().filter(|c| ![Some(4), Some(8)].contains(&c.earlier_id));
        let false_alarms = others.filter(|c| c.class != Class::Unchanged).count();
        prop_assert!(false_alarms <= 1, "{}", false_alarms);
    }

    /// The order in which blocks come changes nothing.
    #[test]
    fn the_order_of_the_blocks_does_not_matter(seed in 0_u64..1000) {
        let catalog = catalog(Shape::Dolos { size: 2.0 });
        let poses = pile(&catalog, 20, seed);
        let (s1, s2) = (survey(&catalog, &poses, poses.len(), seed), survey(&catalog, &poses, poses.len(), seed + 1));
        let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, seed) };
        let b = Epoch { survey: &s2, blocks: seen(&catalog, &poses, seed + 1) };
        let mut c = b.clone();
        c.blocks.reverse();
        let (one, other) = (run(&a, &b, &catalog), run(&a, &c, &catalog));
        for change in &one.changes {
            let same = of(&other, change.earlier_id.unwrap());
            prop_assert_eq!(same.later_id, change.later_id);
            prop_assert_eq!(same.class, change.class);
            prop_assert!((same.distance_m - change.distance_m).abs() < 1e-6);
        }
    }
}

/// A block that rolled and lost the end of a leg, whose places on the concrete nobody can tell any more: the face where it broke shows.
#[test]
fn a_rolled_block_shows_its_broken_face() {
    let catalog = tetrapods();
    let model = catalog.get(ModelId(0));
    let poses = pile(&catalog, 36, 91);
    let mut after = poses.clone();
    // The legs that look up most are cut, so that the face is in sight.
    let tip = |pose: &Pose| {
        let all = model.mesh.vertices.iter().map(|v| *v - model.centre);
        let far = all.clone().map(|v| v.length()).fold(0.0, f32::max);
        let height = |v: &Vec3| (pose.rotation * *v).z;
        let tips = all.filter(|v| v.length() > 0.95 * far);
        tips.max_by(|a, b| height(a).total_cmp(&height(b))).unwrap()
    };
    let (rolled, cut) = (14, 0.6);
    after[rolled] = moved(
        &catalog,
        &poses[rolled],
        Vec3::new(0.2, 0.1, -0.1),
        Quat::from_scaled_axis(Vec3::new(0.5, 0.3, 0.4)),
    );
    let (pose, tip) = (after[rolled], tip(&after[rolled]));
    let beyond = |p: Vec3| (p - model.centre).dot(tip.normalize()) - cut * tip.length();
    let (s1, mut s2) = (survey(&catalog, &poses, 36, 91), survey(&catalog, &after, 36, 92));
    let own = |p: &Vec3| {
        let local = pose.inverse_transform_point(*p);
        beyond(local) > 0.0 && (local - model.centre).length() < 1.02 * tip.length()
    };
    let mut points: Vec<Vec3> = s2.cloud.position_m.iter().copied().filter(|p| !own(p)).collect();
    let explained: Vec<u32> = (0..points.len() as u32).collect();
    let solid = geom::MeshQuery::new(&model.mesh).unwrap();
    let (u, w) = tip.normalize().any_orthonormal_pair();
    let middle = model.centre + tip * cut;
    for i in -20..=20 {
        for k in -20..=20 {
            let p = middle + (u * i as f32 + w * k as f32) * 0.03;
            if solid.nearest_signed(p).distance_m < 0.0 {
                points.push(pose.transform_point(p));
            }
        }
    }
    s2.cloud = geom::PointCloud::from_positions(points);
    let with = |mut blocks: Vec<SeenBlock>, points: Vec<u32>| {
        blocks.iter_mut().for_each(|b| b.points = points.clone());
        blocks
    };
    let all = (0..s1.cloud.position_m.len() as u32).collect();
    let a = Epoch { survey: &s1, blocks: with(seen(&catalog, &poses, 91), all) };
    let b = Epoch { survey: &s2, blocks: with(seen(&catalog, &after, 92), explained) };
    let found = run(&a, &b, &catalog);
    for change in &found.changes {
        let is_broken = change.class == Class::PossiblyBroken;
        assert_eq!(is_broken, change.earlier_id == Some(rolled as u32 + 1), "{change:?}");
    }
    assert!(of(&found, rolled as u32 + 1).face_m2 > 0.03);
}

/// A block that fell half a metre moved; one that stands half a metre higher than the one that is gone is another.
#[test]
fn no_block_rises() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 36, 77);
    let mut after = poses.clone();
    let turn = Quat::from_rotation_z(0.4);
    after[9] = moved(&catalog, &poses[9], Vec3::new(0.3, 0.2, -0.5), turn);
    after[21] = moved(&catalog, &poses[21], Vec3::new(0.3, 0.2, 0.5), turn);
    let (s1, s2) = (survey(&catalog, &poses, 36, 77), survey(&catalog, &after, 36, 78));
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 77) };
    let b = Epoch { survey: &s2, blocks: seen(&catalog, &after, 78) };
    let found = run(&a, &b, &catalog);
    assert_eq!(of(&found, 10).class, Class::Moved);
    assert_eq!(of(&found, 10).later_id, Some(10));
    assert_eq!(of(&found, 22).later_id, None, "{:?}", of(&found, 22));
    let fixed = CompareConfig {
        registration: monitor::RegistrationConfig { fixed: true, ..Default::default() },
        ..Default::default()
    };
    let found = compare(&a, &b, &catalog, &StableGround::default(), &fixed, &Silent).unwrap();
    assert_eq!(of(&found, 22).later_id, Some(22), "coordinates left as they are may lie apart");
}

/// Taken away, come, and turned on itself: cubes, tetrapods, dolosse alike.
#[test]
fn blocks_go_and_come_whatever_their_shape() {
    let shapes = [
        Shape::Cube { size: 1.5 },
        Shape::Tetrapod { size: 2.0 },
        Shape::Dolos { size: 2.0 },
        Shape::Antifer { size: 1.5 },
    ];
    for (k, shape) in shapes.into_iter().enumerate() {
        let catalog = catalog(shape);
        let seed = 50 + k as u64;
        let poses = pile(&catalog, 30, seed);
        let mut after = poses.clone();
        after.remove(12);
        let (s1, s2) = (
            survey(&catalog, &poses, poses.len(), seed),
            survey(&catalog, &after, poses.len(), seed + 1),
        );
        let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, seed) };
        let b = Epoch { survey: &s2, blocks: seen(&catalog, &after, seed + 1) };
        let gone = run(&a, &b, &catalog);
        assert_eq!(of(&gone, 13).class, Class::Missing, "{shape:?}: {}", of(&gone, 13).note);
        assert_eq!(gone.count(Class::Missing), 1, "{shape:?}");
        let come = run(&b, &a, &catalog);
        assert_eq!(come.count(Class::New), 1, "{shape:?}");
    }
}

/// Three of five blocks stayed: a step of the datum comes out to 5 mm, whatever the others did, each its own way.
#[test]
fn a_step_of_the_datum_is_recovered_while_most_blocks_stay() {
    let catalog = tetrapods();
    let steps =
        [Vec3::new(0.0, 0.0, 0.05), Vec3::new(0.03, -0.04, 0.0), Vec3::new(-0.03, 0.02, -0.035)];
    for (k, step) in steps.into_iter().enumerate() {
        let seed = 300 + k as u64;
        let poses = pile(&catalog, 60, seed);
        let mut rng = geom::SeedTree::new(seed).child("moves", 0).rng();
        let moved = |(i, pose): (usize, &Pose)| {
            let mut about = |reach: f32| rand::RngExt::random_range(&mut rng, -reach..reach);
            let own = Vec3::new(about(0.4), about(0.4), about(0.2));
            let by = if i % 5 < 2 { own } else { Vec3::ZERO };
            Pose::from_parts(pose.translation + by + step, pose.rotation)
        };
        let later: Vec<Pose> = poses.iter().enumerate().map(moved).collect();
        let s1 = survey(&catalog, &poses, poses.len(), seed);
        let s2 = survey(&catalog, &later, later.len(), seed + 1);
        let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, seed) };
        let b = Epoch { survey: &s2, blocks: seen(&catalog, &later, seed + 1) };
        let found = run(&a, &b, &catalog);
        let left = found.reference.motion.shift().as_vec3() + step;
        assert!(left.length() < 0.005, "{step}: {left} is left");
    }
}

/// A block that only the earlier recognition holds, with a leg of it gone from the later cloud, broke; it did not vanish.
#[test]
fn most_of_a_block_still_standing_is_not_missing() {
    let catalog = tetrapods();
    let model = catalog.get(ModelId(0));
    let poses = pile(&catalog, 30, 71);
    let s1 = survey(&catalog, &poses, poses.len(), 71);
    let mut s2 = survey(&catalog, &poses, poses.len(), 72);
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 71) };
    let mut blocks = seen(&catalog, &poses, 72);
    blocks.remove(12);
    // Everything of it to one side of a plane through its centre is gone; the bed behind shows.
    let centre = poses[12] * model.centre;
    let of_it = |p: &Vec3| (*p - centre).length() < 1.1 && p.z > 0.1;
    let cut = |p: &Vec3| of_it(p) && p.x > centre.x;
    let mut left: Vec<Vec3> = s2.cloud.position_m.iter().copied().filter(|p| !cut(p)).collect();
    left.extend((0..900).map(|i| {
        centre.truncate().extend(0.0)
            + Vec3::new(0.04 * (i % 30) as f32 - 0.2, 0.07 * (i / 30) as f32 - 1.0, 0.0)
    }));
    s2.cloud = geom::PointCloud::from_positions(left);
    let found = run(&a, &Epoch { survey: &s2, blocks }, &catalog);
    let change = of(&found, 13);
    assert_eq!(change.class, Class::PossiblyBroken, "{change:?}");
}

/// A block whose old place is empty while something unrecognised stands beside it may have moved: nobody can call it missing.
#[test]
fn what_stands_beside_unrecognised_makes_missing_doubtful() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 30, 73);
    let mut after = poses.clone();
    after[12] = moved(&catalog, &poses[12], Vec3::new(0.8, 0.4, 0.1), Quat::from_rotation_x(0.9));
    let s1 = survey(&catalog, &poses, poses.len(), 73);
    let s2 = survey(&catalog, &after, after.len(), 74);
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 73) };
    let mut blocks = explaining(&catalog, &after, &s2, 74);
    blocks.remove(12);
    let found = run(&a, &Epoch { survey: &s2, blocks }, &catalog);
    let change = of(&found, 13);
    assert_eq!(change.class, Class::Doubtful, "{change:?}");
    assert!(change.note.contains("may have moved"), "{}", change.note);
}

/// A survey that does not reach a block says nothing of it.
#[test]
fn what_is_not_surveyed_is_hidden_not_missing() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 36, 5);
    let (s1, mut s2) =
        (survey(&catalog, &poses, poses.len(), 5), survey(&catalog, &poses, poses.len(), 6));
    let edge = 4.2 * STEP_M;
    s2.cloud.position_m.retain(|p| p.x < edge);
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 5) };
    let mut blocks = seen(&catalog, &poses, 6);
    blocks.retain(|b| b.site_from_block.translation.x < edge - 1.2);
    let b = Epoch { survey: &s2, blocks };
    let found = run(&a, &b, &catalog);
    assert_eq!(found.count(Class::Missing), 0);
    assert!(found.count(Class::Hidden) >= 6, "{}", found.count(Class::Hidden));
}

/// Site coordinates decide, not the origins that each run chose for its local frame.
#[test]
fn other_local_origins_change_nothing() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 16, 9);
    let s1 = survey(&catalog, &poses, poses.len(), 9);
    let mut s2 = s1.clone();
    let offset = Vec3::new(20.0, -10.0, 5.0);
    s2.cloud.position_m.iter_mut().for_each(|p| *p -= offset);
    s2.frame = SiteFrame { origin: offset.as_dvec3().to_array(), ..SiteFrame::default() };
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 9) };
    let mut blocks = a.blocks.clone();
    blocks.iter_mut().for_each(|b| b.site_from_block.translation -= offset);
    let found = run(&a, &Epoch { survey: &s2, blocks }, &catalog);
    assert!(found.changes.iter().all(|c| c.class == Class::Unchanged && c.distance_m < 1e-4));
}

/// Bad pairs of epochs are named.
#[test]
fn epochs_that_cannot_be_compared_are_refused() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 12, 3);
    let good = survey(&catalog, &poses, poses.len(), 3);
    let blocks = seen(&catalog, &poses, 3);
    let a = Epoch { survey: &good, blocks: blocks.clone() };
    let refused = |survey: &Survey, blocks: Vec<SeenBlock>| {
        let b = Epoch { survey, blocks };
        compare(&a, &b, &catalog, &StableGround::default(), &CompareConfig::default(), &Silent)
            .unwrap_err()
            .to_string()
    };
    let mut far = good.clone();
    far.frame.origin = [500.0, 0.0, 0.0];
    assert!(refused(&far, blocks.clone()).contains("do not overlap"));
    let mut other = good.clone();
    other.frame.crs = "EPSG:6675".into();
    assert!(refused(&other, blocks.clone()).contains("EPSG:6675"));
    assert!(refused(&Survey::default(), Vec::new()).contains("no points"));
    let mut foreign = blocks.clone();
    foreign[2].model = ModelId(7);
    assert!(refused(&good, foreign).contains("block 3 is of model 7"));
    let other_pile = pile(&catalog, 12, 4444);
    let mut elsewhere = seen(&catalog, &other_pile, 8);
    for (i, b) in elsewhere.iter_mut().enumerate() {
        b.site_from_block.translation += Vec3::new(0.37 * i as f32, -0.21 * i as f32, 0.0);
    }
    assert!(refused(&good, elsewhere).contains("blocks agree"));
}

/// A block hidden for one epoch gets its number back; a new one gets a new number.
#[test]
fn a_series_keeps_its_numbers() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 25, 21);
    let surveys: Vec<Survey> = (0..3)
        .map(|k| {
            let mut s = survey(&catalog, &poses, poses.len(), 21 + k);
            if k == 1 {
                // Something covers block 8 in the second epoch.
                let at = poses[7] * catalog.get(ModelId(0)).centre;
                s.cloud.position_m.retain(|p| (*p - at).truncate().length() > 1.1);
                for i in 0..900 {
                    let (x, y) = ((i % 30) as f32 / 15.0 - 1.0, (i / 30) as f32 / 15.0 - 1.0);
                    s.cloud.position_m.push(at + Vec3::new(x, y, 1.6));
                }
            }
            s
        })
        .collect();
    let mut blocks: Vec<Vec<SeenBlock>> = (0..3).map(|k| seen(&catalog, &poses, 21 + k)).collect();
    blocks[1].remove(7);
    let epochs: Vec<Epoch> =
        surveys.iter().zip(blocks).map(|(survey, blocks)| Epoch { survey, blocks }).collect();
    let mut series = monitor::Series::start(&epochs[0], &catalog);
    let (stable, config) = (StableGround::default(), CompareConfig::default());
    let second = series.add(&epochs[0], &epochs[1], &catalog, &stable, &config, &Silent).unwrap();
    assert_eq!(of(&second, 8).class, Class::Hidden, "{}", of(&second, 8).note);
    let before = series.observations().to_vec();
    series.add(&epochs[1], &epochs[2], &catalog, &stable, &config, &Silent).unwrap();
    assert_eq!(series.observations()[..before.len()], before[..]);
    assert_eq!(series.tracks().len(), 25);
    let back = series.observations().iter().find(|o| o.epoch == 2 && o.track == 8).unwrap();
    assert_eq!(back.block, Some(8));
}

/// Blocks that say which points they explain.
pub fn explaining(catalog: &Catalog, poses: &[Pose], survey: &Survey, seed: u64) -> Vec<SeenBlock> {
    let mut blocks = seen(catalog, poses, seed);
    let mesh = &catalog.get(ModelId(0)).mesh;
    let query = geom::MeshQuery::new(mesh).unwrap();
    for (block, pose) in blocks.iter_mut().zip(poses) {
        let back = pose.inverse();
        let on_it = |p: &Vec3| query.signed_distance_m(back * *p).abs() < 0.05;
        let all = survey.cloud.position_m.iter().enumerate();
        block.points = all.filter(|(_, p)| on_it(p)).map(|(i, _)| i as u32).collect();
    }
    blocks
}
