//! A block as the engine collides it: one hull a convex part, mass and inertia of the true solid.

use crate::SimError;
use geom::{Mat3, Vec3};
use rapier3d::math::Matrix;
use rapier3d::prelude::{MassProperties, SharedShape};
use scene::BlockModel;
use std::sync::Arc;

/// A block model prepared for the engine. Cloning is cheap; one serves any number of worlds and threads.
#[derive(Clone)]
pub struct BlockShape {
    pub(crate) hulls: Arc<[SharedShape]>,
    pub(crate) mass: MassProperties,
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
        let mass_kg = model.mass_kg();
        if !(mass_kg > 0.0 && mass_kg.is_finite()) {
            return Err(SimError::NoMass { name: name(), mass_kg });
        }
        let hulls = model
            .parts
            .iter()
            .enumerate()
            .map(|(part, p)| {
                SharedShape::convex_hull(&p.corners).ok_or_else(|| SimError::FlatPart { name: name(), part })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let moments = model.mesh.moments();
        let covariance = moments.covariance_m5 * model.density_kg_m3;
        // Inertia tensor from the covariance integral: I = tr(C)·1 − C.
        let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
        let inertia: Matrix = Mat3::from_diagonal(Vec3::splat(trace)) - covariance;
        let centre = moments.centroid;
        let reach_m = model.mesh.vertices.iter().map(|v| (*v - centre).length()).fold(0.0, f32::max);
        Ok(Self { hulls: hulls.into(), mass: MassProperties::with_inertia_matrix(centre, mass_kg, inertia), reach_m })
    }

    /// Number of convex hulls.
    pub fn hull_count(&self) -> usize {
        self.hulls.len()
    }

    /// Largest distance from the centre of mass to the surface, metres.
    pub fn reach_m(&self) -> f32 {
        self.reach_m
    }
}
