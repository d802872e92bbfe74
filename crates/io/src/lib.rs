//! Files in and out, one format a file; whole or not at all.
//!
//! Readers check every count of a header against the size of the file before they allocate, name the file and
//! the line or record in every error, and repair nothing. Writers use a temporary name until the file is whole.

pub mod alignment_file;
pub mod as_built_csv;
pub mod as_placed_csv;
pub mod atomic;
pub mod block_points_csv;
pub mod blocks_csv;
pub mod changes_csv;
pub mod changes_geojson;
pub mod changes_gpkg;
pub mod choices_csv;
pub mod covariance_csv;
pub mod crs;
pub mod design_file;
pub mod details;
pub mod drawing;
pub mod dxf;
pub mod e57_scan;
pub mod export_set;
pub mod geojson;
pub mod geopackage;
pub mod geotiff;
pub mod glb;
pub mod ifc;
mod input;
pub mod label_cloud;
pub mod landxml;
pub mod las;
pub mod lifts_csv;
pub mod manifest;
pub mod mesh;
pub mod not_judged_csv;
pub mod npy;
pub mod obj;
mod own_hash;
pub mod pcd;
pub mod placements_csv;
pub mod ply;
pub mod points;
pub mod polygon;
pub mod qgis_project;
pub mod raster;
pub mod ratings;
pub mod read_options;
pub mod relabel;
pub mod review;
pub mod sensor_place;
pub mod signature;
pub mod site;
pub mod stl;
pub mod text_cloud;
pub mod text_lines;
pub mod thinning;
pub mod tin;
pub mod tin_thinning;
pub mod unfilled_csv;
pub mod what_if_csv;
pub mod xlsx;

mod csv_table;
mod error;
mod geotiff_band;
mod geotiff_writer;
mod qgis_style;
mod raw_cloud;
mod vector_layers;

pub use csv_table::SitePose;
pub use error::{IoError, Place};
pub use input::{Input, open_regular, read_bytes, read_text};
pub use raw_cloud::RawCloud;
pub use read_options::{LeaveOut, ReadOptions};
