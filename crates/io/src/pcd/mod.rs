//! PCD (Point Cloud Library): ascii, binary and LZF-compressed. Points with NaN are the format's own mark for
//! "nothing measured": they are left out and counted.

mod relabel;

pub(crate) use relabel::relabel;

use crate::crs;
use crate::input::Input;
use crate::ply::{instance_number, not_a_label};
use crate::raw_cloud::RawCloud;
use crate::read_options::{ByClass, LeaveOut, ReadOptions};
use crate::sensor_place::Station;
use crate::{IoError, Place};
use geom::DVec3;

const BATCH: usize = 65_536;
/// A compressed cloud may unfold to this many times its size; real ones reach 3.
const UNFOLDS: u64 = 40;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Field {
    at: usize,
    size: usize,
    kind: u8,
    count: usize,
    /// Column in an ascii file.
    column: usize,
}

impl Field {
    fn value(&self, record: &[u8]) -> f64 {
        self.value_at(&record[self.at..])
    }

    fn value_at(&self, b: &[u8]) -> f64 {
        macro_rules! number {
            ($t:ty, $n:literal) => {
                <$t>::from_le_bytes(b[..$n].try_into().expect("a slice of this length")) as f64
            };
        }
        match (self.kind, self.size) {
            (b'F', 4) => number!(f32, 4),
            (b'F', _) => number!(f64, 8),
            (b'I', 1) => f64::from(b[0] as i8),
            (b'I', 2) => number!(i16, 2),
            (b'I', 4) => number!(i32, 4),
            (b'I', _) => number!(i64, 8),
            (_, 1) => f64::from(b[0]),
            (_, 2) => number!(u16, 2),
            (_, 4) => number!(u32, 4),
            _ => number!(u64, 8),
        }
    }
}

struct Header {
    fields: Vec<(String, Field)>,
    stride: usize,
    points: u64,
    data: String,
    viewpoint: Option<DVec3>,
    viewpoint_text: String,
    /// Width and height, when they are the number of points.
    size: Option<[u64; 2]>,
    lines: u64,
    comments: Vec<String>,
}

impl Header {
    fn find(&self, names: &[&str]) -> Option<Field> {
        self.fields
            .iter()
            .find(|(n, f)| names.contains(&n.as_str()) && f.count == 1)
            .map(|(_, f)| *f)
    }
}

fn read_header(input: &mut Input) -> Result<Header, IoError> {
    let (mut buffer, mut line) = (Vec::new(), 0);
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    let mut comments = Vec::new();
    loop {
        line += 1;
        if line > 100 || !input.line(&mut buffer, line, 4096)? {
            return Err(input.malformed(
                Place::Line(line),
                "the header has no `DATA` line: this is not a PCD file",
            ));
        }
        let text = String::from_utf8_lossy(&buffer).into_owned();
        if text.trim_start().starts_with('#') {
            comments.push(text);
            continue;
        }
        let mut words = text.split_whitespace().map(str::to_string);
        let Some(key) = words.next().filter(|k| !k.starts_with('#')) else { continue };
        rows.push((key.clone(), words.collect()));
        if key == "DATA" {
            break;
        }
    }
    let row = |key: &str| rows.iter().find(|r| r.0 == key).map(|r| r.1.as_slice());
    let bad = |what: &str| {
        input.malformed(Place::File, format!("the header's {what} cannot be understood"))
    };
    let names = row("FIELDS").ok_or_else(|| bad("`FIELDS`"))?;
    let numbers = |key: &'static str| -> Result<Vec<usize>, IoError> {
        let parse = |w: &String| w.parse::<usize>().ok().filter(|&n| n <= 4096);
        let list: Option<Vec<usize>> =
            row(key).ok_or_else(|| bad(key))?.iter().map(parse).collect();
        list.filter(|l| l.len() == names.len()).ok_or_else(|| bad(key))
    };
    let sizes = numbers("SIZE")?;
    let counts = if row("COUNT").is_some() { numbers("COUNT")? } else { vec![1; names.len()] };
    let kinds = row("TYPE").filter(|t| t.len() == names.len()).ok_or_else(|| bad("`TYPE`"))?;
    let (mut fields, mut at, mut column) = (Vec::new(), 0, 0);
    for (i, name) in names.iter().enumerate() {
        let kind = *kinds[i].as_bytes().first().unwrap_or(&0);
        if !matches!((kind, sizes[i]), (b'F', 4 | 8) | (b'I' | b'U', 1 | 2 | 4 | 8)) {
            return Err(bad("`TYPE` and `SIZE`"));
        }
        fields.push((name.clone(), Field { at, size: sizes[i], kind, count: counts[i], column }));
        at += sizes[i] * counts[i];
        column += counts[i];
    }
    let one = |key: &str| row(key).and_then(|r| r.first()).and_then(|w| w.parse::<u64>().ok());
    let points = one("POINTS")
        .or_else(|| one("WIDTH")?.checked_mul(one("HEIGHT")?))
        .ok_or_else(|| bad("`POINTS`"))?;
    let viewpoint_text = row("VIEWPOINT").map_or("0 0 0 1 0 0 0".into(), |words| words.join(" "));
    let size = one("WIDTH").zip(one("HEIGHT")).map(|(w, h)| [w, h]);
    let size = size.filter(|[w, h]| w.checked_mul(*h) == Some(points));
    let viewpoint: Vec<f64> =
        row("VIEWPOINT").unwrap_or_default().iter().map_while(|w| w.parse().ok()).collect();
    // "0 0 0 1 0 0 0" is what programs write when they know nothing.
    let known = viewpoint.len() == 7 && viewpoint != [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let viewpoint = known
        .then(|| DVec3::new(viewpoint[0], viewpoint[1], viewpoint[2]))
        .filter(|p| p.is_finite());
    let data = row("DATA").and_then(|r| r.first()).cloned().unwrap_or_default();
    Ok(Header {
        fields,
        stride: at.max(1),
        points,
        data,
        viewpoint,
        viewpoint_text,
        size,
        lines: line,
        comments,
    })
}

