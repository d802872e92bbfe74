//! One integration binary: round trips, damaged files, contracts.

mod clouds;
mod contracts;
mod site_folder;
