//! Reads clouds and meshes from PLY.

use super::header::{self, Element, Encoding, Header};
use crate::crs::{self, FileCrs};
use crate::input::Input;
use crate::mesh::RawMesh;
use crate::raw_cloud::RawCloud;
use crate::read_options::{ByClass, LeaveOut, ReadOptions};
use crate::{IoError, Place};
use geom::{DVec3, Vec3};

const BATCH: u64 = 65_536;
const LINE_LIMIT: u64 = 1 << 20;

/// Steps through records, whatever the encoding.
struct Records {
    encoding: Encoding,
    line: u64,
    buffer: Vec<u8>,
}

impl Records {
    fn new(header: &Header) -> Self {
        Self { encoding: header.encoding, line: header.lines, buffer: Vec::new() }
    }

    /// Reads one record: scalars into `scalars` (as many as properties), the list `wanted` into `list`.
    fn next(
        &mut self,
        input: &mut Input,
        element: &Element,
        scalars: &mut [f64],
        wanted: Option<usize>,
        list: &mut Vec<f64>,
    ) -> Result<(), IoError> {
        list.clear();
        match self.encoding {
            Encoding::Ascii => self.next_ascii(input, element, scalars, wanted, list),
            _ => self.next_binary(input, element, scalars, wanted, list),
        }
    }

    fn next_ascii(
        &mut self,
        input: &mut Input,
        element: &Element,
        scalars: &mut [f64],
        wanted: Option<usize>,
        list: &mut Vec<f64>,
    ) -> Result<(), IoError> {
        loop {
            self.line += 1;
            if !input.line(&mut self.buffer, self.line, LINE_LIMIT)? {
                let what =
                    format!("the file ends before the last `{}`; it is cut short", element.name);
                return Err(input.malformed(Place::Line(self.line), what));
            }
            if !self.buffer.iter().all(u8::is_ascii_whitespace) {
                break;
            }
        }
        let at = Place::Line(self.line);
        let text = std::str::from_utf8(&self.buffer)
            .map_err(|_| input.malformed(at, "the line is not text"))?;
        let mut words = text.split_ascii_whitespace();
        let mut number = |name: &str| {
            let word = words
                .next()
                .ok_or_else(|| input.malformed(at, format!("the value of `{name}` is missing")))?;
            word.parse::<f64>()
                .map_err(|_| input.malformed(at, format!("`{name}` = `{word}` is not a number")))
        };
        for (i, property) in element.properties.iter().enumerate() {
            scalars[i] = number(&property.name)?;
            if property.list.is_some() {
                let count = scalars[i];
                if !(count >= 0.0 && count <= text.len() as f64) {
                    return Err(input
                        .malformed(at, format!("a list of {count} values does not fit its line")));
                }
                for _ in 0..count as usize {
                    let value = number(&property.name)?;
                    if wanted == Some(i) {
                        list.push(value);
                    }
                }
            }
        }
        Ok(())
    }

    fn next_binary(
        &mut self,
        input: &mut Input,
        element: &Element,
        scalars: &mut [f64],
        wanted: Option<usize>,
        list: &mut Vec<f64>,
    ) -> Result<(), IoError> {
        let big = self.encoding == Encoding::BigEndian;
        let mut raw = [0; 8];
        for (i, property) in element.properties.iter().enumerate() {
            let scalar = property.list.unwrap_or(property.scalar);
            input.fill(&mut raw[..scalar.size()], "an element")?;
            scalars[i] = scalar.value(&raw, big);
            if property.list.is_some() {
                let size = property.scalar.size();
                let bytes = input.take(scalars[i].max(0.0) as u64 * size as u64, "a list")?;
                if wanted == Some(i) {
                    list.extend(bytes.chunks_exact(size).map(|b| property.scalar.value(b, big)));
                }
            }
        }
        Ok(())
    }
}

const INSTANCE: [&str; 2] = ["instance", "scalar_instance"];
const LABEL: [&str; 2] = ["label", "scalar_label"];

