//! IFC 4.3 (STEP): a breakwater whose armour units are mapped items of their type, in a projected CRS.

use crate::details::Details;
use crate::drawing::{Drawing, Source, Unit};
use crate::{IoError, atomic};
use scene::BlockModel;
use std::fmt::Write as _;
use std::path::Path;

/// Writes the model.
pub fn write(path: &Path, drawing: &Drawing) -> Result<(), IoError> {
    write_with(path, drawing, &Details::default())
}

/// Writes the model with the day of the survey.
pub fn write_with(path: &Path, drawing: &Drawing, details: &Details) -> Result<(), IoError> {
    atomic::write_bytes(path, document(drawing, details).as_bytes())
}

/// The file's text.
pub fn text(drawing: &Drawing) -> String {
    document(drawing, &Details::default())
}

/// The date is that of the survey: the same result gives the same bytes.
fn document(drawing: &Drawing, details: &Details) -> String {
    let mut step = Step { out: String::new(), next: 1 };
    step.raw("ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');");
    let version = concat!("tsumu ", env!("CARGO_PKG_VERSION"));
    step.raw(&format!(
        "FILE_NAME({},'{}T00:00:00',(''),(''),'{version}','{version}','');",
        string(drawing.name),
        details.date()
    ));
    step.raw("FILE_SCHEMA(('IFC4X3_ADD2'));\nENDSEC;\nDATA;");
    model(&mut step, drawing);
    step.raw("ENDSEC;\nEND-ISO-10303-21;");
    step.out
}

/// Numbers the instances.
struct Step {
    out: String,
    next: usize,
}

impl Step {
    fn raw(&mut self, line: &str) {
        self.out.push_str(line);
        self.out.push('\n');
    }

    /// Adds an instance and returns its name, `#n`.
    fn add(&mut self, entity: std::fmt::Arguments) -> String {
        let name = format!("#{}", self.next);
        self.next += 1;
        writeln!(self.out, "{name}={entity};").expect("a string takes every character");
        name
    }
}

macro_rules! add {
    ($step:expr, $($entity:tt)*) => { $step.add(format_args!($($entity)*)) };
}

fn model(s: &mut Step, drawing: &Drawing) {
    let id = |what: &str| guid(drawing.name, what);
    let name = string(drawing.name);
    let metre = add!(s, "IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)");
    let area = add!(s, "IFCSIUNIT(*,.AREAUNIT.,$,.SQUARE_METRE.)");
    let volume = add!(s, "IFCSIUNIT(*,.VOLUMEUNIT.,$,.CUBIC_METRE.)");
    let radian = add!(s, "IFCSIUNIT(*,.PLANEANGLEUNIT.,$,.RADIAN.)");
    let mass = add!(s, "IFCSIUNIT(*,.MASSUNIT.,.KILO.,.GRAM.)");
    let units = add!(s, "IFCUNITASSIGNMENT(({metre},{area},{volume},{radian},{mass}))");
    let zero = add!(s, "IFCCARTESIANPOINT((0.,0.,0.))");
    let axes = add!(s, "IFCAXIS2PLACEMENT3D({zero},$,$)");
    let context = add!(s, "IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-05,{axes},$)");
    let body = add!(
        s,
        "IFCGEOMETRICREPRESENTATIONSUBCONTEXT('Body','Model',*,*,*,*,{context},$,.MODEL_VIEW.,$)"
    );
    let project = add!(s, "IFCPROJECT({},$,{name},$,$,$,$,({context}),{units})", id("project"));
    if let Some(code) = drawing.epsg() {
        let datum = match drawing.frame.vertical_datum.as_str() {
            "" => "$".to_string(),
            words => string(words),
        };
        let crs = add!(s, "IFCPROJECTEDCRS('EPSG:{code}',$,$,{datum},$,$,{metre})");
        let [east, north, up] = drawing.frame.origin.map(real);
        add!(s, "IFCMAPCONVERSION({context},{crs},{east},{north},{up},1.,0.,1.)");
    }
    let place = add!(s, "IFCLOCALPLACEMENT($,{axes})");
    let site = add!(s, "IFCSITE({},$,{name},$,$,{place},$,$,.ELEMENT.,$,$,$,$,$)", id("site"));
    let place = add!(s, "IFCLOCALPLACEMENT({place},{axes})");
    let works = add!(
        s,
        "IFCMARINEFACILITY({},$,{name},$,$,{place},$,$,.ELEMENT.,.BREAKWATER.)",
        id("breakwater")
    );
    add!(s, "IFCRELAGGREGATES({},$,$,$,{project},({site}))", id("project-site"));
    add!(s, "IFCRELAGGREGATES({},$,$,$,{site},({works}))", id("site-breakwater"));

    let mut elements = Vec::new();
    for (model_id, model) in drawing.catalog.iter() {
        let units: Vec<Unit> = drawing.units().filter(|u| u.model == model_id).collect();
        if units.is_empty() {
            continue;
        }
        let map = representation_map(s, model, &axes, &body);
        let properties = type_properties(s, model, &id(&format!("type properties {}", model.name)));
        let kind = add!(
            s,
            "IFCBUILDINGELEMENTPARTTYPE({},$,{},$,$,{properties},({map}),$,$,.ARMOURUNIT.)",
            id(&format!("type {}", model.name)),
            string(&model.name)
        );
        let made: Vec<String> =
            units.iter().map(|unit| element(s, drawing, unit, &place, &map, &body)).collect();
        add!(
            s,
            "IFCRELDEFINESBYTYPE({},$,$,$,({}),{kind})",
            id(&format!("of type {}", model.name)),
            made.join(",")
        );
        elements.extend(made);
    }
    if !elements.is_empty() {
        let all = elements.join(",");
        let concrete = add!(s, "IFCMATERIAL('Concrete',$,'concrete')");
        add!(s, "IFCRELASSOCIATESMATERIAL({},$,$,$,({all}),{concrete})", id("material"));
        add!(s, "IFCRELCONTAINEDINSPATIALSTRUCTURE({},$,$,$,({all}),{works})", id("contents"));
    }
}

