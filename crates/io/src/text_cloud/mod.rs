//! Text clouds: `.xyz`, `.txt`, `.csv`, `.pts`, `.asc`. Columns by a header line (a comment counts), else x y z first; one
//! separator and one decimal sign a file; any encoding and line end. What could mean two things is asked about.

mod columns;
mod layout;

use crate::crs::{self, FileCrs};
use crate::input::Input;
use crate::ply::{instance_number, label, not_a_label};
use crate::raw_cloud::RawCloud;
use crate::read_options::{ByClass, ReadOptions};
use crate::text_lines::TextLines;
use crate::{IoError, Place};
use columns::{Columns, Unusable};
use geom::DVec3;
use layout::{Layout, comment, is_data, plain};

const BATCH: usize = 65_536;
const LINE_LIMIT: usize = 1 << 16;
/// Lines from which the form of a file is taken.
const LOOKED_AT: usize = 400;

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
    let mut lines = TextLines::new(input, LINE_LIMIT)?;
    let head = lines.look_ahead(input, LOOKED_AT)?.to_vec();
    let form = Form::of(input, &head, options.plane)?;
    let mut columns = form.columns;
    columns.minus_one = options.minus_one.or(columns.minus_one);
    if !options.labels {
        (columns.instance, columns.model, columns.confidence) = (None, None, None);
    }
    let reference = of_head(&head);
    let crs = reference.epsg();
    let mut meta =
        RawCloud { named_axes: columns.named_axes, reference, crs, ..RawCloud::default() };
    if let Some(encoding) = lines.unusual_encoding() {
        meta.notes.push(format!("the text was read as {encoding}"));
    }
    if columns.depth {
        meta.notes.push("depths, which count downwards, were turned into heights".into());
    }
    let (mut batch, mut record, mut met) = (empty(&columns), 0_u32, ByClass::default());
    while let Some((number, line)) = lines.next(input)? {
        let line = plain(&line);
        let text = line.trim();
        if number < form.data_from || text.is_empty() || comment(text).is_some() {
            continue;
        }
        let class = columns.class.and_then(|i| {
            let words = form.layout.split(text);
            form.layout.number(words.get(i)?)
        });
        if class.is_some_and(|class| met.leaves_out(class, &options.leave_out)) {
            record = record.saturating_add(1);
            continue;
        }
        push(input, &mut batch, &form.layout, &columns, text, Place::Line(number))?;
        if let Some(last) = batch.position.last_mut().filter(|_| options.plane) {
            last.z = 0.0;
        }
        if let Some(column) = &mut batch.record {
            column.push(record);
        }
        record = record.saturating_add(1);
        if batch.len() == BATCH {
            sink(std::mem::replace(&mut batch, empty(&columns)))?;
        }
    }
    if !batch.is_empty() {
        sink(batch)?;
    }
    (meta.classes, meta.left_out) = (met.classes, met.left_out);
    Ok(meta)
}

/// What the comments of the first lines say of the coordinates.
pub(crate) fn reference(input: &mut Input) -> Result<FileCrs, IoError> {
    let mut lines = TextLines::new(input, LINE_LIMIT)?;
    Ok(of_head(lines.look_ahead(input, LOOKED_AT)?))
}

fn of_head(head: &[(u64, String)]) -> FileCrs {
    crs::of_comments(head.iter().filter_map(|(_, line)| comment(line.trim())))
}

/// What the first lines say of the rest.
struct Form {
    layout: Layout,
    columns: Columns,
    /// First line that can be a point.
    data_from: u64,
}

