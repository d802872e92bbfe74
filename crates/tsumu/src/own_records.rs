//! The way from a survey's points back to the records of the one file they came from.

use crate::Result;
use crate::local_survey::RawSurvey;
use crate::outputs::Columns;
use io::RawCloud;
use io::relabel::{self, PointLabels, Records, SiteFromFile};
use scene::AxisOrder;
use std::path::{Path, PathBuf};

/// Where each point of a survey stands in its file.
pub(crate) struct OwnRecords {
    file: PathBuf,
    record: Vec<u32>,
    to_site: SiteFromFile,
    records: Records,
}

impl OwnRecords {
    /// `None` for a kind of file that cannot be labelled in its own records. `partly`: an area was read.
    pub fn of(file: &Path, cloud: &RawCloud, raw: &RawSurvey, partly: bool) -> Option<Self> {
        let record = cloud.record.clone().filter(|_| relabel::can_relabel(file))?;
        let to_site = SiteFromFile {
            swap: raw.axis_order == AxisOrder::NorthEast,
            height_factor: cloud.height_factor.unwrap_or(1.0),
            vertical_offset_m: raw.vertical_offset_m,
            epsg: None,
        };
        let records = if partly { Records::Labelled } else { Records::All };
        Some(Self { file: file.to_path_buf(), record, to_site, records })
    }

    /// Whether `out` can have these records: the same kind of file.
    pub fn fit(&self, out: &Path) -> bool {
        let kind = |path: &Path| {
            let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            extension.map(|e| if e == "laz" { "las".to_string() } else { e })
        };
        kind(out) == kind(&self.file)
    }

    /// Writes the file's own records with these columns behind each.
    pub fn write(&self, out: &Path, columns: &Columns, crs: &str) -> Result<()> {
        let labels = PointLabels {
            record: &self.record,
            instance: &columns.instance,
            model: &columns.model,
            confidence: &columns.confidence,
        };
        let to_site = SiteFromFile { epsg: io::crs::code(crs), ..self.to_site };
        Ok(relabel::write(out, &self.file, &labels, &to_site, self.records)?)
    }

    /// Of a labelled file's records those that are the survey's points, in the survey's order. `None`: they are not there.
    pub fn of_survey(&self, labelled: &RawCloud) -> Option<RawCloud> {
        let index: Vec<usize> = self.record.iter().map(|&r| r as usize).collect();
        let there = index.iter().all(|&i| i < labelled.len());
        (self.records == Records::All && there).then(|| labelled.select(&index))
    }
}
