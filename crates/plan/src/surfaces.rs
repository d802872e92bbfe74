//! The surfaces of a plan as drawings show them: design, as surveyed, with the plan, and cuts through them.
//!
//! In: survey, pile, design and plan. Out: height maps on one grid, deficits, and cross-sections along the works.
//! The surveyed surface is the survey's own, not the recognised blocks': a drawing must show what was measured.

use geom::{HeightMap, PointCloud, Pose, Vec2, Vec3};
use scene::{BlockModel, Catalog, DesignSurface, Ground, Plan, SiteFrame};

/// What the surfaces are made from.
#[derive(Clone, Copy)]
pub struct SurfacesInput<'a> {
    /// The survey, local frame.
    pub cloud: &'a PointCloud,
    /// Where the local frame lies.
    pub frame: &'a SiteFrame,
    /// What is to be built.
    pub design: &'a DesignSurface,
    /// What the blocks lie on.
    pub ground: &'a Ground,
    /// Block types.
    pub catalog: &'a Catalog,
    /// Blocks to add.
    pub plan: &'a Plan,
}

/// Heights in the local frame, all on one grid that covers the works.
#[derive(Clone, Debug)]
pub struct Surfaces {
    /// The design; empty outside the works.
    pub design: HeightMap,
    /// The survey: highest point of each cell, gaps interpolated.
    pub as_surveyed: HeightMap,
    /// The same with the plan's blocks.
    pub planned: HeightMap,
}

/// A vertical cut across the works. Points are (offset along the cut, level in the site's datum), metres.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossSection {
    /// Distance along the works, metres.
    pub chainage_m: f64,
    /// Where the offsets begin, local frame.
    pub from: Vec2,
    /// The other end.
    pub to: Vec2,
    /// Offset of `from`: negative left of an alignment.
    pub from_offset_m: f32,
    /// Design; not a number outside the works.
    pub design: Vec<[f32; 2]>,
    /// As surveyed.
    pub as_surveyed: Vec<[f32; 2]>,
    /// With the plan.
    pub planned: Vec<[f32; 2]>,
    /// What the blocks lie on.
    pub ground: Vec<[f32; 2]>,
}

/// Cells a block's length is divided into.
const CELLS_PER_BLOCK: f32 = 20.0;
/// A surface this much of d_box above a block's top is still that block: noise and errors of its pose.
const SEEN: f32 = 0.05;
/// No drawing needs more cells than this.
const MOST_CELLS: f64 = 4e6;
/// Most pieces the works are cut into by sections.
const MOST_PIECES: f64 = 8.0;
/// The sections at the ends lie this far inside, metres: on the edge itself nothing is designed.
const INSIDE_M: f64 = 1e-3;

/// The three surfaces.
pub fn surfaces(input: &SurfacesInput) -> Surfaces {
    let block_m = input.catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max).max(1e-3);
    let [low, high] = input.design.extent();
    let area = (high[0] - low[0]) * (high[1] - low[1]);
    let cell_m = (block_m / CELLS_PER_BLOCK).max((area.max(0.0) / MOST_CELLS).sqrt() as f32);
    let local = |p: [f64; 2]| {
        Vec2::new((p[0] - input.frame.origin[0]) as f32, (p[1] - input.frame.origin[1]) as f32)
    };
    let empty = HeightMap::empty(local(low) - block_m, local(high) + block_m, cell_m);

    let mut design = empty.clone();
    design.fill_with(|x, y| design_m(input, x, y));
    let mut as_surveyed = empty;
    as_surveyed.raise_points(&input.cloud.position_m);
    as_surveyed.fill_empty();
    let mut planned = as_surveyed.clone();
    for p in &input.plan.placements {
        if let Some(reset) = p.handling.reset {
            lift(&mut planned, input.catalog.get(p.model), &reset.from);
        }
    }
    for p in &input.plan.placements {
        planned.raise(&input.catalog.get(p.model).mesh, &p.rest);
    }
    Surfaces { design, as_surveyed, planned }
}

/// Takes a block out of a surface: where it is the block that is seen, nothing is known to reach higher than its underside.
fn lift(surface: &mut HeightMap, block: &BlockModel, pose: &Pose) {
    let centre = *pose * block.centre;
    let rect = surface.rect_around(centre.x, centre.y, block.d_max_m + surface.cell_m);
    if rect.area() == 0 {
        return;
    }
    let first = surface.centre(rect.x0, rect.y0);
    let (nx, ny) = (rect.x1 - rect.x0, rect.y1 - rect.y0);
    let part =
        HeightMap { origin: [first.x, first.y], cell_m: surface.cell_m, nx, ny, z_m: Vec::new() };
    let (top, under) = part.top_and_underside(&block.mesh, pose);
    for iy in 0..ny {
        for ix in 0..nx {
            let cell = (rect.y0 + iy) * surface.nx + rect.x0 + ix;
            let seen = surface.z_m[cell] <= top.at(ix, iy) + SEEN * block.d_box_m;
            if seen && surface.z_m[cell] > under.at(ix, iy) {
                surface.z_m[cell] = under.at(ix, iy);
            }
        }
    }
}

