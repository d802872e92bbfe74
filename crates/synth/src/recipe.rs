//! A recipe: everything that decides what a scene looks like, as a TOML file says it.
//!
//! Lengths that follow from the blocks (spacing, bed stones, pen) have defaults in block lengths; a sensor's
//! parameters and their sources stand with the sensor.

use crate::SynthError;
use crate::around::Around;
use crate::bin::Bin;
use crate::delivery::Delivery;
use crate::sensor::Sensor;
use scene::{Catalog, CatalogSpec, ModelId};
use serde::{Deserialize, Serialize};
use sim::{BlockShape, PhysicsConfig};

/// Most points of one scene.
const MOST_POINTS: f64 = 2e7;

/// What `recipe.toml` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Name of the scenes, e.g. `sawara-uav`.
    pub name: String,
    /// Fewest and most blocks of a scene.
    #[serde(default = "fifty_to_sixty")]
    pub count: [u32; 2],
    /// Points per square metre of plan area.
    pub density_per_m2: f32,
    /// Block types and how often each is dropped; empty: all of the catalogue alike.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mix: Vec<Share>,
    /// Where the blocks fall.
    #[serde(default)]
    pub site: Site,
    /// What they fall on.
    #[serde(default)]
    pub bed: Bed,
    /// The bin around them, where it is measured.
    #[serde(default)]
    pub bin: Bin,
    /// What stands around them.
    #[serde(default)]
    pub around: Around,
    /// How they fall.
    #[serde(default)]
    pub drop: Drop,
    /// How points behind other points are found.
    #[serde(default)]
    pub visibility: Visibility,
    /// Physics; bulk scenes take steps of 1/60 s.
    #[serde(default = "bulk_physics")]
    pub physics: PhysicsConfig,
    /// Sensor that measures the pile.
    pub sensor: Sensor,
    /// What becomes of its points before they are handed over.
    #[serde(default)]
    pub delivery: Delivery,
    /// Piles dropped before giving up.
    #[serde(default = "twenty")]
    pub most_attempts: u32,
    /// What a training on these scenes should differ in; read by the training, unknown here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub train: Option<toml::Table>,
    /// Blocks, as in `catalog.toml`; a recipe used with another catalogue leaves this out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub catalog: Option<CatalogSpec>,
}

/// One block type of a mix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// Name in the catalogue.
    pub model: String,
    /// Weight against the others, above 0.
    pub share: f32,
}

/// The plan of the site: a rectangle around the origin with walls that no sensor sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Site {
    /// A square pen.
    Pen {
        /// Side in lengths of the largest block (thesis §2.4.1: 5).
        side_blocks: f32,
    },
    /// A strip of a breakwater.
    Strip {
        /// Along x, metres.
        length_m: f32,
        /// Along y, metres.
        width_m: f32,
    },
    /// A bin; its bottom and walls are not measured.
    Bin {
        /// Along x, metres.
        length_m: f32,
        /// Along y, metres.
        width_m: f32,
    },
}

impl Default for Site {
    fn default() -> Self {
        Self::Pen { side_blocks: 5.0 }
    }
}

/// What the blocks fall on. Its height at the origin is about 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bed {
    /// Size of the rubble stones in lengths of the largest block; 0: smooth.
    pub stone_blocks: f32,
    /// Slope, 1 vertical to `slope_m` horizontal; 0: level.
    pub slope_m: f32,
    /// Where the slope ends: so many block lengths below the middle of the site the bed goes on level.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub toe_blocks: Option<f32>,
    /// Direction in which the bed falls, degrees from +x towards +y.
    pub falls_towards_deg: f32,
    /// Whether the sensor measures the bed.
    pub measured: bool,
}

impl Bed {
    /// Height of the bed without its stones, metres.
    pub(crate) fn plane_m(&self, x: f32, y: f32, largest_m: f32) -> f32 {
        if self.slope_m == 0.0 {
            return 0.0;
        }
        let (sin, cos) = self.falls_towards_deg.to_radians().sin_cos();
        let run = x * cos + y * sin;
        -self.toe_blocks.map_or(run, |toe| run.min(toe * largest_m)) / self.slope_m
    }
}

impl Default for Bed {
    fn default() -> Self {
        Self {
            stone_blocks: 0.25,
            slope_m: 0.0,
            toe_blocks: None,
            falls_towards_deg: 90.0,
            measured: true,
        }
    }
}

