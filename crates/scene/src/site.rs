//! What `site.toml` says, before its files are read.

use crate::design::DesignError;
use crate::name::{NameError, check_name};
use crate::{AxisOrder, DesignSurface, SensorKind, SlopingPlane};
use geom::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The whole file. Paths are relative to it and stay inside its folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteSpec {
    /// Name for reports.
    pub name: String,
    /// Coordinate reference system, `EPSG:n`, or `none` for a bin.
    #[serde(default)]
    pub crs: String,
    /// Vertical datum in words.
    #[serde(default)]
    pub vertical_datum: String,
    /// Which way the axes of the surveys' files run.
    #[serde(default)]
    pub axis_order: AxisOrder,
    /// Root of all random choices.
    #[serde(default)]
    pub seed: u64,
    /// The catalogue file.
    #[serde(default = "default_catalog")]
    pub catalog: PathBuf,
    /// Clouds, at least one.
    #[serde(default)]
    pub survey: Vec<SurveySpec>,
    /// The part of the surveys that is read; `None`: all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<Area>,
    /// How high the finished works should stand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub design: Option<DesignSurface>,
    /// The same from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub design_file: Option<DesignFile>,
    /// What the blocks lie on, where the surveys do not show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundSpec>,
    /// Settings of the segmentation that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub segment: toml::Table,
    /// Settings of the pose stage that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub pose: toml::Table,
    /// Settings of the planner that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub plan: toml::Table,
}

fn default_catalog() -> PathBuf {
    PathBuf::from("catalog.toml")
}

/// A rectangle in site coordinates, metres: what lies outside is not read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// Least east coordinate.
    pub west: f64,
    /// Largest east coordinate.
    pub east: f64,
    /// Least north coordinate.
    pub south: f64,
    /// Largest north coordinate.
    pub north: f64,
}

impl Area {
    /// Lower and upper corner in the coordinates of a file whose axes run so; any height is inside.
    pub fn corners(&self, axis_order: AxisOrder) -> [DVec3; 2] {
        // Turning twice is turning back: the way in is the way out.
        let turned = |x, y, z| axis_order.east_north_up(DVec3::new(x, y, z));
        [
            turned(self.west, self.south, f64::NEG_INFINITY),
            turned(self.east, self.north, f64::INFINITY),
        ]
    }

    /// Checks what the types cannot.
    pub fn check(&self) -> Result<(), SiteError> {
        for (key, value) in [
            ("area.west", self.west),
            ("area.east", self.east),
            ("area.south", self.south),
            ("area.north", self.north),
        ] {
            finite(key, value)?;
        }
        let why = "it must lie above the opposite side";
        if self.east <= self.west {
            return Err(SiteError::BadValue { key: "area.east".into(), value: self.east, why });
        }
        if self.north <= self.south {
            return Err(SiteError::BadValue { key: "area.north".into(), value: self.north, why });
        }
        Ok(())
    }
}

/// One `[[survey]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurveySpec {
    /// The cloud.
    pub file: PathBuf,
    /// How it was measured.
    #[serde(default)]
    pub sensor: SensorKind,
    /// Where the sensor stood, in the file's coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_position: Option<[f64; 3]>,
    /// The same for a sensor that moved.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sensor_positions: Vec<[f64; 3]>,
    /// Added to the file's heights to bring them to the site's vertical datum, metres; needed in a site with a CRS.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical_offset_m: Option<f64>,
}

/// A design surface from LandXML, GeoTIFF or DXF, sampled on a grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignFile {
    /// The file.
    pub file: PathBuf,
    /// Spacing of the grid, metres.
    #[serde(default = "default_cell_m")]
    pub cell_m: f64,
}

fn default_cell_m() -> f64 {
    0.1
}

/// What the blocks lie on, heights in the site's vertical datum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum GroundSpec {
    /// A horizontal bed.
    Level {
        /// Height, metres.
        level_m: f64,
    },
    /// A sloping bed.
    Plane(SlopingPlane),
}

