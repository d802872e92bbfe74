//! Text clouds of every make: read as they are meant, or asked about.

use crate::{heap, read};
use encoding_rs::SHIFT_JIS;
use geom::DVec3;

fn rows(line: impl Fn(usize, DVec3) -> String, end: &str) -> String {
    heap(30).iter().enumerate().map(|(i, p)| line(i, *p) + end).collect()
}

/// Holds what was read against the heap.
fn check(name: &str, kind: &str, bytes: &[u8], named: bool) {
    let (cloud, _) = read(kind, bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(cloud.len(), 30, "{name}");
    assert_eq!(cloud.named_axes, named, "{name}");
    for (a, b) in cloud.position.iter().zip(heap(30)) {
        assert!((*a - b).length() < 1e-2, "{name}: {a} {b}");
    }
}

#[test]
fn semicolon_comma_decimals() {
    let comma = |v: f64| format!("{v:.3}").replace('.', ",");
    let line = |sign: &'static str| move |_: usize, p: DVec3| [p.x, p.y, p.z].map(comma).join(sign);
    check(
        "semicolons",
        "csv",
        ("X;Y;Z\n".to_string() + &rows(line(";"), "\r\n")).as_bytes(),
        false,
    );
    check("tabs", "txt", rows(line("\t"), "\n").as_bytes(), false);
    check("blanks", "xyz", rows(line(" "), "\n").as_bytes(), false);
    // Decimal commas between commas cannot be told from columns.
    let both = "X,Y,Z\n".to_string() + &rows(line(","), "\n");
    let error = read("csv", both.as_bytes()).unwrap_err();
    assert!(error.contains("decimal") && error.contains(';'), "{error}");
}

#[test]
fn thousands() {
    let grouped = |v: f64| {
        let text = format!("{:.2}", v.abs());
        let (whole, rest) = text.split_once('.').unwrap();
        let cut = whole.len().saturating_sub(3);
        let whole =
            if cut > 0 { format!("{},{}", &whole[..cut], &whole[cut..]) } else { whole.into() };
        format!("{}{whole}.{rest}", if v < 0.0 { "-" } else { "" })
    };
    let line =
        |_: usize, p: DVec3| [p.x, p.y, p.z].map(|v| format!("\"{}\"", grouped(v))).join(",");
    check("quoted thousands", "csv", ("x,y,z\n".to_string() + &rows(line, "\n")).as_bytes(), false);
    let question =
        read("txt", "12,345 23,456 3,456\n12,346 23,457 3,457\n".as_bytes()).unwrap_err();
    assert!(question.contains("12.345") && question.contains("12345"), "{question}");
}

#[test]
fn point_number_first() {
    let four = rows(|i, p| format!("{} {} {} {}", i + 1, p.x, p.y, p.z), "\n");
    let error = read("csv", four.as_bytes()).unwrap_err();
    assert!(error.contains("counts 1, 2, 3") && error.contains("first line"), "{error}");
    check("with a header", "csv", ("no x y z\n".to_string() + &four).as_bytes(), false);
    let from_500 = rows(|i, p| format!("{},{},{},{}", i + 500, p.x, p.y, p.z), "\n");
    assert!(read("csv", from_500.as_bytes()).unwrap_err().contains("counts 500"));
    let names = rows(|i, p| format!("P{i} {} {} {}", p.x, p.y, p.z), "\n");
    assert!(read("txt", names.as_bytes()).unwrap_err().contains("holds names"));
    // A grid with a fourth column counts along its rows, and is a grid.
    let grid: String = (0..60).map(|i| format!("{} {} 3.5 {}\n", i % 20, i / 20, i)).collect();
    assert_eq!(read("xyz", grid.as_bytes()).unwrap().0.len(), 60);
}

#[test]
fn hash_header_y_x_z() {
    let swapped = rows(|_, p| format!("{} {} {}", p.y, p.x, p.z), "\n");
    for head in ["# Y X Z\n", "//Y X Z\n", "% y, x, z\n", "# made by a program\n# y x z\n"] {
        check(head, "txt", (head.to_string() + &swapped).as_bytes(), false);
    }
    // A comment that names nothing is one.
    let plain = rows(|_, p| format!("{} {} {}", p.x, p.y, p.z), "\n");
    check("comment", "txt", ("# exported by X on Y\n".to_string() + &plain).as_bytes(), false);
}

#[test]
fn northing_easting_names() {
    let swapped = rows(|_, p| format!("{},{},{}", p.y, p.x, p.z), "\n");
    for head in ["Northing,Easting,Elevation\n", "北,東,標高\n", "X(北),Y(東),Z\n", "N,E,H\n"]
    {
        check(head, "csv", (head.to_string() + &swapped).as_bytes(), true);
    }
    check("letters", "csv", ("Y座標,X座標,標高\n".to_string() + &swapped).as_bytes(), false);
}

#[test]
fn depths_and_units_and_degrees() {
    let depth = rows(|_, p| format!("{},{},{}", p.x, p.y, -(p.z - 20.0)), "\n");
    let (cloud, said) =
        read("csv", ("East,North,Depth\n".to_string() + &depth).as_bytes()).unwrap();
    assert!((cloud.position[3].z - (heap(30)[3].z - 20.0)).abs() < 1e-6 && said.contains("depths"));
    let error = read("csv", ("x,y,水深\n".to_string() + &depth.replace(",1", ",-1")).as_bytes())
        .unwrap_err();
    assert!(error.contains("depths"), "{error}");
    let plain = rows(|_, p| format!("{},{},{}", p.x, p.y, p.z), "\n");
    for (head, part) in [
        ("x,y,z [ft]\n", "foot"),
        ("lat,lon,height\n", "latitude"),
        ("X_mm,Y_mm,Z_mm\n", "millimetre"),
    ] {
        let error = read("csv", (head.to_string() + &plain).as_bytes()).unwrap_err();
        assert!(error.contains(part), "{head}: {error}");
    }
}

#[test]
fn cr_only_lines() {
    let line = |_: usize, p: DVec3| format!("{} {} {}", p.x, p.y, p.z);
    for end in ["\r", "\n", "\r\n"] {
        check("line ends", "xyz", rows(line, end).as_bytes(), false);
        check("line ends", "xyz", ("x y z".to_string() + end + &rows(line, end)).as_bytes(), false);
    }
}

#[test]
fn utf_16_no_bom() {
    let text = "X,Y,Z\r\n".to_string() + &rows(|_, p| format!("{},{},{}", p.x, p.y, p.z), "\r\n");
    for mark in ["", "\u{feff}"] {
        let units: Vec<u16> = format!("{mark}{text}").encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
        check("little", "txt", &little, false);
        check("big", "csv", &big, false);
    }
}

#[test]
fn shift_jis() {
    let text = "点名,北,東,標高\r\n".to_string()
        + &rows(|i, p| format!("点{i},{},{},{}", p.y, p.x, p.z), "\r\n");
    check("Shift-JIS", "csv", &SHIFT_JIS.encode(&text).0, true);
    check("UTF-8", "csv", text.as_bytes(), true);
}
