//! Designs: what the file's unit, band and drawing mean.

use crate::Heard;
use geom::Silent;
use io::design_file::{self, DesignOptions, DesignRead};
use scene::{AxisOrder, LengthUnit};
use std::io::Cursor;
use std::path::Path;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

fn read(
    name: &str,
    bytes: &[u8],
    surface: Option<&str>,
    unit: Option<LengthUnit>,
) -> Result<(DesignRead, String), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let options = DesignOptions { cell_m: 0.5, axis_order: AxisOrder::EastNorth, surface, unit };
    let heard = Heard::default();
    let read = design_file::read_with(&path, &options, &heard).map_err(|e| e.to_string())?;
    Ok((read, heard.all()))
}

fn level(read: &DesignRead) -> Option<f64> {
    read.surface.level_at(41_252.0, -98_760.0)
}

/// A GeoTIFF of 8 × 8 cells of 1 m around the heap.
struct Tiff {
    nodata: Option<&'static str>,
    metadata: Option<&'static str>,
    keys: Vec<u16>,
    white_is_zero: bool,
}

impl Tiff {
    fn plain() -> Self {
        Self {
            nodata: None,
            metadata: None,
            keys: vec![1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 6679],
            white_is_zero: false,
        }
    }

    fn bytes<C: colortype::ColorType>(&self, values: &[C::Inner]) -> Vec<u8>
    where
        [C::Inner]: tiff::encoder::TiffValue,
    {
        let mut out = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut out).unwrap();
        let mut image = encoder.new_image::<C>(8, 8).unwrap();
        let tags = image.encoder();
        tags.write_tag(Tag::ModelPixelScaleTag, &[1.0, 1.0, 0.0][..]).unwrap();
        tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 41_246.0, -98_756.0, 0.0][..])
            .unwrap();
        tags.write_tag(Tag::GeoKeyDirectoryTag, &self.keys[..]).unwrap();
        if let Some(text) = self.nodata {
            tags.write_tag(Tag::GdalNodata, text).unwrap();
        }
        if let Some(text) = self.metadata {
            tags.write_tag(Tag::Unknown(42112), text).unwrap();
        }
        if self.white_is_zero {
            tags.write_tag(Tag::PhotometricInterpretation, 0_u16).unwrap();
        }
        image.write_data(values).unwrap();
        out.into_inner()
    }
}

#[test]
fn crs_of_zone_9_tif() {
    let tiff = Tiff { keys: vec![1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 6677], ..Tiff::plain() };
    let (design, _) =
        read("a.tif", &tiff.bytes::<colortype::Gray32Float>(&[3.4; 64]), None, None).unwrap();
    let said = io::crs::disagreements("EPSG:6679", &[("a.tif".into(), design.reference)]);
    assert!(said[0].to_string().contains("6677") && said[0].to_string().contains("6679"));
}

#[test]
fn int16_scale_0_01() {
    let tiff = Tiff {
        metadata: Some(
            "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.01</Item><Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1</Item></GDALMetadata>",
        ),
        nodata: Some("-32768"),
        ..Tiff::plain()
    };
    let mut values = [240_i16; 64];
    values[0] = -32768;
    let (design, _) =
        read("a.tif", &tiff.bytes::<colortype::GrayI16>(&values), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-5);
    assert_eq!(design.surface.level_at(41_246.6, -98_756.6), None);
    let feet = Tiff {
        metadata: Some(
            "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>",
        ),
        ..Tiff::plain()
    };
    let (design, said) =
        read("a.tif", &feet.bytes::<colortype::Gray32Float>(&[10.0; 64]), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.048).abs() < 1e-5 && said.contains("international foot"));
}

#[test]
fn nodata_minus_9999_9() {
    for (text, value) in [
        ("-9999.9", -9999.9_f32),
        ("-3.4028234663852886e+38", f32::MIN),
        ("nan", f32::NAN),
        (" -9999 ", -9999.0),
    ] {
        let tiff = Tiff { nodata: Some(text), ..Tiff::plain() };
        let mut values = [3.4_f32; 64];
        values[..16].fill(value);
        let (design, _) =
            read("a.tif", &tiff.bytes::<colortype::Gray32Float>(&values), None, None).unwrap();
        assert_eq!(design.surface.level_at(41_250.0, -98_757.5), None, "{text}");
        assert!((level(&design).unwrap() - 3.4).abs() < 1e-5, "{text}");
        let empty = tiff.bytes::<colortype::Gray32Float>(&[value; 64]);
        assert!(read("a.tif", &empty, None, None).unwrap_err().contains("no cell"), "{text}");
    }
}

