//! Which type an accepted block is, when the catalogue has several: the decision by likelihood.
//!
//! Types of one shape and nearly one size explain the same points nearly as well, so the score that accepts blocks
//! is too blunt to tell them apart. Here every type is fitted to the same points and judged by how likely these are:
//! a point off the surface (the rim of a larger block) is unlikely, and so is surface in plain sight without points
//! (the rim of a smaller one). Blur at the edges by the noise is part of the model.

use crate::acceptance::Candidate;
use crate::finish::Accepted;
use crate::fit::{CentredPose, FitPoint, fit};
use crate::measured::{Measured, toward_sensor};
use crate::sight::Seen;
use crate::template::Template;
use geom::{PointGrid, Vec3};
use rayon::prelude::*;
use scene::Survey;

/// Points a decision uses at most.
const MOST_POINTS: usize = 3000;
/// Points at the same place of the surface err together; this many count as one.
const POINTS_A_FACT: f32 = 4.0;
/// How much the density differs from block to block, as a share: surveys are nowhere quite even.
const DENSITY_CV: f32 = 0.1;
/// Below this margin the poses of both types are moved about for a better one, nats.
const DOUBTFUL: f32 = 60.0;
/// First step of that search, in units of d_max.
const FIRST_STEP: f32 = 0.04;

/// Decides the type of every block; poses and rivals change with it.
pub fn decide(
    survey: &Survey,
    grid: &PointGrid,
    blocks: &mut [Accepted],
    pool: &[Candidate],
    templates: &[Template],
    measured: &Measured,
) {
    if templates.len() < 2 {
        return;
    }
    let neighbours: Vec<(usize, CentredPose)> = blocks.iter().map(|b| (b.template, b.at)).collect();
    blocks.par_iter_mut().enumerate().for_each(|(entry, block)| {
        let case = Case { survey, grid, templates, measured, neighbours: &neighbours, entry };
        let contenders = contenders(block, pool, templates);
        let (points, each) = case.points(&contenders);
        let judged: Vec<(Account, usize, CentredPose)> = contenders
            .into_iter()
            .map(|(t, at)| {
                let sd = measured.noise_sd_m.max(0.3 * templates[t].field.cell_m());
                // Sizes a few per cent apart start several centimetres off.
                let wide = (4.0 * sd).max(0.08 * templates[t].model.d_max_m);
                let at = fit(
                    &templates[t].fit_model(),
                    &points,
                    at,
                    &[wide, 4.0 * sd, 3.0 * sd, 2.0 * sd, 2.0 * sd],
                )
                .0;
                (case.account(t, &at, &points, each), t, at)
            })
            .collect();
        // Points that plain surface is expected to show its expected for: the same number for all contenders.
        let expected_here = judged
            .iter()
            .max_by(|a, b| a.0.explained.total_cmp(&b.0.explained))
            .map_or(0.0, |j| j.0.plain_points);
        let mut judged: Vec<(f32, usize, CentredPose)> = judged
            .into_iter()
            .map(|(account, t, at)| (account.charge(expected_here), t, at))
            .collect();
        sort(&mut judged);
        let runner_up = judged.iter().position(|j| j.1 != judged[0].1);
        if let Some(second) =
            runner_up.filter(|&s| judged[s].0 - judged[0].0 < DOUBTFUL * POINTS_A_FACT)
        {
            // Where a face is seen and no edge holds it, a fit slides; the likelihood knows where surface is missing.
            for entry in [0, second] {
                judged[entry] = case.slide(judged[entry], &points, each, expected_here);
            }
            sort(&mut judged);
        }
        let (best, t, at) = judged[0];
        let second = judged.iter().find(|j| j.1 != t);
        (block.template, block.at) = (t, at);
        block.other_type = second.map(|s| (s.1, s.2));
        block.type_margin = second.map_or(f32::INFINITY, |s| (s.0 - best) / POINTS_A_FACT);
    });
}

