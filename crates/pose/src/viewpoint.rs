//! From where a survey was measured that does not say so.
//!
//! A sensor hides what lies behind what it sees. Of several directions the one is believed from which the measured
//! surface hides least of itself: nothing measured can have been hidden. From above is what most surveys are and
//! is left only for a side that is clearly better. Where every single direction hides much, the survey was put together
//! from several: directions are added as long as each sees what none of the others did.

use geom::{Bounds, Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// The directions from which a survey may have been measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// Unit vectors to far sensors, at least one; each sees points that those before it do not.
    pub toward: Vec<Vec3>,
    /// Share of the measured points that lie behind others from all of them.
    pub hidden: f32,
}

/// Directions around, and heights above the horizon at which a scanner on a crest or a boat looks, degrees.
const AROUND: usize = 12;
const HEIGHTS_DEG: [f32; 3] = [12.0, 28.0, 50.0];
/// Points looked at.
const POINTS: usize = 40_000;
/// A side must hide less than this part of what the view from above hides, and that be more than [`CLEARLY`].
const BETTER: f32 = 0.5;
const CLEARLY: f32 = 0.03;
/// More hidden points than this from the best single direction were seen from another one.
const SEVERAL: f32 = 0.08;
/// A further direction must see this share of the points that no other sees. Of two that see much the same the higher is
/// taken, by this factor: a look along the ground expects to see under blocks what nobody saw.
const FURTHER: f32 = 0.02;
const LOWER: f32 = 1.25;
/// And at least this part of what the first further one does: who flies round a pile sees as much of it from every side, who looks
/// from one side leaves shreds that others would have seen.
const ALIKE: f32 = 0.5;
/// A further direction's view may have this much more of its area in holes than the first one's.
const MORE_HOLES: f32 = 0.05;
/// A hole is narrower than twice this, in d_max; what is wider is the survey's outside.
const HOLE: f32 = 0.3;
/// Surface turned away from a look by more than this cosine shows it its back.
const AWAY: f32 = 0.25;
/// Of what a further direction sees it may see this share from the back; more, and it looks through the ground.
const MOST_BACKS: f32 = 0.1;
/// Directions at most.
const MOST: usize = 6;

impl Viewpoint {
    /// The likeliest directions for points this far apart and blocks of this size.
    pub(crate) fn likeliest(points: &[Vec3], spacing_m: f32, d_max_m: f32) -> Self {
        let step = points.len().div_ceil(POINTS).max(1);
        let sample: Vec<Vec3> = points.iter().copied().step_by(step).collect();
        let pixel_m = pixel_m(spacing_m * (step as f32).sqrt());
        let look = |toward: Vec3| Look::new(&sample, toward, pixel_m, d_max_m);
        let above = look(Vec3::Z);
        if above.hidden() < CLEARLY {
            return Self { toward: vec![Vec3::Z], hidden: above.hidden() };
        }
        let sides: Vec<Look> = sides().map(look).collect();
        let best = sides.iter().min_by(|a, b| a.hidden().total_cmp(&b.hidden()));
        let best = best.filter(|side| side.hidden() < BETTER * above.hidden()).unwrap_or(&above);
        let mut toward = vec![best.toward];
        let mut behind_all = best.behind.clone();
        let several = best.hidden() >= SEVERAL;
        let normal = if several {
            geom::normals(&sample, 2.0 * pixel_m, &|_| best.toward)
        } else {
            Vec::new()
        };
        let mut least = FURTHER;
        while several && toward.len() < MOST {
            let uncovered = |look: &Look| {
                let new =
                    look.behind.iter().zip(&behind_all).filter(|(here, all)| **all && !**here);
                new.count() as f32 / sample.len() as f32
            };
            let mut next: Option<(&Look, f32)> = None;
            let may = |look: &&Look| {
                look.holes <= best.holes + MORE_HOLES && look.backs(best, &normal) < MOST_BACKS
            };
            for look in std::iter::once(&above).chain(&sides).filter(may) {
                let found = uncovered(look);
                let better = next.is_none_or(|(held, best)| {
                    let lower = look.toward.z < held.toward.z - 1e-3;
                    found > if lower { LOWER * best } else { best }
                });
                if found >= least && better {
                    next = Some((look, found));
                }
            }
            let Some((look, found)) = next else { break };
            least = least.max(ALIKE * found);
            toward.push(look.toward);
            for (all, here) in behind_all.iter_mut().zip(&look.behind) {
                *all &= here;
            }
        }
        Self { toward, hidden: share(&behind_all) }
    }

