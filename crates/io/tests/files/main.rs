//! One integration binary: round trips, damaged files, contracts.

mod clouds;
