//! One pass over the surveys of a site: every point goes into its cell's file, and what must be known of the whole is counted.
//!
//! In: the files a site names. Out: points by cell, how many lie where, survey lines, strays, the frame. Memory follows the area that was
//! surveyed, not the points.

use super::cell_points::{CellFiles, CellPoint, CellWriter};
use super::grid::{Cell, Count, Grid};
use crate::error::OrBadInput;
use crate::local_survey::{noisiest, round_origin};
use crate::{Error, Job, Result, surveys};
use anyhow::anyhow;
use geom::{DVec3, Event, Observer, Stage, Warning};
use io::crs::FileCrs;
use io::read_options::describe;
use io::{RawCloud, ReadOptions};
use scene::{AxisOrder, SensorKind, SiteFrame, SurveySpec};
use std::collections::BTreeMap;
use std::path::Path;

/// Cubes in which strays are looked for, in cells. Free choice: two blocks wide.
const CUBE: f64 = 0.25;
/// Weight of the whole survey when cubes stand for its points.
const STANDS_FOR: f64 = 20_000.0;

/// What the pass found.
pub(crate) struct Scanned {
    pub files: CellFiles,
    /// Strays are not counted.
    pub counts: BTreeMap<Cell, Count>,
    /// Points of each cell's file, strays too.
    pub in_file: BTreeMap<Cell, u64>,
    /// Points of all files, strays too.
    pub points: u64,
    /// Numbers of the points that lie far from all others, ascending.
    pub strays: Vec<u32>,
    pub frame: SiteFrame,
    pub sensor: SensorKind,
    /// Sensor positions, site coordinates.
    pub sensor_positions: Vec<DVec3>,
    /// For each survey line the cell with most of its points; lines that tell nothing apart are missing.
    pub line_cell: BTreeMap<u16, Cell>,
    /// First and last number of lines that tell nothing apart.
    pub silent_lines: Vec<(u16, u16)>,
    /// Height that the cells' heights count from.
    pub level_m: f64,
}

/// Streams the surveys of a site into `folder`. Errors: a file cannot be read, holds no points, contradicts the site's CRS.
pub(crate) fn scan(site: &io::site::Site, grid: Grid, folder: &Path, job: &Job) -> Result<Scanned> {
    let mut pass: Option<Pass> = None;
    let mut references = Vec::new();
    for (spec, file) in site.spec.survey.iter().zip(&site.survey_files) {
        let survey = SurveyFile::new(site, spec, file)?;
        let meta = survey.stream(grid, folder, &mut pass, job)?;
        references.push((file.display().to_string(), meta.reference.clone()));
        let pass = pass.as_mut().filter(|p| p.points > p.first_of_file);
        let pass = pass.ok_or_else(|| nothing_read(file, site))?;
        pass.end_of_file(&survey, &meta, job);
    }
    surveys::agree(&site.spec.crs, &references, job)?;
    let pass = pass.ok_or_else(|| Error::bad_input(anyhow!("the site names no survey")))?;
    pass.finish(site)
}

fn nothing_read(file: &Path, site: &io::site::Site) -> Error {
    let where_ = if site.spec.area.is_some() { " in the site's [area]" } else { "" };
    Error::bad_input(anyhow!("{}: has no points{where_}", file.display()))
}

/// A file with what the site says of it.
struct SurveyFile<'a> {
    site: &'a io::site::Site,
    spec: &'a SurveySpec,
    file: &'a Path,
    axes: AxisOrder,
    /// What heights are multiplied by.
    height_factor: f64,
}

impl<'a> SurveyFile<'a> {
    fn new(site: &'a io::site::Site, spec: &'a SurveySpec, file: &'a Path) -> Result<Self> {
        let kind = file.extension().map(|e| e.to_string_lossy().to_lowercase());
        let text = !matches!(kind.as_deref(), Some("las" | "laz" | "ply" | "e57" | "pcd"));
        let (reference, named_axes) = if text {
            // Only reading a table tells what its columns are.
            let told =
                io::points::stream_file(file, &ReadOptions::of_survey(spec), &mut |_| Ok(()));
            let told = told.or_bad_input()?;
            (told.reference, told.named_axes)
        } else {
            (io::points::reference(file).or_bad_input()?, false)
        };
        let axes = if named_axes { AxisOrder::EastNorth } else { site.spec.axis_order };
        let height_factor = height_factor(file, &reference)?;
        Ok(Self { site, spec, file, axes, height_factor })
    }