    /// The direction from which each point was seen: the first from which it lies behind nothing.
    pub(crate) fn of_each(&self, points: &[Vec3], spacing_m: f32, d_max_m: f32) -> Vec<Vec3> {
        let mut seen_from = vec![self.toward[0]; points.len()];
        if self.toward.len() == 1 {
            return seen_from;
        }
        let pixel_m = pixel_m(spacing_m);
        let mut open = behind(points, self.toward[0], pixel_m, d_max_m);
        for &toward in &self.toward[1..] {
            let behind = behind(points, toward, pixel_m, d_max_m);
            for ((from, open), behind) in seen_from.iter_mut().zip(&mut open).zip(behind) {
                if *open && !behind {
                    (*from, *open) = (toward, false);
                }
            }
        }
        seen_from
    }

    /// Largest cosine between an outward normal and the directions.
    pub(crate) fn facing(&self, normal: Vec3) -> f32 {
        self.toward.iter().map(|toward| normal.dot(*toward)).fold(-1.0, f32::max)
    }

    /// In words.
    pub fn name(&self) -> String {
        let names: Vec<String> = self.toward.iter().map(|&toward| name(toward)).collect();
        names.join(", ")
    }
}

/// A direction in words.
fn name(toward: Vec3) -> String {
    if toward.z > 0.99 {
        return "from above".into();
    }
    const SIDES: [&str; 8] =
        ["east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east"];
    let turn = toward.y.atan2(toward.x).rem_euclid(std::f32::consts::TAU);
    let side = (turn / std::f32::consts::FRAC_PI_4).round() as usize % SIDES.len();
    let height_deg = toward.z.asin().to_degrees();
    format!("from the {}, {height_deg:.0}° above the horizon", SIDES[side])
}

/// A direction, which points lie behind others from it, and the share of its view that is holes.
struct Look {
    toward: Vec3,
    behind: Vec<bool>,
    holes: f32,
}

impl Look {
    fn new(points: &[Vec3], toward: Vec3, pixel_m: f32, d_max_m: f32) -> Self {
        let Some(image) = Image::new(points, toward, pixel_m) else {
            return Self { toward, behind: Vec::new(), holes: 0.0 };
        };
        Self { toward, behind: image.behind(d_max_m), holes: image.holes(d_max_m) }
    }

    fn hidden(&self) -> f32 {
        share(&self.behind)
    }

    /// Share of what this one and `other` see that turns its back on this one; `normals` are turned towards `other`.
    fn backs(&self, other: &Self, normals: &[Vec3]) -> f32 {
        let (mut seen, mut back) = (0, 0);
        for (i, normal) in normals.iter().enumerate() {
            if !self.behind[i] && !other.behind[i] {
                seen += 1;
                back += usize::from(normal.dot(self.toward) < -AWAY);
            }
        }
        back as f32 / seen.max(1) as f32
    }
}

fn share(of: &[bool]) -> f32 {
    of.iter().filter(|b| **b).count() as f32 / of.len().max(1) as f32
}

/// Side of a pixel in which points this far apart leave hardly a gap.
fn pixel_m(spacing_m: f32) -> f32 {
    (1.6 * spacing_m).max(f32::MIN_POSITIVE)
}

/// The sides looked from, high ones first.
fn sides() -> impl Iterator<Item = Vec3> {
    HEIGHTS_DEG.into_iter().rev().flat_map(|height| {
        let (z, flat) = height.to_radians().sin_cos();
        (0..AROUND).map(move |k| {
            let (s, c) = (std::f32::consts::TAU * k as f32 / AROUND as f32).sin_cos();
            Vec3::new(flat * c, flat * s, z)
        })
    })
}

