//! What an EPSG code means as far as a survey is concerned: projected or not, its unit, which way its heights run.

use super::Unit;
use super::epsg_table::{COMPOUNDS, RUNS};

/// An entry of the table; the number is the unit in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Entry {
    Geographic,
    Geocentric,
    /// Projected, in another unit than metres.
    Feet(f64),
    /// A vertical system.
    Height(f64),
    /// A vertical system that counts downwards.
    Depth(f64),
}

/// What a code is.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// Plane coordinates in this unit. Codes that the table does not hold are taken for such in metres.
    Projected(Unit),
    /// Latitude and longitude.
    Geographic,
    /// Three axes from the middle of the earth.
    Geocentric,
    /// Heights alone.
    Vertical {
        /// Their unit.
        unit: Unit,
        /// They grow downwards.
        depth: bool,
    },
    /// A horizontal and a vertical code.
    Compound(u32, u32),
}

/// Looks the code up.
pub fn meaning(code: u32) -> Meaning {
    if let Ok(i) = COMPOUNDS.binary_search_by_key(&code, |c| c.0) {
        return Meaning::Compound(COMPOUNDS[i].1, COMPOUNDS[i].2);
    }
    let after = RUNS.partition_point(|r| r.0 <= code);
    let run = after.checked_sub(1).map(|i| RUNS[i]).filter(|r| code <= r.1);
    match run.map(|r| r.2) {
        Some(Entry::Geographic) => Meaning::Geographic,
        Some(Entry::Geocentric) => Meaning::Geocentric,
        Some(Entry::Feet(unit)) => Meaning::Projected(Unit::of_metres(unit)),
        Some(Entry::Height(unit)) => {
            Meaning::Vertical { unit: Unit::of_metres(unit), depth: false }
        }
        Some(Entry::Depth(unit)) => Meaning::Vertical { unit: Unit::of_metres(unit), depth: true },
        None => Meaning::Projected(Unit::metre()),
    }
}

/// `EPSG:n` (any case, blanks allowed) as its number.
pub fn code(text: &str) -> Option<u32> {
    let (authority, number) = text.trim().split_once(':')?;
    authority.trim().eq_ignore_ascii_case("EPSG").then(|| number.trim().parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_mean_what_the_register_says() {
        let metres = |code| match meaning(code) {
            Meaning::Projected(unit) => Some(unit.metres),
            _ => None,
        };
        assert_eq!([6669, 6679, 6687, 2451, 32654].map(metres), [Some(1.0); 5]);
        assert!((metres(2227).unwrap() - 0.304_800_609_6).abs() < 1e-9);
        assert_eq!(metres(2994), Some(0.3048));
        for code in [4326, 6668, 4612, 4979, 4301] {
            assert_eq!(meaning(code), Meaning::Geographic, "{code}");
        }
        assert_eq!(meaning(4978), Meaning::Geocentric);
        assert_eq!(meaning(6695), Meaning::Vertical { unit: Unit::metre(), depth: false });
        assert!(
            matches!(meaning(6360), Meaning::Vertical { unit, depth: false } if unit.name == "US survey foot")
        );
        assert!(matches!(meaning(5706), Meaning::Vertical { depth: true, .. }));
        assert_eq!(meaning(6697), Meaning::Compound(6668, 6695));
    }

    #[test]
    fn the_table_is_in_order() {
        assert!(RUNS.windows(2).all(|w| w[0].1 < w[1].0));
        assert!(COMPOUNDS.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn codes_are_read_as_people_write_them() {
        assert_eq!(code("epsg: 6679"), Some(6679));
        assert_eq!(code("6679"), None);
        assert_eq!(code("EPSG:x"), None);
    }
}
