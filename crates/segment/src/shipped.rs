//! The weights inside the program: no download, no path. Their cards lie beside them in `weights/`.

use crate::{SegmentError, SegmentModel};
use scene::Catalog;

/// Tetrapods from the air and by echo sounder: the default for them.
const TETRAPOD: &[u8] = include_bytes!("../weights/tetrapod.safetensors");

/// The five built-in parts in bins, seen by a depth camera: for labels by the network alone. Poses are found as well from those for
/// any shape.
const BIN_PARTS: &[u8] = include_bytes!("../weights/bin-parts.safetensors");

/// Blocks and parts of any shape: the default for whatever the tetrapod's weights do not know.
const ANY_SHAPE: &[u8] = include_bytes!("../weights/any-shape.safetensors");

/// The thesis' first network, for tetrapods without ground; for comparisons.
const FPCC: &[u8] = include_bytes!("../weights/fpcc.safetensors");

/// Name, as `--model` takes it, and bytes.
const SHIPPED: &[(&str, &[u8])] =
    &[("tetrapod", TETRAPOD), ("bin-parts", BIN_PARTS), ("any-shape", ANY_SHAPE), ("fpcc", FPCC)];

impl SegmentModel {
    /// The shipped weights for this catalogue: the tetrapod's when it holds nothing else, otherwise those for any shape.
    /// Which they are stands in `description.name`.
    pub fn shipped(catalog: &Catalog) -> Result<Self, SegmentError> {
        let tetrapod = Self::from_bytes(TETRAPOD)?;
        if tetrapod.unseen_types(catalog).is_empty() {
            Ok(tetrapod)
        } else {
            Self::from_bytes(ANY_SHAPE)
        }
    }

    /// Shipped weights by name; `None` for a name there are none of.
    pub fn shipped_as(name: &str) -> Option<Result<Self, SegmentError>> {
        SHIPPED.iter().find(|s| s.0 == name).map(|s| Self::from_bytes(s.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Shape;

    #[test]
    fn tetrapods_of_any_size_have_their_weights_and_a_cube_among_them_asks_for_those_of_any_shape()
    {
        let model = |name: &str, shape| blocks::shape_model(name, shape, 2300.0).unwrap();
        let mut models = vec![
            model("small", Shape::Tetrapod { size: 0.3 }),
            model("large", Shape::Tetrapod { size: 4.0 }),
        ];
        let shipped = SegmentModel::shipped(&Catalog::new(models.clone())).unwrap();
        assert!(shipped.description.name.contains("tetrapod"));
        models.push(model("cube", Shape::Cube { size: 2.0 }));
        let catalog = Catalog::new(models);
        assert_eq!(shipped.unseen_types(&catalog), ["cube"]);
        let any = SegmentModel::shipped(&catalog).unwrap();
        assert!(
            any.description.name.contains("any shape") && any.unseen_types(&catalog).is_empty()
        );
    }

    #[test]
    fn the_weights_of_bin_parts_know_the_five_and_no_others() {
        let part = |shape| blocks::shape_model("part", shape, 7850.0).unwrap();
        let weights = SegmentModel::shipped_as("bin-parts").unwrap().unwrap();
        let five = [
            Shape::EyeBolt { size: 0.154 },
            Shape::GearShaft { size: 0.2 },
            Shape::HoledPlate { size: 0.091 },
            Shape::HookPlate { size: 0.152 },
            Shape::Bracket { size: 0.091 },
        ];
        let own = Catalog::new(five.map(part).to_vec());
        assert!(weights.unseen_types(&own).is_empty(), "{:?}", weights.unseen_types(&own));
        let other = Catalog::new(vec![part(Shape::Cube { size: 0.1 })]);
        assert_eq!(weights.unseen_types(&other), ["part"]);
    }

    #[test]
    fn all_shipped_weights_load_by_name() {
        assert!(SHIPPED.iter().all(|s| SegmentModel::shipped_as(s.0).unwrap().is_ok()));
        assert!(SegmentModel::shipped_as("nothing").is_none());
    }

    /// Weights come from elsewhere too: damage is named, nothing panics, and no claim takes memory.
    #[test]
    fn damaged_weights_are_refused_or_harmless() {
        let header = 8 + u64::from_le_bytes(TETRAPOD[..8].try_into().unwrap()) as usize;
        let refused = |bytes: &[u8]| SegmentModel::from_bytes(bytes).is_err();
        for cut in [0, 7, 8, header / 2, header, header + 1, TETRAPOD.len() - 1] {
            assert!(refused(&TETRAPOD[..cut]), "cut at {cut}");
        }
        let text = String::from_utf8(TETRAPOD[8..header].to_vec()).unwrap();
        let with = |text: &str| {
            [&(text.len() as u64).to_le_bytes()[..], text.as_bytes(), &TETRAPOD[header..]].concat()
        };
        for (from, to) in [
            (r#"\"out\":512"#, r#"\"out\":99999999"#),
            (r#"\"edge\":["#, r#"\"edge\":[4000000000,"#),
            (r#"\"out\":512"#, r#"\"out\":-1"#),
            (r#"\"vote_width\":0."#, r#"\"vote_width\":1e9"#),
            (r#"\"vote_width\":0."#, r#"\"vote_width\":-0."#),
            ("\"F16\"", "\"F99\""),
            ("data_offsets\":[0,", "data_offsets\":[18446744073709551615,"),
            ("\"shape\":[", "\"shape\":[18446744073709551615,18446744073709551615,"),
        ] {
            let bomb = text.replace(from, to);
            assert!(bomb != text, "{from} is not in the header");
            assert!(refused(&with(&bomb)), "{to}");
        }
        let tree = geom::SeedTree::new(5);
        let mut named = 0;
        for i in 0..150 {
            let mut mutant = TETRAPOD.to_vec();
            for step in 0..3 {
                let at = (tree.child("at", 3 * i + step).value() % header as u64) as usize;
                mutant[at] = tree.child("byte", 3 * i + step).value() as u8;
            }
            named += usize::from(refused(&mutant));
        }
        assert!(named > 100, "{named}");
    }
}