fn representation_map(s: &mut Step, model: &BlockModel, axes: &str, body: &str) -> String {
    let tuple = |values: [f32; 3]| format!("({})", values.map(|v| real(shortest(v))).join(","));
    let points: Vec<String> = model.mesh.vertices.iter().map(|v| tuple(v.to_array())).collect();
    let points = add!(s, "IFCCARTESIANPOINTLIST3D(({}),$)", points.join(","));
    let corner = |t: &[u32; 3]| format!("({},{},{})", t[0] + 1, t[1] + 1, t[2] + 1);
    let faces: Vec<String> = model.mesh.triangles.iter().map(corner).collect();
    let faces = add!(s, "IFCTRIANGULATEDFACESET({points},$,.T.,({}),$)", faces.join(","));
    let shape = add!(s, "IFCSHAPEREPRESENTATION({body},'Body','Tessellation',({faces}))");
    add!(s, "IFCREPRESENTATIONMAP({axes},{shape})")
}

/// Volume, mass and size belong to the type; `($)` is not allowed for an empty set, so there is always one.
fn type_properties(s: &mut Step, model: &BlockModel, id: &str) -> String {
    let volume = property(s, "Volume", "IFCVOLUMEMEASURE", &real(shortest(model.volume_m3)));
    let mass = property(s, "Mass", "IFCMASSMEASURE", &real(shortest(model.mass_kg())));
    let size = property(s, "LargestDimension", "IFCLENGTHMEASURE", &real(shortest(model.d_box_m)));
    let set = add!(s, "IFCPROPERTYSET({id},$,'Tsumu_ArmourUnit',$,({volume},{mass},{size}))");
    format!("({set})")
}

