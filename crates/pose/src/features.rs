//! The features of an accepted block: what speaks for and against it in the context it is stated in.
//!
//! In: the accepted blocks at their final poses with their points, every candidate there was and the bed. Out: the
//! numbers that the confidence is a function of.

use crate::EvidenceConfig;
use crate::absolute::{Absolute, CommonSize, common_size};
use crate::acceptance::{Candidate, overlap_tolerance_m};
use crate::beyond::{points_beyond, worth_of_edges};
use crate::confidence::Features;
use crate::evidence::{Evidence, overlap_m2, reach_m, shared_inside, weigh};
use crate::finish::{Accepted, distance_m, fit_points, largest_sd};
use crate::fit::CentredPose;
use crate::ground::Ground;
use crate::measured::Measured;
use crate::pile_facts::PileFacts;
use crate::rivals::forced;
use crate::shell::Shells;
use crate::template::Template;
use geom::Vec3;
use rayon::prelude::*;
use scene::{PoseLimits, SensorKind, Survey};

/// A pose this far from the stated one, over a true positive's limits, is another pose and not the same one unrefined.
const ANOTHER: f32 = 1.5;

/// With this many points half is believed of how far they lie off: those of one beam or one pass err together.
const FEW: f32 = 100.0;

/// Points lie in a plane and not on a block when they are off it by less than this part of what they are off the block.
const FLATTER: f32 = 0.7;
/// A plane goes on when it holds so many more points beside a block's own.
const GOES_ON: f32 = 0.5;

/// What is explained around a block is asked within so many d_max.
const AROUND: f32 = 1.5;

/// Everything a block is compared with.
pub struct Context<'a> {
    blocks: &'a [Accepted],
    pool: &'a [Candidate],
    templates: &'a [Template<'a>],
    measured: &'a Measured,
    sensor: SensorKind,
    /// How far points lie from the blocks of this survey, metres: the median, each block counted by what it explains.
    typical_m: f32,
    /// What each block is by itself.
    absolute: Vec<Absolute>,
    shells: Shells,
    /// Share of the points that blocks explain, those of the bed aside.
    explained: f32,
}

