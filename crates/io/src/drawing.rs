//! What the CAD, GIS and 3D exports draw: recognised and planned blocks, sections and where they are.

use geom::{DVec3, Pose, Vec2, silhouette};
use scene::{Catalog, Fit, ModelId, Placement, PlacementState, Recognised, SiteFrame};

/// A result as the exporters take it. Coordinates they write are site coordinates: east, north, up.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    /// Name of the site.
    pub name: &'a str,
    /// Local to site coordinates, CRS.
    pub frame: &'a SiteFrame,
    /// Block types.
    pub catalog: &'a Catalog,
    /// Recognised blocks; only stated ones are drawn.
    pub recognised: &'a [Recognised],
    /// The plan; only kept placements are drawn.
    pub placements: &'a [Placement],
    /// Cross-sections.
    pub sections: &'a [SectionLine],
}

/// One line of a cross-section.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionLine {
    /// Position along the alignment, metres.
    pub chainage_m: f64,
    /// Which surface: `design`, `as-is`, `planned`.
    pub surface: String,
    /// Points, site coordinates.
    pub points: Vec<[f64; 3]>,
}

/// Where a drawn block comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source<'a> {
    /// Found in the survey.
    Recognised(&'a Recognised, &'a Fit),
    /// Added by the plan.
    Planned(&'a Placement),
}

/// One block to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit<'a> {
    /// Its type.
    pub model: ModelId,
    /// Block to local frame.
    pub pose: Pose,
    /// What is known of it.
    pub source: Source<'a>,
}

impl Unit<'_> {
    /// `R12` for recognised block 12, `P3` for the third placement.
    pub fn label(&self) -> String {
        match self.source {
            Source::Recognised(r, _) => format!("R{}", r.block.0),
            Source::Planned(p) => format!("P{}", p.order),
        }
    }

    /// `recognised` or `planned`: layers and tables are called so.
    pub fn layer(&self) -> &'static str {
        match self.source {
            Source::Recognised(..) => "recognised",
            Source::Planned(_) => "planned",
        }
    }
}

impl<'a> Drawing<'a> {
    /// Everything to draw: recognised blocks, then placements, in their own order.
    pub fn units(&self) -> impl Iterator<Item = Unit<'a>> {
        let found = scene::stated(self.recognised);
        let added = self.placements.iter().filter(|p| p.state == PlacementState::Kept);
        found
            .map(|(r, fit)| Unit {
                model: fit.model,
                pose: fit.site_from_block,
                source: Source::Recognised(r, fit),
            })
            .chain(added.map(|p| Unit { model: p.model, pose: p.rest, source: Source::Planned(p) }))
    }

    /// Centre of mass of a unit, site coordinates.
    pub fn centre(&self, unit: &Unit) -> DVec3 {
        self.frame.site_from_local(unit.pose * self.catalog.get(unit.model).centre)
    }

    /// Outline seen from above: the outer ring counter-clockwise, then holes clockwise; not closed, site coordinates
    /// (east, north).
    pub fn footprint(&self, unit: &Unit) -> Vec<Vec<[f64; 2]>> {
        self.footprint_of(unit.model, &unit.pose)
    }

    pub(crate) fn footprint_of(&self, model: ModelId, pose: &Pose) -> Vec<Vec<[f64; 2]>> {
        let [east, north, _] = self.frame.origin;
        let site = |p: &Vec2| [east + f64::from(p.x), north + f64::from(p.y)];
        silhouette(&self.catalog.get(model).mesh, pose)
            .iter()
            .map(|ring| ring.iter().map(site).collect())
            .collect()
    }

    /// Code of the CRS, when it has one.
    pub fn epsg(&self) -> Option<u32> {
        epsg(&self.frame.crs)
    }
}

/// The number of `EPSG:n`.
pub(crate) fn epsg(crs: &str) -> Option<u32> {
    crs.strip_prefix("EPSG:")?.parse().ok()
}