/// How the blocks are dropped: layer by layer, each a jittered grid of random orientations above what already lies there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Drop {
    /// Distance between the blocks of a layer, in diameters of the largest block's bounding sphere; at least 1.
    pub spacing: f32,
    /// Time until the next layer falls, seconds (× √unit for small parts); 0: all layers at once, one above the other.
    pub layer_interval_s: f32,
    /// Blocks are set in rows with this joint instead of dropped, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows_joint_m: Option<f32>,
    /// Deepest overlap of two blocks at rest, in lengths of the smallest block.
    pub deepest_overlap: f32,
}

impl Default for Drop {
    fn default() -> Self {
        Self { spacing: 1.02, layer_interval_s: 0.7, rows_joint_m: None, deepest_overlap: 0.01 }
    }
}

/// How hidden points are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// Rays against the true surfaces.
    #[default]
    Exact,
    /// Hidden-point removal on the points (Katz et al. 2007), as in the thesis; for the sensors that look from a few
    /// places, `gaussian` and `uav`. Beams and pixels meet the surface itself, there is nothing to remove.
    Katz,
}

fn fifty_to_sixty() -> [u32; 2] {
    [50, 60]
}

fn twenty() -> u32 {
    20
}

fn bulk_physics() -> PhysicsConfig {
    PhysicsConfig { step_s: 1.0 / 60.0, max_time_s: 20.0, ..Default::default() }
}

impl Recipe {
    /// Reads a recipe; unknown keys are errors with their line.
    pub fn parse(text: &str) -> Result<Self, SynthError> {
        toml::from_str(text)
            .map_err(|e| SynthError::Parse { message: e.to_string().trim_end().to_owned() })
    }

    /// The recipe as a TOML file, with every default written out.
    pub fn to_toml(&self) -> Result<String, SynthError> {
        toml::to_string_pretty(self).map_err(|e| SynthError::Parse { message: e.to_string() })
    }