/// Which property is which column.
struct Columns {
    xyz: [usize; 3],
    normal: Option<[usize; 3]>,
    instance: Option<usize>,
    /// What −1 stands for among the instances: 0 where they are a `label`.
    minus_one: Option<u32>,
    model: Option<usize>,
    confidence: Option<usize>,
    line: Option<usize>,
    class: Option<usize>,
}

/// Points counted and sorted out by their class.
struct Sorting<'a> {
    leave_out: &'a LeaveOut,
    met: ByClass,
}

impl Columns {
    fn of(input: &Input, element: &Element) -> Result<Self, IoError> {
        let found = || {
            let names =
                element.properties.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
            names.chars().filter(|c| !c.is_control()).take(300).collect()
        };
        let need = |column: &'static str| {
            let index = element.find(&[column]).filter(|&i| element.properties[i].list.is_none());
            index.ok_or_else(|| IoError::MissingColumn {
                path: input.path.into(),
                column,
                found: found(),
            })
        };
        let scalar =
            |names: &[&str]| element.find(names).filter(|&i| element.properties[i].list.is_none());
        let normal =
            [["nx", "normal_x"], ["ny", "normal_y"], ["nz", "normal_z"]].map(|n| scalar(&n));
        Ok(Self {
            xyz: [need("x")?, need("y")?, need("z")?],
            normal: match normal {
                [Some(x), Some(y), Some(z)] => Some([x, y, z]),
                _ => None,
            },
            instance: scalar(&INSTANCE).or_else(|| scalar(&LABEL)),
            minus_one: scalar(&INSTANCE).is_none().then_some(0),
            model: scalar(&["model", "scalar_model"]),
            confidence: scalar(&["confidence", "scalar_confidence"]),
            line: scalar(&["point_source_id", "scalar_point_source_id", "line", "scalar_line"]),
            class: element.properties.iter().position(|p| {
                let name = p.name.to_ascii_lowercase();
                p.list.is_none()
                    && matches!(name.as_str(), "classification" | "scalar_classification")
            }),
        })
    }

    /// An empty batch with these columns.
    fn batch(&self) -> RawCloud {
        RawCloud {
            instance: self.instance.map(|_| Vec::new()),
            model: self.model.map(|_| Vec::new()),
            confidence: self.confidence.map(|_| Vec::new()),
            line: self.line.map(|_| Vec::new()),
            normal: self.normal.map(|_| Vec::new()),
            record: Some(Vec::new()),
            ..RawCloud::default()
        }
    }

    /// Whether a record's class leaves it out.
    fn leaves_out(&self, value: impl Fn(usize) -> f64, sorting: &mut Sorting) -> bool {
        self.class.is_some_and(|i| sorting.met.leaves_out(value(i), sorting.leave_out))
    }

    /// Appends one record.
    fn push(
        &self,
        cloud: &mut RawCloud,
        value: impl Fn(usize) -> f64,
        fail: impl Fn(String) -> IoError,
    ) -> Result<(), IoError> {
        cloud.position.push(DVec3::from_array(self.xyz.map(&value)));
        if let (Some(i), Some(column)) = (self.instance, cloud.instance.as_mut()) {
            let id = instance_number(value(i), self.minus_one);
            column.push(id.ok_or_else(|| fail(not_a_label("instance", value(i), u32::MAX)))?);
        }
        if let (Some(i), Some(column)) = (self.model, cloud.model.as_mut()) {
            let wide = label(value(i), u32::from(u16::MAX))
                .ok_or_else(|| fail(not_a_label("model", value(i), u16::MAX.into())))?;
            column.push(wide as u16);
        }
        if let (Some(i), Some(column)) = (self.confidence, cloud.confidence.as_mut()) {
            column.push(value(i) as f32);
        }
        if let (Some(i), Some(column)) = (self.line, cloud.line.as_mut()) {
            // What is no line number says nothing of lines.
            column.push(label(value(i), u32::from(u16::MAX)).unwrap_or(0) as u16);
        }
        if let (Some(n), Some(column)) = (self.normal, cloud.normal.as_mut()) {
            column.push(Vec3::from_array(n.map(|i| value(i) as f32)));
        }
        Ok(())
    }
}

