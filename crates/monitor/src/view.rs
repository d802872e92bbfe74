//! What an epoch's cloud says about a place on a surface: seen, seen through, covered, or nothing.
//!
//! A ray test without rays: along the line from the place to a sensor, points before the place cover it; points behind it,
//! with none before, were measured through it. A sounder measures in the fan across its track alone: of each track the nearest
//! place counts.

use geom::{PointGrid, Vec3};
use scene::SensorKind;
use std::ops::Range;

/// The answer for one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    /// Points lie on it.
    Seen,
    /// Points lie behind it and none before: nothing solid is there.
    Through,
    /// Points lie before it.
    Covered,
    /// The sensor tells nothing of it.
    Nothing,
}

/// The cloud of one epoch, ready to be asked.
pub(crate) struct View {
    /// `None`: every place is known.
    grid: Option<PointGrid>,
    sensors: Vec<Vec3>,
    /// Parts of `sensors` that are one track each, of a sounder.
    tracks: Vec<Range<usize>>,
    /// Points this near lie on the surface.
    pub near_m: f32,
    tube_m: f32,
    reach_m: f32,
    spacing_m: f32,
    noise_sd_m: f32,
}

/// Sensors asked about one place.
const SENSORS: usize = 3;
/// Share of the points of a surface behind a place by which the place is seen through, and the most points that are asked for.
const BEHIND: f32 = 0.6;
const MOST_BEHIND: f32 = 12.0;
/// A sensor sees a face under at least this cosine.
const LEAST_COS: f32 = 0.15;

impl View {
    /// A cloud (frame of the comparison) measured with this noise, for blocks of this size.
    pub fn new(
        points: &[Vec3],
        sensors: Vec<Vec3>,
        kind: SensorKind,
        noise_sd_m: f32,
        size_m: f32,
    ) -> Self {
        let spacing_m = spacing_m(points, 0.25 * size_m);
        let near_m = (2.5 * noise_sd_m + 0.02 * size_m).max(1.2 * spacing_m);
        let tube_m = (1.2 * spacing_m).clamp(0.02 * size_m, 0.15 * size_m);
        let grid = PointGrid::new(points, near_m.max(tube_m));
        let tracks = if kind == SensorKind::Mbes { tracks(&sensors) } else { Vec::new() };
        Self {
            grid: Some(grid),
            sensors,
            tracks,
            near_m,
            tube_m,
            reach_m: 1.3 * size_m,
            spacing_m,
            noise_sd_m,
        }
    }

    /// The view of one who knows all of the surface: a plan's.
    pub fn everything() -> Self {
        Self {
            grid: None,
            sensors: Vec::new(),
            tracks: Vec::new(),
            near_m: 0.0,
            tube_m: 0.0,
            reach_m: 0.0,
            spacing_m: 0.0,
            noise_sd_m: 0.0,
        }
    }

    /// Noise of its points.
    pub fn noise_sd_m(&self) -> f32 {
        self.noise_sd_m
    }

    /// Whether it is a plan's.
    pub fn knows_everything(&self) -> bool {
        self.grid.is_none()
    }

    /// Whether points lie within `near_m`.
    pub fn has_point(&self, p: Vec3) -> bool {
        self.any_within(p, self.near_m)
    }

    /// Typical distance between its points, metres; 0 for one that knows everything.
    pub fn spacing_m(&self) -> f32 {
        self.spacing_m
    }

    fn any_within(&self, p: Vec3, radius_m: f32) -> bool {
        self.grid.as_ref().is_none_or(|g| g.nearest_within(p, radius_m).is_some())
    }

    /// Area of the points within `radius_m` that `is_inside` holds for, each standing for its share of the survey, m².
    pub fn area_inside_m2(
        &self,
        centre: Vec3,
        radius_m: f32,
        is_inside: impl Fn(Vec3) -> bool,
    ) -> f32 {
        let Some(grid) = &self.grid else { return 0.0 };
        let mut count = 0_u32;
        grid.for_each_within(centre, radius_m, |_, p, _| count += u32::from(is_inside(p)));
        count as f32 * self.spacing_m * self.spacing_m
    }

