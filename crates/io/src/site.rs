//! A site folder: `site.toml`, `catalog.toml` and the files they name, none of them outside the folder.

use crate::input::Input;
use crate::{IoError, Place};
use scene::{CatalogSpec, SiteSpec};
use serde::de::DeserializeOwned;
use std::path::{Component, Path, PathBuf};

const TOML_LIMIT: u64 = 64 << 20;

/// A site as its folder states it; the paths exist and lie inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// The folder.
    pub folder: PathBuf,
    /// `site.toml`.
    pub spec: SiteSpec,
    /// The catalogue file's path.
    pub catalog_file: PathBuf,
    /// The catalogue.
    pub catalog: CatalogSpec,
    /// Paths of the surveys, in the order of `spec.survey`.
    pub survey_files: Vec<PathBuf>,
    /// Path of the design, when it is a file.
    pub design_file: Option<PathBuf>,
}

impl Site {
    /// Every file the site consists of, relative to its folder, in a fixed order: what a manifest lists as inputs.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let mut all = vec![PathBuf::from("site.toml"), self.spec.catalog.clone()];
        all.extend(self.spec.survey.iter().map(|s| s.file.clone()));
        all.extend(self.spec.design_file.iter().map(|d| d.file.clone()));
        let beside = self.spec.catalog.parent().unwrap_or(Path::new(""));
        all.extend(
            self.catalog.block.iter().filter_map(|b| b.mesh.as_ref()).map(|m| beside.join(m)),
        );
        all.sort();
        all.dedup();
        all
    }
}

/// Reads `folder/site.toml` (or the file itself) and its catalogue, checks both and finds the files they name.
pub fn load(folder_or_file: &Path) -> Result<Site, IoError> {
    let file = if folder_or_file.is_dir() {
        folder_or_file.join("site.toml")
    } else {
        folder_or_file.to_path_buf()
    };
    let spec: SiteSpec = read_toml(&file)?;
    spec.check().map_err(|e| IoError::malformed(&file, Place::File, e.to_string()))?;
    let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
    let catalog_file = resolve(&file, "catalog", &spec.catalog)?;
    let catalog = load_catalog(&catalog_file)?;
    let survey = |s: &scene::SurveySpec| resolve(&file, "survey.file", &s.file);
    let survey_files = spec.survey.iter().map(survey).collect::<Result<_, _>>()?;
    let design_file = spec
        .design_file
        .as_ref()
        .map(|d| resolve(&file, "design_file.file", &d.file))
        .transpose()?;
    Ok(Site { folder, spec, catalog_file, catalog, survey_files, design_file })
}

/// Reads a catalogue; its mesh files must lie in its folder.
pub fn load_catalog(file: &Path) -> Result<CatalogSpec, IoError> {
    let spec: CatalogSpec = read_toml(file)?;
    for mesh in spec.block.iter().filter_map(|b| b.mesh.as_ref()) {
        resolve(file, "mesh", mesh)?;
    }
    Ok(spec)
}

/// What `blocks::catalog` needs to load the meshes that this catalogue file names.
pub fn mesh_loader(catalog_file: &Path) -> impl Fn(&Path) -> Result<geom::TriMesh, String> {
    let catalog_file = catalog_file.to_path_buf();
    move |mesh| {
        let path = resolve(&catalog_file, "mesh", mesh).map_err(|e| e.to_string())?;
        crate::mesh::read(&path).map_err(|e| e.to_string())
    }
}

/// The file that `target` names beside `file`. It must exist, and neither `..` nor a link may lead out of the folder.
pub fn resolve(file: &Path, key: &str, target: &Path) -> Result<PathBuf, IoError> {
    let outside = || IoError::Outside { path: file.into(), key: key.into(), target: target.into() };
    if !target.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
        return Err(outside());
    }
    let folder = match file.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let path = folder.join(target);
    let real = |p: &Path| p.canonicalize().map_err(|e| IoError::read(p, e));
    if !real(&path)?.starts_with(real(folder)?) {
        return Err(outside());
    }
    Ok(path)
}

/// Reads a TOML file into a type; unknown keys and wrong types are named with their line.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, IoError> {
    let text = Input::open(path)?.text(TOML_LIMIT)?;
    parse_toml(path, &text)
}

/// The same from text; `name` appears in messages.
pub fn parse_toml<T: DeserializeOwned>(name: &Path, text: &str) -> Result<T, IoError> {
    toml::from_str(text).map_err(|e| {
        let line = |at: usize| {
            text.as_bytes()[..at.min(text.len())].iter().filter(|&&b| b == b'\n').count() as u64 + 1
        };
        let at = e.span().map_or(Place::File, |s| Place::Line(line(s.start)));
        IoError::malformed(name, at, e.message().replace('\n', " "))
    })
}
