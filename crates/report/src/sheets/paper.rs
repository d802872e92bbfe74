//! One sheet of paper: millimetres from the lower left corner, lines, polygons and words.

use super::font::Font;
use crate::Text;
use crate::colour::Rgb;
use pdf_writer::types::LineCapStyle;
use pdf_writer::{Content, Name, Str};

/// Points of PDF in a millimetre.
const MM: f32 = 72.0 / 25.4;

/// A3, landscape, millimetres: what Japanese port offices draw on. An A4 print is the same sheet at 71 %.
pub(crate) const WIDTH_MM: f32 = 420.0;
/// See [`WIDTH_MM`].
pub(crate) const HEIGHT_MM: f32 = 297.0;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    pub width_mm: f32,
    pub colour: Rgb,
    /// On and off, millimetres; both 0: solid.
    pub dash_mm: [f32; 2],
}

impl Pen {
    pub const fn solid(width_mm: f32, colour: Rgb) -> Self {
        Self { width_mm, colour, dash_mm: [0.0, 0.0] }
    }
}

/// Where words stand against their point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Middle,
    Right,
}

/// A sheet under construction.
pub(crate) struct Paper<'a> {
    content: Content,
    font: &'a mut Font,
}

impl<'a> Paper<'a> {
    pub fn new(font: &'a mut Font) -> Self {
        let mut content = Content::new();
        content.set_line_cap(LineCapStyle::RoundCap);
        Self { content, font }
    }

    /// The content stream.
    pub fn finish(self) -> Vec<u8> {
        self.content.finish().into_vec()
    }

    fn stroke_with(&mut self, pen: Pen) {
        let [r, g, b] = shares(pen.colour);
        self.content.set_stroke_rgb(r, g, b).set_line_width(pen.width_mm * MM);
        let dash = if pen.dash_mm[0] > 0.0 { pen.dash_mm.map(|d| d * MM).to_vec() } else { vec![] };
        self.content.set_dash_pattern(dash, 0.0);
    }

    fn trace(&mut self, points: &[[f32; 2]]) {
        for (i, [x, y]) in points.iter().enumerate() {
            let (x, y) = (x * MM, y * MM);
            if i == 0 {
                self.content.move_to(x, y)
            } else {
                self.content.line_to(x, y)
            };
        }
    }

    /// A broken line.
    pub fn line(&mut self, points: &[[f32; 2]], pen: Pen) {
        if points.len() > 1 {
            self.stroke_with(pen);
            self.trace(points);
            self.content.stroke();
        }
    }

    /// Closed rings, holes by even-odd; filled, outlined, or both.
    pub fn rings(&mut self, rings: &[Vec<[f32; 2]>], fill: Option<Rgb>, pen: Option<Pen>) {
        if rings.is_empty() {
            return;
        }
        if let Some(colour) = fill {
            let [r, g, b] = shares(colour);
            self.content.set_fill_rgb(r, g, b);
        }
        if let Some(pen) = pen {
            self.stroke_with(pen);
        }
        for ring in rings {
            self.trace(ring);
            self.content.close_path();
        }
        match (fill, pen) {
            (Some(_), Some(_)) => self.content.fill_even_odd_and_stroke(),
            (Some(_), None) => self.content.fill_even_odd(),
            (None, Some(_)) => self.content.stroke(),
            (None, None) => self.content.end_path(),
        };
    }

    /// A rectangle from its lower left corner.
    pub fn rect(&mut self, at: [f32; 2], size: [f32; 2], fill: Option<Rgb>, pen: Option<Pen>) {
        let [[x, y], [w, h]] = [at, size];
        self.rings(&[vec![[x, y], [x + w, y], [x + w, y + h], [x, y + h]]], fill, pen);
    }

    /// What follows is drawn inside this rectangle only, until [`Self::unclip`].
    pub fn clip(&mut self, at: [f32; 2], size: [f32; 2]) {
        self.content.save_state();
        self.content.rect(at[0] * MM, at[1] * MM, size[0] * MM, size[1] * MM);
        self.content.clip_nonzero().end_path();
    }

    /// Ends [`Self::clip`].
    pub fn unclip(&mut self) {
        self.content.restore_state();
    }

    /// Words of a height in millimetres; returns their width.
    pub fn words(&mut self, at: [f32; 2], size_mm: f32, align: Align, text: &str, ink: Rgb) -> f32 {
        let runs = self.font.runs(text);
        let width_mm = runs.iter().map(|r| r.width).sum::<f32>() * size_mm;
        let x = match align {
            Align::Left => at[0],
            Align::Middle => at[0] - width_mm / 2.0,
            Align::Right => at[0] - width_mm,
        };
        let [r, g, b] = shares(ink);
        self.content.set_fill_rgb(r, g, b).begin_text();
        self.content.next_line(x * MM, at[1] * MM);
        for run in runs {
            self.content.set_font(Name(run.font), size_mm * MM).show(Str(&run.codes));
        }
        self.content.end_text();
        width_mm
    }

    /// Width of a text, in heights of its letters.
    pub fn width(&mut self, text: &str) -> f32 {
        self.font.width(text)
    }

    /// Both languages, Japanese first, as labels on drawings stand.
    pub fn label(
        &mut self,
        at: [f32; 2],
        size_mm: f32,
        align: Align,
        text: &Text,
        ink: Rgb,
    ) -> f32 {
        self.words(at, size_mm, align, &both(text), ink)
    }

    /// A sentence on lines of a width, from its first base line down; returns where the next line would stand.
    pub fn paragraph(
        &mut self,
        at: [f32; 2],
        size_mm: f32,
        width_mm: f32,
        text: &str,
        ink: Rgb,
    ) -> f32 {
        let (mut line, mut y) = (String::new(), at[1]);
        for word in words_of(text) {
            let longer = format!("{line}{word}");
            if !line.is_empty() && self.font.width(longer.trim_end()) * size_mm > width_mm {
                self.words([at[0], y], size_mm, Align::Left, line.trim_end(), ink);
                y -= size_mm * 1.6;
                line = word.trim_start().to_string();
            } else {
                line = longer;
            }
        }
        if !line.trim().is_empty() {
            self.words([at[0], y], size_mm, Align::Left, line.trim_end(), ink);
            y -= size_mm * 1.6;
        }
        y
    }
}

/// Where a line may break: behind a blank, and between any two characters that are not ASCII.
fn words_of(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for c in text.chars() {
        let new = words.last().and_then(|w| w.chars().last()).is_none_or(|last| {
            last == ' ' || (!c.is_ascii() && !"、。，．）」・".contains(c)) || !last.is_ascii()
        });
        match words.last_mut().filter(|_| !new) {
            Some(word) => word.push(c),
            None => words.push(c.to_string()),
        }
    }
    words
}

pub(crate) fn both(text: &Text) -> String {
    if text.ja.is_empty() || text.ja == text.en {
        text.en.clone()
    } else {
        format!("{} {}", text.ja, text.en)
    }
}

fn shares(colour: Rgb) -> [f32; 3] {
    colour.map(|c| f32::from(c) / 255.0)
}
