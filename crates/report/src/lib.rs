//! One HTML file a person opens by double click: 3D view, plan view, sections, tables, numbers with units.
//!
//! In: [`ReportInput`], plain values that other crates computed. Out: a page that needs no network, no server
//! and no other file. Nothing here computes a figure; what is drawn is scaled and coloured, never judged.

pub mod changes_page;
pub mod colour;
pub mod input;
pub mod lights;
pub mod picture;
pub mod relief;
pub mod sheets;
pub mod still;
pub mod text;

mod blob;
mod chart;
mod error;
mod grid;
mod headline;
mod histogram;
mod page;
mod points;
mod script;
mod types_table;
mod view_data;

pub use error::ReportError;
pub use input::{
    Alignment, Count, Figure, Histogram, Light, LightState, MapLayer, Outline, Rating, RatingPlace,
    RatingWeight, ReportInput, Section, SectionLine, SectionLineKind, Surfaces, UnfilledWindow,
};
pub use page::{STYLE, html};
pub use picture::{pile_picture, site_picture};
pub use script::MODULES;
pub use sheets::{SheetFont, SheetSet, sheets};
pub use still::{Camera, Image, Lens, StillMesh, StillPoints, still};
pub use text::Text;
