//! The drawings of a plan as sheets of paper: title block, scale, north, approval boxes, n of N.
//!
//! In: the same [`ReportInput`] as the page, and what stands in the title block. Out: one PDF. Words are in both
//! languages, Japanese first, as on the drawings of a port office.

mod font;
mod frame;
mod paper;
mod plan_sheet;
mod schedule;
mod section_sheet;
mod summary;
mod view;

pub use font::SheetFont;

use crate::{ReportError, ReportInput};
use flate2::{Compression, write::ZlibEncoder};
use font::Font;
use paper::{HEIGHT_MM, Paper, WIDTH_MM};
use pdf_writer::{Filter, Finish, Pdf, Rect, Ref, TextStr};
use std::io::Write;

/// What stands in the title block beside the input's own title.
#[derive(Clone, Debug, Default)]
pub struct SheetSet {
    /// Who draws: company or office; may be empty.
    pub author: String,
    /// Drawing number; sheets add their own after a dash; may be empty.
    pub drawing: String,
    /// Font to embed; without one standard fonts are named.
    pub font: Option<SheetFont>,
}

/// A sheet: what it shows, and how it is drawn.
struct Sheet<'a> {
    title: crate::Text,
    scale: String,
    draw: Box<dyn Fn(&mut Paper) + 'a>,
}

/// The whole set as a PDF: summary, plan sheets, sections, block schedule, annex. Errors: values that do not belong
/// together, a font that cannot be cut down.
pub fn sheets(input: &ReportInput, set: &SheetSet) -> Result<Vec<u8>, ReportError> {
    crate::view_data::check(input)?;
    let mut sheets = vec![summary::sheet(input)];
    sheets.extend(plan_sheet::sheets(input));
    sheets.extend(section_sheet::sheets(input));
    sheets.extend(schedule::sheets(input));
    sheets.push(summary::annex(input));
    let mut font = Font::new(set.font.as_ref());
    let count = sheets.len();
    let mut pages = Vec::new();
    for (i, sheet) in sheets.iter().enumerate() {
        let mut paper = Paper::new(&mut font);
        frame::draw(&mut paper, input, set, sheet, [i + 1, count]);
        (sheet.draw)(&mut paper);
        pages.push(packed(&paper.finish())?);
    }
    document(input, &font, &pages)
}

fn document(input: &ReportInput, font: &Font, pages: &[Vec<u8>]) -> Result<Vec<u8>, ReportError> {
    let mut pdf = Pdf::new();
    let mut last = 0;
    let mut next = || {
        last += 1;
        Ref::new(last)
    };
    let [catalog, tree, info] = [next(), next(), next()];
    let ids: Vec<[Ref; 2]> = pages.iter().map(|_| [next(), next()]).collect();
    let fonts = font.write(&mut pdf, &mut next)?;
    pdf.catalog(catalog).pages(tree);
    pdf.pages(tree).kids(ids.iter().map(|i| i[0])).count(ids.len() as i32);
    const MM: f32 = 72.0 / 25.4;
    for ([page, content], bytes) in ids.iter().zip(pages) {
        let mut p = pdf.page(*page);
        p.parent(tree)
            .media_box(Rect::new(0.0, 0.0, WIDTH_MM * MM, HEIGHT_MM * MM))
            .contents(*content);
        let mut resources = p.resources();
        let mut list = resources.fonts();
        for (name, id) in &fonts {
            list.pair(*name, *id);
        }
        list.finish();
        resources.finish();
        p.finish();
        pdf.stream(*content, bytes).filter(Filter::FlateDecode);
    }
    pdf.document_info(info).title(TextStr(&input.title)).producer(TextStr(&input.program));
    Ok(pdf.finish())
}

fn packed(bytes: &[u8]) -> Result<Vec<u8>, ReportError> {
    let fail = |e: std::io::Error| ReportError::Pack(e.to_string());
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::new(6));
    zlib.write_all(bytes).map_err(fail)?;
    zlib.finish().map_err(fail)
}
