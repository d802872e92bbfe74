//! A PCD file again with three fields more for each point. A compressed file comes back uncompressed.

use super::{Field, Header, read_header, unpack};
use crate::input::Input;
use crate::relabel::{ByRecord, PointLabels, Records, SiteFromFile};
use crate::{IoError, Place, atomic};
use std::fmt::Write as _;
use std::io;
use std::path::Path;

const LABELS: [&str; 3] = ["instance", "model", "confidence"];

/// Writes `out` from `source` with these labels.
pub fn relabel(
    out: &Path,
    source: &Path,
    labels: &PointLabels,
    to_site: &SiteFromFile,
    records: Records,
) -> Result<(), IoError> {
    let mut input = Input::open(source)?;
    let header = read_header(&mut input)?;
    super::check_count(&mut input, &header)?;
    let by_record = ByRecord::new(labels, header.points, records);
    let shape = Shape { header: &header, to_site, xyz: ["x", "y", "z"].map(|n| header.find(&[n])) };
    let text = shape.text(by_record.count());
    let mut problem = None;
    let result = atomic::write(out, |file| {
        file.write_all(text.as_bytes())?;
        let copied = copy(&mut input, &shape, &by_record, &mut |bytes| {
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

struct Shape<'a> {
    header: &'a Header,
    to_site: &'a SiteFromFile,
    xyz: [Option<Field>; 3],
}

impl Shape<'_> {
    fn is_label(&self, name: &str) -> bool {
        LABELS.contains(&name)
    }

    fn axis(&self, field: &Field) -> Option<usize> {
        let moved = !self.to_site.is_identity();
        self.xyz.iter().position(|x| x.as_ref() == Some(field)).filter(|_| moved)
    }

    fn text(&self, points: u64) -> String {
        let kept = || self.header.fields.iter().filter(|(n, _)| !self.is_label(n));
        let row = |of: &dyn Fn(&(String, Field)) -> String, tail: &str| {
            kept().map(of).chain([tail.to_string()]).collect::<Vec<_>>().join(" ")
        };
        let kind = |f: &Field| if self.axis(f).is_some() { b'F' } else { f.kind };
        let size = |f: &Field| if self.axis(f).is_some() { 8 } else { f.size };
        let mut out = String::new();
        let fine = "a string takes every character";
        self.header.comments.iter().for_each(|c| writeln!(out, "{c}").expect(fine));
        writeln!(out, "VERSION 0.7").expect(fine);
        writeln!(out, "FIELDS {}", row(&|f| f.0.clone(), "instance model confidence")).expect(fine);
        writeln!(out, "SIZE {}", row(&|f| size(&f.1).to_string(), "4 2 4")).expect(fine);
        writeln!(out, "TYPE {}", row(&|f| char::from(kind(&f.1)).to_string(), "U U F"))
            .expect(fine);
        writeln!(out, "COUNT {}", row(&|f| f.1.count.to_string(), "1 1 1")).expect(fine);
        let whole = points == self.header.points;
        let [width, height] = self.header.size.filter(|_| whole).unwrap_or([points, 1]);
        writeln!(out, "WIDTH {width}\nHEIGHT {height}").expect(fine);
        writeln!(out, "VIEWPOINT {}", self.header.viewpoint_text).expect(fine);
        let data = if self.header.data == "ascii" { "ascii" } else { "binary" };
        writeln!(out, "POINTS {points}\nDATA {data}").expect(fine);
        out
    }

    fn binary(
        &self,
        value: &dyn Fn(&Field) -> f64,
        raw: &dyn Fn(&Field) -> Vec<u8>,
        found: (u32, u16, f32),
    ) -> Vec<u8> {
        let moved = self.to_site.place(self.xyz.map(|f| f.map_or(0.0, |f| value(&f))));
        let mut out = Vec::with_capacity(self.header.stride + 22);
        for (name, field) in &self.header.fields {
            match self.axis(field) {
                Some(axis) => out.extend(moved[axis].to_le_bytes()),
                None if self.is_label(name) => {}
                None => out.extend(raw(field)),
            }
        }
        out.extend(found.0.to_le_bytes());
        out.extend(found.1.to_le_bytes());
        out.extend(found.2.to_le_bytes());
        out
    }

    fn ascii(&self, line: &str, (instance, model, confidence): (u32, u16, f32)) -> Option<String> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let number =
            |f: Option<Field>| f.map_or(Some(0.0), |f| words.get(f.column)?.parse::<f64>().ok());
        let [x, y, z] = self.xyz.map(number);
        let moved = self.to_site.place([x?, y?, z?]);
        let mut out = String::new();
        for (name, field) in &self.header.fields {
            match self.axis(field) {
                Some(axis) => {
                    write!(out, "{} ", moved[axis]).expect("a string takes every character")
                }
                None if self.is_label(name) => {}
                None => {
                    let own = words.get(field.column..field.column + field.count)?;
                    own.iter().for_each(|w| out.extend([w, " "]));
                }
            }
        }
        writeln!(out, "{instance} {model} {confidence}").expect("a string takes every character");
        Some(out)
    }
}

fn copy(
    input: &mut Input,
    shape: &Shape,
    labels: &ByRecord,
    sink: &mut dyn FnMut(&[u8]) -> Result<(), IoError>,
) -> Result<(), IoError> {
    let header = shape.header;
    match header.data.as_str() {
        "ascii" => {
            let mut buffer = Vec::new();
            for i in 0..header.points {
                let line = header.lines + 1 + i;
                let at = Place::Line(line);
                if !input.line(&mut buffer, line, 1 << 16)? {
                    return Err(input.malformed(at, "the file ends before its last point"));
                }
                let Some(found) = labels.of(i) else { continue };
                let row = shape.ascii(&String::from_utf8_lossy(&buffer), found);
                sink(row.ok_or_else(|| input.malformed(at, "this is not a point"))?.as_bytes())?;
            }
            Ok(())
        }
        "binary" => {
            for i in 0..header.points {
                let record = input.take(header.stride as u64, "the points")?;
                let Some(found) = labels.of(i) else { continue };
                let bytes = |f: &Field| record[f.at..f.at + f.size * f.count].to_vec();
                sink(&shape.binary(&|f| f.value(&record), &bytes, found))?;
            }
            Ok(())
        }
        _ => {
            let columns = unpack(input, header)?;
            let points = header.points as usize;
            for i in 0..points {
                let Some(found) = labels.of(i as u64) else { continue };
                let at = |f: &Field| f.at * points + i * f.size * f.count;
                let bytes = |f: &Field| columns[at(f)..at(f) + f.size * f.count].to_vec();
                sink(&shape.binary(&|f| f.value_at(&columns[at(f)..]), &bytes, found))?;
            }
            Ok(())
        }
    }
}
