//! The plan of a cut: `tiles.json` and the points beside it. Everything a tile follows from stands in it, so that tiles can be worked on
//! in any order, anywhere, by anybody who sees the folder.

use super::cell_points::CellFiles;
use super::facts;
use super::grid::{Cell, Core, Cut, Grid, Most};
use super::memory;
use super::part::PartReader;
use super::scan::{Scanned, scan};
use crate::error::OrBadInput;
use crate::lock::FolderLock;
use crate::recognition::RecogniseOptions;
use crate::{Error, Job, Result, Settings, Site, catalogue, outputs, site, version, weights};
use anyhow::{Context, anyhow};
use io::manifest::{Entry, entry, portable};
use pipeline::{Config, PileFacts};
use scene::{Catalog, MemoryBound, SensorKind, SiteFrame, SiteSpec};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Layout of the file that this version writes and reads.
const FORMAT: u32 = 1;
/// Name in the plan's folder.
pub(crate) const FILE: &str = "tiles.json";
/// Memory a tile may need when nobody says otherwise.
const DEFAULT_MEMORY: &str = "4GB";
/// Where the points lie in it.
const POINTS: &str = "points";

/// How a site is cut.
#[derive(Clone, Debug, PartialEq)]
pub struct TileOptions {
    /// About so many blocks a tile has at most.
    pub blocks: u64,
    /// How far a tile sees beyond what it owns, in lengths of the largest block (d_box).
    pub halo: f64,
    /// Memory that working on a tile may need.
    pub memory: MemoryBound,
}

impl Default for TileOptions {
    fn default() -> Self {
        // Beyond 2.5 d_box nothing hides a block: with it 541 blocks of a strip came out as from the whole, occlusion too.
        Self { blocks: 800, halo: 2.5, memory: DEFAULT_MEMORY.parse().expect("a test reads it") }
    }
}

/// A tile of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tile {
    /// Its name, the same in every plan of these works.
    pub key: String,
    core: Core,
    /// What it owns: west, south, east, north, site coordinates, metres.
    pub bounds_m: [f64; 4],
    /// About so many blocks lie in it at most.
    pub blocks: u64,
    /// Points it owns.
    pub points: u64,
    /// Points it reads.
    pub read_points: u64,
    /// Memory that working on it needs, bytes.
    pub memory_bytes: u64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CellEntry {
    cell: Cell,
    points: u64,
}

/// What `tiles.json` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    format: u32,
    version: String,
    site: PathBuf,
    inputs: BTreeMap<String, Entry>,
    seed: u64,
    /// Settings as asked for.
    asked: String,
    /// The same with the bed that the site states.
    config: String,
    weights: Option<PathBuf>,
    weights_line: String,
    grid: Grid,
    level_m: f64,
    halo_m: f64,
    most: Most,
    frame: SiteFrame,
    sensor: SensorKind,
    sensor_positions: Vec<[f64; 3]>,
    points: u64,
    strays: Vec<u32>,
    silent_lines: Vec<(u16, u16)>,
    facts: PileFacts,
    cells: Vec<CellEntry>,
    tiles: Vec<Tile>,
}

/// A site cut into tiles.
///
/// ```no_run
/// # fn main() -> tsumu::Result<()> {
/// use tsumu::{Job, RunOptions, TilePlan, TileRequest, TiledSite};
/// let (plan, job) = ("plan".as_ref(), Job::silent());
/// let cut = TilePlan::make("examples/breakwater".as_ref(), plan, &TiledSite::default(), &job)?;
/// for tile in cut.tiles() {
///     cut.work_on(&tile.key, &TileRequest::default(), &job)?;
/// }
/// tsumu::merge_tiles(&cut, "out".as_ref(), None, &RunOptions::default(), &job)?;
/// # Ok(()) }
/// ```
#[derive(Clone, Debug)]
pub struct TilePlan {
    folder: PathBuf,
    id: String,
    content: Content,
    cells: BTreeMap<Cell, u64>,
}

/// What a site is cut with.
#[derive(Clone, Debug, Default)]
pub struct TiledSite {
    /// Settings over the site's own.
    pub settings: Settings,
    /// Weights of recognition.
    pub recognise: RecogniseOptions,
    /// Sizes.
    pub tiles: TileOptions,
}

/// Where schedulers (Slurm, Kubernetes, AWS Batch) say which of many equal jobs this is.
const INDEX_VARIABLES: [&str; 3] =
    ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "AWS_BATCH_JOB_ARRAY_INDEX"];

