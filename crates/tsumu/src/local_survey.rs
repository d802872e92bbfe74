//! From what the files say to one [`Survey`] in the site's local frame.

use geom::{DVec3, PointCloud};
use scene::{AxisOrder, SensorKind, SiteFrame, Survey};

/// Files that make no survey.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SurveyError {
    /// The site names no survey.
    #[error("the site has no [[survey]]: add one with file = \"…\"")]
    NoSurvey,
    /// A cloud without points.
    #[error("{file}: the cloud has no points")]
    EmptySurvey {
        /// The file.
        file: String,
    },
    /// A coordinate that is NaN or infinite.
    #[error("{file}: point {} has a coordinate that is not a number; remove it in the program that wrote the file", point + 1)]
    NotFinite {
        /// The file.
        file: String,
        /// Index of the point, from 0.
        point: usize,
    },
    /// More lines than a point can name.
    #[error("{file}: with it the surveys have more than 65535 lines; join fewer of them")]
    TooManyLines {
        /// The file.
        file: String,
    },
}

/// One file's points as read, with what the site says of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct RawSurvey {
    /// The file, for messages.
    pub file: String,
    /// Which way its axes run.
    pub axis_order: AxisOrder,
    /// Points in the file's own order of axes.
    pub position: Vec<DVec3>,
    /// Survey line of each point, 0 = unknown; empty when the file does not say.
    pub line: Vec<u16>,
    /// How they were measured.
    pub sensor: SensorKind,
    /// Sensor positions in the file's own order of axes; empty when unknown.
    pub sensor_position: Vec<DVec3>,
    /// Added to every height to reach the site's vertical datum, metres.
    pub vertical_offset_m: f64,
}

/// Joins the surveys in one local frame whose origin is a round number near their middle.
///
/// Surveys of several sensors are joined too; the noisiest decides the expected noise.
/// Errors: no points at all, a coordinate that is not a number, more survey lines than can be told apart.
pub(crate) fn local_survey(
    raw: &[RawSurvey],
    crs: &str,
    vertical_datum: &str,
) -> Result<Survey, SurveyError> {
    let to_site = |p: DVec3, part: &RawSurvey| {
        part.axis_order.east_north_up(p) + DVec3::new(0.0, 0.0, part.vertical_offset_m)
    };
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for survey in raw {
        if survey.position.is_empty() {
            return Err(SurveyError::EmptySurvey { file: survey.file.clone() });
        }
        for (i, &p) in survey.position.iter().enumerate() {
            if !p.is_finite() {
                return Err(SurveyError::NotFinite { file: survey.file.clone(), point: i });
            }
            let p = to_site(p, survey);
            (low, high) = (low.min(p), high.max(p));
        }
    }
    if raw.is_empty() {
        return Err(SurveyError::NoSurvey);
    }
    let frame = SiteFrame {
        origin: round_origin(low, high).to_array(),
        crs: crs.to_string(),
        vertical_datum: vertical_datum.to_string(),
    };
    let mut survey =
        Survey { frame, sensor: noisiest(raw.iter().map(|r| r.sensor)), ..Survey::default() };
    // Points live once: tens of millions of them are most of a run's memory.
    let mut positions = Vec::with_capacity(raw.iter().map(|part| part.position.len()).sum());
    for part in raw {
        let local = |p: &DVec3| survey.frame.local_from_site(to_site(*p, part));
        let sensors: Vec<_> = part.sensor_position.iter().map(local).collect();
        positions.extend(part.position.iter().map(local));
        survey.sensor_positions.extend(sensors);
    }
    survey.line = joined_lines(raw)?;
    survey.cloud = PointCloud::from_positions(positions);
    Ok(survey)
}

/// Lines of all files, numbered on from file to file; empty when no file has any.
fn joined_lines(raw: &[RawSurvey]) -> Result<Vec<u16>, SurveyError> {
    if raw.iter().all(|part| part.line.is_empty()) {
        return Ok(Vec::new());
    }
    let mut joined = Vec::new();
    let mut last = 0_u16;
    for part in raw {
        if part.line.len() != part.position.len() {
            joined.extend(std::iter::repeat_n(0, part.position.len()));
            continue;
        }
        let lines = part.line.iter().copied().max().unwrap_or(0);
        let next = last
            .checked_add(lines)
            .ok_or_else(|| SurveyError::TooManyLines { file: part.file.clone() })?;
        joined.extend(part.line.iter().map(|&line| if line == 0 { 0 } else { line + last }));
        last = next;
    }
    Ok(joined)
}