    /// What is known of a place with this outward normal.
    pub fn look(&self, p: Vec3, normal: Vec3) -> Look {
        self.looked(p, normal, LEAST_COS, |away, from_m| self.meets(p, away, from_m))
    }

    /// The same for one small place whose absence counts: of sensors that look at it at least as squarely as this cosine of the
    /// slant, and seen through only where what lies behind it is shown as fully as a surface would be.
    pub fn look_strictly(&self, p: Vec3, normal: Vec3, least_cos: f32) -> Look {
        self.looked(p, normal, least_cos, |away, from_m| self.shows_behind(p, away, from_m))
    }

    fn looked(
        &self,
        p: Vec3,
        normal: Vec3,
        least_cos: f32,
        is_behind: impl Fn(Vec3, f32) -> bool,
    ) -> Look {
        if self.has_point(p) {
            return Look::Seen;
        }
        let clear_m = self.near_m + self.tube_m;
        let (mut covered, mut through) = (false, false);
        let squarely = |d: &Vec3| d.dot(normal) >= least_cos;
        for to_sensor in self.directions(p, normal).into_iter().filter(squarely) {
            if self.meets(p, to_sensor, clear_m) {
                covered = true;
            } else if is_behind(-to_sensor, clear_m) {
                through = true;
            }
        }
        match (through, covered) {
            (true, _) => Look::Through,
            (false, true) => Look::Covered,
            (false, false) => Look::Nothing,
        }
    }

    /// Whether as many points lie behind a place as a surface that is measured through it would show, or most of them. A few are
    /// always there, seen from elsewhere past what stands before them.
    fn shows_behind(&self, p: Vec3, away: Vec3, from_m: f32) -> bool {
        let Some(grid) = &self.grid else { return false };
        let expected = std::f32::consts::PI * (self.tube_m / self.spacing_m.max(1e-6)).powi(2);
        let enough = (BEHIND * expected).ceil().clamp(1.0, MOST_BEHIND) as u32;
        let step = 1.3 * self.tube_m;
        let ball = (self.tube_m * self.tube_m + 0.25 * step * step).sqrt();
        let (mut at, mut count) = (from_m, 0);
        while at < self.reach_m && count < enough {
            grid.for_each_within(p + away * (at + 0.5 * step), ball, |_, q, _| {
                let d = q - p;
                let t = d.dot(away);
                let across2 = d.length_squared() - t * t;
                let inside = t >= at && t < at + step && across2 <= self.tube_m * self.tube_m;
                count += u32::from(inside);
            });
            at += step;
        }
        count >= enough
    }

    /// Whether any point lies in the tube from `from_m` on.
    fn meets(&self, p: Vec3, direction: Vec3, from_m: f32) -> bool {
        let mut at = from_m;
        while at < self.reach_m {
            if self.any_within(p + direction * at, self.tube_m) {
                return true;
            }
            at += 1.3 * self.tube_m;
        }
        false
    }

    /// Directions to the sensors that should see the place: for a moving sounder those of its tracks that passed closest, else
    /// those that look at it most squarely; straight up when nothing is known.
    fn directions(&self, p: Vec3, normal: Vec3) -> Vec<Vec3> {
        if self.sensors.is_empty() {
            return if normal.z > LEAST_COS { vec![Vec3::Z] } else { Vec::new() };
        }
        let to = |s: Vec3| (s - p).normalize_or_zero();
        let faces = |d: &Vec3| d.dot(normal) > LEAST_COS;
        if !self.tracks.is_empty() {
            let places = self.tracks.iter().map(|t| nearest_on(&self.sensors[t.clone()], p));
            let ranked = places.map(|s| (-(s - p).length(), to(s))).filter(|(_, d)| faces(d));
            return best(ranked);
        }
        best(self.sensors.iter().map(|s| to(*s)).filter(faces).map(|d| (d.dot(normal), d)))
    }
}

