//! `as_placed.csv`: where the blocks of a plan really stand, as a positioning system or a person wrote it down.

use crate::IoError;
use crate::csv_table;
use crate::input::Input;
use std::path::Path;

/// Columns that must be there, those of `lifts.csv`: number in the plan, then the centre of mass in site coordinates.
pub const COLUMNS: [&str; 4] = ["order", "x_m", "y_m", "rest_level_m"];
/// Attitude, where it was measured.
pub const ATTITUDE: [&str; 4] = ["qw", "qx", "qy", "qz"];

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct AsPlacedRow {
    /// Number in the plan.
    pub order: u32,
    /// Centre of mass: east, north, level.
    pub centre_m: [f64; 3],
    /// Rotation of the block, w x y z; `None`: as planned.
    pub rotation_wxyz: Option<[f64; 4]>,
}

/// Reads the file. Errors: a number twice, a rotation that is none.
pub fn read(path: &Path) -> Result<Vec<AsPlacedRow>, IoError> {
    let mut seen = std::collections::BTreeSet::new();
    csv_table::read(&mut Input::open(path)?, &COLUMNS, &ATTITUDE, |row, c| {
        let order = row.number(COLUMNS[0], c[0])?;
        if !seen.insert(order) {
            return Err(row.bad(format!("`order` = {order} stands there twice")));
        }
        let axis = |i: usize| row.finite(COLUMNS[i], c[i]);
        let centre_m = [axis(1)?, axis(2)?, axis(3)?];
        let measured = c[4..].iter().all(|column| !row.text(*column).is_empty());
        let rotation_wxyz = match measured {
            false => None,
            true => {
                let part = |i: usize| row.finite(ATTITUDE[i], c[4 + i]);
                let q = [part(0)?, part(1)?, part(2)?, part(3)?];
                let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
                if !((length - 1.0).abs() < 0.01) {
                    return Err(row.bad(format!(
                        "qw qx qy qz have the length {length:.3}, a rotation has 1; leave them empty where the attitude was not measured"
                    )));
                }
                Some(q.map(|v| v / length))
            }
        };
        Ok(AsPlacedRow { order, centre_m, rotation_wxyz })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_with_and_without_attitudes_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("as_placed.csv");
        std::fs::write(
            &file,
            "order,x_m,y_m,rest_level_m,qw,qx,qy,qz\n1,10,20,1.5,1,0,0,0\n2,11,20,1.5,,,,\n",
        )
        .unwrap();
        let rows = read(&file).unwrap();
        assert_eq!(
            (rows[0].rotation_wxyz, rows[1].rotation_wxyz),
            (Some([1.0, 0.0, 0.0, 0.0]), None)
        );
        std::fs::write(&file, "order,x_m,y_m,rest_level_m\n1,10,20,1.5\n1,10,20,1.5\n").unwrap();
        assert!(read(&file).unwrap_err().to_string().contains("twice"));
        std::fs::write(&file, "order,x_m,y_m,rest_level_m,qw,qx,qy,qz\n1,1,1,1,2,0,0,0\n").unwrap();
        assert!(read(&file).unwrap_err().to_string().contains("2.000"));
    }
}