/// The block's own pose as every type, and the best candidates of each type at its place.
fn contenders(
    block: &Accepted,
    pool: &[Candidate],
    templates: &[Template],
) -> Vec<(usize, CentredPose)> {
    let mut contenders = Vec::new();
    for (t, template) in templates.iter().enumerate() {
        contenders.push((t, block.at));
        let mut near: Vec<&Candidate> = pool
            .iter()
            .filter(|c| {
                c.template == t
                    && (c.at.centre - block.at.centre).length() < 0.5 * template.model.d_max_m
            })
            .collect();
        near.sort_by(|a, b| b.evidence.score().total_cmp(&a.evidence.score()));
        contenders.extend(near.into_iter().take(2).map(|c| (t, c.at)));
    }
    contenders
}

fn sort(judged: &mut [(f32, usize, CentredPose)]) {
    judged.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
}

/// What a contender is expected to show and explains.
struct Account {
    /// Points that its plain surface should have.
    expected: f32,
    /// Points near its plain surface.
    plain_points: f32,
    /// Sum over the points of the logarithm of their intensity over its peak.
    explained: f32,
}

impl Account {
    /// Negative log-likelihood up to a constant of the block: `expected_here` points on plain surface whose density is the survey's
    /// up to [`DENSITY_CV`], a gamma prior with which it is integrated out.
    fn charge(&self, expected_here: f32) -> f32 {
        let certain = POINTS_A_FACT / (DENSITY_CV * DENSITY_CV);
        (expected_here + certain) * (self.expected / certain).ln_1p() - self.explained
    }
}

/// How far surface is expected to show points by the cosine at which it faces the sensor: steep faces are measured thinly or not at
/// all, they may explain points but owe none.
fn expected_share(facing: f32) -> f32 {
    ((facing - 0.2) / 0.25).clamp(0.0, 1.0)
}

struct Case<'a> {
    survey: &'a Survey,
    grid: &'a PointGrid,
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    neighbours: &'a [(usize, CentredPose)],
    entry: usize,
}

