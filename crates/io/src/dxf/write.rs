//! Writes DXF (AutoCAD R12, which every CAD program reads): one BLOCK of faces per type, one INSERT per unit, sections as 3D
//! polylines.
//!
//! An INSERT turns its block about the extrusion direction only, so that a general rotation is written as that
//! direction plus an angle, by the format's arbitrary-axis rule.

use super::arbitrary_axes;
use crate::drawing::{Drawing, Source};
use crate::{IoError, atomic};
use geom::{DQuat, DVec3};
use std::fmt::Write as _;
use std::path::Path;

/// Writes the drawing in site coordinates, metres.
pub fn write(path: &Path, drawing: &Drawing) -> Result<(), IoError> {
    atomic::write_bytes(path, text(drawing).as_bytes())
}

/// The file's text.
pub fn text(drawing: &Drawing) -> String {
    let mut out = Groups(String::new());
    out.header(drawing);
    out.tables(drawing);
    out.blocks(drawing);
    out.entities(drawing);
    out.pair(0, "EOF");
    out.0
}

struct Groups(String);

impl Groups {
    fn pair(&mut self, code: u16, value: impl std::fmt::Display) {
        writeln!(self.0, "{code}\n{value}").expect("a string takes every character");
    }

    fn point(&mut self, first: u16, p: DVec3) {
        self.pair(first, p.x);
        self.pair(first + 10, p.y);
        self.pair(first + 20, p.z);
    }

    fn section(&mut self, name: &str) {
        self.pair(0, "SECTION");
        self.pair(2, name);
    }

    fn header(&mut self, drawing: &Drawing) {
        let [mut low, mut high] = [DVec3::MAX, DVec3::MIN];
        for unit in drawing.units() {
            let (centre, reach) =
                (drawing.centre(&unit), f64::from(drawing.catalog.get(unit.model).d_max_m));
            (low, high) = (low.min(centre - reach), high.max(centre + reach));
        }
        if low.x > high.x {
            [low, high] = [DVec3::from_array(drawing.frame.origin); 2];
        }
        self.section("HEADER");
        self.pair(9, "$ACADVER");
        self.pair(1, "AC1009");
        self.pair(9, "$EXTMIN");
        self.point(10, low);
        self.pair(9, "$EXTMAX");
        self.point(10, high);
        self.pair(0, "ENDSEC");
    }

    fn tables(&mut self, drawing: &Drawing) {
        self.section("TABLES");
        self.pair(0, "TABLE");
        self.pair(2, "LTYPE");
        self.pair(70, 1);
        self.pair(0, "LTYPE");
        self.pair(2, "CONTINUOUS");
        self.pair(70, 0);
        self.pair(3, "Solid line");
        self.pair(72, 65);
        self.pair(73, 0);
        self.pair(40, "0.0");
        self.pair(0, "ENDTAB");
        let mut layers: Vec<(String, u8)> = vec![("RECOGNISED".into(), 8), ("PLANNED".into(), 4)];
        for line in drawing.sections {
            let layer = section_layer(&line.surface);
            if layers.iter().all(|(name, _)| *name != layer) {
                layers.push((layer, 2));
            }
        }
        self.pair(0, "TABLE");
        self.pair(2, "LAYER");
        self.pair(70, layers.len());
        for (name, colour) in layers {
            self.pair(0, "LAYER");
            self.pair(2, name);
            self.pair(70, 0);
            self.pair(62, colour);
            self.pair(6, "CONTINUOUS");
        }
        self.pair(0, "ENDTAB");
        self.pair(0, "TABLE");
        self.pair(2, "APPID");
        self.pair(70, 1);
        self.pair(0, "APPID");
        self.pair(2, "TSUMU");
        self.pair(70, 0);
        self.pair(0, "ENDTAB");
        self.pair(0, "ENDSEC");
    }

