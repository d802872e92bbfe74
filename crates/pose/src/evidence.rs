//! What speaks for a pose and what against it: the two-sided judgement of a single candidate.
//!
//! For: measured points within reach of a face that the sensor could see, each with the area it stands for.
//! Against: measured points deep inside the solid, surface in free space that the sensor looked through, surface
//! beyond the walls of a bin. A one-sided fit cannot tell a face of a small block from a part of a larger one; the
//! surface that should have been seen and was not can (METHOD §4).

use crate::EvidenceConfig;
use crate::beyond::{goes_on, strip_m};
use crate::fit::{CentredPose, agreement};
use crate::measured::Measured;
use crate::sight::{LEAST_COSINE, Seen};
use crate::template::Template;

/// The case of one candidate.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Working points it explains and how well, in (0, 1]; ascending.
    pub explained: Vec<(u32, f32)>,
    /// Area of the evidence against it, weighted, m².
    pub against_m2: f32,
    /// Of the surface that ought to be seen, the share that is.
    pub agreement: f32,
    /// Half the block's surface, m²: the unit of scores.
    pub unit_m2: f32,
    /// Area one working point stands for, m².
    pub point_area_m2: f32,
}

impl Evidence {
    /// Score without rivals, in halves of the block's surface.
    pub fn score(&self) -> f32 {
        let area: f32 = self.explained.iter().map(|e| e.1).sum::<f32>() * self.point_area_m2;
        (area - self.against_m2) / self.unit_m2
    }

    /// What the candidate adds to what others explain already.
    pub fn gain(&self, taken: &[f32]) -> f32 {
        let new: f32 = self.explained.iter().map(|&(i, w)| (w - taken[i as usize]).max(0.0)).sum();
        (new * self.point_area_m2 - self.against_m2) / self.unit_m2
    }
}

/// Reach of a surface, metres: points within it are explained.
pub fn reach_m(measured: &Measured, template: &Template, config: &EvidenceConfig) -> f32 {
    (config.reach_sd * measured.noise_sd_m).max(1.5 * template.field.cell_m())
}

/// Collects the evidence of one pose.
pub fn weigh(
    template: &Template,
    at: &CentredPose,
    measured: &Measured,
    config: &EvidenceConfig,
) -> Evidence {
    let reach = reach_m(measured, template, config);
    let d_max = template.model.d_max_m;
    let site_from_block = at.pose(template.model.centre);
    let block_from_site = site_from_block.inverse();
    let deep = reach.max(0.04 * d_max);
    let strip = if template.flat_faces { strip_m(template) } else { 0.0 };
    let mut explained = Vec::new();
    let (mut inside, mut beyond, mut beside) = (0.0, 0.0_f32, 0.0_f32);
    measured.grid.for_each_within(at.centre, d_max + reach.max(strip), |i, p, _| {
        let p = block_from_site * p;
        let (d, g) = template.field.at(p);
        if d.abs() < reach {
            let face = site_from_block.rotation * g;
            let w = agreement(face, &measured.fit_point(i)) * (1.0 - (d / reach).powi(2));
            if w > 0.02 {
                explained.push((i, w));
                if measured.viewpoint.as_ref().is_some_and(|v| v.facing(face) < LEAST_COSINE) {
                    beside += w;
                }
            }
        } else if d < -deep {
            inside += ((-d - deep) / deep).min(1.0);
        }
        if d > 0.0 && d < strip {
            let normal = block_from_site.rotation * measured.normal[i as usize];
            beyond += f32::from(u8::from(goes_on(template, p, normal, (d, g), reach)));
        }
    });
    explained.sort_unstable_by_key(|e| e.0);

    // A face that was measured was seen, even where it is turned from the side that the survey is thought to be seen from.
    let beside = beside * measured.point_area_m2 / template.sample_area_m2;
    let (mut seen, mut through, mut unknown, mut under) = (beside, 0.0_f32, 0.0_f32, 0.0_f32);
    for &(p, n) in &template.surface {
        let p = site_from_block * p;
        match measured.sight.of_surface(p, site_from_block.rotation * n, reach) {
            Some(Seen::Here) => seen += 1.0,
            Some(Seen::Through) => through += 1.0,
            Some(Seen::Unknown) => unknown += 1.0,
            Some(Seen::Hidden) | None => {}
        }
        let depth = measured
            .solid
            .iter()
            .map(|bed| -bed.plane.distance_m(p) - bed.relief_m)
            .fold(0.0, f32::max);
        under += ((depth - deep) / deep).clamp(0.0, 1.0);
    }
    let area = template.sample_area_m2;
    Evidence {
        explained,
        against_m2: (config.inside_weight * inside + config.beyond_weight * beyond)
            * measured.point_area_m2
            + config.free_space_weight * through * area
            + config.overlap_weight * under * area,
        agreement: seen
            / (seen + through + 0.3 * unknown + 0.01 * template.surface.len() as f32).max(1.0),
        unit_m2: 0.5 * area * template.surface.len() as f32,
        point_area_m2: measured.point_area_m2,
    }
}

