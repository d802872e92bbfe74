//! The surfaces and sections of a plan, for the report and the exports.

use crate::planning::Planned;
use crate::recognition::Recognition;
use crate::unfilled::why;
use crate::{Result, Site};
use geom::{HeightMap, Vec2, Vec3};
use io::details::{self, Details};
use io::drawing::{Drawing, SectionLine};
use io::export_set::{self, ExportSet};
use io::raster::Raster;
use plan::{CrossSection, Surfaces, Unfilled};
use scene::SiteFrame;
use std::path::{Path, PathBuf};

/// Rasters of one grid and cuts through them, local frame.
pub struct Drawings {
    /// Design, survey, and survey with the plan.
    pub surfaces: Surfaces,
    /// What the blocks lie on, on the same grid.
    pub bed: HeightMap,
    /// Design minus survey.
    pub deficit_before: HeightMap,
    /// Design minus survey with the plan.
    pub deficit_after: HeightMap,
    /// Cuts across the works.
    pub sections: Vec<CrossSection>,
    /// The line chainages run along: east, north in site coordinates.
    pub line: Vec<[f64; 2]>,
    /// How far the works reach left and right of it, metres.
    pub reach_m: [f64; 2],
    /// Lines of the design, each with whether it closes.
    pub design_lines: Vec<(bool, Vec<Vec3>)>,
}

impl Drawings {
    /// Drawn from a plan. Error: the site has no design.
    pub fn of(site: &Site, recognition: &Recognition, planned: &Planned) -> Result<Self> {
        let works = site.works(&recognition.blocks, site.needed_design()?);
        let (surfaces, sections) = pipeline::surfaces(&works, &planned.pile, &planned.plan);
        let (deficit_before, deficit_after) = (surfaces.deficit_before(), surfaces.deficit_after());
        let mut bed = surfaces.design.clone();
        bed.fill_with(|x, y| planned.pile.ground.height_m(x, y));
        let (line, reach_m) = plan::works_line(works.design);
        let design_lines = pipeline::design_lines(&works);
        Ok(Self {
            surfaces,
            bed,
            deficit_before,
            deficit_after,
            sections,
            line,
            reach_m,
            design_lines,
        })
    }

    /// What drawings show beside the blocks.
    fn details(&self, site: &Site, unfilled: &[Unfilled]) -> Details {
        let frame = &site.survey.frame;
        let place = |p: Vec3| frame.site_from_local(p).to_array();
        let line = |(closed, points): &(bool, Vec<Vec3>)| {
            (*closed, points.iter().map(|&p| place(p)).collect())
        };
        let window = |w: &Unfilled| {
            let [east, north, _] = place(w.centre.extend(0.0));
            details::Unfilled {
                centre: [east, north],
                half_m: f64::from(w.half_m),
                void_m3: f64::from(w.void_m3),
                reason: why(w.reason).en,
            }
        };
        Details {
            survey_date: site.survey_date.clone(),
            alignment: self.line.clone(),
            design_lines: self.design_lines.iter().map(line).collect(),
            unfilled: unfilled.iter().map(window).collect(),
            quantities: plan::section_quantities(&self.sections),
        }
    }

    /// Maps by the names that their files have.
    fn maps(&self, frame: &SiteFrame) -> [(&'static str, Raster); 5] {
        [
            ("design", Raster::of_heights(&self.surfaces.design, frame)),
            ("as-surveyed", Raster::of_heights(&self.surfaces.as_surveyed, frame)),
            ("planned", Raster::of_heights(&self.surfaces.planned, frame)),
            ("deficit-before", Raster::of_differences(&self.deficit_before, frame)),
            ("deficit-after", Raster::of_differences(&self.deficit_after, frame)),
        ]
    }

    /// Sections as lines in space, broken where there is nothing.
    fn section_lines(&self, frame: &SiteFrame) -> Vec<SectionLine> {
        let [east, north, _] = frame.origin;
        let mut lines = Vec::new();
        for cut in &self.sections {
            let along = (cut.to - cut.from).normalize_or_zero();
            let at = |p: &[f32; 2]| {
                let place: Vec2 = cut.from + along * (p[0] - cut.from_offset_m);
                [east + f64::from(place.x), north + f64::from(place.y), f64::from(p[1])]
            };
            for (surface, points) in
                [("design", &cut.design), ("as-is", &cut.as_surveyed), ("planned", &cut.planned)]
            {
                for piece in points.split(|p| !p[1].is_finite()).filter(|piece| piece.len() > 1) {
                    lines.push(SectionLine {
                        chainage_m: cut.chainage_m,
                        surface: surface.to_string(),
                        points: piece.iter().map(at).collect(),
                    });
                }
            }
        }
        lines
    }
}

/// Writes every export of a run but its sheets into `folder`: its blocks, and with a plan its surfaces, sections and new blocks.
pub fn export(
    folder: &Path,
    site: &Site,
    recognition: &Recognition,
    planned: Option<(&Planned, &Drawings)>,
) -> Result<Vec<PathBuf>> {
    let frame = &site.survey.frame;
    let (sections, maps) = match planned {
        Some((_, drawings)) => (drawings.section_lines(frame), drawings.maps(frame).to_vec()),
        None => Default::default(),
    };
    let drawing = Drawing {
        name: &site.name,
        frame,
        catalog: &site.catalog,
        recognised: &recognition.blocks,
        placements: planned.map_or(&[][..], |(planned, _)| &planned.plan.placements),
        sections: &sections,
    };
    let surfaces = &["design", "as-surveyed", "planned"];
    let set = ExportSet { drawing, seed: site.seed, maps: &maps, surfaces };
    let details = match planned {
        Some((planned, drawings)) => drawings.details(site, &planned.unfilled),
        None => Details { survey_date: site.survey_date.clone(), ..Details::default() },
    };
    Ok(export_set::write_with(folder, &set, &details)?)
}
