//! Blocks by kind and nominal tonnage, as people order them: `tetrapod 5t`.

use crate::Shape;

/// Density that nominal masses are taken with where no volume is tabulated, kg/m³.
const CONCRETE: f32 = 2300.0;

/// Tetrapods are made in steps of preferred numbers: nominal tonnes and volume, m³.
const TETRAPODS: [(f32, f32); 18] = [
    (0.5, 0.2),
    (1.0, 0.4),
    (2.0, 0.8),
    (3.2, 1.25),
    (4.0, 1.6),
    (5.0, 2.0),
    (6.3, 2.5),
    (8.0, 3.2),
    (10.0, 4.0),
    (12.5, 5.0),
    (16.0, 6.3),
    (20.0, 8.0),
    (25.0, 10.0),
    (32.0, 12.5),
    (40.0, 16.0),
    (50.0, 20.0),
    (64.0, 25.0),
    (80.0, 32.0),
];
/// Tonnages that other kinds are listed with.
const LISTED_T: [f32; 8] = [2.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 32.0];

/// A kind of block: its name, volume over the cube of its size, and the shape of a size.
struct Kind {
    name: &'static str,
    volume: f32,
    shape: fn(f32) -> Shape,
}

/// Volume of the six-leg unit over the cube of its length.
pub const SIX_LEG_VOLUME: f32 = 0.176;

/// Volume of the hollow tetrahedron over the cube of its height.
pub const HOLLOW_TETRAHEDRON_VOLUME: f32 = 0.339;

const KINDS: [Kind; 9] = [
    Kind { name: "tetrapod", volume: 0.28, shape: |size| Shape::Tetrapod { size } },
    Kind { name: "dolos", volume: 0.16, shape: |size| Shape::Dolos { size } },
    Kind { name: "cube", volume: 1.0, shape: |size| Shape::Cube { size } },
    Kind { name: "antifer", volume: 1.0247, shape: |size| Shape::Antifer { size } },
    Kind { name: "core-loc-like", volume: 0.2236, shape: |size| Shape::CoreLocLike { size } },
    Kind { name: "xbloc-like", volume: 1.0 / 3.0, shape: |size| Shape::XblocLike { size } },
    Kind { name: "accropode-like", volume: 0.34, shape: |size| Shape::AccropodeLike { size } },
    Kind { name: "six-leg-like", volume: SIX_LEG_VOLUME, shape: |size| Shape::SixLegLike { size } },
    Kind {
        name: "hollow-tetrahedron-like",
        volume: HOLLOW_TETRAHEDRON_VOLUME,
        shape: |size| Shape::HollowTetrahedronLike { size },
    },
];

/// One block of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalBlock {
    /// Kind, as `shape` takes it.
    pub kind: &'static str,
    /// Nominal mass, tonnes.
    pub tonnes: f32,
    /// Volume, m³.
    pub volume_m3: f32,
    /// Height (dolos: fluke length; cube: edge), metres.
    pub size_m: f32,
    /// The shape itself.
    pub shape: Shape,
}

impl NominalBlock {
    fn of(kind: &Kind, tonnes: f32) -> Self {
        let tabulated = TETRAPODS.iter().find(|t| kind.name == "tetrapod" && t.0 == tonnes);
        let volume_m3 = tabulated.map_or(tonnes * 1000.0 / CONCRETE, |t| t.1);
        let size_m = (volume_m3 / kind.volume).cbrt();
        Self { kind: kind.name, tonnes, volume_m3, size_m, shape: (kind.shape)(size_m) }
    }

    /// The name that gives this block: `tetrapod 5t`.
    pub fn name(&self) -> String {
        format!("{} {}t", self.kind, self.tonnes)
    }
}

/// Every block that is listed: kind by kind, the lightest first.
pub fn nominal_blocks() -> Vec<NominalBlock> {
    let of = |kind: &'static Kind| {
        let tonnes: Vec<f32> = if kind.name == "tetrapod" {
            TETRAPODS.iter().map(|t| t.0).collect()
        } else {
            LISTED_T.to_vec()
        };
        tonnes.into_iter().map(move |t| NominalBlock::of(kind, t))
    };
    KINDS.iter().flat_map(of).collect()
}

/// The shape of a name: a kind with its nominal tonnage (`tetrapod 5t`, any tonnage) or with its size (`cube 1.5m`).
/// `Err` says what can be written.
pub fn shape_of_name(name: &str) -> Result<Shape, String> {
    let kinds = KINDS.map(|k| k.name).join(", ");
    let plain = name.trim().to_lowercase();
    let Some((kind, number)) = plain.split_once(char::is_whitespace) else {
        return Err(format!(
            "`{name}` has no tonnage or size: write e.g. \"tetrapod 5t\" or \"cube 1.5m\""
        ));
    };
    let Some(kind) = KINDS.iter().find(|k| k.name == kind) else {
        return Err(format!("`{kind}` is no built-in block; there are {kinds}"));
    };
    let number = number.trim();
    let bad = || format!("`{number}` is neither a tonnage (5t) nor a size (1.5m)");
    let value = |unit: &str| number.strip_suffix(unit).and_then(|n| n.trim().parse::<f32>().ok());
    let sound = |v: &f32| *v > 0.0 && v.is_finite();
    if let Some(tonnes) = value("t").filter(sound) {
        return Ok(NominalBlock::of(kind, tonnes).shape);
    }
    value("m").filter(sound).map(kind.shape).ok_or_else(bad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_shapes() {
        let Ok(Shape::Tetrapod { size }) = shape_of_name("tetrapod 5t") else { panic!() };
        assert!((size - 1.926).abs() < 1e-3, "{size}");
        assert_eq!(shape_of_name(" Cube  1.5 m"), Ok(Shape::Cube { size: 1.5 }));
        let Ok(Shape::Dolos { size }) = shape_of_name("dolos 7.36 t") else { panic!() };
        assert!((size.powi(3) * 0.16 - 3.2).abs() < 1e-3);
        for bad in ["tetrapod", "sealock 5t", "cube 5", "cube -1m", "cube 0t", ""] {
            assert!(shape_of_name(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_listed_name_gives_its_block() {
        let all = nominal_blocks();
        assert!(all.len() > 40);
        for block in all {
            assert_eq!(shape_of_name(&block.name()), Ok(block.shape), "{}", block.name());
        }
    }
}