/// The best few directions, the first of equals first; hundreds of places are asked for by every sample.
fn best(ranked: impl Iterator<Item = (f32, Vec3)>) -> Vec<Vec3> {
    let mut best: Vec<(f32, Vec3)> = Vec::with_capacity(SENSORS + 1);
    for found in ranked {
        let place = best.iter().position(|b| found.0 > b.0).unwrap_or(best.len());
        if place < SENSORS {
            best.insert(place, found);
            best.truncate(SENSORS);
        }
    }
    best.into_iter().map(|r| r.1).collect()
}

/// A step so many times as long as the usual one, or a turn about, begins another track.
const BREAK: f32 = 3.0;

/// Where each track begins and ends, of places in the order they were passed in.
fn tracks(sensors: &[Vec3]) -> Vec<Range<usize>> {
    let mut steps: Vec<f32> = sensors.windows(2).map(|w| (w[1] - w[0]).length()).collect();
    steps.sort_by(f32::total_cmp);
    let longest_m = BREAK * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut out = Vec::new();
    let mut start = 0;
    for i in 1..sensors.len() {
        let step = sensors[i] - sensors[i - 1];
        let turns = i > start + 1 && step.dot(sensors[start + 1] - sensors[start]) < 0.0;
        if step.length() > longest_m || turns {
            out.push(start..i);
            start = i;
        }
    }
    if start < sensors.len() {
        out.push(start..sensors.len());
    }
    out
}

/// The place of a track nearest to a point.
fn nearest_on(track: &[Vec3], p: Vec3) -> Vec3 {
    let on = |w: &[Vec3]| {
        let along = w[1] - w[0];
        let t = (p - w[0]).dot(along) / along.length_squared().max(1e-12);
        w[0] + along * t.clamp(0.0, 1.0)
    };
    let far = |s: &Vec3| (*s - p).length_squared();
    let between = track.windows(2).map(on).min_by(|a, b| far(a).total_cmp(&far(b)));
    between.unwrap_or(track[0])
}

/// Mean distance of neighbouring points where there are any: one over the root of the points a square metre of occupied plan.
pub(crate) fn spacing_m(points: &[Vec3], cell_m: f32) -> f32 {
    let cell = |p: &Vec3| [p.x, p.y].map(|v| (v / cell_m).floor() as i32);
    let mut cells: Vec<[i32; 2]> = points.iter().map(cell).collect();
    cells.sort_unstable();
    cells.dedup();
    if points.is_empty() {
        return 0.0;
    }
    (cells.len() as f32 * cell_m * cell_m / points.len() as f32).sqrt()
}

/// Shares of what an epoch says of a set of places.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shares {
    pub seen: f64,
    pub through: f64,
    pub covered: f64,
    pub nothing: f64,
    /// Places asked.
    pub count: usize,
}

impl Shares {
    /// Of these answers.
    pub fn of(looks: &[Look]) -> Self {
        let count = looks.len();
        let share =
            |kind: Look| looks.iter().filter(|l| **l == kind).count() as f64 / count.max(1) as f64;
        Self {
            seen: share(Look::Seen),
            through: share(Look::Through),
            covered: share(Look::Covered),
            nothing: share(Look::Nothing),
            count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sounder_looks_across_its_track_and_once_from_each() {
        let pass = |y: f32| (0..6).map(move |i| Vec3::new(2.0 * i as f32, y, 9.0));
        let sensors: Vec<Vec3> = pass(0.0).chain(pass(4.0)).collect();
        assert_eq!(tracks(&sensors), [0..6, 6..12]);
        let back: Vec<Vec3> =
            pass(0.0).chain(pass(1.0).collect::<Vec<_>>().into_iter().rev()).collect();
        assert_eq!(tracks(&back).len(), 2, "{:?}", tracks(&back));
        let view = View::new(&[Vec3::ZERO], sensors, SensorKind::Mbes, 0.03, 2.0);
        let found = view.directions(Vec3::new(3.0, 0.0, 0.0), Vec3::Z);
        assert_eq!(found.len(), 2);
        // Straight above between two places, and aslant from the other track, neither ahead nor behind.
        assert!((found[0] - Vec3::Z).length() < 1e-6, "{found:?}");
        assert!(found[1].x.abs() < 1e-6 && found[1].y > 0.3, "{found:?}");
    }
}
