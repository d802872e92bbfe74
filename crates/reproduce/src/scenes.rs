//! The six site-sensor sets of the method and their held-out scenes.

use crate::{Bench, ReproduceError};
use geom::SeedTree;
use scene::{Catalog, Segmentation};
use segment::{SegmentConfig, SegmentModel, segment};
use synth::{Recipe, SynthScene};

/// A recipe with its catalogue.
#[derive(Clone, Debug)]
pub struct SiteSet {
    /// As in `recipes/`.
    pub name: &'static str,
    /// What its scenes look like.
    pub recipe: Recipe,
    /// Its blocks.
    pub catalog: Catalog,
}

/// The recipes, as they lie in `recipes/`.
const RECIPES: [(&str, &str); 6] = [
    ("sawara-uav", include_str!("../../../recipes/sawara-uav.toml")),
    ("sawara-mbes", include_str!("../../../recipes/sawara-mbes.toml")),
    ("todohokke-uav", include_str!("../../../recipes/todohokke-uav.toml")),
    ("todohokke-mbes", include_str!("../../../recipes/todohokke-mbes.toml")),
    ("era-uav", include_str!("../../../recipes/era-uav.toml")),
    ("era-mbes", include_str!("../../../recipes/era-mbes.toml")),
];

/// The thesis' second shape at Todohokke, in one size and in two.
const SECOND_SHAPE: [(&str, &str); 2] = [
    ("todohokke-b-uav", include_str!("../../../recipes/todohokke-b-uav.toml")),
    ("todohokke-b-mbes", include_str!("../../../recipes/todohokke-b-mbes.toml")),
];

/// The thesis' own simplification of the first site: white noise, no ground.
const WHITE_NOISE: [(&str, &str); 2] = [
    ("white-noise-uav", include_str!("../../../recipes/white-noise-uav.toml")),
    ("white-noise-mbes", include_str!("../../../recipes/white-noise-mbes.toml")),
];

/// Two sets as simple as the thesis', on which FPCC can be compared.
pub fn white_noise_sets() -> Result<Vec<SiteSet>, ReproduceError> {
    WHITE_NOISE.iter().map(|&(name, text)| SiteSet::parse(name, text)).collect()
}

/// All six, in the order of the thesis' tables.
pub fn site_sets() -> Result<Vec<SiteSet>, ReproduceError> {
    RECIPES.iter().map(|&(name, text)| SiteSet::parse(name, text)).collect()
}

/// The six sets with two shapes, as the thesis has them: A (tetrapods) in three sizes at Sawara and Era, B (dolosse) in two at
/// Todohokke. Beyond a quick look also Todohokke with tetrapods, on which our settings were fitted.
pub fn table_sets(quick: bool) -> Result<Vec<SiteSet>, ReproduceError> {
    let mut sets = site_sets()?;
    let second = SECOND_SHAPE.iter().map(|&(name, text)| SiteSet::parse(name, text));
    let first: Vec<SiteSet> = sets.splice(2..4, second.collect::<Result<Vec<_>, _>>()?).collect();
    sets.extend(first.into_iter().filter(|_| !quick));
    Ok(sets)
}

impl SiteSet {
    /// The set a recipe describes; its blocks must be built-in shapes.
    pub fn parse(name: &'static str, text: &str) -> Result<Self, ReproduceError> {
        let wrong = |message: String| ReproduceError::Recipe { set: name.into(), message };
        let recipe = Recipe::parse(text).map_err(|e| wrong(e.to_string()))?;
        let spec = recipe.catalog.clone().ok_or_else(|| wrong("it names no blocks".into()))?;
        let catalog = blocks::catalog(&spec, &|_| Err("only built-in shapes here".into()))?;
        Ok(Self { name, recipe, catalog })
    }

    /// The scenes the settings ask for, made one after the other.
    pub fn held_out<'a>(&'a self, bench: &'a Bench) -> HeldOut<'a> {
        HeldOut { set: self, bench, next: 0 }
    }

    /// Instances of the `index`-th held-out scene by a network with the default settings.
    pub fn segmented(
        &self,
        bench: &Bench,
        model: &SegmentModel,
        made: &SynthScene,
        index: u64,
    ) -> Result<Segmentation, ReproduceError> {
        let seed = SeedTree::new(bench.settings.seed).child("segment", index);
        let (cloud, config) = (&made.survey.cloud, SegmentConfig::default());
        Ok(segment(cloud, &self.catalog, model, &config, seed, bench.observer)?)
    }

    /// Scene `index` of a seed.
    pub fn scene(&self, seed: u64, index: u64) -> Result<SynthScene, ReproduceError> {
        let node = SeedTree::new(seed).child(self.name, index);
        synth::scene(&self.recipe, &self.catalog, node).map_err(|source| ReproduceError::Scene {
            set: self.name.into(),
            index,
            source,
        })
    }
}

/// Iterator over a set's held-out scenes; ends with [`ReproduceError::Stopped`] when the observer says so.
pub struct HeldOut<'a> {
    set: &'a SiteSet,
    bench: &'a Bench<'a>,
    next: u64,
}

impl Iterator for HeldOut<'_> {
    type Item = Result<SynthScene, ReproduceError>;

    fn next(&mut self) -> Option<Self::Item> {
        let index = self.next;
        if index >= self.bench.settings.scenes {
            return None;
        }
        self.next += 1;
        if self.bench.observer.cancelled() {
            self.next = u64::MAX;
            return Some(Err(ReproduceError::Stopped));
        }
        Some(self.set.scene(self.bench.settings.seed, index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_have_one_shape_in_three_sizes_and_another_in_two() {
        let sets = table_sets(true).unwrap();
        assert_eq!(sets.len(), 6);
        let mut names: Vec<String> = Vec::new();
        for (_, model) in sets.iter().flat_map(|s| s.catalog.iter()) {
            if !names.contains(&model.name) {
                names.push(model.name.clone());
            }
        }
        let of = |shape: &str| names.iter().filter(|n| n.starts_with(shape)).count();
        assert_eq!((of("tetrapod"), of("dolos"), names.len()), (3, 2, 5));
        assert_eq!(table_sets(false).unwrap().len(), 8);
    }

    #[test]
    fn the_recipes_read_and_name_their_blocks() {
        let mut sets = site_sets().unwrap();
        assert_eq!(sets.len(), 6);
        sets.extend(white_noise_sets().unwrap());
        sets.extend(table_sets(true).unwrap());
        assert!(sets.iter().all(|s| s.recipe.name == s.name && !s.catalog.is_empty()));
    }
}
