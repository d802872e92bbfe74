//! The site of the planning tables: a span like Sawara's, 25 m wide and 150 m long at 100 percent, 1000 tetrapods of 2 m on
//! a level bed, a level design 2.4 m above it, tetrapods one size larger to add.

use crate::{Bench, ReproduceError, Table};
use geom::{HeightMap, Observer, SeedTree, Vec2};
use placement::PlacementModel;
use plan::{OfVolume, PlanConfig, PlanInput, Policy};
use scene::{Catalog, DesignSurface, Plan, Scene, Shape, SiteFrame};
use synth::Recipe;

const WIDTH_M: f64 = 25.0;
const LENGTH_M: f64 = 150.0;
const LEVEL_M: f64 = 2.4;
/// Blocks on a square metre.
const BLOCKS_PER_M2: f64 = 1000.0 / (150.0 * 25.0);
/// What lies there, what is added, and the smaller of two types that are added together.
pub(crate) const EXISTING: &str = "existing";
pub(crate) const SUPPLEMENT: &str = "supplement";
pub(crate) const SMALLER: &str = "smaller";
const SIZES_M: [(&str, f32); 3] = [(EXISTING, 2.0), (SUPPLEMENT, 2.1), (SMALLER, 1.7)];

/// The policies in the order of the tables.
pub(crate) const POLICIES: [(&str, Policy); 3] =
    [("random", Policy::Random), ("network", Policy::Network), ("search", Policy::Search)];

/// A site to plan on: how large, of which blocks, which of the piles of the bench's seed.
#[derive(Clone, Copy)]
pub(crate) struct Works {
    pub length_m: f64,
    pub width_m: f64,
    pub shape: Make,
    pub number: u64,
}

impl Works {
    /// The method's span, on the bench's percentage of the length.
    pub fn span(bench: &Bench) -> Self {
        let length_m = LENGTH_M * bench.settings.percent as f64 / 100.0;
        Self { length_m, width_m: WIDTH_M, shape: |size| Shape::Tetrapod { size }, number: 0 }
    }
}

/// A shape of a size, metres.
type Make = fn(f32) -> Shape;

/// Shapes that the planning tables are made with, by the size of the block.
pub(crate) const SHAPES: [(&str, Make); 2] = [
    ("tetrapod", |size| Shape::Tetrapod { size }),
    ("xbloc-like", |size| Shape::XblocLike { size }),
];

/// The span with everything planning needs.
pub(crate) struct Span {
    pub catalog: Catalog,
    pub scene: Scene,
    pub works: Works,
    design: DesignSurface,
    frame: SiteFrame,
    model: PlacementModel,
    seed: u64,
}

impl Span {
    /// Drops the pile of the bench's seed on its percentage of the length.
    pub fn new(bench: &Bench) -> Result<Self, ReproduceError> {
        Self::of(bench, &Works::span(bench))
    }

    /// Drops the pile of a site.
    pub fn of(bench: &Bench, works: &Works) -> Result<Self, ReproduceError> {
        let Works { length_m, width_m, shape, number } = *works;
        let block = |(name, size): (&str, f32)| blocks::shape_model(name, shape(size), 2300.0);
        let catalog = Catalog::new(SIZES_M.into_iter().map(block).collect::<Result<_, _>>()?);
        let count = (length_m * width_m * BLOCKS_PER_M2).round().max(1.0);
        let set = "the planning site";
        // The survey is not used: few points.
        let text = format!(
            "name = \"span\"\ncount = [{count}, {count}]\ndensity_per_m2 = 5\n\
             [[mix]]\nmodel = \"{EXISTING}\"\nshare = 1.0\n\
             [site]\nkind = \"strip\"\nlength_m = {length_m:.1}\nwidth_m = {width_m:.1}\n\
             [bed]\nstone_blocks = 0.0\n[sensor]\nkind = \"gaussian\"\n"
        );
        let recipe = Recipe::parse(&text)
            .map_err(|e| ReproduceError::Recipe { set: set.into(), message: e.to_string() })?;
        let seed = SeedTree::new(bench.settings.seed).child("span", number);
        let made = synth::scene(&recipe, &catalog, seed)
            .map_err(|source| ReproduceError::Scene { set: set.into(), index: 0, source })?;
        let (x, y) = (length_m / 2.0, width_m / 2.0);
        let design = DesignSurface::Level {
            level_m: LEVEL_M,
            boundary: vec![[-x, -y], [x, -y], [x, y], [-x, y]],
        };
        let model = PlacementModel::shipped()?;
        let (scene, frame, seed) = (made.scene, SiteFrame::default(), bench.settings.seed);
        Ok(Self { catalog, scene, works: *works, design, frame, model, seed })
    }

    fn half(&self) -> Vec2 {
        Vec2::new(self.works.length_m as f32 / 2.0, self.works.width_m as f32 / 2.0)
    }

    /// The plans of each v.
    pub fn plans(
        &self,
        config: &PlanConfig,
        volumes_m3: &[f32],
        seed: SeedTree,
        observer: &dyn Observer,
    ) -> Result<Vec<OfVolume>, ReproduceError> {
        if observer.cancelled() {
            return Err(ReproduceError::Stopped);
        }
        Ok(plan::plans_over_volumes(&self.input(), config, volumes_m3, seed, observer)?)
    }