impl Case<'_> {
    /// Survey points near any contender's surface that no neighbour explains better, thinned, and how many each stands for.
    fn points(&self, contenders: &[(usize, CentredPose)]) -> (Vec<FitPoint>, f32) {
        let sd = self.measured.noise_sd_m;
        let own = &self.neighbours[self.entry];
        let reach =
            contenders.iter().map(|c| self.templates[c.0].model.d_max_m).fold(0.0, f32::max) * 1.1;
        let others: Vec<_> = self
            .neighbours
            .iter()
            .enumerate()
            .filter(|(n, o)| *n != self.entry && (o.1.centre - own.1.centre).length() < 2.2 * reach)
            .map(|(_, o)| {
                (&self.templates[o.0], o.1.pose(self.templates[o.0].model.centre).inverse())
            })
            .collect();
        let frames: Vec<_> = contenders
            .iter()
            .map(|c| (&self.templates[c.0], c.1.pose(self.templates[c.0].model.centre).inverse()))
            .collect();
        let near = 3.0 * sd + 0.05 * reach;
        let mut index = Vec::new();
        self.grid.for_each_within(own.1.centre, reach, |i, p, _| {
            let best = frames
                .iter()
                .map(|(t, f)| t.field.distance_m(*f * p).abs())
                .fold(f32::INFINITY, f32::min);
            let other = others
                .iter()
                .map(|(t, f)| t.field.distance_m(*f * p).abs())
                .fold(f32::INFINITY, f32::min);
            if best < near && (other > 4.0 * sd || best < 0.5 * other) {
                index.push(i);
            }
        });
        index.sort_unstable();
        let stride = index.len().div_ceil(MOST_POINTS).max(1);
        let points = index
            .into_iter()
            .step_by(stride)
            .map(|i| {
                let working = self.measured.thinned.cell_of_point[i as usize] as usize;
                FitPoint {
                    position: self.survey.cloud.position_m[i as usize],
                    normal: self.measured.normal[working],
                    to_sensor: self.measured.to_sensor[working],
                }
            })
            .collect();
        (points, stride as f32)
    }

    /// Moves a contender along the block's axes as long as that makes the points likelier; steps halve.
    fn slide(
        &self,
        mut best: (f32, usize, CentredPose),
        points: &[FitPoint],
        each: f32,
        expected_here: f32,
    ) -> (f32, usize, CentredPose) {
        let t = best.1;
        let mut step_m = FIRST_STEP * self.templates[t].model.d_max_m;
        for _ in 0..3 {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                for sign in [-1.0, 1.0] {
                    let mut at = best.2;
                    at.centre += at.rotation * axis * (sign * step_m);
                    let charge = self.account(t, &at, points, each).charge(expected_here);
                    if charge < best.0 {
                        best = (charge, t, at);
                    }
                }
            }
            step_m *= 0.5;
        }
        best
    }

    /// Points are a Poisson process whose intensity is the density on the visible surface, blurred by the noise, over a
    /// thin background.
    fn account(&self, t: usize, at: &CentredPose, points: &[FitPoint], each: f32) -> Account {
        let template = &self.templates[t];
        let site_from_block = at.pose(template.model.centre);
        let spacing = self.measured.survey_spacing_m;
        let surface = &template.dense_surface;
        let area_m2 =
            template.sample_area_m2 * template.surface.len() as f32 / surface.len().max(1) as f32;
        let margin = (1.6 * spacing).max(2.0 * self.measured.noise_sd_m);
        let mut plain_m2 = 0.0;
        // The nearest sensor position of any place on the block is among those hardly farther than the centre's.
        let away = |s: &Vec3| (*s - at.centre).length();
        let nearest_m = self.survey.sensor_positions.iter().map(away).fold(f32::INFINITY, f32::min);
        let reach_m = nearest_m + 2.0 * template.model.d_max_m;
        let sensors: Vec<Vec3> =
            self.survey.sensor_positions.iter().copied().filter(|s| away(s) <= reach_m).collect();
        let far = self.measured.viewpoint.as_ref();
        let (mut place, mut normal, mut expected) = (Vec::new(), Vec::new(), Vec::new());
        for &(p, n) in surface {
            let (p, n) = (site_from_block * p, site_from_block.rotation * n);
            let seen = matches!(
                self.measured.sight.of_surface(p, n, margin),
                Some(Seen::Here | Seen::Through)
            );
            let facing = far.map_or_else(|| n.dot(toward_sensor(p, &sensors)), |far| far.facing(n));
            if self.buried(p) {
                // Two solids cannot share a place: charged like surface that ought to be seen and is not.
                plain_m2 += area_m2;
                continue;
            }
            // Faces along the view come and go with a degree of pose: what was measured of them may be explained.
            if facing < -0.2 || (expected_share(facing) >= 1.0 && !seen) {
                continue;
            }
            // On a steep face a depth image cannot tell hidden from seen: it is expected to show nothing where it seems hidden.
            let expected_here = if seen { expected_share(facing) } else { 0.0 };
            plain_m2 += area_m2 * expected_here;
            place.push(p);
            normal.push(n);
            expected.push(expected_here);
        }
        let along = self.measured.noise_sd_m.max(0.3 * template.field.cell_m());
        let across = self.measured.noise_sd_m.max(0.7 * area_m2.sqrt());
        let grid = PointGrid::new(&place, 2.0 * across);
        let density = 1.0 / (spacing * spacing);
        // Intensity over its peak on the surface, which all contenders share; a fiftieth of it is chance.
        let share = area_m2 / (std::f32::consts::TAU * across * across);
        let (mut explained, mut plain_points) = (0.0, 0.0);
        for point in points {
            let (mut sum, mut plain) = (0.0_f32, 0.0_f32);
            grid.for_each_within(point.position, 3.0 * along.max(across), |i, q, d2| {
                let off = (point.position - q).dot(normal[i as usize]);
                let exponent =
                    (off / along).powi(2) + (d2 - off * off).max(0.0) / (across * across);
                let near = (-0.5 * exponent).exp();
                sum += near;
                plain += near * expected[i as usize];
            });
            explained += (sum * share + 0.02).ln();
            plain_points += plain / sum.max(1e-6);
        }
        Account {
            expected: density * plain_m2,
            plain_points: plain_points * each,
            explained: explained * each,
        }
    }

    /// Whether a place lies inside an accepted neighbour, deeper than poses err.
    fn buried(&self, p: Vec3) -> bool {
        self.neighbours.iter().enumerate().any(|(n, (t, at))| {
            let template = &self.templates[*t];
            n != self.entry
                && (at.centre - p).length() < template.model.d_max_m
                && template.field.distance_m(at.pose(template.model.centre).inverse() * p)
                    < -(1.5 * self.measured.noise_sd_m).max(0.01 * template.model.d_max_m)
        })
    }
}
