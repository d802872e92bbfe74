//! Tables of our contracts: columns by name in any order, extra ones passed over, bad values named by line.

use crate::input::Input;
use crate::{IoError, Place};
use csv::StringRecord;
use std::borrow::Cow;
use std::path::Path;

/// Longer tables are not ours.
const LIMIT: u64 = 1 << 30;

/// One row with its place.
pub(crate) struct Row<'a> {
    path: &'a Path,
    line: u64,
    record: &'a StringRecord,
}

impl Row<'_> {
    /// The text in a column, without blanks around it; empty when the column is absent.
    pub fn text(&self, column: Option<usize>) -> &str {
        as_meant(column.and_then(|c| self.record.get(c)).unwrap_or_default().trim())
    }

    /// A value that must be there.
    pub fn number<T: std::str::FromStr>(
        &self,
        name: &str,
        column: Option<usize>,
    ) -> Result<T, IoError> {
        let text = self.text(column);
        text.parse()
            .map_err(|_| self.bad(format!("`{name}` = `{text}` is not a number of the right kind")))
    }

    /// A finite number that must be there.
    pub fn finite(&self, name: &str, column: Option<usize>) -> Result<f64, IoError> {
        let value: f64 = self.number(name, column)?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.bad(format!("`{name}` = {value} is not a finite number")))
        }
    }

    /// A finite number, or nothing when the field is empty.
    pub fn finite_or_empty(
        &self,
        name: &str,
        column: Option<usize>,
    ) -> Result<Option<f64>, IoError> {
        if self.text(column).is_empty() { Ok(None) } else { self.finite(name, column).map(Some) }
    }

    /// An error at this row.
    pub fn bad(&self, what: String) -> IoError {
        IoError::malformed(self.path, Place::Line(self.line), what)
    }
}

/// Reads a table: `needed` columns must exist, `optional` ones may; `row` gets their places in that order.
pub(crate) fn read<T>(
    input: &mut Input,
    needed: &[&'static str],
    optional: &[&'static str],
    mut row: impl FnMut(&Row, &[Option<usize>]) -> Result<T, IoError>,
) -> Result<Vec<T>, IoError> {
    let text = input.text(LIMIT)?;
    let text = text.trim_start_matches('\u{feff}'); // spreadsheets put a byte-order mark in front
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
    let path = input.path;
    let fail = |e: csv::Error| {
        let at = e.position().map_or(Place::File, |p| Place::Line(p.line()));
        IoError::malformed(path, at, e.to_string())
    };
    let header = reader.headers().map_err(fail)?.clone();
    let find = |name: &str| header.iter().position(|h| h.trim() == name);
    let mut columns = Vec::new();
    for &column in needed {
        let found = header
            .iter()
            .collect::<Vec<_>>()
            .join(", ")
            .chars()
            .filter(|c| !c.is_control())
            .take(300)
            .collect();
        columns.push(Some(find(column).ok_or(IoError::MissingColumn {
            path: path.into(),
            column,
            found,
        })?));
    }
    columns.extend(optional.iter().map(|c| find(c)));
    let (mut record, mut out) = (StringRecord::new(), Vec::new());
    while reader.read_record(&mut record).map_err(fail)? {
        let line = record.position().map_or(0, csv::Position::line);
        out.push(row(&Row { path, line, record: &record }, &columns)?);
    }
    Ok(out)
}

/// A table as text; numbers are written with the fewest digits that read back exactly.
pub(crate) fn text(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    let fine = "memory takes every byte, and every row is as long as the header";
    writer.write_record(header).expect(fine);
    for row in rows {
        writer.write_record(row.iter().map(|cell| as_text(cell).into_owned())).expect(fine);
    }
    String::from_utf8(writer.into_inner().expect(fine)).expect("text in, text out")
}

/// A cell that no spreadsheet takes for a formula: text that begins like one gets an apostrophe in front, which
/// spreadsheets do not show. Numbers stay numbers.
pub fn as_text(cell: &str) -> Cow<'_, str> {
    if like_formula(cell.trim_start_matches('\'')) {
        Cow::Owned(format!("'{cell}"))
    } else {
        Cow::Borrowed(cell)
    }
}

/// The cell as it was before [`as_text`].
fn as_meant(cell: &str) -> &str {
    match cell.strip_prefix('\'') {
        Some(rest) if like_formula(rest.trim_start_matches('\'')) => rest,
        _ => cell,
    }
}

/// Whether a spreadsheet would run it. A number may begin with a sign.
fn like_formula(cell: &str) -> bool {
    cell.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'])
        && cell.parse::<f64>().is_err()
}

/// x, y, z and a unit quaternion (w first) of a pose in site coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SitePose {
    /// East, north, up of the block's origin, metres.
    pub position_m: [f64; 3],
    /// Rotation, w x y z.
    pub rotation_wxyz: [f64; 4],
}

