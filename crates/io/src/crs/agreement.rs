//! Whether the coordinate systems that files name agree with the site's and with each other.

use super::{CrsKind, FileCrs, epsg};
use scene::Complaint;

/// The horizontal code that a site's `crs` stands for; `Err` says why it cannot be used. `none` and an empty text are `None`.
pub fn site_code(crs: &str) -> Result<Option<u32>, String> {
    if crs.is_empty() || crs == "none" {
        return Ok(None);
    }
    let Some(code) = epsg::code(crs) else {
        return Err(format!("`crs` = \"{crs}\" is not an EPSG code"));
    };
    match epsg::meaning(code) {
        epsg::Meaning::Projected(unit) if unit.is_metre() => Ok(Some(code)),
        epsg::Meaning::Projected(unit) => {
            Err(format!("EPSG:{code} counts in the {unit}, not in metres"))
        }
        epsg::Meaning::Geographic => {
            Err(format!("EPSG:{code} is geographic: its coordinates are degrees, not metres"))
        }
        epsg::Meaning::Geocentric => {
            Err(format!("EPSG:{code} is geocentric: its axes are not east, north and up"))
        }
        epsg::Meaning::Vertical { .. } => Err(format!("EPSG:{code} is a system of heights alone")),
        epsg::Meaning::Compound(horizontal, _) => site_code(&format!("EPSG:{horizontal}")),
    }
}

/// Compares what each file says with the site's `crs` (`EPSG:n`, `none`, or empty: not stated yet) and with the other files.
/// The site's own code must have passed [`site_code`].
pub fn disagreements(site_crs: &str, files: &[(String, FileCrs)]) -> Vec<Complaint> {
    let mut out: Vec<Complaint> =
        files.iter().filter_map(|(file, crs)| unusable(file, crs)).collect();
    let stated = site_code(site_crs).ok().flatten();
    let first =
        files.iter().find(|(_, crs)| crs.kind == CrsKind::Projected && crs.horizontal.is_some());
    for (file, crs) in files {
        if crs.kind != CrsKind::Projected {
            continue;
        }
        let Some(code) = crs.horizontal else {
            let found =
                format!("the file names {} without a code that could be compared", crs.label());
            out.push(Complaint::note("crs-without-code", file, found));
            continue;
        };
        let is = |other: u32| code == other || crs.alternatives.contains(&other);
        match (stated, first) {
            (Some(site), _) if !is(site) => out.push(Complaint::refusal(
                "crs-differs",
                file,
                format!("the file is in {}, the site in EPSG:{site}", crs.label()),
                "put the right code into `crs`, or bring the file into the site's system before",
            )),
            (None, Some((other, theirs)))
                if !theirs.horizontal.is_some_and(is) && !theirs.alternatives.contains(&code) =>
            {
                out.push(Complaint::refusal(
                    "crs-differs",
                    file,
                    format!("the file is in {}, but {other} in {}", crs.label(), theirs.label()),
                    "bring all files into one system before",
                ));
            }
            _ if site_crs == "none" => out.push(Complaint::warning(
                "crs-not-used",
                file,
                format!("the file is in {}, but the site says `crs = \"none\"`", crs.label()),
                format!("write `crs = \"EPSG:{code}\"` unless this is a bin"),
            )),
            _ => {}
        }
    }
    out.extend(vertical_differences(files));
    out
}

/// Why a file's coordinates cannot be worked with, whatever the site.
fn unusable(file: &str, crs: &FileCrs) -> Option<Complaint> {
    let refuse =
        |code, found: String, advice: &str| Some(Complaint::refusal(code, file, found, advice));
    match crs.kind {
        CrsKind::Geographic => refuse(
            "crs-geographic",
            format!("by the file its coordinates are degrees ({})", crs.label()),
            "project the file into the site's plane coordinates before",
        ),
        CrsKind::Geocentric => refuse(
            "crs-geocentric",
            format!("the axes start in the middle of the earth ({})", crs.label()),
            "project the file into the site's plane coordinates before",
        ),
        _ => {
            let unit = crs.unit.as_ref().filter(|u| !u.is_metre())?;
            refuse(
                "unit-not-metre",
                format!("the plane coordinates are in the {unit} ({})", crs.label()),
                "bring the file into plane coordinates in metres before",
            )
        }
    }
}

/// Heights that refer to different vertical systems.
fn vertical_differences(files: &[(String, FileCrs)]) -> Vec<Complaint> {
    let mut stated = files.iter().filter_map(|(f, c)| Some((f, c.vertical?)));
    let Some((first, code)) = stated.next() else { return Vec::new() };
    stated
        .filter(|(_, other)| *other != code)
        .map(|(file, other)| {
            Complaint::warning(
                "vertical-differs",
                file,
                format!("the heights refer to EPSG:{other}, those of {first} to EPSG:{code}"),
                "see that `vertical_offset_m` brings each survey to the site's vertical datum",
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crs::Unit;
    use scene::Severity;

    fn file(name: &str, code: u32) -> (String, FileCrs) {
        (name.into(), FileCrs::of_code(code))
    }

    fn refusals(site: &str, files: &[(String, FileCrs)]) -> Vec<String> {
        let all = disagreements(site, files);
        all.iter().filter(|c| c.severity == Severity::Refusal).map(ToString::to_string).collect()
    }

    #[test]
    fn another_zone_is_refused_naming_both_codes() {
        let lines = refusals("EPSG:6679", &[file("a.laz", 6677), file("b.laz", 6679)]);
        assert_eq!(lines.len(), 1);
        assert!(
            lines[0].contains("a.laz") && lines[0].contains("6677") && lines[0].contains("6679")
        );
        assert!(
            refusals("EPSG:6679", &[file("b.laz", 6679), ("c.xyz".into(), FileCrs::default())])
                .is_empty()
        );
        // Without the site's word the files are held against each other.
        let lines = refusals("", &[file("a.laz", 6677), file("b.laz", 6679)]);
        assert!(lines.len() == 1 && lines[0].contains("b.laz") && lines[0].contains("6677"));
    }

    #[test]
    fn degrees_and_feet_are_refused_by_name() {
        let lines =
            refusals("EPSG:6679", &[file("a.las", 6668), file("b.tif", 2227), file("c.las", 4978)]);
        assert!(lines.iter().any(|l| l.contains("degrees") && l.contains("6668")));
        assert!(lines.iter().any(|l| l.contains("US survey foot")));
        assert!(lines.iter().any(|l| l.contains("middle of the earth")));
        let feet = FileCrs { unit: Some(Unit::of_word("foot")), ..FileCrs::of_code(6679) };
        assert!(refusals("EPSG:6679", &[("d.las".into(), feet)])[0].contains("international foot"));
        assert!(site_code("EPSG:4326").unwrap_err().contains("degrees"));
        assert!(site_code("EPSG:2227").unwrap_err().contains("foot"));
        assert!(site_code("EPSG:5703").unwrap_err().contains("heights"));
        assert_eq!(site_code("EPSG:6679"), Ok(Some(6679)));
        assert_eq!(site_code("none"), Ok(None));
    }

    #[test]
    fn a_bin_with_a_code_is_asked_about() {
        let all = disagreements("none", &[file("a.laz", 6677)]);
        assert_eq!(all[0].severity, Severity::Warning);
    }
}
