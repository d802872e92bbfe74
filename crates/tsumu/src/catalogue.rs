//! Block types and the meshes they name.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use geom::{Event, Observer, Stage, TriMesh};
use scene::{BlockModel, Catalog, CatalogSpec};
use std::collections::BTreeMap;
use std::path::Path;
use synth::Recipe;

/// A recipe is a page of text.
const MOST_BYTES: u64 = 16 << 20;

/// Reads `catalog.toml` and the meshes it names.
pub fn read(file: &Path, observer: &dyn Observer) -> Result<Catalog> {
    let spec = io::site::load_catalog(file).or_bad_input()?;
    models(&spec, file, observer)
}

/// The models of a catalogue whose meshes lie beside `file`.
pub(crate) fn models(spec: &CatalogSpec, file: &Path, observer: &dyn Observer) -> Result<Catalog> {
    models_with(spec, &BTreeMap::new(), Some(file), observer)
}

/// The models of a catalogue; meshes in memory count before those beside `file`.
pub(crate) fn models_with(
    spec: &CatalogSpec,
    meshes: &BTreeMap<String, TriMesh>,
    file: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Catalog> {
    let load = |mesh: &Path| match (meshes.get(mesh.to_string_lossy().as_ref()), file) {
        (Some(found), _) => Ok(found.clone()),
        (None, Some(file)) => io::site::mesh_loader_telling(file, observer)(mesh),
        (None, None) => Err(format!("the mesh `{}` was not given", mesh.display())),
    };
    let named = file.map_or("catalog".to_string(), |file| file.display().to_string());
    let catalog =
        blocks::catalog(spec, &load).map_err(|e| Error::bad_input(anyhow!(e).context(named)))?;
    for warning in blocks::warnings(&catalog) {
        observer.event(Event::Warned(warning));
    }
    for (_, model) in catalog.iter() {
        observer.event(Event::Noted { stage: Stage::Catalogue, message: describe(model) });
    }
    Ok(catalog)
}

/// What an engineer checks against the drawing.
fn describe(model: &BlockModel) -> String {
    let c = model.centre;
    format!(
        "{}: {:.4} m³, {:.1} kg, largest edge {:.3} m, centre of mass ({:.3}, {:.3}, {:.3}) m, {} rotations map it onto itself, {} convex parts of {:.1} % of its volume",
        model.name,
        model.volume_m3,
        model.mass_kg(),
        model.d_box_m,
        c.x,
        c.y,
        c.z,
        model.symmetry.order(),
        model.parts.len(),
        100.0 * model.parts_volume_ratio
    )
}

/// A recipe of synthetic piles with its blocks.
pub struct RecipeInputs {
    /// The recipe.
    pub recipe: Recipe,
    /// Its block types as written.
    pub spec: CatalogSpec,
    /// The same as models.
    pub catalog: Catalog,
    /// The file that names them: meshes lie beside it.
    pub(crate) catalog_file: std::path::PathBuf,
}

/// Reads a recipe and the blocks that it, or the catalogue file if one is given, names.
pub fn read_recipe(
    file: &Path,
    catalog: Option<&Path>,
    observer: &dyn Observer,
) -> Result<RecipeInputs> {
    let named = || file.display().to_string();
    let text = io::read_text(file, MOST_BYTES).or_bad_input()?;
    let recipe = Recipe::parse(&text).with_context(named).or_bad_input()?;
    recipe.check().with_context(named).or_bad_input()?;
    let (catalog_file, spec) = match (catalog, &recipe.catalog) {
        (Some(file), _) => (file, io::site::load_catalog(file).or_bad_input()?),
        (None, Some(spec)) => (file, spec.clone()),
        (None, None) => {
            return Err(Error::bad_input(anyhow!(
                "{}: has no [[catalog.block]]; add one or give --catalog FILE",
                file.display()
            )));
        }
    };
    let models = models(&spec, catalog_file, observer)?;
    recipe.check_with(&models).with_context(named).or_bad_input()?;
    Ok(RecipeInputs { recipe, spec, catalog: models, catalog_file: catalog_file.into() })
}