/// Why a site makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SiteError {
    /// No CRS.
    #[error(
        "`crs` is missing: add e.g. `crs = \"EPSG:6679\"`, or `crs = \"none\"` for a bin without one"
    )]
    NoCrs,
    /// A CRS that is not a code.
    #[error(
        "`crs` = \"{crs}\" is not an EPSG code: write e.g. `crs = \"EPSG:6679\"`, or \"none\" for a bin without one"
    )]
    BadCrs {
        /// As written.
        crs: String,
    },
    /// Nothing to read.
    #[error("there is no [[survey]]: add one with `file = \"survey.laz\"`")]
    NoSurvey,
    /// A survey whose heights refer to nothing.
    #[error(
        "survey `{file}`: add `vertical_offset_m` (0.0 when its heights already refer to the site's vertical datum)"
    )]
    NoOffset {
        /// The survey's file.
        file: String,
    },
    /// A number that is not one, or out of range.
    #[error("`{key}` = {value} is not allowed: {why}")]
    BadValue {
        /// Key in the file.
        key: String,
        /// The value.
        value: f64,
        /// What is allowed.
        why: &'static str,
    },
    /// Two designs.
    #[error("give either [design] or [design_file], not both")]
    TwoDesigns,
    /// A name no file or page can hold.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The design itself.
    #[error(transparent)]
    Design(#[from] DesignError),
}

impl SiteSpec {
    /// Whether coordinates are projected ones.
    pub fn has_crs(&self) -> bool {
        self.crs != "none"
    }

    /// Checks what the types cannot.
    pub fn check(&self) -> Result<(), SiteError> {
        check_name("the site's `name`", &self.name)?;
        match self.crs.as_str() {
            "" => return Err(SiteError::NoCrs),
            "none" => {}
            crs => {
                let digits = crs.strip_prefix("EPSG:").unwrap_or_default();
                if digits.is_empty()
                    || digits.len() > 6
                    || !digits.bytes().all(|b| b.is_ascii_digit())
                {
                    return Err(SiteError::BadCrs { crs: crs.into() });
                }
            }
        }
        if self.survey.is_empty() {
            return Err(SiteError::NoSurvey);
        }
        for survey in &self.survey {
            survey.check(self.has_crs())?;
        }
        self.area.iter().try_for_each(Area::check)?;
        match (&self.design, &self.design_file) {
            (Some(_), Some(_)) => return Err(SiteError::TwoDesigns),
            (Some(design), None) => design.check()?,
            (None, Some(file)) => positive("design_file.cell_m", file.cell_m)?,
            (None, None) => {}
        }
        match self.ground {
            Some(GroundSpec::Plane(plane)) => positive("ground.slope_m", plane.slope_m),
            Some(GroundSpec::Level { level_m }) => finite("ground.level_m", level_m),
            None => Ok(()),
        }
    }
}

impl SurveySpec {
    fn check(&self, needs_offset: bool) -> Result<(), SiteError> {
        match self.vertical_offset_m {
            Some(v) => finite("survey.vertical_offset_m", v)?,
            None if needs_offset => {
                return Err(SiteError::NoOffset { file: self.file.display().to_string() });
            }
            None => {}
        }
        self.sensors().flatten().try_for_each(|v| finite("survey.sensor_position", v))
    }

    /// Every stated sensor position, in the file's coordinates.
    pub fn sensors(&self) -> impl Iterator<Item = [f64; 3]> {
        self.sensor_position.into_iter().chain(self.sensor_positions.iter().copied())
    }
}

fn finite(key: &str, value: f64) -> Result<(), SiteError> {
    let why = "it must be a finite number";
    if value.is_finite() {
        Ok(())
    } else {
        Err(SiteError::BadValue { key: key.into(), value, why })
    }
}

fn positive(key: &str, value: f64) -> Result<(), SiteError> {
    let why = "it must be above 0";
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(SiteError::BadValue { key: key.into(), value, why })
    }
}