    /// Site coordinates of a point of the file.
    fn to_site(&self, p: DVec3) -> DVec3 {
        let p = self.axes.east_north_up(p);
        let up = p.z * self.height_factor + self.spec.vertical_offset_m.unwrap_or(0.0);
        DVec3::new(p.x, p.y, up)
    }

    fn stream(
        &self,
        grid: Grid,
        folder: &Path,
        pass: &mut Option<Pass>,
        job: &Job,
    ) -> Result<RawCloud> {
        let mut failed = None;
        let options = ReadOptions::of_survey(self.spec);
        if let Some(pass) = pass.as_mut() {
            pass.first_of_file = pass.points;
        }
        let mut sink = |batch: RawCloud| {
            let taken = if job.cancelled() {
                Err(Error::stopped(anyhow!("stopped while the surveys were read")))
            } else {
                self.take(&batch, grid, folder, pass)
            };
            taken.map_err(|error| {
                failed = Some(error);
                let source = std::io::ErrorKind::Interrupted.into();
                io::IoError::Os { path: self.file.into(), doing: "read", source }
            })
        };
        let read = io::points::stream_file(self.file, &options, &mut sink);
        match failed {
            Some(error) => Err(error),
            None => read.or_bad_input(),
        }
    }

    fn take(
        &self,
        batch: &RawCloud,
        grid: Grid,
        folder: &Path,
        pass: &mut Option<Pass>,
    ) -> Result<()> {
        for (i, &raw) in batch.position.iter().enumerate() {
            let p = self.to_site(raw);
            if !p.is_finite() {
                return Err(Error::bad_input(anyhow!(
                    "{}: a point has a coordinate that is not a number; remove it in the program that wrote the file",
                    self.file.display()
                )));
            }
            let inside = self.site.spec.area.as_ref().is_none_or(|a| {
                (a.west..=a.east).contains(&p.x) && (a.south..=a.north).contains(&p.y)
            });
            if !inside {
                continue;
            }
            if pass.is_none() {
                *pass = Some(Pass::new(grid, folder, p)?);
            }
            let line = batch.line.as_ref().map_or(0, |l| l[i]);
            pass.as_mut().expect("it was just made").add(p, line, self.file)?;
        }
        Ok(())
    }
}

/// What makes a file's heights heights in metres.
fn height_factor(file: &Path, reference: &FileCrs) -> Result<f64> {
    let metres = reference.vertical_unit.as_ref().map_or(1.0, |unit| unit.metres);
    if !metres.is_finite() {
        return Err(Error::bad_input(anyhow!(
            "{}: its heights are in a unit that is not known here; convert them to metres",
            file.display()
        )));
    }
    Ok(if reference.depth { -metres } else { metres })
}

/// Points of a cube in which strays are looked for.
struct Cube {
    points: u64,
    one: DVec3,
    low: DVec3,
    high: DVec3,
}

struct Pass {
    grid: Grid,
    writer: CellWriter,
    level_m: f64,
    /// What is known of each cell, by the writer's slots.
    cells: Vec<InCell>,
    slots: BTreeMap<Cell, usize>,
    /// Neighbours in a file are neighbours in space: the cell of the last point.
    last_cell: Option<(Cell, usize)>,
    points: u64,
    first_of_file: u64,
    /// Of the file that is read.
    cubes: Vec<([i64; 3], Cube)>,
    cube_at: BTreeMap<[i64; 3], usize>,
    last_cube: Option<usize>,
    /// Lines of earlier files.
    lines_before: u16,
    last_line: u16,
    first_line: u16,
    silent_lines: Vec<(u16, u16)>,
    strays: Vec<StrayCubes>,
    low: DVec3,
    high: DVec3,
    sensor_positions: Vec<DVec3>,
}

/// What is known of a cell.
#[derive(Default)]
struct InCell {
    count: Count,
    points: u64,
    /// Points of each survey line.
    lines: BTreeMap<u16, u64>,
}

/// Cubes of one file that hold strays.
struct StrayCubes {
    cubes: Vec<[i64; 3]>,
    numbers: std::ops::Range<u64>,
}

