//! PROJ strings (`+proj=tmerc +lat_0=36 …`) as headers and side files of older programs carry them.

use super::{CrsKind, FileCrs, Unit, japan};

/// Longer texts are no coordinate system.
const LIMIT: usize = 4096;

/// What the string says; nothing when it holds no `+proj=` or `+init=`.
pub fn of_proj(text: &str) -> FileCrs {
    let words = Words::of(text);
    let epsg = words.value("init").and_then(super::code);
    if let Some(code) = epsg {
        return FileCrs::of_code(code);
    }
    let Some(projection) = words.value("proj") else { return FileCrs::default() };
    let mut crs = FileCrs { name: format!("+proj={projection}"), ..FileCrs::default() };
    crs.vertical_unit = words.unit("vunits", "vto_meter");
    match projection {
        "longlat" | "latlong" | "lonlat" | "latlon" => crs.kind = CrsKind::Geographic,
        "geocent" | "cart" => crs.kind = CrsKind::Geocentric,
        _ => {
            crs.kind = CrsKind::Projected;
            crs.unit = words.unit("units", "to_meter").or_else(|| Some(Unit::metre()));
            let codes = codes(&words, projection);
            crs.horizontal = codes.first().copied();
            crs.alternatives = codes.get(1..).unwrap_or_default().to_vec();
        }
    }
    crs
}

/// The codes that projection and datum stand for: several where the string names an ellipsoid and no datum.
fn codes(words: &Words, projection: &str) -> Vec<u32> {
    let datum = words.value("datum").unwrap_or_default();
    let grs80 = datum.is_empty() && words.value("ellps") == Some("GRS80");
    let datums: &[&str] = match datum {
        "WGS84" => &["WGS 84"],
        _ if grs80 => &["JGD2011", "JGD2000", "WGS 84"],
        _ if words.value("ellps") == Some("bessel") => &["Tokyo"],
        _ => return Vec::new(),
    };
    let number = |key: &str, default: f64| words.number(key).unwrap_or(default);
    let parameters = match projection {
        "utm" => {
            let Some(zone) = words.number("zone") else { return Vec::new() };
            let north = if words.has("south") { 10_000_000.0 } else { 0.0 };
            [0.0, 6.0 * zone - 183.0, 0.9996, 500_000.0, north]
        }
        "tmerc" | "etmerc" => {
            let scale = words.number("k").or_else(|| words.number("k_0")).unwrap_or(1.0);
            [
                number("lat_0", 0.0),
                number("lon_0", 0.0),
                scale,
                number("x_0", 0.0),
                number("y_0", 0.0),
            ]
        }
        _ => return Vec::new(),
    };
    datums.iter().filter_map(|datum| japan::code_of_parameters(datum, parameters)).collect()
}

/// `+key=value` and `+flag`.
struct Words<'a>(Vec<(&'a str, &'a str)>);

impl<'a> Words<'a> {
    fn of(text: &'a str) -> Self {
        let words = text.get(..LIMIT).unwrap_or(text).split_ascii_whitespace();
        let plus = words.filter_map(|w| w.trim_matches(['"', '\'', ',', ';']).strip_prefix('+'));
        Self(plus.map(|w| w.split_once('=').unwrap_or((w, ""))).collect())
    }

    fn has(&self, key: &str) -> bool {
        self.0.iter().any(|w| w.0 == key)
    }

    fn value(&self, key: &str) -> Option<&'a str> {
        self.0.iter().find(|w| w.0 == key).map(|w| w.1)
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.value(key)?.parse().ok().filter(|v: &f64| v.is_finite())
    }

    /// By its word, or by its metres (`0.3048`, `1200/3937`).
    fn unit(&self, word: &str, metres: &str) -> Option<Unit> {
        let size = self.value(metres).and_then(|text| match text.split_once('/') {
            Some((a, b)) => Some(a.parse::<f64>().ok()? / b.parse::<f64>().ok()?),
            None => text.parse().ok(),
        });
        let size = size.filter(|m| *m > 0.0 && m.is_finite()).map(Unit::of_metres);
        size.or_else(|| self.value(word).map(Unit::of_word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_units_and_degrees_are_understood() {
        let zone = "proj4 +proj=tmerc +lat_0=36 +lon_0=139.833333333333 +k=0.9999 +x_0=0 +y_0=0 +ellps=GRS80 +units=m +no_defs";
        let crs = of_proj(zone);
        assert_eq!((crs.kind, crs.horizontal), (CrsKind::Projected, Some(6677)));
        // The ellipsoid alone does not tell the two datums apart.
        assert_eq!(crs.alternatives, [2451]);
        let utm = of_proj("+proj=utm +zone=54 +datum=WGS84 +units=m");
        assert_eq!((utm.horizontal, utm.alternatives.len()), (Some(32654), 0));
        assert_eq!(of_proj("+proj=utm +zone=56 +south +datum=WGS84").horizontal, Some(32756));
        assert_eq!(of_proj("+proj=longlat +datum=WGS84 +no_defs").kind, CrsKind::Geographic);
        assert_eq!(of_proj("+proj=geocent +datum=WGS84").kind, CrsKind::Geocentric);
        let feet =
            of_proj("+proj=lcc +lat_1=38.43 +lat_0=36.5 +datum=NAD83 +units=us-ft +vunits=ft");
        assert_eq!(feet.unit.unwrap().name, "US survey foot");
        assert_eq!(feet.vertical_unit.unwrap().name, "international foot");
        let parts = of_proj("+proj=lcc +to_meter=1200/3937");
        assert_eq!(parts.unit.unwrap().name, "US survey foot");
        assert_eq!(of_proj("+init=epsg:6677").horizontal, Some(6677));
        assert!(of_proj("a + b = c").is_unstated() && of_proj("").is_unstated());
    }
}