    /// The thesis' distance (Tables 4.6, 4.7): of the added blocks' surface points that are seen from above, one a cell of
    /// 0.1 m, to the level of the design. Gaps between blocks and the pile below do not count; ours counts both.
    pub fn surface_distance_m(&self, plan: &Plan) -> f64 {
        let half = self.half();
        let mut surface = HeightMap::empty(-half, half, 0.1);
        for placement in &plan.placements {
            surface.raise(&self.catalog.get(placement.model).mesh, &placement.rest);
        }
        let seen = surface.z_m.iter().filter(|z| z.is_finite());
        let (sum, count) =
            seen.fold((0.0, 0_u32), |(sum, n), z| (sum + (f64::from(*z) - LEVEL_M).abs(), n + 1));
        if count == 0 { 0.0 } else { sum / f64::from(count) }
    }

    /// Seconds of a round's steps on the pile as it is: looking for windows, and pose and drop of one window by each policy.
    pub fn step_seconds(
        &self,
        seed: SeedTree,
        bench: &Bench,
    ) -> Result<Vec<(&'static str, f64, usize)>, ReproduceError> {
        let input = self.input();
        let clock = bench.clock;
        let mut steps = Vec::new();
        let config = settings(Policy::Search);
        let block = self.catalog.get(plan::block_to_place(&input, &config)?);
        let resolved = config.resolve(block, self.catalog.d_max_m())?;
        let half = self.half();
        let start = clock();
        let mut surface = HeightMap::empty(-half, half, resolved.cell_m);
        for block in &self.scene.blocks {
            surface.raise(&self.catalog.get(block.model).mesh, &block.site_from_block);
        }
        surface.fill_empty();
        steps.push(("height map of the pile", clock() - start, 1));
        let mut design = surface.clone();
        design.fill_with(|_, _| LEVEL_M as f32);
        let start = clock();
        let windows = plan::windows::detect(&surface, &design, &resolved, |_| true);
        steps.push(("windows (4.5)", clock() - start, 1));
        for (name, policy) in POLICIES {
            let most = windows.len().min(20) as u32;
            let start = clock();
            let seed = seed.child(name, 0);
            let answers = plan::each_window(&input, &settings(policy), most, seed, bench.observer)?;
            steps.push((name, clock() - start, answers.len().max(1)));
        }
        Ok(steps)
    }

    /// What planning is given.
    pub fn input(&self) -> PlanInput<'_> {
        PlanInput {
            scene: &self.scene,
            frame: &self.frame,
            design: &self.design,
            catalog: &self.catalog,
            placed: &[],
            proposer: Some(&self.model),
            survey: None,
        }
    }

    /// Volume of a block that is added.
    pub fn supplement_volume_m3(&self) -> f64 {
        let id = self.catalog.find(SUPPLEMENT).expect("it is in the span's catalogue");
        f64::from(self.catalog.get(id).volume_m3)
    }

    /// What its plans depend on beside their settings, in one line.
    pub fn stamp(&self) -> Result<String, ReproduceError> {
        let model = blake3::hash(&self.model.to_bytes()?).to_hex();
        let version = env!("CARGO_PKG_VERSION");
        Ok(format!(
            "{:.1} × {:.1} m, seed {}, network {}, tsumu {version}",
            self.works.length_m,
            self.works.width_m,
            self.seed,
            &model[..16]
        ))
    }

    /// What every page says of the site.
    pub fn words(&self) -> String {
        format!(
            "{:.1} × {} m, {} tetrapods of 2.0 m, supplement 2.1 m, level design {LEVEL_M} m above the bed; placement \
             network: {} ({} steps).",
            self.works.length_m,
            self.works.width_m,
            self.scene.blocks.len(),
            self.model.description.name,
            self.model.description.steps
        )
    }
}

/// The planner's settings for one policy, with the supplement.
pub(crate) fn settings(policy: Policy) -> PlanConfig {
    PlanConfig { policy, block: Some(SUPPLEMENT.into()), ..PlanConfig::default() }
}

/// The method's minimum volume v for the supplement.
pub(crate) fn method_volume_m3(span: &Span) -> Result<f32, ReproduceError> {
    let config = settings(Policy::Search);
    let block =
        span.catalog.get(span.catalog.find(SUPPLEMENT).expect("it is in the span's catalogue"));
    Ok(config.resolve(block, span.catalog.d_max_m())?.minimum_volume_m3)
}

/// The site in rows.
pub(crate) fn site_table(span: &Span) -> String {
    let mut table = Table::new(&["", "here", "thesis"]);
    let rows = [
        ("site", "simulated".to_string(), "Sawara port"),
        (
            "construction area, m",
            format!("{:.1} × {}", span.works.length_m, span.works.width_m),
            "150 × 25",
        ),
        (
            "existing blocks",
            format!("{} tetrapods of 2.0 m", span.scene.blocks.len()),
            "Clinger 5 t",
        ),
        ("supplement", "tetrapods of 2.1 m".to_string(), "Clinger 6 t"),
        ("design", format!("level, {LEVEL_M} m above the bed"), "the works' section"),
    ];
    for (name, here, thesis) in rows {
        table.row([name.to_string(), here, thesis.to_string()]);
    }
    table.finish()
}

/// Mean and standard deviation of a figure; one value has none.
pub(crate) fn mean_and_spread(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, if values.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 })
}
