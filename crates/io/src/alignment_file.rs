//! An alignment from another program: LandXML, DXF, or a text table of points.

use crate::crs::{FileCrs, Unit};
use crate::input::Input;
use crate::mesh::extension;
use crate::read_options::ReadOptions;
use crate::{IoError, Place, dxf, landxml, points};
use geom::{DVec3, Observer};
use scene::AxisOrder;
use std::path::Path;

/// Reads the points (east, north, metres) of an alignment. `name` chooses an alignment of a LandXML or a layer of a DXF;
/// `axis_order` says how the columns of a DXF, and of a text table without directions in its names, run.
pub fn read(
    path: &Path,
    name: Option<&str>,
    axis_order: AxisOrder,
    observer: &dyn Observer,
) -> Result<(Vec<[f64; 2]>, FileCrs), IoError> {
    let turned = |x: f64, y: f64, named: bool| {
        let p = DVec3::new(x, y, 0.0);
        let p = if named { p } else { axis_order.east_north_up(p) };
        [p.x, p.y]
    };
    match extension(path).as_str() {
        "xml" | "landxml" => landxml::read_alignment(&mut Input::open(path)?, name),
        "dxf" => {
            let mut input = Input::open(path)?;
            let (lines, unit) = dxf::read_polylines(&mut input, name)?;
            let metre = unit.unwrap_or_else(Unit::metre).metres;
            let [line] = lines.as_slice() else {
                let mut layers: Vec<&str> = lines.iter().map(|l| l.layer.as_str()).collect();
                layers.dedup();
                let what = if lines.is_empty() {
                    "model space shows no line; draw the alignment as one polyline".to_string()
                } else {
                    format!(
                        "the drawing has {} lines (layers {}); leave one polyline on a layer of its own and name it: `name = \"…\"`",
                        lines.len(),
                        layers.iter().take(12).copied().collect::<Vec<_>>().join(", ")
                    )
                };
                return Err(input.malformed(Place::File, what));
            };
            let points = line.points.iter().map(|p| turned(p.x * metre, p.y * metre, false));
            Ok((points.collect(), FileCrs::default()))
        }
        "csv" | "txt" | "xyz" => {
            let options = ReadOptions { plane: true, ..ReadOptions::survey() };
            let cloud = points::read_with(path, &options, observer)?;
            let points = cloud.position.iter().map(|p| turned(p.x, p.y, cloud.named_axes));
            Ok((points.collect(), cloud.reference))
        }
        _ => Err(IoError::UnknownExtension { path: path.into(), known: ".xml, .dxf, .csv, .txt" }),
    }
}