impl Form {
    fn of(input: &Input, head: &[(u64, String)], plane: bool) -> Result<Self, IoError> {
        let lines: Vec<(u64, String)> =
            head.iter().map(|(n, l)| (*n, plain(l).trim().to_string())).collect();
        let data: Vec<&(u64, String)> = lines
            .iter()
            .filter(|(_, l)| !l.is_empty() && comment(l).is_none() && is_data(l))
            .collect();
        // PTS files (and others) begin with the number of points.
        let counts = |l: &str| l.parse::<u64>().is_ok();
        let counted = data.len() > 1 && counts(&data[0].1) && !counts(&data[1].1);
        let data = &data[usize::from(counted)..];
        let texts: Vec<&str> = data.iter().map(|(_, l)| l.as_str()).collect();
        let first_data = data.first().map_or(u64::MAX, |d| d.0);
        let at = Place::Line(first_data.min(lines.len() as u64).max(1));
        let layout = Layout::of(&texts).map_err(|question| input.malformed(at, question))?;
        let header = header(input, &lines, first_data, &layout, plane)?;
        let unnamed = if plane { Columns::PLANE } else { Columns::PLAIN };
        let mut form = Self {
            layout,
            columns: header.as_ref().map_or(unnamed, |h| h.1),
            data_from: first_data,
        };
        if data.is_empty() {
            form.data_from = lines.last().map_or(0, |l| l.0) + 1;
            return Ok(form);
        }
        match header {
            Some((names, _)) => form.check_count(input, names, &texts, at)?,
            None if plane => {}
            None => form.check_plain(input, &texts, at)?,
        }
        form.check_depth(input, &texts, at)?;
        Ok(form)
    }

    fn words_of(&self, line: &str) -> Vec<f64> {
        let words = self.layout.split(line);
        words.iter().map(|w| self.layout.number(w).unwrap_or(f64::NAN)).collect()
    }

    /// Twice as many words as names: decimal commas between commas.
    fn check_count(
        &self,
        input: &Input,
        names: usize,
        texts: &[&str],
        at: Place,
    ) -> Result<(), IoError> {
        let twice = |l: &&str| self.layout.split(l).len() == 2 * names;
        if self.layout.separator != layout::Separator::Comma || !texts.iter().all(twice) {
            return Ok(());
        }
        let what = format!(
            "the header names {names} columns, but the lines have {}: either the commas are decimal signs too, or names are missing; separate the columns with `;`, or write a decimal point",
            2 * names
        );
        Err(input.malformed(at, what))
    }

    /// Without a header the first column must not be a number of the point, nor a name.
    fn check_plain(&self, input: &Input, texts: &[&str], at: Place) -> Result<(), IoError> {
        let rows: Vec<Vec<f64>> = texts.iter().take(LOOKED_AT).map(|l| self.words_of(l)).collect();
        let wide = rows.iter().all(|r| r.len() >= 4);
        if wide && rows.iter().all(|r| r[0].is_nan() && r[1..4].iter().all(|v| v.is_finite())) {
            let first = self.layout.split(texts[0])[0].to_string();
            let what = format!(
                "the first column holds names (`{first}`) and there is no header; write the names of the columns into the first line, e.g. `name x y z`"
            );
            return Err(input.malformed(at, what));
        }
        // Whole numbers that grow, in steps or with gaps, beside coordinates that are not whole.
        let whole = rows.iter().all(|r| r[0].fract() == 0.0);
        let grow = rows.windows(2).all(|w| w[1][0] > w[0][0]) && rows.len() >= 3;
        let one_by_one = rows.windows(2).all(|w| w[1][0] - w[0][0] == 1.0);
        let fine = rows.iter().any(|r| r[1..].iter().any(|v| v.fract() != 0.0));
        let counts = whole && grow && (one_by_one || fine);
        // A row of a grid counts too, but its second coordinate stands still.
        let moves = rows.windows(2).any(|w| w[1].get(1) != w[0].get(1));
        if wide && counts && moves {
            let what = format!(
                "the first column counts {}, {}, {} …: the numbers of the points, or their first coordinate? Write the names of the columns into the first line, e.g. `number x y z`",
                rows[0][0], rows[1][0], rows[2][0]
            );
            return Err(input.malformed(at, what));
        }
        Ok(())
    }

    /// A column called depth that holds negative numbers may be heights.
    fn check_depth(&self, input: &Input, texts: &[&str], at: Place) -> Result<(), IoError> {
        if !self.columns.depth {
            return Ok(());
        }
        let value = |l: &&str| self.words_of(l).get(self.columns.xyz[2]).copied();
        let mut values: Vec<f64> =
            texts.iter().filter_map(value).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let middle = values.get(values.len() / 2).copied().unwrap_or(0.0);
        if middle >= 0.0 {
            return Ok(());
        }
        let what = format!(
            "the column of depths holds numbers like {middle}: {middle} as a height below the datum, or {} above it? Call the column `z` for heights, or write depths downwards positive",
            -middle
        );
        Err(input.malformed(at, what))
    }
}

