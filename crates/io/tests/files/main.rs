//! One integration binary: round trips, damaged files, contracts.

mod clouds;
mod contracts;
mod exports;
mod sample;
mod site_folder;