/// Design height, local frame; NaN outside the works.
fn design_m(input: &SurfacesInput, x: f32, y: f32) -> f32 {
    let origin = input.frame.origin;
    let level = input.design.level_at(f64::from(x) + origin[0], f64::from(y) + origin[1]);
    level.map_or(f32::NAN, |z| (z - origin[2]) as f32)
}

impl Surfaces {
    /// How far the survey lies below the design, metres; negative above it.
    pub fn deficit_before(&self) -> HeightMap {
        self.deficit(&self.as_surveyed)
    }

    /// The same with the plan.
    pub fn deficit_after(&self) -> HeightMap {
        self.deficit(&self.planned)
    }

    fn deficit(&self, surface: &HeightMap) -> HeightMap {
        let mut map = self.design.clone();
        map.z_m.iter_mut().zip(&surface.z_m).for_each(|(d, z)| *d -= z);
        map
    }
}

/// How far each point lies below the design, metres; negative above it, NaN outside the works.
pub fn point_deficits_m(input: &SurfacesInput) -> Vec<f32> {
    input.cloud.position_m.iter().map(|p| design_m(input, p.x, p.y) - p.z).collect()
}

/// Cuts across the works at its ends and at round distances between, at most nine.
pub fn cross_sections(input: &SurfacesInput, surfaces: &Surfaces) -> Vec<CrossSection> {
    let (line, ..) = spine(input.design);
    let length_m: f64 = line.windows(2).map(|w| distance(w[0], w[1])).sum();
    cross_sections_every(input, surfaces, round_up(length_m / MOST_PIECES))
}

/// The line chainages run along, site coordinates, and how far the works reach left and right of it, metres: the alignment of
/// a section, the long middle of anything else.
pub fn works_line(design: &DesignSurface) -> (Vec<[f64; 2]>, [f64; 2]) {
    let (line, left_m, right_m) = spine(design);
    (line, [left_m, right_m])
}

/// Cuts across the works every `step_m` metres, which must be above 0, and at its end: volumes by average end area cover all
/// of it.
pub fn cross_sections_every(
    input: &SurfacesInput,
    surfaces: &Surfaces,
    step_m: f64,
) -> Vec<CrossSection> {
    let (line, left_m, right_m) = spine(input.design);
    let length_m: f64 = line.windows(2).map(|w| distance(w[0], w[1])).sum();
    if length_m <= 2.0 * INSIDE_M {
        return Vec::new();
    }
    // A last piece of almost nothing is left to its neighbour.
    let count = (length_m / step_m - 0.05).ceil().max(1.0) as usize;
    let chainages = (0..count).map(|k| k as f64 * step_m).chain([length_m]);
    chainages
        .filter_map(|chainage_m| {
            let inside_m = chainage_m.clamp(INSIDE_M, length_m - INSIDE_M);
            let (at, along) = place_on(&line, inside_m)?;
            let left = [-along[1], along[0]];
            Some(cut(input, surfaces, chainage_m, at, left, left_m, right_m))
        })
        .collect()
}

fn cut(
    input: &SurfacesInput,
    surfaces: &Surfaces,
    chainage_m: f64,
    at: [f64; 2],
    left: [f64; 2],
    left_m: f64,
    right_m: f64,
) -> CrossSection {
    let origin = input.frame.origin;
    // Offsets grow to the right, as one reads a section looking along the works.
    let place = |offset: f64| {
        Vec2::new(
            (at[0] - left[0] * offset - origin[0]) as f32,
            (at[1] - left[1] * offset - origin[1]) as f32,
        )
    };
    let cells = ((left_m + right_m) / f64::from(surfaces.design.cell_m)).ceil().max(1.0) as usize;
    let offsets = || (0..=cells).map(|i| -left_m + (left_m + right_m) * i as f64 / cells as f64);
    let profile = |height: &dyn Fn(Vec2) -> f32| -> Vec<[f32; 2]> {
        offsets().map(|o| [o as f32, height(place(o)) + origin[2] as f32]).collect()
    };
    CrossSection {
        chainage_m,
        from: place(-left_m),
        to: place(right_m),
        from_offset_m: -left_m as f32,
        design: profile(&|p| design_m(input, p.x, p.y)),
        as_surveyed: profile(&|p| surfaces.as_surveyed.sample_m(p.x, p.y).unwrap_or(f32::NAN)),
        planned: profile(&|p| surfaces.planned.sample_m(p.x, p.y).unwrap_or(f32::NAN)),
        ground: profile(&|p| input.ground.height_m(p.x, p.y)),
    }
}

