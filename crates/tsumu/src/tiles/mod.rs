//! A site that is too large for one machine, or for one go: cut into tiles, worked on in any order and anywhere, merged without a seam.
//!
//! `scan` streams the surveys once and leaves their points by cell; `facts` estimates what every tile must know of the whole; `plan` says
//! what the tiles are; `work` does one; `merge` makes the recognition of the whole, and from there a run is a run like any other.

mod cell_points;
mod facts;
mod grid;
mod memory;
mod merge;
mod part;
mod plan;
mod scan;
mod status;
mod work;

pub use plan::{Tile, TileOptions, TilePlan, TiledSite};
pub use status::TileStatus;
pub use work::{TileDone, TileRequest};

use crate::{Job, Result, RunFolder, RunOptions, Site, WholeRun};
use std::path::Path;

impl TilePlan {
    /// The site of the plan with the settings and the seed it was made with.
    pub fn load_site(&self, folder: Option<&Path>, job: &Job) -> Result<Site> {
        let mut site = Site::load(folder.unwrap_or(self.site()), job)?;
        (site.config, site.seed) = (self.config()?.with_ground(site.ground.as_ref()), self.seed());
        Ok(site)
    }
}

/// Merges the tiles of a plan into a run folder: blocks, then plan, exports and report as for any run. `site`: the site folder, where it
/// is not where the plan was made. Errors: a tile is missing, or does not belong to the plan; nothing is merged then.
pub fn merge_tiles(
    plan: &TilePlan,
    out: &Path,
    site: Option<&Path>,
    options: &RunOptions,
    job: &Job,
) -> Result<RunFolder> {
    let site = plan.load_site(site, job)?;
    let whole = WholeRun::of_tiles(plan, &site, out, options, job)?;
    let recognition = whole.recognise()?;
    let planned = whole.plan(&recognition)?;
    whole.finish(&recognition, planned.as_ref())
}

/// Surveys with more points than this are cut. Measured: a recognition of the whole needs some 100 MB a million points.
pub(crate) const MOST_POINTS: usize = 12_000_000;
/// And sites with more blocks: about so many block widths squared that were surveyed.
const MOST_BLOCKS: usize = 4_000;

impl Site {
    /// Whether the site is so large that it is recognised in tiles.
    pub(crate) fn is_cut(&self) -> bool {
        let points = &self.survey.cloud.position_m;
        if self.folder.is_none() || self.survey.sensor == scene::SensorKind::DepthCamera {
            return false;
        }
        points.len() > MOST_POINTS || self.block_squares(points) > MOST_BLOCKS
    }

    fn block_squares(&self, points: &[geom::Vec3]) -> usize {
        let d_box_m = self.catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
        let square = |p: &geom::Vec3| (p.truncate() / d_box_m).floor().as_ivec2();
        points.iter().map(square).collect::<std::collections::HashSet<_>>().len()
    }
}