impl TilePlan {
    /// Cuts a site: reads its surveys once, writes their points by cell and estimates on a part of them what every tile must know of
    /// the whole. A plan of the same site with the same settings that is there already is opened instead.
    /// Errors: the site's, `out` holds another plan, a tile cannot be made small enough for the memory allowed.
    pub fn make(folder: &Path, out: &Path, what: &TiledSite, job: &Job) -> Result<Self> {
        let files = io::site::load(folder).or_bad_input()?;
        let config = what.settings.of_site(&files.spec)?;
        let mut inputs = BTreeMap::new();
        for name in files.inputs() {
            inputs.insert(portable(&name), entry(&files.folder.join(&name)).or_bad_input()?);
        }
        let seed = what.settings.seed.unwrap_or(files.spec.seed);
        let making = Making { files, config, inputs, seed, what };
        making.plan(out, job)
    }

    /// The same for a site that was read already.
    pub(crate) fn make_for(site: &Site, what: &TiledSite, out: &Path, job: &Job) -> Result<Self> {
        let folder = site.folder.as_deref().unwrap_or(Path::new("."));
        let mut inputs = site.inputs.clone();
        inputs.remove(io::review::FILE);
        let files = io::site::load(folder).or_bad_input()?;
        let config = site.config.clone();
        Making { files, config, inputs, seed: site.seed, what }.plan(out, job)
    }

    /// Reads a plan. Errors: there is none, or it is damaged, or of another version.
    pub fn open(folder: &Path) -> Result<Self> {
        let file = folder.join(FILE);
        let text = std::fs::read_to_string(&file).map_err(|e| {
            Error::bad_input(anyhow!(
                "cannot read {}: {e}; `tsumu tiles plan` writes it",
                file.display()
            ))
        })?;
        let content: Content = serde_json::from_str(&text)
            .with_context(|| format!("{}: not a plan of tiles", file.display()))
            .or_bad_input()?;
        if (content.format, content.version.as_str()) != (FORMAT, version::STAMP) {
            return Err(Error::bad_input(anyhow!(
                "{}: was made by version {}, this is {}; use that, or make the plan again",
                file.display(),
                content.version,
                version::STAMP
            )));
        }
        let id = io::manifest::hash(text.as_bytes());
        let id = id.iter().map(|byte| format!("{byte:02x}")).collect();
        let cells = content.cells.iter().map(|c| (c.cell, c.points)).collect();
        Ok(Self { folder: folder.to_path_buf(), id, content, cells })
    }

    /// Its tiles, from south to north and west to east.
    pub fn tiles(&self) -> &[Tile] {
        &self.content.tiles
    }

    /// The tile of a name. Error: there is none of it.
    pub fn tile(&self, key: &str) -> Result<&Tile> {
        self.tiles().iter().find(|t| t.key == key).ok_or_else(|| {
            let all = self.tiles();
            let some: Vec<&str> = all.iter().take(3).map(|t| t.key.as_str()).collect();
            Error::bad_input(anyhow!(
                "there is no tile `{key}` in {}; its {} tiles are {}{}",
                self.folder.display(),
                all.len(),
                some.join(", "),
                if all.len() > some.len() { ", …" } else { "" }
            ))
        })
    }

    /// The tile of a number from 0. Error: there are not so many.
    pub fn tile_at(&self, index: usize) -> Result<&Tile> {
        self.tiles().get(index).ok_or_else(|| {
            Error::bad_input(anyhow!(
                "there is no tile {index} in {}: it has {}, numbered from 0",
                self.folder.display(),
                self.tiles().len()
            ))
        })
    }

    /// The tile whose number a scheduler gave to one of many equal jobs, in the environment that `variable` reads. Errors: no
    /// number there, or not one of a tile.
    pub fn tile_of_job(&self, variable: impl Fn(&str) -> Option<String>) -> Result<&Tile> {
        let said = INDEX_VARIABLES.iter().find_map(|name| Some((name, variable(name)?)));
        let (name, value) = said.ok_or_else(|| {
            Error::bad_input(anyhow!(
                "which tile? Give --index or --key, or set one of {}",
                INDEX_VARIABLES.join(", ")
            ))
        })?;
        let index = value.parse().map_err(|_| {
            Error::bad_input(anyhow!("{name} is `{value}`, which is no number of a tile"))
        })?;
        self.tile_at(index)
    }

