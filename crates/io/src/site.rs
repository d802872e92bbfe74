//! A site folder: `site.toml`, `catalog.toml` and the files they name. The catalogue and its meshes lie in the folder; surveys and
//! designs may lie anywhere.

use crate::input::Input;
use crate::{IoError, Place};
use scene::{CatalogSpec, SiteSpec};
use serde::de::DeserializeOwned;
use std::path::{Component, Path, PathBuf};

const TOML_LIMIT: u64 = 64 << 20;

/// A site as its folder states it; the paths exist.
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
    /// Path of the alignment, when it is a file.
    pub alignment_file: Option<PathBuf>,
}

impl Site {
    /// Every file the site consists of, relative to its folder, in a fixed order: what a manifest lists as inputs.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let mut all = vec![PathBuf::from("site.toml"), self.spec.catalog.clone()];
        all.extend(self.spec.survey.iter().map(|s| s.file.clone()));
        // What stands beside a survey says which system it is in.
        let named = self.spec.survey.iter().map(|s| &s.file).zip(&self.survey_files);
        let prj = named.filter(|(_, found)| crate::crs::beside(found).is_some());
        all.extend(prj.map(|(name, _)| name.with_extension("prj")));
        all.extend(self.spec.design_file.iter().map(|d| d.file.clone()));
        all.extend(self.spec.alignment_file.iter().map(|a| a.file.clone()));
        let beside = self.spec.catalog.parent().unwrap_or(Path::new(""));
        all.extend(
            self.catalog.block.iter().filter_map(|b| b.mesh.as_ref()).map(|m| beside.join(m)),
        );
        all.sort();
        all.dedup();
        all
    }
}

/// Reads `folder/site.toml` (or the file itself) and its catalogue, checks both and finds the files they name. Everything that is
/// wrong is said at once. A site without `crs` takes that of its surveys' files.
pub fn load(folder_or_file: &Path) -> Result<Site, IoError> {
    let file = site_file(folder_or_file)?;
    let mut spec: SiteSpec = read_toml(&file)?;
    let mut wrong = Vec::new();
    let folder = file.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut anywhere = |key: &str, target: &Path| match find(&file, key, target) {
        Ok(path) => path,
        Err(error) => {
            wrong.push(error);
            file.with_file_name(target)
        }
    };
    let survey_files: Vec<PathBuf> =
        spec.survey.iter().map(|s| anywhere("survey.file", &s.file)).collect();
    let design_file = spec.design_file.as_ref().map(|d| anywhere("design_file.file", &d.file));
    let alignment_file =
        spec.alignment_file.as_ref().map(|a| anywhere("alignment_file.file", &a.file));
    if spec.crs.is_empty() {
        let stated = stated_crs(&survey_files);
        spec.crs = stated.0.unwrap_or_default();
        wrong.extend(stated.1);
    }
    let problems = spec.problems().into_iter();
    wrong.extend(problems.map(|e| IoError::malformed(&file, Place::File, e.to_string())));
    if let Err(why) = crate::crs::site_code(&spec.crs)
        && crate::crs::code(&spec.crs).is_some()
    {
        let what = format!("`crs`: {why}; give the code of plane coordinates in metres");
        wrong.push(IoError::malformed(&file, Place::File, what));
    }
    let catalog_file = resolve(&file, "catalog", &spec.catalog);
    let catalog = match &catalog_file {
        Ok(path) => load_catalog(path),
        Err(_) => Ok(CatalogSpec { block: Vec::new() }),
    };
    match (catalog_file, catalog, wrong.is_empty()) {
        (Ok(catalog_file), Ok(catalog), true) => Ok(Site {
            folder,
            spec,
            catalog_file,
            catalog,
            survey_files,
            design_file,
            alignment_file,
        }),
        (catalog_file, catalog, _) => {
            wrong.extend(catalog_file.err());
            wrong.extend(catalog.err());
            Err(IoError::of_several(wrong))
        }
    }
}

/// `site.toml` of a folder, or the file itself; says what to do where there is none.
fn site_file(folder_or_file: &Path) -> Result<PathBuf, IoError> {
    let kind = crate::mesh::extension(folder_or_file);
    if folder_or_file.is_file() && kind != "toml" {
        let what = if crate::points::READABLE.contains(&format!(".{kind}")) && !kind.is_empty() {
            "this is a cloud, not a site; `tsumu init` with this file writes the site's folder"
        } else {
            "this is no site; give the folder with site.toml"
        };
        return Err(IoError::unsupported(folder_or_file, what));
    }
    if !folder_or_file.is_dir() {
        return Ok(folder_or_file.to_path_buf());
    }
    let file = folder_or_file.join("site.toml");
    if file.exists() {
        return Ok(file);
    }
    let clouds: Vec<String> = names_in(folder_or_file)
        .into_iter()
        .filter(|n| {
            crate::points::READABLE.contains(&format!(".{}", crate::mesh::extension(Path::new(n))))
        })
        .collect();
    let what = if clouds.is_empty() {
        "the folder has no site.toml; `tsumu init` with your surveys writes one".to_string()
    } else {
        format!("the folder has no site.toml; `tsumu init {}` writes one", clouds.join(" "))
    };
    Err(IoError::unsupported(folder_or_file, what))
}

