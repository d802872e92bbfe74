//! A site as a form edits it: read, changed and written back whole, without looking at the files it names. What is wrong with it
//! is for the check to say.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use scene::{CatalogSpec, DesignSurface, SiteSpec};
use serde::{Deserialize, Serialize};
use std::path::{Component, Path, PathBuf};

/// First line of a site that was written here; one without it was written by hand and is kept beside.
const OURS: &str = "# Written by `tsumu open`.\n";
const SITE: &str = "site.toml";

/// `site.toml` and its catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draft {
    /// The site.
    pub site: SiteSpec,
    /// The catalogue as its file has it: names of shapes stay names.
    pub catalog: toml::Table,
    /// What the two files held when they were read.
    #[serde(default)]
    pub revision: String,
}

/// What a variant of a site has otherwise; what is left out stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Variant {
    /// Height of the crest, or of a level design, metres.
    pub crest_level_m: Option<f64>,
    /// Width of the crest, metres.
    pub crest_width_m: Option<f64>,
    /// v, m³.
    pub minimum_volume_m3: Option<f64>,
    /// f, metres.
    pub overflow_m: Option<f64>,
    /// The block to place, as `tsumu blocks` names it.
    pub block: Option<String>,
}

/// Reads the two files of a site folder. Errors: one is missing or is not what it should be, by file and line.
pub fn read_draft(folder: &Path) -> Result<Draft> {
    let file = folder.join(SITE);
    let site: SiteSpec = io::site::read_toml(&file).or_bad_input()?;
    let catalog_file = io::site::resolve(&file, "catalog", &site.catalog).or_bad_input()?;
    let catalog = io::site::read_toml(&catalog_file).or_bad_input()?;
    Ok(Draft { revision: revision(&file, &catalog_file)?, site, catalog })
}

/// Writes both files and returns their new revision. Errors: they are not what the draft was read from (somebody else changed
/// them), the catalogue is none, or it would lie outside the folder.
pub fn write_draft(folder: &Path, draft: &Draft) -> Result<String> {
    let file = folder.join(SITE);
    let catalog_file = inside(folder, &draft.site.catalog)?;
    if file.exists() && revision(&file, &catalog_file)? != draft.revision {
        return Err(Error::bad_input(anyhow!(
            "{}: was changed elsewhere since it was read; load it again and repeat the change",
            file.display()
        )));
    }
    write_files(&file, &catalog_file, draft)?;
    revision(&file, &catalog_file)
}

/// Writes a site folder that differs from `site` in what the variant says, for a plan of its own on the same run.
pub fn write_variant(site: &Path, folder: &Path, variant: &Variant) -> Result<()> {
    let mut draft = read_draft(site)?;
    let file = site.join(SITE);
    for path in files_of(&mut draft.site) {
        *path = io::site::find(&file, "file", path).or_bad_input()?;
        *path = path.canonicalize().with_context(|| path.display().to_string())?;
    }
    variant.apply(&mut draft)?;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for mesh in meshes(&draft.catalog)? {
        let from = io::site::resolve(&site.join(&draft.site.catalog), "mesh", &mesh);
        copy(&from.or_bad_input()?, &inside(folder, &mesh)?)?;
    }
    draft.site.catalog = "catalog.toml".into();
    let review = site.join(io::review::FILE);
    if review.is_file() {
        copy(&review, &folder.join(io::review::FILE))?;
    }
    write_files(&folder.join(SITE), &folder.join("catalog.toml"), &draft)
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let doing = || format!("cannot copy {} to {}", from.display(), to.display());
    to.parent().map_or(Ok(()), std::fs::create_dir_all).with_context(doing)?;
    std::fs::copy(from, to).with_context(doing)?;
    Ok(())
}

/// Puts a reviewer's decisions into a site folder: the next run applies them. Error: the text is no review.
pub fn write_review(folder: &Path, text: &str) -> Result<()> {
    let file = folder.join(io::review::FILE);
    let mut input = io::Input::of_bytes(&file, text.as_bytes());
    io::review::read_from(&mut input).or_bad_input()?;
    Ok(io::atomic::write_bytes(&file, text.as_bytes())?)
}

impl Draft {
    /// Files that the site names, as it names them.
    pub fn paths(&self) -> Vec<PathBuf> {
        files_of(&mut self.site.clone()).map(|path| path.clone()).collect()
    }
}

