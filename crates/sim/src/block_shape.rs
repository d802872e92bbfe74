//! A block as the engine collides it: one hull a convex part, mass and inertia of the true solid.
//!
//! Hulls are kept in the block's own length unit and scaled to that of the world, if it differs.

use crate::SimError;
use crate::config::unit_for;
use geom::{Mat3, Vec3};
use rapier3d::prelude::{MassProperties, SharedShape};
use scene::{BlockModel, MOST_PARTS_ERROR};
use std::sync::Arc;

/// A block model prepared for the engine. Cloning is cheap; one serves any number of worlds and threads.
#[derive(Clone)]
pub struct BlockShape {
    hulls: Arc<[SharedShape]>,
    /// Metres in one unit of the hulls.
    unit_m: f32,
    mass_kg: f32,
    centre: Vec3,
    inertia_kg_m2: Mat3,
    reach_m: f32,
}

impl BlockShape {
    /// Builds the hulls of the model's convex parts.
    ///
    /// Mass, centre of mass and inertia come from the mesh and the density, not from the hulls, which may overlap.
    pub fn new(model: &BlockModel) -> Result<Self, SimError> {
        let name = || model.name.clone();
        if model.parts.is_empty() {
            return Err(SimError::NoParts { name: name() });
        }
        if model.parts_error() > MOST_PARTS_ERROR {
            return Err(SimError::LooseParts {
                name: name(),
                parts: model.parts.len(),
                percent: 100.0 * model.parts_volume_ratio,
                most: 100.0 * MOST_PARTS_ERROR,
            });
        }
        let mass_kg = model.mass_kg();
        if !(mass_kg > 0.0 && mass_kg.is_finite()) {
            return Err(SimError::NoMass { name: name(), mass_kg });
        }
        let unit_m = unit_for(model.d_box_m);
        let hulls = model
            .parts
            .iter()
            .enumerate()
            .map(|(part, p)| {
                let corners: Vec<Vec3> = p.corners.iter().map(|&c| c / unit_m).collect();
                SharedShape::convex_hull(&corners)
                    .ok_or_else(|| SimError::FlatPart { name: name(), part })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let moments = model.mesh.moments();
        let covariance = moments.covariance_m5 * model.density_kg_m3;
        // Inertia tensor from the covariance integral: I = tr(C)·1 − C.
        let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
        let inertia_kg_m2 = Mat3::from_diagonal(Vec3::splat(trace)) - covariance;
        let centre = moments.centroid;
        let reach_m =
            model.mesh.vertices.iter().map(|v| (*v - centre).length()).fold(0.0, f32::max);
        Ok(Self { hulls: hulls.into(), unit_m, mass_kg, centre, inertia_kg_m2, reach_m })
    }

    /// Number of convex hulls.
    pub fn hull_count(&self) -> usize {
        self.hulls.len()
    }

    /// Largest distance from the centre of mass to the surface, metres.
    pub fn reach_m(&self) -> f32 {
        self.reach_m
    }

    /// Centre of mass, block coordinates, metres.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// The hulls in a world where `unit_m` is 1.
    pub(crate) fn hulls_in(&self, unit_m: f32) -> Arc<[SharedShape]> {
        let factor = self.unit_m / unit_m;
        if factor == 1.0 {
            return self.hulls.clone();
        }
        let scale = |hull: &SharedShape| {
            let polyhedron =
                hull.as_convex_polyhedron().cloned().and_then(|p| p.scaled(Vec3::splat(factor)));
            SharedShape::new(polyhedron.expect("a hull stays a hull when scaled evenly"))
        };
        self.hulls.iter().map(scale).collect()
    }

    /// Mass, centre of mass and inertia in a world where `unit_m` is 1.
    pub(crate) fn mass_in(&self, unit_m: f32) -> MassProperties {
        let inertia = self.inertia_kg_m2 * (1.0 / (unit_m * unit_m));
        MassProperties::with_inertia_matrix(self.centre / unit_m, self.mass_kg, inertia)
    }
}