impl<'a> Context<'a> {
    /// `points`: survey points of each block.
    #[allow(clippy::too_many_arguments)] // each is one of the stage's own values
    pub fn new(
        survey: &Survey,
        blocks: &'a [Accepted],
        points: &[Vec<u32>],
        pool: &'a [Candidate],
        templates: &'a [Template<'a>],
        measured: &'a Measured,
        ground: Option<&Ground>,
        config: &EvidenceConfig,
        facts: Option<&PileFacts>,
    ) -> Self {
        let mut off: Vec<(f32, f32)> = blocks
            .par_iter()
            .zip(points)
            .map(|(block, own)| {
                let sample = fit_points(survey, measured, own);
                (distance_m(&templates[block.template], &block.at, &sample), block.gain.max(0.0))
            })
            .collect();
        off.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * off.iter().map(|o| o.1).sum::<f32>();
        let mut sum = 0.0;
        let middle = off.iter().find(|o| {
            sum += o.1;
            sum >= half
        });
        let own_m = middle.map_or(0.0, |o| o.0).max(1e-6);
        let typical_m = facts.and_then(|f| f.typical_m).unwrap_or(own_m);
        let shells = Shells::new(blocks, templates, measured, ground, config);
        let absolute: Vec<Absolute> = blocks
            .par_iter()
            .zip(&shells.of)
            .map(|(block, shell)| {
                let template = &templates[block.template];
                Absolute::of(block, shell, template, measured, reach_m(measured, template, config))
            })
            .collect();
        let known = facts.and_then(|f| f.explained);
        let explained = known.unwrap_or_else(|| shells.explained_by(|_| true));
        let sensor = survey.sensor;
        Self { blocks, pool, templates, measured, sensor, typical_m, absolute, shells, explained }
    }

    /// The size that fits the blocks for which `counts` holds best.
    pub fn size_of(&self, counts: impl Fn(usize) -> bool) -> Option<CommonSize> {
        let all = self.absolute.iter().enumerate();
        let of: Vec<Absolute> = all.filter(|(entry, _)| counts(*entry)).map(|(_, a)| *a).collect();
        common_size(&of, self.sensor)
    }

    /// Working points at places for which `owns` holds that the blocks explain for which `counts` holds, and all that stand above the
    /// bed there.
    pub fn explained_where(
        &self,
        counts: impl Fn(usize) -> bool,
        owns: impl Fn(Vec3) -> bool,
    ) -> (usize, usize) {
        self.shells.explained_where(counts, |i| owns(self.measured.position[i]))
    }

    /// How far points usually lie from the blocks, metres, and the share of the points that blocks explain.
    pub fn of_the_pile(&self) -> (f32, f32) {
        (self.typical_m, self.explained)
    }

    /// The features of a block at its final pose, on its own points, from which the surface is off by `distance_m`.
    pub fn features(
        &self,
        entry: usize,
        points: &[u32],
        distance_m: f32,
        covariance: Option<&[f32; 36]>,
        config: &EvidenceConfig,
    ) -> Features {
        let block = &self.blocks[entry];
        let absolute = self.absolute[entry];
        let template = &self.templates[block.template];
        let case = weigh(template, &block.at, self.measured, config);
        let own = self.measured.working(points);
        let (mut area_m2, mut weight, mut count) = (0.0, 0.0, 0);
        for &(i, w) in &case.explained {
            if own.binary_search(&i).is_ok() {
                area_m2 += self.measured.point_area_m2 * w;
                weight += w;
                count += 1;
            }
        }
        let (shift_sd, turn_sd) =
            covariance.map_or((f32::INFINITY, f32::INFINITY), |c| largest_sd(c, template.model));
        Features {
            area: area_m2 / case.unit_m2,
            fit: weight / (count as f32).max(1.0),
            own: count as f32 / (case.explained.len() as f32).max(1.0),
            agreement: case.agreement,
            against: case.against_m2 / area_m2.max(1e-6),
            shared: self.shared(block),
            shift_sd,
            turn_sd,
            rough: (distance_m / self.typical_m).powf(count as f32 / (count as f32 + FEW)),
            rival: self.rival(block, &case, &own, covariance, config),
            type_margin: block.type_margin,
            in_a_plane: self.in_a_plane(block, &own, distance_m),
            goes_on: self.goes_on(entry, count, config),
            noisy: distance_m / self.measured.noise_sd_m.max(0.3 * template.field.cell_m()),
            shell: absolute.shell,
            off: absolute.off,
            bias: absolute.bias,
            covered: absolute.covered,
            hollow: absolute.hollow,
            scale: absolute.held_scale().abs(),
            around: self.shells.explained_around(
                self.measured,
                block.at.centre,
                AROUND * template.model.d_max_m,
            ),
            explained: self.explained,
            flat_faces: template.flat_faces,
        }
    }

    /// Whether the block's own points lie nearer to one plane than to the block and that plane goes on beside it: a bed,
    /// a wall or a slab that a strip of the block happens to touch.
    fn in_a_plane(&self, block: &Accepted, own: &[u32], distance_m: f32) -> bool {
        let at = |i: &u32| self.measured.position[*i as usize];
        let middle = own.iter().map(at).sum::<Vec3>() / (own.len() as f32).max(1.0);
        let facing: Vec3 = own.iter().map(|i| self.measured.normal[*i as usize]).sum();
        let Some(normal) = facing.try_normalize() else { return false };
        let off = |p: Vec3| normal.dot(p - middle).abs();
        let off_m = own.iter().map(|i| off(at(i))).sum::<f32>() / (own.len() as f32).max(1.0);
        if off_m > FLATTER * distance_m {
            return false;
        }
        let mut beside = 0;
        let reach_m = self.templates[block.template].model.d_max_m;
        self.measured.grid.for_each_within(block.at.centre, reach_m, |i, p, _| {
            beside += usize::from(off(p) < distance_m && own.binary_search(&i).is_err());
        });
        beside as f32 > GOES_ON * own.len() as f32
    }

    /// How many points of surface go on beyond the block's edges and are no other block's, over its own `count`; 0 for a block
    /// that is not made of a few flat faces, whose edges may be its own steps.
    fn goes_on(&self, entry: usize, count: usize, config: &EvidenceConfig) -> f32 {
        let block = &self.blocks[entry];
        let template = &self.templates[block.template];
        if !template.flat_faces {
            return 0.0;
        }
        let reach = reach_m(self.measured, template, config);
        let open = |i: u32| {
            let of = self.shells.explained[i as usize];
            of == u32::MAX || of == entry as u32
        };
        let beyond = points_beyond(template, &block.at, self.measured, reach, open);
        worth_of_edges(template.edge_share) * beyond as f32 / (count as f32).max(1.0)
    }

    /// Share of the block's inside within a block that was accepted before it.
    fn shared(&self, block: &Accepted) -> f32 {
        let template = &self.templates[block.template];
        let tolerance_m = overlap_tolerance_m(self.measured, template);
        self.blocks
            .iter()
            .filter(|o| !std::ptr::eq(*o, block) && o.gain > block.gain)
            .map(|o| {
                shared_inside(
                    (&self.templates[o.template], &o.at),
                    (template, &block.at),
                    tolerance_m,
                )
            })
            .fold(0.0, f32::max)
    }

    /// Other accepted blocks that a block may reach, those accepted before it.
    fn neighbours(&self, block: &Accepted) -> Vec<&Accepted> {
        let d = |b: &Accepted| self.templates[b.template].model.d_max_m;
        self.blocks
            .iter()
            .filter(|o| !std::ptr::eq(*o, block) && o.gain > block.gain)
            .filter(|o| (o.at.centre - block.at.centre).length() < d(o) + 2.0 * d(block))
            .collect()
    }

    /// How well the best other pose of the same type, met by the search or forced, explains the block's own points, over
    /// how well the stated one does.
    /// Near 1 where the points do not tell one from the other: a cube of which one face and no edge is seen.
    fn rival(
        &self,
        block: &Accepted,
        case: &Evidence,
        own: &[u32],
        covariance: Option<&[f32; 36]>,
        config: &EvidenceConfig,
    ) -> f32 {
        let template = &self.templates[block.template];
        let right = PoseLimits::right(template.model);
        let (shift_m, turn_rad) = (ANOTHER * right.displacement_m, ANOTHER * right.rotation_rad);
        let worth = |e: &Evidence| {
            let explained: f32 =
                e.explained.iter().filter(|x| own.binary_search(&x.0).is_ok()).map(|x| x.1).sum();
            explained * e.point_area_m2 - e.against_m2
        };
        let neighbours = self.neighbours(block);
        let tolerance_m = overlap_tolerance_m(self.measured, template);
        let overlap = |at: &CentredPose| {
            let with = |o: &&Accepted| {
                let other = (&self.templates[o.template], &o.at);
                overlap_m2(other, (template, at), tolerance_m)
            };
            config.overlap_weight * neighbours.iter().map(with).sum::<f32>()
        };
        let stated = worth(case) - overlap(&block.at);
        // Overlaps cost time: only what would be the best so far is asked for them.
        let better = |best: f32, at: &CentredPose, worth: f32| {
            if worth > best { best.max(worth - overlap(at)) } else { best }
        };
        let met = self
            .pool
            .iter()
            .filter(|c| c.template == block.template)
            .filter(|c| (c.at.centre - block.at.centre).length() < template.model.d_max_m)
            .filter(|c| !template.same(&c.at, &block.at, shift_m, turn_rad))
            .fold(0.0, |best, c| better(best, &c.at, worth(&c.evidence)));
        let limits = (shift_m, turn_rad);
        let best = forced(block, own, covariance, template, self.measured, limits)
            .iter()
            .fold(met, |best, at| {
                better(best, at, worth(&weigh(template, at, self.measured, config)))
            });
        if stated > 0.0 { best / stated } else { f32::INFINITY }
    }
}
