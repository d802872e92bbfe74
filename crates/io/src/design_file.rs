//! A design surface from another program: LandXML (.xml), GeoTIFF (.tif), DXF with faces (.dxf).

use crate::crs::{self, FileCrs, Unit};
use crate::input::Input;
use crate::mesh::extension;
use crate::tin::Tin;
use crate::{IoError, Place, dxf, geotiff, landxml};
use geom::{Event, Observer, Stage};
use scene::{AxisOrder, DesignSurface};
use std::path::Path;

/// A design and what its file says of it.
#[derive(Clone, Debug)]
pub struct DesignRead {
    /// The surface, metres.
    pub surface: DesignSurface,
    /// What the file says of its coordinates. Units that were converted are no longer named.
    pub reference: FileCrs,
    /// Surface of a LandXML, layers of a DXF, as far as the file names them.
    pub taken: String,
    /// What was left out or converted.
    pub notes: Vec<String>,
}

/// What the site says of a design file.
#[derive(Clone, Copy, Debug)]
pub struct DesignOptions<'a> {
    /// Spacing at which triangles are sampled, metres; a GeoTIFF keeps its own cells.
    pub cell_m: f64,
    /// How the columns of a DXF run; LandXML (north first) and GeoTIFF (east first) have their own rule.
    pub axis_order: AxisOrder,
    /// The surface of a LandXML, or the layer of a DXF.
    pub surface: Option<&'a str>,
    /// Unit of a DXF, where the site knows better than the file.
    pub unit: Option<scene::LengthUnit>,
}

/// Reads the surface with what is known of its file.
pub fn read(
    path: &Path,
    cell_m: f64,
    axis_order: AxisOrder,
    observer: &dyn Observer,
) -> Result<DesignSurface, IoError> {
    let options = DesignOptions { cell_m, axis_order, surface: None, unit: None };
    read_with(path, &options, observer).map(|d| d.surface)
}

/// The same with everything the site says, and everything the file says.
pub fn read_with(
    path: &Path,
    options: &DesignOptions,
    observer: &dyn Observer,
) -> Result<DesignRead, IoError> {
    let kind = extension(path);
    if !matches!(kind.as_str(), "xml" | "landxml" | "tif" | "tiff" | "dxf") {
        return Err(IoError::UnknownExtension { path: path.into(), known: ".xml, .tif, .dxf" });
    }
    let mut input = Input::open(path)?;
    let read = match kind.as_str() {
        "tif" | "tiff" => of_geotiff(&mut input)?,
        "dxf" => of_dxf(&mut input, options)?,
        _ => of_landxml(&mut input, options)?,
    };
    let name = path.display();
    read.surface.check().map_err(|e| IoError::malformed(path, Place::File, e.to_string()))?;
    for note in &read.notes {
        observer.event(Event::Noted { stage: Stage::Read, message: format!("{name}: {note}") });
    }
    let [low, high] = read.surface.extent();
    let message = format!(
        "{name}: design from ({:.1}, {:.1}) to ({:.1}, {:.1})",
        low[0], low[1], high[0], high[1]
    );
    observer.event(Event::Noted { stage: Stage::Read, message });
    Ok(read)
}

fn of_geotiff(input: &mut Input) -> Result<DesignRead, IoError> {
    if masked_beside(input.path) {
        return Err(crate::geotiff_band::masked(input.path));
    }
    let image = geotiff::read_heights(input)?;
    let mut notes = Vec::new();
    if let Some(unit) = &image.converted_from {
        notes.push(format!("heights in the {unit} were turned into metres"));
    }
    if image.raster.value.iter().all(|v| v.is_nan()) {
        return Err(input.malformed(Place::File, "no cell of the image holds a height"));
    }
    let (surface, taken) = (image.raster.design(), String::new());
    let stated = crs::or_beside(input.path, of_side_file(input.path, image.reference));
    let reference = FileCrs { vertical_unit: None, ..stated };
    Ok(DesignRead { surface, reference, taken, notes })
}

/// GDAL can keep the system of an image without keys in a file beside it.
fn of_side_file(path: &Path, own: FileCrs) -> FileCrs {
    if !own.is_unstated() {
        return own;
    }
    let mut name = path.as_os_str().to_owned();
    name.push(".aux.xml");
    let text = crate::input::read_text(Path::new(&name), 1 << 20).unwrap_or_default();
    let document = roxmltree::Document::parse(&text).ok();
    let node = document.as_ref().and_then(|d| d.descendants().find(|n| n.has_tag_name("SRS")));
    node.and_then(|n| n.text()).map(crs::of_text).unwrap_or_default()
}

/// GDAL can keep a mask in a file beside the image.
fn masked_beside(path: &Path) -> bool {
    let mut name = path.as_os_str().to_owned();
    name.push(".msk");
    Path::new(&name).exists()
}

fn of_dxf(input: &mut Input, options: &DesignOptions) -> Result<DesignRead, IoError> {
    let mut read = dxf::read_surface(input, options.surface)?;
    let stated = options.unit.map(|u| Unit::of_metres(f64::from(u.metres())));
    let unit = stated.clone().or(read.unit).unwrap_or_else(Unit::metre);
    if !unit.is_metre() {
        let whose = if stated.is_some() { "the site says" } else { "$INSUNITS says" };
        read.notes.push(format!(
            "{whose} that the drawing is in the {unit}; it was turned into metres (write `unit = \"m\"` if it is in metres)"
        ));
    }
    let place = |p| options.axis_order.east_north_up(p) * unit.metres;
    let turned: Vec<_> = read.faces.iter().map(|f| f.map(place)).collect();
    let surface = on_grid(input, &Tin::of_faces(&turned), options)?;
    let layers = read.layers.keys().map(|l| format!("`{l}`")).collect::<Vec<_>>().join(", ");
    if read.layers.len() > 1 {
        read.notes.push(format!("the design was taken from the layers {layers}"));
    }
    // What the numbers are in is said by the drawing's unit.
    let beside = crs::or_beside(input.path, FileCrs::default());
    let reference = FileCrs { vertical_unit: None, ..beside };
    Ok(DesignRead { surface, reference, taken: layers, notes: read.notes })
}

fn of_landxml(input: &mut Input, options: &DesignOptions) -> Result<DesignRead, IoError> {
    let read = landxml::read_surface(input, options.surface)?;
    let mut notes = Vec::new();
    let other = |unit: &Option<Unit>| unit.clone().filter(|u| !u.is_metre());
    if let Some(unit) = other(&read.reference.unit).or_else(|| other(&read.reference.vertical_unit))
    {
        notes.push(format!("the file is in the {unit}; it was turned into metres"));
    }
    let surface = on_grid(input, &read.tin, options)?;
    // The code of a system in feet stays wrong for coordinates in metres.
    let of_code = read.reference.horizontal.map(FileCrs::of_code).unwrap_or_default();
    let reference = FileCrs { unit: of_code.unit, vertical_unit: None, ..read.reference };
    Ok(DesignRead { surface, reference, taken: format!("`{}`", read.name), notes })
}

fn on_grid(input: &Input, tin: &Tin, options: &DesignOptions) -> Result<DesignSurface, IoError> {
    tin.on_grid(options.cell_m).map_err(|what| input.malformed(Place::File, what))
}
