//! The design surface: how high the finished works should stand at each place.

use serde::{Deserialize, Serialize};

/// Heights in the site's vertical datum, positions in site coordinates (east, north), metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum DesignSurface {
    /// One level everywhere inside `boundary`.
    Level {
        /// Height, metres.
        level_m: f64,
        /// Corners of the area, site coordinates; at least three.
        boundary: Vec<[f64; 2]>,
    },
    /// The lowest of several sloping planes inside `boundary`.
    Planes {
        /// Planes; the surface is the minimum of them.
        plane: Vec<SlopingPlane>,
        /// Corners of the area.
        boundary: Vec<[f64; 2]>,
    },
    /// A cross-section swept along an alignment.
    Section {
        /// Points of the alignment polyline (crest centre line), at least two; none when they come from a file.
        #[serde(default)]
        alignment: Vec<[f64; 2]>,
        /// Height of the crest, metres.
        crest_level_m: f64,
        /// Width of the crest, metres.
        crest_width_m: f64,
        /// Slope left of the alignment, 1 vertical to `m` horizontal.
        left_slope_m: f64,
        /// Slope on the right.
        right_slope_m: f64,
        /// Height where the slopes end, metres.
        toe_level_m: f64,
    },
    /// A regular grid of heights; NaN where nothing is designed.
    Grid {
        /// East and north of the first node.
        origin: [f64; 2],
        /// Spacing, metres.
        cell_m: f64,
        /// Nodes along east.
        columns: usize,
        /// Heights, row by row northwards.
        level_m: Vec<f64>,
    },
}

/// A plane through a point, falling in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlopingPlane {
    /// A point of the plane, site coordinates.
    pub point: [f64; 2],
    /// Its height, metres.
    pub level_m: f64,
    /// Compass direction in which the plane falls, degrees clockwise from north.
    pub falls_towards_deg: f64,
    /// 1 vertical to `slope_m` horizontal.
    pub slope_m: f64,
}

/// Corners of a boundary and points of an alignment, at most: every cell of a plan is held against each of them. Ten kilometres of
/// works with a point every metre have so many.
pub const MOST_CORNERS: usize = 10_000;

/// Why a design surface makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// Too few corners or alignment points.
    #[error("design.{key} needs at least {need} points, found {found}")]
    TooFewPoints {
        /// Key in the file.
        key: &'static str,
        /// Points needed.
        need: usize,
        /// Points found.
        found: usize,
    },
    /// More corners or alignment points than a place can be held against.
    #[error(
        "design.{key} has {found} points, at most {MOST_CORNERS} are taken; leave out those on straight stretches"
    )]
    TooManyPoints {
        /// Key in the file.
        key: &'static str,
        /// Points found.
        found: usize,
    },
    /// A number out of range.
    #[error("design.{key} = {value} is not allowed: {why}")]
    BadValue {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        why: &'static str,
    },
}

impl DesignSurface {
    /// Checks ranges and counts.
    pub fn check(&self) -> Result<(), DesignError> {
        self.check_finite()?;
        let need = |key, points: &[[f64; 2]], need| {
            if points.len() < need {
                Err(DesignError::TooFewPoints { key, need, found: points.len() })
            } else if points.len() > MOST_CORNERS {
                Err(DesignError::TooManyPoints { key, found: points.len() })
            } else {
                Ok(())
            }
        };
        let positive = |key, value: f64| {
            if value > 0.0 {
                Ok(())
            } else {
                Err(DesignError::BadValue { key, value, why: "it must be above 0" })
            }
        };
        match self {
            Self::Level { boundary, .. } => need("boundary", boundary, 3),
            Self::Planes { plane, boundary } => {
                need("boundary", boundary, 3)?;
                if plane.is_empty() {
                    return Err(DesignError::TooFewPoints { key: "plane", need: 1, found: 0 });
                }
                plane.iter().try_for_each(|p| positive("plane.slope_m", p.slope_m))
            }
            Self::Section {
                alignment,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            } => {
                need("alignment", alignment, 2)?;
                positive("crest_width_m", *crest_width_m)?;
                positive("left_slope_m", *left_slope_m)?;
                positive("right_slope_m", *right_slope_m)?;
                if toe_level_m >= crest_level_m {
                    return Err(DesignError::BadValue {
                        key: "toe_level_m",
                        value: *toe_level_m,
                        why: "it must be below crest_level_m",
                    });
                }
                Ok(())
            }
            Self::Grid { cell_m, columns, level_m, .. } => {
                positive("cell_m", *cell_m)?;
                if *columns < 2 || level_m.len() % columns != 0 || level_m.len() / columns < 2 {
                    return Err(DesignError::BadValue {
                        key: "columns",
                        value: *columns as f64,
                        why: "level_m must fill whole rows, at least 2 × 2",
                    });
                }
                Ok(())
            }
        }
    }