/// The line sections stand on, and how far they reach left and right of it.
fn spine(design: &DesignSurface) -> (Vec<[f64; 2]>, f64, f64) {
    if let DesignSurface::Section {
        alignment,
        crest_level_m,
        crest_width_m,
        left_slope_m,
        right_slope_m,
        toe_level_m,
    } = design
    {
        let reach = |slope: f64| crest_width_m / 2.0 + (crest_level_m - toe_level_m) * slope;
        return (alignment.clone(), reach(*left_slope_m), reach(*right_slope_m));
    }
    let [low, high] = design.extent();
    let (width, depth) = (high[0] - low[0], high[1] - low[1]);
    let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
    if width >= depth {
        (vec![[low[0], middle[1]], [high[0], middle[1]]], depth / 2.0, depth / 2.0)
    } else {
        (vec![[middle[0], low[1]], [middle[0], high[1]]], width / 2.0, width / 2.0)
    }
}

/// Lines that show the design in plan and space, local frame: its boundary, or crest and toe edges. Each with
/// whether it closes.
pub fn design_lines(design: &DesignSurface, frame: &SiteFrame) -> Vec<(bool, Vec<Vec3>)> {
    let point = |p: [f64; 2], z: f64| frame.local_from_site(geom::DVec3::new(p[0], p[1], z));
    match design {
        DesignSurface::Section {
            alignment,
            crest_level_m,
            crest_width_m,
            left_slope_m,
            right_slope_m,
            toe_level_m,
        } => {
            let half = crest_width_m / 2.0;
            let fall = crest_level_m - toe_level_m;
            let edges = [
                (half, *crest_level_m),
                (-half, *crest_level_m),
                (half + fall * left_slope_m, *toe_level_m),
                (-half - fall * right_slope_m, *toe_level_m),
            ];
            edges
                .into_iter()
                .map(|(o, z)| {
                    (false, beside(alignment, o).into_iter().map(|p| point(p, z)).collect())
                })
                .collect()
        }
        DesignSurface::Level { boundary, level_m } => {
            vec![(true, boundary.iter().map(|p| point(*p, *level_m)).collect())]
        }
        DesignSurface::Planes { boundary, .. } => vec![(true, ring(design, frame, boundary))],
        DesignSurface::Grid { .. } => {
            let [low, high] = design.extent();
            vec![(true, ring(design, frame, &[low, [high[0], low[1]], high, [low[0], high[1]]]))]
        }
    }
}

/// A boundary at the design's height just inside it; corners where nothing is designed are left out.
fn ring(design: &DesignSurface, frame: &SiteFrame, boundary: &[[f64; 2]]) -> Vec<Vec3> {
    let n = boundary.len().max(1) as f64;
    let middle = [0, 1].map(|k| boundary.iter().map(|p| p[k]).sum::<f64>() / n);
    let inwards = |p: &[f64; 2]| [0, 1].map(|k| p[k] + (middle[k] - p[k]) * 1e-6);
    boundary
        .iter()
        .filter_map(|p| {
            let q = inwards(p);
            design
                .level_at(q[0], q[1])
                .map(|z| frame.local_from_site(geom::DVec3::new(p[0], p[1], z)))
        })
        .collect()
}

