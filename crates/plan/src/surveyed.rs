//! Where the survey has seen anything: elsewhere nothing is planned, for what lies there is not judged.
//!
//! In: the design's height map and the survey's points. Out: the map without the cells that no point is near, and how much that
//! is. A gap that blocks a few lengths wide can shade stays; a stretch that nobody has surveyed does not.

use geom::{HeightMap, Vec3};

/// A cell is surveyed when a point lies in its square of this many block lengths, or in one of the eight around it: surely
/// within two block lengths, surely not beyond six. Free choice; shadows behind blocks are one or two wide.
pub(crate) const SQUARE: f32 = 2.0;

/// Empties the cells of a design that no point is near; square metres that were emptied.
pub(crate) fn leave_out_unseen(design: &mut HeightMap, points: &[Vec3], square_m: f32) -> f32 {
    let along =
        |cells: usize| ((cells as f32 * design.cell_m / square_m) as usize).saturating_add(3);
    // One square of margin on every side.
    let (nx, ny) = (along(design.nx), along(design.ny));
    let (origin, nowhere) = (design.origin, square_m);
    let square_of = |x: f32, y: f32| {
        let at = |v: f32, from: f32| ((v - from + nowhere) / square_m).floor();
        let (x, y) = (at(x, origin[0]), at(y, origin[1]));
        let inside = x >= 0.0 && y >= 0.0 && x < nx as f32 && y < ny as f32;
        inside.then_some((x as usize, y as usize))
    };
    let mut seen = vec![false; nx * ny];
    for point in points {
        if let Some((x, y)) = square_of(point.x, point.y) {
            seen[y * nx + x] = true;
        }
    }
    let near = |x: usize, y: usize| {
        let mut rows = y.saturating_sub(1)..(y + 2).min(ny);
        rows.any(|y| (x.saturating_sub(1)..(x + 2).min(nx)).any(|x| seen[y * nx + x]))
    };
    let mut left_out = 0_usize;
    for iy in 0..design.ny {
        for ix in 0..design.nx {
            let centre = design.centre(ix, iy);
            let is_seen = square_of(centre.x, centre.y).is_some_and(|(x, y)| near(x, y));
            let height = &mut design.z_m[iy * design.nx + ix];
            if height.is_finite() && !is_seen {
                *height = f32::NAN;
                left_out += 1;
            }
        }
    }
    left_out as f32 * design.cell_m * design.cell_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Vec2;

    fn design() -> HeightMap {
        let mut map = HeightMap::empty(Vec2::new(-50.0, 0.0), Vec2::new(50.0, 20.0), 0.5);
        map.fill_with(|_, _| 3.0);
        map
    }

    #[test]
    fn a_stretch_without_points_is_no_works_and_a_gap_is() {
        // Surveyed west of 0 but for a gap three metres wide.
        let surveyed = |x: f32| x < 0.0 && !(-23.0..-20.0).contains(&x);
        let points: Vec<Vec3> = (0..400)
            .flat_map(|i| {
                (0..80).map(move |j| Vec3::new(-50.0 + 0.25 * i as f32, 0.25 * j as f32, 1.0))
            })
            .filter(|p| surveyed(p.x))
            .collect();
        let mut map = design();
        let left_m2 = leave_out_unseen(&mut map, &points, 4.0);
        let height = |x: f32| map.sample_m(x, 10.0).is_some_and(f32::is_finite);
        assert!(height(-40.0) && height(-21.5) && height(-1.0));
        assert!(!height(13.0) && !height(40.0));
        // Half of 100 m × 20 m, less what is near the last points.
        assert!((1_000.0 - 20.0 * 8.0 - 1.0..=1_000.0).contains(&left_m2), "{left_m2}");
    }

    #[test]
    fn without_points_nothing_is_left_and_points_elsewhere_do_no_harm() {
        let mut map = design();
        leave_out_unseen(
            &mut map,
            &[Vec3::splat(f32::NAN), Vec3::splat(1e30), Vec3::splat(-1e30)],
            4.0,
        );
        assert!(map.z_m.iter().all(|z| z.is_nan()));
    }
}