    /// Every number but a grid's heights (NaN there: nothing is designed) must be finite.
    fn check_finite(&self) -> Result<(), DesignError> {
        let points = |key: &'static str, points: &[[f64; 2]]| {
            points.iter().flatten().find(|v| !v.is_finite()).map(|&value| (key, value))
        };
        let numbers =
            |numbers: &[(&'static str, f64)]| numbers.iter().find(|(_, v)| !v.is_finite()).copied();
        let bad = match self {
            Self::Level { level_m, boundary } => {
                numbers(&[("level_m", *level_m)]).or_else(|| points("boundary", boundary))
            }
            Self::Planes { plane, boundary } => {
                let of = |p: &SlopingPlane| {
                    numbers(&[
                        ("plane.point", p.point[0]),
                        ("plane.point", p.point[1]),
                        ("plane.level_m", p.level_m),
                        ("plane.falls_towards_deg", p.falls_towards_deg),
                        ("plane.slope_m", p.slope_m),
                    ])
                };
                plane.iter().find_map(of).or_else(|| points("boundary", boundary))
            }
            Self::Section {
                alignment,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            } => numbers(&[
                ("crest_level_m", *crest_level_m),
                ("crest_width_m", *crest_width_m),
                ("left_slope_m", *left_slope_m),
                ("right_slope_m", *right_slope_m),
                ("toe_level_m", *toe_level_m),
            ])
            .or_else(|| points("alignment", alignment)),
            Self::Grid { origin, cell_m, level_m, .. } => {
                let infinite = level_m.iter().find(|v| v.is_infinite()).map(|&v| ("level_m", v));
                numbers(&[("origin", origin[0]), ("origin", origin[1]), ("cell_m", *cell_m)])
                    .or(infinite)
            }
        };
        match bad {
            Some((key, value)) => {
                Err(DesignError::BadValue { key, value, why: "it must be a finite number" })
            }
            None => Ok(()),
        }
    }

    /// Design height at a site position (east, north), or `None` outside the works.
    pub fn level_at(&self, east: f64, north: f64) -> Option<f64> {
        match self {
            Self::Level { level_m, boundary } => inside(boundary, east, north).then_some(*level_m),
            Self::Planes { plane, boundary } => inside(boundary, east, north).then(|| {
                let level = |p: &SlopingPlane| {
                    let (sin, cos) = p.falls_towards_deg.to_radians().sin_cos();
                    let along = (east - p.point[0]) * sin + (north - p.point[1]) * cos;
                    p.level_m - along / p.slope_m
                };
                plane.iter().map(level).fold(f64::INFINITY, f64::min)
            }),
            Self::Section {
                alignment,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            } => {
                let offset = offset_from_alignment(alignment, east, north)?;
                let beyond = (offset.abs() - crest_width_m / 2.0).max(0.0);
                // Positive offsets lie left of the direction of travel.
                let slope = if offset > 0.0 { left_slope_m } else { right_slope_m };
                let level = crest_level_m - beyond / slope;
                (level >= *toe_level_m).then_some(level)
            }
            Self::Grid { origin, cell_m, columns, level_m } => {
                let rows = level_m.len() / columns;
                let (u, v) = ((east - origin[0]) / cell_m, (north - origin[1]) / cell_m);
                if !(0.0..=(columns - 1) as f64).contains(&u)
                    || !(0.0..=(rows - 1) as f64).contains(&v)
                {
                    return None;
                }
                let (i, j) = ((u as usize).min(columns - 2), (v as usize).min(rows - 2));
                let (fu, fv) = (u - i as f64, v - j as f64);
                let at = |i: usize, j: usize| level_m[j * columns + i];
                let level = at(i, j) * (1.0 - fu) * (1.0 - fv)
                    + at(i + 1, j) * fu * (1.0 - fv)
                    + at(i, j + 1) * (1.0 - fu) * fv
                    + at(i + 1, j + 1) * fu * fv;
                level.is_finite().then_some(level)
            }
        }
    }

    /// The same design higher by this much; of a section the crest alone.
    #[must_use]
    pub fn raised(mut self, by_m: f64) -> Self {
        match &mut self {
            Self::Level { level_m, .. } => *level_m += by_m,
            Self::Planes { plane, .. } => plane.iter_mut().for_each(|p| p.level_m += by_m),
            Self::Section { crest_level_m, .. } => *crest_level_m += by_m,
            Self::Grid { level_m, .. } => level_m.iter_mut().for_each(|z| *z += by_m),
        }
        self
    }

    /// The same design with all its slopes 1 to `slope_m`; `None` for one that has none.
    #[must_use]
    pub fn with_slope(mut self, slope_m: f64) -> Option<Self> {
        match &mut self {
            Self::Planes { plane, .. } => plane.iter_mut().for_each(|p| p.slope_m = slope_m),
            Self::Section { left_slope_m, right_slope_m, .. } => {
                (*left_slope_m, *right_slope_m) = (slope_m, slope_m);
            }
            Self::Level { .. } | Self::Grid { .. } => return None,
        }
        Some(self)
    }

    /// The same design along this alignment; a design that is no section stays as it is.
    #[must_use]
    pub fn along(self, points: Vec<[f64; 2]>) -> Self {
        match self {
            Self::Section {
                alignment: _,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            } => Self::Section {
                alignment: points,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            },
            other => other,
        }
    }

    /// Lowest and highest design height, metres; `None` when nothing is designed. Sloping planes are taken at the corners of their
    /// boundary.
    pub fn levels(&self) -> Option<[f64; 2]> {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let finite = values.filter(|v| v.is_finite());
            let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(v), high.max(v)]
            });
            (low <= high).then_some([low, high])
        };
        match self {
            Self::Level { level_m, .. } => range(&mut [*level_m].into_iter()),
            Self::Planes { boundary, plane } => {
                // The corners themselves lie on the edge; the planes have a height there all the same.
                let everywhere =
                    Self::Planes { plane: plane.clone(), boundary: self.around().to_vec() };
                range(&mut boundary.iter().filter_map(|p| everywhere.level_at(p[0], p[1])))
            }
            Self::Section { crest_level_m, toe_level_m, .. } => {
                range(&mut [*toe_level_m, *crest_level_m].into_iter())
            }
            Self::Grid { level_m, .. } => range(&mut level_m.iter().copied()),
        }
    }

    /// Corners of a box one metre wider than the works.
    fn around(&self) -> [[f64; 2]; 4] {
        let [[w, s], [e, n]] = self.extent();
        [[w - 1.0, s - 1.0], [e + 1.0, s - 1.0], [e + 1.0, n + 1.0], [w - 1.0, n + 1.0]]
    }

    /// Why the design cannot be for a survey with these lowest and highest heights: a part of it lies more than 100 m off, as
    /// heights in another unit or no-data marks do. `None`: it can.
    pub fn heights_objection(&self, survey_low_m: f64, survey_high_m: f64) -> Option<String> {
        const MOST_M: f64 = 100.0;
        let [low, high] = self.levels()?;
        let off = (survey_low_m - low).max(high - survey_high_m);
        (off > MOST_M).then(|| {
            format!(
                "the design's heights are {low:.2} to {high:.2} m, the survey's {survey_low_m:.2} to {survey_high_m:.2} m: they cannot belong together; check the unit, the no-data value and the vertical datum of the design"
            )
        })
    }

    /// Smallest box (east, north) around the works: `[min, max]`.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        let around = |points: &[[f64; 2]], margin: f64| {
            let fold = |f: fn(f64, f64) -> f64, start: f64, axis: usize| {
                points.iter().map(|p| p[axis]).fold(start, f)
            };
            let low = |axis| fold(f64::min, f64::INFINITY, axis) - margin;
            let high = |axis| fold(f64::max, f64::NEG_INFINITY, axis) + margin;
            [[low(0), low(1)], [high(0), high(1)]]
        };
        match self {
            Self::Level { boundary, .. } | Self::Planes { boundary, .. } => around(boundary, 0.0),
            Self::Section {
                alignment,
                crest_level_m,
                crest_width_m,
                left_slope_m,
                right_slope_m,
                toe_level_m,
            } => {
                let reach = crest_width_m / 2.0
                    + (crest_level_m - toe_level_m) * left_slope_m.max(*right_slope_m);
                around(alignment, reach)
            }
            Self::Grid { origin, cell_m, columns, level_m } => {
                let rows = level_m.len() / columns;
                [
                    *origin,
                    [
                        origin[0] + (columns - 1) as f64 * cell_m,
                        origin[1] + (rows - 1) as f64 * cell_m,
                    ],
                ]
            }
        }
    }
}

