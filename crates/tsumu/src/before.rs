//! Before a run: a site looked at, all complaints at once; and a first site from surveys alone.

use crate::block_look::look_closely;
use crate::error::OrBadInput;
use crate::{Error, Job, Result};
use anyhow::{Context, anyhow};
use geom::{Event, Observer, Stage, Warning};
use pipeline::sizes::WARNED_FROM;
use preflight::{FirstSite, InitError, Preflight};
use scene::Severity;
use std::path::{Path, PathBuf};

/// Doubts that reading the site says again.
const SAID_WHEN_READ: [&str; 5] =
    ["block", "strays", "float32", "crs-not-used", "vertical-differs"];

/// Looks at a site folder: every complaint, and whether an answer can be given. Where nothing rules one out, blocks are sought in a
/// part of the surveys and their size held against the catalogue's.
pub fn check(folder: &Path, job: &Job) -> Preflight {
    let mut found = job.install(|| preflight::check(folder, job));
    if found.can_be_answered {
        look_closely(folder, &mut found, job);
    }
    found
}

/// The same before surveys are worked on in parts, which tells the blocks' size itself: doubts are warned of. Error: no answer can be
/// given; every reason is a line of it. [`Site::load_checked`](crate::Site::load_checked) does so while it reads.
pub fn check_first(folder: &Path, job: &Job) -> Result<()> {
    let found = job.install(|| preflight::check(folder, job));
    tell(&found, job)
}

/// Warns of what a check before a run has found; its refusals are the error.
pub(crate) fn tell(found: &Preflight, job: &Job) -> Result<()> {
    let cannot = cannot(found);
    let doubts = found.complaints.iter().filter(|c| c.severity == Severity::Warning);
    // A site that goes on to be read warns of some itself.
    for doubt in doubts.filter(|c| cannot.is_some() || !SAID_WHEN_READ.contains(&c.code)) {
        let message = doubt.to_string();
        job.event(Event::Warned(Warning { stage: Stage::Check, message }));
    }
    cannot.map_or(Ok(()), Err)
}

/// The error of a site that cannot be answered, a line for each reason; `None` for one that can.
pub fn cannot(found: &Preflight) -> Option<Error> {
    Error::of_lines(found.because.clone())
}

/// Writes what a check has seen from above as a JSON file; nothing where no survey could be read. Errors: a file of another kind is
/// there.
pub fn write_map(found: &Preflight, file: &Path) -> Result<()> {
    let Some(map) = preflight::site_map(found) else { return Ok(()) };
    io::atomic::write_over_own_kind(file, &serde_json::to_vec(&map)?).or_bad_input()
}

/// Writes `site.toml` and `catalog.toml` of a first site into `folder`: everything that the surveys say, guesses marked as such.
/// Errors: a survey cannot be read, no such block, the folder has a site already.
pub fn init(
    surveys: &[PathBuf],
    block: Option<&str>,
    folder: &Path,
    job: &Job,
) -> Result<FirstSite> {
    let files = ["site.toml", "catalog.toml"].map(|name| folder.join(name));
    if let Some(file) = files.iter().find(|file| file.exists()) {
        return Err(Error::bad_input(anyhow!(
            "{}: is there already and stays as it is; choose another folder with --out",
            file.display()
        )));
    }
    let made = job.install(|| preflight::first_site(surveys, block, folder));
    let mut made = made.map_err(|e| match e {
        InitError::Survey(e) => Error::bad_input(e),
        InitError::Refused(_) => Error::bad_input(e),
    })?;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (file, text) in files.iter().zip([&made.site_toml, &made.catalog_toml]) {
        io::atomic::write_bytes(file, text.as_bytes())?;
    }
    if block.is_none() && as_surveys_show(folder, &mut made, job) {
        io::atomic::write_bytes(&files[1], made.catalog_toml.as_bytes())?;
    }
    Ok(made)
}

/// Surveys up to so many points are asked how large their blocks are.
const ASKED_POINTS: u64 = 20_000_000;

/// Holds the proposed block against the surveys; true where another size is to be written.
fn as_surveys_show(folder: &Path, made: &mut FirstSite, job: &Job) -> bool {
    let found = job.install(|| preflight::check(folder, job));
    // What cannot be answered will be said by the check that the user makes next.
    if !found.can_be_answered || found.expected.points > ASKED_POINTS {
        return false;
    }
    let mut found = found;
    look_closely(folder, &mut found, job);
    let Some(size) = found.sizes.first() else {
        made.without_size();
        return false;
    };
    let same = (size.fits_m / size.catalogue_m - 1.0).abs() < WARNED_FROM;
    if !same {
        made.with_size(size.fits_m, size.fits_sd_m, size.found);
    }
    !same
}
