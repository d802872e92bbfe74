//! Clouds as files have them, as one local survey.

use crate::error::OrBadInput;
use crate::local_survey::{RawSurvey, local_survey};
use crate::{Error, Result};
use anyhow::anyhow;
use geom::{DVec3, Event, Observer};
use io::{IoError, RawCloud};
use scene::{Area, AxisOrder, SensorKind, Survey};
use std::path::{Path, PathBuf};

/// How clouds without a site were measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clouds {
    /// One survey each.
    pub files: Vec<PathBuf>,
    /// Kind of sensor.
    pub sensor: SensorKind,
    /// Where the sensor was, in the clouds' coordinates; empty: what the files say, or straight above.
    pub sensor_positions: Vec<[f64; 3]>,
    /// The part that is read; `None`: all of them.
    pub area: Option<Area>,
}

impl Clouds {
    /// All of them as one local survey; columns other than the positions and survey lines are dropped.
    pub(crate) fn survey(&self, observer: &dyn Observer) -> Result<Survey> {
        let mut crs = String::new();
        let mut raw = Vec::new();
        for file in &self.files {
            let cloud = cloud(file, self.area.as_ref(), AxisOrder::EastNorth, observer)?;
            if let Some(code) = &cloud.crs {
                crs.clone_from(code);
            }
            let given = self.sensor_positions.iter().copied();
            raw.push(raw_survey(file, cloud, self.sensor, given, 0.0));
        }
        local_survey(&raw, AxisOrder::EastNorth, &crs, "").or_bad_input()
    }
}

/// All surveys of a site in one local frame.
pub(crate) fn of_site(site: &io::site::Site, observer: &dyn Observer) -> Result<Survey> {
    let mut raw = Vec::new();
    for (spec, file) in site.spec.survey.iter().zip(&site.survey_files) {
        let cloud = cloud(file, site.spec.area.as_ref(), site.spec.axis_order, observer)?;
        let offset_m = spec.vertical_offset_m.unwrap_or(0.0);
        raw.push(raw_survey(file, cloud, spec.sensor, spec.sensors(), offset_m));
    }
    local_survey(&raw, site.spec.axis_order, &site.spec.crs, &site.spec.vertical_datum)
        .or_bad_input()
}

/// What a file holds with what is said of it; sensor positions that are stated count before the file's own.
fn raw_survey(
    file: &Path,
    cloud: RawCloud,
    sensor: SensorKind,
    stated: impl Iterator<Item = [f64; 3]>,
    vertical_offset_m: f64,
) -> RawSurvey {
    let mut sensor_position: Vec<DVec3> = stated.map(DVec3::from_array).collect();
    if sensor_position.is_empty() {
        sensor_position = cloud.sensor_positions;
    }
    RawSurvey {
        file: file.display().to_string(),
        position: cloud.position,
        line: cloud.line.unwrap_or_default(),
        sensor,
        sensor_position,
        vertical_offset_m,
    }
}

/// A cloud, or what of it lies in the area; of a COPC only the tiles that touch it are read.
fn cloud(
    file: &Path,
    area: Option<&Area>,
    axes: AxisOrder,
    observer: &dyn Observer,
) -> Result<RawCloud> {
    let Some(area) = area else { return io::points::read(file, observer).or_bad_input() };
    area.check().or_bad_input()?;
    let [low, high] = area.corners(axes);
    let cloud = io::points::read_box(file, low, high, observer).map_err(|e| match e {
        IoError::NoPoints { path } => Error::bad_input(anyhow!(
            "{}: none of its points lies in the area (east {} to {}, north {} to {}); is the axis order right?",
            path.display(),
            area.west,
            area.east,
            area.south,
            area.north
        )),
        e => Error::bad_input(e),
    })?;
    let message = format!("{}: {} points in the area", file.display(), cloud.len());
    observer.event(Event::Noted { stage: "read", message });
    Ok(cloud)
}