/// Even-odd rule.
fn inside(polygon: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut odd = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
            odd = !odd;
        }
    }
    odd
}

/// Signed distance from the polyline, left positive; `None` beyond its ends.
fn offset_from_alignment(line: &[[f64; 2]], x: f64, y: f64) -> Option<f64> {
    let mut best: Option<(f64, f64)> = None;
    let last = line.len() - 2;
    for i in 0..=last {
        let (a, b) = (line[i], line[i + 1]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length2 = dx * dx + dy * dy;
        if length2 == 0.0 {
            continue;
        }
        let t = ((x - a[0]) * dx + (y - a[1]) * dy) / length2;
        if (i == 0 && t < 0.0) || (i == last && t > 1.0) {
            continue;
        }
        let t = t.clamp(0.0, 1.0);
        let (px, py) = (x - a[0] - t * dx, y - a[1] - t * dy);
        let distance = px.hypot(py);
        let side = if dx * py - dy * px >= 0.0 { 1.0 } else { -1.0 };
        if best.is_none_or(|(d, _)| distance < d) {
            best = Some((distance, side * distance));
        }
    }
    best.map(|(_, signed)| signed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200,000 points of an alignment were once looked through for every cell, without an end and without a stop.
    #[test]
    fn more_corners_than_a_cell_can_be_held_against_are_refused() {
        let at = |i: usize| [i as f64 * 0.01, 0.0];
        let section = |points: usize| DesignSurface::Section {
            alignment: (0..points).map(at).collect(),
            crest_level_m: 4.0,
            crest_width_m: 6.0,
            left_slope_m: 1.5,
            right_slope_m: 1.5,
            toe_level_m: 0.0,
        };
        assert_eq!(section(MOST_CORNERS).check(), Ok(()));
        let found = MOST_CORNERS + 1;
        let error = DesignError::TooManyPoints { key: "alignment", found };
        assert_eq!(section(found).check(), Err(error));
        let boundary = (0..found).map(at).collect();
        let level = DesignSurface::Level { level_m: 1.0, boundary };
        assert!(level.check().unwrap_err().to_string().contains("10001 points"));
    }

    #[test]
    fn a_section_has_a_crest_two_slopes_and_an_end() {
        let section = DesignSurface::Section {
            alignment: vec![[0.0, 0.0], [100.0, 0.0]],
            crest_level_m: 5.0,
            crest_width_m: 4.0,
            left_slope_m: 1.5,
            right_slope_m: 2.0,
            toe_level_m: 0.0,
        };
        assert_eq!(section.check(), Ok(()));
        assert_eq!(section.level_at(50.0, 1.0), Some(5.0));
        assert_eq!(section.level_at(50.0, 3.5), Some(4.0)); // left: 1.5 beyond the crest
        assert_eq!(section.level_at(50.0, -4.0), Some(4.0)); // right: 2 beyond the crest
        assert_eq!(section.level_at(50.0, -13.0), None);
        assert_eq!(section.level_at(-1.0, 0.0), None);
    }

    #[test]
    fn a_grid_interpolates_and_leaves_holes_out() {
        let grid = DesignSurface::Grid {
            origin: [10.0, 20.0],
            cell_m: 2.0,
            columns: 3,
            level_m: vec![1.0, 2.0, 3.0, 1.0, 2.0, f64::NAN],
        };
        assert_eq!(grid.check(), Ok(()));
        assert_eq!(grid.level_at(11.0, 21.0), Some(1.5));
        assert_eq!(grid.level_at(13.0, 21.5), None);
        assert_eq!(grid.level_at(9.9, 21.0), None);
    }

    #[test]
    fn a_design_that_cannot_be_for_the_survey_is_named_with_both_ranges() {
        let grid = |levels: [f64; 4]| DesignSurface::Grid {
            origin: [0.0, 0.0],
            cell_m: 1.0,
            columns: 2,
            level_m: levels.to_vec(),
        };
        let objection = |levels| grid(levels).heights_objection(-2.0, 5.5);
        assert_eq!(objection([3.4, 3.4, f64::NAN, 8.0]), None);
        for levels in [[340.0; 4], [3.4, 3.4, -9999.9, 3.4], [-32768.0; 4]] {
            let said = objection(levels).unwrap();
            assert!(said.contains("-2.00 to 5.50") && said.contains("heights are"), "{said}");
        }
        assert_eq!(objection([f64::NAN; 4]), None);
    }

    #[test]
    fn planes_fall_towards_their_bearing() {
        let plane =
            SlopingPlane { point: [0.0, 0.0], level_m: 3.0, falls_towards_deg: 90.0, slope_m: 2.0 };
        let surface = DesignSurface::Planes {
            plane: vec![plane],
            boundary: vec![[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]],
        };
        assert!((surface.level_at(4.0, 7.0).unwrap() - 1.0).abs() < 1e-9);
    }
}
