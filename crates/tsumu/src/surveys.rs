//! Clouds as files have them, as one local survey.

use crate::error::OrBadInput;
use crate::local_survey::{RawSurvey, local_survey};
use crate::own_records::OwnRecords;
use crate::{Error, Result};
use anyhow::anyhow;
use geom::{DVec3, Event, Observer, Stage, Warning};
use io::crs::FileCrs;
use io::read_options::{Reason, describe};
use io::{IoError, RawCloud, ReadOptions};
use preflight::{Preflight, SurveyLook};
use scene::{
    Area, AxisOrder, Catalog, Ground, GroundSpec, SensorKind, Severity, SiteFrame, Survey,
};
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

/// Surveys joined, and the way back to the one file they may be.
pub(crate) struct Joined {
    /// All of them in one local frame.
    pub survey: Survey,
    /// What each file says of its coordinates, by its path.
    pub references: Vec<(String, FileCrs)>,
    /// Step of each file's stored numbers, metres, by its path.
    pub steps_m: Vec<(String, f64)>,
    /// The points' places in their file; `None` where several files, or a kind without records, were read.
    pub records: Option<OwnRecords>,
}

impl Clouds {
    /// All of them as one local survey; columns other than the positions and survey lines are dropped.
    pub(crate) fn survey(&self, observer: &dyn Observer) -> Result<Joined> {
        let mut parts = Parts::default();
        for file in &self.files {
            let options = ReadOptions::survey();
            let axes = AxisOrder::EastNorth;
            let cloud = cloud(file, self.area.as_ref(), axes, &options, observer)?;
            let given = self.sensor_positions.iter().copied();
            let raw = RawSurvey { sensor: self.sensor, ..raw_survey(file, &cloud, given, axes) };
            parts.add(file, cloud, raw, self.area.is_some());
        }
        agree("", &parts.references, observer)?;
        let crs = parts.references.iter().rev().find_map(|(_, crs)| crs.epsg()).unwrap_or_default();
        parts.join(&crs, "")
    }
}

/// All surveys of a site in one local frame.
pub(crate) fn of_site(site: &io::site::Site, observer: &dyn Observer) -> Result<Joined> {
    let mut parts = Parts::default();
    for number in 0..site.survey_files.len() {
        parts.read(site, number, observer)?;
    }
    parts.join(&site.spec.crs, &site.spec.vertical_datum)
}

/// The same, checked while it is read: one pass over each file. What the check finds comes beside the surveys, which there are only
/// where nothing rules an answer out.
pub(crate) fn of_site_checked(
    site: &io::site::Site,
    observer: &dyn Observer,
) -> (Preflight, Option<Result<Joined>>) {
    let mut parts = Parts::default();
    let found = preflight::check_read(site, &mut |number| parts.read(site, number, observer));
    let can = found.can_be_answered;
    let joined = can.then(|| parts.join(&site.spec.crs, &site.spec.vertical_datum));
    (found, joined)
}

/// Holds what files say of their coordinates against the site and against each other: contradictions are bad input, one line
/// each, naming both codes; doubts are warned of.
pub(crate) fn agree(
    site_crs: &str,
    references: &[(String, FileCrs)],
    observer: &dyn Observer,
) -> Result<()> {
    let all = io::crs::disagreements(site_crs, references);
    for doubt in all.iter().filter(|c| c.severity == Severity::Warning) {
        let message = doubt.to_string();
        observer.event(Event::Warned(Warning { stage: Stage::Read, message }));
    }
    let refusals = all.iter().filter(|c| c.severity == Severity::Refusal);
    Error::of_lines(refusals.map(ToString::to_string).collect()).map_or(Ok(()), Err)
}

/// Refuses surveys whose numbers are stored in steps that hide every block; a line each.
pub(crate) fn fine_enough(steps_m: &[(String, f64)], catalog: &Catalog) -> Result<()> {
    let objection = |(file, step_m): &(String, f64)| {
        let found = preflight::step_objection(*step_m, catalog)?;
        Some(format!("{file}: {found}; export the survey with millimetres"))
    };
    Error::of_lines(steps_m.iter().filter_map(objection).collect()).map_or(Ok(()), Err)
}

/// Files read so far.
#[derive(Default)]
struct Parts {
    raw: Vec<RawSurvey>,
    references: Vec<(String, FileCrs)>,
    steps_m: Vec<(String, f64)>,
    records: Vec<Option<OwnRecords>>,
}

impl Parts {
    /// Reads the site's survey of this number; what it holds.
    fn read(
        &mut self,
        site: &io::site::Site,
        number: usize,
        observer: &dyn Observer,
    ) -> Result<SurveyLook> {
        let (spec, file) = (&site.spec.survey[number], &site.survey_files[number]);
        let (area, axes) = (site.spec.area.as_ref(), site.spec.axis_order);
        let offset_m = spec.vertical_offset_m.unwrap_or(0.0);
        let cloud = cloud(file, area, axes, &ReadOptions::of_survey(spec), observer)?;
        let look = preflight::look_of_cloud(file, &cloud, axes, offset_m);
        let raw = RawSurvey {
            sensor: spec.sensor,
            vertical_offset_m: offset_m,
            ..raw_survey(file, &cloud, spec.sensors(), axes)
        };
        self.add(file, cloud, raw, area.is_some());
        Ok(look)
    }