/// What the header says of the coordinates.
pub(crate) fn reference(input: &mut Input) -> Result<crs::FileCrs, IoError> {
    let header = read_header(input)?;
    Ok(crs::of_comments(header.comments.iter().map(String::as_str)))
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
    let header = read_header(input)?;
    let mut collector = Collector::new(input, &header, options)?;
    check_count(input, &header)?;
    match header.data.as_str() {
        "ascii" => collector.ascii(input, &header, sink)?,
        "binary" => collector.binary(input, &header, sink)?,
        "binary_compressed" => collector.compressed(input, &header, sink)?,
        other => return Err(input.malformed(Place::File, format!("DATA `{other}` is unknown"))),
    }
    let float32 =
        header.data != "ascii" && collector.xyz.iter().any(|f| (f.kind, f.size) == (b'F', 4));
    let reference = crs::of_comments(header.comments.iter().map(String::as_str));
    let mut meta = RawCloud {
        float32,
        invalid: collector.invalid,
        crs: reference.epsg(),
        reference,
        classes: std::mem::take(&mut collector.met.classes),
        left_out: std::mem::take(&mut collector.met.left_out),
        ..RawCloud::default()
    };
    collector.station.finish(&mut meta);
    Ok(meta)
}

/// The header's number of points must fit the file.
fn check_count(input: &mut Input, header: &Header) -> Result<(), IoError> {
    let left = input.len - input.position()?.min(input.len);
    let least = match header.data.as_str() {
        "ascii" => 2 * header.fields.len() as u64,
        "binary" => header.stride as u64,
        _ => 0,
    };
    let unfolded = left.saturating_mul(UNFOLDS) / header.stride as u64;
    let at_most = (left + 1).checked_div(least).unwrap_or(unfolded);
    if header.points > at_most {
        let (path, file_bytes) = (input.path.into(), input.len);
        return Err(IoError::TooMany {
            path,
            what: "points",
            promised: header.points,
            at_most,
            file_bytes,
        });
    }
    Ok(())
}

struct Collector {
    xyz: [Field; 3],
    instance: Option<Field>,
    class: Option<Field>,
    leave_out: LeaveOut,
    met: ByClass,
    /// What −1 stands for among the instances: 0 where they are a `label`.
    minus_one: Option<u32>,
    station: Station,
    record: u64,
    batch: RawCloud,
    invalid: u64,
}

