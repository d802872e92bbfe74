//! The letters of the sheets.
//!
//! A Japanese font found on the machine is embedded, cut down to the letters used. Without one, Latin letters are
//! Helvetica and Japanese ones the standard `HeiseiKakuGo-W5`, both named and not embedded: every viewer has them or a
//! stand-in, and the file's bytes then depend on no machine.

use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeMap;
use subsetter::GlyphRemapper;

/// A font file to embed: its bytes and which font of a collection.
#[derive(Clone, Debug)]
pub struct SheetFont {
    /// The file, TrueType or OpenType, or a collection of them.
    pub data: Vec<u8>,
    /// Which font of a collection; 0 otherwise.
    pub index: u32,
}

/// Letters of one font, ready to be shown.
pub(crate) struct Run {
    pub font: &'static [u8],
    pub codes: Vec<u8>,
    /// In heights of the letters.
    pub width: f32,
}

/// What the sheets are written with.
pub(crate) enum Font {
    /// Everything in one embedded font.
    Embedded(Box<Embedded>),
    /// Named fonts only.
    Standard,
}

pub(crate) struct Embedded {
    source: SheetFont,
    face: ttf_parser::Face<'static>,
    remapper: GlyphRemapper,
    /// What each glyph of the cut-down font says, and how wide it is.
    seen: BTreeMap<u16, (char, f32)>,
}

const LATIN: &[u8] = b"F1";
const JAPANESE: &[u8] = b"F2";

impl Font {
    /// The font of a file, or the standard ones where there is none or it has no Japanese.
    pub fn new(source: Option<&SheetFont>) -> Self {
        let Some(source) = source else { return Self::Standard };
        // The face borrows from bytes that live as long as the program draws: a leak of one font a process.
        let bytes: &'static [u8] = Box::leak(source.data.clone().into_boxed_slice());
        match ttf_parser::Face::parse(bytes, source.index) {
            Ok(face) if face.glyph_index('工').is_some() && face.glyph_index('A').is_some() => {
                let (remapper, seen) = (GlyphRemapper::new(), BTreeMap::new());
                Self::Embedded(Box::new(Embedded { source: source.clone(), face, remapper, seen }))
            }
            _ => Self::Standard,
        }
    }
}