impl Variant {
    fn apply(&self, draft: &mut Draft) -> Result<()> {
        let no_crest = || Error::bad_input(anyhow!("the design has no crest that could be moved"));
        match (&mut draft.site.design, self.crest_level_m) {
            (Some(DesignSurface::Section { crest_level_m: level, .. }), Some(new))
            | (Some(DesignSurface::Level { level_m: level, .. }), Some(new)) => *level = new,
            (_, Some(_)) => return Err(no_crest()),
            (_, None) => {}
        }
        match (&mut draft.site.design, self.crest_width_m) {
            (Some(DesignSurface::Section { crest_width_m, .. }), Some(new)) => *crest_width_m = new,
            (_, Some(_)) => return Err(no_crest()),
            (_, None) => {}
        }
        let plan = &mut draft.site.plan;
        let numbers =
            [("minimum_volume_m3", self.minimum_volume_m3), ("overflow_m", self.overflow_m)];
        for (key, value) in numbers {
            if let Some(value) = value {
                plan.insert(key.into(), toml::Value::Float(value));
            }
        }
        if let Some(block) = &self.block {
            scene::shape_of_name(block).map_err(|e| Error::bad_input(anyhow!(e)))?;
            plan.insert("block".into(), toml::Value::String(block.clone()));
            add_block(&mut draft.catalog, block);
        }
        Ok(())
    }
}

/// The block as one more entry of the catalogue, unless one has its name.
fn add_block(catalog: &mut toml::Table, block: &str) {
    let list = catalog.entry("block").or_insert_with(|| toml::Value::Array(Vec::new()));
    let Some(list) = list.as_array_mut() else { return };
    let named = |b: &toml::Value| b.get("name").and_then(|n| n.as_str()) == Some(block);
    if !list.iter().any(named) {
        let text = |t: &str| toml::Value::String(t.into());
        let entry = [("name".into(), text(block)), ("shape".into(), text(block))];
        list.push(toml::Value::Table(entry.into_iter().collect()));
    }
}

/// Every path of a site that begins at its folder.
fn files_of(site: &mut SiteSpec) -> impl Iterator<Item = &mut PathBuf> {
    let surveys = site.survey.iter_mut().map(|s| &mut s.file);
    let design = site.design_file.iter_mut().map(|d| &mut d.file);
    surveys.chain(design).chain(site.alignment_file.iter_mut().map(|a| &mut a.file))
}

fn meshes(catalog: &toml::Table) -> Result<Vec<PathBuf>> {
    let spec = spec(catalog)?;
    Ok(spec.block.into_iter().filter_map(|b| b.mesh).collect())
}

fn spec(catalog: &toml::Table) -> Result<CatalogSpec> {
    let read: std::result::Result<CatalogSpec, _> = catalog.clone().try_into();
    read.map_err(|e| Error::bad_input(anyhow!("catalog.toml: {}", e.message())))
}

/// A path that stays in the folder.
fn inside(folder: &Path, target: &Path) -> Result<PathBuf> {
    let plain = target.components().all(|c| matches!(c, Component::Normal(_)));
    if !plain || target.as_os_str().is_empty() {
        return Err(Error::bad_input(anyhow!(
            "`{}` leads out of the site's folder; give a name in it",
            target.display()
        )));
    }
    Ok(folder.join(target))
}

fn write_files(file: &Path, catalog_file: &Path, draft: &Draft) -> Result<()> {
    spec(&draft.catalog)?;
    let site = format!("{OURS}{}", toml::to_string_pretty(&draft.site)?);
    let catalog = format!("{OURS}{}", toml::to_string_pretty(&draft.catalog)?);
    for (file, text) in [(catalog_file, catalog), (file, site)] {
        keep_beside(file)?;
        io::atomic::write_bytes(file, text.as_bytes())?;
    }
    Ok(())
}

/// What was written by hand has comments that would be lost: it stays, as `site.before.toml`.
fn keep_beside(file: &Path) -> Result<()> {
    match std::fs::read(file) {
        Ok(text) if !text.starts_with(OURS.as_bytes()) => {
            let free = (1..).map(|n| {
                let number = if n == 1 { String::new() } else { format!("-{n}") };
                file.with_extension(format!("before{number}.toml"))
            });
            let place = free.into_iter().find(|p| !p.exists()).expect("some number is free");
            Ok(io::atomic::write_bytes(&place, &text)?)
        }
        Ok(_) => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        // What cannot be read now is not written over.
        Err(source) => {
            let path = file.to_path_buf();
            Err(crate::Error::failed(io::IoError::Os { path, doing: "read", source }))
        }
    }
}

