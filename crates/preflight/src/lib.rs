//! Looks at a site before it is worked on: every complaint at once, and whether the question can be answered. And writes a first
//! site from surveys alone.

mod check;
mod first_site;
mod look;
mod overlap;
mod site_map;
mod texture;

pub use check::{Expected, Preflight, SizeLook, SurfaceLook, check, check_read, step_objection};
pub use first_site::{FirstSite, InitError, first_site};
pub use look::{SurveyLook, look_of_cloud};
pub use site_map::{SiteMap, site_map};
pub use texture::Texture;