/// A whole number from 0 to `largest`.
pub(crate) fn label(value: f64, largest: u32) -> Option<u32> {
    (value >= 0.0 && value <= f64::from(largest) && value.fract() == 0.0).then_some(value as u32)
}

/// The number of an instance. −1 is read as `none`, where that is said; so is every other whole number below 0 where none is told
/// from 0 (by the largest number).
pub(crate) fn instance_number(value: f64, none: Option<u32>) -> Option<u32> {
    let below_0 = none == Some(u32::MAX) && value < 0.0 && value.fract() == 0.0;
    none.filter(|_| value == -1.0 || below_0).or_else(|| label(value, u32::MAX))
}

pub(crate) fn not_a_label(column: &str, value: f64, largest: u32) -> String {
    format!("`{column}` = {value} is not a whole number from 0 to {largest} (0 means none)")
}

fn of_header(header: &Header) -> FileCrs {
    crs::of_comments(header.comments.iter().map(String::as_str))
}

/// What the header says of the coordinates.
pub(crate) fn reference(input: &mut Input) -> Result<FileCrs, IoError> {
    header::read(input).map(|h| of_header(&h))
}

/// Hands the points on in batches; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    stream_with(input, &ReadOptions::default(), sink)
}

/// The same with options.
pub fn stream_with(
    input: &mut Input,
    options: &ReadOptions,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    let header = header::read(input)?;
    let mut records = Records::new(&header);
    let reference = of_header(&header);
    let crs = reference.epsg();
    for element in &header.elements {
        if element.name != "vertex" {
            skip(input, &mut records, element)?;
            continue;
        }
        let mut columns = Columns::of(input, element)?;
        columns.minus_one = options.minus_one.or(columns.minus_one);
        if !options.labels {
            (columns.instance, columns.model, columns.confidence) = (None, None, None);
        }
        let mut sorting = Sorting { leave_out: &options.leave_out, met: ByClass::default() };
        match (header.encoding, element.stride()) {
            (Encoding::LittleEndian | Encoding::BigEndian, Some(stride)) => {
                stream_fixed(
                    input,
                    element,
                    &columns,
                    stride,
                    header.encoding == Encoding::BigEndian,
                    &mut sorting,
                    sink,
                )?;
            }
            _ => stream_records(input, &mut records, element, &columns, &mut sorting, sink)?,
        }
        let float32 =
            columns.xyz.iter().any(|&i| element.properties[i].scalar == header::Scalar::F32)
                && header.encoding != Encoding::Ascii;
        let ByClass { classes, left_out } = sorting.met;
        return Ok(RawCloud { reference, crs, float32, classes, left_out, ..RawCloud::default() });
    }
    Err(input.malformed(Place::File, "the file has no `vertex` element"))
}

/// Binary records of one size: read in large pieces.
fn stream_fixed(
    input: &mut Input,
    element: &Element,
    columns: &Columns,
    stride: usize,
    big: bool,
    sorting: &mut Sorting,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let offsets: Vec<usize> = element
        .properties
        .iter()
        .scan(0, |sum, p| {
            *sum += p.scalar.size();
            Some(*sum - p.scalar.size())
        })
        .collect();
    let scalars: Vec<_> = element.properties.iter().map(|p| p.scalar).collect();
    let mut done = 0;
    while done < element.count {
        let count = BATCH.min(element.count - done);
        let bytes = input.take(count * stride as u64, "the vertices")?;
        let mut batch = columns.batch();
        batch.position.reserve_exact(count as usize);
        for (i, record) in bytes.chunks_exact(stride).enumerate() {
            let at = Place::Record(done + i as u64 + 1);
            let fail = |what| IoError::malformed(input.path, at, what);
            let value = |i: usize| scalars[i].value(&record[offsets[i]..], big);
            if columns.leaves_out(value, sorting) {
                continue;
            }
            columns.push(&mut batch, value, fail)?;
            number(&mut batch, done + i as u64);
            finite(input, &batch, at)?;
        }
        if !batch.is_empty() {
            sink(batch)?;
        }
        done += count;
    }
    Ok(())
}

