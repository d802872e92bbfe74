//! What the stage says of a survey as a whole, beside its blocks.

use crate::absolute::CommonSize;
use crate::size::{REFUSED_FROM, SIGNIFICANT, WARNED_FROM};
use crate::viewpoint::Viewpoint;
use serde::{Deserialize, Serialize};

/// Facts of the whole survey that a reader of the blocks should know.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PileVerdict {
    /// Share of what stands above the bed that the stated blocks explain, in [0, 1].
    pub explained: f32,
    /// Blocks that are stated.
    pub stated: usize,
    /// The size that fits the blocks best over the catalogue's; `None` where too few blocks tell.
    pub size: Option<CommonSize>,
    /// Whether the blocks fit the mirror image of the catalogue's better.
    pub mirrored: bool,
    /// Segments and places that bed, walls or stones explain better: nothing a person need look at.
    pub not_a_block: usize,
    /// From where the survey was taken to be measured; `None` when sensor positions are known.
    pub viewpoint: Option<Viewpoint>,
}

/// Blocks that explain less than this of what stands above the bed are no pile of these blocks.
const UNLIKE: f32 = 0.2;

impl PileVerdict {
    /// Whether the blocks are so much larger or smaller than the catalogue's that none may be stated.
    pub fn wrong_size(&self) -> bool {
        self.size.is_some_and(|s| is_wrong(&s))
    }

    /// Whether the survey looks like something else than a pile of these blocks.
    pub fn unlike(&self) -> bool {
        self.explained < UNLIKE
    }

    /// What a person must be told before believing a block, a sentence each; nothing when all is as it should be.
    pub fn warnings(&self) -> Vec<String> {
        let mut told = Vec::new();
        if self.mirrored {
            told.push(
                "the blocks fit the mirror image of the catalogue's: none is stated, check the axes of mesh and survey".into(),
            );
        }
        if let Some(size) = self.size.filter(is_wrong) {
            told.push(format!(
                "the blocks fit {:.1} ± {:.1} % of the catalogue's size: none is stated, check size and unit",
                100.0 * size.factor,
                100.0 * size.factor_sd
            ));
        }
        if let Some(size) = self.size.filter(|s| !is_wrong(s) && is_off(s, WARNED_FROM)) {
            told.push(format!(
                "the blocks fit {:.1} ± {:.1} % of the catalogue's size: hold it against drawing and unit",
                100.0 * size.factor,
                100.0 * size.factor_sd
            ));
        }
        if self.unlike() {
            told.push(format!(
                "this does not look like a pile of these blocks: the blocks explain {:.0} % of what stands above the ground",
                100.0 * self.explained
            ));
        }
        told
    }

    /// What a person may like to know.
    pub fn notes(&self) -> Vec<String> {
        let mut told = Vec::new();
        if self.not_a_block > 0 {
            told.push(format!(
                "{} places are bed, wall or stone and not a block",
                self.not_a_block
            ));
        }
        if let Some(viewpoint) = &self.viewpoint {
            told.push(format!("sensor positions unknown: taken as seen {}", viewpoint.name()));
        }
        told
    }
}

/// Whether a common size is significantly wrong.
pub fn is_wrong(size: &CommonSize) -> bool {
    is_off(size, REFUSED_FROM)
}

/// Whether a common size is significantly so far off.
fn is_off(size: &CommonSize, least: f32) -> bool {
    let off = (size.factor - 1.0).abs();
    off >= least && off > SIGNIFICANT * size.factor_sd
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_said_with_its_number() {
        let size = |factor, factor_sd| Some(CommonSize { factor, factor_sd, blocks: 9 });
        let right = PileVerdict { explained: 0.9, size: size(1.01, 0.003), ..Default::default() };
        assert_eq!(right.warnings(), Vec::<String>::new());
        let large = PileVerdict { size: size(1.06, 0.004), ..right.clone() };
        assert!(large.wrong_size() && large.warnings()[0].contains("106.0 ± 0.4 %"));
        let slightly = PileVerdict { size: size(1.02, 0.003), ..right.clone() };
        assert!(!slightly.wrong_size() && slightly.warnings()[0].contains("102.0 ± 0.3 %"));
        let unsure = PileVerdict { size: size(1.06, 0.03), ..right.clone() };
        assert!(!unsure.wrong_size());
        let trees = PileVerdict { explained: 0.04, not_a_block: 7, ..right };
        assert_eq!((trees.warnings().len(), trees.notes().len()), (1, 1));
    }
}