/// A polyline moved to the left; corners keep their distance from both sides.
fn beside(line: &[[f64; 2]], offset_m: f64) -> Vec<[f64; 2]> {
    let left = |a: [f64; 2], b: [f64; 2]| {
        let l = distance(a, b).max(1e-9);
        [-(b[1] - a[1]) / l, (b[0] - a[0]) / l]
    };
    (0..line.len())
        .map(|i| {
            let before = left(line[i.saturating_sub(1)], line[i.max(1)]);
            let after = left(line[i.min(line.len() - 2)], line[(i + 1).min(line.len() - 1)]);
            let sum = [before[0] + after[0], before[1] + after[1]];
            let stretch = 2.0 / (sum[0] * sum[0] + sum[1] * sum[1]).max(0.2);
            [0, 1].map(|k| line[i][k] + sum[k] * stretch * offset_m)
        })
        .collect()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// The point at this distance along the line, and the line's direction there.
fn place_on(line: &[[f64; 2]], chainage_m: f64) -> Option<([f64; 2], [f64; 2])> {
    let mut rest = chainage_m;
    for w in line.windows(2) {
        let length = distance(w[0], w[1]);
        let along = [0, 1].map(|k| (w[1][k] - w[0][k]) / length.max(1e-9));
        if rest <= length && length > 0.0 {
            return Some(([0, 1].map(|k| w[0][k] + along[k] * rest), along));
        }
        rest -= length;
    }
    None
}

/// The next of 1, 2, 5, 10, 20 …
fn round_up(v: f64) -> f64 {
    let power = 10_f64.powf(v.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= v * 0.999_999)
        .unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Quat;
    use scene::{ModelId, Placement, PlacementState, PlanSummary, Shape};

    fn breakwater() -> DesignSurface {
        DesignSurface::Section {
            alignment: vec![[1000.0, 2000.0], [1015.0, 2000.0]],
            crest_level_m: 5.0,
            crest_width_m: 4.0,
            left_slope_m: 1.5,
            right_slope_m: 2.0,
            toe_level_m: 1.0,
        }
    }

    #[test]
    fn sections_show_design_survey_and_plan() {
        let design = breakwater();
        let frame = SiteFrame { origin: [1000.0, 2000.0, 0.5], ..SiteFrame::default() };
        let catalog = Catalog::new(vec![
            blocks::shape_model("cube", Shape::Cube { size: 2.0 }, 2300.0).unwrap(),
        ]);
        let cloud = PointCloud::from_positions(
            (0..400)
                .flat_map(|i| {
                    (0..300).map(move |j| {
                        Vec3::new(-2.0 + i as f32 * 0.05, -11.0 + j as f32 * 0.07, 1.5)
                    })
                })
                .collect(),
        );
        let rest = Pose::from_parts(Vec3::new(6.0, 0.0, 2.5), Quat::IDENTITY);
        let placement = Placement {
            order: 1,
            round: 1,
            model: ModelId(0),
            drop: rest,
            rest,
            filled_m3: 8.0,
            contacts: 1,
            state: PlacementState::Kept,
            handling: scene::Handling::default(),
        };
        let plan = Plan {
            placements: vec![placement],
            removed: Vec::new(),
            summary: PlanSummary::default(),
        };
        let ground = Ground::Level { z_m: 0.0 };
        let input = SurfacesInput {
            cloud: &cloud,
            frame: &frame,
            design: &design,
            ground: &ground,
            catalog: &catalog,
            plan: &plan,
        };
        let surfaces = surfaces(&input);
        let cuts = cross_sections(&input, &surfaces);
        assert_eq!(
            cuts.iter().map(|c| c.chainage_m).collect::<Vec<_>>(),
            [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 15.0]
        );

        let at = |line: &[[f32; 2]], offset: f32| {
            line.iter()
                .min_by(|a, b| (a[0] - offset).abs().total_cmp(&(b[0] - offset).abs()))
                .unwrap()[1]
        };
        let c = &cuts[3];
        // The ends are cut too: the design stands there as it does between.
        for end in [&cuts[0], &cuts[8]] {
            assert_eq!(at(&end.design, 0.0), 5.0);
        }
        assert!(
            (c.from_offset_m + 8.0).abs() < 1e-5
                && (c.design.last().unwrap()[0] - 10.0).abs() < 1e-4
        );
        assert_eq!(at(&c.design, 0.0), 5.0);
        // Right of an alignment that runs east is south, where the slope is 1:2.
        assert!(
            (at(&c.design, 4.0) - 4.0).abs() < 0.06 && (at(&c.design, -5.0) - 3.0).abs() < 0.06
        );
        assert!((at(&c.as_surveyed, 0.0) - 2.0).abs() < 1e-5);
        assert!(
            (at(&c.planned, 0.0) - 4.0).abs() < 1e-5 && (at(&c.planned, 3.0) - 2.0).abs() < 1e-5
        );
        assert!((at(&c.ground, 0.0) - 0.5).abs() < 1e-6);

        let middle = surfaces.design.cell_of(6.0, 0.0).unwrap();
        assert!((surfaces.deficit_before().at(middle.0, middle.1) - 3.0).abs() < 1e-5);
        assert!((surfaces.deficit_after().at(middle.0, middle.1) - 1.0).abs() < 1e-5);
        let deficits = point_deficits_m(&input);
        assert_eq!(deficits.len(), cloud.len());
        assert!(
            deficits.iter().any(|d| (d - 3.0).abs() < 1e-5) && deficits.iter().any(|d| d.is_nan())
        );
    }

    #[test]
    fn design_lines_are_crest_and_toe() {
        let frame = SiteFrame { origin: [1000.0, 2000.0, 0.0], ..SiteFrame::default() };
        let lines = design_lines(&breakwater(), &frame);
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[0].1, [Vec3::new(0.0, 2.0, 5.0), Vec3::new(15.0, 2.0, 5.0)]);
        assert_eq!(lines[3].1[1], Vec3::new(15.0, -10.0, 1.0));
    }

    #[test]
    fn a_bent_line_keeps_its_distance() {
        let bent = beside(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]], 1.0);
        assert!(distance(bent[1], [9.0, 1.0]) < 1e-9 && distance(bent[2], [9.0, 10.0]) < 1e-9);
    }
}
