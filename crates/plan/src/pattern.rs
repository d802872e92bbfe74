//! Policy `pattern`: blocks on the nodes of a regular grid, layer upon layer, as layered placing asks for (ours).
//!
//! In: bond, spacing or density, direction, origin and the rule of attitudes. Out: a block on every node that lacks volume and on
//! which one rests by all rules of the planner. Nodes are counted as on drawings: layer, row, place in the row.

use crate::{
    PlanError, Settings, attitudes, batches, each_window,
    rounds::Filled,
    search::{self, Candidate, Places},
    silhouette::Silhouette,
    site::{Site, TypeToPlace},
    stack::Stack,
    windows::Window,
};
use geom::{Event, Observer, Quat, SeedTree, Stage, Vec2, Vec3, Warning};
use rayon::prelude::*;
use scene::{
    BlockModel, ConvexPart, DesignSurface, InstanceId, PatternNode, PlacedBlock, Placement,
    PlacementState, SiteFrame,
};
use serde::{Deserialize, Serialize};

/// Turns about the vertical in which a block of a stated attitude is tried.
const YAWS: u32 = 24;
/// Parts whose middle lies farther than this from the centre of mass, in d_box, are legs.
const LEG: f32 = 0.1;
/// Share of the asked density below which the plan says so.
const NEAR_DENSITY: f32 = 0.9;
/// Most nodes of a layer: more is a slip of the keyboard.
const MOST_NODES: f32 = 1e6;

/// How the rows of a pattern lie against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bond {
    /// A square grid; the next layer lies over the middles of its meshes.
    Rows,
    /// Every second row and every second layer is shifted by half a spacing.
    HalfBrick,
    /// A grid of equal triangles; the next layer lies over their middles.
    #[default]
    Staggered,
}

/// In which attitude blocks are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AttitudeRule {
    /// In any.
    Any,
    /// A leg up (of a block without legs: an axis of its mesh).
    LegUp,
    /// A leg up and a leg down in turn along each row.
    #[default]
    Alternate,
}

/// Settings of policy `pattern`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PatternConfig {
    /// How rows lie against each other.
    pub bond: Bond,
    /// Distance of nodes in a row and of rows; left out: from the density, without one a block's length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_m: Option<[f32; 2]>,
    /// Blocks on a square metre in each layer, instead of the spacing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_per_m2: Option<f32>,
    /// Where rows run, degrees clockwise from north.
    pub bearing_deg: f32,
    /// East and north of node R1 C1; left out: the south-western corner of the design.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 2]>,
    /// The attitude of the blocks.
    pub attitude: AttitudeRule,
    /// Most layers; left out: as many as the design takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layers: Option<u32>,
}

/// The pattern laid out for a block.
pub(crate) struct Pattern {
    bond: Bond,
    /// Along a row, across rows.
    spacing_m: Vec2,
    along: Vec2,
    origin: Vec2,
    layers: u32,
    density_per_m2: Option<f32>,
    /// Of even nodes, of odd ones.
    silhouettes: [Vec<Silhouette>; 2],
}

impl Pattern {
    /// Lays it out. Errors: spacing and density together, either not above 0, a spacing wider than the works.
    pub fn new(
        config: &PatternConfig,
        settings: &Settings,
        block: &BlockModel,
        (design, frame): (&DesignSurface, &SiteFrame),
        seed: SeedTree,
    ) -> Result<Self, PlanError> {
        let spacing_m = spacing(config, block)?;
        let [low, high] = design.extent();
        let origin = config.origin.unwrap_or(low);
        let local = |k: usize| (origin[k] - frame.origin[k]) as f32;
        if !(local(0).is_finite() && local(1).is_finite() && config.bearing_deg.is_finite()) {
            let (key, value) = ("pattern.bearing_deg", config.bearing_deg);
            return Err(PlanError::BadSetting {
                key,
                value,
                why: "it and the origin must be numbers",
            });
        }
        let (width_m, height_m) = ((high[0] - low[0]) as f32, (high[1] - low[1]) as f32);
        let widest_m = width_m.hypot(height_m);
        if spacing_m.max_element() > widest_m {
            let spacing_m = spacing_m.max_element();
            return Err(PlanError::PatternTooWide { spacing_m, width_m, height_m });
        }
        if (widest_m / spacing_m.x) * (widest_m / spacing_m.y) > MOST_NODES {
            let (key, value) = ("pattern.spacing_m", spacing_m.min_element());
            return Err(PlanError::BadSetting {
                key,
                value,
                why: "it gives more than a million nodes",
            });
        }
        if config.layers == Some(0) {
            let (key, value) = ("pattern.layers", 0.0);
            return Err(PlanError::BadSetting { key, value, why: "it must be at least 1" });
        }
        let (sin, cos) = config.bearing_deg.to_radians().sin_cos();
        let laid = |set: Vec<Quat>| -> Vec<Silhouette> {
            set.into_iter().map(|q| Silhouette::new(block, q, settings.cell_m)).collect()
        };
        let [even, odd] = attitudes_of(config.attitude, block, settings, seed);
        Ok(Self {
            bond: config.bond,
            spacing_m,
            along: Vec2::new(sin, cos),
            origin: Vec2::new(local(0), local(1)),
            layers: config.layers.unwrap_or(settings.rounds).min(settings.rounds),
            density_per_m2: config.density_per_m2,
            silhouettes: [laid(even), laid(odd)],
        })
    }