/// Within 10 m of the middle for projected coordinates, zero for coordinates that f32 holds to 10 µm anyway.
pub(crate) fn round_origin(low: DVec3, high: DVec3) -> DVec3 {
    let one = |low: f64, high: f64| {
        let middle = (low + high) / 2.0;
        if low.abs().max(high.abs()) < 100.0 { 0.0 } else { (middle / 10.0).round() * 10.0 }
    };
    DVec3::new(one(low.x, high.x), one(low.y, high.y), one(low.z, high.z))
}

/// The kind with the most noise decides what noise is expected.
pub(crate) fn noisiest(kinds: impl Iterator<Item = SensorKind>) -> SensorKind {
    let noise = |kind: SensorKind| kind.noise_sd_m(0.0);
    let noisier = |a: SensorKind, b: SensorKind| if noise(b) > noise(a) { b } else { a };
    kinds.reduce(noisier).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(points: &[[f64; 3]]) -> RawSurvey {
        RawSurvey {
            file: "a.laz".into(),
            position: points.iter().map(|&p| DVec3::from_array(p)).collect(),
            vertical_offset_m: 0.5,
            ..RawSurvey::default()
        }
    }

    #[test]
    fn large_coordinates_keep_their_millimetres() {
        let survey = local_survey(
            &[raw(&[[43_210.125, -98_765.25, 3.0], [43_212.0, -98_760.0, 4.0]])],
            "EPSG:6679",
            "T.P.",
        )
        .unwrap();
        let back = survey.frame.site_from_local(survey.cloud.position_m[0]);
        assert!((back - DVec3::new(43_210.125, -98_765.25, 3.5)).length() < 1e-5);
    }

    #[test]
    fn north_east_files_are_turned() {
        let survey = local_survey(
            &[RawSurvey { axis_order: AxisOrder::NorthEast, ..raw(&[[-98_765.0, 43_210.0, 3.0]]) }],
            "EPSG:6679",
            "",
        )
        .unwrap();
        let back = survey.frame.site_from_local(survey.cloud.position_m[0]);
        assert!((back - DVec3::new(43_210.0, -98_765.0, 3.5)).length() < 1e-5);
    }

    #[test]
    fn a_single_survey_keeps_its_sensor() {
        for sensor in [SensorKind::Uav, SensorKind::Mbes, SensorKind::DepthCamera] {
            let one = RawSurvey { sensor, ..raw(&[[1.0, 2.0, 3.0]]) };
            assert_eq!(local_survey(&[one], "", "").unwrap().sensor, sensor);
        }
        let both = [RawSurvey { sensor: SensorKind::Mbes, ..raw(&[[0.0; 3]]) }, raw(&[[1.0; 3]])];
        assert_eq!(local_survey(&both, "", "").unwrap().sensor, SensorKind::Mbes);
    }

    /// Lines beyond the 65,535th were once taken for one.
    #[test]
    fn more_lines_than_numbers_are_refused() {
        let part = |line: u16| RawSurvey { line: vec![line], ..raw(&[[1.0, 2.0, 3.0]]) };
        let join = |a, b| local_survey(&[part(a), part(b)], "", "");
        assert_eq!(join(60_000, 5_535).unwrap().line, [60_000, 65_535]);
        assert!(join(60_000, 5_536).unwrap_err().to_string().contains("a.laz"));
    }

    #[test]
    fn bad_surveys_are_named() {
        let at = |r: Result<Survey, SurveyError>| r.unwrap_err().to_string();
        assert!(at(local_survey(&[raw(&[])], "", "")).contains("a.laz"));
        assert!(at(local_survey(&[raw(&[[0.0, f64::NAN, 0.0]])], "", "")).contains("point 1"));
    }
}
