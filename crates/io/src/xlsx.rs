//! Excel workbook: quantities by section and the block schedule, as offices calculate with them.

use crate::details::{Details, station};
use crate::drawing::{Drawing, Source};
use crate::{IoError, atomic};
use rust_xlsxwriter::{
    DocProperties, ExcelDateTime, Format, Formula, Workbook, Worksheet, XlsxError,
};
use scene::AreaVolume;
use std::io;
use std::path::Path;

/// Writes the workbook.
pub fn write(path: &Path, drawing: &Drawing, details: &Details) -> Result<(), IoError> {
    let bytes = bytes(drawing, details).map_err(|e| IoError::write(path, io::Error::other(e)))?;
    atomic::write_bytes(path, &bytes)
}

fn bytes(drawing: &Drawing, details: &Details) -> Result<Vec<u8>, XlsxError> {
    let mut book = Workbook::new();
    // The file's own date is fixed: the same result gives the same bytes.
    let made = ExcelDateTime::from_ymd(2000, 1, 1)?;
    let properties =
        DocProperties::new().set_title(plain(drawing.name)).set_creation_datetime(&made);
    book.set_properties(&properties);
    let styles = Styles::new();
    if !details.quantities.is_empty() {
        quantities(book.add_worksheet(), details, &styles)?;
    }
    schedule(book.add_worksheet(), drawing, &styles)?;
    recognised(book.add_worksheet(), drawing, &styles)?;
    book.save_to_buffer()
}

struct Styles {
    head: Format,
    whole: Format,
    two: Format,
    three: Format,
    sum: Format,
}

impl Styles {
    fn new() -> Self {
        let number = |f: &str| Format::new().set_num_format(f);
        Self {
            head: Format::new().set_bold().set_text_wrap().set_background_color(0xDD_E6EE),
            whole: number("#,##0"),
            two: number("#,##0.00"),
            three: number("#,##0.000"),
            sum: number("#,##0.00").set_bold(),
        }
    }
}

/// Text without control characters; it is written as a string cell, which no program executes.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn head(sheet: &mut Worksheet, names: &[&str], styles: &Styles) -> Result<(), XlsxError> {
    for (column, name) in names.iter().enumerate() {
        sheet.write_string_with_format(0, column as u16, *name, &styles.head)?;
        sheet.set_column_width(column as u16, 14)?;
    }
    sheet.set_freeze_panes(1, 0)?;
    Ok(())
}

/// Areas as numbers, volumes as formulas over them with their value, so that an office can follow the calculation.
fn quantities(sheet: &mut Worksheet, details: &Details, styles: &Styles) -> Result<(), XlsxError> {
    sheet.set_name("数量 Quantities")?;
    let names = [
        "測点 Station",
        "距離 Chainage (m)",
        "区間 Length (m)",
        "不足断面 Missing (m²)",
        "不足体積 Missing (m³)",
        "計画断面 Planned (m²)",
        "計画体積 Planned (m³)",
        "残不足断面 Still missing (m²)",
        "残不足体積 Still missing (m³)",
        "超過断面 Above design (m²)",
        "超過体積 Above design (m³)",
    ];
    head(sheet, &names, styles)?;
    for (i, q) in details.quantities.iter().enumerate() {
        let row = i as u32 + 1;
        sheet.write_string(row, 0, station(q.chainage_m))?;
        sheet.write_number_with_format(row, 1, q.chainage_m, &styles.two)?;
        sheet.write_number_with_format(row, 2, q.length_m, &styles.two)?;
        let all: [&AreaVolume; 4] = [&q.missing, &q.planned, &q.still_missing, &q.above];
        for (k, pair) in all.into_iter().enumerate() {
            let column = 3 + 2 * k as u16;
            sheet.write_number_with_format(row, column, pair.area_m2, &styles.two)?;
            let letter = char::from(b'D' + 2 * k as u8);
            let volume = match row {
                1 => Formula::new("=0"),
                _ => Formula::new(format!("=({letter}{}+{letter}{})/2*C{}", row, row + 1, row + 1)),
            };
            let volume = volume.set_result(pair.volume_m3.to_string());
            sheet.write_formula_with_format(row, column + 1, volume, &styles.two)?;
        }
    }
    let last = details.quantities.len() as u32 + 1;
    sheet.write_string_with_format(last, 0, "合計 Total", &styles.head)?;
    let sums: [f64; 4] = details.quantities.iter().fold([0.0; 4], |s, q| {
        let v = [q.missing, q.planned, q.still_missing, q.above].map(|p| p.volume_m3);
        std::array::from_fn(|k| s[k] + v[k])
    });
    for (k, sum) in sums.iter().enumerate() {
        let letter = char::from(b'E' + 2 * k as u8);
        let formula =
            Formula::new(format!("=SUM({letter}2:{letter}{last})")).set_result(sum.to_string());
        sheet.write_formula_with_format(last, 4 + 2 * k as u16, formula, &styles.sum)?;
    }
    sheet.write_string(last + 1, 0, "平均断面法 Average end area: V = (A1 + A2)/2 · L")?;
    Ok(())
}