/// Which points lie behind others, more than a quarter of d_max deep, along parallel rays.
fn behind(points: &[Vec3], toward: Vec3, pixel_m: f32, d_max_m: f32) -> Vec<bool> {
    Image::new(points, toward, pixel_m).map_or_else(Vec::new, |image| image.behind(d_max_m))
}

/// Points as seen along parallel rays.
struct Image {
    /// Pixel and height towards the viewer of each point.
    points: Vec<(usize, f32)>,
    /// Greatest height in each pixel, row by row.
    nearest: Vec<f32>,
    width: usize,
    pixel_m: f32,
}

impl Image {
    /// `None` without points.
    fn new(points: &[Vec3], toward: Vec3, pixel_m: f32) -> Option<Self> {
        let right = toward.any_orthonormal_vector();
        let view = Mat3::from_cols(right, toward.cross(right), toward).transpose();
        let seen: Vec<Vec3> = points.iter().map(|&p| view * p).collect();
        let bounds = Bounds::of(seen.iter().copied());
        if bounds.is_empty() {
            return None;
        }
        let pixel_m = pixel_m.max(bounds.size().max_element() / 2048.0);
        let width = (bounds.size().x / pixel_m) as usize + 1;
        let height = (bounds.size().y / pixel_m) as usize + 1;
        // From the points' own corner: the same in whatever frame they are given.
        let pixel = |p: &Vec3| {
            let at = (*p - bounds.min) / pixel_m;
            (at.y as usize).min(height - 1) * width + (at.x as usize).min(width - 1)
        };
        let points: Vec<(usize, f32)> = seen.iter().map(|p| (pixel(p), p.z)).collect();
        let mut nearest = vec![f32::NEG_INFINITY; width * height];
        for &(at, z) in &points {
            nearest[at] = nearest[at].max(z);
        }
        Some(Self { points, nearest, width, pixel_m })
    }

    fn behind(&self, d_max_m: f32) -> Vec<bool> {
        self.points.iter().map(|&(at, z)| z < self.nearest[at] - 0.25 * d_max_m).collect()
    }

    /// Share of the view in which nothing was measured though something was all around.
    fn holes(&self, d_max_m: f32) -> f32 {
        let filled: Vec<bool> = self.nearest.iter().map(|z| z.is_finite()).collect();
        let reach = (HOLE * d_max_m / self.pixel_m).round() as usize;
        // A gap of two pixels may lie between points side by side.
        let sampled = closed(&filled, self.width, 1);
        let around = closed(&filled, self.width, reach.max(1));
        let (mut view, mut holes) = (0, 0);
        for (&around, &sampled) in around.iter().zip(&sampled) {
            view += usize::from(around || sampled);
            holes += usize::from(around && !sampled);
        }
        holes as f32 / view.max(1) as f32
    }
}

/// Pixels that no empty square of 2 · `reach` + 1 pixels covers, what lies beyond the image being empty: the morphological closing.
fn closed(filled: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let height = filled.len() / width;
    let wide = width + 2 * reach;
    let padded = |x: usize, y: usize| (y + reach) * wide + x + reach;
    let mut set = vec![false; wide * (height + 2 * reach)];
    for (i, _) in filled.iter().enumerate().filter(|(_, filled)| **filled) {
        set[padded(i % width, i / width)] = true;
    }
    let empty: Vec<bool> = grown(&set, wide, reach).iter().map(|g| !g).collect();
    let open = grown(&empty, wide, reach);
    (0..filled.len()).map(|i| !open[padded(i % width, i / width)]).collect()
}

