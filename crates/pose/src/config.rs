//! Settings of the pose stage; `Default` is what we recommend, the thesis' way is `method = "ppf"`.

use crate::PoseError;
use serde::{Deserialize, Serialize};

/// How poses are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Rotation grid and robust Gauss-Newton on the model's distance field.
    #[default]
    SdfSearch,
    /// Point pair features, voting, clustering and ICP (METHOD §4).
    Ppf,
}

/// Where a search looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Places {
    /// At the segmentation's centres and segments.
    #[default]
    Segments,
    /// In windows sliding over the plan, the baseline of §3.7.
    Windows,
}

/// A plane in the survey's local frame: `normal · p = offset_m`, blocks on the normal's side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatedPlane {
    /// Unit normal, pointing up.
    pub normal: [f32; 3],
    /// Distance from the local origin along the normal, metres.
    pub offset_m: f32,
}

impl From<StatedPlane> for geom::Plane {
    fn from(plane: StatedPlane) -> Self {
        Self { normal: geom::Vec3::from_array(plane.normal), offset_m: plane.offset_m }
    }
}

/// Everything the stage can be told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseConfig {
    /// Search used on every hypothesis.
    pub method: Method,
    /// Where it looks.
    pub places: Places,
    /// Standard deviation of a point, metres; absent: from the sensor's kind and, on levelled lines, from their scatter.
    pub noise_sd_m: Option<f32>,
    /// The bed under the pile where it is known; absent: asked of the points, with the blocks as rivals.
    pub bed: Option<StatedPlane>,
    /// Survey lines that the file tells apart are laid onto each other first.
    pub levelling: bool,
    /// Hypotheses compete for the points and are judged two-sidedly; off: one block a segment.
    pub verification: bool,
    /// Points nobody explains are searched again.
    pub re_search: bool,
    /// Point pair features add hypotheses to the distance-field search.
    pub ppf_hypotheses: bool,
    /// Rounds of searching leftovers.
    pub rounds: usize,
    /// The distance-field search.
    pub search: SearchConfig,
    /// How a hypothesis is judged.
    pub evidence: EvidenceConfig,
    /// The thesis' search.
    pub ppf: PpfConfig,
}

impl Default for PoseConfig {
    fn default() -> Self {
        Self {
            method: Method::SdfSearch,
            places: Places::Segments,
            noise_sd_m: None,
            bed: None,
            levelling: true,
            verification: true,
            re_search: true,
            ppf_hypotheses: false,
            rounds: 3,
            search: SearchConfig::default(),
            evidence: EvidenceConfig::default(),
            ppf: PpfConfig::default(),
        }
    }
}

impl PoseConfig {
    /// The thesis' chain (METHOD §4): point pair features on every segment, ICP from point to point, the type of least
    /// fitness; nothing is verified, searched again or levelled.
    pub fn thesis() -> Self {
        Self {
            method: Method::Ppf,
            levelling: false,
            verification: false,
            re_search: false,
            ppf: PpfConfig { icp: IcpError::PointToPoint, ..PpfConfig::default() },
            ..Self::default()
        }
    }
}

/// The search over rotations and its refinement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SearchConfig {
    /// Nodes of the distance field along the model's longest edge.
    pub field_cells: usize,
    /// Angle between neighbouring starts, radians.
    pub rotation_spacing_rad: f32,
    /// No more starts than this, whatever the spacing.
    pub max_rotations: usize,
    /// Points of a segment used by the search.
    pub points: usize,
    /// Centres tried beside the expected one lie this far away, in units of d_max; 0: none.
    pub centre_offset: f32,
    /// Poses kept after the coarse steps.
    pub keep_coarse: usize,
    /// Poses of a segment handed to verification.
    pub keep: usize,
    /// Cells of the working cloud are this part of the smallest d_max.
    pub working_cell: f32,
}

impl Default for SearchConfig {
    fn default() -> Self {
        Self {
            field_cells: 72,
            rotation_spacing_rad: 0.42,
            max_rotations: 1000,
            points: 56,
            centre_offset: 0.0,
            keep_coarse: 6,
            keep: 4,
            working_cell: 1.0 / 32.0,
        }
    }
}

/// The two-sided score. Areas are measured in halves of the block's surface, the most one side can see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvidenceConfig {
    /// Even samples of each model's surface.
    pub surface_samples: usize,
    /// Points within this many standard deviations of the surface are explained by it.
    pub reach_sd: f32,
    /// Price of measured points deep inside the solid.
    pub inside_weight: f32,
    /// Price of measured surface that goes on beyond the edge of a flat face.
    pub beyond_weight: f32,
    /// Price of surface the sensor looked through.
    pub free_space_weight: f32,
    /// Price of surface inside an accepted neighbour or the bed.
    pub overlap_weight: f32,
    /// Largest share of a block's inside that may lie inside an accepted neighbour.
    pub max_shared: f32,
    /// Least score of an accepted block, in halves of its surface.
    pub min_score: f32,
    /// Least share of the surface that ought to be seen and is.
    pub min_agreement: f32,
    /// Blocks less sure than this are reported as not judged.
    pub min_confidence: f32,
    /// Types less sure than this are reported as not judged; the block's pose is stated all the same.
    pub min_type_confidence: f32,
}

