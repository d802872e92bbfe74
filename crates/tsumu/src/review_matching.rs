//! A reviewer's decisions, applied: what a person decided about a block stands, and every difference is said.
//!
//! In: decisions with places, the blocks of this run. Out: the blocks as decided, and what each decision changed. A decision belongs to the block
//! whose centre lies nearest its own, within a quarter of a block.

use geom::{DVec3, Event, Observer, Pose, Quat, Stage, Warning};
use scene::{
    Catalog, Decision, Fit, InstanceId, ModelId, PoseLimits, PosedModel, Recognised, Review,
    ReviewedBlock, SiteFrame, Verdict,
};

/// Moved by less than this share of the longest edge, the pose is the reviewed one.
const SAME_MOVE: f32 = 0.01;

/// What one decision did to the blocks of this run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The block's number in this run; `None`: it has none.
    pub block_id: Option<u32>,
    /// What this run saw otherwise; empty: it agrees.
    pub changed: Vec<String>,
}

/// A review that cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReviewError {
    /// Written by a later version.
    #[error("review.json: format {format} is not known (this version reads 1)")]
    Format {
        /// Stated format.
        format: u32,
    },
    /// A type the catalogue lacks.
    #[error("review.json: block {block_id} is of type `{model}`, which is not in the catalogue")]
    UnknownModel {
        /// Block.
        block_id: u32,
        /// Its type.
        model: String,
    },
    /// A pose that is none.
    #[error(
        "review.json: block {block_id} has a pose that is not a finite position and a rotation"
    )]
    BadPose {
        /// Block.
        block_id: u32,
    },
}

/// Applies the decisions; returns what each did. Deterministic: decisions in the order of the file.
pub fn apply(
    review: &Review,
    catalog: &Catalog,
    frame: &SiteFrame,
    blocks: &mut Vec<Recognised>,
    observer: &dyn Observer,
) -> Result<Vec<Change>, ReviewError> {
    if review.format != 1 {
        return Err(ReviewError::Format { format: review.format });
    }
    let decisions =
        review.blocks.iter().map(|d| decision(d, catalog, frame)).collect::<Result<Vec<_>, _>>()?;
    let warn =
        |message: String| observer.event(Event::Warned(Warning { stage: Stage::Review, message }));
    let mut changes = Vec::with_capacity(decisions.len());
    for (said, (model, pose)) in review.blocks.iter().zip(decisions) {
        let here = nearest(blocks, catalog, model, &pose);
        let mut changed = Vec::new();
        let block_id = match (said.decision, here) {
            (Decision::Rejected, None) => None,
            (Decision::Rejected, Some(i)) => {
                let gone = blocks.remove(i);
                changed.push(format!("block {} removed", gone.block.0));
                None
            }
            (Decision::Accepted | Decision::Corrected, Some(i)) => {
                let found = &mut blocks[i];
                changed = differences(found, catalog, model, &pose);
                warn_of_doubt(said, found, catalog, model, &pose, observer);
                found.verdict = Verdict::Stated(decided(said, catalog, model, pose, found.fit()));
                Some(found.block.0)
            }
            (Decision::Accepted | Decision::Corrected, None) => {
                warn(format!(
                    "block {} of the review was not found by this run; it is kept as reviewed",
                    said.block_id
                ));
                let number = blocks.iter().map(|b| b.block.0).max().unwrap_or(0) + 1;
                let fit = decided(said, catalog, model, pose, None);
                blocks.push(Recognised::of_fit(InstanceId(number), Vec::new(), fit));
                changed.push("not found by this run".into());
                Some(number)
            }
        };
        changes.push(Change { block_id, changed });
    }
    Ok(changes)
}

/// What this run saw otherwise than the reviewer.
fn differences(found: &Recognised, catalog: &Catalog, model: ModelId, pose: &Pose) -> Vec<String> {
    let mut list = Vec::new();
    if !found.is_stated() {
        list.push("not judged by this run".into());
    }
    let Some(fit) = found.fit() else { return list };
    if fit.model != model {
        list.push(format!(
            "type `{}` to `{}`",
            catalog.get(fit.model).name,
            catalog.get(model).name
        ));
    }
    let moved_m = moved_m(fit, pose);
    if moved_m > SAME_MOVE * catalog.get(model).d_box_m {
        list.push(format!("moved by {moved_m:.3} m"));
    }
    let turned_rad = turned_rad(fit, catalog, model, pose);
    if turned_rad > PoseLimits::right(catalog.get(model)).rotation_rad {
        list.push(format!("turned by {:.0}°", turned_rad.to_degrees()));
    }
    list
}

