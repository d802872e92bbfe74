//! A PLY file again with three properties more for each vertex; everything else is copied.

use super::header::{self, Element, Encoding, Header, Scalar};
use crate::input::Input;
use crate::relabel::{ByRecord, PointLabels, Records, SiteFromFile};
use crate::{IoError, Place, atomic};
use std::fmt::Write as _;
use std::io;
use std::ops::Range;
use std::path::Path;

const LABELS: [&str; 3] = ["instance", "model", "confidence"];
const PIECE: u64 = 1 << 20;

/// Writes `out` from `source` with these labels.
pub fn relabel(
    out: &Path,
    source: &Path,
    labels: &PointLabels,
    to_site: &SiteFromFile,
    records: Records,
) -> Result<(), IoError> {
    let mut input = Input::open(source)?;
    let header = header::read(&mut input)?;
    let Some(vertex) = header.elements.iter().find(|e| e.name == "vertex") else {
        return Err(input.malformed(Place::File, "the file has no `vertex` element"));
    };
    let by_record = ByRecord::new(labels, vertex.count, records);
    let shape = Shape::of(&header, vertex, to_site);
    if shape.xyz.iter().flatten().any(|&i| vertex.properties[i].list.is_some()) {
        return Err(input.malformed(Place::File, "a coordinate of `vertex` is a list"));
    }
    let text = shape.header(&header, by_record.count());
    let mut problem = None;
    let result = atomic::write(out, |file| {
        file.write_all(text.as_bytes())?;
        let copied = copy(&mut input, &header, &shape, &by_record, &mut |bytes| {
            file.write_all(bytes).map_err(|e| IoError::write(out, e))
        });
        copied.map_err(|e| {
            problem = Some(e);
            io::Error::other("the survey could not be read again")
        })
    });
    match problem {
        Some(error) => Err(error),
        None => result,
    }
}

/// How a vertex is written.
struct Shape<'a> {
    to_site: &'a SiteFromFile,
    vertex: &'a Element,
    /// Place of x, y and z among the properties.
    xyz: [Option<usize>; 3],
    big: bool,
}

impl<'a> Shape<'a> {
    fn of(header: &Header, vertex: &'a Element, to_site: &'a SiteFromFile) -> Self {
        let xyz = ["x", "y", "z"].map(|n| vertex.find(&[n]));
        Self { to_site, vertex, xyz, big: header.encoding == Encoding::BigEndian }
    }

    /// Earlier labels are written anew.
    fn is_label(&self, property: usize) -> bool {
        LABELS.contains(&self.vertex.properties[property].name.as_str())
    }

    /// Coordinates that are moved become doubles, so that nothing is lost.
    fn is_moved(&self, property: usize) -> bool {
        !self.to_site.is_identity() && self.xyz.contains(&Some(property))
    }

    fn header(&self, header: &Header, count: u64) -> String {
        let mut out = String::from("ply\n");
        let encoding = match header.encoding {
            Encoding::Ascii => "ascii",
            Encoding::LittleEndian => "binary_little_endian",
            Encoding::BigEndian => "binary_big_endian",
        };
        let fine = "a string takes every character";
        writeln!(out, "format {encoding} 1.0").expect(fine);
        header.comments.iter().for_each(|c| writeln!(out, "{c}").expect(fine));
        for element in &header.elements {
            let own = std::ptr::eq(element, self.vertex);
            let count = if own { count } else { element.count };
            writeln!(out, "element {} {count}", element.name).expect(fine);
            for (i, property) in element.properties.iter().enumerate() {
                if own && self.is_label(i) {
                    continue;
                }
                let scalar = if own && self.is_moved(i) { Scalar::F64 } else { property.scalar };
                match property.list {
                    Some(list) => writeln!(
                        out,
                        "property list {} {} {}",
                        list.word(),
                        scalar.word(),
                        property.name
                    ),
                    None => writeln!(out, "property {} {}", scalar.word(), property.name),
                }
                .expect(fine);
            }
            if own {
                out.push_str(
                    "property uint instance\nproperty ushort model\nproperty float confidence\n",
                );
            }
        }
        out.push_str("end_header\n");
        out
    }

