//! Parts and scenes of others, from a folder of the user's: the thesis' own CAD models and labelled scenes.
//!
//! None of them is shipped. What the folder may hold: `IPAGearShaft.stl` and `IPARingScrew.stl` (metres), which take the place of
//! our gear shaft and eye bolt, and `XA_A.txt`, `XA_B.txt`, `XA_C.txt` (`x y z score instance`, in tenths of a metre), on which
//! weights trained on our plates and bracket are judged.

use crate::bin_parts::BinPart;
use crate::bin_rows::Reading;
use crate::markdown::percent;
use crate::{Bench, ReproduceError};
use geom::{DVec3, Observer, PointCloud, SeedTree, Vec3};
use metrics::{LabelFigures, Labelled, Zero, label_figures, match_labels};
use scene::BlockModel;
use segment::{SegmentConfig, SegmentModel, segment};
use std::path::{Path, PathBuf};

/// Files and where they come from.
const MESHES: [(&str, &str); 2] =
    [("gear-shaft", "IPAGearShaft.stl"), ("eye-bolt", "IPARingScrew.stl")];
const SCENES: [(&str, &str); 3] =
    [("holed-plate", "XA_A.txt"), ("hook-plate", "XA_B.txt"), ("bracket", "XA_C.txt")];
const SOURCES: &str = "the meshes are part of Fraunhofer IPA's bin-picking data set, the scenes lie in `datas/` of the authors' \
                       repository xyjbaal/FPCC as A.txt, B.txt, C.txt";
/// How far a part may reach from its middle, metres.
const PART_M: std::ops::RangeInclusive<f32> = 0.005..=1.0;
/// Metres of a unit in the scenes' files.
const SCENE_UNIT_M: f64 = 0.1;

/// A folder with at least one of the files.
pub struct BinData {
    folder: PathBuf,
}

/// A labelled scene of others.
pub struct ForeignScene {
    /// Points, metres from the first.
    pub cloud: PointCloud,
    /// Places as read, metres.
    position: Vec<DVec3>,
    instance: Vec<i64>,
}

impl BinData {
    /// Error: a folder that holds none of the files.
    pub fn of(folder: &Path) -> Result<Self, ReproduceError> {
        let names = || MESHES.iter().chain(&SCENES).map(|m| m.1);
        if names().any(|name| folder.join(name).is_file()) {
            return Ok(Self { folder: folder.to_owned() });
        }
        if !folder.is_dir() {
            return Err(ReproduceError::DataFile {
                file: folder.display().to_string(),
                message: "there is no such folder; --data takes one with files of others".into(),
            });
        }
        Err(ReproduceError::Data {
            folder: folder.display().to_string(),
            wanted: names().collect::<Vec<_>>().join(", "),
            sources: SOURCES,
        })
    }

    /// The mesh that takes the place of one of our parts, if the folder has it.
    pub fn model(&self, part: &str) -> Result<Option<BlockModel>, ReproduceError> {
        let Some(path) = self.file(part, &MESHES) else { return Ok(None) };
        let wrong = |message: String| ReproduceError::DataFile {
            file: path.display().to_string(),
            message,
        };
        let mesh = io::mesh::read(&path).map_err(|e| wrong(e.to_string()))?;
        let model = blocks::mesh_model(part, &mesh, 7850.0).map_err(|e| wrong(e.to_string()))?;
        if !PART_M.contains(&model.d_max_m) {
            return Err(wrong(format!(
                "the part reaches {} m from its middle, {} to {} are expected: its numbers must be metres",
                model.d_max_m,
                PART_M.start(),
                PART_M.end()
            )));
        }
        Ok(Some(model))
    }

    /// The scene on which weights for one of our parts are judged, if the folder has it.
    pub fn scene(
        &self,
        part: &str,
        observer: &dyn Observer,
    ) -> Result<Option<ForeignScene>, ReproduceError> {
        let Some(path) = self.file(part, &SCENES) else { return Ok(None) };
        let wrong = |message: String| ReproduceError::DataFile {
            file: path.display().to_string(),
            message,
        };
        let read =
            io::label_cloud::read(&path, None, observer).map_err(|e| wrong(e.to_string()))?;
        if !read.instance.iter().any(|&i| i >= 0) {
            return Err(wrong("no point belongs to an instance: all numbers are below 0".into()));
        }
        let position: Vec<DVec3> = read.position.iter().map(|p| *p * SCENE_UNIT_M).collect();
        let first = position.first().copied().unwrap_or_default();
        let local: Vec<Vec3> = position.iter().map(|p| (*p - first).as_vec3()).collect();
        let cloud = PointCloud::from_positions(local);
        Ok(Some(ForeignScene { cloud, position, instance: read.instance }))
    }

    fn file(&self, part: &str, of: &[(&str, &str)]) -> Option<PathBuf> {
        let name = of.iter().find(|f| f.0 == part)?.1;
        Some(self.folder.join(name)).filter(|p| p.is_file())
    }
}

