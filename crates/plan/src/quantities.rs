//! Quantities by section: areas between survey, plan and design, and volumes by average end area.

use crate::CrossSection;
use scene::{AreaVolume, SectionQuantity};

/// Areas of each section and volumes from section to section, in the order given; V = (A₁ + A₂)/2 · L.
/// Where a surface is not known nothing is counted.
pub fn section_quantities(sections: &[CrossSection]) -> Vec<SectionQuantity> {
    let mut list: Vec<SectionQuantity> = Vec::with_capacity(sections.len());
    for s in sections {
        let (missing, _) = between(&s.design, &s.as_surveyed);
        let (planned, _) = between(&s.planned, &s.as_surveyed);
        let (still, above) = between(&s.design, &s.planned);
        let last = list.last().copied();
        let length_m = last.map_or(0.0, |l| s.chainage_m - l.chainage_m);
        let of = |area_m2: f64, before: fn(&SectionQuantity) -> f64| {
            let mean = |l: SectionQuantity| (before(&l) + area_m2) / 2.0;
            AreaVolume { area_m2, volume_m3: last.map_or(0.0, |l| mean(l) * length_m) }
        };
        list.push(SectionQuantity {
            chainage_m: s.chainage_m,
            length_m,
            missing: of(missing, |q| q.missing.area_m2),
            planned: of(planned, |q| q.planned.area_m2),
            still_missing: of(still, |q| q.still_missing.area_m2),
            above: of(above, |q| q.above.area_m2),
        });
    }
    list
}

/// Areas where the first line lies above the second, and where it lies below it. Both have the same offsets.
fn between(upper: &[[f32; 2]], lower: &[[f32; 2]]) -> (f64, f64) {
    let (mut above, mut below) = (0.0, 0.0);
    for (u, l) in upper.windows(2).zip(lower.windows(2)) {
        let wide = f64::from(u[1][0] - u[0][0]);
        let [a, b] = [0, 1].map(|k| f64::from(u[k][1] - l[k][1]));
        if !(a.is_finite() && b.is_finite()) {
            continue;
        }
        // Where the lines cross, each side of the crossing is a triangle.
        let share = if (a < 0.0) == (b < 0.0) { 1.0 } else { a / (a - b) };
        let mut count = |area: f64| if area > 0.0 { above += area } else { below -= area };
        if share == 1.0 {
            count((a + b) / 2.0 * wide);
        } else {
            count(a / 2.0 * share * wide);
            count(b / 2.0 * (1.0 - share) * wide);
        }
    }
    (above, below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Vec2;

    /// A triangle of design, `high` metres over a level survey, 4 m wide; half of it filled by the plan.
    fn section(chainage_m: f64, high: f32) -> CrossSection {
        let line = |z: &dyn Fn(f32) -> f32| (-2..=2).map(|i| [i as f32, z(i as f32)]).collect();
        CrossSection {
            chainage_m,
            from: Vec2::ZERO,
            to: Vec2::X,
            from_offset_m: -2.0,
            design: line(&|o| 1.0 + high * (1.0 - o.abs() / 2.0)),
            as_surveyed: line(&|_| 1.0),
            planned: line(&|o| if o < 0.0 { 1.0 } else { 1.0 + high }),
            ground: Vec::new(),
        }
    }

    #[test]
    fn a_growing_wedge_is_measured_by_average_end_area() {
        let list = section_quantities(&[section(0.0, 1.0), section(10.0, 3.0), section(14.0, 3.0)]);
        let areas: Vec<f64> = list.iter().map(|q| q.missing.area_m2).collect();
        assert_eq!(areas, [2.0, 6.0, 6.0]);
        let volumes: Vec<f64> = list.iter().map(|q| q.missing.volume_m3).collect();
        assert_eq!(volumes, [0.0, 40.0, 24.0]);
        // Left half empty, the right half a step: half of the step lies above the design.
        assert!((list[0].planned.area_m2 - 2.5).abs() < 1e-9, "{:?}", list[0]);
        assert!(
            (list[0].above.area_m2 - list[0].planned.area_m2 + 2.0 - list[0].still_missing.area_m2)
                .abs()
                < 1e-6
        );
    }

    #[test]
    fn crossing_lines_are_two_triangles_and_gaps_count_nothing() {
        let up = [[0.0, 0.0], [2.0, 2.0], [3.0, f32::NAN], [4.0, 5.0]];
        let level = [[0.0, 1.0], [2.0, 1.0], [3.0, 1.0], [4.0, 1.0]];
        assert_eq!(between(&up, &level), (0.5, 0.5));
        assert_eq!(between(&level, &up), (0.5, 0.5));
    }
}
