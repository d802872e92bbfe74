//! The plane coordinate systems that Japanese and most other works use: their text, and their codes from a text without one.

use super::wkt::Node;

/// Well-known text (version 1) of the systems that Japanese and most other works use:
/// JGD2011 and JGD2000 plane rectangular zones, JGD2011 and WGS 84 UTM zones. `None` for others.
pub fn wkt_of_epsg(code: u32) -> Option<String> {
    let (name, datum, lat, lon, scale, east, north) = match code {
        6669..=6687 => {
            let zone = (code - 6669) as usize;
            let (lat, lon) = ZONES[zone];
            (
                format!("JGD2011 / Japan Plane Rectangular CS {}", ROMAN[zone]),
                JGD2011,
                lat,
                lon,
                0.9999,
                0.0,
                0.0,
            )
        }
        2443..=2461 => {
            let zone = (code - 2443) as usize;
            let (lat, lon) = ZONES[zone];
            (
                format!("JGD2000 / Japan Plane Rectangular CS {}", ROMAN[zone]),
                JGD2000,
                lat,
                lon,
                0.9999,
                0.0,
                0.0,
            )
        }
        6688..=6692 => {
            let zone = code - 6688 + 51;
            (
                format!("JGD2011 / UTM zone {zone}N"),
                JGD2011,
                0.0,
                meridian(zone),
                0.9996,
                500_000.0,
                0.0,
            )
        }
        32601..=32660 => {
            let zone = code - 32600;
            (
                format!("WGS 84 / UTM zone {zone}N"),
                WGS84,
                0.0,
                meridian(zone),
                0.9996,
                500_000.0,
                0.0,
            )
        }
        32701..=32760 => {
            let zone = code - 32700;
            (
                format!("WGS 84 / UTM zone {zone}S"),
                WGS84,
                0.0,
                meridian(zone),
                0.9996,
                500_000.0,
                10_000_000.0,
            )
        }
        _ => return None,
    };
    let axes = match code {
        6669..=6687 | 2443..=2461 => r#"AXIS["X",NORTH],AXIS["Y",EAST]"#,
        _ => r#"AXIS["Easting",EAST],AXIS["Northing",NORTH]"#,
    };
    Some(format!(
        r#"PROJCS["{name}",{datum},PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",{lat}],PARAMETER["central_meridian",{lon}],PARAMETER["scale_factor",{scale}],PARAMETER["false_easting",{east}],PARAMETER["false_northing",{north}],UNIT["metre",1,AUTHORITY["EPSG","9001"]],{axes},AUTHORITY["EPSG","{code}"]]"#
    ))
}

fn meridian(zone: u32) -> f64 {
    f64::from(zone) * 6.0 - 183.0
}

const JGD2011: &str = r#"GEOGCS["JGD2011",DATUM["Japanese_Geodetic_Datum_2011",SPHEROID["GRS 1980",6378137,298.257222101,AUTHORITY["EPSG","7019"]],AUTHORITY["EPSG","1128"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","6668"]]"#;
const JGD2000: &str = r#"GEOGCS["JGD2000",DATUM["Japanese_Geodetic_Datum_2000",SPHEROID["GRS 1980",6378137,298.257222101,AUTHORITY["EPSG","7019"]],AUTHORITY["EPSG","6612"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4612"]]"#;
const WGS84: &str = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]"#;

const ROMAN: [&str; 19] = [
    "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI", "XII", "XIII", "XIV", "XV",
    "XVI", "XVII", "XVIII", "XIX",
];

/// Origins of the nineteen zones: latitude, longitude, degrees (Geospatial Information Authority of Japan).
const ZONES: [(f64, f64); 19] = [
    (33.0, 129.5),
    (33.0, 131.0),
    (36.0, 132.166_666_666_666_66),
    (33.0, 133.5),
    (36.0, 134.333_333_333_333_34),
    (36.0, 136.0),
    (36.0, 137.166_666_666_666_66),
    (36.0, 138.5),
    (36.0, 139.833_333_333_333_34),
    (40.0, 140.833_333_333_333_34),
    (44.0, 140.25),
    (44.0, 142.25),
    (44.0, 144.25),
    (26.0, 142.0),
    (26.0, 127.5),
    (26.0, 124.0),
    (26.0, 131.0),
    (20.0, 136.0),
    (26.0, 154.0),
];

/// The family of codes that a datum's name belongs to: first code of the nineteen zones, and of the UTM zones from `utm.1`.
struct Family {
    zones: Option<u32>,
    utm: Option<(u32, u32)>,
}

fn family(datum: &str) -> Option<Family> {
    let plain: String = datum.to_uppercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let has = |part: &str| plain.contains(part);
    if has("JGD2011") || has("JAPANESEGEODETICDATUM2011") {
        Some(Family { zones: Some(6669), utm: Some((6688, 51)) })
    } else if has("JGD2000") || has("JAPANESEGEODETICDATUM2000") {
        Some(Family { zones: Some(2443), utm: Some((3097, 51)) })
    } else if has("TOKYO") {
        Some(Family { zones: Some(30161), utm: None })
    } else if has("WGS84") || has("WGS1984") || has("WORLDGEODETICSYSTEM1984") {
        Some(Family { zones: None, utm: Some((32601, 1)) })
    } else {
        None
    }
}

