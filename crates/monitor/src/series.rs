//! One number for a block through all epochs.
//!
//! A [`Series`] holds tracks (blocks with a number of their own) and observations (a track in an epoch). Adding an epoch compares
//! it with the last state of every track that may still be there, so a block that was hidden for a while gets its own number
//! back; it adds rows and changes none.

use crate::compare::{CompareConfig, Comparison, compare};
use crate::motion::Motion;
use crate::{Class, Epoch, MonitorError, SeenBlock, StableGround};
use geom::{DVec3, Observer, Pose};
use scene::{Catalog, ModelId, SiteFrame};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A block of the structure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Its number, from 1, never given twice.
    pub track: u32,
    /// Type.
    pub model: ModelId,
    /// Epoch it was first seen in, from 0.
    pub first_epoch: usize,
}

/// A track in an epoch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Observation {
    /// The track.
    pub track: u32,
    /// The epoch, from 0.
    pub epoch: usize,
    /// The block's number in that epoch; `None` where it was not recognised.
    pub block: Option<u32>,
    /// What happened since the epoch before; `None` in the first.
    pub class: Option<Class>,
    /// Origin of its mesh, site coordinates as that survey has them; `None` where it was not recognised.
    pub position_m: Option<[f64; 3]>,
    /// Rotation, w x y z.
    pub rotation_wxyz: [f64; 4],
    /// Shift since the epoch before.
    pub shift_m: [f64; 3],
    /// Turn since the epoch before, radians.
    pub turn_rad: f64,
    /// Level of detection of the shift.
    pub level_m: f64,
    /// Probability that it is right.
    pub confidence: f64,
    /// Share of the surface that is hidden.
    pub occlusion: Option<f64>,
    /// What a reader should know.
    pub note: String,
}

/// All epochs so far.
#[derive(Clone, Debug, Default)]
pub struct Series {
    tracks: Vec<Track>,
    observations: Vec<Observation>,
    epochs: usize,
    /// Last state of the tracks that may still be there, in the latest epoch's local frame.
    last: Vec<(u32, SeenBlock)>,
}

impl Series {
    /// The first epoch: every block begins a track.
    pub fn start(epoch: &Epoch, catalog: &Catalog) -> Self {
        let mut out = Self::default();
        for block in &epoch.blocks {
            let track = out.begin(block.model);
            out.observations.push(seen(track, 0, block, &epoch.survey.frame));
            out.last.push((track, block.clone()));
        }
        debug_assert!(out.tracks.iter().all(|t| usize::from(t.model.0) < catalog.len()));
        out.epochs = 1;
        out
    }

    /// Tracks in the order of their numbers.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Observations, epoch by epoch.
    pub fn observations(&self) -> &[Observation] {
        &self.observations
    }

    /// Epochs so far.
    pub fn epochs(&self) -> usize {
        self.epochs
    }

    /// Adds an epoch. `previous` is the one added last, for its survey. The comparison that is returned numbers earlier blocks
    /// by their tracks.
    pub fn add(
        &mut self,
        previous: &Epoch,
        next: &Epoch,
        catalog: &Catalog,
        stable: &StableGround,
        config: &CompareConfig,
        observer: &dyn Observer,
    ) -> Result<Comparison, MonitorError> {
        let blocks: Vec<SeenBlock> =
            self.last.iter().map(|(track, b)| SeenBlock { id: *track, ..b.clone() }).collect();
        let state = Epoch { survey: previous.survey, blocks };
        let mut found = compare(&state, next, catalog, stable, config, observer)?;
        let by_id: BTreeMap<u32, &SeenBlock> = next.blocks.iter().map(|b| (b.id, b)).collect();
        let before: BTreeMap<u32, &SeenBlock> = state.blocks.iter().map(|b| (b.id, b)).collect();
        let epoch = self.epochs;
        let mut last = Vec::new();
        for change in &mut found.changes {
            let track = match change.earlier_id {
                Some(track) => track,
                None => self.begin(change.model),
            };
            change.block_id = track;
            let block = change.later_id.and_then(|id| by_id.get(&id).copied());
            let mut row = match block {
                Some(block) => seen(track, epoch, block, &next.survey.frame),
                None => unseen(track, epoch),
            };
            row.class = Some(change.class);
            row.shift_m = change.shift_m;
            row.turn_rad = change.turn_rad;
            row.level_m = change.level_m;
            row.confidence = change.confidence;
            row.note.clone_from(&change.note);
            self.observations.push(row);
            match (block, change.class) {
                (Some(block), _) => last.push((track, block.clone())),
                (None, Class::Missing) => {}
                // It may be there still: where it was, as the new survey would show it.
                (None, _) => {
                    let old = before[&track];
                    last.push((
                        track,
                        carried(old, state.survey.frame.origin, next, &found.reference.motion),
                    ));
                }
            }
        }
        self.last = last;
        self.epochs += 1;
        Ok(found)
    }

    fn begin(&mut self, model: ModelId) -> u32 {
        let track = self.tracks.len() as u32 + 1;
        self.tracks.push(Track { track, model, first_epoch: self.epochs });
        track
    }
}

fn seen(track: u32, epoch: usize, block: &SeenBlock, frame: &SiteFrame) -> Observation {
    let q = block.site_from_block.rotation;
    Observation {
        track,
        epoch,
        block: Some(block.id),
        class: None,
        position_m: Some(frame.site_from_local(block.site_from_block.translation).to_array()),
        rotation_wxyz: [q.w, q.x, q.y, q.z].map(f64::from),
        shift_m: [0.0; 3],
        turn_rad: 0.0,
        level_m: 0.0,
        confidence: block.confidence.into(),
        occlusion: Some(block.occlusion.into()),
        note: String::new(),
    }
}

fn unseen(track: u32, epoch: usize) -> Observation {
    Observation {
        track,
        epoch,
        block: None,
        class: None,
        position_m: None,
        rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
        shift_m: [0.0; 3],
        turn_rad: 0.0,
        level_m: 0.0,
        confidence: 0.0,
        occlusion: None,
        note: String::new(),
    }
}

/// A block of the earlier frame where the next survey would show it.
fn carried(block: &SeenBlock, origin: [f64; 3], next: &Epoch, motion: &Motion) -> SeenBlock {
    let pose = &block.site_from_block;
    let shift = DVec3::from_array(origin) - DVec3::from_array(next.survey.frame.origin);
    let translation = (motion.undo(pose.translation.as_dvec3()) + shift).as_vec3();
    let rotation = (motion.rotation().inverse() * pose.rotation.as_dquat()).as_quat().normalize();
    SeenBlock {
        site_from_block: Pose::from_parts(translation, rotation),
        points: Vec::new(),
        ..block.clone()
    }
}
