//! The surfaces and sections of a plan, for the report and the exports.

use crate::exit::Exit;
use geom::{HeightMap, Vec2};
use io::drawing::{Drawing, SectionLine};
use io::export_set::{self, ExportSet};
use io::raster::Raster;
use pipeline::Works;
use plan::{CrossSection, Surfaces};
use scene::{Plan, Scene};
use std::path::Path;

/// Rasters of one grid and cuts through them, local frame.
pub struct Drawings {
    /// Design, survey, and survey with the plan.
    pub surfaces: Surfaces,
    /// Design minus survey.
    pub deficit_before: HeightMap,
    /// Design minus survey with the plan.
    pub deficit_after: HeightMap,
    /// Cuts across the works.
    pub sections: Vec<CrossSection>,
}

impl Drawings {
    /// Drawn from a plan.
    pub fn of(works: &Works, pile: &Scene, plan: &Plan) -> Self {
        let (surfaces, sections) = pipeline::surfaces(works, pile, plan);
        let (deficit_before, deficit_after) = (surfaces.deficit_before(), surfaces.deficit_after());
        Self { surfaces, deficit_before, deficit_after, sections }
    }

    /// Writes every export of a run into `folder`.
    pub fn export(
        &self,
        folder: &Path,
        name: &str,
        works: &Works,
        plan: &Plan,
        seed: u64,
    ) -> Result<(), Exit> {
        let frame = &works.survey.frame;
        let sections = self.section_lines(works);
        let drawing = Drawing {
            name,
            frame,
            catalog: works.catalog,
            recognised: works.blocks,
            placements: &plan.placements,
            sections: &sections,
        };
        let maps = [
            ("design", Raster::of_heights(&self.surfaces.design, frame)),
            ("as-surveyed", Raster::of_heights(&self.surfaces.as_surveyed, frame)),
            ("planned", Raster::of_heights(&self.surfaces.planned, frame)),
            ("deficit-before", Raster::of_differences(&self.deficit_before, frame)),
            ("deficit-after", Raster::of_differences(&self.deficit_after, frame)),
        ];
        let set = ExportSet {
            drawing,
            seed,
            maps: &maps,
            surfaces: &["design", "as-surveyed", "planned"],
        };
        Ok(export_set::write(folder, &set)?)
    }

    /// Sections as lines in space, broken where there is nothing.
    fn section_lines(&self, works: &Works) -> Vec<SectionLine> {
        let [east, north, _] = works.survey.frame.origin;
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
