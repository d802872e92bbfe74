//! Labelled clouds of any program: PLY, LAS and LAZ with a column `instance`, text `x y z … instance …` with or without a head,
//! and NumPy tables.
//!
//! Instance numbers come as they are, −1, 0 and huge ones too; what they mean is the reader's business. Without a head the
//! column of the instances is the only whole-numbered one after x, y, z, or the one that is named by its number.

use crate::input::Input;
use crate::mesh::extension;
use crate::{IoError, Place, ReadOptions, npy, points};
use geom::{DVec3, Observer};
use std::path::Path;

/// Points with the instance each belongs to, as the file numbers them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelCloud {
    /// Coordinates as in the file.
    pub position: Vec<DVec3>,
    /// Instance of each point.
    pub instance: Vec<i64>,
    /// Confidence of each point's label, where the file has a column of that name.
    pub confidence: Option<Vec<f32>>,
}

const LINE_LIMIT: u64 = 1 << 16;
/// Below it every whole number is told from the next.
const WHOLE_LIMIT: f64 = 9e15;
/// Farther than this from the origin nothing is surveyed, in metres or millimetres.
const COORDINATE_LIMIT: f64 = 1e12;

/// Reads a labelled cloud; `column`, from 1, names the column of the instances in files without column names.
pub fn read(
    path: &Path,
    column: Option<usize>,
    observer: &dyn Observer,
) -> Result<LabelCloud, IoError> {
    let kind = extension(path);
    let mut input = Input::open(path)?;
    let table = match kind.as_str() {
        "npz" => {
            let what = "it is an archive of arrays; save the one of the points alone: np.save(\"cloud.npy\", points)";
            return Err(input.malformed(Place::File, what));
        }
        "npy" => npy::read(&mut input)?,
        "txt" | "xyz" | "asc" | "csv" | "pts" => match text_table(&mut input)? {
            Some(table) => table,
            None => return named_columns(path, observer),
        },
        _ => return named_columns(path, observer),
    };
    of_table(path, &table, column)
}

/// Files whose columns have names.
fn named_columns(path: &Path, observer: &dyn Observer) -> Result<LabelCloud, IoError> {
    // Also points that a survey would leave out: they are judged.
    let cloud = points::read_with(path, &ReadOptions::every_label(), observer)?;
    let missing = || IoError::MissingColumn {
        path: path.into(),
        column: "instance",
        found: "none called `label` either: call that of the instances so, or give points with one"
            .into(),
    };
    let number = |i: u32| if i == u32::MAX { -1 } else { i64::from(i) };
    let instance = cloud.instance.ok_or_else(missing)?.into_iter().map(number).collect();
    Ok(LabelCloud { position: cloud.position, instance, confidence: cloud.confidence })
}

/// The numbers of a text file; `None` when it begins with names.
fn text_table(input: &mut Input) -> Result<Option<npy::Table>, IoError> {
    let (mut buffer, mut line, mut table) = (Vec::new(), 0, npy::Table::default());
    loop {
        line += 1;
        if !input.line(&mut buffer, line, LINE_LIMIT)? {
            return Ok(Some(table));
        }
        let at = Place::Line(line);
        let text = std::str::from_utf8(&buffer)
            .map_err(|_| input.malformed(at, "the line is not text"))?
            .trim_start_matches('\u{feff}')
            .trim();
        let words: Vec<&str> =
            text.split([' ', '\t', ',', ';']).filter(|w| !w.is_empty()).collect();
        if words.is_empty() || text.starts_with('#') || text.starts_with("//") {
            continue;
        }
        let first = table.columns == 0;
        if first && words[0].parse::<f64>().is_err() {
            return Ok(None);
        }
        if first && words.len() == 1 {
            continue; // PTS files begin with the number of points
        }
        if first {
            table.columns = words.len();
        } else if words.len() != table.columns {
            let what = format!("{} values, the lines before have {}", words.len(), table.columns);
            return Err(input.malformed(at, what));
        }
        for word in words {
            let value: f64 = word
                .parse()
                .map_err(|_| input.malformed(at, format!("`{word}` is not a number")))?;
            table.values.push(value);
        }
    }
}

