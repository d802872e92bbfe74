//! The labels of points back into the survey's own file: every record as it was, with `instance`, `model` and `confidence`
//! behind it. Read and written piece by piece.

use crate::mesh::extension;
use crate::{IoError, las, pcd, ply};
use std::path::Path;

/// What was found of some points of a file. All columns are as long as `record`.
#[derive(Clone, Copy, Debug)]
pub struct PointLabels<'a> {
    /// Number of each point among the file's points, from 0 ([`crate::RawCloud::record`]).
    pub record: &'a [u32],
    /// Block of each point, 0 = none.
    pub instance: &'a [u32],
    /// Type of each point's block, from 1; 0 = none.
    pub model: &'a [u16],
    /// Confidence of each label, in [0, 1].
    pub confidence: &'a [f32],
}

/// What takes the file's coordinates to the site's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteFromFile {
    /// The file's first two columns change places.
    pub swap: bool,
    /// Multiplies the file's heights.
    pub height_factor: f64,
    /// Added to them then, metres.
    pub vertical_offset_m: f64,
    /// Code of the site's coordinate reference system, for a LAS that names none.
    pub epsg: Option<u32>,
}

impl Default for SiteFromFile {
    fn default() -> Self {
        Self { swap: false, height_factor: 1.0, vertical_offset_m: 0.0, epsg: None }
    }
}

impl SiteFromFile {
    /// Nothing changes.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    pub(crate) fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [x, y] = if self.swap { [y, x] } else { [x, y] };
        [x, y, z * self.height_factor + self.vertical_offset_m]
    }
}

/// Which records come back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Records {
    /// All of the file's; points without a label have instance 0.
    All,
    /// Those with a label alone (a part of a large survey).
    Labelled,
}

/// Whether a survey of this kind can be labelled in its own records: LAS, LAZ, PLY and PCD.
pub fn can_relabel(source: &Path) -> bool {
    matches!(extension(source).as_str(), "las" | "laz" | "ply" | "pcd")
}

/// Writes `out`, of the same kind as `source` (LAS and LAZ are one kind), whole or not at all.
pub fn write(
    out: &Path,
    source: &Path,
    labels: &PointLabels,
    to_site: &SiteFromFile,
    records: Records,
) -> Result<(), IoError> {
    let n = labels.record.len();
    assert!(
        labels.instance.len() == n && labels.model.len() == n && labels.confidence.len() == n,
        "columns of labels are of one length"
    );
    let kind = |path: &Path| match extension(path).as_str() {
        "laz" => "las".to_string(),
        other => other.to_string(),
    };
    if kind(out) != kind(source) || !can_relabel(source) {
        let what =
            format!("labels of {} cannot be written into this kind of file", source.display());
        return Err(IoError::unsupported(out, what));
    }
    match kind(source).as_str() {
        "las" => las::relabel(out, source, labels, to_site, records),
        "ply" => ply::relabel(out, source, labels, to_site, records),
        _ => pcd::relabel(out, source, labels, to_site, records),
    }
}

/// Labels by record: where each record stands among the labels.
pub(crate) struct ByRecord<'a> {
    labels: &'a PointLabels<'a>,
    /// Place among the labels plus one; 0 = none.
    place: Vec<u32>,
    records: Records,
}

impl<'a> ByRecord<'a> {
    /// For a file of `total` points.
    pub fn new(labels: &'a PointLabels<'a>, total: u64, records: Records) -> Self {
        let mut place = vec![0; usize::try_from(total).unwrap_or(0)];
        for (i, &record) in labels.record.iter().enumerate() {
            if let Some(slot) = place.get_mut(record as usize) {
                *slot = i as u32 + 1;
            }
        }
        Self { labels, place, records }
    }

    /// The labels of a record; `None`: it does not come back.
    #[inline]
    pub fn of(&self, record: u64) -> Option<(u32, u16, f32)> {
        let place = self.place.get(record as usize).copied().unwrap_or(0);
        match (place.checked_sub(1), self.records) {
            (Some(i), _) => {
                let (i, l) = (i as usize, self.labels);
                Some((l.instance[i], l.model[i], l.confidence[i]))
            }
            (None, Records::All) => Some((0, 0, 0.0)),
            (None, Records::Labelled) => None,
        }
    }

    /// How many records come back.
    pub fn count(&self) -> u64 {
        match self.records {
            Records::All => self.place.len() as u64,
            Records::Labelled => self.place.iter().filter(|p| **p > 0).count() as u64,
        }
    }
}