fn moved_m(fit: &Fit, pose: &Pose) -> f32 {
    (fit.site_from_block.translation - pose.translation).length()
}

/// Whether a run found the type and the pose that a reviewer states.
fn same_pose(fit: &Fit, catalog: &Catalog, model: ModelId, pose: &Pose) -> bool {
    fit.model == model
        && moved_m(fit, pose) <= SAME_MOVE * catalog.get(model).d_box_m
        && turned_rad(fit, catalog, model, pose)
            <= PoseLimits::right(catalog.get(model)).rotation_rad
}

fn turned_rad(fit: &Fit, catalog: &Catalog, model: ModelId, pose: &Pose) -> f32 {
    fit.posed(catalog).error(&PosedModel::new(catalog.get(model), *pose)).rotation_rad
}

/// What a reviewer accepted and this run sees as another type, or turned, is worth a look.
fn warn_of_doubt(
    said: &ReviewedBlock,
    found: &Recognised,
    catalog: &Catalog,
    model: ModelId,
    pose: &Pose,
    observer: &dyn Observer,
) {
    let Some(fit) = found.fit().filter(|_| said.decision == Decision::Accepted) else { return };
    let turned_rad = turned_rad(fit, catalog, model, pose);
    let turned = turned_rad > PoseLimits::right(catalog.get(model)).rotation_rad;
    if fit.model != model || turned {
        let message = format!(
            "block {} was accepted as `{}` and this run sees it otherwise (`{}`, turned by {:.0}°); the review stands",
            said.block_id,
            said.model,
            catalog.get(fit.model).name,
            turned_rad.to_degrees()
        );
        observer.event(Event::Warned(Warning { stage: Stage::Review, message }));
    }
}

fn decision(
    said: &ReviewedBlock,
    catalog: &Catalog,
    frame: &SiteFrame,
) -> Result<(ModelId, Pose), ReviewError> {
    let model = catalog.find(&said.model).ok_or_else(|| ReviewError::UnknownModel {
        block_id: said.block_id,
        model: said.model.clone(),
    })?;
    let place = frame.local_from_site(DVec3::new(said.x_m, said.y_m, said.z_m));
    let turn = Quat::from_xyzw(said.qx as f32, said.qy as f32, said.qz as f32, said.qw as f32);
    if !place.is_finite() || !turn.is_finite() || (turn.length() - 1.0).abs() > 1e-2 {
        return Err(ReviewError::BadPose { block_id: said.block_id });
    }
    Ok((model, Pose::from_parts(place, turn.normalize())))
}

fn nearest(blocks: &[Recognised], catalog: &Catalog, model: ModelId, pose: &Pose) -> Option<usize> {
    let model = catalog.get(model);
    let centre = *pose * model.centre;
    let distance = |b: &Recognised| (b.centre(catalog) - centre).length();
    let (i, off_m) = blocks.iter().map(distance).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (off_m <= PoseLimits::same_place(model).displacement_m).then_some(i)
}

