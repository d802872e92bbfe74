//! Blocks placed side by side: where one ends the next is looked for.
//!
//! Of a cube in a row one face is seen, and a search slides along it. But rows are made of blocks turned alike, each as far
//! from the last as a block is long and a joint is wide. Every accepted block of flat faces offers a place on each of its
//! sides; how wide the joint is, the points decide.

use crate::EvidenceConfig;
use crate::acceptance::Candidate;
use crate::evidence::{reach_m, weigh};
use crate::fit::{CentredPose, fit};
use crate::measured::Measured;
use crate::search::nearby;
use crate::template::Template;
use geom::Vec3;
use rayon::prelude::*;

/// The joint that is tried first, in lengths of the block.
const JOINT: f32 = 0.025;
/// Shifts tried along the faces, in lengths of the block: from far to near.
const FAR: [f32; 6] = [0.45, 0.3, 0.2, 0.13, 0.08, 0.05];
const NEAR: [f32; 2] = [0.025, 0.01];
/// Rows go on to a place that explains at least so much, in halves of a block's surface.
const GOES_ON: f32 = 0.12;
/// Places of a row that follow from one block.
const ROW: usize = 4;
/// Places within this part of d_box of each other are one.
const SAME_PLACE: f32 = 0.1;
/// Points a pose is fitted to.
const POINTS: usize = 600;

/// Blocks whose neighbours were looked for.
#[derive(Default)]
pub struct Rows {
    known: Vec<(usize, Vec3)>,
}

impl Rows {
    /// Poses beside the `accepted` blocks, and on from there, where there is a surface for one; and better places of the
    /// accepted themselves along their faces. What was looked at before is left out.
    pub fn go_on(
        &mut self,
        accepted: &[&Candidate],
        templates: &[Template],
        measured: &Measured,
        config: &EvidenceConfig,
    ) -> Vec<Candidate> {
        let place = Place { templates, measured, config };
        let mut last: Vec<Candidate> = accepted
            .iter()
            .filter(|c| templates[c.template].flat_faces)
            .filter(|c| self.is_new(c, templates))
            .map(|c| (*c).clone())
            .collect();
        let moved =
            |c: &Candidate| place.along_faces(c.template, c.at, &[&FAR[..], &NEAR].concat());
        let mut found: Vec<Candidate> = last.par_iter().map(moved).collect();
        found.retain(|c| self.is_new(c, templates));
        last.extend(found.iter().cloned());
        for _ in 0..ROW {
            let starts: Vec<(usize, CentredPose)> =
                last.iter().flat_map(|block| place.beside(block)).collect();
            let starts: Vec<(usize, CentredPose)> = starts
                .into_iter()
                .filter(|(t, at)| self.is_new_place(*t, at.centre, templates))
                .collect();
            let beside: Vec<Candidate> =
                starts.par_iter().filter_map(|(t, at)| place.settled(*t, *at)).collect();
            last = beside.into_iter().filter(|c| self.is_new(c, templates)).collect();
            found.extend(last.iter().cloned());
            if last.is_empty() {
                break;
            }
        }
        found
    }

    /// Whether a block was not looked at before; from now on it was.
    fn is_new(&mut self, block: &Candidate, templates: &[Template]) -> bool {
        let new = self.is_new_place(block.template, block.at.centre, templates);
        if new {
            self.known.push((block.template, block.at.centre));
        }
        new
    }

    fn is_new_place(&self, template: usize, centre: Vec3, templates: &[Template]) -> bool {
        let near_m = SAME_PLACE * templates[template].model.d_box_m;
        !self.known.iter().any(|(t, c)| *t == template && (*c - centre).length() < near_m)
    }
}

struct Place<'a> {
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    config: &'a EvidenceConfig,
}

impl Place<'_> {
    fn case(&self, template: usize, at: CentredPose) -> Candidate {
        let evidence = weigh(&self.templates[template], &at, self.measured, self.config);
        Candidate { template, at, evidence }
    }

    /// A place on each side of a block.
    fn beside(&self, block: &Candidate) -> Vec<(usize, CentredPose)> {
        let size = self.templates[block.template].model.mesh.bounds().size();
        let axes = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
        let place = |axis: Vec3| {
            let centre = block.at.centre + block.at.rotation * axis * (1.0 + JOINT);
            (block.template, CentredPose { centre, ..block.at })
        };
        axes.into_iter().flat_map(|axis| [axis, -axis]).map(place).collect()
    }

    /// A pose fitted to the points around it, then moved along its faces to where they end; `None` where there is hardly
    /// any surface for a block.
    fn settled(&self, template: usize, start: CentredPose) -> Option<Candidate> {
        if self.case(template, start).evidence.score() < GOES_ON {
            return None;
        }
        let (t, measured) = (&self.templates[template], self.measured);
        let fine = (2.5 * measured.noise_sd_m).max(0.03 * t.model.d_max_m);
        let near = nearby(measured, start.centre, t.model.d_max_m + fine, POINTS);
        let reach = reach_m(measured, t, self.config);
        let (at, _) = fit(&t.fit_model(), &near, start, &[fine, reach]);
        let found = self.along_faces(template, at, &NEAR);
        (found.evidence.score() > GOES_ON).then_some(found)
    }

    /// The best of a pose and those moved along its axes by these parts of its length.
    fn along_faces(&self, template: usize, at: CentredPose, shifts: &[f32]) -> Candidate {
        let mut best = self.case(template, at);
        let length_m = self.templates[template].model.d_box_m;
        for shift in shifts {
            for axis in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                let centre = best.at.centre + best.at.rotation * axis * (shift * length_m);
                let moved = self.case(template, CentredPose { centre, ..best.at });
                if moved.evidence.score() > best.evidence.score() {
                    best = moved;
                }
            }
        }
        best
    }
}
