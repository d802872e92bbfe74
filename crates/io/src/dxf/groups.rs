//! The pairs of lines a DXF is made of.

use geom::DVec3;
use std::fmt::Write as _;

/// A DXF under construction. Text is ASCII: what is not is written as `\U+XXXX`, control characters as blanks.
#[derive(Default)]
pub(crate) struct Groups(pub String);

impl Groups {
    pub fn pair(&mut self, code: u16, value: impl std::fmt::Display) {
        writeln!(self.0, "{code}\n{value}").expect("a string takes every character");
    }

    pub fn point(&mut self, first: u16, p: DVec3) {
        self.pair(first, p.x);
        self.pair(first + 10, p.y);
        self.pair(first + 20, p.z);
    }

    pub fn section(&mut self, name: &str) {
        self.pair(0, "SECTION");
        self.pair(2, name);
    }

    pub fn table(&mut self, name: &str, entries: usize) {
        self.pair(0, "TABLE");
        self.pair(2, name);
        self.pair(70, entries);
    }

    pub fn block(&mut self, name: &str) {
        self.pair(0, "BLOCK");
        self.pair(8, 0);
        self.pair(2, name);
        self.pair(70, if name == "NUMBER" { 2 } else { 0 });
        self.point(10, DVec3::ZERO);
        self.pair(3, name);
    }

    pub fn end_block(&mut self) {
        self.pair(0, "ENDBLK");
        self.pair(8, 0);
    }

    /// A text value, group 1.
    pub fn words(&mut self, text: &str) {
        let mut safe = String::new();
        for c in text.chars() {
            match c {
                c if c.is_control() => safe.push(' '),
                ' '..='~' => safe.push(c),
                c => c.encode_utf16(&mut [0; 2]).iter().for_each(|u| {
                    write!(safe, "\\U+{u:04X}").expect("a string takes every character")
                }),
            }
        }
        self.pair(1, safe);
    }

    /// Letters of a height; `align` 0 left, 1 middle, 2 right.
    pub fn text(
        &mut self,
        layer: &str,
        at: DVec3,
        high_m: f64,
        turn_rad: f64,
        align: u8,
        text: &str,
    ) {
        self.pair(0, "TEXT");
        self.pair(8, layer);
        self.point(10, at);
        self.pair(40, high_m);
        self.words(text);
        self.pair(50, turn_rad.to_degrees());
        self.pair(72, align);
        if align > 0 {
            self.point(11, at);
        }
    }

    pub fn line(&mut self, layer: &str, a: DVec3, b: DVec3) {
        self.pair(0, "LINE");
        self.pair(8, layer);
        self.point(10, a);
        self.point(11, b);
    }

    /// A polyline in space.
    pub fn polyline(&mut self, layer: &str, points: &[DVec3], closed: bool) {
        self.pair(0, "POLYLINE");
        self.pair(8, layer);
        self.pair(66, 1);
        self.point(10, DVec3::ZERO);
        self.pair(70, if closed { 9 } else { 8 });
        for p in points {
            self.pair(0, "VERTEX");
            self.pair(8, layer);
            self.point(10, *p);
            self.pair(70, 32);
        }
        self.pair(0, "SEQEND");
        self.pair(8, layer);
    }
}
