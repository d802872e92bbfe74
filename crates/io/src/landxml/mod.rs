//! LandXML 1.2: triangulated surfaces out and in, alignments in. Points run north, east, up, as the standard has it.

mod alignment;
mod document;
mod surface;
mod write;

pub use alignment::read_alignment;
pub use surface::{LandXmlSurface, read, read_surface};
pub use write::{Surface, text, write, write_with};
pub(crate) use write::{escaped, offset_m};
