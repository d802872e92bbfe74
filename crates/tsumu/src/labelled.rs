//! A labelled cloud as one file, with its manifest and settings beside it.

use crate::recognition::Segments;
use crate::weights::WeightsOrigin;
use crate::{Error, Result, Site, outputs, version};
use anyhow::anyhow;
use io::manifest::{Manifest, entry, portable};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Whether a file's name ends in a format that holds labels: .ply, .laz, .las, and .pcd for a survey that is one itself.
pub fn check_labelled(file: &Path, survey: &Path) -> Result<()> {
    let is_pcd = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pcd"));
    holds_labels(file, is_pcd(file) && is_pcd(survey))
}

fn holds_labels(file: &Path, of_the_same_kind: bool) -> Result<()> {
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    if of_the_same_kind || matches!(extension.as_deref(), Some("ply" | "laz" | "las")) {
        return Ok(());
    }
    Err(Error::bad_input(anyhow!("--out {}: end it in .ply, .laz or .las", file.display())))
}

impl Site {
    /// Writes the survey with the instance of every point, FILE.manifest.json and FILE.config.toml.
    pub fn write_labelled(
        &self,
        file: &Path,
        segments: &Segments,
        weights: &WeightsOrigin,
    ) -> Result<()> {
        holds_labels(file, self.records.as_ref().is_some_and(|own| own.fit(file)))?;
        for out in [file, &beside(file, ".config.toml"), &beside(file, ".manifest.json")] {
            self.refuse_input(out)?;
        }
        outputs::write_labelled(file, self, segments)?;
        let config = beside(file, ".config.toml");
        io::atomic::write_bytes(&config, toml::to_string(&self.config)?.as_bytes())?;
        let mut manifest =
            Manifest::new(version::STAMP, self.seed, serde_json::to_value(&self.config)?);
        manifest.inputs = self.inputs.clone();
        weights.record(&mut manifest);
        for output in [file, &config] {
            let name = output.file_name().map_or(output, Path::new);
            manifest.outputs.insert(portable(name), entry(output)?);
        }
        let text = manifest.sealed_text();
        Ok(io::atomic::write_bytes(&beside(file, ".manifest.json"), text.as_bytes())?)
    }
}

/// `cloud.ply` and `.config.toml`: `cloud.ply.config.toml`.
fn beside(file: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = file.as_os_str().into();
    name.push(ending);
    name.into()
}
