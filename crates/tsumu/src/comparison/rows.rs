//! What the stage found, as rows of files in site coordinates.

use super::Compared;
use geom::Vec3;
use io::changes_csv::ChangeRow;
use io::changes_gpkg::{EpochChanges, EpochRow, ObservationRow, Store, TrackRow};
use monitor::{Basis, Change, Observation, Registration};
use std::collections::BTreeMap;

impl Compared<'_> {
    /// Rows of `changes.csv` of a step, from 0.
    pub fn rows(&self, step: usize) -> Vec<ChangeRow> {
        let site = &self.epochs[step].site;
        let frame = &site.survey.frame;
        let place = |p: Option<Vec3>| p.map(|p| frame.site_from_local(p).to_array());
        let own_numbers = self.numbers_before(step);
        let number_before = |id: u32| match &own_numbers {
            Some(own) => own.get(&id).copied().flatten(),
            None => Some(id),
        };
        let one = |c: &Change| {
            let both = c.earlier_id.is_some() && c.later_id.is_some();
            let if_both = |v: f64| both.then_some(v);
            ChangeRow {
                block_id: c.block_id,
                earlier_id: c.earlier_id.and_then(number_before),
                later_id: c.later_id,
                model: site.catalog.get(c.model).name.clone(),
                class: c.class.word().into(),
                shift_m: both.then_some(c.shift_m),
                distance_m: if_both(c.distance_m),
                turn_deg: if_both(c.turn_rad.to_degrees()),
                axis: both.then_some(c.axis),
                level_m: if_both(c.level_m),
                level_deg: if_both(c.level_rad.to_degrees()),
                significance: if_both(c.significance),
                confidence: Some(c.confidence),
                occlusion_earlier: c.occlusion_earlier,
                occlusion_later: c.occlusion_later,
                note: c.note.clone(),
                centre_earlier: place(c.centre_earlier),
                centre_later: place(c.centre_later),
            }
        };
        self.steps[step].changes.iter().map(one).collect()
    }

    /// A series numbers blocks by their tracks; each one's own number in the epoch before a step, `None` where the epoch does not
    /// show it. `None` of all: no series was made, and numbers are the epoch's.
    fn numbers_before(&self, step: usize) -> Option<BTreeMap<u32, Option<u32>>> {
        let series = self.series.as_ref()?;
        let own = series.observations().iter().filter(|o| o.epoch == step);
        Some(own.map(|o| (o.track, o.block)).collect())
    }

    /// The project store; `None` where no series was made.
    pub(super) fn store(&self) -> Option<Store> {
        let series = self.series.as_ref()?;
        let catalog = &self.epochs[0].site.catalog;
        let epoch = |(i, run): (usize, &&super::EpochRun)| EpochRow {
            epoch: i as u32,
            survey: run.name.clone(),
            date: run.site.survey_date.clone(),
            ..i.checked_sub(1).map(|s| registered(&self.steps[s].reference)).unwrap_or_default()
        };
        let track = |t: &monitor::Track| TrackRow {
            block_id: t.track,
            model: catalog.get(t.model).name.clone(),
            first_epoch: t.first_epoch as u32,
        };
        let step = |s: usize| EpochChanges { from: s as u32, to: s as u32 + 1, rows: self.rows(s) };
        Some(Store {
            crs: self.epochs[0].site.survey.frame.crs.clone(),
            epochs: self.epochs.iter().enumerate().map(epoch).collect(),
            blocks: series.tracks().iter().map(track).collect(),
            observations: series.observations().iter().map(observed).collect(),
            changes: (0..self.steps.len()).map(step).collect(),
        })
    }
}

fn observed(o: &Observation) -> ObservationRow {
    ObservationRow {
        block_id: o.track,
        epoch: o.epoch as u32,
        block_in_epoch: o.block,
        class: o.class.map(|c| c.word().to_string()).unwrap_or_default(),
        position_m: o.position_m,
        rotation_wxyz: o.rotation_wxyz,
        shift_m: o.shift_m,
        turn_deg: o.turn_rad.to_degrees(),
        level_m: o.level_m,
        confidence: o.confidence,
        occlusion: o.occlusion,
        note: o.note.clone(),
    }
}

fn registered(r: &Registration) -> EpochRow {
    EpochRow {
        basis: basis(r.basis).into(),
        shift_m: r.motion.shift_m,
        yaw_deg: r.motion.turn_rad[2].to_degrees(),
        sd_z_m: r.sd()[2],
        ..EpochRow::default()
    }
}

/// What a registration rests on, in a word.
pub(super) fn basis(basis: Basis) -> &'static str {
    match basis {
        Basis::Fixed => "fixed",
        Basis::Blocks => "blocks",
        Basis::StableGround => "stable ground",
        Basis::UnexplainedGround => "unexplained ground",
    }
}
