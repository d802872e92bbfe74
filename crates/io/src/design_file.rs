//! A design surface from another program: LandXML (.xml), GeoTIFF (.tif), DXF with 3D faces (.dxf).

use crate::input::Input;
use crate::mesh::extension;
use crate::tin::Tin;
use crate::{IoError, Place, dxf, geotiff, landxml};
use geom::Observer;
use scene::{AxisOrder, DesignSurface};
use std::path::Path;

/// Reads the surface. Triangles are sampled every `cell_m`; a GeoTIFF keeps its own cells. `axis_order` says how the
/// columns of a DXF run; LandXML (north first) and GeoTIFF (east first) have their own rule.
pub fn read(
    path: &Path,
    cell_m: f64,
    axis_order: AxisOrder,
    observer: &dyn Observer,
) -> Result<DesignSurface, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "xml" | "landxml" | "tif" | "tiff" | "dxf") {
        return Err(IoError::UnknownExtension { path: path.into(), known: ".xml, .tif, .dxf" });
    }
    let mut input = Input::open(path)?;
    let surface = match kind.as_str() {
        "tif" | "tiff" => {
            let (raster, _) = geotiff::read(&mut input)?;
            Ok(raster.design())
        }
        "dxf" => {
            let faces = dxf::read_faces(&mut input)?;
            let turned: Vec<_> =
                faces.iter().map(|f| f.map(|p| axis_order.east_north_up(p))).collect();
            Tin::of_faces(&turned).on_grid(cell_m)
        }
        _ => landxml::read(&mut input, None)?.on_grid(cell_m),
    };
    let surface = surface.map_err(|what| IoError::malformed(path, Place::File, what))?;
    surface.check().map_err(|e| IoError::malformed(path, Place::File, e.to_string()))?;
    let [low, high] = surface.extent();
    let message = format!(
        "{}: design from ({:.1}, {:.1}) to ({:.1}, {:.1})",
        path.display(),
        low[0],
        low[1],
        high[0],
        high[1]
    );
    observer.event(geom::Event::Noted { stage: "read", message });
    Ok(surface)
}
