//! What can be wrong with a physics setting or a block handed to the engine.

/// Names the setting or the block and says what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A setting out of range.
    #[error("physics.{key} = {value} is not allowed: {why}")]
    BadSetting {
        /// Key in the file.
        key: &'static str,
        /// The value.
        value: f32,
        /// What is allowed.
        why: &'static str,
    },
    /// A block without convex parts.
    #[error("block `{name}` has no convex parts to collide with; its mesh may not be a solid")]
    NoParts {
        /// Block name.
        name: String,
    },
    /// Convex parts that are not the block.
    #[error(
        "block `{name}`: its {parts} convex parts take {percent:.0} % of the mesh's volume, off by more than {most:.0} %, so piles of it \
         would stand at a wrong height; close bores and hollows that nothing reaches into, or thicken thin walls, in the mesh"
    )]
    LooseParts {
        /// Block name.
        name: String,
        /// How many parts.
        parts: usize,
        /// Volume of their union, per cent of the mesh's.
        percent: f32,
        /// What is allowed, per cent.
        most: f32,
    },
    /// A convex part that is flat.
    #[error("block `{name}`: convex part {part} is flat, so it has no hull; repair the mesh")]
    FlatPart {
        /// Block name.
        name: String,
        /// Part number, from 0.
        part: usize,
    },
    /// A solid without mass.
    #[error("block `{name}` weighs {mass_kg} kg; volume and density must be above 0")]
    NoMass {
        /// Block name.
        name: String,
        /// Its mass.
        mass_kg: f32,
    },
}
