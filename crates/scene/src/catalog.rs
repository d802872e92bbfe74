//! What `catalog.toml` says, before it becomes a [`crate::Catalog`].

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The whole file: `[[block]]` entries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CatalogSpec {
    /// Block types, at least one.
    pub block: Vec<BlockSpec>,
}

/// One `[[block]]`: a built-in shape or a mesh file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockSpec {
    /// Name used in every output.
    pub name: String,
    /// A built-in shape, by kind and size (`{ kind = "tetrapod", size = 2.0 }`) or by name (`"tetrapod 5t"`); exactly one of `shape`
    /// and `mesh` is given.
    #[serde(default, deserialize_with = "shape_or_name", skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape>,
    /// Path of an STL, OBJ or PLY file, relative to the catalogue file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// Unit of the mesh file's numbers; needed with `mesh`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<LengthUnit>,
    /// Density, kg/m³ (concrete 2300).
    #[serde(default = "concrete_density")]
    pub density_kg_m3: f32,
}

/// A table is read as it always was, so that its messages stay; a text is a name.
fn shape_or_name<'de, D: Deserializer<'de>>(source: D) -> Result<Option<Shape>, D::Error> {
    struct Either;
    impl<'de> Visitor<'de> for Either {
        type Value = Shape;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str("a shape like { kind = \"tetrapod\", size = 2.0 } or \"tetrapod 5t\"")
        }

        fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Shape, E> {
            crate::shape_of_name(name).map_err(E::custom)
        }

        fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Shape, M::Error> {
            Shape::deserialize(MapAccessDeserializer::new(map))
        }
    }
    source.deserialize_any(Either).map(Some)
}

fn concrete_density() -> f32 {
    2300.0
}

/// A parametric block; `size` is its height (cubes: edge), metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// Four tapered legs (Shore Protection Manual proportions); V = 0.280 h³.
    Tetrapod {
        /// Height h, metres.
        size: f32,
    },
    /// Two crossed flukes and a shank, waist ratio 0.32; V = 0.16 C³.
    Dolos {
        /// Fluke length C, metres.
        size: f32,
    },
    /// A cube.
    Cube {
        /// Edge, metres.
        size: f32,
    },
    /// A cube tapered towards its top.
    Antifer {
        /// Height, metres.
        size: f32,
    },
    /// Three crossed flukes on a shank, in the manner of a Core-Loc; V = 0.2236 C³.
    CoreLocLike {
        /// Length C of a fluke, metres.
        size: f32,
    },
    /// Four legs in a plane and two noses, in the manner of an Xbloc; V = D³/3.
    XblocLike {
        /// Height D, metres.
        size: f32,
    },
    /// Two crossed flukes on a core, in the manner of an Accropode; V = 0.34 H³.
    AccropodeLike {
        /// Height H, metres.
        size: f32,
    },
    /// Three bars through one point; V = 0.176 h³.
    SixLegLike {
        /// Length of a bar, metres.
        size: f32,
    },
    /// A frame along the edges of a tetrahedron; V = 0.339 h³.
    HollowTetrahedronLike {
        /// Height on one face, metres.
        size: f32,
    },
    /// A bin part: a ring on a shank.
    EyeBolt {
        /// Length, metres.
        size: f32,
    },
    /// A bin part: a stepped shaft with a toothed wheel.
    GearShaft {
        /// Length, metres.
        size: f32,
    },
    /// A bin part: a dished round plate with six holes.
    HoledPlate {
        /// Diameter, metres.
        size: f32,
    },
    /// A bin part: a holed plate with lugs and pegs that catch in others.
    HookPlate {
        /// Length, metres.
        size: f32,
    },
    /// A bin part: a bracket of sheet with two upright walls.
    Bracket {
        /// Length, metres.
        size: f32,
    },
}

impl Shape {
    /// The one length that decides the shape, metres.
    pub fn size_m(&self) -> f32 {
        match *self {
            Self::Tetrapod { size }
            | Self::Dolos { size }
            | Self::Cube { size }
            | Self::Antifer { size }
            | Self::CoreLocLike { size }
            | Self::XblocLike { size }
            | Self::AccropodeLike { size }
            | Self::SixLegLike { size }
            | Self::HollowTetrahedronLike { size }
            | Self::EyeBolt { size }
            | Self::GearShaft { size }
            | Self::HoledPlate { size }
            | Self::HookPlate { size }
            | Self::Bracket { size } => size,
        }
    }
}

/// Unit of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
    /// Inches.
    In,
    /// Feet (international).
    Ft,
}

impl LengthUnit {
    /// Metres in one unit.
    pub fn metres(self) -> f32 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}
