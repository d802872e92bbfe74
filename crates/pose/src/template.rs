//! What is prepared once for each block type: its distance field, even samples of its surface, its rotations.

use crate::beyond::{edge_share, has_flat_faces};
use crate::thesis::PairTable;
use crate::twins::Twin;
use crate::{Method, PoseConfig, PoseError, rotation_grid::rotation_grid};
use geom::{DistanceField, PointGrid, Quat, SeedTree, Vec3};
use rand::RngExt;
use scene::{BlockModel, Catalog, ModelId};
use std::sync::OnceLock;

/// A block type ready to be searched for.
pub struct Template<'a> {
    /// Its id.
    pub id: ModelId,
    /// The model itself.
    pub model: &'a BlockModel,
    /// Signed distance, block coordinates.
    pub field: DistanceField,
    /// Even samples of the outside and their outward normals, block coordinates.
    pub surface: Vec<(Vec3, Vec3)>,
    /// Many samples of the outside, for questions of a few centimetres; empty with one type.
    pub dense_surface: Vec<(Vec3, Vec3)>,
    /// Even samples of the inside, deepest_m, block coordinates: two blocks that share some share a place.
    pub inside: Vec<Vec3>,
    /// How deep the deepest of them lies below the surface, metres: half the thickness of a shell.
    pub deepest_m: f32,
    /// Area one sample of `surface` stands for, m².
    pub sample_area_m2: f32,
    /// Point pair features, when they are asked for.
    pub pairs: Option<PairTable>,
    /// Sampled surface for ICP, when it is asked for.
    pub cloud: Option<ModelCloud>,
    /// Whether it is made of a few flat faces.
    pub flat_faces: bool,
    /// Share of its surface at edges where a face ends; 0 where it has no flat faces.
    pub edge_share: f32,
    /// Starts of the rotation search, one per physical orientation.
    pub rotations: Vec<Quat>,
    /// Whether it and its mirror image are two shapes; found when it is first asked.
    pub handed: OnceLock<bool>,
    /// Poses in which it looks much the same; found when they are first asked for.
    pub twins: OnceLock<Vec<Twin>>,
}

/// A model as the points ICP pairs with, block coordinates.
pub struct ModelCloud {
    /// Points and outward normals.
    pub points: Vec<(Vec3, Vec3)>,
    /// Who is near a place.
    pub grid: PointGrid,
}

/// Points whose pairs are hashed.
const PAIR_POINTS: usize = 300;
/// Points of a [`ModelCloud`].
const CLOUD: usize = 4000;
/// Samples of a model's inside.
const INSIDE: usize = 200;
/// Types whose fields are as fine as asked for; with more, all are coarser.
const FULL_FIELDS: usize = 10;
/// Samples that tell types apart.
const DENSE: usize = 8000;

/// Prepares all types. Errors: [`PoseError::NoModels`], [`PoseError::Mesh`].
pub fn templates<'a>(
    catalog: &'a Catalog,
    config: &PoseConfig,
    seed: SeedTree,
) -> Result<Vec<Template<'a>>, PoseError> {
    if catalog.is_empty() {
        return Err(PoseError::NoModels);
    }
    let dense = if catalog.len() > 1 { DENSE } else { 0 };
    let cells = field_cells(config.search.field_cells, catalog.len());
    // In an order of their own: a catalogue is the same catalogue with its entries in another order.
    let mut entries: Vec<(ModelId, &BlockModel)> = catalog.iter().collect();
    entries.sort_by(|a, b| a.1.name.cmp(&b.1.name));
    let of = |(id, model): (ModelId, &'a BlockModel)| {
        template(id, model, cells, dense, config, seed.child(&model.name, 0))
    };
    entries.into_iter().map(of).collect()
}

/// Cells along the longest edge of each field, so that the fields of many types take no more memory than those of
/// [`FULL_FIELDS`].
fn field_cells(wanted: usize, types: usize) -> usize {
    let share = (FULL_FIELDS as f32 / types as f32).min(1.0);
    (wanted as f32 * share.cbrt()) as usize
}

