//! Places on a block's surface, evenly by area, the same for every call.

use geom::{Pose, SeedTree, Vec3};
use scene::{BlockModel, Catalog, ModelId};

/// Samples of one model, block coordinates.
pub(crate) struct Samples {
    pub position: Vec<Vec3>,
    pub normal: Vec<Vec3>,
    /// Surface that one sample stands for, m².
    pub area_m2: f32,
}

impl Samples {
    fn of(model: &BlockModel, count: usize) -> Self {
        let mut rng = SeedTree::new(0).child("surface", 0).rng();
        let (position, normal) = model.mesh.sample_surface(count, &mut rng).into_iter().unzip();
        Self { position, normal, area_m2: model.mesh.area_m2() / count as f32 }
    }

    /// Position and normal of every sample of a posed block.
    pub fn posed(&self, pose: Pose) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        let both = self.position.iter().zip(&self.normal);
        both.map(move |(p, n)| (pose.transform_point(*p), pose.rotation * *n))
    }
}

/// Samples of every model, by number.
pub(crate) fn samples(catalog: &Catalog, count: usize) -> Vec<Samples> {
    catalog.iter().map(|(_, model)| Samples::of(model, count)).collect()
}

/// Those of a block's model.
pub(crate) fn of(samples: &[Samples], model: ModelId) -> &Samples {
    &samples[model.0 as usize]
}
