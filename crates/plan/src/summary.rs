//! The figures of a plan.

use crate::{objective, porosity, site::Site, stack::Stack, windows};
use geom::HeightMap;
use scene::{Placement, PlacementState, PlanSummary};

/// What is remembered of the pile before planning.
pub(crate) struct Before {
    surface: HeightMap,
    void_m3: f32,
}

pub(crate) fn before(stack: &Stack) -> Before {
    Before {
        surface: stack.surface.clone(),
        void_m3: windows::void_m3(&stack.surface, &stack.design),
    }
}

/// All figures, from the stack as it stands after planning.
pub(crate) fn summary(
    site: &Site,
    stack: &Stack,
    before: &Before,
    placements: &[Placement],
    removed: &[Placement],
) -> PlanSummary {
    let model = |p: &Placement| stack.catalog.get(p.model);
    let (mut sum, mut largest, mut cells) = (0.0_f64, 0.0_f32, 0_u64);
    let (mut bulk_m3, cell_m2) = (0.0_f64, f64::from(stack.surface.cell_m).powi(2));
    for (cell, design) in stack.design.z_m.iter().enumerate() {
        bulk_m3 += f64::from(stack.surface.z_m[cell] - before.surface.z_m[cell]) * cell_m2;
        if design.is_finite() {
            let distance = (design - stack.surface.z_m[cell]).abs();
            (sum, largest, cells) = (sum + f64::from(distance), largest.max(distance), cells + 1);
        }
    }
    let count = |state: PlacementState| removed.iter().filter(|p| p.state == state).count() as u32;
    let solids = placements.iter().map(|p| (&model(p).mesh, p.rest));
    let rasterised_m3 = porosity::rasterised_volume_m3(solids, stack.surface.cell_m);
    let (concrete_m3, mass_kg) = amounts(placements, stack);
    let porosity_of =
        |concrete: f64| if bulk_m3 > 0.0 { (1.0 - concrete / bulk_m3) as f32 } else { 0.0 };
    PlanSummary {
        rounds: placements.iter().chain(removed).map(|p| p.round).max().unwrap_or(0),
        blocks: placements.iter().filter(|p| p.is_new()).count() as u32,
        void_before_m3: before.void_m3,
        void_after_m3: windows::void_m3(&stack.surface, &stack.design),
        mean_distance_m: (sum / cells.max(1) as f64) as f32,
        max_distance_m: largest,
        protruding: placements.iter().filter(|p| objective::protrudes(site, stack, p)).count()
            as u32,
        concrete_m3,
        mass_kg,
        area_m2: (cells as f64 * cell_m2) as f32,
        porosity: porosity_of(f64::from(concrete_m3)),
        porosity_rasterised: porosity_of(rasterised_m3),
        overflowed: count(PlacementState::Overflow),
        unsettled: count(PlacementState::Unsettled),
        unstable: count(PlacementState::Unstable),
        outside: count(PlacementState::Outside),
        shut: 0,
        opened: 0,
        guided: placements.iter().filter(|p| !p.handling.path.is_empty()).count() as u32,
        reset: placements.iter().filter(|p| !p.is_new()).count() as u32,
    }
}

/// Concrete, m³, and mass, kg: number times amount of each type, so that one type gives no sum of rounding errors.
fn amounts(placements: &[Placement], stack: &Stack) -> (f32, f64) {
    let (mut concrete_m3, mut mass_kg) = (0.0, 0.0);
    for (id, block) in stack.catalog.iter() {
        let count = placements.iter().filter(|p| p.model == id && p.is_new()).count();
        concrete_m3 += count as f32 * block.volume_m3;
        mass_kg += count as f64 * f64::from(block.mass_kg());
    }
    (concrete_m3, mass_kg)
}