/// Pixels with a set one at most `reach` columns and rows away.
fn grown(set: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let along = |set: &[bool], count: usize, step: usize, lines: usize, stride: usize| {
        let mut out = vec![false; set.len()];
        for line in 0..lines {
            let at = |k: usize| line * stride + k * step;
            let mut until = 0;
            for k in 0..count {
                if set[at(k)] {
                    for out_k in k.saturating_sub(reach).max(until)..(k + reach + 1).min(count) {
                        out[at(out_k)] = true;
                    }
                    until = (k + reach + 1).min(count);
                }
            }
        }
        out
    };
    let height = set.len() / width.max(1);
    let rows = along(set, width, 1, height, width);
    along(&rows, height, width, width, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor with a hill, and a slab above it where `covered`.
    fn floor(covered: bool) -> Vec<Vec3> {
        let mut points = Vec::new();
        for i in 0..40 * 40 {
            let (x, y) = ((i % 40) as f32 * 0.05, (i / 40) as f32 * 0.05);
            points.push(Vec3::new(x, y, 0.2 * x));
            if covered {
                points.push(Vec3::new(x, y, 2.0));
            }
        }
        points
    }

    fn likeliest(points: &[Vec3]) -> Viewpoint {
        Viewpoint::likeliest(points, 0.05, 1.0)
    }

    #[test]
    fn from_above_unless_a_side_hides_clearly_less() {
        assert_eq!(likeliest(&floor(false)).toward, [Vec3::Z]);
        assert_eq!(likeliest(&[]).toward, [Vec3::Z]);
        let side = likeliest(&floor(true));
        assert!(side.toward.len() == 1 && side.toward[0].z < 0.8 && side.hidden < 0.05, "{side:?}");
        assert!(side.name().contains("above the horizon"), "{}", side.name());
    }

    /// A slope that faces south: the north would see all of it, through the ground.
    #[test]
    fn nobody_looks_through_the_ground() {
        let points: Vec<Vec3> = (0..40 * 40)
            .map(|i| ((i % 40) as f32 * 0.05, (i / 40) as f32 * 0.05))
            .map(|(x, y)| Vec3::new(x, y, 0.7 * y))
            .collect();
        let normals = geom::normals(&points, 0.12, &|_| Vec3::new(0.0, -0.9, 0.4));
        let look = |x: f32, y: f32| Look::new(&points, Vec3::new(x, y, 0.2).normalize(), 0.08, 1.0);
        let south = look(0.0, -1.0);
        assert!(look(0.0, 1.0).backs(&south, &normals) > 0.9);
        assert!(look(0.7, -0.7).backs(&south, &normals) < 0.1);
    }

    /// Every second square metre was measured: half of the view is holes, whatever lies outside.
    #[test]
    fn what_was_not_measured_between_is_holes() {
        let board = |k: usize| {
            (0..80 * 80)
                .map(|i| (i % 80, i / 80))
                .filter(|(x, y)| (x / 10 + y / 10) % k == 0)
                .map(|(x, y)| Vec3::new(x as f32 * 0.05, y as f32 * 0.05, 0.0))
                .collect::<Vec<_>>()
        };
        let holes = |points: &[Vec3]| Look::new(points, Vec3::Z, 0.06, 1.0).holes;
        assert!(holes(&board(1)) < 0.01);
        let half = holes(&board(2));
        assert!((0.3..0.6).contains(&half), "{half}");
    }

    /// Both sides of a wall and the roof over both: no single direction sees more than one side.
    #[test]
    fn what_one_direction_hides_another_has_seen() {
        let mut points = Vec::new();
        for i in 0..160 * 40 {
            let (y, z) = ((i % 160) as f32 * 0.05, (i / 160) as f32 * 0.05);
            points.extend([-0.5, 0.5].map(|x| Vec3::new(x, y, z)));
            points.extend([z - 1.0, z - 1.0].map(|x| Vec3::new(x, y, 2.0)));
        }
        let found = likeliest(&points);
        let sees = |side: f32| found.toward.iter().any(|toward| side * toward.x > 0.4);
        assert!(sees(1.0) && sees(-1.0) && found.hidden < SEVERAL, "{found:?}");
        let from = found.of_each(&points, 0.05, 1.0);
        // From above the wall's upper edge is seen as well.
        let wrong =
            points.iter().zip(&from).filter(|(p, from)| p.x.abs() == 0.5 && p.x * from.x < 0.0);
        let wrong = wrong.count();
        assert!(wrong < 640, "{wrong} of 12,800 points of the wall");
        assert!(found.facing(Vec3::X) > 0.5 && found.facing(Vec3::NEG_Z) < 0.0);
    }
}