    /// Where a node lies, local frame.
    fn place(&self, node: PatternNode) -> Vec2 {
        let (row, column) = ((node.row - 1) as f32, (node.column - 1) as f32);
        let odd_row = (node.row - 1).rem_euclid(2) as f32;
        let odd_layer = f32::from(node.layer.is_multiple_of(2));
        let (in_row, across) = match self.bond {
            Bond::Rows => (0.5 * odd_layer, 0.5 * odd_layer),
            Bond::HalfBrick => (0.5 * odd_row + 0.5 * odd_layer, 0.0),
            Bond::Staggered => (0.5 * odd_row + 0.5 * odd_layer, odd_layer / 3.0),
        };
        let left = self.along.perp();
        // Rows follow each other to the right of their direction.
        self.origin + self.along * ((column + in_row) * self.spacing_m.x)
            - left * ((row + across) * self.spacing_m.y)
    }

    /// The nodes of a layer over the works, row by row.
    fn nodes(&self, stack: &Stack, layer: u32) -> Vec<(PatternNode, Vec2)> {
        let map = &stack.design;
        let (low, high) = (map.centre(0, 0), map.centre(map.nx - 1, map.ny - 1));
        let corners = [low, high, Vec2::new(low.x, high.y), Vec2::new(high.x, low.y)];
        let right = -self.along.perp();
        let range = |axis: Vec2, spacing_m: f32| {
            let of = |c: &Vec2| (*c - self.origin).dot(axis) / spacing_m;
            let least = corners.iter().map(of).fold(f32::INFINITY, f32::min);
            let most = corners.iter().map(of).fold(f32::NEG_INFINITY, f32::max);
            (least.floor() as i32 - 1, most.ceil() as i32 + 2)
        };
        let (first_row, last_row) = range(right, self.spacing_m.y);
        let (first, last) = range(self.along, self.spacing_m.x);
        let all = (first_row..=last_row)
            .flat_map(|row| (first..=last).map(move |column| PatternNode { layer, row, column }));
        all.map(|node| (node, self.place(node)))
            .filter(|(_, at)| stack.has_design(at.x, at.y))
            .collect()
    }

    /// Poses over a node, best first.
    fn candidates(
        &self,
        stack: &Stack,
        kind: &TypeToPlace,
        node: PatternNode,
        window: &Window,
    ) -> Vec<Candidate> {
        let (settings, reach) = (&kind.settings, search::reach_cells(&kind.settings));
        let verify = settings.search.verify as usize;
        let silhouettes = &self.silhouettes[(node.row + node.column).rem_euclid(2) as usize];
        let here = Places { x: reach..=reach, y: reach..=reach, step: 1 };
        let at = |_| here.clone();
        search::candidates(stack, settings, kind.model, silhouettes, at, verify, window)
    }

    /// The poses over the node nearest to a window's middle.
    pub fn near(&self, stack: &Stack, kind: &TypeToPlace, window: &Window) -> Vec<Candidate> {
        let nodes = self.nodes(stack, 1).into_iter().chain(self.nodes(stack, 2));
        let away = |at: &Vec2| (*at - window.centre).length();
        let nearest = nodes.min_by(|a, b| away(&a.1).total_cmp(&away(&b.1)));
        let of = |(node, at): (PatternNode, Vec2)| {
            self.candidates(
                stack,
                kind,
                node,
                &each_window::window_at(stack, at, kind.settings.window_m),
            )
        };
        nearest.map_or(Vec::new(), of)
    }
}