fn schedule(sheet: &mut Worksheet, drawing: &Drawing, styles: &Styles) -> Result<(), XlsxError> {
    sheet.set_name("据付表 Schedule")?;
    let names = [
        "順序 Order",
        "回 Round",
        "種類 Type",
        "質量 Mass (t)",
        "X 北 North (m)",
        "Y 東 East (m)",
        "標高 Level (m)",
        "投下高 Let go at (m)",
        "充填 Fills (m³)",
        "接触 Contacts",
        "据付日 Placed on",
        "備考 Note",
    ];
    head(sheet, &names, styles)?;
    let mut row = 0;
    for unit in drawing.units() {
        let Source::Planned(p) = unit.source else { continue };
        row += 1;
        let (model, centre) = (drawing.catalog.get(unit.model), drawing.centre(&unit));
        let drop = drawing.frame.site_from_local(p.drop * model.centre);
        sheet.write_number_with_format(row, 0, p.order, &styles.whole)?;
        sheet.write_number_with_format(row, 1, p.round, &styles.whole)?;
        sheet.write_string(row, 2, plain(&model.name))?;
        sheet.write_number_with_format(row, 3, f64::from(model.mass_kg()) / 1000.0, &styles.two)?;
        for (k, v) in [centre.y, centre.x, centre.z, drop.z].into_iter().enumerate() {
            sheet.write_number_with_format(row, 4 + k as u16, v, &styles.three)?;
        }
        sheet.write_number_with_format(row, 8, p.filled_m3, &styles.two)?;
        sheet.write_number_with_format(row, 9, p.contacts, &styles.whole)?;
    }
    if row > 0 {
        sheet.autofilter(0, 0, row, names.len() as u16 - 1)?;
    }
    Ok(())
}

fn recognised(sheet: &mut Worksheet, drawing: &Drawing, styles: &Styles) -> Result<(), XlsxError> {
    sheet.set_name("認識 Recognised")?;
    let names = [
        "番号 No.",
        "種類 Type",
        "X 北 North (m)",
        "Y 東 East (m)",
        "標高 Level (m)",
        "信頼度 Confidence",
        "当てはめ誤差 Fit (mm)",
        "隠れ Hidden (%)",
    ];
    head(sheet, &names, styles)?;
    let mut row = 0;
    for unit in drawing.units() {
        let Source::Recognised(r, fit) = unit.source else { continue };
        row += 1;
        let centre = drawing.centre(&unit);
        sheet.write_number_with_format(row, 0, r.block.0, &styles.whole)?;
        sheet.write_string(row, 1, plain(&drawing.catalog.get(unit.model).name))?;
        for (k, v) in [centre.y, centre.x, centre.z].into_iter().enumerate() {
            sheet.write_number_with_format(row, 2 + k as u16, v, &styles.three)?;
        }
        let known = [
            (fit.confidence, 1.0, &styles.two),
            (fit.fitness_m, 1000.0, &styles.whole),
            (fit.occlusion, 100.0, &styles.whole),
        ];
        for (k, (value, factor, style)) in known.into_iter().enumerate() {
            if let Some(v) = value {
                sheet.write_number_with_format(row, 5 + k as u16, v * factor, style)?;
            }
        }
    }
    if row > 0 {
        sheet.autofilter(0, 0, row, names.len() as u16 - 1)?;
    }
    Ok(())
}
