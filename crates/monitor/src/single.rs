//! Blocks of one epoch only: gone, come, or not to be seen.
//!
//! The other epoch's cloud is asked about the surface that the block's own epoch shows. Seen through: it is not there. Covered or
//! not surveyed: nobody can say. Still there: the block is, and was merely not recognised.

use crate::SeenBlock;
use crate::body::Body;
use crate::change::{Change, Class};
use crate::surface_samples::{Samples, of};
use crate::view::{Look, Shares, View};
use rayon::prelude::*;
use scene::Catalog;
use serde::{Deserialize, Serialize};

/// When a block of one epoch only is missing or new.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SingleConfig {
    /// Samples of a block's surface.
    pub samples: usize,
    /// Share of the surface that must be seen through.
    pub through: f64,
    /// Share that must be seen for the block to be still there.
    pub still_there: f64,
    /// Fewest samples of its surface that its own epoch must show.
    pub least_shown: usize,
}

impl Default for SingleConfig {
    fn default() -> Self {
        Self { samples: 250, through: 0.35, still_there: 0.6, least_shown: 8 }
    }
}

/// Which epoch the block was recognised in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Only {
    Earlier,
    Later,
}

/// What became of each block of one epoch; `own` and `other` are the clouds of both epochs in one frame.
pub(crate) fn judge_all(
    bodies: &[&Body],
    blocks: &[SeenBlock],
    only: Only,
    catalog: &Catalog,
    samples: &[Samples],
    own: &View,
    other: &View,
    config: &SingleConfig,
) -> Vec<Change> {
    let one = |body: &&Body| {
        let shares = shares(body, catalog, samples, own, other);
        verdict(body, &blocks[body.index], only, &shares, config)
    };
    bodies.par_iter().map(one).collect()
}

/// What the other epoch says of the surface that the own one shows.
fn shares(body: &Body, catalog: &Catalog, samples: &[Samples], own: &View, other: &View) -> Shares {
    let pose = body.pose(catalog.get(body.model));
    let looks: Vec<Look> = of(samples, body.model)
        .posed(pose)
        .filter(|(p, _)| own.has_point(*p))
        .map(|(p, n)| other.look(p, n))
        .collect();
    Shares::of(&looks)
}

fn verdict(
    body: &Body,
    block: &SeenBlock,
    only: Only,
    shares: &Shares,
    config: &SingleConfig,
) -> Change {
    let (gone, epoch) = match only {
        Only::Earlier => (Class::Missing, "later"),
        Only::Later => (Class::New, "earlier"),
    };
    let judgeable = shares.seen + shares.through + shares.covered;
    let (class, confidence, note) = if shares.count < config.least_shown {
        (Class::Hidden, 0.5, "its own epoch shows too little of it".to_string())
    } else if shares.nothing > 0.6 {
        (Class::Hidden, shares.nothing, format!("the {epoch} survey does not reach it"))
    } else if shares.through > config.through && shares.through > 1.5 * shares.covered {
        (gone, shares.through / judgeable, String::new())
    } else if shares.seen >= config.still_there {
        let note =
            format!("its surface is in the {epoch} survey too, but was not recognised there");
        (Class::Hidden, shares.seen, note)
    } else if shares.covered >= 0.5 * judgeable {
        (Class::Hidden, shares.covered, format!("covered in the {epoch} survey"))
    } else {
        let note = format!(
            "the {epoch} survey shows {:.0} % of its surface, sees through {:.0} %, covers {:.0} %",
            100.0 * shares.seen,
            100.0 * shares.through,
            100.0 * shares.covered
        );
        (Class::Doubtful, 0.5, note)
    };
    let mut change = blank(body, class, note);
    change.confidence = confidence * f64::from(block.confidence);
    let occlusion = Some(f64::from(block.occlusion));
    let centre = Some(body.centre.as_vec3());
    match only {
        Only::Earlier => {
            change.earlier_id = Some(block.id);
            change.occlusion_earlier = occlusion;
            change.centre_earlier = centre;
        }
        Only::Later => {
            change.later_id = Some(block.id);
            change.occlusion_later = occlusion;
            change.centre_later = centre;
        }
    }
    change
}

/// A change without figures of a movement.
fn blank(body: &Body, class: Class, note: String) -> Change {
    Change {
        block_id: 0,
        earlier_id: None,
        later_id: None,
        model: body.model,
        class,
        shift_m: [0.0; 3],
        distance_m: 0.0,
        turn_rad: 0.0,
        axis: [0.0; 3],
        level_m: 0.0,
        level_axes_m: [0.0; 3],
        level_rad: 0.0,
        significance: 1.0,
        confidence: 0.0,
        occlusion_earlier: None,
        occlusion_later: None,
        centre_earlier: None,
        centre_later: None,
        readings: 1,
        gone_m2: 0.0,
        note,
    }
}
