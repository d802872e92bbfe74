//! The five parts of chapter 2 in our own make, what is learnt of them and what is judged on.

use crate::bin_kept::digits;
use crate::{Bench, ReproduceError};
use geom::{SeedTree, Vec3};
use scene::{BlockModel, Catalog};
use segment::Split;
use segment::tile::{LabelledScene, ThinScene};
use synth::{Recipe, SynthScene};
use teach::{Blocks, TrainingScenes};

/// Name of a part, its recipe, the thesis' name of the part it stands for and its figures there (Table 2.2, FPCC).
const PARTS: [(&str, &str, &str, [f32; 2]); 5] = [
    ("eye-bolt", include_str!("../../../recipes/bin-eye-bolt.toml"), "ring screw", [58.4, 48.7]),
    (
        "gear-shaft",
        include_str!("../../../recipes/bin-gear-shaft.toml"),
        "gear shaft",
        [54.3, 69.5],
    ),
    ("holed-plate", include_str!("../../../recipes/bin-holed-plate.toml"), "A", [89.7, 67.3]),
    ("hook-plate", include_str!("../../../recipes/bin-hook-plate.toml"), "B", [80.9, 50.9]),
    ("bracket", include_str!("../../../recipes/bin-bracket.toml"), "C", [78.6, 64.3]),
];

/// A part in its bin.
pub struct BinPart {
    /// Name in the recipe.
    pub name: &'static str,
    /// What it stands for in the thesis.
    pub stands_for: &'static str,
    /// The thesis' precision and recall of FPCC on it, percent.
    pub thesis: [f32; 2],
    /// Whether it is its own mirror image.
    pub mirrored: bool,
    /// The bin, not measured: the method's own clouds have no ground.
    pub recipe: Recipe,
    /// The part alone.
    pub catalog: Catalog,
}

/// All five, in the order of the thesis' tables; `own` puts another mesh in the place of one.
pub fn bin_parts(
    own: &dyn Fn(&str) -> Result<Option<BlockModel>, ReproduceError>,
) -> Result<Vec<BinPart>, ReproduceError> {
    let part = |(name, text, stands_for, thesis): (&'static str, &str, &'static str, [f32; 2])| {
        let wrong = |message: String| ReproduceError::Recipe { set: name.into(), message };
        let mut recipe = Recipe::parse(text).map_err(|e| wrong(e.to_string()))?;
        recipe.bin.measured = false;
        let catalog = match own(name)? {
            Some(model) => Catalog::new(vec![model]),
            None => {
                let spec =
                    recipe.catalog.clone().ok_or_else(|| wrong("it names no part".into()))?;
                blocks::catalog(&spec, &|_| Err("only built-in shapes here".into()))?
            }
        };
        let mirrored = !["hook-plate", "bracket"].contains(&name);
        Ok(BinPart { name, stands_for, thesis, mirrored, recipe, catalog })
    };
    PARTS.into_iter().map(part).collect()
}

impl BinPart {
    /// d_max of the part, metres.
    pub fn unit_m(&self) -> f32 {
        self.catalog.d_max_m()
    }

    /// Eight digits that stand for its mesh: another one of the user's has others.
    pub fn mesh_digits(&self) -> String {
        let vertices = self.catalog.iter().flat_map(|(_, model)| &model.mesh.vertices);
        let bytes: Vec<u8> =
            vertices.flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect();
        digits(&bytes)
    }

    fn training_scenes(&self) -> Result<TrainingScenes, ReproduceError> {
        Ok(TrainingScenes::new(self.recipe.clone(), self.catalog.clone(), Blocks::Catalog)?)
    }

    /// Shapes that weights trained on it know.
    pub fn shapes(&self) -> Result<Vec<segment::ShapeSignature>, ReproduceError> {
        Ok(self.training_scenes()?.shapes())
    }

    /// Root of everything that is learnt from.
    pub fn root(&self, seed: u64) -> SeedTree {
        SeedTree::new(seed).child("bin lessons", 0).child(self.name, 0)
    }

    /// Scene `index` to learn from; never one that is judged on.
    pub fn training_scene(
        &self,
        seed: u64,
        split: Split,
        index: u64,
    ) -> Result<LabelledScene, String> {
        let of = if split == Split::Train { "train" } else { "held out" };
        let training_scenes = self.training_scenes().map_err(|e| e.to_string())?;
        training_scenes.scene(index, self.root(seed).child(of, index))
    }

    /// The first `count` scenes to learn from, thinned as the networks see them.
    pub fn thin_training_scenes(
        &self,
        bench: &Bench,
        count: u64,
    ) -> Result<Vec<ThinScene>, ReproduceError> {
        let one = |index: u64| {
            if bench.observer.cancelled() {
                return Err(ReproduceError::Stopped);
            }
            let scene = self
                .training_scene(bench.settings.seed, Split::Train, index)
                .map_err(|message| ReproduceError::Recipe { set: self.name.into(), message })?;
            let seed = self.root(bench.settings.seed).child("thin", index);
            Ok(ThinScene::new(&scene, 1.0 / 7.0, 0.35, seed))
        };
        (0..count).map(one).collect()
    }

    /// The scenes that are judged on.
    pub fn held_out(&self, bench: &Bench, count: u64) -> Result<Vec<SynthScene>, ReproduceError> {
        (0..count).map(|index| self.scene(bench, &self.recipe, "bins", index)).collect()
    }

    /// One of them with its bin in view.
    pub fn seen_bin(&self, bench: &Bench, index: u64) -> Result<SynthScene, ReproduceError> {
        let mut recipe = self.recipe.clone();
        recipe.bin.measured = true;
        self.scene(bench, &recipe, "bins", index)
    }

    /// One with so many parts.
    pub fn crowd(&self, bench: &Bench, parts: u32) -> Result<SynthScene, ReproduceError> {
        let recipe = Recipe { count: [parts, parts], ..self.recipe.clone() };
        self.scene(bench, &recipe, "crowds", parts.into())
    }

    fn scene(
        &self,
        bench: &Bench,
        recipe: &Recipe,
        kind: &str,
        index: u64,
    ) -> Result<SynthScene, ReproduceError> {
        if bench.observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        let seed = SeedTree::new(bench.settings.seed).child(kind, 0).child(self.name, index);
        let set = self.name.into();
        synth::scene(recipe, &self.catalog, seed).map_err(|source| ReproduceError::Scene {
            set,
            index,
            source,
        })
    }
}

/// The positions of a cloud in units of d_max.
pub fn in_units(position_m: &[Vec3], unit_m: f32) -> Vec<Vec3> {
    position_m.iter().map(|p| *p / unit_m).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recipes_read_and_are_the_parts_named() {
        let parts = bin_parts(&|_| Ok(None)).unwrap();
        assert_eq!(parts.len(), 5);
        for part in parts {
            assert_eq!(part.catalog.len(), 1);
            assert!(part.catalog.find(part.name).is_some(), "{}", part.name);
            assert!(!part.recipe.bin.measured && part.recipe.name.ends_with(part.name));
        }
    }
}