    /// Most memory any of its tiles needs, bytes.
    pub fn largest_bytes(&self) -> u64 {
        self.tiles().iter().map(|t| t.memory_bytes).max().unwrap_or(0)
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The site folder it was made from.
    pub fn site(&self) -> &Path {
        &self.content.site
    }

    /// A word for everything its tiles follow from.
    pub(crate) fn id(&self) -> &str {
        &self.id
    }

    pub(crate) fn grid(&self) -> Grid {
        self.content.grid
    }

    pub(crate) fn facts(&self) -> &PileFacts {
        &self.content.facts
    }

    pub(crate) fn frame(&self) -> &SiteFrame {
        &self.content.frame
    }

    pub(crate) fn halo_m(&self) -> f64 {
        self.content.halo_m
    }

    pub(crate) fn seed(&self) -> u64 {
        self.content.seed
    }

    pub(crate) fn inputs(&self) -> &BTreeMap<String, Entry> {
        &self.content.inputs
    }

    pub(crate) fn weights(&self) -> Option<&Path> {
        self.content.weights.as_deref()
    }

    pub(crate) fn strays(&self) -> &[u32] {
        &self.content.strays
    }

    /// Points of the surveys, strays too.
    pub(crate) fn points(&self) -> u64 {
        self.content.points
    }

    pub(crate) fn config(&self) -> Result<Config> {
        toml::from_str(&self.content.config).context(FILE).or_bad_input()
    }

    /// The catalogue of the site, which must be the one the plan was made with.
    pub(crate) fn catalog(&self, site: Option<&Path>, job: &Job) -> Result<Catalog> {
        // Who works on tiles need not have the surveys.
        let folder = site.unwrap_or(self.site());
        let spec: SiteSpec = io::site::read_toml(&folder.join("site.toml")).or_bad_input()?;
        let file = folder.join(&spec.catalog);
        let stated = self.content.inputs.get(&portable(&spec.catalog));
        if stated != Some(&entry(&file).or_bad_input()?) {
            return Err(Error::bad_input(anyhow!(
                "{}: was changed since the plan was made; make it again with `tsumu tiles plan`",
                file.display()
            )));
        }
        catalogue::read(&file, job)
    }

    pub(crate) fn points_of(&self) -> PartReader<'_> {
        let files =
            CellFiles::new(self.folder.join(POINTS), self.content.grid, self.content.level_m);
        PartReader {
            files,
            cells: &self.cells,
            frame: &self.content.frame,
            sensor: self.content.sensor,
            sensor_positions: &self.content.sensor_positions,
            strays: &self.content.strays,
            silent_lines: &self.content.silent_lines,
        }
    }
}

impl Tile {
    pub(crate) fn core(&self) -> Core {
        self.core
    }

    fn of(cut: &Cut, grid: Grid) -> Self {
        let [low, high] = grid.bounds(cut.core, 0.0);
        Self {
            key: cut.core.key(),
            core: cut.core,
            bounds_m: [low.x, low.y, high.x, high.y],
            blocks: cut.blocks,
            points: cut.points,
            read_points: cut.read,
            memory_bytes: memory::of_tile(cut.read),
        }
    }
}

/// A plan in the making.
struct Making<'a> {
    files: io::site::Site,
    config: Config,
    inputs: BTreeMap<String, Entry>,
    seed: u64,
    what: &'a TiledSite,
}

