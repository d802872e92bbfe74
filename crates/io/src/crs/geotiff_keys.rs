//! GeoTIFF keys, in TIFF images and in LAS records alike.

use super::{CrsKind, FileCrs, Unit, epsg, japan};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const CITATION: u16 = 1026;
const GEOGRAPHIC: u16 = 2048;
const GEOGRAPHIC_CITATION: u16 = 2049;
const PROJECTED: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const LINEAR_UNIT: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL: u16 = 4096;
const VERTICAL_UNIT: u16 = 4099;
const USER_DEFINED: u16 = 32767;
const DOUBLES: u16 = 34736;
const TEXTS: u16 = 34737;

/// The directory with the numbers and the text it refers to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeoKeys {
    /// Four numbers a key: id, where its value is, how many, value or index.
    pub directory: Vec<u16>,
    /// Record 34736.
    pub doubles: Vec<f64>,
    /// Record 34737, entries end with `|`.
    pub texts: String,
}

impl GeoKeys {
    fn entry(&self, key: u16) -> Option<[u16; 3]> {
        let found = self.directory.chunks_exact(4).skip(1).find(|e| e[0] == key)?;
        Some([found[1], found[2], found[3]])
    }

    /// A key's number, 0 (undefined) being none.
    fn short(&self, key: u16) -> Option<u16> {
        self.entry(key).filter(|e| e[0] == 0).map(|e| e[2]).filter(|&v| v != 0)
    }

    fn double(&self, key: u16) -> Option<f64> {
        let [at, _, index] = self.entry(key)?;
        (at == DOUBLES).then(|| self.doubles.get(usize::from(index)).copied()).flatten()
    }

    fn text(&self, key: u16) -> Option<&str> {
        let [at, count, index] = self.entry(key)?;
        let from = usize::from(index);
        let text = self.texts.get(from..from + usize::from(count))?;
        (at == TEXTS).then(|| text.trim_matches(['|', '\0', ' ']))
    }

    /// The value stands for the middle of its cell (else for the whole cell).
    pub fn pixel_is_point(&self) -> bool {
        self.short(RASTER_TYPE) == Some(2)
    }

    /// What the keys say of the coordinates.
    pub fn crs(&self) -> FileCrs {
        let mut crs = FileCrs::default();
        let code = |key: u16| self.short(key).filter(|&c| c != USER_DEFINED).map(u32::from);
        let name = [PROJECTED_CITATION, CITATION, GEOGRAPHIC_CITATION]
            .iter()
            .find_map(|&k| self.text(k))
            .unwrap_or_default();
        crs.name = name.into();
        let model = self.short(MODEL_TYPE);
        let linear = self.unit(LINEAR_UNIT, Some(LINEAR_UNIT_SIZE));
        crs.unit = linear;
        crs.vertical_unit = self.unit(VERTICAL_UNIT, None);
        let geographic = code(GEOGRAPHIC);
        let projected = code(PROJECTED).or_else(|| {
            let named = japan::code_of_name(name);
            named.filter(|_| model != Some(2))
        });
        if let Some(code) = projected {
            crs.take_code(code);
        } else if model == Some(1) || self.short(PROJECTED).is_some() {
            crs.kind = CrsKind::Projected;
        } else if model == Some(2) || geographic.is_some() {
            crs.kind = CrsKind::Geographic;
            crs.horizontal = geographic;
        } else if model == Some(3) {
            crs.kind = CrsKind::Geocentric;
        }
        // Some writers put 5001 to 5099 here (ellipsoidal heights of GeoTIFF 1.0): they are no code of the register.
        if let Some(code) = code(VERTICAL).filter(|c| !(5001..=5099).contains(c))
            && matches!(epsg::meaning(code), epsg::Meaning::Vertical { .. })
        {
            crs.take_code(code);
        }
        crs
    }

    fn unit(&self, key: u16, size: Option<u16>) -> Option<Unit> {
        let code = self.short(key)?;
        let metres = match code {
            9001 => 1.0,
            9002 => 0.3048,
            9003 => 1200.0 / 3937.0,
            9036 => 1000.0,
            9093 => 1609.344,
            9096 => 0.9144,
            1025 => 0.001,
            1033 => 0.01,
            USER_DEFINED => {
                let size = size.and_then(|k| self.double(k)).unwrap_or(f64::NAN);
                if !(size > 0.0 && size.is_finite()) {
                    return Some(Unit { name: "user-defined unit".into(), metres: f64::NAN });
                }
                size
            }
            other => {
                return Some(Unit { name: format!("unit EPSG:{other}"), metres: f64::NAN });
            }
        };
        Some(Unit::of_metres(metres))
    }
}

/// A directory, as bytes, that names a projected system in metres and nothing else.
pub fn keys_of_epsg(code: u16) -> Vec<u8> {
    let keys: [u16; 16] =
        [1, 1, 0, 3, MODEL_TYPE, 0, 1, 1, PROJECTED, 0, 1, code, LINEAR_UNIT, 0, 1, 9001];
    keys.iter().flat_map(|k| k.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(entries: &[[u16; 4]]) -> GeoKeys {
        let mut directory = vec![1, 1, 0, entries.len() as u16];
        directory.extend(entries.iter().flatten());
        GeoKeys { directory, ..GeoKeys::default() }
    }

    #[test]
    fn codes_and_units_are_read() {
        let crs = keys(&[[1024, 0, 1, 1], [3072, 0, 1, 6677], [4096, 0, 1, 6360]]).crs();
        assert_eq!((crs.horizontal, crs.vertical), (Some(6677), Some(6360)));
        assert_eq!(crs.height_unit().name, "US survey foot");
        let crs = keys(&[[3072, 0, 1, 6677], [3076, 0, 1, 9002], [4099, 0, 1, 9003]]).crs();
        assert_eq!(crs.unit.unwrap().name, "international foot");
        assert_eq!(crs.vertical_unit.unwrap().name, "US survey foot");
        let crs = keys(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]]).crs();
        assert_eq!((crs.kind, crs.horizontal), (CrsKind::Geographic, Some(4326)));
        let mut own =
            keys(&[[1024, 0, 1, 1], [3072, 0, 1, 32767], [3076, 0, 1, 32767], [3077, 34736, 1, 0]]);
        own.doubles = vec![0.001];
        assert_eq!(own.crs().unit.unwrap().name, "millimetre");
        assert_eq!(own.crs().kind, CrsKind::Projected);
        let mut named = keys(&[[1024, 0, 1, 1], [1026, 34737, 40, 0]]);
        named.texts = "JGD2011 / Japan Plane Rectangular CS IX|".into();
        assert_eq!(named.crs().horizontal, Some(6677));
        assert!(keys(&[]).crs().is_unstated());
    }
}
