//! Plans against what was built, and the roll-up along the structure.

use crate::pile::{moved, pile, seen, survey, tetrapods};
use geom::{Pose, Quat, Silent, Vec3};
use monitor::{AsBuiltConfig, Built, Class, CompareConfig, Epoch, SpanConfig, StableGround};
use scene::{DesignSurface, ModelId, Placement, PlacementState, Plan};

fn placement(order: u32, rest: Pose) -> Placement {
    Placement {
        order,
        round: 1,
        model: ModelId(0),
        drop: rest,
        rest,
        filled_m3: 1.0,
        contacts: 3,
        state: PlacementState::Kept,
        handling: scene::Handling::default(),
    }
}

/// Placed, off by a known step, skipped and extra blocks are told apart, and the step comes out.
#[test]
fn works_are_told_block_by_block() {
    let catalog = tetrapods();
    let all = pile(&catalog, 36, 31);
    let (old, planned) = all.split_at(24);
    let (planned, extra) = planned.split_at(10);
    let plan = Plan {
        placements: planned.iter().zip(1..).map(|(p, k)| placement(k, *p)).collect(),
        ..Plan::default()
    };
    let step = Vec3::new(0.3, -0.2, -0.05);
    let mut after = old.to_vec();
    for (i, pose) in planned.iter().enumerate() {
        match i {
            2 => after.push(moved(&catalog, pose, step, Quat::from_rotation_z(0.1))),
            5 => {}
            _ => after.push(*pose),
        }
    }
    after.push(extra[1]);
    let (s1, s2) = (survey(&catalog, old, 36, 31), survey(&catalog, &after, 36, 32));
    let a = Epoch { survey: &s1, blocks: seen(&catalog, old, 31) };
    let b = Epoch { survey: &s2, blocks: seen(&catalog, &after, 32) };
    let (stable, config) = (StableGround::default(), AsBuiltConfig::default());
    let found = monitor::as_built(&a, &plan, &b, &catalog, &stable, &config, &Silent).unwrap();
    for block in &found.blocks {
        let expected = match block.order {
            Some(3) => Built::OffBy,
            Some(6) => Built::NotPlaced,
            Some(_) => Built::Placed,
            None => Built::Extra,
        };
        assert_eq!(block.state, expected, "{:?} {}", block.order, block.note);
    }
    assert_eq!(found.count(Built::Extra), 1);
    assert_eq!(found.built(), 10);
    let off = Vec3::from_array(found.blocks[2].off_m.map(|v| v as f32));
    assert!((off - step).length() < 0.03, "{off}");
    let volume = catalog.get(ModelId(0)).volume_m3;
    assert!((found.concrete_m3 - 10.0 * f64::from(volume)).abs() < 1e-3);
    let (measured, of_poses) = (found.porosity_measured.unwrap(), found.porosity_of_poses.unwrap());
    assert!((measured - of_poses).abs() < 0.1, "{measured} {of_poses}");
}

/// Spans count their blocks once each, and a hollow in one of them shows there.
#[test]
fn a_hollow_shows_in_its_span() {
    let catalog = tetrapods();
    let poses = pile(&catalog, 64, 41);
    let sinks =
        |p: &Pose| (6.0..12.0).contains(&p.transform_point(catalog.get(ModelId(0)).centre).x);
    let after: Vec<Pose> = poses
        .iter()
        .map(|p| {
            let down = if sinks(p) { Vec3::NEG_Z * 0.3 } else { Vec3::ZERO };
            Pose::from_parts(p.translation + down, p.rotation)
        })
        .collect();
    let (s1, s2) = (survey(&catalog, &poses, 64, 41), survey(&catalog, &after, 64, 42));
    let a = Epoch { survey: &s1, blocks: seen(&catalog, &poses, 41) };
    let b = Epoch { survey: &s2, blocks: seen(&catalog, &after, 42) };
    let stable = StableGround::default();
    let found =
        monitor::compare(&a, &b, &catalog, &stable, &CompareConfig::default(), &Silent).unwrap();
    let config = SpanConfig {
        span_m: 6.0,
        alignment: vec![[0.0, 8.0], [18.0, 8.0]],
        ..SpanConfig::default()
    };
    let design = DesignSurface::Level {
        level_m: 2.0,
        boundary: vec![[-1.0, -1.0], [18.0, -1.0], [18.0, 18.0], [-1.0, 18.0]],
    };
    let spans =
        monitor::spans(&found, &s1.cloud.position_m, &s1.frame, &catalog, Some(&design), &config);
    let blocks: usize = spans.iter().flat_map(|s| s.counts).sum();
    assert_eq!(blocks, 64);
    let sunk =
        |s: &monitor::Span| s.counts[Class::ALL.iter().position(|c| *c == Class::Sunk).unwrap()];
    let hollow = spans.iter().find(|s| s.chainage_m[0] == 6.0).unwrap();
    let others: usize = spans.iter().map(sunk).sum::<usize>() - sunk(hollow);
    assert!(sunk(hollow) >= 20 && others <= 1, "{} {others}", sunk(hollow));
    assert!((hollow.height_change_m.unwrap() + 0.3).abs() < 0.02);
    assert!(hollow.lost_m3 > 10.0 && hollow.grade < monitor::Grade::C, "{hollow:?}");
    let [before, now] = hollow.below_design_m2.unwrap();
    assert!(now > before + 1.0, "{before} {now}");
}
