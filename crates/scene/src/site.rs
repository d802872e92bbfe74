//! What `site.toml` says, before its files are read.

use crate::design::DesignError;
use crate::memory::MemoryBound;
use crate::name::{NameError, check_name};
use crate::{AxisOrder, DesignSurface, LengthUnit, PointMark, SensorKind, SlopingPlane};
use geom::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The whole file. Relative paths begin at its folder; the catalogue and its meshes lie in it, surveys and designs may lie
/// anywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteSpec {
    /// Name for reports.
    pub name: String,
    /// Coordinate reference system, `EPSG:n`, or `none` for a bin; empty: what the surveys' files say.
    #[serde(default)]
    pub crs: String,
    /// Vertical datum in words.
    #[serde(default)]
    pub vertical_datum: String,
    /// Day of the survey, `YYYY-MM-DD`, for drawings; empty when not stated.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub survey_date: String,
    /// Which way the axes of the surveys' files run.
    #[serde(default)]
    pub axis_order: AxisOrder,
    /// Root of all random choices.
    #[serde(default)]
    pub seed: u64,
    /// How much memory a run may take; `None`: as much as it needs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryBound>,
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
    /// The alignment of a `section` design from a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alignment_file: Option<AlignmentFile>,
    /// What the blocks lie on, where the surveys do not show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundSpec>,
    /// Settings of what goes before the network that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub background: toml::Table,
    /// Settings of the segmentation that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub segment: toml::Table,
    /// Settings of the pose stage that differ from the method's.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub pose: toml::Table,
    /// Settings of the bed's estimate that differ from the method's; what the bed *is* stands in `ground`.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub bed: toml::Table,
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
    /// Classes and flags whose points are left out besides withheld points, noise (7, 18) and water (9).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub leave_out: Vec<PointMark>,
    /// Classes and flags whose points are kept although they would be left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keep: Vec<PointMark>,
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
    /// The surface of a LandXML, or the layer of a DXF, where the file has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<String>,
    /// Unit of a DXF, where its own is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<LengthUnit>,
}