    /// Checks ranges that need no catalogue.
    pub fn check(&self) -> Result<(), SynthError> {
        let within = |key, value: f32, low: f32, high: f32, why| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SynthError::BadValue { key, value: value.into(), why })
            }
        };
        let [fewest, most] = self.count;
        within("count", fewest as f32, 1.0, 20_000.0, "1 to 20000 blocks")?;
        within(
            "count",
            most as f32,
            fewest as f32,
            20_000.0,
            "the second number is the larger one, at most 20000",
        )?;
        within(
            "density_per_m2",
            self.density_per_m2,
            f32::MIN_POSITIVE,
            1e9,
            "it must be above 0",
        )?;
        within("most_attempts", self.most_attempts as f32, 1.0, 1000.0, "1 to 1000")?;
        within(
            "drop.spacing",
            self.drop.spacing,
            1.0,
            10.0,
            "1 to 10; below 1 blocks start inside each other",
        )?;
        within("drop.layer_interval_s", self.drop.layer_interval_s, 0.0, 60.0, "0 to 60 s")?;
        within(
            "drop.deepest_overlap",
            self.drop.deepest_overlap,
            1e-5,
            1.0,
            "0.00001 to 1 block length",
        )?;
        within("bed.stone_blocks", self.bed.stone_blocks, 0.0, 2.0, "0 to 2 block lengths")?;
        within(
            "bed.slope_m",
            self.bed.slope_m,
            0.0,
            1e6,
            "0 for level, else the run of a rise of 1",
        )?;
        if self.bed.slope_m > 0.0 {
            within(
                "bed.slope_m",
                self.bed.slope_m,
                1.0,
                1e6,
                "steeper than 1:1 nothing stays on the bed",
            )?;
        }
        for share in &self.mix {
            within("mix.share", share.share, f32::MIN_POSITIVE, 1e9, "it must be above 0")?;
        }
        match self.site {
            Site::Pen { side_blocks } => {
                within("site.side_blocks", side_blocks, 0.0, 1000.0, "0 to 1000")?
            }
            Site::Strip { length_m, width_m } | Site::Bin { length_m, width_m } => {
                within(
                    "site.length_m",
                    length_m,
                    f32::MIN_POSITIVE,
                    5000.0,
                    "above 0, at most 5000 m",
                )?;
                within(
                    "site.width_m",
                    width_m,
                    f32::MIN_POSITIVE,
                    5000.0,
                    "above 0, at most 5000 m",
                )?;
            }
        }
        if self.visibility == Visibility::Katz
            && !matches!(self.sensor, Sensor::Gaussian(_) | Sensor::Uav(_))
        {
            let sensor = match self.sensor {
                Sensor::Mbes(_) => "mbes",
                Sensor::Scanner(_) => "scanner",
                _ => "depth-camera",
            };
            return Err(SynthError::NothingToRemove { sensor });
        }
        if let Some(joint) = self.drop.rows_joint_m {
            within("drop.rows_joint_m", joint, 0.0, 10.0, "0 to 10 m")?;
        }
        if let Some(toe) = self.bed.toe_blocks {
            within("bed.toe_blocks", toe, -1000.0, 1000.0, "-1000 to 1000 block lengths")?;
        }
        self.around.check()?;
        self.delivery.check()?;
        self.bin.check()?;
        self.physics.check()?;
        self.sensor.check()
    }

    /// Checks everything that can be told without making a scene.
    pub fn check_with(&self, catalog: &Catalog) -> Result<(), SynthError> {
        self.resolve(catalog)?;
        for (_, model) in catalog.iter() {
            BlockShape::new(model)?;
        }
        Ok(())
    }

    /// The recipe against a catalogue: plan, models with weights, sizes.
    pub(crate) fn resolve(&self, catalog: &Catalog) -> Result<Resolved, SynthError> {
        self.check()?;
        if catalog.is_empty() {
            return Err(SynthError::EmptyCatalog);
        }
        let known = || catalog.iter().map(|(_, m)| m.name.as_str()).collect::<Vec<_>>().join(", ");
        let mix: Vec<(ModelId, f32)> = if self.mix.is_empty() {
            catalog.iter().map(|(id, _)| (id, 1.0)).collect()
        } else {
            let find = |s: &Share| {
                let id = catalog.find(&s.model);
                id.map(|id| (id, s.share)).ok_or_else(|| SynthError::UnknownModel {
                    name: s.model.clone(),
                    known: known(),
                })
            };
            self.mix.iter().map(find).collect::<Result<_, _>>()?
        };
        let used = || mix.iter().map(|(id, _)| catalog.get(*id));
        let largest_m = used().map(|m| m.d_box_m).fold(0.0, f32::max);
        let smallest_m = used().map(|m| m.d_box_m).fold(f32::INFINITY, f32::min);
        let widest_m = 2.0 * used().map(|m| m.d_max_m).fold(0.0, f32::max);
        let size_m = match self.site {
            Site::Pen { side_blocks } => [side_blocks * largest_m; 2],
            Site::Strip { length_m, width_m } | Site::Bin { length_m, width_m } => {
                [length_m, width_m]
            }
        };
        let narrow = size_m[0].min(size_m[1]);
        if narrow < widest_m {
            return Err(SynthError::SiteTooSmall { site_m: narrow, block_m: widest_m });
        }
        let points = f64::from(self.density_per_m2) * f64::from(size_m[0]) * f64::from(size_m[1]);
        if points > MOST_POINTS {
            return Err(SynthError::TooDense {
                density: self.density_per_m2.into(),
                points,
                limit: MOST_POINTS,
            });
        }
        let target_points = points.round() as usize;
        Ok(Resolved {
            mix,
            size_m,
            largest_m,
            smallest_m,
            widest_m,
            target_points,
            density_per_m2: self.density_per_m2,
        })
    }
}

/// What follows from a recipe and a catalogue.
#[derive(Clone, Debug)]
pub(crate) struct Resolved {
    /// Models with weights.
    pub mix: Vec<(ModelId, f32)>,
    /// Plan of the site, metres.
    pub size_m: [f32; 2],
    /// Largest box edge of the largest block.
    pub largest_m: f32,
    /// Largest box edge of the smallest block.
    pub smallest_m: f32,
    /// Diameter of the widest block's sphere about its centre.
    pub widest_m: f32,
    /// Points of the finished survey.
    pub target_points: usize,
    /// Points per square metre of plan area.
    pub density_per_m2: f32,
}

impl Resolved {
    /// Cell of a camera's image on the pile: 1 % of a block.
    pub fn pixel_m(&self) -> f32 {
        0.01 * self.largest_m
    }
}
