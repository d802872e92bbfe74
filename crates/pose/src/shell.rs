//! What is measured around the accepted blocks, without a cut-off: which block each point is nearest to and how far.
//!
//! A fit looks at the points within its reach and finds them near, whatever it is fitted to. Here the points of a shell
//! several reaches thick have their say: of a block that is there they lie on its surface, of a stone, a tree or a block
//! of another size many lie beside it, or on one side here and on the other there.

use crate::EvidenceConfig;
use crate::evidence::reach_m;
use crate::finish::Accepted;
use crate::fit::agreement;
use crate::ground::Ground;
use crate::measured::Measured;
use crate::template::Template;
use geom::Vec3;

/// A point in a block's shell.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// Working point.
    pub point: u32,
    /// Signed distance from the surface, metres.
    pub off_m: f32,
    /// Outward normal of the surface there, block coordinates.
    pub face: Vec3,
    /// How much a face turned like this can be what was measured, in [0, 1].
    pub agreement: f32,
}

/// The shells of all accepted blocks: every working point belongs to the nearest one.
pub struct Shells {
    /// Points of each block, ascending.
    pub of: Vec<Vec<Near>>,
    /// Block within reach of each working point, the nearest; `u32::MAX` where there is none.
    pub explained: Vec<u32>,
    /// Working points the bed explains.
    pub bed: Vec<bool>,
}

/// A shell is so many reaches thick, within these parts of d_max.
const REACHES: f32 = 4.0;
const THINNEST: f32 = 0.08;
const THICKEST: f32 = 0.25;
/// Points are explained within so many reaches.
const EXPLAINED: f32 = 1.5;
/// Points that the bed explains at least so well are the bed's.
const OF_THE_BED: f32 = 0.3;

impl Shells {
    /// Gives every working point to the nearest block.
    pub fn new(
        blocks: &[Accepted],
        templates: &[Template],
        measured: &Measured,
        ground: Option<&Ground>,
        config: &EvidenceConfig,
    ) -> Self {
        let points = measured.position.len();
        let mut nearest: Vec<(f32, u32)> = vec![(f32::INFINITY, u32::MAX); points];
        let mut explained = vec![u32::MAX; points];
        for (entry, block) in blocks.iter().enumerate() {
            let template = &templates[block.template];
            let reach = reach_m(measured, template, config);
            let d_max = template.model.d_max_m;
            let thick = (REACHES * reach).clamp(THINNEST * d_max, THICKEST * d_max);
            let block_from_site = block.at.pose(template.model.centre).inverse();
            measured.grid.for_each_within(block.at.centre, d_max + thick, |i, p, _| {
                let d = template.field.distance_m(block_from_site * p).abs();
                if d < thick && d < nearest[i as usize].0 {
                    nearest[i as usize] = (d, entry as u32);
                    if d < EXPLAINED * reach {
                        explained[i as usize] = entry as u32;
                    }
                }
            });
        }
        let bed: Vec<bool> = (0..points)
            .map(|i| {
                ground.is_some_and(|g| g.explained[i] > OF_THE_BED) && explained[i] == u32::MAX
            })
            .collect();
        let mut of = vec![Vec::new(); blocks.len()];
        for (i, &(_, entry)) in nearest.iter().enumerate() {
            if entry == u32::MAX || bed[i] {
                continue;
            }
            let block = &blocks[entry as usize];
            let template = &templates[block.template];
            let site_from_block = block.at.pose(template.model.centre);
            let (off_m, face) = template.field.at(site_from_block.inverse() * measured.position[i]);
            let turned = site_from_block.rotation * face;
            let agreement = agreement(turned, &measured.fit_point(i as u32));
            of[entry as usize].push(Near { point: i as u32, off_m, face, agreement });
        }
        Self { of, explained, bed }
    }

    /// Share of the points within a radius that a block explains, those of the bed aside; 1 where there are none.
    pub fn explained_around(&self, measured: &Measured, centre: Vec3, radius_m: f32) -> f32 {
        let (mut explained, mut all) = (0, 0);
        measured.grid.for_each_within(centre, radius_m, |i, _, _| {
            if !self.bed[i as usize] {
                all += 1;
                explained += usize::from(self.explained[i as usize] != u32::MAX);
            }
        });
        explained as f32 / (all as f32).max(1.0)
    }

    /// The same of the whole survey, by the blocks for which `counts` holds.
    pub fn explained_by(&self, counts: impl Fn(usize) -> bool) -> f32 {
        let (explained, standing) = self.explained_where(counts, |_| true);
        explained as f32 / (standing as f32).max(1.0)
    }

    /// How many of the working points for which `here` holds the blocks explain for which `counts` holds, and how many there are,
    /// those of the bed aside.
    pub fn explained_where(
        &self,
        counts: impl Fn(usize) -> bool,
        here: impl Fn(usize) -> bool,
    ) -> (usize, usize) {
        let (mut explained, mut standing) = (0, 0);
        for (i, &block) in self.explained.iter().enumerate().filter(|(i, _)| here(*i)) {
            standing += usize::from(!self.bed[i]);
            explained += usize::from(block != u32::MAX && counts(block as usize));
        }
        (explained, standing)
    }
}