/// Number of names and the columns of the last header before the data: a line of names, or a comment with all three axes.
fn header(
    input: &Input,
    lines: &[(u64, String)],
    first_data: u64,
    layout: &Layout,
    plane: bool,
) -> Result<Option<(usize, Columns)>, IoError> {
    let before = lines.iter().filter(|(n, l)| *n < first_data && !l.is_empty());
    let (mut found, mut problem) = (None, None);
    for (number, line) in before {
        let said = comment(line);
        let text = said.unwrap_or(line);
        let names = names_of(text, layout);
        match Columns::of(&names, plane) {
            Ok(columns) => {
                found = Some((names.len(), columns));
                problem = None;
            }
            // A line that is no comment is meant as a header; a comment may say anything, but not degrees or feet.
            Err(Unusable::Missing(column))
                if said.is_none() && found.is_none() && names.len() > 1 =>
            {
                let all = names.join(", ");
                let all: String = all.chars().filter(|c| !c.is_control()).take(300).collect();
                problem =
                    Some(IoError::MissingColumn { path: input.path.into(), column, found: all });
            }
            Err(Unusable::Refused(why)) if names.len() >= 3 => {
                problem = Some(input.malformed(Place::Line(*number), why));
            }
            Err(_) => {}
        }
    }
    match problem {
        Some(error) => Err(error),
        None => Ok(found),
    }
}

/// The names of a header: by the file's separator, or by any when that gives fewer than three.
fn names_of(text: &str, layout: &Layout) -> Vec<String> {
    let by_layout: Vec<String> = layout.split(text).iter().map(ToString::to_string).collect();
    // `E [m]` separated by blanks: a word in brackets belongs to the name before it.
    let joined = by_layout.into_iter().fold(Vec::<String>::new(), |mut all, word| {
        match all.last_mut() {
            Some(last) if word.starts_with(['[', '(']) => last.push_str(&word),
            _ => all.push(word),
        }
        all
    });
    if joined.len() >= 3 {
        return joined;
    }
    let any = text.split([',', ';', '\t', ' ']).map(str::trim).filter(|w| !w.is_empty());
    any.map(str::to_string).collect()
}

fn empty(columns: &Columns) -> RawCloud {
    RawCloud {
        instance: columns.instance.map(|_| Vec::new()),
        model: columns.model.map(|_| Vec::new()),
        confidence: columns.confidence.map(|_| Vec::new()),
        record: Some(Vec::new()),
        ..RawCloud::default()
    }
}

fn push(
    input: &Input,
    batch: &mut RawCloud,
    layout: &Layout,
    columns: &Columns,
    text: &str,
    at: Place,
) -> Result<(), IoError> {
    let words = layout.split(text);
    let number = |name: &str, i: usize| {
        let word = words
            .get(i)
            .ok_or_else(|| input.malformed(at, format!("the value of `{name}` is missing")))?;
        layout
            .number(word)
            .ok_or_else(|| input.malformed(at, format!("`{name}` = `{word}` is not a number")))
    };
    let [x, y, z] = columns.xyz;
    let mut p = DVec3::new(number("x", x)?, number("y", y)?, number("z", z)?);
    if !p.is_finite() {
        return Err(IoError::NotFinite { path: input.path.into(), at, x: p.x, y: p.y, z: p.z });
    }
    if columns.depth {
        p.z = -p.z;
    }
    batch.position.push(p);
    if let (Some(i), Some(column)) = (columns.instance, &mut batch.instance) {
        let v = number("instance", i)?;
        let id = instance_number(v, columns.minus_one);
        let wrong = || input.malformed(at, not_a_label("instance", v, u32::MAX));
        column.push(id.ok_or_else(wrong)?);
    }
    if let (Some(i), Some(column)) = (columns.model, &mut batch.model) {
        let v = number("model", i)?;
        let wide = label(v, u16::MAX.into())
            .ok_or_else(|| input.malformed(at, not_a_label("model", v, u16::MAX.into())))?;
        column.push(wide as u16);
    }
    if let (Some(i), Some(column)) = (columns.confidence, &mut batch.confidence) {
        column.push(number("confidence", i)? as f32);
    }
    Ok(())
}
