//! A first site from surveys alone: `site.toml` and `catalog.toml` with everything filled in that the files say, and a comment
//! beside everything that is a guess.

use crate::look::{Placed, SurveyLook, look};
use io::{IoError, ReadOptions};
use scene::shape_of_name;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The block that is written when none is named.
const DEFAULT_BLOCK: &str = "tetrapod 5t";

/// The two files, not written yet.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstSite {
    /// Text of `site.toml`.
    pub site_toml: String,
    /// Text of `catalog.toml`.
    pub catalog_toml: String,
    /// What the user should look at before he runs it.
    pub to_check: Vec<String>,
}

/// Why there is no first site.
#[derive(Debug)]
pub enum InitError {
    /// A survey cannot be read.
    Survey(IoError),
    /// The block's name, or the surveys, make no site.
    Refused(String),
}

impl std::fmt::Display for InitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Survey(e) => e.fmt(f),
            Self::Refused(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for InitError {}

/// Looks at the surveys and writes the texts of a site whose folder will be `folder`.
pub fn first_site(
    surveys: &[PathBuf],
    block: Option<&str>,
    folder: &Path,
) -> Result<FirstSite, InitError> {
    let block = block.unwrap_or(DEFAULT_BLOCK);
    shape_of_name(block).map_err(InitError::Refused)?;
    if surveys.is_empty() {
        return Err(InitError::Refused("give one survey at least".into()));
    }
    let mut looks = Vec::new();
    for file in surveys {
        let options = ReadOptions::survey();
        looks.push(look(file, &options, &Placed::default()).map_err(InitError::Survey)?);
    }
    let references: Vec<_> = looks.iter().map(|l| (l.file.clone(), l.reference.clone())).collect();
    let refusals = io::crs::disagreements("", &references);
    if let Some(refusal) = refusals.iter().find(|c| c.severity == scene::Severity::Refusal) {
        return Err(InitError::Refused(refusal.to_string()));
    }
    let crs = looks.iter().find_map(|l| l.reference.epsg());
    // A text may call a plane system by the code of another kind.
    if let Some(code) = &crs {
        io::crs::site_code(code).map_err(InitError::Refused)?;
    }
    let mut to_check = Vec::new();
    let site_toml = site_text(surveys, &looks, crs.as_deref(), folder, &mut to_check);
    let catalog_toml = catalog_text(block, &quoted(block));
    to_check.push(format!("the block: `{block}` (catalog.toml)"));
    Ok(FirstSite { site_toml, catalog_toml, to_check })
}

/// A catalogue of one built-in block.
fn catalog_text(name: &str, shape: &str) -> String {
    format!(
        "# Blocks of this site. `tsumu blocks` lists the names; a mesh of your own:\n# [[block]]\n# name = \"own\"\n# mesh = \"own.stl\"\n# unit = \"mm\"\n\n[[block]]\nname = {}\nshape = {shape}\ndensity_kg_m3 = 2300.0\n",
        quoted(name)
    )
}

impl FirstSite {
    /// Nobody has named the block: it is of the size that the surveys show.
    pub fn with_size(&mut self, fits_m: f32, fits_sd_m: f32, found: usize) {
        let size = (fits_m * 100.0).round() / 100.0;
        let shape = format!(
            "{{ kind = \"tetrapod\", size = {size:?} }}  # {fits_m:.2} ± {fits_sd_m:.2} m over {found} blocks of the survey; its drawing knows better"
        );
        self.catalog_toml = catalog_text("tetrapod", &shape);
        self.to_check.pop();
        self.to_check.push(format!(
            "the block: a tetrapod of {size:.2} m, as {found} blocks of the survey show it (catalog.toml)"
        ));
    }

    /// Nobody has named the block, and none like the proposed one was found.
    pub fn without_size(&mut self) {
        self.to_check.pop();
        self.to_check.push(format!(
            "the block: none like `{DEFAULT_BLOCK}` was found; `tsumu blocks fit` seeks other kinds and sizes (catalog.toml)"
        ));
    }
}

fn site_text(
    surveys: &[PathBuf],
    looks: &[SurveyLook],
    crs: Option<&str>,
    folder: &Path,
    to_check: &mut Vec<String>,
) -> String {
    let mut out = String::new();
    let fine = "a string takes every character";
    let name = surveys[0].file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    writeln!(out, "name = {}", quoted(&name)).expect(fine);
    match crs {
        Some(crs) => {
            let label = looks.iter().find(|l| l.reference.epsg().is_some()).map(|l| l.crs.as_str());
            writeln!(out, "crs = \"{crs}\"  # as the survey says: {}", label.unwrap_or_default())
                .expect(fine);
        }
        None => {
            writeln!(out, "crs = \"none\"  # no survey says its system; write e.g. \"EPSG:6679\" when you know it").expect(fine);
            to_check.push("`crs`: no survey says which system it is in".into());
        }
    }
    writeln!(out, "vertical_datum = \"\"  # in words, e.g. \"T.P.\"").expect(fine);
    writeln!(out, "# survey_date = \"2026-11-30\"  # day of the survey, for report and drawings")
        .expect(fine);
    writeln!(
        out,
        "axis_order = \"east-north\"  # \"north-east\" when the first column is X = north"
    )
    .expect(fine);
    for (file, look) in surveys.iter().zip(looks) {
        let [low, middle, high] = look.levels_m;
        writeln!(out, "\n[[survey]]\nfile = {}", quoted(&place(file, folder))).expect(fine);
        writeln!(
            out,
            "# {} points, {:.0} a m²; east {:.1} to {:.1}, north {:.1} to {:.1}",
            look.points, look.density_per_m2, look.low[0], look.high[0], look.low[1], look.high[1]
        )
        .expect(fine);
        writeln!(out, "# heights {low:.2} to {high:.2} m, half of them below {middle:.2} m")
            .expect(fine);
        writeln!(
            out,
            "sensor = \"uav\"  # \"mbes\" for a multibeam echo sounder, \"depth-camera\" for a bin"
        )
        .expect(fine);
        writeln!(
            out,
            "vertical_offset_m = 0.0  # added to the heights to reach the vertical datum"
        )
        .expect(fine);
        for (reason, n) in &look.left_out {
            writeln!(out, "# left out: {n} {reason}").expect(fine);
        }
        if !look.strays.is_empty() {
            writeln!(out, "# left out: {}", look.strays).expect(fine);
        }
    }
    to_check.push("`sensor` and `vertical_offset_m` of each survey".into());
    design_text(&mut out, looks);
    to_check.push("[design]: it is a proposal, a level over the whole survey".into());
    out
}

/// A level at the height that few points exceed, over the box of the surveys.
fn design_text(out: &mut String, looks: &[SurveyLook]) {
    let fine = "a string takes every character";
    let fold = |axis: usize| {
        let low = looks.iter().map(|l| l.low[axis]).fold(f64::INFINITY, f64::min);
        let high = looks.iter().map(|l| l.high[axis]).fold(f64::NEG_INFINITY, f64::max);
        // Whole half metres inside the survey, unless it is smaller than that.
        let (a, b) = ((low * 2.0).ceil() / 2.0, (high * 2.0).floor() / 2.0);
        if b - a > 1.0 { (a, b) } else { (low, high) }
    };
    let ((west, east), (south, north)) = (fold(0), fold(1));
    let top = looks.iter().map(|l| l.levels_m[2]).fold(f64::NEG_INFINITY, f64::max);
    let level = (top * 10.0).round() / 10.0;
    writeln!(out, "\n# How high the finished works should stand. This is a proposal: the height that 2 % of the points exceed, everywhere.").expect(fine);
    writeln!(out, "# Other kinds: planes, section (with `alignment`), or [design_file] with a LandXML, GeoTIFF or DXF.").expect(fine);
    writeln!(out, "[design]\nkind = \"level\"\nlevel_m = {level:?}").expect(fine);
    writeln!(out, "boundary = [[{west:?}, {south:?}], [{east:?}, {south:?}], [{east:?}, {north:?}], [{west:?}, {north:?}]]  # east, north").expect(fine);
}

/// The path as a site writes it: relative when the file lies in the folder or beside it, so that both can be moved together, else
/// whole; `/` between folders.
fn place(file: &Path, folder: &Path) -> String {
    let real = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_path_buf());
    let (real_file, folder) = (real(file), real_folder(folder));
    let below = |f: Option<&Path>| f.and_then(|f| real_file.strip_prefix(f).ok());
    let shown = match (below(Some(&folder)), below(folder.parent())) {
        (Some(inside), _) => inside.to_path_buf(),
        (None, Some(beside)) => Path::new("..").join(beside),
        // As the user knows it: the real path of Windows is no path that a user writes.
        (None, None) => std::path::absolute(file).unwrap_or_else(|_| real_file.clone()),
    };
    shown.display().to_string().replace('\\', "/")
}

/// The folder without links in its path, also one that is not there yet.
fn real_folder(folder: &Path) -> PathBuf {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let parent = || Some(whole.parent()?.canonicalize().ok()?.join(whole.file_name()?));
    whole.canonicalize().ok().or_else(parent).unwrap_or(whole)
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_survey_beside_the_site_moves_with_it() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(root.path().join("files")).unwrap();
        let file = root.path().join("files/a.laz");
        std::fs::write(&file, "").unwrap();
        assert_eq!(place(&file, root.path()), "files/a.laz");
        // The folder of a first site is not there yet.
        assert_eq!(place(&file, &root.path().join("pier")), "../files/a.laz");
        let elsewhere = tempfile::tempdir().unwrap();
        let far = place(&file, &elsewhere.path().join("a/b"));
        assert!(Path::new(&far).is_absolute() && far.ends_with("files/a.laz"), "{far}");
    }
}