/// Names of the files in a folder, sorted, a dozen at most.
fn names_in(folder: &Path) -> Vec<String> {
    let Ok(items) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = items
        .flatten()
        .filter(|i| i.path().is_file())
        .map(|i| i.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names.truncate(12);
    names
}

/// `EPSG:n` that the files agree on, from their headers, or of the first where they do not, with why that is wrong; `None` when none
/// says.
fn stated_crs(files: &[PathBuf]) -> (Option<String>, Vec<IoError>) {
    let stated = |f: &PathBuf| Some((f.display().to_string(), crate::points::reference(f).ok()?));
    let references: Vec<_> = files.iter().filter_map(stated).collect();
    let all = crate::crs::disagreements("", &references);
    let refusals = all.iter().filter(|c| c.severity == scene::Severity::Refusal);
    let wrong = refusals.map(|c| {
        let what = format!("{}; {}", c.found, c.advice);
        IoError::unsupported(Path::new(&c.file), what)
    });
    let first = references.iter().find_map(|(_, r)| r.epsg());
    (first, wrong.collect())
}

/// The file that `target` names: relative to the folder of `file`, or anywhere else (a network drive). It must exist.
pub fn find(file: &Path, key: &str, target: &Path) -> Result<PathBuf, IoError> {
    let folder = match file.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let path = folder.join(target);
    if path.is_file() {
        return Ok(path);
    }
    let text = target.to_string_lossy();
    let drive = text.as_bytes().get(1) == Some(&b':') && text.as_bytes()[0].is_ascii_alphabetic();
    let why = if path.is_dir() {
        "it is a folder; name the file in it".to_string()
    } else if path.exists() {
        "it is a pipe or a device; write it to an ordinary file first".into()
    } else if cfg!(not(windows)) && drive {
        "a path with a drive letter is known on Windows alone; write where the file is on this machine".into()
    } else if cfg!(not(windows)) && text.contains('\\') {
        "write `/` between folders, not `\\`".into()
    } else {
        let here = names_in(path.parent().unwrap_or(folder));
        let holds = if here.is_empty() { "nothing".to_string() } else { here.join(", ") };
        format!("there is no such file; check the spelling of the path (the folder holds {holds})")
    };
    let what = format!("`{key}` = \"{text}\": {why}");
    Err(IoError::malformed(file, Place::File, what))
}

/// Reads a catalogue; its mesh files must lie in its folder. Everything that is wrong is said at once.
pub fn load_catalog(file: &Path) -> Result<CatalogSpec, IoError> {
    let spec: CatalogSpec = read_toml(file)?;
    let meshes = spec.block.iter().filter_map(|b| b.mesh.as_ref());
    let wrong: Vec<IoError> = meshes.filter_map(|m| resolve(file, "mesh", m).err()).collect();
    if wrong.is_empty() { Ok(spec) } else { Err(IoError::of_several(wrong)) }
}

/// What `blocks::catalog` needs to load the meshes that this catalogue file names.
pub fn mesh_loader(catalog_file: &Path) -> impl Fn(&Path) -> Result<geom::TriMesh, String> {
    mesh_loader_telling(catalog_file, &geom::Silent)
}

/// The same, telling the observer of a mesh that was moved to its origin.
pub fn mesh_loader_telling<'a>(
    catalog_file: &Path,
    observer: &'a dyn geom::Observer,
) -> impl Fn(&Path) -> Result<geom::TriMesh, String> + 'a {
    let catalog_file = catalog_file.to_path_buf();
    move |mesh| {
        let path = resolve(&catalog_file, "mesh", mesh).map_err(|e| e.to_string())?;
        let read = crate::mesh::read_moved(&path).map_err(|e| e.to_string())?;
        if read.moved_by != geom::DVec3::ZERO {
            let geom::DVec3 { x, y, z } = read.moved_by;
            let message = format!(
                "{}: the mesh lies far from its origin; it was moved there, and poses are those of the moved mesh (its origin is the file's ({x}, {y}, {z}))",
                path.display()
            );
            observer.event(geom::Event::Warned(geom::Warning {
                stage: geom::Stage::Catalogue,
                message,
            }));
        }
        Ok(read.mesh)
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
        let said = e.message().replace('\n', " ");
        let advice = advice(&said);
        IoError::malformed(name, at, format!("{said}{advice}"))
    })
}

/// What to do about a message of the parser.
fn advice(said: &str) -> &'static str {
    if said.contains("escape") {
        "; write `/` between the folders of a path, or put it in 'single quotes'"
    } else if said.contains("missing field `kind`") {
        "; write `kind = \"level\"`, \"planes\", \"section\" or \"grid\" in [design]; \"level\" or \"plane\" in [ground]; \"tetrapod\" and the like in a shape"
    } else if said.contains("invalid type: string")
        && (said.contains("f64") || said.contains("f32"))
    {
        "; a number stands without quotes"
    } else {
        ""
    }
}