    /// One binary vertex; `spans`: where each property lies in it.
    fn binary(
        &self,
        record: &[u8],
        spans: &[Range<usize>],
        (instance, model, confidence): (u32, u16, f32),
        out: &mut Vec<u8>,
    ) {
        let value = |i: Option<usize>| {
            i.map_or(0.0, |i| {
                let scalar = self.vertex.properties[i].scalar;
                scalar.value(&record[spans[i].clone()], self.big)
            })
        };
        let moved = self.to_site.place(self.xyz.map(value));
        for (i, span) in spans.iter().enumerate() {
            if self.is_moved(i) {
                let axis = self.xyz.iter().position(|x| *x == Some(i)).unwrap_or(0);
                let v = moved[axis];
                out.extend(if self.big { v.to_be_bytes() } else { v.to_le_bytes() });
            } else if !self.is_label(i) {
                out.extend_from_slice(&record[span.clone()]);
            }
        }
        if self.big {
            out.extend(instance.to_be_bytes());
            out.extend(model.to_be_bytes());
            out.extend(confidence.to_be_bytes());
        } else {
            out.extend(instance.to_le_bytes());
            out.extend(model.to_le_bytes());
            out.extend(confidence.to_le_bytes());
        }
    }

    /// One vertex as text: its own words, so that no digit changes.
    fn ascii(
        &self,
        line: &str,
        spans: &[Range<usize>],
        (instance, model, confidence): (u32, u16, f32),
    ) -> Option<String> {
        let number =
            |i: Option<usize>| i.map_or(Some(0.0), |i| line[spans[i].clone()].parse::<f64>().ok());
        let [x, y, z] = self.xyz.map(number);
        let moved = self.to_site.place([x?, y?, z?]);
        let mut out = String::new();
        for (i, span) in spans.iter().enumerate() {
            if self.is_moved(i) {
                let axis = self.xyz.iter().position(|x| *x == Some(i)).unwrap_or(0);
                write!(out, "{} ", moved[axis]).expect("a string takes every character");
            } else if !self.is_label(i) {
                out.push_str(&line[span.clone()]);
                out.push(' ');
            }
        }
        writeln!(out, "{instance} {model} {confidence}").expect("a string takes every character");
        Some(out)
    }
}

type Sink<'s> = &'s mut dyn FnMut(&[u8]) -> Result<(), IoError>;

/// Everything behind the header, vertices with their labels.
fn copy(
    input: &mut Input,
    header: &Header,
    shape: &Shape,
    labels: &ByRecord,
    sink: Sink,
) -> Result<(), IoError> {
    let mut line = header.lines;
    for element in &header.elements {
        let own = std::ptr::eq(element, shape.vertex).then_some((shape, labels));
        match (header.encoding, element.stride()) {
            (Encoding::Ascii, _) => copy_lines(input, element, own, &mut line, sink)?,
            (_, Some(stride)) => copy_fixed(input, element, own, stride, sink)?,
            (_, None) => copy_lists(input, element, own, shape.big, sink)?,
        }
    }
    // What nobody announced.
    loop {
        let left = input.len.saturating_sub(input.position()?);
        if left == 0 {
            return Ok(());
        }
        let bytes = input.take(left.min(PIECE), "the bytes behind the last element")?;
        sink(&bytes)?;
    }
}

/// What makes vertices of records; `None` for other elements, which stay as they are.
type Own<'a> = Option<(&'a Shape<'a>, &'a ByRecord<'a>)>;

