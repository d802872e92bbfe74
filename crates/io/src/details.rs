//! What drawings and tables show beside the blocks: alignment, design, what stays unfilled, quantities.

use scene::SectionQuantity;

/// Site coordinates, metres. The default shows nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Details {
    /// Day of the survey, `YYYY-MM-DD`; empty when unknown.
    pub survey_date: String,
    /// The line chainages run along: east, north.
    pub alignment: Vec<[f64; 2]>,
    /// Lines of the design, each with whether it closes.
    pub design_lines: Vec<(bool, Vec<[f64; 3]>)>,
    /// Places that stay below the design.
    pub unfilled: Vec<Unfilled>,
    /// Areas and volumes by section.
    pub quantities: Vec<SectionQuantity>,
}

/// A square place that stays below the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Unfilled {
    /// East and north of its middle.
    pub centre: [f64; 2],
    /// Half its edge, metres.
    pub half_m: f64,
    /// Volume missing in it, m³.
    pub void_m3: f64,
    /// Why no block went there.
    pub reason: String,
}

impl Details {
    /// The day where it is a date, else the first day of the year 2000: formats demand one, and the same result has to
    /// give the same bytes.
    pub(crate) fn date(&self) -> &str {
        let digits = |s: &str, n: usize| s.len() == n && s.bytes().all(|b| b.is_ascii_digit());
        let mut parts = self.survey_date.split('-');
        let date = parts.next().is_some_and(|y| digits(y, 4))
            && parts.next().is_some_and(|m| digits(m, 2))
            && parts.next().is_some_and(|d| digits(d, 2))
            && parts.next().is_none();
        if date { &self.survey_date } else { "2000-01-01" }
    }

    /// Places at each of these distances along the alignment, with the direction there.
    pub(crate) fn stations(&self, step_m: f64) -> Vec<(f64, [f64; 2], [f64; 2])> {
        let mut list = Vec::new();
        let (mut start, mut next) = (0.0, 0.0);
        for w in self.alignment.windows(2) {
            let [dx, dy] = [w[1][0] - w[0][0], w[1][1] - w[0][1]];
            let long = dx.hypot(dy);
            while long > 0.0 && next <= start + long + 1e-9 {
                let f = (next - start) / long;
                let along = [dx / long, dy / long];
                list.push((next, [w[0][0] + dx * f, w[0][1] + dy * f], along));
                next += step_m;
            }
            start += long;
        }
        list
    }
}

/// `No.3+12`: stations of 20 m.
pub(crate) fn station(metres: f64) -> String {
    let number = (metres / 20.0 + 1e-6).floor();
    let rest = metres - number * 20.0;
    match rest {
        r if r.abs() < 0.005 => format!("No.{number:.0}"),
        r if (r - r.round()).abs() < 0.005 => format!("No.{number:.0}+{r:.0}"),
        r => format!("No.{number:.0}+{r:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_follow_the_bend() {
        let details =
            Details { alignment: vec![[0.0, 0.0], [10.0, 0.0], [10.0, 5.0]], ..Details::default() };
        let places: Vec<[f64; 2]> = details.stations(5.0).into_iter().map(|s| s.1).collect();
        assert_eq!(places, [[0.0, 0.0], [5.0, 0.0], [10.0, 0.0], [10.0, 5.0]]);
        assert_eq!([station(0.0), station(72.0), station(72.5)], ["No.0", "No.3+12", "No.3+12.50"]);
    }

    #[test]
    fn a_date_is_a_date_or_the_fixed_one() {
        let date =
            |d: &str| Details { survey_date: d.into(), ..Details::default() }.date().to_string();
        assert_eq!(date("2026-11-30"), "2026-11-30");
        for other in ["", "2026-1-3", "30 Nov\" onload", "2026-11-30-1"] {
            assert_eq!(date(other), "2000-01-01");
        }
    }
}
