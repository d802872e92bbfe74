//! Many blocks that moved alike are told from those that stood still.

use crate::laws::explaining;
use crate::pile::{pile, seen, survey, tetrapods};
use geom::{Pose, Quat, Silent, Vec3};
use monitor::{Class, CompareConfig, Comparison, Decided, Epoch, SeenBlock, StableGround, compare};
use scene::{SensorKind, Survey};

/// A pile and the same one later: `share` of its blocks, by place or one side of it, went `by`; the survey is off by `datum`.
struct Case {
    before: Vec<Pose>,
    after: Vec<Pose>,
    went: Vec<bool>,
    datum: Pose,
}

impl Case {
    fn new(count: usize, seed: u64, went: impl Fn(usize) -> bool, by: Vec3, datum: Pose) -> Self {
        let before = pile(&tetrapods(), count, seed);
        let went: Vec<bool> = (0..count).map(went).collect();
        let moved = |(p, went): (&Pose, &bool)| {
            let by = if *went { by } else { Vec3::ZERO };
            datum * Pose::from_parts(p.translation + by, p.rotation)
        };
        let after = before.iter().zip(&went).map(moved).collect();
        Self { before, after, went, datum }
    }

    fn surveys(&self, seed: u64) -> [Survey; 2] {
        let catalog = tetrapods();
        let off = self.after.iter().map(|p| self.datum.inverse() * *p).collect::<Vec<_>>();
        let mut later = survey(&catalog, &off, off.len(), seed + 1);
        later.cloud.position_m.iter_mut().for_each(|p| *p = self.datum * *p);
        [survey(&catalog, &self.before, self.before.len(), seed), later]
    }

    fn blocks(&self, seed: u64) -> [Vec<SeenBlock>; 2] {
        let catalog = tetrapods();
        [seen(&catalog, &self.before, seed), seen(&catalog, &self.after, seed + 1)]
    }

    fn compared(&self, surveys: &[Survey; 2], blocks: [Vec<SeenBlock>; 2]) -> Comparison {
        let [earlier, later] = blocks;
        let a = Epoch { survey: &surveys[0], blocks: earlier };
        let b = Epoch { survey: &surveys[1], blocks: later };
        let (stable, config) = (StableGround::default(), CompareConfig::default());
        compare(&a, &b, &tetrapods(), &stable, &config, &Silent).unwrap()
    }

    /// How far the registration leaves the blocks that stood still off, on average, metres.
    fn left_m(&self, found: &Comparison) -> f32 {
        let motion = &found.reference.motion;
        let still = self.before.iter().zip(&self.went).filter(|(_, w)| !**w).map(|(p, _)| p);
        let left = |p: &Pose| {
            let shown = self.datum * p.translation;
            motion.apply(shown.as_dvec3()).as_vec3() - p.translation
        };
        let all: Vec<Vec3> = still.map(left).collect();
        (all.iter().sum::<Vec3>() / all.len() as f32).length()
    }
}

/// Every other place, and one side of the pile.
const PATTERNS: [fn(usize) -> bool; 2] = [|i| i % 5 < 2, |i| i % 8 < 3];

fn step(down_m: f32) -> Pose {
    Pose::from_parts(Vec3::new(0.02, -0.01, down_m), Quat::IDENTITY)
}

/// Two of five sank alike and the later survey's datum rose by 5 cm: the step comes out to 5 mm, and so do those that sank. 3 cm are
/// three and a half standard deviations of a pair here, which a wider common error explains as well: no less is left than of all
/// blocks together.
#[test]
fn a_step_of_the_datum_comes_out_where_two_of_five_sank_alike() {
    for (k, went) in PATTERNS.into_iter().enumerate() {
        for (m, down) in [0.03_f32, 0.05, 0.10].into_iter().enumerate() {
            for sensor in [SensorKind::Uav, SensorKind::Mbes] {
                if sensor == SensorKind::Mbes && m != 1 {
                    continue;
                }
                let seed = 500 + 10 * k as u64 + m as u64;
                let case = Case::new(64, seed, went, Vec3::NEG_Z * down, step(0.05));
                let mut surveys = case.surveys(seed);
                surveys[1].sensor = sensor;
                let found = case.compared(&surveys, case.blocks(seed));
                let left = case.left_m(&found);
                let at = format!("pattern {k}, {down} m, {sensor:?}");
                let most = if down < 0.04 { 0.4 * down } else { 0.005 };
                assert!(left < most, "{at}: {left} is left, {:?}", found.moved_alike);
                if down < 0.04 {
                    continue;
                }
                let [alike] = found.moved_alike[..] else {
                    panic!("{at}: {:?}", found.moved_alike)
                };
                let sank = case.went.iter().filter(|w| **w).count();
                assert!(alike.blocks.abs_diff(sank) <= 2, "{at}: {alike:?}");
                assert!((alike.shift_m[2] + f64::from(down)).abs() < 0.006, "{at}: {alike:?}");
                let called = found.count(Class::Sunk) + found.count(Class::Moved);
                assert!(called.abs_diff(sank) <= 2, "{at}: {called} of {sank}");
            }
        }
    }
}

/// A tilt of the datum is none of the blocks' doing, with blocks that sank and without.
#[test]
fn a_tilt_of_the_datum_comes_out_where_two_of_five_sank_alike() {
    let tilt = Pose::from_parts(Vec3::new(0.0, 0.03, 0.05), Quat::from_rotation_x(0.005));
    for (k, went) in PATTERNS.into_iter().enumerate() {
        let case = Case::new(64, 540 + k as u64, went, Vec3::NEG_Z * 0.06, tilt);
        let found = case.compared(&case.surveys(540), case.blocks(540));
        assert!(case.left_m(&found) < 0.006, "pattern {k}: {}", case.left_m(&found));
        assert_eq!(found.moved_alike.len(), 1, "pattern {k}");
    }
    let still = Case::new(64, 550, |_| false, Vec3::ZERO, tilt);
    let found = still.compared(&still.surveys(550), still.blocks(550));
    assert!(still.left_m(&found) < 0.006 && found.moved_alike.is_empty());
    assert!((found.reference.motion.turn_rad[0] + 0.005).abs() < 0.0008);
}

/// Where those that sank are the most, the ground tells; where there is no ground, nobody does, and that is said.
#[test]
fn where_no_group_is_most_of_the_blocks_the_ground_is_asked() {
    let catalog = tetrapods();
    let case = Case::new(64, 560, |i| i % 9 < 5, Vec3::NEG_Z * 0.08, step(0.05));
    let surveys = case.surveys(560);
    let found = case.compared(&surveys, case.blocks(560));
    assert_eq!(found.moved_alike[0].decided, Decided::Nobody, "{:?}", found.moved_alike);
    let earlier = explaining(&catalog, &case.before, &surveys[0], 560);
    let later = explaining(&catalog, &case.after, &surveys[1], 561);
    let found = case.compared(&surveys, [earlier, later]);
    assert_eq!(found.moved_alike[0].decided, Decided::Ground, "{:?}", found.moved_alike);
    assert!(case.left_m(&found) < 0.006, "{}: {:?}", case.left_m(&found), found.moved_alike);
    assert!(found.moved_alike[0].still < found.moved_alike[0].blocks);
}