fn copy_lines(
    input: &mut Input,
    element: &Element,
    own: Own,
    line: &mut u64,
    sink: Sink,
) -> Result<(), IoError> {
    let mut buffer = Vec::new();
    let mut done = 0;
    while done < element.count {
        *line += 1;
        let at = Place::Line(*line);
        if !input.line(&mut buffer, *line, 1 << 20)? {
            let what = format!("the file ends before the last `{}`", element.name);
            return Err(input.malformed(at, what));
        }
        let text = String::from_utf8_lossy(&buffer);
        if text.trim().is_empty() {
            continue;
        }
        match own {
            None => sink(format!("{}\n", text.trim_end()).as_bytes())?,
            Some((shape, labels)) => {
                if let Some(found) = labels.of(done) {
                    let row = words(element, &text).and_then(|s| shape.ascii(&text, &s, found));
                    let row = row.ok_or_else(|| input.malformed(at, "this is not a vertex"))?;
                    sink(row.as_bytes())?;
                }
            }
        }
        done += 1;
    }
    Ok(())
}

/// Where the words of each property stand in a line.
fn words(element: &Element, line: &str) -> Option<Vec<Range<usize>>> {
    let start = |word: &str| word.as_ptr() as usize - line.as_ptr() as usize;
    let mut all = line.split_ascii_whitespace().map(|w| start(w)..start(w) + w.len());
    let span = |list: bool| {
        let first = all.next()?;
        let more = if list { line[first.clone()].parse::<usize>().ok()? } else { 0 };
        let last = (0..more).try_fold(first.end, |_, _| Some(all.next()?.end))?;
        Some(first.start..last)
    };
    element.properties.iter().map(|p| p.list.is_some()).map(span).collect()
}

/// Binary records of one size: in large pieces.
fn copy_fixed(
    input: &mut Input,
    element: &Element,
    own: Own,
    stride: usize,
    sink: Sink,
) -> Result<(), IoError> {
    let mut end = 0;
    let span = |size: usize| {
        end += size;
        end - size..end
    };
    let spans: Vec<Range<usize>> =
        element.properties.iter().map(|p| p.scalar.size()).map(span).collect();
    let piece = (PIECE / stride.max(1) as u64).max(1);
    let mut done = 0;
    while done < element.count && stride > 0 {
        let count = piece.min(element.count - done);
        let bytes = input.take(count * stride as u64, "an element")?;
        match own {
            None => sink(&bytes)?,
            Some((shape, labels)) => {
                let mut out = Vec::with_capacity(bytes.len() * 2);
                for (i, record) in bytes.chunks_exact(stride).enumerate() {
                    if let Some(found) = labels.of(done + i as u64) {
                        shape.binary(record, &spans, found, &mut out);
                    }
                }
                sink(&out)?;
            }
        }
        done += count;
    }
    Ok(())
}

/// Binary records with lists: one by one.
fn copy_lists(
    input: &mut Input,
    element: &Element,
    own: Own,
    big: bool,
    sink: Sink,
) -> Result<(), IoError> {
    let (mut record, mut spans, mut out) = (Vec::new(), Vec::new(), Vec::new());
    for done in 0..element.count {
        record.clear();
        spans.clear();
        for property in &element.properties {
            let start = record.len();
            let mut raw = [0; 8];
            let head = property.list.unwrap_or(property.scalar);
            input.fill(&mut raw[..head.size()], "an element")?;
            record.extend_from_slice(&raw[..head.size()]);
            if property.list.is_some() {
                let count = head.value(&raw, big).max(0.0) as u64;
                record.extend(input.take(count * property.scalar.size() as u64, "a list")?);
            }
            spans.push(start..record.len());
        }
        match own {
            None => out.extend_from_slice(&record),
            Some((shape, labels)) => {
                if let Some(found) = labels.of(done) {
                    shape.binary(&record, &spans, found, &mut out);
                }
            }
        }
        if out.len() as u64 >= PIECE || done + 1 == element.count {
            sink(&out)?;
            out.clear();
        }
    }
    Ok(())
}