fn element(
    s: &mut Step,
    drawing: &Drawing,
    unit: &Unit,
    parent: &str,
    map: &str,
    body: &str,
) -> String {
    let label = unit.label();
    let id = |what: &str| guid(drawing.name, &format!("{what} {label}"));
    let vector = |v: geom::Vec3| v.to_array().map(|v| real(shortest(v))).join(",");
    let rotation = unit.pose.rotation.normalize();
    let at = add!(s, "IFCCARTESIANPOINT(({}))", vector(unit.pose.translation));
    let z = add!(s, "IFCDIRECTION(({}))", vector(rotation * geom::Vec3::Z));
    let x = add!(s, "IFCDIRECTION(({}))", vector(rotation * geom::Vec3::X));
    let axes = add!(s, "IFCAXIS2PLACEMENT3D({at},{z},{x})");
    let place = add!(s, "IFCLOCALPLACEMENT({parent},{axes})");
    let zero = add!(s, "IFCCARTESIANPOINT((0.,0.,0.))");
    let same = add!(s, "IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,{zero},1.,$)");
    let mapped = add!(s, "IFCMAPPEDITEM({map},{same})");
    let shape = add!(s, "IFCSHAPEREPRESENTATION({body},'Body','MappedRepresentation',({mapped}))");
    let shape = add!(s, "IFCPRODUCTDEFINITIONSHAPE($,$,({shape}))");
    let element = add!(
        s,
        "IFCBUILDINGELEMENTPART({},$,'{label}',$,'{}',{place},{shape},'{label}',.ARMOURUNIT.)",
        id("unit"),
        unit.layer()
    );
    let properties = match unit.source {
        Source::Recognised(_, fit) => [
            ("Confidence", "IFCREAL", fit.confidence),
            ("Occlusion", "IFCREAL", fit.occlusion),
            ("FittingError", "IFCLENGTHMEASURE", fit.fitness_m),
        ]
        .into_iter()
        .filter_map(|(name, kind, value)| Some(property(s, name, kind, &real(shortest(value?)))))
        .collect(),
        Source::Planned(p) => vec![
            property(s, "PlacingOrder", "IFCINTEGER", &p.order.to_string()),
            property(s, "Round", "IFCINTEGER", &p.round.to_string()),
            property(s, "FilledVolume", "IFCVOLUMEMEASURE", &real(shortest(p.filled_m3))),
        ],
    };
    let set = add!(
        s,
        "IFCPROPERTYSET({},$,'Tsumu_Result',$,({}))",
        id("properties"),
        properties.join(",")
    );
    add!(s, "IFCRELDEFINESBYPROPERTIES({},$,$,$,({element}),{set})", id("has properties"));
    element
}

fn property(s: &mut Step, name: &str, kind: &str, value: &str) -> String {
    add!(s, "IFCPROPERTYSINGLEVALUE('{name}',$,{kind}({value}),$)")
}

/// The f64 with the f32's own shortest digits.
fn shortest(v: f32) -> f64 {
    v.to_string().parse().expect("a printed number is a number")
}

/// A STEP real: always with a point, the exponent behind a capital E.
fn real(v: f64) -> String {
    let text = format!("{v:?}").to_uppercase();
    match text.split_once('E') {
        Some((mantissa, exponent)) if !mantissa.contains('.') => format!("{mantissa}.E{exponent}"),
        _ => text,
    }
}

/// A STEP string: quotes doubled, everything beyond ASCII as UTF-16 in hexadecimal.
fn string(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            c if c.is_control() => out.push(' '),
            _ => {
                out.push_str("\\X2\\");
                for unit in c.encode_utf16(&mut [0; 2]) {
                    write!(out, "{unit:04X}").expect("a string takes every character");
                }
                out.push_str("\\X0\\");
            }
        }
    }
    out.push('\'');
    out
}

/// A GlobalId that depends on the names alone: 128 bits of BLAKE3 in IFC's own base 64.
fn guid(site: &str, what: &str) -> String {
    const DIGITS: &[u8; 64] = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$";
    let hash = blake3::hash(format!("{site}\0{what}").as_bytes());
    let bits = u128::from_be_bytes(hash.as_bytes()[..16].try_into().expect("a hash has 32 bytes"));
    // 22 digits of 6 bits hold 132: the first digit carries two.
    let digit = |i: u32| char::from(DIGITS[(bits >> (6 * (21 - i)) & 63) as usize]);
    format!("'{}'", (0..22).map(digit).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_text() {
        assert_eq!(
            [real(1.0), real(-0.5), real(1e-7), real(1.5e21)],
            ["1.0", "-0.5", "1.E-7", "1.5E21"]
        );
        assert_eq!(string("it's 積む"), "'it''s \\X2\\7A4D\\X0\\\\X2\\3080\\X0\\'");
        let id = guid("a", "b");
        assert_eq!(id.len(), 24);
        assert!(id.as_bytes()[1] <= b'3', "the first digit carries two bits");
        assert_ne!(id, guid("a", "c"));
    }
}