/// Hash of what the files hold.
fn revision(file: &Path, catalog_file: &Path) -> Result<String> {
    let mut all = Vec::new();
    for path in [file, catalog_file] {
        let bytes =
            if path.exists() { io::read_bytes(path, 64 << 20).or_bad_input()? } else { vec![] };
        all.extend(io::manifest::hash(&bytes));
    }
    Ok(io::manifest::hash(&all)[..16].iter().map(|b| format!("{b:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SITE_TEXT: &str = "# By hand.\nname = \"Pier\"\ncrs = \"none\"\n[[survey]]\nfile = \"a.xyz\"\n[design]\nkind = \"section\"\nalignment = [[0.0, 0.0], [9.0, 0.0]]\ncrest_level_m = 3.0\ncrest_width_m = 6.0\nleft_slope_m = 1.5\nright_slope_m = 1.5\ntoe_level_m = 0.0\n[plan]\nrounds = 3\n";
    const CATALOG: &str = "[[block]]\nname = \"old\"\nshape = \"tetrapod 5t\"\n";

    fn site() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [(SITE, SITE_TEXT), ("catalog.toml", CATALOG), ("a.xyz", "0 0 0\n")] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn what_is_written_comes_back_and_the_hand_written_file_stays() {
        let folder = site();
        let mut draft = read_draft(folder.path()).unwrap();
        draft.site.name = "東防波堤 <b>=1+1".into();
        draft.revision = write_draft(folder.path(), &draft).unwrap();
        assert_eq!(read_draft(folder.path()).unwrap(), draft);
        let before = std::fs::read_to_string(folder.path().join("site.before.toml")).unwrap();
        assert_eq!(before, SITE_TEXT);
        // Its own text is not kept again, and the shape is still a name.
        draft.site.name = "East".into();
        write_draft(folder.path(), &draft).unwrap();
        assert!(!folder.path().join("site.before-2.toml").exists());
        let catalog = std::fs::read_to_string(folder.path().join("catalog.toml")).unwrap();
        assert!(catalog.contains("shape = \"tetrapod 5t\""), "{catalog}");
        assert_eq!(read_draft(folder.path()).unwrap().site.plan["rounds"].as_integer(), Some(3));
    }

    #[test]
    fn of_two_who_change_a_site_the_second_is_told() {
        let folder = site();
        let (first, second) =
            (read_draft(folder.path()).unwrap(), read_draft(folder.path()).unwrap());
        write_draft(folder.path(), &first).unwrap();
        let said = write_draft(folder.path(), &second).unwrap_err().line();
        assert!(said.contains("changed elsewhere"), "{said}");
    }

    #[test]
    fn a_catalogue_outside_or_of_nonsense_is_refused() {
        let folder = site();
        let good = read_draft(folder.path()).unwrap();
        let mut out = good.clone();
        out.site.catalog = "../catalog.toml".into();
        assert!(write_draft(folder.path(), &out).unwrap_err().line().contains("leads out"));
        let mut bad = good;
        bad.catalog.insert("block".into(), toml::Value::Integer(3));
        assert!(write_draft(folder.path(), &bad).unwrap_err().line().contains("catalog.toml"));
        assert_eq!(std::fs::read_to_string(folder.path().join(SITE)).unwrap(), SITE_TEXT);
    }

    #[test]
    fn a_variant_is_a_site_with_what_it_changes() {
        let folder = site();
        let place = folder.path().join("what-if/1");
        let variant = Variant {
            crest_level_m: Some(4.5),
            overflow_m: Some(0.2),
            block: Some("cube 1m".into()),
            ..Variant::default()
        };
        write_variant(folder.path(), &place, &variant).unwrap();
        let made = read_draft(&place).unwrap();
        let Some(DesignSurface::Section { crest_level_m, crest_width_m, .. }) = made.site.design
        else {
            panic!()
        };
        assert_eq!((crest_level_m, crest_width_m), (4.5, 6.0));
        assert_eq!(made.site.plan["overflow_m"].as_float(), Some(0.2));
        assert_eq!(made.catalog["block"].as_array().unwrap().len(), 2);
        assert!(made.site.survey[0].file.is_absolute());
        let unknown = Variant { block: Some("sealock 5t".into()), ..Variant::default() };
        let said = write_variant(folder.path(), &place, &unknown).unwrap_err().line();
        assert!(said.contains("sealock"), "{said}");
    }

    #[test]
    fn only_a_review_is_kept_as_one() {
        let folder = site();
        assert!(write_review(folder.path(), "{}").is_err());
        write_review(folder.path(), "{\"format\":1,\"reviewer\":\"Sato\",\"blocks\":[]}").unwrap();
        assert!(folder.path().join("review.json").is_file());
    }
}
