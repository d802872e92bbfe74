//! Blocks keep their numbers through epochs that do not show all of them.

use crate::pile::{STEP_M, moved, pile, seen, survey, tetrapods};
use geom::{Pose, Quat, Silent, Vec3};
use monitor::{Class, CompareConfig, Epoch, SeenBlock, Series, StableGround};
use scene::{ModelId, Survey};

/// The second of three surveys leaves a third of the site out: blocks there are hidden, go on with their numbers in the third, one
/// that moved meanwhile is found to have, and no row of an earlier epoch changes.
#[test]
fn a_part_that_one_epoch_did_not_survey_goes_on_with_its_numbers() {
    let catalog = tetrapods();
    let centre = catalog.get(ModelId(0)).centre;
    let poses = pile(&catalog, 36, 81);
    let edge = 3.5 * STEP_M;
    let beyond = |p: &Pose| (*p * centre).x > edge + 0.4;
    let mut last = poses.clone();
    let mover = poses.iter().position(|p| (*p * centre).x > edge + 1.5).unwrap();
    last[mover] = moved(&catalog, &poses[mover], Vec3::new(0.0, 0.3, -0.1), Quat::IDENTITY);

    let mut surveys: Vec<Survey> = [&poses, &poses, &last]
        .iter()
        .zip(81..)
        .map(|(poses, seed)| survey(&catalog, poses, poses.len(), seed))
        .collect();
    surveys[1].cloud.position_m.retain(|p| p.x < edge);
    let mut blocks: Vec<Vec<SeenBlock>> = [&poses, &poses, &last]
        .iter()
        .zip(81..)
        .map(|(poses, seed)| seen(&catalog, poses, seed))
        .collect();
    blocks[1].retain(|b| !beyond(&b.site_from_block));
    let epochs: Vec<Epoch> =
        surveys.iter().zip(blocks).map(|(survey, blocks)| Epoch { survey, blocks }).collect();

    let (stable, config) = (StableGround::default(), CompareConfig::default());
    let mut series = Series::start(&epochs[0], &catalog);
    series.add(&epochs[0], &epochs[1], &catalog, &stable, &config, &Silent).unwrap();
    let before = series.observations().to_vec();
    series.add(&epochs[1], &epochs[2], &catalog, &stable, &config, &Silent).unwrap();
    assert_eq!(series.observations()[..before.len()], before[..], "an earlier row changed");
    assert_eq!(series.tracks().len(), 36, "a block got a second number");
    for (i, pose) in poses.iter().enumerate() {
        let track = i as u32 + 1;
        let row = |epoch: usize| {
            let all = series.observations();
            all.iter().find(|o| o.epoch == epoch && o.track == track).unwrap()
        };
        let (second, third) = (row(1), row(2));
        assert_eq!(third.block, Some(track), "{third:?}");
        if beyond(pose) {
            assert_eq!((second.class, second.block), (Some(Class::Hidden), None), "{second:?}");
        }
        if i == mover {
            assert_eq!(third.class, Some(Class::Moved), "{third:?}");
        } else {
            assert_eq!(third.class, Some(Class::Unchanged), "{third:?}");
        }
    }
}
