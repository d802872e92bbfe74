//! A cloud as its file states it: f64 coordinates in the file's own axes and unit, nothing interpreted.

use crate::crs::FileCrs;
use crate::read_options::LeftOut;
use crate::{IoError, Place};
use geom::{DVec3, Observer, Stage, Vec3, Warning};
use std::collections::BTreeMap;
use std::path::Path;

/// Steps of the stored numbers from here on swallow the shape of most blocks.
const COARSE: f64 = 0.05;

/// Points with the columns that the file has. A column is as long as `position` or absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawCloud {
    /// First, second and third coordinate as in the file.
    pub position: Vec<DVec3>,
    /// Instance of each point, 0 = none.
    pub instance: Option<Vec<u32>>,
    /// Block type of each point: its number in the catalogue, from 1; 0 = none.
    pub model: Option<Vec<u16>>,
    /// Confidence of each label, in [0, 1].
    pub confidence: Option<Vec<f32>>,
    /// Survey line (pass) of each point: the point source id of LAS; 0 = unknown.
    pub line: Option<Vec<u16>>,
    /// Unit normals.
    pub normal: Option<Vec<Vec3>>,
    /// Where the sensor stood, in the file's coordinates, when the format says it (E57, PCD).
    pub sensor_positions: Vec<DVec3>,
    /// Number of each point among the file's points, from 0: the way back from what is left to the file's own records.
    pub record: Option<Vec<u32>>,
    /// The file's columns are named after the directions, so that `position` is east, north, up whatever the site says.
    pub named_axes: bool,
    /// What the file says of the system its coordinates are in.
    pub reference: FileCrs,
    /// Coordinate reference system named by the file, as `EPSG:n`.
    pub crs: Option<String>,
    /// The same as the file's well-known text, kept for writing.
    pub crs_wkt: Option<String>,
    /// The coordinates are stored as 32-bit floats.
    pub float32: bool,
    /// Points that the format itself marks as invalid and that were left out (PCD's NaN, E57's flag).
    pub invalid: u64,
    /// Points left out for their class or flags.
    pub left_out: LeftOut,
    /// Points of each class of LAS, those left out included; empty where the file has no classes.
    pub classes: BTreeMap<u8, u64>,
    /// What the file's heights were multiplied by to make them heights in metres; `None`: nothing.
    pub height_factor: Option<f64>,
    /// Notes of the reader on what it took for what.
    pub notes: Vec<String>,
}

