//! Blocks of one epoch only: gone, come, or not to be seen.
//!
//! The other epoch's cloud is asked about the surface that the block's own epoch shows. Seen through: it is not there. Covered or
//! not surveyed: nobody can say. Still there: the block is, and was merely not recognised.

use crate::SeenBlock;
use crate::body::Body;
use crate::change::{Change, Class};
use crate::room::Room;
use crate::surface_samples::{Samples, of};
use crate::view::{Look, Shares, View};
use geom::{DistanceField, PointGrid, Vec3};
use rayon::prelude::*;
use scene::{Catalog, ModelId};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

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
    /// Share of an earlier block's surface that still stands, from which what is gone is a piece and not the block.
    pub partly: f64,
    /// Share of the block that contradicts the later survey in the best pose near its old place: below the first value it may lie
    /// there unseen, from the second on there is no room for it, and it is gone even where its old place is covered.
    pub room: [f64; 2],
    /// Share of the surface that must be seen through for a block to be gone that may lie near its old place unseen.
    pub through_despite_room: f64,
    /// Surface that no block explains near the upper part of a block's old place, in squares of the block length, from which the
    /// block may have moved without having been recognised.
    pub unexplained_blocks2: f32,
}

impl Default for SingleConfig {
    fn default() -> Self {
        Self {
            samples: 250,
            through: 0.35,
            still_there: 0.6,
            least_shown: 8,
            partly: 0.45,
            room: [0.01, 0.03],
            through_despite_room: 0.6,
            unexplained_blocks2: 0.12,
        }
    }
}

/// Which epoch the block was recognised in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Only {
    Earlier,
    Later,
}

/// Everything a single block is judged by.
pub(crate) struct Single<'a> {
    pub catalog: &'a Catalog,
    pub samples: &'a [Samples],
    pub solids: &'a Solids,
    /// The clouds of the block's own epoch and of the other one, in one frame.
    pub own: &'a View,
    pub other: &'a View,
    /// Points of the other epoch that no block of it explains.
    pub unexplained: &'a PointGrid,
    /// Where a block of the earlier epoch may lie unseen; `None`: nobody asks.
    pub room: Option<&'a Room<'a>>,
    pub config: &'a SingleConfig,
}

impl Single<'_> {
    /// What became of each block.
    pub fn judge_all(&self, bodies: &[&Body], blocks: &[SeenBlock], only: Only) -> Vec<Change> {
        bodies.par_iter().map(|body| self.judge(body, &blocks[body.index], only)).collect()
    }

    /// What the other epoch says of the surface that the own one shows.
    fn looks(&self, body: &Body) -> Vec<Look> {
        let pose = body.pose(self.catalog.get(body.model));
        let looks: Vec<Look> = of(self.samples, body.model)
            .posed(pose)
            .filter(|(p, _)| self.own.has_point(*p))
            .map(|(p, n)| self.other.look(p, n))
            .collect();
        let told: Vec<Look> = looks.iter().copied().filter(|l| *l != Look::Nothing).collect();
        // A plan shows undersides, too, which no sensor would see.
        let of_plan = self.own.knows_everything() && told.len() >= self.config.least_shown;
        if of_plan { told } else { looks }
    }

    /// What became of a block that its own epoch alone shows.
    pub fn judge(&self, body: &Body, block: &SeenBlock, only: Only) -> Change {
        let shares = Shares::of(&self.looks(body));
        let pierced = self.pierced(body);
        let looked_for = self.room.filter(|_| only == Only::Earlier);
        let room = || looked_for.map(|r| r.least_contradiction(body));
        let mut change = verdict(body, block, only, &shares, pierced, &room, self.config);
        let size_m = self.catalog.get(body.model).d_box_m;
        let moved_m2 = self.unexplained_m2(body, size_m);
        if matches!(change.class, Class::Missing | Class::New)
            && moved_m2 > self.config.unexplained_blocks2 * size_m * size_m
        {
            let epoch = if only == Only::Earlier { "later" } else { "earlier" };
            change.doubt(&format!(
                "{moved_m2:.1} m² that no block explains stand there in the {epoch} survey: it may have moved"
            ));
        }
        change
    }

    /// Surface of the other epoch about the upper half of the block that none of its blocks explains, m²: what a removed block
    /// leaves free lies lower.
    fn unexplained_m2(&self, body: &Body, size_m: f32) -> f32 {
        let centre = body.centre.as_vec3();
        let mut count = 0_u32;
        self.unexplained.for_each_within(centre, NEIGHBOURHOOD * size_m, |_, p, _| {
            count += u32::from(p.z > centre.z + UPPER * size_m);
        });
        count as f32 * self.other.spacing_m().powi(2)
    }

    /// Whether the other epoch has points where the block would be solid.
    fn pierced(&self, body: &Body) -> bool {
        let model = self.catalog.get(body.model);
        let Some(solid) = solid(self.solids, self.catalog, body.model) else { return false };
        let pose = body.pose(model);
        let depth_m = self.other.near_m + DEPTH_BLOCKS * model.d_box_m;
        let inside = |p: Vec3| solid.distance_m(pose.inverse_transform_point(p)) < -depth_m;
        let area_m2 = self.other.area_inside_m2(body.centre.as_vec3(), model.d_max_m, inside);
        area_m2 > PIERCED_BLOCKS2 * model.d_box_m * model.d_box_m
    }
}

