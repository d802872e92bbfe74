//! What can be wrong with a catalogue entry.

/// Names the block and says what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BlockError {
    /// Neither or both of `shape` and `mesh`.
    #[error("block `{name}`: give either `shape` or `mesh`, not both and not neither")]
    ShapeOrMesh {
        /// Block name.
        name: String,
    },
    /// A size that is not a positive length.
    #[error("block `{name}`: a size of {size} m is not between 1 mm and 100 m; is the unit right?")]
    BadSize {
        /// Block name.
        name: String,
        /// The value.
        size: f32,
    },
    /// A density that is not positive.
    #[error(
        "block `{name}`: density_kg_m3 = {density} is not between 10 and 30,000 (concrete: 2300)"
    )]
    BadDensity {
        /// Block name.
        name: String,
        /// The value.
        density: f32,
    },
    /// A mesh without its unit.
    #[error(
        "block `{name}`: add `unit = \"m\"`, \"cm\", \"mm\", \"in\" or \"ft\": a mesh file does not say what its numbers mean"
    )]
    NoUnit {
        /// Block name.
        name: String,
    },
    /// The mesh is not a solid.
    #[error("block `{name}`: {source}")]
    Mesh {
        /// Block name.
        name: String,
        /// Why.
        source: geom::MeshError,
    },
    /// Surfaces that lie in each other, or are turned inside out.
    #[error(
        "block `{name}`: the mesh's surfaces lie in each other or are turned inside out (triangle {}: the solid is counted {} times behind it and {} times before it, which must be 1 and 0); unite the bodies in your CAD program",
        sides.triangle + 1, sides.behind, sides.before
    )]
    Shells {
        /// Block name.
        name: String,
        /// Where.
        sides: geom::Sides,
    },
    /// The file could not be read.
    #[error("block `{name}`: {message}")]
    Read {
        /// Block name.
        name: String,
        /// The reader's message, with the path.
        message: String,
    },
    /// Two entries of one name.
    #[error("block `{name}` is named twice in the catalogue")]
    Duplicate {
        /// Block name.
        name: String,
    },
    /// A name no file or page can hold.
    #[error(transparent)]
    Name(#[from] scene::NameError),
    /// More types than a search can tell apart in bearable time.
    #[error(
        "the catalogue has {types} [[block]] entries, at most {limit} are searched; leave out those this site does not have"
    )]
    TooManyTypes {
        /// Entries.
        types: usize,
        /// Most.
        limit: usize,
    },
    /// No entries.
    #[error("the catalogue has no [[block]] entry")]
    NoBlocks,
    /// Not built in yet.
    #[error("block `{name}`: {what}")]
    Unsupported {
        /// Block name.
        name: String,
        /// What is missing.
        what: &'static str,
    },
}