fn spacing(config: &PatternConfig, block: &BlockModel) -> Result<Vec2, PlanError> {
    let positive = |key, value: f32| match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(PlanError::BadSetting { key, value, why: "it must be above 0" }),
    };
    match (config.spacing_m, config.density_per_m2) {
        (Some(_), Some(density)) => Err(PlanError::BadSetting {
            key: "pattern.density_per_m2",
            value: density,
            why: "give either it or pattern.spacing_m",
        }),
        (Some([along_m, across_m]), None) => {
            positive("pattern.spacing_m", along_m.min(across_m))?;
            positive("pattern.spacing_m", along_m.max(across_m))?;
            Ok(Vec2::new(along_m, across_m))
        }
        (None, Some(density)) => {
            positive("pattern.density_per_m2", density)?;
            Ok(match config.bond {
                Bond::Staggered => equal_triangles((2.0 / (3.0_f32.sqrt() * density)).sqrt()),
                Bond::Rows | Bond::HalfBrick => Vec2::splat(density.sqrt().recip()),
            })
        }
        (None, None) => Ok(match config.bond {
            Bond::Staggered => equal_triangles(block.d_box_m),
            Bond::Rows | Bond::HalfBrick => Vec2::splat(block.d_box_m),
        }),
    }
}

fn equal_triangles(edge_m: f32) -> Vec2 {
    Vec2::new(edge_m, 0.5 * 3.0_f32.sqrt() * edge_m)
}

/// The attitudes of even nodes and of odd ones.
fn attitudes_of(
    rule: AttitudeRule,
    block: &BlockModel,
    settings: &Settings,
    seed: SeedTree,
) -> [Vec<Quat>; 2] {
    if rule == AttitudeRule::Any {
        let turn = attitudes::random(&mut seed.child("attitudes", 0).rng());
        let set = attitudes::spread(settings.search.attitudes as usize, &block.symmetry);
        let all: Vec<Quat> = set.into_iter().map(|q| turn * q).collect();
        return [all.clone(), all];
    }
    let middle = |p: &ConvexPart| {
        p.corners.iter().sum::<Vec3>() / p.corners.len().max(1) as f32 - block.centre
    };
    let leg = block.parts.iter().map(middle).find(|v| v.length() > LEG * block.d_box_m);
    let axis = leg.map_or(Vec3::Z, Vec3::normalize);
    let about = |to: Vec3| -> Vec<Quat> {
        let upright = Quat::from_rotation_arc(axis, to);
        let yaw = |k: u32| std::f32::consts::TAU * k as f32 / YAWS as f32;
        (0..YAWS).map(|k| Quat::from_rotation_z(yaw(k)) * upright).collect()
    };
    let down = if rule == AttitudeRule::Alternate { Vec3::NEG_Z } else { Vec3::Z };
    [about(Vec3::Z), about(down)]
}

/// Fills the works layer by layer.
pub(crate) fn fill(
    site: &Site,
    pattern: &Pattern,
    stack: &mut Stack,
    observer: &dyn Observer,
) -> Result<Filled, PlanError> {
    let kind = site.main();
    let apart_m = 2.0 * (kind.settings.local_radius_m + kind.settings.window_m);
    let mut filled = Filled::default();
    let mut left = kind.stock.unwrap_or(u32::MAX) as usize;
    let mut done = 0_u64;
    observer.event(Event::Started { stage: Stage::Plan, total: 0 });
    for layer in 1..=pattern.layers {
        let nodes = pattern.nodes(stack, layer);
        let places: Vec<Vec2> = nodes.iter().map(|(_, at)| *at).collect();
        let before = done;
        for batch in batches::independent(&places, apart_m) {
            let mut open = batch.as_slice();
            while !open.is_empty() && left > 0 {
                if observer.cancelled() {
                    return Err(PlanError::Cancelled);
                }
                // No more at once than there are blocks left.
                let (now, later) = open.split_at(open.len().min(left));
                open = later;
                let serve = |&i: &usize| serve(kind, pattern, stack, nodes[i], layer);
                let found: Vec<(Vec<Placement>, f32)> = now.par_iter().map(serve).collect();
                for (placements, deficit_m3) in found {
                    for p in placements {
                        if p.state == PlacementState::Kept {
                            let block = InstanceId(stack.blocks.len() as u32 + 1);
                            let site_from_block = p.rest;
                            stack
                                .add(PlacedBlock { block, model: p.model, site_from_block }, layer);
                            (left, done) = (left - 1, done + 1);
                        }
                        filled.tried.push((p, deficit_m3));
                    }
                }
            }
            observer.event(Event::Advanced { stage: Stage::Plan, done });
        }
        if done == before {
            break;
        }
        warn_of_density(pattern, stack, layer, done - before, observer);
    }
    Ok(filled)
}

