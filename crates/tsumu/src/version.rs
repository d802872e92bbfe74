//! What program this is: for `--version`, manifests and reports.

/// Version and commit on one line. `+` after the commit: the sources had been changed since; "unknown": built without git.
pub const STAMP: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TSUMU_COMMIT"), ")");

/// Everything, for `--version`.
pub const LONG: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit:   ",
    env!("TSUMU_COMMIT"),
    "\nfeatures: ",
    env!("TSUMU_FEATURES"),
    "\ntarget:   ",
    env!("TSUMU_TARGET"),
    ", opt-level ",
    env!("TSUMU_OPT_LEVEL"),
);
