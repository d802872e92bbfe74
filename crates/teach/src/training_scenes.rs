//! What the segmentation network learns from: piles of a recipe, scanned and labelled, made when they are asked for.

use geom::SeedTree;
use rand::RngExt;
use scene::{BlockModel, Catalog, PlacedBlock, Shape};
use segment::tile::LabelledScene;
use segment::{SegmentError, ShapeSignature};
use synth::{Recipe, Site};

/// Which blocks the piles are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blocks {
    /// Those of the catalogue.
    #[default]
    Catalog,
    /// One type a pile, of the size of the catalogue's: one in eight the catalogue's own, one a cube or an Antifer block,
    /// six a random union of convex parts that no other pile has. Piles have half as many blocks, for the sake of more
    /// piles. For a network that works on any shape.
    AnyShape,
}

/// A recipe with its blocks.
#[derive(Clone, Debug)]
pub struct TrainingScenes {
    recipe: Recipe,
    catalog: Catalog,
    blocks: Blocks,
    /// The sizes the network runs at.
    units_m: Vec<f32>,
}

/// Piles of other shapes tried before giving up; some random blocks never settle.
const MOST_SHAPES: u64 = 4;

impl TrainingScenes {
    /// Errors: an empty catalogue or a block without size.
    pub fn new(recipe: Recipe, catalog: Catalog, blocks: Blocks) -> Result<Self, SegmentError> {
        let units_m = segment::scales(&catalog)?;
        Ok(Self { recipe, catalog, blocks, units_m })
    }

    /// Name of the recipe.
    pub fn name(&self) -> &str {
        &self.recipe.name
    }

    /// The recipe's `[train]` table.
    pub fn train_table(&self) -> Option<&toml::Table> {
        self.recipe.train.as_ref()
    }

    /// The catalogue.
    pub fn catalog(&self) -> &Catalog {
        &self.catalog
    }

    /// Shapes a network trained on these piles knows; empty when it is meant for any.
    pub fn shapes(&self) -> Vec<ShapeSignature> {
        match self.blocks {
            Blocks::Catalog => {
                self.catalog.iter().map(|(_, model)| ShapeSignature::of(model)).collect()
            }
            Blocks::AnyShape => Vec::new(),
        }
    }

    /// The pile of a seed. `index` chooses among the sizes of the catalogue, each of which is looked at in turn.
    pub fn scene(&self, index: u64, seed: SeedTree) -> Result<LabelledScene, String> {
        match self.blocks {
            Blocks::Catalog => {
                let unit_m = self.units_m[(index / 2 % self.units_m.len() as u64) as usize];
                labelled(&self.recipe, &self.catalog, unit_m, seed)
            }
            Blocks::AnyShape => {
                let recipe = half_as_large(&self.recipe);
                let mut last = String::new();
                for attempt in 0..MOST_SHAPES {
                    let node = seed.child("shape", attempt);
                    let model = self.any_shape(node)?;
                    let unit_m = model.d_max_m;
                    match labelled(
                        &recipe,
                        &Catalog::new(vec![model]),
                        unit_m,
                        node.child("pile", 0),
                    ) {
                        Ok(scene) => return Ok(scene),
                        Err(error) => last = error,
                    }
                }
                Err(last)
            }
        }
    }

    /// A block of some shape, within a fifth of the size of one of the catalogue's.
    fn any_shape(&self, seed: SeedTree) -> Result<BlockModel, String> {
        let mut rng = seed.rng();
        let own = self
            .catalog
            .iter()
            .nth(rng.random_range(0..self.catalog.len()))
            .expect("within its length")
            .1;
        let built_in = |shape| {
            blocks::shape_model("stand-in", shape, own.density_kg_m3).map_err(|e| e.to_string())
        };
        let model = match rng.random_range(0..16) {
            0..2 => own.clone(),
            2 => built_in(Shape::Cube { size: 1.0 })?,
            3 => built_in(Shape::Antifer { size: 1.0 })?,
            _ => blocks::random_union(seed.child("union", 0)),
        };
        let size = rng.random_range(0.8..1.2);
        Ok(model.scaled(own.d_max_m * size / model.d_max_m))
    }
}

/// The recipe with half its blocks, of one type, on half its area.
fn half_as_large(recipe: &Recipe) -> Recipe {
    let side = std::f32::consts::FRAC_1_SQRT_2;
    let site = match recipe.site {
        Site::Strip { length_m, width_m } => {
            Site::Strip { length_m: length_m * side, width_m: width_m * side }
        }
        Site::Bin { length_m, width_m } => {
            Site::Bin { length_m: length_m * side, width_m: width_m * side }
        }
        Site::Pen { side_blocks } => Site::Pen { side_blocks: side_blocks * side },
    };
    let count = recipe.count.map(|n| (n / 2).max(1));
    Recipe { mix: Vec::new(), count, site, ..recipe.clone() }
}

/// One scanned pile with the truth of every point.
fn labelled(
    recipe: &Recipe,
    catalog: &Catalog,
    unit_m: f32,
    seed: SeedTree,
) -> Result<LabelledScene, String> {
    let made = synth::scene(recipe, catalog, seed).map_err(|e| e.to_string())?;
    let centre = |b: &PlacedBlock| b.site_from_block * catalog.get(b.model).centre;
    Ok(LabelledScene {
        position_m: made.survey.cloud.position_m,
        instance: made.instance,
        centre_m: made.scene.blocks.iter().map(centre).collect(),
        unit_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn training_scenes(blocks: Blocks) -> TrainingScenes {
        let text = "name = \"t\"\ncount = [6, 6]\ndensity_per_m2 = 100\n[bed]\nstone_blocks = 0.0\n\
                    [sensor]\nkind = \"gaussian\"\n";
        let model = blocks::shape_model("t", Shape::Tetrapod { size: 2.0 }, 2300.0).unwrap();
        TrainingScenes::new(Recipe::parse(text).unwrap(), Catalog::new(vec![model]), blocks)
            .unwrap()
    }

    #[test]
    fn any_shape_means_many_shapes_of_about_one_size() {
        let any = training_scenes(Blocks::AnyShape);
        let drawn: Vec<BlockModel> =
            (0..40).map(|i| any.any_shape(SeedTree::new(i)).unwrap()).collect();
        let own = any.catalog.d_max_m();
        assert!(drawn.iter().all(|m| (0.79..1.21).contains(&(m.d_max_m / own))));
        let signatures: Vec<_> = drawn.iter().map(ShapeSignature::of).collect();
        let distinct = signatures
            .iter()
            .enumerate()
            .filter(|(i, s)| !signatures[..*i].iter().any(|t| t.matches(s)));
        assert!(distinct.count() >= 8);
        assert!(any.shapes().is_empty());
    }

    #[test]
    fn every_point_of_a_block_lies_within_reach_of_its_centre() {
        for blocks in [Blocks::Catalog, Blocks::AnyShape] {
            let scene = training_scenes(blocks).scene(0, SeedTree::new(3)).unwrap();
            assert!(scene.instance.iter().any(|&i| i > 0));
            for (p, &i) in scene.position_m.iter().zip(&scene.instance).filter(|(_, i)| **i > 0) {
                assert!((scene.centre_m[i as usize - 1] - *p).length() < 1.2 * scene.unit_m);
            }
        }
    }
}
