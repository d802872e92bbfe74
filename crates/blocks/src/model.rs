//! Assembles a [`BlockModel`] from a shape or a mesh.

use crate::convex_parts::{ConvexConfig, convex_parts};
use crate::symmetry::{SymmetryConfig, find_symmetry};
use crate::{
    BlockError, antifer, bin_parts, dolos, frustum::square_frustum, interlocking, rotation_group,
    tetrapod,
};
use geom::{MeshError, Stage, TriMesh, Warning};
use scene::{
    BlockModel, BlockSpec, Catalog, CatalogSpec, ConvexPart, MOST_PARTS_ERROR, Shape,
    SymmetryGroup, check_name,
};
use std::ops::RangeInclusive;
use std::path::Path;

/// Edges a block may have: from a screw to a caisson. Far beyond, f32 loses the shape, and a unit was mistaken.
const SIZES_M: RangeInclusive<f32> = 1e-3..=100.0;
/// Densities a block may have: from cork to beyond osmium.
const DENSITIES_KG_M3: RangeInclusive<f32> = 10.0..=30_000.0;
/// Types a catalogue may hold; each costs a distance field of some 4 MB and a search of every place.
const MOST_TYPES: usize = 100;

/// The whole catalogue; `load_mesh` reads a mesh file given as the catalogue writes it, in the file's unit.
pub fn catalog(
    spec: &CatalogSpec,
    load_mesh: &dyn Fn(&Path) -> Result<TriMesh, String>,
) -> Result<Catalog, BlockError> {
    if spec.block.is_empty() {
        return Err(BlockError::NoBlocks);
    }
    if spec.block.len() > MOST_TYPES {
        return Err(BlockError::TooManyTypes { types: spec.block.len(), limit: MOST_TYPES });
    }
    for (i, block) in spec.block.iter().enumerate() {
        check_name(format!("catalogue: the name of block {}", i + 1), &block.name)?;
        // Names that differ by blanks at their ends look the same in every table.
        if spec.block[..i].iter().any(|b| b.name.trim() == block.name.trim()) {
            return Err(BlockError::Duplicate { name: block.name.clone() });
        }
    }
    let models = spec.block.iter().map(|b| model(b, load_mesh)).collect::<Result<_, _>>()?;
    Ok(Catalog::new(models))
}

fn model(
    spec: &BlockSpec,
    load_mesh: &dyn Fn(&Path) -> Result<TriMesh, String>,
) -> Result<BlockModel, BlockError> {
    match (&spec.shape, &spec.mesh) {
        (Some(shape), None) => shape_model(&spec.name, *shape, spec.density_kg_m3),
        (None, Some(path)) => {
            let unit = spec.unit.ok_or_else(|| BlockError::NoUnit { name: spec.name.clone() })?;
            let read = load_mesh(path)
                .map_err(|message| BlockError::Read { name: spec.name.clone(), message })?;
            mesh_model(&spec.name, &read.map(|v| v * unit.metres()), spec.density_kg_m3)
        }
        _ => Err(BlockError::ShapeOrMesh { name: spec.name.clone() }),
    }
}

/// A mesh in metres as a block: welded, checked, turned to face outwards; its parts and symmetry are found.
pub fn mesh_model(
    name: &str,
    mesh: &TriMesh,
    density_kg_m3: f32,
) -> Result<BlockModel, BlockError> {
    let wrong = |source| BlockError::Mesh { name: name.into(), source };
    let mesh = closed(mesh).map_err(wrong)?;
    if let Some(sides) = geom::shells_in_each_other(&mesh) {
        return Err(BlockError::Shells { name: name.into(), sides });
    }
    let (parts, ratio) = convex_parts(&mesh, &ConvexConfig::default());
    let symmetry = find_symmetry(&mesh, &SymmetryConfig::default()).map_err(wrong)?;
    assemble(name, mesh, parts, ratio, symmetry, density_kg_m3)
}

