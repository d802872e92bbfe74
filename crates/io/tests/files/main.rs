//! One integration binary: round trips, damaged files, contracts.

mod clouds;
mod contracts;
mod exports;
mod foreign;
mod inputs;
mod sample;
mod site_folder;