#[test]
fn colours_and_masks_are_refused() {
    let error =
        read("a.tif", &Tiff::plain().bytes::<colortype::RGB8>(&[3; 192]), None, None).unwrap_err();
    assert!(error.contains("bands"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    std::fs::write(&path, Tiff::plain().bytes::<colortype::Gray32Float>(&[3.4; 64])).unwrap();
    std::fs::write(folder.path().join("a.tif.msk"), b"mask").unwrap();
    let error =
        design_file::read(&path, 0.5, AxisOrder::EastNorth, &Silent).unwrap_err().to_string();
    assert!(error.contains("mask"), "{error}");
}

fn landxml(unit: &str, surfaces: &[(&str, f64)]) -> String {
    let surface = |(name, z): &(&str, f64)| {
        let corners = [(0, 0), (0, 8), (8, 8), (8, 0)];
        let metre = if unit.contains("millimeter") { 1000.0 } else { 1.0 };
        let points: String = corners
            .iter()
            .enumerate()
            .map(|(i, (n, e))| {
                let place =
                    [-98_764.0 + f64::from(*n), 41_246.0 + f64::from(*e), *z].map(|v| v * metre);
                format!("<P id=\"{i}\">{} {} {}</P>", place[0], place[1], place[2])
            })
            .collect();
        format!(
            "<Surface name=\"{name}\"><Definition surfType=\"TIN\"><Pnts>{points}</Pnts><Faces><F>0 1 2</F><F>0 2 3</F></Faces></Definition></Surface>"
        )
    };
    let all: String = surfaces.iter().map(surface).collect();
    format!(
        "<LandXML><Units><Metric {unit}/></Units><CoordinateSystem epsgCode=\"6679\"/><Surfaces>{all}</Surfaces></LandXML>"
    )
}

#[test]
fn existing_ground_first() {
    let file = landxml("linearUnit=\"meter\"", &[("EG", 1.2), ("FG", 3.4)]);
    let error = read("a.xml", file.as_bytes(), None, None).unwrap_err();
    assert!(
        error.contains("`EG`") && error.contains("`FG`") && error.contains("surface ="),
        "{error}"
    );
    let (design, _) = read("a.xml", file.as_bytes(), Some("FG"), None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
    assert_eq!(design.reference.horizontal, Some(6679));
}

#[test]
fn linear_unit_millimeter() {
    let file = landxml("linearUnit=\"millimeter\"", &[("FG", 3.4)]);
    let (design, said) = read("a.xml", file.as_bytes(), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
    assert!(said.contains("millimetre"), "{said}");
    assert!(io::crs::disagreements("EPSG:6679", &[("a.xml".into(), design.reference)]).is_empty());
}

fn quad(layer: &str, z: f64, metre: f64) -> String {
    let corners = [
        (41_246.0, -98_764.0),
        (41_254.0, -98_764.0),
        (41_254.0, -98_756.0),
        (41_246.0, -98_756.0),
    ];
    let groups: String = corners
        .iter()
        .enumerate()
        .map(|(i, (x, y))| {
            format!(
                "{}\n{}\n{}\n{}\n{}\n{}\n",
                10 + i,
                x * metre,
                20 + i,
                y * metre,
                30 + i,
                z * metre
            )
        })
        .collect();
    format!("0\n3DFACE\n8\n{layer}\n{groups}")
}

fn dxf(units: u32, layers: &str, blocks: &str, model: &str) -> String {
    format!(
        "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{units}\n0\nENDSEC\n0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n{layers}0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{model}0\nENDSEC\n0\nEOF\n"
    )
}

#[test]
fn unused_block() {
    let block =
        format!("0\nBLOCK\n8\n0\n2\nOLD\n10\n0\n20\n0\n30\n0\n{}0\nENDBLK\n", quad("0", 5.5, 1.0));
    let (design, _) =
        read("a.dxf", dxf(6, "", &block, &quad("FG", 3.4, 1.0)).as_bytes(), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
    // Inserted it counts.
    let model = quad("FG", 3.4, 1.0) + "0\nINSERT\n8\n0\n2\nOLD\n10\n0\n20\n0\n30\n0\n";
    let (design, _) = read("a.dxf", dxf(6, "", &block, &model).as_bytes(), None, None).unwrap();
    assert!((level(&design).unwrap() - 5.5).abs() < 1e-9);
}

#[test]
fn layer_off() {
    let layers = "0\nLAYER\n2\nREV_A\n70\n0\n62\n-7\n0\nLAYER\n2\nREV_B\n70\n0\n62\n7\n";
    let model = quad("REV_A", 5.0, 1.0) + &quad("REV_B", 3.4, 1.0);
    let (design, said) = read("a.dxf", dxf(6, layers, "", &model).as_bytes(), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
    assert!(said.contains("REV_A"), "{said}");
    let (design, _) =
        read("a.dxf", dxf(6, layers, "", &model).as_bytes(), Some("REV_A"), None).unwrap();
    assert!((level(&design).unwrap() - 5.0).abs() < 1e-9);
}

#[test]
fn drawing_units_are_obeyed() {
    let (design, said) =
        read("a.dxf", dxf(4, "", "", &quad("FG", 3.4, 1000.0)).as_bytes(), None, None).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
    assert!(said.contains("millimetre") && said.contains("unit ="), "{said}");
    // The site may know better.
    let metres = dxf(4, "", "", &quad("FG", 3.4, 1.0));
    let (design, _) = read("a.dxf", metres.as_bytes(), None, Some(LengthUnit::M)).unwrap();
    assert!((level(&design).unwrap() - 3.4).abs() < 1e-9);
}

#[test]
fn alignments_come_from_three_formats() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let xml = put(
        "a.xml",
        "<LandXML><Alignments><Alignment name=\"CL\"><CoordGeom><Line><Start>-98764 41246</Start><End>-98764 41254</End></Line></CoordGeom></Alignment></Alignments></LandXML>",
    );
    let line = "0\nLWPOLYLINE\n8\nCL\n90\n2\n70\n0\n10\n41246\n20\n-98764\n10\n41254\n20\n-98764\n";
    let drawing = put("a.dxf", &dxf(6, "", "", line));
    let table = put("a.csv", "北,東\n-98764,41246\n-98764,41254\n");
    for path in [&xml, &drawing, &table] {
        let (points, _) =
            io::alignment_file::read(Path::new(path), None, AxisOrder::EastNorth, &Silent)
                .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(points, [[41_246.0, -98_764.0], [41_254.0, -98_764.0]], "{}", path.display());
    }
}