    fn blocks(&mut self, drawing: &Drawing) {
        self.section("BLOCKS");
        for (id, model) in drawing.catalog.iter() {
            let name = block_name(id.0, &model.name);
            self.pair(0, "BLOCK");
            self.pair(8, 0);
            self.pair(2, &name);
            self.pair(70, 0);
            self.point(10, DVec3::ZERO);
            self.pair(3, &name);
            for t in 0..model.mesh.triangles.len() {
                let [a, b, c] = model.mesh.corners(t).map(|v| v.as_dvec3());
                self.pair(0, "3DFACE");
                self.pair(8, 0); // takes the layer of the INSERT
                for (i, p) in [a, b, c, c].into_iter().enumerate() {
                    self.point(10 + i as u16, p);
                }
            }
            self.pair(0, "ENDBLK");
            self.pair(8, 0);
        }
        self.pair(0, "ENDSEC");
    }

    fn entities(&mut self, drawing: &Drawing) {
        self.section("ENTITIES");
        for unit in drawing.units() {
            let model = drawing.catalog.get(unit.model);
            let (normal, angle_rad) = extrusion(unit.pose.rotation.as_dquat().normalize());
            let [ax, ay] = arbitrary_axes(normal);
            let at = drawing.frame.site_from_local(unit.pose.translation);
            self.pair(0, "INSERT");
            self.pair(8, unit.layer().to_uppercase());
            self.pair(2, block_name(unit.model.0, &model.name));
            // The insertion point is in the axes that belong to the extrusion direction.
            self.point(10, DVec3::new(at.dot(ax), at.dot(ay), at.dot(normal)));
            self.pair(50, angle_rad.to_degrees());
            self.point(210, normal);
            self.pair(1001, "TSUMU");
            self.pair(1000, unit.label());
            if let Source::Planned(p) = unit.source {
                self.pair(1000, format!("order {} round {}", p.order, p.round));
            }
        }
        for line in drawing.sections {
            let layer = section_layer(&line.surface);
            self.pair(0, "POLYLINE");
            self.pair(8, &layer);
            self.pair(66, 1);
            self.point(10, DVec3::ZERO);
            self.pair(70, 8); // a polyline in space
            for p in &line.points {
                self.pair(0, "VERTEX");
                self.pair(8, &layer);
                self.point(10, DVec3::from_array(*p));
                self.pair(70, 32);
            }
            self.pair(0, "SEQEND");
            self.pair(8, &layer);
        }
        self.pair(0, "ENDSEC");
    }
}

/// R12 names: capitals, digits, `_`, `-`; the number in front keeps them apart.
fn block_name(id: u16, name: &str) -> String {
    let plain =
        |c: char| if c.is_ascii_alphanumeric() || c == '-' { c.to_ascii_uppercase() } else { '_' };
    let name: String = name.chars().map(plain).take(24).collect();
    format!("B{}_{name}", id + 1)
}

fn section_layer(surface: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    format!("SECTION_{}", surface.chars().map(plain).take(20).collect::<String>())
}

/// The rotation as extrusion direction and angle about it.
fn extrusion(rotation: DQuat) -> (DVec3, f64) {
    let normal = (rotation * DVec3::Z).normalize();
    let [ax, ay] = arbitrary_axes(normal);
    let x = rotation * DVec3::X;
    (normal, x.dot(ay).atan2(x.dot(ax)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrusion_and_angle_give_the_rotation_back() {
        for i in 0..200 {
            let t = f64::from(i);
            let axis = DVec3::new(t.sin(), (t * 1.7).cos(), (t * 0.3).sin() + 0.01).normalize();
            let rotation = DQuat::from_axis_angle(axis, t * 0.41);
            let (normal, angle) = extrusion(rotation);
            let [ax, ay] = arbitrary_axes(normal);
            let x = ax * angle.cos() + ay * angle.sin();
            assert!((x - rotation * DVec3::X).length() < 1e-12);
            assert!((normal.cross(x) - rotation * DVec3::Y).length() < 1e-12);
        }
    }
}