impl ForeignScene {
    /// What weights make of it under one of the readings that need no sensor.
    pub fn segmented(
        &self,
        bench: &Bench,
        part: &BinPart,
        model: &SegmentModel,
        reading: Reading,
    ) -> Result<LabelFigures, ReproduceError> {
        let config = match reading {
            Reading::Votes | Reading::Poses => SegmentConfig::default(),
            Reading::Own | Reading::Thesis => SegmentConfig::thesis(),
        };
        let seed = SeedTree::new(bench.settings.seed).child("foreign", 0);
        let found = segment(&self.cloud, &part.catalog, model, &config, seed, bench.observer)?;
        self.judged(&found.instance, part.unit_m())
    }

    /// Labels of its points against the truth. The scenes number their instances from 0.
    pub fn judged(&self, labels: &[u32], d_max_m: f32) -> Result<LabelFigures, ReproduceError> {
        // Ours count from 1.
        let labels: Vec<i64> = labels.iter().map(|&l| i64::from(l) - 1).collect();
        let truth =
            Labelled { position: &self.position, instance: &self.instance, confidence: None };
        let result = Labelled { position: &self.position, instance: &labels, confidence: None };
        let tolerance_m = metrics::labelled_clouds::tolerance_m(d_max_m);
        let matched = match_labels(truth, result, tolerance_m, [Zero::Instance; 2])?;
        Ok(label_figures(&[matched], 0.5)?)
    }
}

/// A row of a table of the scenes of others: scene, network, P, R, AP50, coverage in percent.
pub fn foreign_row(scene: &str, network: &str, figures: &LabelFigures) -> [String; 6] {
    [
        scene.to_string(),
        network.to_string(),
        percent(figures.counts.precision()),
        percent(figures.counts.recall()),
        percent(figures.average_precision.ap50),
        percent(figures.coverage),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Silent;

    #[test]
    fn a_folder_without_the_files_says_which_and_where_from() {
        let folder = tempfile::tempdir().unwrap();
        let error = BinData::of(folder.path()).err().unwrap().to_string();
        assert!(error.contains("XA_A.txt") && error.contains("xyjbaal/FPCC"), "{error}");
        let error = BinData::of(&folder.path().join("nowhere")).err().unwrap();
        assert!(error.is_bad_input() && error.to_string().contains("nowhere: there is no such"));
    }

    /// A cube of this edge as an STL file's text.
    fn cube(edge: f32) -> String {
        let mut text = String::from("solid cube\n");
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let corner = |i: usize| {
            let at = |bit: usize| if i >> bit & 1 == 1 { edge } else { 0.0 };
            format!("vertex {} {} {}\n", at(0), at(1), at(2))
        };
        for [a, b, c, d] in quads {
            for face in [[a, b, c], [a, c, d]] {
                text += "facet normal 0 0 0\nouter loop\n";
                face.iter().for_each(|&i| text += &corner(i));
                text += "endloop\nendfacet\n";
            }
        }
        text + "endsolid cube\n"
    }

    #[test]
    fn a_mesh_in_millimetres_or_of_nothing_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("IPAGearShaft.stl");
        let model = |text: &str| {
            std::fs::write(&file, text).unwrap();
            BinData::of(folder.path()).unwrap().model("gear-shaft")
        };
        assert!(model(&cube(0.1)).unwrap().is_some());
        for text in [&cube(100.0), "solid cube\nendsolid cube\n", ""] {
            let error = model(text).unwrap_err();
            assert!(
                error.is_bad_input() && error.to_string().contains("IPAGearShaft.stl"),
                "{error}"
            );
        }
        assert!(model(&cube(100.0)).unwrap_err().to_string().contains("metres"));
    }

    #[test]
    fn a_scene_without_instances_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        for text in ["0 0 0 0.5 -1\n1 0 0 0.5 -1\n", "0 0 0\n", ""] {
            std::fs::write(folder.path().join("XA_C.txt"), text).unwrap();
            let data = BinData::of(folder.path()).unwrap();
            let error = data.scene("bracket", &Silent).err().unwrap();
            assert!(error.is_bad_input() && error.to_string().contains("XA_C.txt"), "{error}");
        }
    }

    #[test]
    fn a_scene_is_read_in_metres_and_judged_against_itself() {
        let folder = tempfile::tempdir().unwrap();
        let rows: Vec<String> = (0..40)
            .map(|i| format!("{} 0.0 0.0 0.5{} {}", i as f64 * 0.1, i % 7, i / 20))
            .collect();
        std::fs::write(folder.path().join("XA_A.txt"), rows.join("\n")).unwrap();
        let data = BinData::of(folder.path()).unwrap();
        assert!(data.model("gear-shaft").unwrap().is_none());
        assert!(data.scene("bracket", &Silent).unwrap().is_none());
        let scene = data.scene("holed-plate", &Silent).unwrap().unwrap();
        assert!((scene.cloud.position_m[39].x - 0.39).abs() < 1e-6);
        let labels: Vec<u32> = (0..40).map(|i| 1 + i / 20).collect();
        let figures = scene.judged(&labels, 0.05).unwrap();
        assert_eq!((figures.counts.true_positives, figures.counts.false_positives), (2, 0));
    }
}
