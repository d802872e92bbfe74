//! Both surveys of a step from above, for the page.

use super::Compared;
use geom::{Bounds, DVec3, HeightMap, Vec3};
use report::changes_page::SurveyPictures;
use report::relief::{difference, relief};

/// Longest side of a picture, pixels.
const LONGEST: f32 = 900.0;
/// A cell is so many times as wide as the points lie apart, so that few stay empty.
const WIDER: f32 = 1.5;
/// Neighbours with a height that close an empty cell, and how often.
const NEIGHBOURS: usize = 4;
const ROUNDS: usize = 2;
/// Share of the surface at either end that does not decide colours.
const OUTER: f32 = 0.02;

/// The pictures; `None` where there is nothing to show.
pub(super) fn of(out: &Compared) -> Option<SurveyPictures> {
    let n = out.epochs.len();
    let (earlier, later) = (&out.epochs[n - 2].site.survey, &out.last().later_points);
    let maps = maps(&earlier.cloud.position_m, later)?;
    let mut heights: Vec<f32> =
        maps.iter().flat_map(|m| m.z_m.iter().copied()).filter(|z| z.is_finite()).collect();
    let range_m = outer(&mut heights)?;
    let mut changes: Vec<f32> = maps[0]
        .z_m
        .iter()
        .zip(&maps[1].z_m)
        .map(|(a, b)| b - a)
        .filter(|d| d.is_finite())
        .collect();
    let limit_m = outer(&mut changes).map_or(0.1, |[low, high]| high.max(-low)).max(0.02);
    let [first, second] = &maps;
    let png = |image: report::Image| image.png().ok();
    let size = [first.nx, first.ny].map(|n| n as f32 * first.cell_m);
    let corner = |x: f32, y: f32| earlier.frame.site_from_local(Vec3::new(x, y, 0.0));
    let low: DVec3 = corner(first.origin[0], first.origin[1]);
    let high: DVec3 = corner(first.origin[0] + size[0], first.origin[1] + size[1]);
    Some(SurveyPictures {
        extent_m: [low.x, low.y, high.x, high.y],
        names: [n - 2, n - 1].map(|i| out.epochs[i].title()),
        earlier: png(relief(first, range_m))?,
        later: png(relief(second, range_m))?,
        difference: png(difference(first, second, limit_m))?,
        difference_m: f64::from(limit_m),
    })
}

/// Both surveys' upper surface over the same cells.
fn maps(earlier: &[Vec3], later: &[Vec3]) -> Option<[HeightMap; 2]> {
    let bounds = |points: &[Vec3]| Bounds::of(points.iter().copied().filter(|p| p.is_finite()));
    let both = [bounds(earlier), bounds(later)];
    if both.iter().any(Bounds::is_empty) {
        return None;
    }
    let (low, high) = (both[0].min.min(both[1].min), both[0].max.max(both[1].max));
    let apart_m = |b: &Bounds, n: usize| {
        let size = b.size().truncate().max(geom::Vec2::splat(1e-3));
        (size.x * size.y / n as f32).sqrt()
    };
    let apart_m = apart_m(&both[0], earlier.len()).max(apart_m(&both[1], later.len()));
    let longest_m = (high - low).truncate().max_element();
    let cell_m = (WIDER * apart_m).max(longest_m / LONGEST).max(1e-3);
    let map = |points: &[Vec3]| {
        let mut map = HeightMap::empty(low.truncate(), high.truncate(), cell_m);
        map.raise_points(points);
        (0..ROUNDS).for_each(|_| close(&mut map));
        map
    };
    Some([map(earlier), map(later)])
}

/// Gives empty cells most of whose neighbours have a height their mean; wide holes stay.
fn close(map: &mut HeightMap) {
    let before = map.clone();
    let (nx, ny) = (map.nx, map.ny);
    for i in (0..nx * ny).filter(|i| before.z_m[*i].is_nan()) {
        let (x, y) = (i % nx, i / nx);
        let (mut sum, mut count) = (0.0, 0);
        for v in y.saturating_sub(1)..(y + 2).min(ny) {
            for u in x.saturating_sub(1)..(x + 2).min(nx) {
                let z = before.at(u, v);
                if z.is_finite() {
                    (sum, count) = (sum + z, count + 1);
                }
            }
        }
        if count >= NEIGHBOURS {
            map.z_m[i] = sum / count as f32;
        }
    }
}

/// The values that [`OUTER`] lies below and above; `None` without values.
fn outer(values: &mut [f32]) -> Option<[f32; 2]> {
    values.sort_by(f32::total_cmp);
    let at = |share: f32| values.get((share * values.len().saturating_sub(1) as f32) as usize);
    Some([*at(OUTER)?, *at(1.0 - OUTER)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_surveys_share_their_cells() {
        let grid = |z: f32| -> Vec<Vec3> {
            (0..10_000)
                .map(|i| Vec3::new((i % 100) as f32 * 0.1, (i / 100) as f32 * 0.1, z))
                .collect()
        };
        let [a, b] = maps(&grid(1.0), &grid(2.0)).unwrap();
        assert_eq!((a.nx, a.ny, a.origin), (b.nx, b.ny, b.origin));
        assert!(a.z_m.iter().filter(|z| z.is_finite()).count() * 10 > 9 * a.z_m.len());
        assert!(maps(&[], &grid(1.0)).is_none());
        // A cell without points is closed, a hole of a metre stays one.
        let holed: Vec<Vec3> = grid(1.0)
            .into_iter()
            .filter(|p| (p.truncate() - geom::Vec2::splat(5.0)).length() > 1.0)
            .collect();
        let [map, _] = maps(&holed, &holed).unwrap();
        assert!(map.sample_m(5.0, 5.0).is_none());
        assert_eq!(outer(&mut [3.0, 1.0, 2.0]), Some([1.0, 2.0]));
        assert_eq!(outer(&mut []), None);
    }
}