impl Collector {
    fn new(input: &Input, header: &Header, options: &ReadOptions) -> Result<Self, IoError> {
        let found = || header.fields.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(", ");
        let need = |column: &'static str| {
            header.find(&[column]).ok_or_else(|| IoError::MissingColumn {
                path: input.path.into(),
                column,
                found: found(),
            })
        };
        let xyz = [need("x")?, need("y")?, need("z")?];
        let named = header.find(&["instance"]);
        let instance = named.or_else(|| header.find(&["label"])).filter(|_| options.labels);
        let station = Station::new(header.viewpoint, false);
        let batch = empty(instance.is_some());
        let minus_one = options.minus_one.or(named.is_none().then_some(0));
        let is_class = |(name, f): &&(String, Field)| {
            name.eq_ignore_ascii_case("classification") && f.count == 1
        };
        let class = header.fields.iter().find(is_class).map(|(_, f)| *f);
        let (leave_out, met) = (options.leave_out.clone(), ByClass::default());
        Ok(Self {
            xyz,
            instance,
            class,
            leave_out,
            met,
            minus_one,
            station,
            record: 0,
            batch,
            invalid: 0,
        })
    }

    fn push(
        &mut self,
        input: &Input,
        at: Place,
        value: impl Fn(&Field) -> f64,
        sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let p = DVec3::from_array([0, 1, 2].map(|i| value(&self.xyz[i])));
        let record = self.record;
        self.record += 1;
        if p.is_nan() {
            self.invalid += 1;
            return Ok(());
        }
        if !p.is_finite() {
            return Err(IoError::NotFinite { path: input.path.into(), at, x: p.x, y: p.y, z: p.z });
        }
        if let Some(class) = self.class.as_ref().map(&value)
            && self.met.leaves_out(class, &self.leave_out)
        {
            return Ok(());
        }
        self.batch.position.push(p);
        self.station.see(p);
        if let Some(column) = &mut self.batch.record {
            column.push(u32::try_from(record).unwrap_or(u32::MAX));
        }
        if let (Some(field), Some(column)) = (&self.instance, &mut self.batch.instance) {
            let v = value(field);
            let id = instance_number(v, self.minus_one);
            let wrong = || input.malformed(at, not_a_label("label", v, u32::MAX));
            column.push(id.ok_or_else(wrong)?);
        }
        if self.batch.len() == BATCH { self.hand_on(sink) } else { Ok(()) }
    }

    fn hand_on(
        &mut self,
        sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let next = empty(self.instance.is_some());
        let batch = std::mem::replace(&mut self.batch, next);
        if batch.is_empty() { Ok(()) } else { sink(batch) }
    }

    fn ascii(
        &mut self,
        input: &mut Input,
        header: &Header,
        sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let mut buffer = Vec::new();
        for i in 0..header.points {
            let line = header.lines + 1 + i;
            if !input.line(&mut buffer, line, 1 << 16)? {
                return Err(input.malformed(
                    Place::Line(line),
                    "the file ends before its last point; it is cut short",
                ));
            }
            let text = String::from_utf8_lossy(&buffer);
            let values: Option<Vec<f64>> =
                text.split_ascii_whitespace().map(|w| w.parse().ok()).collect();
            let read = self.xyz.iter().chain(&self.instance).chain(&self.class);
            let wanted = read.map(|f| f.column).max().unwrap_or(0);
            let Some(values) = values.filter(|v| v.len() > wanted) else {
                return Err(
                    input.malformed(Place::Line(line), format!("`{}` is not a point", text.trim()))
                );
            };
            self.push(input, Place::Line(line), |f| values[f.column], sink)?;
        }
        self.hand_on(sink)
    }

    fn binary(
        &mut self,
        input: &mut Input,
        header: &Header,
        sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let mut done = 0;
        while done < header.points {
            let count = (header.points - done).min(BATCH as u64);
            let bytes = input.take(count * header.stride as u64, "the points")?;
            for (i, record) in bytes.chunks_exact(header.stride).enumerate() {
                self.push(input, Place::Record(done + i as u64 + 1), |f| f.value(record), sink)?;
            }
            done += count;
        }
        self.hand_on(sink)
    }

    /// Column after column, LZF-compressed.
    fn compressed(
        &mut self,
        input: &mut Input,
        header: &Header,
        sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let bytes = unpack(input, header)?;
        let points = header.points as usize;
        for i in 0..points {
            let value = |f: &Field| f.value_at(&bytes[f.at * points + i * f.size..]);
            self.push(input, Place::Record(i as u64 + 1), value, sink)?;
        }
        self.hand_on(sink)
    }
}

fn empty(instance: bool) -> RawCloud {
    RawCloud { instance: instance.then(Vec::new), record: Some(Vec::new()), ..RawCloud::default() }
}

/// The columns of a compressed file, one after another.
fn unpack(input: &mut Input, header: &Header) -> Result<Vec<u8>, IoError> {
    let mut sizes = [0; 8];
    input.fill(&mut sizes, "the sizes of the compressed points")?;
    let size = |at: usize| {
        u64::from(u32::from_le_bytes(sizes[at..at + 4].try_into().expect("four bytes")))
    };
    let (packed, unpacked) = (size(0), size(4));
    if Some(unpacked) != header.points.checked_mul(header.stride as u64) {
        let what = format!(
            "{unpacked} bytes of points are not {} points of {} bytes",
            header.points, header.stride
        );
        return Err(input.malformed(Place::File, what));
    }
    let packed = input.take(packed, "the compressed points")?;
    unpack_lzf(&packed, unpacked as usize)
        .ok_or_else(|| input.malformed(Place::File, "the compressed points are damaged"))
}

/// LZF: runs of literals and back references; `None` when the data do not give exactly `size` bytes.
fn unpack_lzf(packed: &[u8], size: usize) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(size);
    let mut input = packed.iter().copied();
    while let Some(control) = input.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                out.push(input.next()?);
            }
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(input.next()?);
            }
            let back = ((control & 31) << 8) + usize::from(input.next()?) + 1;
            let start = out.len().checked_sub(back)?;
            for i in start..start + length + 2 {
                out.push(out[i]);
            }
        }
        if out.len() > size {
            return None;
        }
    }
    (out.len() == size).then_some(out)
}
