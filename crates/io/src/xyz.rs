//! Text clouds: `.xyz`, `.txt`, `.csv`, `.pts`, `.asc`. Columns by a header line, else x y z first; separated by blanks,
//! commas, semicolons or tabs; `#` and `//` begin comments.

use crate::input::Input;
use crate::ply::{label, not_a_label};
use crate::raw_cloud::RawCloud;
use crate::{IoError, Place};
use geom::DVec3;

const BATCH: usize = 65_536;
const LINE_LIMIT: u64 = 1 << 16;

/// Column of each quantity.
#[derive(Clone, Copy)]
struct Columns {
    xyz: [usize; 3],
    instance: Option<usize>,
    model: Option<usize>,
    confidence: Option<usize>,
}

impl Columns {
    const PLAIN: Self = Self { xyz: [0, 1, 2], instance: None, model: None, confidence: None };

    fn of(input: &Input, words: &[&str]) -> Result<Self, IoError> {
        let plain = |w: &str| w.trim_matches(['"', ' ']).trim_start_matches("//").to_lowercase();
        let find = |names: &[&str]| words.iter().position(|w| names.contains(&plain(w).as_str()));
        let need = |column: &'static str, names: &[&str]| {
            let found: String =
                words.join(", ").chars().filter(|c| !c.is_control()).take(300).collect();
            find(names).ok_or(IoError::MissingColumn { path: input.path.into(), column, found })
        };
        Ok(Self {
            xyz: [
                need("x", &["x", "x_m", "east", "easting", "e"])?,
                need("y", &["y", "y_m", "north", "northing", "n"])?,
                need("z", &["z", "z_m", "height", "elevation", "level", "up", "h"])?,
            ],
            instance: find(&["instance", "label"]),
            model: find(&["model"]),
            confidence: find(&["confidence"]),
        })
    }

    fn batch(&self) -> RawCloud {
        RawCloud {
            instance: self.instance.map(|_| Vec::new()),
            model: self.model.map(|_| Vec::new()),
            confidence: self.confidence.map(|_| Vec::new()),
            ..RawCloud::default()
        }
    }
}

/// Hands the points on in batches; what comes back has everything but the points.
pub fn stream(
    input: &mut Input,
    sink: &mut dyn FnMut(RawCloud) -> Result<(), IoError>,
) -> Result<RawCloud, IoError> {
    let (mut buffer, mut line, mut columns) = (Vec::new(), 0, None);
    let mut batch = RawCloud::default();
    loop {
        line += 1;
        if !input.line(&mut buffer, line, LINE_LIMIT)? {
            break;
        }
        let at = Place::Line(line);
        let text = std::str::from_utf8(&buffer)
            .map_err(|_| input.malformed(at, "the line is not text"))?;
        let text = text.trim_start_matches('\u{feff}').trim();
        let words: Vec<&str> = if text.contains([',', ';', '\t']) {
            text.split([',', ';', '\t']).map(str::trim).collect()
        } else {
            text.split_ascii_whitespace().collect()
        };
        let first = words.first().copied().unwrap_or_default();
        let starts = columns.is_none();
        let named = first.trim_matches('"').trim_start_matches("//").eq_ignore_ascii_case("x");
        if text.is_empty()
            || text.starts_with('#')
            || (text.starts_with("//") && !(starts && named))
        {
            continue;
        }
        if starts && words.len() == 1 && first.parse::<u64>().is_ok() {
            continue; // PTS files begin with the number of points
        }
        if starts && first.parse::<f64>().is_err() {
            let of = Columns::of(input, &words)?;
            batch = of.batch();
            columns = Some(of);
            continue;
        }
        let columns = *columns.get_or_insert(Columns::PLAIN);
        push(input, &mut batch, &columns, &words, at)?;
        if batch.len() == BATCH {
            sink(std::mem::replace(&mut batch, columns.batch()))?;
        }
    }
    if !batch.is_empty() {
        sink(batch)?;
    }
    Ok(RawCloud::default())
}

fn push(
    input: &Input,
    batch: &mut RawCloud,
    columns: &Columns,
    words: &[&str],
    at: Place,
) -> Result<(), IoError> {
    let number = |name: &str, i: usize| {
        let word = words
            .get(i)
            .ok_or_else(|| input.malformed(at, format!("the value of `{name}` is missing")))?;
        word.parse::<f64>()
            .map_err(|_| input.malformed(at, format!("`{name}` = `{word}` is not a number")))
    };
    let [x, y, z] = columns.xyz;
    let p = DVec3::new(number("x", x)?, number("y", y)?, number("z", z)?);
    if !p.is_finite() {
        return Err(IoError::NotFinite { path: input.path.into(), at, x: p.x, y: p.y, z: p.z });
    }
    batch.position.push(p);
    if let (Some(i), Some(column)) = (columns.instance, &mut batch.instance) {
        let v = number("instance", i)?;
        column.push(
            label(v, u32::MAX).ok_or_else(|| input.malformed(at, not_a_label("instance", v)))?,
        );
    }
    if let (Some(i), Some(column)) = (columns.model, &mut batch.model) {
        let v = number("model", i)?;
        let wide = label(v, u16::MAX.into())
            .ok_or_else(|| input.malformed(at, not_a_label("model", v)))?;
        column.push(wide as u16);
    }
    if let (Some(i), Some(column)) = (columns.confidence, &mut batch.confidence) {
        column.push(number("confidence", i)? as f32);
    }
    Ok(())
}