impl Pass {
    fn new(grid: Grid, folder: &Path, first: DVec3) -> Result<Self> {
        let level_m = (first.z / 10.0).round() * 10.0;
        let files = CellFiles::new(folder.to_path_buf(), grid, level_m);
        Ok(Self {
            grid,
            writer: CellWriter::new(files)?,
            level_m,
            cells: Vec::new(),
            slots: BTreeMap::new(),
            last_cell: None,
            points: 0,
            first_of_file: 0,
            cubes: Vec::new(),
            cube_at: BTreeMap::new(),
            last_cube: None,
            lines_before: 0,
            last_line: 0,
            first_line: u16::MAX,
            silent_lines: Vec::new(),
            strays: Vec::new(),
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            sensor_positions: Vec::new(),
        })
    }

    fn add(&mut self, p: DVec3, line: u16, file: &Path) -> Result<()> {
        let number = u32::try_from(self.points).map_err(|_| {
            Error::bad_input(anyhow!(
                "{}: with it the site has more than 4,294,967,295 points; cut it with [area]",
                file.display()
            ))
        })?;
        (self.first_line, self.last_line) = (self.first_line.min(line), self.last_line.max(line));
        let line = match line {
            0 => 0,
            line => self.lines_before.checked_add(line).ok_or_else(|| {
                Error::bad_input(anyhow!(
                    "{}: with it the surveys have more than 65535 lines; join fewer of them",
                    file.display()
                ))
            })?,
        };
        let cell = self.grid.cell(p);
        // Counted where it will be read.
        let p = self.writer.rounded(cell, p);
        let slot = self.slot(cell);
        self.writer.add(slot, &CellPoint { position: p, line, number })?;
        let known = &mut self.cells[slot];
        known.count.squares[self.grid.square(cell, p)] += 1;
        known.points += 1;
        if line > 0 {
            *known.lines.entry(line).or_default() += 1;
        }
        self.add_to_cube(p);
        self.points += 1;
        Ok(())
    }

    fn slot(&mut self, cell: Cell) -> usize {
        if let Some((_, slot)) = self.last_cell.filter(|last| last.0 == cell) {
            return slot;
        }
        let slot = *self.slots.entry(cell).or_insert_with(|| {
            self.cells.push(InCell::default());
            self.writer.new_slot(cell)
        });
        self.last_cell = Some((cell, slot));
        slot
    }

    fn add_to_cube(&mut self, p: DVec3) {
        let key = cube_of(self.grid, p);
        let last = self.last_cube.filter(|&at| self.cubes[at].0 == key);
        let at = last.unwrap_or_else(|| {
            *self.cube_at.entry(key).or_insert_with(|| {
                self.cubes.push((key, Cube { points: 0, one: p, low: p, high: p }));
                self.cubes.len() - 1
            })
        });
        self.last_cube = Some(at);
        let cube = &mut self.cubes[at].1;
        cube.points += 1;
        (cube.low, cube.high) = (cube.low.min(p), cube.high.max(p));
    }

    /// Lines, strays and sensor positions of the file that was read last.
    fn end_of_file(&mut self, survey: &SurveyFile, meta: &RawCloud, job: &Job) {
        let (first, last) = (self.first_line, self.last_line);
        if first < last {
            self.lines_before += last;
        } else if last > 0 {
            // One number for all points says nothing of lines.
            let number = self.lines_before + last;
            self.silent_lines.push((number, number));
            for cell in &mut self.cells {
                cell.lines.remove(&number);
            }
            self.lines_before = number;
        }
        (self.first_line, self.last_line) = (u16::MAX, 0);
        let left_out = describe(&meta.left_out);
        if !left_out.is_empty() {
            let message = format!("{}: left out {left_out}", survey.file.display());
            job.event(Event::Warned(Warning { stage: Stage::Read, message }));
        }
        let stated: Vec<DVec3> = survey.spec.sensors().map(DVec3::from_array).collect();
        let of_file = if stated.is_empty() { meta.sensor_positions.clone() } else { stated };
        self.sensor_positions.extend(of_file.into_iter().map(|p| survey.to_site(p)));
        self.set_strays_aside(survey.file, job);
    }