/// The code of a transverse Mercator system from its datum and parameters: texts by ESRI have no codes.
pub(super) fn code_of(projected: &Node) -> Option<u32> {
    let geographic = projected.child(&["GEOGCS", "BASEGEOGCRS", "BASEGEODCRS"])?;
    let datum = geographic.child(&["DATUM", "ENSEMBLE"])?.text();
    let family = family(datum).or_else(|| family(geographic.text()))?;
    let conversion = projected.child(&["CONVERSION"]).unwrap_or(projected);
    let plain = |text: &str| text.to_lowercase().replace('_', " ");
    let method = plain(conversion.child(&["PROJECTION", "METHOD"])?.text());
    if !matches!(method.as_str(), "transverse mercator" | "gauss kruger") {
        return None;
    }
    let value = |names: [&str; 2]| {
        let found = conversion.children().find(|p| names.contains(&plain(p.text()).as_str()))?;
        found.number()
    };
    let lat = value(["latitude of origin", "latitude of natural origin"])?;
    let lon = value(["central meridian", "longitude of natural origin"])?;
    let scale = value(["scale factor", "scale factor at natural origin"])?;
    let east = value(["false easting"; 2])?;
    let north = value(["false northing"; 2])?;
    of_family(&family, [lat, lon, scale, east, north])
}

/// The code of a transverse Mercator system by the name of its datum and its parameters: latitude and longitude of the origin
/// (degrees), scale, false easting and northing (metres).
pub(super) fn code_of_parameters(datum: &str, parameters: [f64; 5]) -> Option<u32> {
    of_family(&family(datum)?, parameters)
}

fn of_family(family: &Family, [lat, lon, scale, east, north]: [f64; 5]) -> Option<u32> {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
    if near(scale, 0.9999) && near(east, 0.0) && near(north, 0.0) {
        let zone = ZONES.iter().position(|z| near(z.0, lat) && near(z.1, lon))?;
        return Some(family.zones? + zone as u32);
    }
    let zone = (lon + 183.0) / 6.0;
    let is_utm = near(scale, 0.9996) && near(lat, 0.0) && near(east, 500_000.0);
    if !is_utm || !near(zone, zone.round()) || !(1.0..=60.0).contains(&zone.round()) {
        return None;
    }
    utm_code(family, zone.round() as u32, near(north, 10_000_000.0))
}

fn utm_code(family: &Family, zone: u32, south: bool) -> Option<u32> {
    let (first, from) = family.utm?;
    match (first, south) {
        (32601, south) => Some(if south { 32700 } else { 32600 } + zone),
        (_, true) => None,
        (_, false) => zone.checked_sub(from).filter(|i| *i < 5).map(|i| first + i),
    }
}

/// The code that a name alone states: `JGD2011 / Japan Plane Rectangular CS IX`, `JGD_2000_Japan_Zone_9`, `WGS 84 / UTM zone 54N`.
pub(super) fn code_of_name(name: &str) -> Option<u32> {
    let family = family(name)?;
    let plain = name.to_uppercase().replace(['_', '/', ','], " ");
    let words: Vec<&str> = plain.split_whitespace().collect();
    let last = words.last()?;
    let zone_word = words.iter().position(|w| *w == "ZONE").and_then(|i| words.get(i + 1));
    if plain.contains("UTM") {
        let word = zone_word?;
        let digits = word.trim_end_matches(['N', 'S']);
        let zone = digits.parse().ok().filter(|z| (1..=60).contains(z))?;
        return utm_code(&family, zone, word.ends_with('S'));
    }
    if !plain.contains("JAPAN") {
        return None;
    }
    let number = zone_word.unwrap_or(last);
    let roman = ROMAN.iter().position(|r| r == number).map(|i| i as u32 + 1);
    let zone = roman.or_else(|| number.parse().ok()).filter(|z| (1..=19).contains(z))?;
    Some(family.zones? + zone - 1)
}

/// The code of a datum and a zone as Japanese LandXML (J-LandXML) writes them: `JGD2011` and `9(X,Y)`.
pub fn code_of_zone(datum: &str, zone: &str) -> Option<u32> {
    let digits: String = zone.trim().chars().take_while(char::is_ascii_digit).collect();
    let number = digits.parse().ok().filter(|z: &u32| (1..=19).contains(z))?;
    Some(family(datum)?.zones? + number - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crs::of_wkt;

    #[test]
    fn the_code_of_a_written_text_is_found_again() {
        for code in [6669, 6679, 6687, 2443, 6691, 32654, 32760] {
            let wkt = wkt_of_epsg(code).unwrap();
            assert_eq!(of_wkt(&wkt).horizontal, Some(code));
            // And without the codes in it, from its parameters.
            let bare: String = wkt
                .split(",AUTHORITY[\"EPSG\",")
                .enumerate()
                .map(|(i, p)| if i == 0 { p } else { &p[p.find(']').unwrap() + 1..] })
                .collect();
            assert!(!bare.contains("EPSG"), "{bare}");
            assert_eq!(of_wkt(&bare).horizontal, Some(code), "{bare}");
        }
        assert_eq!(wkt_of_epsg(4326), None);
    }

    #[test]
    fn names_alone_give_codes() {
        for (name, code) in [
            ("JGD2011 / Japan Plane Rectangular CS IX", Some(6677)),
            ("JGD_2000_Japan_Zone_11", Some(2453)),
            ("Tokyo / Japan Plane Rectangular CS I", Some(30161)),
            ("WGS_1984_UTM_Zone_54N", Some(32654)),
            ("JGD2011 / UTM zone 53N", Some(6690)),
            ("WGS 84 / UTM zone 7S", Some(32707)),
            ("JGD2011", None),
            ("JGD2011 / Japan Plane Rectangular CS XXV", None),
        ] {
            assert_eq!(code_of_name(name), code, "{name}");
        }
    }
}