/// Tries one node that lacks volume.
fn serve(
    kind: &TypeToPlace,
    pattern: &Pattern,
    stack: &Stack,
    (node, at): (PatternNode, Vec2),
    layer: u32,
) -> (Vec<Placement>, f32) {
    let window = each_window::window_at(stack, at, kind.settings.window_m);
    let deficit_m3 = window.deficit_m3;
    if deficit_m3 <= kind.settings.minimum_volume_m3 || !kind.allowed.covers(at) {
        return (Vec::new(), deficit_m3);
    }
    let found = pattern.candidates(stack, kind, node, &window);
    let mut tried = search::best(kind, stack, &found, layer);
    tried.iter_mut().for_each(|p| p.handling.node = Some(node));
    (tried, deficit_m3)
}

/// Says where a layer does not reach the density asked for.
fn warn_of_density(
    pattern: &Pattern,
    stack: &Stack,
    layer: u32,
    blocks: u64,
    observer: &dyn Observer,
) {
    let Some(asked) = pattern.density_per_m2 else { return };
    let cells = stack.design.z_m.iter().filter(|z| z.is_finite()).count() as f32;
    let density = blocks as f32 / (cells * stack.design.cell_m * stack.design.cell_m);
    if density < NEAR_DENSITY * asked {
        let message = format!(
            "layer {layer} of the pattern has {blocks} blocks, {density:.3} on a square metre of the works instead of {asked:.3}: the other nodes lack less than plan.minimum_volume_m3, lie at the edge, or no block rests there"
        );
        observer.event(Event::Warned(Warning { stage: Stage::Plan, message }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block() -> BlockModel {
        blocks::shape_model("t", scene::Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap()
    }

    fn laid(config: &PatternConfig) -> Result<Pattern, PlanError> {
        let block = block();
        let settings = crate::PlanConfig::default().resolve(&block, block.d_max_m).unwrap();
        let boundary = vec![[0.0, 0.0], [20.0, 0.0], [20.0, 12.0], [0.0, 12.0]];
        let design = DesignSurface::Level { boundary, level_m: 2.0 };
        Pattern::new(config, &settings, &block, (&design, &SiteFrame::default()), SeedTree::new(1))
    }

    #[test]
    fn every_bond_has_the_density_asked_for() {
        for bond in [Bond::Rows, Bond::HalfBrick, Bond::Staggered] {
            let config = PatternConfig { bond, density_per_m2: Some(0.2), ..Default::default() };
            let pattern = laid(&config).unwrap();
            let of_a_node = pattern.spacing_m.x * pattern.spacing_m.y;
            assert!((1.0 / of_a_node - 0.2).abs() < 1e-4, "{bond:?}");
        }
    }

    #[test]
    fn rows_run_where_the_bearing_says_and_layers_lie_in_hollows() {
        let config = PatternConfig {
            bond: Bond::Staggered,
            spacing_m: Some([2.0, 1.732]),
            bearing_deg: 90.0,
            ..Default::default()
        };
        let pattern = laid(&config).unwrap();
        let at = |layer, row, column| pattern.place(PatternNode { layer, row, column });
        assert!((at(1, 1, 2) - at(1, 1, 1) - Vec2::new(2.0, 0.0)).length() < 1e-4, "east");
        assert!((at(1, 2, 1) - at(1, 1, 1) - Vec2::new(1.0, -1.732)).length() < 1e-3);
        let above = at(2, 1, 1);
        for below in [at(1, 1, 1), at(1, 1, 2), at(1, 2, 1)] {
            assert!(((above - below).length() - 1.1547).abs() < 0.01, "over a triangle's middle");
        }
    }

    #[test]
    fn a_pattern_that_cannot_be_is_named() {
        let said = |config: PatternConfig| laid(&config).err().unwrap().to_string();
        let wide = PatternConfig { spacing_m: Some([40.0, 2.0]), ..Default::default() };
        assert!(said(wide).contains("40"), "wider than the works");
        let both = PatternConfig {
            spacing_m: Some([2.0, 2.0]),
            density_per_m2: Some(0.2),
            ..Default::default()
        };
        assert!(said(both).contains("density_per_m2"));
        let none = PatternConfig { density_per_m2: Some(0.0), ..Default::default() };
        assert!(said(none).contains("above 0"));
        let nowhere = PatternConfig { layers: Some(0), ..Default::default() };
        assert!(said(nowhere).contains("layers"));
    }
}
