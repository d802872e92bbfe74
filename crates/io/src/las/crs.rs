//! Coordinate reference systems as LAS states them: GeoTIFF keys or well-known text.

use super::header::u16_at;

const PROJECTED_KEY: u16 = 3072;
const GEOGRAPHIC_KEY: u16 = 2048;

/// `EPSG:n` from a GeoKeyDirectory (record 34735); projected before geographic.
pub(super) fn epsg_of_geotiff_keys(data: &[u8]) -> Option<String> {
    let entry = |key: u16| {
        data.chunks_exact(8)
            .skip(1)
            .find(|e| u16_at(e, 0) == key && u16_at(e, 2) == 0)
            .map(|e| u16_at(e, 6))
    };
    let code = entry(PROJECTED_KEY).or_else(|| entry(GEOGRAPHIC_KEY))?;
    // 32767 means user-defined, 0 undefined.
    (code != 0 && code != 32767).then(|| format!("EPSG:{code}"))
}

/// A GeoKeyDirectory that names a projected system and nothing else.
pub(super) fn geotiff_keys_of_epsg(code: u16) -> Vec<u8> {
    let keys: [u16; 16] = [1, 1, 0, 3, 1024, 0, 1, 1, PROJECTED_KEY, 0, 1, code, 3076, 0, 1, 9001];
    keys.iter().flat_map(|k| k.to_le_bytes()).collect()
}

/// `EPSG:n` of the projected (else the outermost) system of a WKT 1 or 2 text.
pub fn epsg_of_wkt(wkt: &str) -> Option<String> {
    let upper = wkt.to_ascii_uppercase();
    let start =
        ["PROJCRS[", "PROJCS[", "PROJECTEDCRS["].iter().find_map(|k| upper.find(k)).unwrap_or(0);
    let body = &wkt.as_bytes()[start..];
    let (mut depth, mut quoted) = (0_i32, false);
    for (i, &c) in body.iter().enumerate() {
        match c {
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'[' | b'(' => depth += 1,
            b']' | b')' => {
                depth -= 1;
                if depth == 0 {
                    break;
                }
            }
            // The authority of the system itself is a direct child.
            b'A' | b'I' | b'a' | b'i' if depth == 1 => {
                let rest =
                    String::from_utf8_lossy(&body[i..body.len().min(i + 64)]).to_ascii_uppercase();
                for start in ["AUTHORITY[\"EPSG\",", "ID[\"EPSG\","] {
                    if let Some(code) = rest.strip_prefix(start) {
                        let digits: String = code
                            .trim_start_matches(['"', ' '])
                            .chars()
                            .take_while(char::is_ascii_digit)
                            .collect();
                        return (!digits.is_empty()).then(|| format!("EPSG:{digits}"));
                    }
                }
            }
            _ => {}
        }
    }
    None
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_a_written_text_is_found_again() {
        for code in [6669, 6679, 6687, 2443, 6691, 32654, 32760] {
            let wkt = wkt_of_epsg(code).unwrap();
            assert_eq!(epsg_of_wkt(&wkt), Some(format!("EPSG:{code}")));
        }
        assert_eq!(wkt_of_epsg(4326), None);
    }

    #[test]
    fn a_compound_system_gives_its_horizontal_part() {
        let horizontal = wkt_of_epsg(6679).unwrap();
        let wkt = format!(
            r#"COMPD_CS["a [b",{horizontal},VERT_CS["JGD2011 (vertical) height",AUTHORITY["EPSG","6695"]],AUTHORITY["EPSG","6701"]]"#
        );
        assert_eq!(epsg_of_wkt(&wkt), Some("EPSG:6679".into()));
        assert_eq!(
            epsg_of_wkt(r#"PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",6668]],ID["EPSG",6679]]"#),
            Some("EPSG:6679".into())
        );
        assert_eq!(epsg_of_wkt("LOCAL_CS[\"bin\"]"), None);
    }

    #[test]
    fn keys_name_the_code() {
        assert_eq!(epsg_of_geotiff_keys(&geotiff_keys_of_epsg(2992)), Some("EPSG:2992".into()));
        assert_eq!(epsg_of_geotiff_keys(&[1, 0]), None);
    }
}