    fn add(&mut self, file: &Path, cloud: RawCloud, raw: RawSurvey, partly: bool) {
        self.references.push((raw.file.clone(), cloud.reference.clone()));
        self.steps_m.push((raw.file.clone(), cloud.step()));
        self.records.push(OwnRecords::of(file, &cloud, &raw, partly));
        let (position, line) = (cloud.position, cloud.line.unwrap_or_default());
        self.raw.push(RawSurvey { position, line, ..raw });
    }

    fn join(mut self, crs: &str, vertical_datum: &str) -> Result<Joined> {
        let survey = local_survey(&self.raw, crs, vertical_datum).or_bad_input()?;
        let one = self.records.len() == 1;
        let records = self.records.pop().flatten().filter(|_| one);
        Ok(Joined { survey, references: self.references, steps_m: self.steps_m, records })
    }
}

/// What a file says with what is said of it, without its points; sensor positions that are stated count before the file's own.
/// Columns that are named after the directions are not turned again.
fn raw_survey(
    file: &Path,
    cloud: &RawCloud,
    stated: impl Iterator<Item = [f64; 3]>,
    axes: AxisOrder,
) -> RawSurvey {
    let mut sensor_position: Vec<DVec3> = stated.map(DVec3::from_array).collect();
    if sensor_position.is_empty() {
        sensor_position.clone_from(&cloud.sensor_positions);
    }
    RawSurvey {
        file: file.display().to_string(),
        axis_order: if cloud.named_axes { AxisOrder::EastNorth } else { axes },
        sensor_position,
        ..RawSurvey::default()
    }
}

/// A cloud, or what of it lies in the area; of a COPC only the tiles that touch it are read. Points left out by class or flag
/// are warned of.
fn cloud(
    file: &Path,
    area: Option<&Area>,
    axes: AxisOrder,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud> {
    let cloud = match area {
        None => io::points::read_with(file, options, observer).or_bad_input()?,
        Some(area) => part(file, area, axes, options, observer)?,
    };
    let marked = cloud.left_out.iter().filter(|(reason, _)| **reason != Reason::Invalid);
    let marked = marked.map(|(reason, n)| (*reason, *n)).collect();
    let points = describe(&marked);
    if !points.is_empty() {
        let message = format!("{}: left out {points}", file.display());
        observer.event(Event::Warned(Warning { stage: Stage::Read, message }));
    }
    Ok(cloud)
}

fn part(
    file: &Path,
    area: &Area,
    axes: AxisOrder,
    options: &ReadOptions,
    observer: &dyn Observer,
) -> Result<RawCloud> {
    area.check().or_bad_input()?;
    let none = || {
        Error::bad_input(anyhow!(
            "{}: none of its points lies in the area (east {} to {}, north {} to {}); is the axis order right?",
            file.display(),
            area.west,
            area.east,
            area.south,
            area.north
        ))
    };
    let read = |axes: AxisOrder| {
        let [low, high] = area.corners(axes);
        io::points::read_box_with(file, low, high, options, observer)
    };
    let turned = axes != AxisOrder::EastNorth;
    let cloud = match read(axes) {
        // Columns named after the directions do not follow the site's order of axes: the corners were another place's.
        Ok(cloud) if cloud.named_axes && turned => read(AxisOrder::EastNorth),
        Err(IoError::NoPoints { .. }) if turned => match read(AxisOrder::EastNorth) {
            Ok(cloud) if cloud.named_axes => Ok(cloud),
            _ => return Err(none()),
        },
        other => other,
    };
    let cloud = match cloud {
        Err(IoError::NoPoints { .. }) => return Err(none()),
        other => other.or_bad_input()?,
    };
    let message = format!("{}: {} points in the area", file.display(), cloud.len());
    observer.event(Event::Noted { stage: Stage::Read, message });
    Ok(cloud)
}

/// A bed that is stated in site coordinates, in a local frame.
pub(crate) fn ground_of(ground: &GroundSpec, frame: &SiteFrame) -> Ground {
    match ground {
        GroundSpec::Level { level_m } => Ground::Level { z_m: (level_m - frame.origin[2]) as f32 },
        GroundSpec::Plane(plane) => {
            let (sin, cos) = plane.falls_towards_deg.to_radians().sin_cos();
            let normal =
                DVec3::new(sin / plane.slope_m, cos / plane.slope_m, 1.0).normalize().as_vec3();
            let point = DVec3::new(plane.point[0], plane.point[1], plane.level_m);
            Ground::Plane { point: frame.local_from_site(point), normal }
        }
    }
}
