//! The letters of the sheets.
//!
//! A Japanese font found on the machine is embedded, cut down to the letters used. Without one, Latin letters are
//! Helvetica and Japanese ones the standard `HeiseiKakuGo-W5`, both named and not embedded: every viewer has them or a
//! stand-in, and the file's bytes then depend on no machine.

use crate::ReportError;
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeMap;
use subsetter::GlyphRemapper;
use ttf_parser::{Face, RawFace, Tag};

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
    Embedded(Embedded),
    /// Named fonts only.
    Standard,
}

pub(crate) struct Embedded {
    source: SheetFont,
    remapper: GlyphRemapper,
    /// What each glyph of the cut-down font says, and its width in thousandths.
    seen: BTreeMap<u16, (char, f32)>,
    widths: BTreeMap<char, (u16, f32)>,
}

const LATIN: &[u8] = b"F1";
const JAPANESE: &[u8] = b"F2";
const IDENTITY: SystemInfo =
    SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };
/// Widths of Helvetica from the blank to the tilde, thousandths of the height (Adobe's metrics of the standard fonts).
const HELVETICA: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];

impl Font {
    /// The font of a file, or the standard ones where there is none or it has no Japanese.
    pub fn new(source: Option<&SheetFont>) -> Self {
        let whole = |s: &&SheetFont| {
            Face::parse(&s.data, s.index).is_ok_and(|f| {
                ['工', 'A', '図'].iter().all(|c| f.glyph_index(*c).is_some())
                    && f.is_subsetting_allowed()
            })
        };
        match source.filter(whole) {
            Some(source) => Self::Embedded(Embedded {
                source: source.clone(),
                remapper: GlyphRemapper::new(),
                seen: BTreeMap::new(),
                widths: BTreeMap::new(),
            }),
            None => Self::Standard,
        }
    }

    /// Width of a text, in heights of its letters.
    pub fn width(&mut self, text: &str) -> f32 {
        self.runs(text).iter().map(|r| r.width).sum()
    }

    /// The text cut where the font changes. Control characters are left out.
    pub fn runs(&mut self, text: &str) -> Vec<Run> {
        let letters = text.chars().filter(|c| !c.is_control());
        match self {
            Self::Embedded(font) => vec![font.run(letters)],
            Self::Standard => {
                let mut runs: Vec<Run> = Vec::new();
                for c in letters {
                    let (font, code, width) = standard(c);
                    match runs.last_mut().filter(|r| r.font == font) {
                        Some(run) => {
                            run.codes.extend(code);
                            run.width += width;
                        }
                        None => runs.push(Run { font, codes: code, width }),
                    }
                }
                runs
            }
        }
    }

    /// Writes the fonts and names them in a resource dictionary's font list; `next` gives out references.
    pub fn write(
        &self,
        pdf: &mut Pdf,
        next: &mut impl FnMut() -> Ref,
    ) -> Result<Vec<(Name<'static>, Ref)>, ReportError> {
        match self {
            Self::Embedded(font) => Ok(vec![(Name(LATIN), font.write(pdf, next)?)]),
            Self::Standard => {
                Ok(vec![(Name(LATIN), helvetica(pdf, next())), (Name(JAPANESE), heisei(pdf, next))])
            }
        }
    }
}

/// Font, code and width of a letter in the standard fonts.
fn standard(c: char) -> (&'static [u8], Vec<u8>, f32) {
    // What Windows' Latin letters hold beyond ASCII and these sheets use.
    let latin = match c {
        ' '..='~' => Some((c as u8, HELVETICA[c as usize - 32])),
        '–' => Some((0x96, 556)),
        '°' | '±' | '²' | '³' | '·' => {
            Some((c as u32 as u8, if c == '·' { 278 } else { 400 }))
        }
        'à'..='ÿ' | 'À'..='ß' => Some((c as u32 as u8, 556)),
        _ => None,
    };
    match latin {
        Some((code, width)) => (LATIN, vec![code], f32::from(width) / 1000.0),
        None => {
            let code = c.encode_utf16(&mut [0; 2]).iter().flat_map(|u| u.to_be_bytes()).collect();
            (JAPANESE, code, 1.0)
        }
    }
}

fn helvetica(pdf: &mut Pdf, id: Ref) -> Ref {
    let mut font = pdf.type1_font(id);
    font.base_font(Name(b"Helvetica")).encoding_predefined(Name(b"WinAnsiEncoding"));
    id
}