fn of_table(path: &Path, table: &npy::Table, column: Option<usize>) -> Result<LabelCloud, IoError> {
    if table.values.is_empty() {
        return Err(IoError::NoPoints { path: path.into() });
    }
    let wrong = |what: String| IoError::malformed(path, Place::File, what);
    let rows = || table.values.chunks_exact(table.columns);
    let is_whole = |c: usize| rows().all(|r| r[c].fract() == 0.0 && r[c].abs() < WHOLE_LIMIT);
    let at = match column {
        Some(c) if (4..=table.columns).contains(&c) && is_whole(c - 1) => c - 1,
        Some(c) => {
            return Err(wrong(format!(
                "column {c} does not hold instances: give one of 4 to {} whose values are whole numbers",
                table.columns
            )));
        }
        None => {
            let whole: Vec<usize> = (3..table.columns).filter(|&c| is_whole(c)).collect();
            match whole.as_slice() {
                [one] => *one,
                [] => return Err(wrong(no_instances(table))),
                many => {
                    let names: Vec<String> = many.iter().map(|c| (c + 1).to_string()).collect();
                    return Err(wrong(format!(
                        "columns {} all hold whole numbers; say which of them are the instances",
                        names.join(", ")
                    )));
                }
            }
        }
    };
    let mut cloud = LabelCloud::default();
    for (number, row) in rows().enumerate() {
        let p = DVec3::new(row[0], row[1], row[2]);
        if !p.is_finite() {
            let at = Place::Record(number as u64 + 1);
            return Err(IoError::NotFinite { path: path.into(), at, x: p.x, y: p.y, z: p.z });
        }
        if p.abs().max_element() > COORDINATE_LIMIT {
            let what = format!("the coordinates ({:e}, {:e}, {:e}) are on no site", p.x, p.y, p.z);
            return Err(IoError::malformed(path, Place::Record(number as u64 + 1), what));
        }
        cloud.position.push(p);
        cloud.instance.push(row[at] as i64);
    }
    Ok(cloud)
}

/// Why none of the columns can be that of the instances.
fn no_instances(table: &npy::Table) -> String {
    let rows = || table.values.chunks_exact(table.columns);
    let Some(after) = table.columns.checked_sub(3).filter(|n| *n > 0) else {
        return "it has no column after x, y, z, so it has no instances".into();
    };
    let too_large = |c: &usize| rows().all(|r| r[*c].fract() == 0.0);
    match (3..table.columns).find(too_large) {
        Some(c) => format!(
            "column {} holds numbers beyond {WHOLE_LIMIT:e}, which cannot be told from their neighbours; number the instances from 1",
            c + 1
        ),
        None => format!(
            "none of its {after} columns after x, y, z holds whole numbers, so it has no instances"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Silent;

    fn read_text(text: &str, column: Option<usize>) -> Result<LabelCloud, IoError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, text).unwrap();
        read(&path, column, &Silent)
    }

    #[test]
    fn the_whole_numbered_column_is_the_instance_wherever_it_stands() {
        let score_first = read_text("0 0 0 0.5 3\n1 0 0 0.25 -1\n", None).unwrap();
        let score_last = read_text("0,0,0,3,0.5\n1,0,0,-1,0.25\n", None).unwrap();
        assert_eq!(score_first, score_last);
        assert_eq!(score_first.instance, [3, -1]);
        let huge = read_text("0 0 0 4294967296000\n", None).unwrap();
        assert_eq!(huge.instance, [4_294_967_296_000]);
        let named = read_text("x y z instance\n0 0 0 7\n0 0 0 -1\n0 0 0 0\n", None).unwrap();
        assert_eq!(named.instance, [7, -1, 0]);
    }

    #[test]
    fn what_cannot_be_told_is_asked_for() {
        let says = |text: &str, column| read_text(text, column).unwrap_err().to_string();
        assert!(says("0 0 0 1 2\n", None).contains("columns 4, 5"));
        assert_eq!(read_text("0 0 0 1 2\n", Some(5)).unwrap().instance, [2]);
        assert!(says("0 0 0 1 2\n", Some(3)).contains("4 to 5"));
        assert!(says("0 0 0\n", None).contains("no instances"));
        let beyond = says("0 0 0 4000000000000000000\n", None);
        assert!(beyond.contains("column 4") && beyond.contains("number the instances from 1"));
        assert!(says("0 0 0 1\n1e300 0 0 1\n", None).contains("record 2"));
        let named = says("x y z instance\n0 0 0 5000000000000\n", None);
        assert!(named.contains("from 0 to 4294967295"), "{named}");
        let below = read_text("x y z instance\n0 0 0 -100\n0 0 0 -1\n", None).unwrap();
        assert_eq!(below.instance, [-1, -1]);
        assert!(says("0 0 0 1\n0 0 0\n", None).contains("line 2"));
        assert!(says("x y z\n0 0 0\n", None).contains("instance"));
        assert!(says("# nothing\n", None).contains("no points"));
    }
}
