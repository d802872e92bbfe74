//! The weights inside the program: no download, no path. Their cards lie beside them in `weights/`.

use crate::{SegmentError, SegmentModel};
use scene::Catalog;

/// Tetrapods from the air and by echo sounder: the default for them.
const TETRAPOD: &[u8] = include_bytes!("../weights/tetrapod.safetensors");

/// Name, as `--model` takes it, and bytes.
const SHIPPED: &[(&str, &[u8])] = &[("tetrapod", TETRAPOD)];

impl SegmentModel {
    /// The shipped weights for this catalogue. Which they are stands in `description.name`; blocks of a shape they
    /// never saw are named by [`SegmentModel::strangers`], and [`crate::segment`] warns of them.
    pub fn shipped(_catalog: &Catalog) -> Result<Self, SegmentError> {
        Self::from_bytes(TETRAPOD)
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
    fn tetrapods_of_any_size_are_known_and_cubes_are_strangers() {
        let model = |name: &str, shape| blocks::shape_model(name, shape, 2300.0).unwrap();
        let catalog = Catalog::new(vec![
            model("small", Shape::Tetrapod { size: 0.3 }),
            model("large", Shape::Tetrapod { size: 4.0 }),
            model("cube", Shape::Cube { size: 2.0 }),
        ]);
        let shipped = SegmentModel::shipped(&catalog).unwrap();
        assert_eq!(shipped.strangers(&catalog), ["cube"]);
        assert!(shipped.description.name.contains("tetrapod"));
    }

    #[test]
    fn all_shipped_weights_load_by_name() {
        assert!(SHIPPED.iter().all(|s| SegmentModel::shipped_as(s.0).unwrap().is_ok()));
        assert!(SegmentModel::shipped_as("nothing").is_none());
    }
}