fn heisei(pdf: &mut Pdf, next: &mut impl FnMut() -> Ref) -> Ref {
    let [id, cid, descriptor] = [next(), next(), next()];
    let name = Name(b"HeiseiKakuGo-W5");
    pdf.type0_font(id)
        .base_font(name)
        .encoding_predefined(Name(b"UniJIS-UTF16-H"))
        .descendant_font(cid);
    let japan = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Japan1"), supplement: 4 };
    pdf.cid_font(cid)
        .subtype(CidFontType::Type0)
        .base_font(name)
        .system_info(japan)
        .font_descriptor(descriptor)
        .default_width(1000.0);
    pdf.font_descriptor(descriptor)
        .name(name)
        .flags(FontFlags::SYMBOLIC)
        .bbox(Rect::new(-92.0, -250.0, 1010.0, 922.0))
        .italic_angle(0.0)
        .ascent(752.0)
        .descent(-221.0)
        .cap_height(737.0)
        .stem_v(114.0);
    id
}

impl Embedded {
    fn run(&mut self, letters: impl Iterator<Item = char>) -> Run {
        let (mut codes, mut width) = (Vec::new(), 0.0);
        for c in letters {
            let (glyph, wide) = self.glyph(c);
            codes.extend(glyph.to_be_bytes());
            width += wide / 1000.0;
        }
        Run { font: LATIN, codes, width }
    }

    /// Number of the letter in the cut-down font, and its width.
    fn glyph(&mut self, c: char) -> (u16, f32) {
        if let Some(known) = self.widths.get(&c) {
            return *known;
        }
        let face = Face::parse(&self.source.data, self.source.index).expect("it was parsed before");
        let glyph = face.glyph_index(c).or(face.glyph_index('?')).unwrap_or_default();
        let em = f32::from(face.units_per_em()).max(1.0);
        let wide = f32::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * 1000.0 / em;
        let number = self.remapper.remap(glyph.0);
        self.seen.entry(number).or_insert((c, wide));
        self.widths.insert(c, (number, wide));
        (number, wide)
    }

    fn write(&self, pdf: &mut Pdf, next: &mut impl FnMut() -> Ref) -> Result<Ref, ReportError> {
        let fail = |e: String| ReportError::Pack(format!("font of the sheets: {e}"));
        let face =
            Face::parse(&self.source.data, self.source.index).map_err(|e| fail(e.to_string()))?;
        let cut = subsetter::subset(&self.source.data, self.source.index, &self.remapper)
            .map_err(|e| fail(e.to_string()))?;
        // OpenType with PostScript outlines: PDF wants the outlines alone.
        let outlines =
            RawFace::parse(&cut, 0).ok().and_then(|raw| raw.table(Tag::from_bytes(b"CFF ")));
        let [id, cid, descriptor, file, map] = [next(), next(), next(), next(), next()];
        let name = Name(b"TSUMUA+Sheet");
        pdf.type0_font(id)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(map);
        let mut font = pdf.cid_font(cid);
        let kind = if outlines.is_some() { CidFontType::Type0 } else { CidFontType::Type2 };
        font.subtype(kind).base_font(name).system_info(IDENTITY).font_descriptor(descriptor);
        font.default_width(1000.0);
        if outlines.is_none() {
            font.cid_to_gid_map_predefined(Name(b"Identity"));
        }
        let mut widths = font.widths();
        for (glyph, (_, wide)) in &self.seen {
            widths.same(*glyph, *glyph, *wide);
        }
        widths.finish();
        font.finish();
        let scale = 1000.0 / f32::from(face.units_per_em()).max(1.0);
        let number = |v: i16| f32::from(v) * scale;
        let b = face.global_bounding_box();
        let mut about = pdf.font_descriptor(descriptor);
        about
            .name(name)
            .flags(FontFlags::SYMBOLIC)
            .bbox(Rect::new(number(b.x_min), number(b.y_min), number(b.x_max), number(b.y_max)))
            .italic_angle(0.0)
            .ascent(number(face.ascender()))
            .descent(number(face.descender()))
            .cap_height(number(face.capital_height().unwrap_or(face.ascender())))
            .stem_v(80.0);
        if outlines.is_some() {
            about.font_file3(file)
        } else {
            about.font_file2(file)
        };
        about.finish();
        let bytes = super::packed(outlines.unwrap_or(&cut))?;
        let mut stream = pdf.stream(file, &bytes);
        stream.filter(Filter::FlateDecode);
        if outlines.is_some() {
            stream.pair(Name(b"Subtype"), Name(b"CIDFontType0C"));
        }
        stream.finish();
        let mut unicode = UnicodeCmap::new(Name(b"Custom"), IDENTITY);
        for (glyph, (c, _)) in &self.seen {
            unicode.pair(*glyph, *c);
        }
        pdf.cmap(map, &unicode.finish());
        Ok(id)
    }
}