fn template<'a>(
    id: ModelId,
    model: &'a BlockModel,
    cells: usize,
    dense: usize,
    config: &PoseConfig,
    seed: SeedTree,
) -> Result<Template<'a>, PoseError> {
    let named = |source| PoseError::Mesh { name: model.name.clone(), source };
    model.mesh.check_solid().map_err(named)?;
    let margin_m = 0.3 * model.d_max_m;
    let field = DistanceField::new(&model.mesh, cells, margin_m).map_err(named)?;
    let surface = even_surface(model, config.evidence.surface_samples, seed.child("surface", 0));
    let dense_surface = model.mesh.sample_surface(dense, &mut seed.child("dense", 0).rng());
    let thesis = config.method == Method::Ppf || config.ppf_hypotheses;
    let pairs = thesis.then(|| {
        let few = even_surface(model, PAIR_POINTS, seed.child("pairs", 0));
        PairTable::new(few, 2.0 * model.d_max_m, &config.ppf)
    });
    let cloud = thesis.then(|| {
        let points = model.mesh.sample_surface(CLOUD, &mut seed.child("cloud", 0).rng());
        let position: Vec<Vec3> = points.iter().map(|p| p.0).collect();
        ModelCloud { grid: PointGrid::new(&position, 0.08 * model.d_max_m), points }
    });
    let sample_area_m2 = model.mesh.area_m2() / surface.len().max(1) as f32;
    let rotations = rotation_grid(
        &model.symmetry,
        config.search.rotation_spacing_rad,
        config.search.max_rotations,
    );
    let flat_faces = has_flat_faces(&surface);
    let edges = seed.child("edges", 0);
    let edge_share = if flat_faces { edge_share(model, &field, edges) } else { 0.0 };
    let inside = inside(model, &field, seed.child("inside", 0));
    let deepest_m = inside.iter().map(|&p| -field.distance_m(p)).fold(0.0, f32::max);
    Ok(Template {
        id,
        model,
        field,
        surface,
        inside,
        deepest_m,
        dense_surface,
        sample_area_m2,
        pairs,
        cloud,
        flat_faces,
        edge_share,
        rotations,
        handed: OnceLock::new(),
        twins: OnceLock::new(),
    })
}

/// Random places inside the solid; thin shells give fewer.
fn inside(model: &BlockModel, field: &DistanceField, seed: SeedTree) -> Vec<Vec3> {
    let bounds = model.mesh.bounds();
    let mut rng = seed.rng();
    let mut draw =
        || bounds.min + bounds.size() * Vec3::new(rng.random(), rng.random(), rng.random());
    (0..100 * INSIDE).map(|_| draw()).filter(|&p| field.distance_m(p) < 0.0).take(INSIDE).collect()
}

/// Surface samples thinned from a dense draw by farthest-first order, so that no leg is short of them.
fn even_surface(model: &BlockModel, count: usize, seed: SeedTree) -> Vec<(Vec3, Vec3)> {
    let dense = model.mesh.sample_surface(count * 6, &mut seed.rng());
    let mut far = vec![f32::INFINITY; dense.len()];
    let mut picked = Vec::with_capacity(count);
    let mut next = 0;
    while picked.len() < count.min(dense.len()) {
        let p = dense[next].0;
        picked.push(dense[next]);
        let mut best = (0.0, 0);
        for (i, (q, _)) in dense.iter().enumerate() {
            far[i] = far[i].min((*q - p).length_squared());
            if far[i] > best.0 {
                best = (far[i], i);
            }
        }
        next = best.1;
    }
    picked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_types_share_the_memory_of_a_few() {
        assert_eq!(field_cells(96, 1), 96);
        assert_eq!(field_cells(96, FULL_FIELDS), 96);
        for types in [11, 20, 200] {
            let cells = field_cells(96, types);
            assert!(
                types * cells.pow(3) <= FULL_FIELDS * 96_usize.pow(3),
                "{types} types, {cells} cells"
            );
        }
    }
}
