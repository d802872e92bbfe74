//! Several types in one plan: which may be used, how many of each there are, what one costs, where the light ones may not lie.

use crate::PlanError;
use geom::Vec2;
use scene::{Catalog, ModelId, SiteFrame};
use serde::{Deserialize, Serialize};

/// One type to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockChoice {
    /// Name in the catalogue.
    pub name: String,
    /// How many lie ready. They are used before any that must be made; left out: as many as needed are made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock: Option<u32>,
    /// Cost of one block in its place, in any currency.
    #[serde(default = "one")]
    pub cost: f32,
}

fn one() -> f32 {
    1.0
}

/// A part of the works where light blocks may not lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZoneConfig {
    /// What messages call it.
    pub name: String,
    /// Its corners, site coordinates (east, north).
    pub boundary: Vec<[f64; 2]>,
    /// Lightest block that may lie in it.
    pub minimum_mass_kg: f32,
}

/// A type with what limits it, largest block first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice {
    pub model: ModelId,
    pub stock: Option<u32>,
    pub cost: f32,
}

/// The types of `blocks`, checked. Errors: a name twice or not in the catalogue, no stock, a cost that is none.
pub(crate) fn choices(blocks: &[BlockChoice], catalog: &Catalog) -> Result<Vec<Choice>, PlanError> {
    let mut list: Vec<Choice> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let name = || block.name.clone();
        let model = catalog.find(&block.name).ok_or_else(|| PlanError::UnknownBlock {
            key: "plan.blocks",
            name: name(),
            known: catalog.iter().map(|(_, m)| m.name.as_str()).collect::<Vec<_>>().join(", "),
        })?;
        if list.iter().any(|c| c.model == model) {
            return Err(PlanError::Assortment {
                name: name(),
                why: "it is named twice; name each type once".into(),
            });
        }
        if block.stock == Some(0) {
            return Err(PlanError::Assortment {
                name: name(),
                why: "stock = 0: there is none to place; take it out, or leave stock out if more can be made".into(),
            });
        }
        if !(block.cost > 0.0 && block.cost.is_finite()) {
            let why = format!("cost = {} must be above 0", block.cost);
            return Err(PlanError::Assortment { name: name(), why });
        }
        list.push(Choice { model, stock: block.stock, cost: block.cost });
    }
    let size = |c: &Choice| catalog.get(c.model).d_box_m;
    list.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.model.0.cmp(&b.model.0)));
    Ok(list)
}

/// Corners, local frame, of the zones where a block of this mass may not lie. Errors: a zone that is no area.
pub(crate) fn closed_zones(
    zones: &[ZoneConfig],
    mass_kg: f32,
    frame: &SiteFrame,
) -> Result<Vec<Vec<Vec2>>, PlanError> {
    let local =
        |p: &[f64; 2]| Vec2::new((p[0] - frame.origin[0]) as f32, (p[1] - frame.origin[1]) as f32);
    for zone in zones {
        let finite = zone.boundary.iter().flatten().all(|v| v.is_finite());
        if !(3..=scene::MOST_CORNERS).contains(&zone.boundary.len()) || !finite {
            return Err(PlanError::Zone {
                name: zone.name.clone(),
                why: format!(
                    "boundary has {} corners; give three to {}, [east, north]",
                    zone.boundary.len(),
                    scene::MOST_CORNERS
                ),
            });
        }
        if !(zone.minimum_mass_kg >= 0.0) {
            return Err(PlanError::Zone {
                name: zone.name.clone(),
                why: format!("minimum_mass_kg = {} must not be negative", zone.minimum_mass_kg),
            });
        }
    }
    let closed = zones.iter().filter(|z| mass_kg < z.minimum_mass_kg);
    Ok(closed.map(|z| z.boundary.iter().map(local).collect()).collect())
}

/// Zones for which no type of the plan is heavy enough.
pub(crate) fn unserved(zones: &[ZoneConfig], heaviest_kg: f32) -> Vec<&ZoneConfig> {
    zones.iter().filter(|z| heaviest_kg < z.minimum_mass_kg).collect()
}

/// Whether a place lies in the polygon (even-odd rule).
pub(crate) fn lies_in(polygon: &[Vec2], place: Vec2) -> bool {
    let mut within = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a.y > place.y) != (b.y > place.y)
            && place.x < a.x + (place.y - a.y) / (b.y - a.y) * (b.x - a.x)
        {
            within = !within;
        }
    }
    within
}