    fn set_strays_aside(&mut self, file: &Path, job: &Job) {
        let cubes: BTreeMap<[i64; 3], Cube> = std::mem::take(&mut self.cubes).into_iter().collect();
        self.cube_at.clear();
        self.last_cube = None;
        let total = (self.points - self.first_of_file) as f64;
        let keys: Vec<[i64; 3]> = cubes.keys().copied().collect();
        let (mut one, mut of) = (Vec::new(), Vec::new());
        for (at, cube) in cubes.values().enumerate() {
            let weight = (cube.points as f64 / total * STANDS_FOR).ceil() as usize;
            one.extend(std::iter::repeat_n(cube.one, weight));
            of.extend(std::iter::repeat_n(at, weight));
        }
        let found = geom::strays(&one);
        let mut stray: Vec<usize> = found.index.iter().map(|&i| of[i]).collect();
        stray.dedup();
        let stray: Vec<[i64; 3]> = stray.into_iter().map(|at| keys[at]).collect();
        for (_, cube) in cubes.iter().filter(|(key, _)| !stray.contains(key)) {
            (self.low, self.high) = (self.low.min(cube.low), self.high.max(cube.high));
        }
        if stray.is_empty() {
            return;
        }
        let points: u64 = stray.iter().map(|key| cubes[key].points).sum();
        let one = cubes[&stray[0]].one;
        let message = format!(
            "{}: left out {points} points far from all others, one near ({:.1}, {:.1}, {:.1})",
            file.display(),
            one.x,
            one.y,
            one.z
        );
        job.event(Event::Warned(Warning { stage: Stage::Read, message }));
        self.strays.push(StrayCubes { cubes: stray, numbers: self.first_of_file..self.points });
    }

    fn finish(mut self, site: &io::site::Site) -> Result<Scanned> {
        let files = self.writer.finish()?;
        let in_file: BTreeMap<Cell, u64> =
            self.slots.iter().map(|(cell, &slot)| (*cell, self.cells[slot].points)).collect();
        let mut numbers = Vec::new();
        for stray in &self.strays {
            for (&cell, &points) in &in_file {
                let touched = stray.cubes.iter().any(|c| touches(self.grid, cell, c));
                let own = if touched { files.read(cell, points)? } else { Vec::new() };
                for point in own {
                    let is_one = stray.numbers.contains(&u64::from(point.number))
                        && stray.cubes.contains(&cube_of(self.grid, point.position));
                    if is_one {
                        numbers.push(point.number);
                        let square = self.grid.square(cell, point.position);
                        self.cells[self.slots[&cell]].count.squares[square] -= 1;
                    }
                }
            }
        }
        numbers.sort_unstable();
        let mut line_cell: BTreeMap<u16, (u64, Cell)> = BTreeMap::new();
        for (&cell, &slot) in &self.slots {
            for (&line, &points) in &self.cells[slot].lines {
                let best = line_cell.entry(line).or_insert((points, cell));
                if points > best.0 {
                    *best = (points, cell);
                }
            }
        }
        let counts = self
            .slots
            .iter()
            .map(|(cell, &slot)| (*cell, self.cells[slot].count.clone()))
            .collect();
        let frame = SiteFrame {
            origin: round_origin(self.low, self.high).to_array(),
            crs: site.spec.crs.clone(),
            vertical_datum: site.spec.vertical_datum.clone(),
        };
        Ok(Scanned {
            files,
            counts,
            in_file,
            points: self.points,
            strays: numbers,
            frame,
            sensor: noisiest(site.spec.survey.iter().map(|s| s.sensor)),
            sensor_positions: self.sensor_positions,
            line_cell: line_cell.into_iter().map(|(line, best)| (line, best.1)).collect(),
            silent_lines: self.silent_lines,
            level_m: self.level_m,
        })
    }
}

fn cube_of(grid: Grid, p: DVec3) -> [i64; 3] {
    (p / (CUBE * grid.edge_m)).floor().to_array().map(|v| v as i64)
}

fn touches(grid: Grid, cell: Cell, cube: &[i64; 3]) -> bool {
    let edge_m = CUBE * grid.edge_m;
    let at = DVec3::new((cube[0] as f64 + 0.5) * edge_m, (cube[1] as f64 + 0.5) * edge_m, 0.0);
    let of_cube = grid.cell(at);
    of_cube.north.abs_diff(cell.north) <= 1 && of_cube.east.abs_diff(cell.east) <= 1
}