/// A block on a reviewer's word: the pose is theirs and as sure as they are, the fit what was measured of it. No points
/// hold a pose that a person put there, so that it has a covariance only where it is the one that was found.
fn decided(
    said: &ReviewedBlock,
    catalog: &Catalog,
    model: ModelId,
    pose: Pose,
    found: Option<&Fit>,
) -> Fit {
    let fit = match found {
        Some(fit) => {
            let same = same_pose(fit, catalog, model, &pose);
            Fit {
                covariance: fit.covariance.filter(|_| same),
                legs: fit.legs.filter(|_| same),
                ..fit.clone()
            }
        }
        None => Fit {
            fitness_m: said.fitness_m,
            occlusion: said.occlusion,
            ..Fit::of_pose(model, pose)
        },
    };
    Fit { model, site_from_block: pose, confidence: Some(1.0), ..fit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Silent, Vec3};
    use scene::{Guess, Shape};

    fn catalog() -> Catalog {
        let model = |name: &str, shape| blocks::shape_model(name, shape, 2300.0).unwrap();
        Catalog::new(vec![
            model("tetrapod", Shape::Tetrapod { size: 2.0 }),
            model("cube", Shape::Cube { size: 1.5 }),
        ])
    }

    fn frame() -> SiteFrame {
        SiteFrame { origin: [-62000.0, -42000.0, 1.0], ..SiteFrame::default() }
    }

    fn found(x: f32) -> Recognised {
        let pose = Pose::from_parts(Vec3::new(x, 0.0, 0.0), Quat::IDENTITY);
        let fit = Fit { confidence: Some(0.3), ..Fit::of_pose(ModelId(0), pose) };
        let verdict = Verdict::NotJudged(Guess::Fit(fit));
        Recognised { block: InstanceId(1 + x as u32), points: vec![1, 2], verdict }
    }

    fn said(block_id: u32, decision: Decision, model: &str, x: f32) -> ReviewedBlock {
        ReviewedBlock {
            block_id,
            decision,
            model: model.into(),
            x_m: -62000.0 + f64::from(x),
            y_m: -42000.0,
            z_m: 1.0,
            qw: 1.0,
            qx: 0.0,
            qy: 0.0,
            qz: 0.0,
            fitness_m: Some(0.02),
            occlusion: Some(0.5),
            note: String::new(),
        }
    }

    #[test]
    fn decisions_stand() {
        let (catalog, frame) = (catalog(), frame());
        let mut blocks = vec![found(0.0), found(3.0), found(6.0)];
        let review = Review {
            format: 1,
            reviewer: "Sato".into(),
            blocks: vec![
                said(1, Decision::Accepted, "tetrapod", 0.1),
                said(4, Decision::Rejected, "tetrapod", 3.0),
                said(7, Decision::Corrected, "cube", 6.2),
                said(9, Decision::Accepted, "tetrapod", 12.0),
                said(8, Decision::Rejected, "tetrapod", 20.0),
            ],
            ..Review::default()
        };
        let changes = apply(&review, &catalog, &frame, &mut blocks, &Silent).unwrap();
        let told: Vec<_> = changes
            .iter()
            .zip(&review.blocks)
            .map(|(c, said)| (said.block_id, c.block_id, c.changed.join(", ")))
            .collect();
        let expected = [
            (1, Some(1), "not judged by this run, moved by 0.100 m"),
            (4, None, "block 4 removed"),
            (7, Some(7), "not judged by this run, type `tetrapod` to `cube`, moved by 0.200 m"),
            (9, Some(8), "not found by this run"),
            (8, None, ""),
        ];
        assert_eq!(told, expected.map(|(a, b, c)| (a, b, c.to_string())));
        let seen: Vec<_> = blocks
            .iter()
            .map(|b| {
                let fit = b.stated().unwrap();
                (b.block.0, fit.model.0, fit.site_from_block.translation.x, b.points.len())
            })
            .collect();
        assert_eq!(seen.len(), 3);
        assert!(
            seen.iter().zip([(1, 0, 0.1, 2), (7, 1, 6.2, 2), (8, 0, 12.0, 0)]).all(|(a, b)| (
                a.0, a.1, a.3
            ) == (
                b.0, b.1, b.3
            ) && (a
                .2
                - b.2)
                .abs()
                < 0.01),
            "{seen:?}"
        );
        let fits: Vec<&Fit> = blocks.iter().map(|b| b.stated().unwrap()).collect();
        assert!(fits.iter().all(|f| f.confidence == Some(1.0) && f.covariance.is_none()));
        // Once more changes nothing.
        let before = blocks.clone();
        apply(&review, &catalog, &frame, &mut blocks, &Silent).unwrap();
        assert_eq!(blocks, before);
    }

    #[test]
    fn what_cannot_be_applied_is_named() {
        let (catalog, frame) = (catalog(), frame());
        let fails = |format, block: ReviewedBlock| {
            let review = Review { format, blocks: vec![block], ..Review::default() };
            apply(&review, &catalog, &frame, &mut Vec::new(), &Silent).unwrap_err().to_string()
        };
        assert!(fails(2, said(1, Decision::Accepted, "cube", 0.0)).contains("format 2"));
        assert!(
            fails(1, said(5, Decision::Accepted, "dolos", 0.0))
                .contains("block 5 is of type `dolos`")
        );
        assert!(
            fails(1, ReviewedBlock { qw: 0.2, ..said(5, Decision::Accepted, "cube", 0.0) })
                .contains("block 5 has a pose")
        );
    }
}