/// The mesh as a solid that faces outwards. STL repeats each corner, sometimes rounded: corners are joined within
/// a millionth of the size first, then more, up to a ten-thousandth, and the least that closes the mesh is used.
fn closed(mesh: &TriMesh) -> Result<TriMesh, MeshError> {
    let size = mesh.bounds().size().max_element();
    if !size.is_finite() || mesh.vertices.iter().any(|v| !v.is_finite()) {
        // Names the vertex, or the empty mesh.
        mesh.check_solid()?;
    }
    let mut first_error = None;
    for share in [1e-6, 1e-5, 1e-4] {
        let solid = mesh.welded(size * share).without_doubles();
        match solid.check_solid() {
            Ok(()) if solid.moments().volume_m3 < 0.0 => return Ok(solid.flipped()),
            Ok(()) => return Ok(solid),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    Err(first_error.expect("the loop ran"))
}

/// What the user should know of a catalogue before it is used.
pub fn warnings(catalog: &Catalog) -> Vec<Warning> {
    let off = |m: &&BlockModel| m.parts_error() > 0.5 * MOST_PARTS_ERROR;
    let said = |m: &BlockModel| {
        let consequence = if m.parts_error() > MOST_PARTS_ERROR {
            "too far off to make piles of it or to plan with it, but it can be recognised"
        } else {
            "piles of it will stand a little too high or too low, and nothing can reach into its hollows"
        };
        let (count, percent) = (m.parts.len(), m.parts_volume_ratio * 100.0);
        format!(
            "block `{}`: the {count} convex parts physics uses take {percent:.0} % of the mesh's volume: {consequence}",
            m.name
        )
    };
    let warning = |m| Warning { stage: Stage::Catalogue, message: said(m) };
    catalog.iter().map(|(_, m)| m).filter(off).map(warning).collect()
}

/// A built-in shape as a block.
pub fn shape_model(name: &str, shape: Shape, density_kg_m3: f32) -> Result<BlockModel, BlockError> {
    let size = shape.size_m();
    if !SIZES_M.contains(&size) {
        return Err(BlockError::BadSize { name: name.into(), size });
    }
    let (mesh, parts, rotations) = match shape {
        Shape::Tetrapod { size } => {
            let (mesh, parts) = tetrapod::tetrapod(size);
            (mesh, parts, rotation_group::tetrahedral(&tetrapod::leg_axes()))
        }
        Shape::Dolos { size } => {
            let (mesh, parts) = dolos::dolos(size);
            (mesh, parts, dolos::rotations())
        }
        Shape::Cube { size } => {
            let (mesh, parts) = square_frustum(size, size, size);
            (mesh, parts, rotation_group::octahedral())
        }
        Shape::Antifer { size } => {
            let (mesh, parts) = antifer::antifer(size);
            (mesh, parts, rotation_group::cyclic_z(4))
        }
        Shape::CoreLocLike { size } => interlocking::core_loc_like(size),
        Shape::XblocLike { size } => interlocking::xbloc_like(size),
        Shape::AccropodeLike { size } => interlocking::accropode_like(size),
        Shape::SixLegLike { size } => interlocking::six_leg_like(size),
        Shape::HollowTetrahedronLike { size } => interlocking::hollow_tetrahedron_like(size),
        Shape::EyeBolt { size } => bin_parts::eye_bolt(size),
        Shape::GearShaft { size } => bin_parts::gear_shaft(size),
        Shape::HoledPlate { size } => bin_parts::holed_plate(size),
        Shape::HookPlate { size } => bin_parts::hook_plate(size),
        Shape::Bracket { size } => bin_parts::bracket(size),
    };
    let symmetry = SymmetryGroup::new(mesh.moments().centroid, rotations);
    assemble(name, mesh, parts, 1.0, symmetry, density_kg_m3)
}

/// A block of one type from its checked ingredients.
pub(crate) fn assemble(
    name: &str,
    mesh: TriMesh,
    parts: Vec<ConvexPart>,
    parts_volume_ratio: f32,
    symmetry: SymmetryGroup,
    density_kg_m3: f32,
) -> Result<BlockModel, BlockError> {
    if !DENSITIES_KG_M3.contains(&density_kg_m3) {
        return Err(BlockError::BadDensity { name: name.into(), density: density_kg_m3 });
    }
    let edge_m = mesh.bounds().size().max_element();
    if edge_m.is_finite() && !SIZES_M.contains(&edge_m) {
        return Err(BlockError::BadSize { name: name.into(), size: edge_m });
    }
    mesh.check_solid().map_err(|source| BlockError::Mesh { name: name.into(), source })?;
    let moments = mesh.moments();
    let centre = moments.centroid;
    let d_max_m = mesh.vertices.iter().map(|v| (*v - centre).length()).fold(0.0, f32::max);
    Ok(BlockModel {
        name: name.into(),
        d_box_m: mesh.bounds().size().max_element(),
        symmetry,
        volume_m3: moments.volume_m3,
        mesh,
        parts,
        parts_volume_ratio,
        density_kg_m3,
        centre,
        d_max_m,
    })
}