/// Surface of two blocks inside each other, weighted by depth, m²: the larger of both ways.
pub fn overlap_m2(
    a: (&Template, &CentredPose),
    b: (&Template, &CentredPose),
    tolerance_m: f32,
) -> f32 {
    if (a.1.centre - b.1.centre).length() > a.0.model.d_max_m + b.0.model.d_max_m {
        return 0.0;
    }
    let one_way = |from: (&Template, &CentredPose), into: (&Template, &CentredPose)| {
        let to = into.1.pose(into.0.model.centre).inverse() * from.1.pose(from.0.model.centre);
        let deep: f32 = from
            .0
            .surface
            .iter()
            .map(|&(p, _)| {
                ((-into.0.field.distance_m(to * p) - tolerance_m) / tolerance_m).clamp(0.0, 1.0)
            })
            .sum();
        deep * from.0.sample_area_m2
    };
    one_way(a, b).max(one_way(b, a))
}

/// Share of a block's inside that is inside another, deeper than `tolerance_m`: the larger of both ways. In a shell
/// thinner than that a quarter of its half thickness is deep, or two pipes through each other would share nothing.
pub fn shared_inside(
    a: (&Template, &CentredPose),
    b: (&Template, &CentredPose),
    tolerance_m: f32,
) -> f32 {
    if (a.1.centre - b.1.centre).length() > a.0.model.d_max_m + b.0.model.d_max_m {
        return 0.0;
    }
    let one_way = |from: (&Template, &CentredPose), into: (&Template, &CentredPose)| {
        let to = into.1.pose(into.0.model.centre).inverse() * from.1.pose(from.0.model.centre);
        let deep_m = tolerance_m.min(0.25 * into.0.deepest_m);
        let deep =
            from.0.inside.iter().filter(|&&p| into.0.field.distance_m(to * p) < -deep_m).count();
        deep as f32 / from.0.inside.len().max(1) as f32
    };
    one_way(a, b).max(one_way(b, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PoseConfig, template::templates};
    use geom::{Quat, SeedTree, Vec3};
    use scene::{Catalog, Shape};

    /// Two pipes through each other were once stated as two blocks: a shell has hardly any inside.
    #[test]
    fn solids_and_shells_through_each_other_share_a_place_and_touching_ones_do_not() {
        let ring = blocks::parts::ring(1.0).unwrap();
        let cube = blocks::shape_model("cube", Shape::Cube { size: 1.0 }, 2300.0).unwrap();
        for (model, touching) in
            [(ring, Vec3::new(1.02, 0.0, 0.0)), (cube, Vec3::new(1.02, 0.0, 0.0))]
        {
            let catalog = Catalog::new(vec![model]);
            let templates = templates(&catalog, &PoseConfig::default(), SeedTree::new(1)).unwrap();
            let t = &templates[0];
            let at = |centre, rotation| CentredPose { centre, rotation };
            let first = at(Vec3::ZERO, Quat::IDENTITY);
            let share = |second: &CentredPose| shared_inside((t, &first), (t, second), 0.05);
            let max = PoseConfig::default().evidence.max_shared;
            assert!(share(&first) > 0.3);
            assert!(share(&at(Vec3::new(0.1, 0.0, 0.0), Quat::IDENTITY)) > max);
            assert!(share(&at(Vec3::ZERO, Quat::from_rotation_x(1.2))) > max);
            assert!(share(&at(touching * t.model.d_box_m, Quat::IDENTITY)) <= 0.5 * max);
        }
    }
}
