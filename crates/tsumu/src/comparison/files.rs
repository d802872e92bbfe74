//! The files of a comparison.

use super::folder::{ComparisonFolder, NOTE};
use super::{CompareOptions, Compared, page};
use crate::outputs::write_json;
use crate::{Result, version};
use io::RawCloud;
use io::as_built_csv::AsBuiltRow;
use io::las::{ExtraColumn, write_cloud_with};
use io::manifest::Manifest;
use monitor::{AsBuilt, Built, Class};
use scene::Catalog;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

impl Compared<'_> {
    /// Writes everything and seals it; the folder, whole.
    pub fn write(&self, folder: ComparisonFolder, options: &CompareOptions) -> Result<PathBuf> {
        let at = |name: &str| folder.aside.join(name);
        let rows = self.rows(self.steps.len() - 1);
        let site = &self.epochs[self.epochs.len() - 2].site;
        let crs = &site.survey.frame.crs;
        io::changes_csv::write(&at("changes.csv"), &rows)?;
        io::changes_geojson::write(&at("changes.geojson"), &site.name, crs, &rows)?;
        if let Some(store) = self.store() {
            io::changes_gpkg::write(&at("changes.gpkg"), &store)?;
        }
        if let Some(built) = &self.as_built {
            io::as_built_csv::write(&at("as_built.csv"), &self.built_rows(built))?;
        }
        write_json(&at("summary.json"), &self.summary())?;
        write_json(&at("registration.json"), &self.registrations())?;
        self.write_cloud(&at("cloud.laz"))?;
        io::atomic::write_bytes(&at("report.html"), page::html(self, &rows).as_bytes())?;
        folder.put(self.manifest(options)?)
    }

    /// The later survey, registered, with what the surface did at every point.
    fn write_cloud(&self, path: &Path) -> Result<()> {
        let site = &self.epochs[self.epochs.len() - 2].site;
        let (frame, points) = (&site.survey.frame, &self.last().later_points);
        let size_m = largest_edge_m(&site.catalog);
        let change = monitor::surface::of_points(points, &self.surface, size_m);
        let cloud = RawCloud {
            position: points.iter().map(|p| frame.site_from_local(*p)).collect(),
            crs: Some(frame.crs.clone()).filter(|c| c.starts_with("EPSG:")),
            ..RawCloud::default()
        };
        let column = ExtraColumn {
            name: "change_m",
            description: "along the normal, NaN: unknown",
            values: &change,
        };
        Ok(write_cloud_with(path, &cloud, &[column])?)
    }

    fn built_rows(&self, built: &AsBuilt) -> Vec<AsBuiltRow> {
        let site = &self.epochs[0].site;
        let one = |b: &monitor::BuiltBlock| AsBuiltRow {
            order: b.order,
            later_id: b.later_id,
            model: site.catalog.get(b.model).name.clone(),
            state: b.state.word().into(),
            off_m: b.off_m,
            distance_m: b.distance_m,
            turn_deg: b.turn_rad.to_degrees(),
            level_m: b.level_m,
            centre_m: site.survey.frame.site_from_local(b.centre).to_array(),
            note: b.note.clone(),
        };
        built.blocks.iter().map(one).collect()
    }

    /// The figures, as `summary.json` has them.
    pub fn summary(&self) -> Value {
        let last = self.last();
        let count = |c: &Class| (c.word().to_string(), json!(last.count(*c)));
        let names: Vec<&str> = self.epochs.iter().map(|e| e.name.as_str()).collect();
        json!({
            "epochs": names,
            "survey_dates": self.epochs.iter().map(|e| e.site.survey_date.as_str()).collect::<Vec<_>>(),
            "earlier": names[names.len() - 2],
            "later": names[names.len() - 1],
            "counts": Class::ALL.iter().map(count).collect::<Map<_, _>>(),
            "common_settlement_m": last.common_settlement_m(),
            "surface": {
                "places": self.surface.len(),
                "changed": self.surface.iter().filter(|s| s.is_change()).count(),
            },
            "spans": self.spans,
            "as_built": self.as_built.as_ref().map(|b| self.built_summary(b)),
        })
    }

    fn built_summary(&self, built: &AsBuilt) -> Value {
        let count = |s: &Built| (s.word().to_string(), json!(built.count(*s)));
        let range = self.epochs[0].planned.as_ref().and_then(|p| p.range.as_ref());
        let n = built.built() as f32;
        json!({
            "counts": Built::ALL.iter().map(count).collect::<Map<_, _>>(),
            "built_blocks": built.built(),
            "planned_p10": range.map(|r| r.p10),
            "planned_p90": range.map(|r| r.p90),
            "within_p10_p90": range.map(|r| (r.p10..=r.p90).contains(&n)),
            "concrete_m3": built.concrete_m3,
            "area_m2": built.area_m2,
            "porosity_measured": built.porosity_measured,
            "porosity_of_poses": built.porosity_of_poses,
            "packing": built.packing,
        })
    }

    fn registrations(&self) -> Value {
        let last = self.last();
        json!({
            "reference": last.reference,
            "reference_sd": last.reference.sd(),
            "on_blocks": last.on_blocks,
            "on_ground": last.on_ground,
            "common_movement": last.common_movement,
            "moved_alike": last.moved_alike,
            "common_error": last.common_error,
        })
    }

    fn manifest(&self, options: &CompareOptions) -> Result<Manifest> {
        let config = json!({
            "stable": options.stable,
            "compare": options.config,
            "spans": options.spans,
        });
        let mut manifest = Manifest::new(version::STAMP, self.epochs[0].site.seed, config);
        let epoch = |e: &&super::EpochRun| json!({ "name": e.name, "site_files": e.site.inputs, "blocks": e.blocks_file });
        let epochs: Vec<Value> = self.epochs.iter().map(epoch).collect();
        manifest.notes.insert(NOTE.into(), json!({ "epochs": epochs }));
        Ok(manifest)
    }
}

/// Largest edge of any type.
pub(super) fn largest_edge_m(catalog: &Catalog) -> f32 {
    catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max)
}