impl RawCloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Appends the points of a batch of the same file (the same columns).
    pub fn append(&mut self, mut batch: Self) {
        fn join<T>(to: &mut Option<Vec<T>>, from: Option<Vec<T>>, first: bool) {
            match (to.as_mut(), from) {
                (Some(to), Some(mut from)) => to.append(&mut from),
                (None, from) if first => *to = from,
                _ => *to = None,
            }
        }
        let first = self.position.is_empty();
        self.position.append(&mut batch.position);
        join(&mut self.instance, batch.instance, first);
        join(&mut self.model, batch.model, first);
        join(&mut self.confidence, batch.confidence, first);
        join(&mut self.line, batch.line, first);
        join(&mut self.normal, batch.normal, first);
        join(&mut self.record, batch.record, first);
    }

    /// The points at `index` with all their columns; panics when one is out of range.
    pub fn select(&self, index: &[usize]) -> Self {
        fn pick<T: Copy>(column: &Option<Vec<T>>, index: &[usize]) -> Option<Vec<T>> {
            column.as_ref().map(|c| index.iter().map(|&i| c[i]).collect())
        }
        Self {
            position: index.iter().map(|&i| self.position[i]).collect(),
            instance: pick(&self.instance, index),
            model: pick(&self.model, index),
            confidence: pick(&self.confidence, index),
            line: pick(&self.line, index),
            normal: pick(&self.normal, index),
            record: pick(&self.record, index),
            ..self.meta()
        }
    }

    /// The same cloud without its points.
    pub(crate) fn meta(&self) -> Self {
        Self {
            sensor_positions: self.sensor_positions.clone(),
            named_axes: self.named_axes,
            reference: self.reference.clone(),
            crs: self.crs.clone(),
            crs_wkt: self.crs_wkt.clone(),
            float32: self.float32,
            invalid: self.invalid,
            left_out: self.left_out.clone(),
            classes: self.classes.clone(),
            height_factor: self.height_factor,
            notes: self.notes.clone(),
            ..Self::default()
        }
    }

    /// Lower and upper corner; `None` without points.
    pub fn extent(&self) -> Option<[DVec3; 2]> {
        let first = *self.position.first()?;
        Some(self.position.iter().fold([first, first], |[low, high], &p| [low.min(p), high.max(p)]))
    }

    /// What 32-bit storage costs at these coordinates: half the spacing of floats at the largest, metres; 0 for doubles.
    pub fn rounding_m(&self) -> f64 {
        if !self.float32 {
            return 0.0;
        }
        let largest =
            self.position.iter().fold(0.0_f64, |m, p| m.max(p.abs().max_element())) as f32;
        f64::from(largest.next_up() - largest) / 2.0
    }

    /// Warns when 32-bit storage has cost half a millimetre or more.
    pub(crate) fn warn_of_rounding(&self, path: &Path, observer: &dyn Observer) {
        let loss_mm = self.rounding_m() * 1000.0;
        if loss_mm >= 0.5 {
            observer.event(geom::Event::Warned(Warning {
                stage: Stage::Read,
                message: format!(
                    "{}: coordinates this large, stored as 32-bit floats, are off by up to {loss_mm:.1} mm; export the cloud with double coordinates, or as LAS/LAZ",
                    path.display()
                ),
            }));
        }
    }

    /// Step of the stored numbers, heights in metres whatever the file counts them in: the coarsest decimal step that a sample of the
    /// heights keeps to, or that of the plane coordinates where several points share a place. 0 when there is none down to a tenth
    /// of a millimetre, or fewer than a hundred points.
    pub fn step(&self) -> f64 {
        if self.len() < 100 {
            return 0.0;
        }
        let plane = self.step_of_axis(0, 1.0).min(self.step_of_axis(1, 1.0));
        // The cells of a gridded surface are no loss: it has one point at each place.
        let plane = if plane >= COARSE && self.share_places() { plane } else { 0.0 };
        let stated = self.reference.vertical_unit.as_ref().map_or(1.0, |u| u.metres);
        let height = match self.height_factor {
            // The steps are those of the numbers before they were turned into metres.
            Some(factor) => self.step_of_axis(2, factor) * factor.abs(),
            None if stated.is_finite() => self.step_of_axis(2, 1.0) * stated,
            None => self.step_of_axis(2, 1.0),
        };
        height.max(plane)
    }

    fn step_of_axis(&self, axis: usize, factor: f64) -> f64 {
        const STEPS: [f64; 13] =
            [10.0, 5.0, 2.0, 1.0, 0.5, 0.25, 0.1, 0.05, 0.025, 0.02, 0.01, 0.001, 0.0001];
        const SAMPLE: usize = 20_000;
        let stride = self.len().div_ceil(SAMPLE);
        let first = self.position[0][axis] / factor;
        let values = || self.position.iter().step_by(stride).map(|p| p[axis] / factor);
        // One level for all points is no step.
        if values().all(|v| v == first) {
            return 0.0;
        }
        let kept_to = |step: &f64| {
            let near = 1e-3 + first.abs() * 4.0 * f64::EPSILON / step;
            values().all(|v| {
                let steps = (v - first) / step;
                (steps - steps.round()).abs() < near
            })
        };
        STEPS.iter().copied().find(kept_to).unwrap_or(0.0)
    }

    /// More than a tenth of the points lie above or below another one.
    fn share_places(&self) -> bool {
        const MOST: usize = 1_000_000;
        let points = self.position.iter().take(MOST);
        let places: std::collections::HashSet<[u64; 2]> =
            points.map(|p| [p.x.to_bits(), p.y.to_bits()]).collect();
        places.len() * 10 < self.len().min(MOST) * 9
    }

    /// Warns when the numbers are stored in steps that swallow the shape of most blocks.
    pub(crate) fn warn_of_step(&self, path: &Path, observer: &dyn Observer) {
        let step = self.step();
        let extent = self.extent().map_or(0.0, |[low, high]| (high - low).max_element());
        // In a file of millimetres a step of 1 is fine.
        if step >= COARSE && step < extent && extent < 1e5 * step {
            observer.event(geom::Event::Warned(Warning {
                stage: Stage::Read,
                message: format!(
                    "{}: coordinates are stored in steps of {step} (half of that is lost at each point); export the cloud with millimetres",
                    path.display()
                ),
            }));
        }
    }

    /// All columns must be as long as the positions: a caller's promise, checked before writing.
    pub(crate) fn check_columns(&self, path: &Path) -> Result<(), IoError> {
        let n = self.len();
        let lengths = [
            self.instance.as_ref().map(Vec::len),
            self.model.as_ref().map(Vec::len),
            self.confidence.as_ref().map(Vec::len),
            self.line.as_ref().map(Vec::len),
            self.normal.as_ref().map(Vec::len),
            self.record.as_ref().map(Vec::len),
        ];
        if lengths.iter().flatten().any(|&l| l != n) {
            return Err(IoError::malformed(
                path,
                Place::File,
                "a column of the cloud is not as long as its positions",
            ));
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            let p = self.position[i];
            return Err(IoError::NotFinite {
                path: path.into(),
                at: Place::Record(i as u64 + 1),
                x: p.x,
                y: p.y,
                z: p.z,
            });
        }
        Ok(())
    }
}