/// Where a block that moved by less than half its length may show, in block lengths about its old centre, and above it.
const NEIGHBOURHOOD: f32 = 0.75;
const UPPER: f32 = 0.1;
/// How deep inside a block points must lie, beyond a survey's nearness, in block lengths, and how much of them.
const DEPTH_BLOCKS: f32 = 0.03;
const PIERCED_BLOCKS2: f32 = 0.01;
/// Cells of a distance field along its longest edge.
const CELLS: usize = 32;

/// Distance fields of all models, each made when a block of its type is first asked about; `None` where a mesh has none.
pub(crate) type Solids = Vec<OnceLock<Option<DistanceField>>>;

/// None made yet.
pub(crate) fn solids(catalog: &Catalog) -> Solids {
    catalog.iter().map(|_| OnceLock::new()).collect()
}

/// The distance field of a type; `None` where its mesh has none.
pub(crate) fn solid<'a>(
    solids: &'a Solids,
    catalog: &Catalog,
    model: ModelId,
) -> Option<&'a DistanceField> {
    let mesh = catalog.get(model);
    solids[usize::from(model.0)]
        .get_or_init(|| DistanceField::new(&mesh.mesh, CELLS, 0.05 * mesh.d_box_m).ok())
        .as_ref()
}

fn verdict(
    body: &Body,
    block: &SeenBlock,
    only: Only,
    shares: &Shares,
    pierced: bool,
    room: &dyn Fn() -> Option<f64>,
    config: &SingleConfig,
) -> Change {
    let (gone, epoch) = match only {
        Only::Earlier => (Class::Missing, "later"),
        Only::Later => (Class::New, "earlier"),
    };
    let seen_through = shares.through > config.through && shares.through > 1.5 * shares.covered;
    let leaves_no_room = || {
        shares.through >= config.through_despite_room || room().is_none_or(|r| r >= config.room[0])
    };
    let judgeable = shares.seen + shares.through + shares.covered;
    let (class, confidence, note) = if shares.count < config.least_shown {
        (Class::Hidden, 0.5, "its own epoch shows too little of it".to_string())
    } else if only == Only::Earlier
        && shares.seen >= config.partly
        && shares.seen < config.still_there.max(0.9)
        && (pierced || shares.through > 0.4 * (1.0 - shares.seen))
    {
        let note = format!(
            "{:.0} % of its surface still stands, the rest is gone; it was not recognised whole",
            100.0 * shares.seen
        );
        (Class::PossiblyBroken, shares.seen, note)
    } else if pierced && leaves_no_room() {
        let note = format!("the {epoch} survey has points where it would be solid");
        (gone, f64::max(0.9, shares.through), note)
    } else if shares.nothing > 0.6 {
        (Class::Hidden, shares.nothing, format!("the {epoch} survey does not reach it"))
    } else if seen_through && leaves_no_room() {
        (gone, shares.through / judgeable, String::new())
    } else if pierced || seen_through {
        let note = format!(
            "its old place is free, but within a move's reach the {epoch} survey leaves room for it unseen"
        );
        (Class::Doubtful, 0.5, note)
    } else if shares.seen < 0.5 * config.still_there && room().is_some_and(|r| r >= config.room[1])
    {
        (gone, 0.9, format!("the {epoch} survey leaves no room for it, there or near"))
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
    let mut change = Change::blank(body.model, class, note);
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
