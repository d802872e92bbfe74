//! What program this is: for `--version`, manifests and reports.

use io::IoError;
use io::manifest::Entry;
use std::io::ErrorKind;
use std::sync::OnceLock;

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

/// Size and hash of the running program's file, the shipped weights in it included (of the Python package: the interpreter's);
/// `None` where the system does not say where it is, or does not let it be read. Errors: it fails otherwise, so that no run is
/// sealed without it by chance.
pub fn program_file() -> Result<Option<&'static Entry>, IoError> {
    static FILE: OnceLock<Option<Entry>> = OnceLock::new();
    if FILE.get().is_none() {
        // Whoever else comes first has found the same.
        let _ = FILE.set(read_program_file()?);
    }
    Ok(FILE.get().and_then(Option::as_ref))
}

fn read_program_file() -> Result<Option<Entry>, IoError> {
    let Ok(path) = std::env::current_exe() else { return Ok(None) };
    match io::manifest::entry(&path) {
        Ok(entry) => Ok(Some(entry)),
        Err(IoError::Os { source, .. })
            if matches!(source.kind(), ErrorKind::NotFound | ErrorKind::PermissionDenied) =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// The class of processor. Results are equal to the byte between `x86-64-v3` and `x86-64-v4` (docs/trust.md says for which
/// networks and policies); elsewhere within a class, and to some tenths of a millimetre between classes.
pub fn processor() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let wide = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl");
        if wide {
            return "x86-64-v4";
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return "x86-64-v3";
        }
    }
    std::env::consts::ARCH
}
