//! A PLY file again with three properties more for each vertex; everything else is copied.

use super::header::{self, Element, Encoding, Header, Scalar};
use crate::input::Input;
use crate::relabel::{ByRecord, PointLabels, Records, SiteFromFile};
use crate::{IoError, atomic};
use std::fmt::Write as _;
use std::io;
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
    let vertex = header.elements.first().filter(|e| e.name == "vertex");
    let Some(vertex) = vertex.filter(|e| e.stride().is_some()) else {
        let what =
            "labels are written into PLY files whose first element is `vertex`, without lists";
        return Err(IoError::unsupported(source, what));
    };
    let by_record = ByRecord::new(labels, vertex.count, records);
    let shape = Shape::of(&header, vertex, to_site);
    let text = shape.header(&header, by_record.count());
    let mut problem = None;
    let result = atomic::write(out, |file| {
        file.write_all(text.as_bytes())?;
        let copied = copy(&mut input, &header, vertex, &shape, &by_record, &mut |bytes| {
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
        for (e, element) in header.elements.iter().enumerate() {
            let own = e == 0;
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

    /// One binary vertex.
    fn binary(
        &self,
        record: &[u8],
        (instance, model, confidence): (u32, u16, f32),
        out: &mut Vec<u8>,
    ) {
        let place = self.xyz.map(|i| {
            i.map_or(0.0, |i| {
                let at: usize = self.vertex.properties[..i].iter().map(|p| p.scalar.size()).sum();
                self.vertex.properties[i].scalar.value(&record[at..], self.big)
            })
        });
        let moved = self.to_site.place(place);
        let mut at = 0;
        for (i, property) in self.vertex.properties.iter().enumerate() {
            let size = property.scalar.size();
            if self.is_moved(i) {
                let axis = self.xyz.iter().position(|x| *x == Some(i)).unwrap_or(0);
                let v = moved[axis];
                out.extend(if self.big { v.to_be_bytes() } else { v.to_le_bytes() });
            } else if !self.is_label(i) {
                out.extend_from_slice(&record[at..at + size]);
            }
            at += size;
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
    fn ascii(&self, line: &str, (instance, model, confidence): (u32, u16, f32)) -> Option<String> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if words.len() < self.vertex.properties.len() {
            return None;
        }
        let number = |i: Option<usize>| i.map_or(Some(0.0), |i| words[i].parse::<f64>().ok());
        let [x, y, z] = self.xyz.map(number);
        let moved = self.to_site.place([x?, y?, z?]);
        let mut out = String::new();
        for i in 0..self.vertex.properties.len() {
            if self.is_moved(i) {
                let axis = self.xyz.iter().position(|x| *x == Some(i)).unwrap_or(0);
                write!(out, "{} ", moved[axis]).expect("a string takes every character");
            } else if !self.is_label(i) {
                out.push_str(words[i]);
                out.push(' ');
            }
        }
        writeln!(out, "{instance} {model} {confidence}").expect("a string takes every character");
        Some(out)
    }
}

fn copy(
    input: &mut Input,
    header: &Header,
    vertex: &Element,
    shape: &Shape,
    labels: &ByRecord,
    sink: &mut dyn FnMut(&[u8]) -> Result<(), IoError>,
) -> Result<(), IoError> {
    if header.encoding == Encoding::Ascii {
        let (mut buffer, mut line) = (Vec::new(), header.lines);
        let mut done = 0;
        while done < vertex.count {
            line += 1;
            let at = crate::Place::Line(line);
            if !input.line(&mut buffer, line, 1 << 20)? {
                return Err(input.malformed(at, "the file ends before the last `vertex`"));
            }
            let text = String::from_utf8_lossy(&buffer);
            if text.trim().is_empty() {
                continue;
            }
            if let Some(found) = labels.of(done) {
                let row = shape.ascii(&text, found);
                sink(row.ok_or_else(|| input.malformed(at, "this is not a vertex"))?.as_bytes())?;
            }
            done += 1;
        }
    } else {
        let stride = vertex.stride().expect("checked by the caller") as u64;
        let piece = (PIECE / stride).max(1);
        let mut done = 0;
        while done < vertex.count {
            let count = piece.min(vertex.count - done);
            let bytes = input.take(count * stride, "the vertices")?;
            let mut out = Vec::with_capacity(bytes.len() * 2);
            for (i, record) in bytes.chunks_exact(stride as usize).enumerate() {
                if let Some(found) = labels.of(done + i as u64) {
                    shape.binary(record, found, &mut out);
                }
            }
            sink(&out)?;
            done += count;
        }
    }
    // Faces and the like.
    loop {
        let left = input.len.saturating_sub(input.position()?);
        if left == 0 {
            return Ok(());
        }
        let bytes = input.take(left.min(PIECE), "the elements behind the vertices")?;
        sink(&bytes)?;
    }
}
