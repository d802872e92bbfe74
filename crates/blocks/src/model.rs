//! Assembles a [`BlockModel`] from a shape or a mesh.

use crate::{BlockError, frustum::square_frustum, rotation_group, tetrapod};
use geom::{Quat, TriMesh};
use scene::{BlockModel, BlockSpec, Catalog, CatalogSpec, ConvexPart, Shape, SymmetryGroup};
use std::path::Path;

/// The whole catalogue; `load_mesh` reads a mesh file given as the catalogue writes it, in the file's unit.
pub fn catalog(
    spec: &CatalogSpec,
    load_mesh: &dyn Fn(&Path) -> Result<TriMesh, String>,
) -> Result<Catalog, BlockError> {
    if spec.block.is_empty() {
        return Err(BlockError::NoBlocks);
    }
    for (i, block) in spec.block.iter().enumerate() {
        if spec.block[..i].iter().any(|b| b.name == block.name) {
            return Err(BlockError::Duplicate { name: block.name.clone() });
        }
    }
    let models = spec.block.iter().map(|b| model(b, load_mesh)).collect::<Result<_, _>>()?;
    Ok(Catalog::new(models))
}

fn model(spec: &BlockSpec, _load_mesh: &dyn Fn(&Path) -> Result<TriMesh, String>) -> Result<BlockModel, BlockError> {
    match (&spec.shape, &spec.mesh) {
        (Some(shape), None) => shape_model(&spec.name, *shape, spec.density_kg_m3),
        (None, Some(_)) => Err(BlockError::Unsupported { name: spec.name.clone(), what: "meshes are not read yet" }),
        _ => Err(BlockError::ShapeOrMesh { name: spec.name.clone() }),
    }
}

/// A built-in shape as a block.
pub fn shape_model(name: &str, shape: Shape, density_kg_m3: f32) -> Result<BlockModel, BlockError> {
    let size = match shape {
        Shape::Tetrapod { size } | Shape::Dolos { size } | Shape::Cube { size } | Shape::Antifer { size } => size,
    };
    if !(size > 0.0 && size.is_finite()) {
        return Err(BlockError::BadSize { name: name.into(), size });
    }
    let (mesh, parts, rotations) = match shape {
        Shape::Tetrapod { size } => {
            let (mesh, parts) = tetrapod::tetrapod(size);
            (mesh, parts, rotation_group::tetrahedral(&tetrapod::leg_axes()))
        }
        Shape::Cube { size } => {
            let (mesh, parts) = square_frustum(size, size, size);
            (mesh, parts, rotation_group::octahedral())
        }
        Shape::Antifer { size } => {
            let (mesh, parts) = square_frustum(size, 1.086 * size, 1.005 * size);
            (mesh, parts, rotation_group::cyclic_z(4))
        }
        Shape::Dolos { .. } => {
            return Err(BlockError::Unsupported { name: name.into(), what: "the dolos is not built in yet" });
        }
    };
    assemble(name, mesh, parts, 1.0, rotations, density_kg_m3)
}

fn assemble(
    name: &str,
    mesh: TriMesh,
    parts: Vec<ConvexPart>,
    parts_volume_ratio: f32,
    rotations: Vec<Quat>,
    density_kg_m3: f32,
) -> Result<BlockModel, BlockError> {
    if !(density_kg_m3 > 0.0 && density_kg_m3.is_finite()) {
        return Err(BlockError::BadDensity { name: name.into(), density: density_kg_m3 });
    }
    mesh.check_solid().map_err(|source| BlockError::Mesh { name: name.into(), source })?;
    let moments = mesh.moments();
    let centre = moments.centroid;
    let d_max_m = mesh.vertices.iter().map(|v| (*v - centre).length()).fold(0.0, f32::max);
    Ok(BlockModel {
        name: name.into(),
        d_box_m: mesh.bounds().size().max_element(),
        symmetry: SymmetryGroup::new(centre, rotations),
        volume_m3: moments.volume_m3,
        mesh,
        parts,
        parts_volume_ratio,
        density_kg_m3,
        centre,
        d_max_m,
    })
}