impl Making<'_> {
    fn plan(self, out: &Path, job: &Job) -> Result<TilePlan> {
        let options = &self.what.tiles;
        options.check()?;
        if self.files.spec.survey.iter().any(|s| s.sensor == SensorKind::DepthCamera) {
            return Err(Error::bad_input(anyhow!(
                "{}: a bin (sensor = \"depth-camera\") is not cut into tiles; `tsumu run` takes it whole",
                self.files.folder.display()
            )));
        }
        let catalog = catalogue::models(&self.files.catalog, &self.files.catalog_file, job)?;
        let chosen = weights::choose(self.what.recognise.weights.as_deref(), &catalog, job)?;
        let halo_m = self.halo_m(&catalog);
        if let Some(there) = self.already(out, halo_m, &chosen.origin.line)? {
            return Ok(there);
        }
        let _lock = FolderLock::take(out)?;
        refuse_strangers(out)?;
        let grid = Grid::of(&catalog);
        let found = job.install(|| scan(&self.files, grid, &out.join(POINTS), job))?;
        let cuts = grid.cut(&found.counts, halo_m, self.most());
        self.refuse_too_much(&cuts, grid)?;
        let ground = site::ground(&self.files, &found.frame);
        let config = self.config.clone().with_ground(ground.as_ref());
        let facts = job.install(|| {
            let ask = facts::Asked {
                found: &found,
                grid,
                catalog: &catalog,
                model: &chosen.model,
                config: &config,
                seed: self.seed,
                halo_m,
            };
            facts::estimate(&ask, job)
        })?;
        let content =
            self.content(found, facts, (grid, halo_m), &cuts, &config, chosen.origin.line)?;
        outputs::write_json(&out.join(FILE), &content)?;
        TilePlan::open(out)
    }

    /// The plan that lies there, if it is this one. Error: it is another.
    fn already(&self, out: &Path, halo_m: f64, weights: &str) -> Result<Option<TilePlan>> {
        if !out.join(FILE).exists() {
            return Ok(None);
        }
        let there = TilePlan::open(out)?;
        let c = &there.content;
        let config = toml::to_string(&self.config)?;
        let same = (&c.inputs, c.seed, &c.asked, c.weights_line.as_str())
            == (&self.inputs, self.seed, &config, weights)
            && (c.halo_m, c.most) == (halo_m, self.most());
        if same {
            return Ok(Some(there));
        }
        Err(Error::bad_input(anyhow!(
            "{}: holds another plan (the site, its settings or the sizes of the tiles were others); choose another --out, or remove it",
            out.display()
        )))
    }

    fn halo_m(&self, catalog: &Catalog) -> f64 {
        let d_box_m = catalog.iter().map(|(_, m)| f64::from(m.d_box_m)).fold(0.0, f64::max);
        self.what.tiles.halo * d_box_m
    }

    fn most(&self) -> Most {
        let options = &self.what.tiles;
        Most { blocks: options.blocks, read: memory::points_within(options.memory) }
    }

    fn refuse_too_much(&self, cuts: &[Cut], grid: Grid) -> Result<()> {
        let memory = self.what.tiles.memory;
        let Some(cut) = cuts.iter().find(|c| memory::of_tile(c.read) > memory.bytes()) else {
            return Ok(());
        };
        Err(Error::bad_input(anyhow!(
            "the smallest tile ({} m wide, `{}`) has {} points with its surroundings and needs {:.1} GB, more than --memory {memory}; give more, or thin the survey",
            grid.edge_m,
            cut.core.key(),
            cut.read,
            memory::of_tile(cut.read) as f64 / 1e9
        )))
    }

    fn content(
        &self,
        found: Scanned,
        facts: PileFacts,
        (grid, halo_m): (Grid, f64),
        cuts: &[Cut],
        config: &Config,
        weights_line: String,
    ) -> Result<Content> {
        let in_file = found.in_file.iter();
        let tiles: Vec<Tile> = cuts.iter().map(|cut| Tile::of(cut, grid)).collect();
        Ok(Content {
            format: FORMAT,
            version: version::STAMP.into(),
            site: std::path::absolute(&self.files.folder).context("the site's path")?,
            inputs: self.inputs.clone(),
            seed: self.seed,
            asked: toml::to_string(&self.config)?,
            config: toml::to_string(config)?,
            weights: self.what.recognise.weights.clone(),
            weights_line,
            grid,
            level_m: found.level_m,
            halo_m,
            most: self.most(),
            frame: found.frame,
            sensor: found.sensor,
            sensor_positions: found.sensor_positions.iter().map(|p| p.to_array()).collect(),
            points: found.points,
            strays: found.strays,
            silent_lines: found.silent_lines,
            facts,
            cells: in_file
                .map(|(cell, points)| CellEntry { cell: *cell, points: *points })
                .collect(),
            tiles,
        })
    }
}

impl TileOptions {
    fn check(&self) -> Result<()> {
        if self.blocks == 0 {
            return Err(Error::bad_input(anyhow!("--blocks-per-tile 0: give at least 1")));
        }
        if !(0.5..=8.0).contains(&self.halo) {
            return Err(Error::bad_input(anyhow!(
                "--halo {}: give 0.5 to 8 lengths of the largest block",
                self.halo
            )));
        }
        Ok(())
    }
}

/// Refuses a folder with something else in it.
fn refuse_strangers(out: &Path) -> Result<()> {
    let ours = [FILE, POINTS, super::work::TILES, io::manifest::LOCK];
    for entry in std::fs::read_dir(out).with_context(|| format!("cannot read {}", out.display()))? {
        let name = entry.context("a folder's entry")?.file_name().to_string_lossy().into_owned();
        if !ours.contains(&name.as_str()) && !name.starts_with(io::atomic::TEMPORARY) {
            return Err(Error::bad_input(anyhow!(
                "{}: holds `{name}`, which is not of a plan of tiles; choose an empty folder with --out",
                out.display()
            )));
        }
    }
    Ok(())
}