impl SitePose {
    /// From a local pose.
    pub fn of(pose: &geom::Pose, frame: &scene::SiteFrame) -> Self {
        let q = pose.rotation;
        Self {
            position_m: frame.site_from_local(pose.translation).to_array(),
            rotation_wxyz: [q.w, q.x, q.y, q.z].map(f64::from),
        }
    }

    /// To a local pose, the quaternion brought to unit length. One of f32's unit length stays as it is, so that a pose we wrote
    /// comes back to the last bit and a plan that is read and written again keeps its digits.
    pub fn local(&self, frame: &scene::SiteFrame) -> geom::Pose {
        let [w, x, y, z] = self.rotation_wxyz;
        let given = geom::DQuat::from_xyzw(x, y, z, w);
        let is_unit = (given.length() - 1.0).abs() < 1e-6;
        let rotation = if is_unit { given } else { given.normalize() }.as_quat();
        let position = geom::DVec3::from_array(self.position_m);
        geom::Pose::from_parts(frame.local_from_site(position), rotation)
    }

    /// The seven fields.
    pub(crate) fn fields(&self) -> Vec<String> {
        self.position_m.iter().chain(&self.rotation_wxyz).map(f64::to_string).collect()
    }

    /// From the columns x y z qw qx qy qz.
    pub(crate) fn read(
        row: &Row,
        names: &[&str],
        columns: &[Option<usize>],
    ) -> Result<Self, IoError> {
        let mut value = [0.0; 7];
        for i in 0..7 {
            value[i] = row.finite(names[i], columns[i])?;
        }
        let [x, y, z, qw, qx, qy, qz] = value;
        let length = (qw * qw + qx * qx + qy * qy + qz * qz).sqrt();
        if (length - 1.0).abs() > 1e-3 {
            return Err(row.bad(format!(
                "the quaternion ({qw}, {qx}, {qy}, {qz}) has length {length:.4}; it must be 1 (order: w, x, y, z)"
            )));
        }
        Ok(Self { position_m: [x, y, z], rotation_wxyz: [qw, qx, qy, qz] })
    }
}

#[cfg(test)]
mod tests {
    use super::{SitePose, as_meant, as_text};
    use geom::{Pose, Quat, Vec3};
    use proptest::prelude::*;
    use scene::SiteFrame;

    #[test]
    fn a_name_like_a_formula_is_text_to_a_spreadsheet() {
        for name in ["=1+1", "+a", "-a", "@SUM(A1)", "\t=1", "-", "＝1"] {
            assert!(as_text(name).starts_with('\''), "{name}");
        }
        for plain in ["-1.5", "+3", "1e-5", "tetrapod", "", "'s-Gravenzande", "-inf"] {
            assert_eq!(as_text(plain), plain);
        }
    }

    proptest! {
        #[test]
        fn a_cell_comes_back_as_it_was(cell in "'{0,2}[=+@-]?[ -~]{0,6}") {
            let written = as_text(&cell).into_owned();
            prop_assert_eq!(as_meant(&written), cell.as_str());
        }

        #[test]
        fn a_pose_comes_back_to_the_last_bit(turn in (-3.0f32..3.0, -3.0f32..3.0), x in -200.0f32..200.0, z in -9.0f32..9.0) {
            let frame = SiteFrame { origin: [-35_604.27, -12_310.5, 0.25], ..SiteFrame::default() };
            let rotation = Quat::from_rotation_x(turn.0) * Quat::from_rotation_y(turn.1);
            let pose = Pose::from_parts(Vec3::new(x, -0.3 * x, z), rotation);
            prop_assert_eq!(SitePose::of(&pose, &frame).local(&frame), pose);
        }
    }
}
