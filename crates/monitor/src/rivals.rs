//! Blocks that are not gone, or not new, for sure, because a pair may be theirs.
//!
//! A pair is doubtful when another block could be the same one. That other block is then left over, and was once called missing: it had
//! moved by a metre, was recognised again, and its pose had gone to the pair.

use crate::change::{Change, Class};
use crate::matching::MatchConfig;
use geom::Vec3;
use scene::Catalog;
use std::collections::BTreeSet;

/// Calls missing and new blocks doubtful that a doubtful pair may belong to. `unsure` are the later numbers of the pairs whose partner
/// may be another.
pub(crate) fn doubt_rivals(
    changes: &mut [Change],
    unsure: &BTreeSet<u32>,
    catalog: &Catalog,
    config: &MatchConfig,
) {
    let doubted = |c: &&Change| {
        c.class == Class::Doubtful
            && c.earlier_id.is_some()
            && c.later_id.is_some_and(|id| unsure.contains(&id))
    };
    let pairs: Vec<Change> = changes.iter().filter(doubted).cloned().collect();
    for change in changes {
        let size_m = f64::from(catalog.get(change.model).d_box_m);
        let reaches = |from: Option<Vec3>, to: Option<Vec3>| {
            let ends = from.zip(to);
            ends.is_some_and(|(from, to)| config.may_go((to - from).as_dvec3(), size_m, 0.0))
        };
        let same = |p: &&Change| match change.class {
            Class::Missing => reaches(change.centre_earlier, p.centre_later),
            Class::New => reaches(p.centre_earlier, change.centre_later),
            _ => false,
        };
        let rival = pairs.iter().filter(|p| p.model == change.model).find(same);
        if let Some(number) = rival.and_then(|p| p.later_id) {
            change.doubt(&format!("block {number} of the later survey is this one or another"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{ModelId, Shape};

    fn change(class: Class, earlier: Option<(u32, Vec3)>, later: Option<(u32, Vec3)>) -> Change {
        Change {
            earlier_id: earlier.map(|e| e.0),
            later_id: later.map(|l| l.0),
            centre_earlier: earlier.map(|e| e.1),
            centre_later: later.map(|l| l.1),
            ..Change::blank(ModelId(0), class, String::new())
        }
    }

    #[test]
    fn a_block_whose_pose_a_doubtful_pair_took_is_not_missing_for_sure() {
        let block = blocks::shape_model("b", Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap();
        let catalog = Catalog::new(vec![block]);
        let at = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        let pair = |sure: bool| {
            let class = if sure { Class::Moved } else { Class::Doubtful };
            change(class, Some((2, at(2.0, 0.0))), Some((5, at(1.0, -0.2))))
        };
        let class_of = |gone: Vec3, sure: bool, unsure: &[u32]| {
            let mut changes = [pair(sure), change(Class::Missing, Some((1, gone)), None)];
            let unsure = unsure.iter().copied().collect();
            doubt_rivals(&mut changes, &unsure, &catalog, &MatchConfig::default());
            changes[1].class
        };
        assert_eq!(class_of(at(0.2, 0.0), false, &[5]), Class::Doubtful);
        assert_eq!(class_of(at(0.2, 0.0), true, &[5]), Class::Missing, "the pair is sure");
        assert_eq!(
            class_of(at(0.2, 0.0), false, &[]),
            Class::Missing,
            "doubtful for another reason"
        );
        assert_eq!(class_of(at(-4.0, 0.0), false, &[5]), Class::Missing, "too far");
        assert_eq!(class_of(at(0.8, -2.0), false, &[5]), Class::Missing, "it would have risen");
        let come = |at: Vec3| {
            let mut changes = [pair(false), change(Class::New, None, Some((7, at)))];
            doubt_rivals(&mut changes, &[5].into(), &catalog, &MatchConfig::default());
            changes[1].class
        };
        assert_eq!(come(at(2.2, -0.3)), Class::Doubtful);
        assert_eq!(come(at(9.0, 0.0)), Class::New);
    }
}