impl Default for EvidenceConfig {
    fn default() -> Self {
        Self {
            surface_samples: 400,
            reach_sd: 3.0,
            inside_weight: 2.0,
            beyond_weight: 1.0,
            free_space_weight: 1.0,
            overlap_weight: 2.0,
            max_shared: 0.05,
            min_score: 0.03,
            min_agreement: 0.6,
            min_confidence: 0.7,
            min_type_confidence: 0.95,
        }
    }
}

/// Point pair features (METHOD §4).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PpfConfig {
    /// Distance step over the model's diameter.
    pub distance_step: f32,
    /// Angle step, radians.
    pub angle_step_rad: f32,
    /// Every n-th point of a segment is a reference point.
    pub reference_stride: usize,
    /// Poses are one cluster within this displacement, in units of d_max.
    pub cluster_displacement: f32,
    /// Poses are one cluster within this rotation, radians.
    pub cluster_rotation_rad: f32,
    /// Share of the best vote a pose needs to enter clustering.
    pub vote_threshold: f32,
    /// Edge of a sliding window, in units of the largest d_box (5 m for blocks of 4 m).
    pub window: f32,
    /// Clusters refined by ICP.
    pub refined: usize,
    /// Error ICP minimises.
    pub icp: IcpError,
}

impl Default for PpfConfig {
    fn default() -> Self {
        Self {
            distance_step: 0.08,
            angle_step_rad: 12.0_f32.to_radians(),
            reference_stride: 5,
            cluster_displacement: 0.12,
            cluster_rotation_rad: 18.0_f32.to_radians(),
            vote_threshold: 0.5,
            window: 1.25,
            refined: 5,
            icp: IcpError::PointToPlane,
        }
    }
}

/// What ICP makes small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IcpError {
    /// Distance to the nearest model point.
    PointToPoint,
    /// Distance along the model point's normal.
    #[default]
    PointToPlane,
}

impl PoseConfig {
    /// Checks every range. Error: [`PoseError::BadConfig`] with the first key that is wrong.
    pub fn check(&self) -> Result<(), PoseError> {
        let s = &self.search;
        let e = &self.evidence;
        let p = &self.ppf;
        let rules = [
            ("noise_sd_m", self.noise_sd_m.unwrap_or(1.0), 0.0, 1e3, "must be above 0"),
            ("search.field_cells", s.field_cells as f32, 8.0, 256.0, "must be 8 to 256"),
            (
                "search.rotation_spacing_rad",
                s.rotation_spacing_rad,
                0.05,
                3.2,
                "must be 0.05 to 3.2",
            ),
            ("search.max_rotations", s.max_rotations as f32, 1.0, 1e6, "must be 1 or more"),
            ("search.points", s.points as f32, 6.0, 1e5, "must be 6 or more"),
            ("search.centre_offset", s.centre_offset, 0.0, 1.0, "must be 0 to 1"),
            ("search.keep_coarse", s.keep_coarse as f32, 1.0, 1e4, "must be 1 or more"),
            ("search.keep", s.keep as f32, 1.0, 1e3, "must be 1 or more"),
            ("search.working_cell", s.working_cell, 1e-3, 0.5, "must be 0.001 to 0.5"),
            ("evidence.surface_samples", e.surface_samples as f32, 50.0, 1e5, "must be 50 or more"),
            ("evidence.reach_sd", e.reach_sd, 1.0, 10.0, "must be 1 to 10"),
            ("evidence.max_shared", e.max_shared, 0.0, 1.0, "must be 0 to 1"),
            ("evidence.min_confidence", e.min_confidence, 0.0, 1.0, "must be 0 to 1"),
            ("evidence.min_type_confidence", e.min_type_confidence, 0.0, 1.0, "must be 0 to 1"),
            ("evidence.min_agreement", e.min_agreement, 0.0, 1.0, "must be 0 to 1"),
            ("ppf.distance_step", p.distance_step, 0.01, 0.5, "must be 0.01 to 0.5"),
            ("ppf.angle_step_rad", p.angle_step_rad, 0.02, 1.6, "must be 0.02 to 1.6"),
            ("ppf.reference_stride", p.reference_stride as f32, 1.0, 1e6, "must be 1 or more"),
            ("ppf.window", p.window, 0.1, 100.0, "must be 0.1 to 100"),
            ("ppf.refined", p.refined as f32, 1.0, 1e3, "must be 1 or more"),
        ];
        if let Some(bed) = &self.bed {
            let length = geom::Vec3::from_array(bed.normal).length();
            if !((length - 1.0).abs() < 1e-3 && bed.offset_m.is_finite() && bed.normal[2] > 0.0) {
                let rule = "the normal must be a unit vector that points up";
                return Err(PoseError::BadConfig { key: "bed", value: f64::from(length), rule });
            }
        }
        for (key, value, low, high, rule) in rules {
            if !(low..=high).contains(&value) || (key == "noise_sd_m" && value == 0.0) {
                return Err(PoseError::BadConfig { key, value: f64::from(value), rule });
            }
        }
        Ok(())
    }
}