/// An alignment from LandXML, DXF or a text table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlignmentFile {
    /// The file.
    pub file: PathBuf,
    /// The alignment of a LandXML, or the layer of a DXF, where the file has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
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
    /// A day that is none.
    #[error("`survey_date` = \"{date}\" is not a day: write e.g. \"2026-11-30\"")]
    BadDate {
        /// As written.
        date: String,
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
    /// A class that is left out and kept.
    #[error("survey `{file}`: {mark:?} stands in `leave_out` and in `keep`; take it out of one")]
    LeftOutAndKept {
        /// The survey's file.
        file: String,
        /// The class or flag.
        mark: PointMark,
    },
    /// An alignment without a design that needs one, or besides the design's own.
    #[error(
        "[alignment_file] goes with a [design] of `kind = \"section\"` that has no `alignment` of its own"
    )]
    AlignmentUnused,
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
    /// The tables that are settings, by name.
    pub fn settings(&self) -> [(&'static str, &toml::Table); 5] {
        [
            ("background", &self.background),
            ("segment", &self.segment),
            ("pose", &self.pose),
            ("bed", &self.bed),
            ("plan", &self.plan),
        ]
    }

    /// Whether coordinates are projected ones.
    pub fn has_crs(&self) -> bool {
        self.crs != "none"
    }

    /// Checks what the types cannot: the first of [`Self::problems`].
    pub fn check(&self) -> Result<(), SiteError> {
        self.problems().into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that the types cannot check, in the order of the file.
    pub fn problems(&self) -> Vec<SiteError> {
        let mut out = Vec::new();
        if let Err(e) = check_name("the site's `name`", &self.name) {
            out.push(e.into());
        }
        match self.crs.as_str() {
            "" => out.push(SiteError::NoCrs),
            "none" => {}
            crs => {
                let digits = crs.strip_prefix("EPSG:").unwrap_or_default();
                if digits.is_empty()
                    || digits.len() > 6
                    || !digits.bytes().all(|b| b.is_ascii_digit())
                {
                    out.push(SiteError::BadCrs { crs: crs.into() });
                }
            }
        }
        if !self.survey_date.is_empty() && !is_day(&self.survey_date) {
            out.push(SiteError::BadDate { date: self.survey_date.clone() });
        }
        if self.survey.is_empty() {
            out.push(SiteError::NoSurvey);
        }
        for survey in &self.survey {
            survey.problems(self.has_crs(), &mut out);
        }
        out.extend(self.area.iter().filter_map(|a| a.check().err()));
        out.extend(self.design_problem());
        out.extend(match self.ground {
            Some(GroundSpec::Plane(plane)) => positive("ground.slope_m", plane.slope_m).err(),
            Some(GroundSpec::Level { level_m }) => finite("ground.level_m", level_m).err(),
            None => None,
        });
        out
    }

    fn design_problem(&self) -> Option<SiteError> {
        let own = match &self.design {
            Some(DesignSurface::Section { alignment, .. }) => Some(!alignment.is_empty()),
            _ => None,
        };
        match (&self.alignment_file, own) {
            (Some(_), Some(false)) => {}
            (Some(_), _) => return Some(SiteError::AlignmentUnused),
            (None, _) => {}
        }
        match (&self.design, &self.design_file) {
            (Some(_), Some(_)) => Some(SiteError::TwoDesigns),
            // The alignment comes from its file.
            (Some(_), None) if self.alignment_file.is_some() => None,
            (Some(design), None) => design.check().err().map(Into::into),
            (None, Some(file)) => positive("design_file.cell_m", file.cell_m).err(),
            (None, None) => None,
        }
    }
}

impl SurveySpec {
    fn problems(&self, needs_offset: bool, out: &mut Vec<SiteError>) {
        let file = || self.file.display().to_string();
        match self.vertical_offset_m {
            Some(v) => out.extend(finite("survey.vertical_offset_m", v).err()),
            None if needs_offset => out.push(SiteError::NoOffset { file: file() }),
            None => {}
        }
        out.extend(
            self.sensors().flatten().find_map(|v| finite("survey.sensor_position", v).err()),
        );
        if let Some(mark) = self.leave_out.iter().find(|m| self.keep.contains(m)) {
            out.push(SiteError::LeftOutAndKept { file: file(), mark: *mark });
        }
    }

    /// Every stated sensor position, in the file's coordinates.
    pub fn sensors(&self) -> impl Iterator<Item = [f64; 3]> {
        self.sensor_position.into_iter().chain(self.sensor_positions.iter().copied())
    }
}

/// Whether the text is a day of the calendar as `YYYY-MM-DD`.
fn is_day(text: &str) -> bool {
    let number = |part: &str, long: usize| {
        let digits = part.len() == long && part.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| part.parse::<u32>().ok()).flatten()
    };
    let parts: Vec<&str> = text.split('-').collect();
    let [year, month, day] = parts[..] else { return false };
    let (Some(year), Some(month), Some(day)) = (number(year, 4), number(month, 2), number(day, 2))
    else {
        return false;
    };
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => 0,
    };
    (1..=days).contains(&day)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_of_the_calendar() {
        for day in ["2026-11-30", "2024-02-29", "2000-02-29", "2026-12-31"] {
            assert!(is_day(day), "{day}");
        }
        for other in
            ["2026-11-31", "2023-02-29", "1900-02-29", "2026-13-01", "2026-1-3", "30.11.2026"]
        {
            assert!(!is_day(other), "{other}");
        }
        let text =
            "name = \"s\"\ncrs = \"none\"\nsurvey_date = \"soon\"\n[[survey]]\nfile = \"a.laz\"\n";
        let spec: SiteSpec = toml::from_str(text).unwrap();
        assert!(matches!(&spec.problems()[..], [SiteError::BadDate { date }] if date == "soon"));
    }
}
