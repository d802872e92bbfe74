//! What the CAD, GIS and 3D exports draw: recognised and planned blocks, sections and where they are.

use geom::{DVec3, Pose, Vec2};
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

    /// Outline seen from above, counter-clockwise, not closed, site coordinates (east, north).
    pub fn footprint(&self, unit: &Unit) -> Vec<[f64; 2]> {
        let mesh = &self.catalog.get(unit.model).mesh;
        let flat = mesh.vertices.iter().map(|&v| (unit.pose * v).truncate()).collect();
        let [east, north, _] = self.frame.origin;
        convex_outline(flat)
            .into_iter()
            .map(|p| [east + f64::from(p.x), north + f64::from(p.y)])
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

/// Andrew's monotone chain.
fn convex_outline(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut outline: Vec<Vec2> = Vec::new();
    for pass in 0..2 {
        let start = outline.len();
        for i in 0..points.len() {
            let p = if pass == 0 { points[i] } else { points[points.len() - 1 - i] };
            while outline.len() >= start + 2 {
                let [a, b] = [outline[outline.len() - 2], outline[outline.len() - 1]];
                if (b - a).perp_dot(p - b) > 0.0 {
                    break;
                }
                outline.pop();
            }
            outline.push(p);
        }
        outline.pop(); // the first point of the other pass
    }
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_a_square_with_points_inside() {
        let mut points: Vec<Vec2> =
            (0..25).map(|i| Vec2::new((i % 5) as f32, (i / 5) as f32)).collect();
        points.reverse();
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(Vec2::from_array);
        assert_eq!(convex_outline(points), corners);
    }
}
