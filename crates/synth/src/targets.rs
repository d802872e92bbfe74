//! All surfaces of a scene as world triangles that know their block, and dense points on them.

use geom::{Bounds, SeedTree, TriMesh, Vec3};
use scene::{Catalog, Scene};

/// World triangles with their owner: 0 the bed, k block k.
pub(crate) struct Targets {
    pub corners: Vec<[Vec3; 3]>,
    pub normal: Vec<Vec3>,
    pub owner: Vec<u32>,
    pub bounds: Bounds,
    meshes: Vec<TriMesh>,
    area_m2: Vec<f32>,
}

/// Points on the surfaces, uniform by area.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfacePoints {
    pub position: Vec<Vec3>,
    pub normal: Vec<Vec3>,
    pub owner: Vec<u32>,
}

impl Targets {
    /// Surfaces of the blocks and of what they lie in.
    pub fn new(scene: &Scene, catalog: &Catalog, ground: TriMesh) -> Self {
        let block = |b: &scene::PlacedBlock| {
            catalog.get(b.model).mesh.map(|v| b.site_from_block.transform_point(v))
        };
        let meshes: Vec<TriMesh> =
            std::iter::once(ground).chain(scene.blocks.iter().map(block)).collect();
        let (mut corners, mut normal, mut owner) = (Vec::new(), Vec::new(), Vec::new());
        for (k, mesh) in meshes.iter().enumerate() {
            for t in 0..mesh.triangles.len() {
                corners.push(mesh.corners(t));
                normal.push(mesh.triangle_normal(t));
                owner.push(k as u32);
            }
        }
        let bounds = Bounds::of(meshes.iter().flat_map(|m| m.vertices.iter().copied()));
        let area_m2 = meshes.iter().map(TriMesh::area_m2).collect();
        Self { corners, normal, owner, bounds, meshes, area_m2 }
    }

    /// Number of blocks.
    pub fn block_count(&self) -> usize {
        self.meshes.len() - 1
    }

    /// Whole surface, m².
    pub fn area_m2(&self) -> f32 {
        self.area_m2.iter().sum()
    }

    /// `per_m2` points a square metre on every surface; each surface draws from its own stream.
    pub fn sample(&self, per_m2: f32, seed: SeedTree) -> SurfacePoints {
        let mut points = SurfacePoints::default();
        for (k, mesh) in self.meshes.iter().enumerate() {
            let count = (self.area_m2[k] * per_m2).round() as usize;
            for (p, n) in mesh.sample_surface(count, &mut seed.child("surface", k as u64).rng()) {
                points.position.push(p);
                points.normal.push(n);
                points.owner.push(k as u32);
            }
        }
        points
    }
}

impl SurfacePoints {
    /// Appends the points of `other`.
    pub fn append(&mut self, mut other: Self) {
        self.position.append(&mut other.position);
        self.normal.append(&mut other.normal);
        self.owner.append(&mut other.owner);
    }
}