/// Any other records, one by one.
fn stream_records(
    input: &mut Input,
    records: &mut Records,
    element: &Element,
    columns: &Columns,
    sorting: &mut Sorting,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let (mut values, mut list) = (vec![0.0; element.properties.len()], Vec::new());
    let mut batch = columns.batch();
    for i in 0..element.count {
        records.next(input, element, &mut values, None, &mut list)?;
        let at = if records.encoding == Encoding::Ascii {
            Place::Line(records.line)
        } else {
            Place::Record(i + 1)
        };
        if columns.leaves_out(|i| values[i], sorting) {
            continue;
        }
        columns.push(&mut batch, |i| values[i], |what| IoError::malformed(input.path, at, what))?;
        number(&mut batch, i);
        finite(input, &batch, at)?;
        if batch.len() as u64 == BATCH {
            sink(std::mem::replace(&mut batch, columns.batch()))?;
        }
    }
    if batch.is_empty() { Ok(()) } else { sink(batch) }
}

/// The last point of the batch is this one of the file.
fn number(batch: &mut RawCloud, record: u64) {
    if let Some(column) = &mut batch.record {
        column.push(u32::try_from(record).unwrap_or(u32::MAX));
    }
}

/// The last point of the batch must be a place.
fn finite(input: &Input, batch: &RawCloud, at: Place) -> Result<(), IoError> {
    match batch.position.last() {
        Some(p) if !p.is_finite() => {
            Err(IoError::NotFinite { path: input.path.into(), at, x: p.x, y: p.y, z: p.z })
        }
        _ => Ok(()),
    }
}

fn skip(input: &mut Input, records: &mut Records, element: &Element) -> Result<(), IoError> {
    let (mut values, mut list) = (vec![0.0; element.properties.len()], Vec::new());
    (0..element.count).try_for_each(|_| records.next(input, element, &mut values, None, &mut list))
}

/// A triangle mesh in the file's unit; polygons are cut.
pub(crate) fn read_mesh(input: &mut Input) -> Result<RawMesh, IoError> {
    let header = header::read(input)?;
    let mut records = Records::new(&header);
    let mut mesh = RawMesh::default();
    for element in &header.elements {
        let (mut values, mut list) = (vec![0.0; element.properties.len()], Vec::new());
        let corners =
            element.find(&["vertex_indices", "vertex_index"]).filter(|_| element.name == "face");
        let columns =
            if element.name == "vertex" { Some(Columns::of(input, element)?) } else { None };
        if let Some(columns) = columns.as_ref().filter(|_| header.encoding != Encoding::Ascii) {
            let narrow = |&i: &usize| element.properties[i].scalar == header::Scalar::F32;
            mesh.float32 = columns.xyz.iter().any(narrow);
        }
        for i in 0..element.count {
            records.next(input, element, &mut values, corners, &mut list)?;
            let at = Place::Record(i + 1);
            if let Some(columns) = &columns {
                let p = DVec3::from_array(columns.xyz.map(|i| values[i]));
                if !p.is_finite() {
                    let [x, y, z] = columns.xyz.map(|i| values[i]);
                    return Err(IoError::NotFinite { path: input.path.into(), at, x, y, z });
                }
                mesh.vertices.push(p);
            }
            if corners.is_some() {
                let index = |&v: &f64| label(v, u32::MAX).ok_or(v);
                let polygon: Result<Vec<u32>, f64> = list.iter().map(index).collect();
                let polygon = polygon.map_err(|v| {
                    input.malformed(at, format!("face corner {v} is not a vertex number"))
                })?;
                mesh.push_polygon(&polygon);
            }
        }
    }
    Ok(mesh)
}
