//! From where a depth camera looked, asked of its cloud alone.
//!
//! A camera measures nothing that lies behind what it measures. Seen from any other place some of the cloud hides some more
//! of it: the place is the one from which the cloud hides least of itself. It starts above the middle of the cloud
//! and goes wherever less is hidden, in ever smaller steps.

use geom::{Bounds, PointGrid, Vec3, thin_from_lowest};

/// Heights above the middle that are tried first, in diagonals of the cloud.
const HEIGHTS: [f32; 6] = [0.8, 1.2, 1.8, 2.7, 4.0, 6.0];
/// First and last step, in distances from the middle.
const FIRST_STEP: f32 = 0.3;
const LAST_STEP: f32 = 0.02;
/// A step towards the middle or away from it is so many times longer than one aside: what is hidden depends less on it.
const ALONG: f32 = 1.5;
/// Side of a pixel in distances between points.
const PIXEL: f32 = 1.3;
/// Points looked at at most, about; more are thinned, so that their order does not matter.
const POINTS: usize = 60_000;
/// Fewer points say nothing.
const FEWEST: usize = 100;
/// Pixels along a side at most.
const WIDEST: f32 = 4096.0;

/// A place from which the cloud hides least of itself, where what lies `deeper_m` behind something counts as hidden;
/// `None` for clouds too small to tell.
pub fn camera_place(points: &[Vec3], deeper_m: f32) -> Option<Vec3> {
    let bounds = Bounds::of(points.iter().copied());
    let size_m = bounds.size().length();
    if points.len() < FEWEST || !(size_m > 0.0 && size_m.is_finite()) {
        return None;
    }
    let middle = bounds.centre();
    let some = if points.len() > POINTS { thinned(points)? } else { points.to_vec() };
    let pixel_m = PIXEL * spacing_m(&some)?;
    let hidden = |place: Vec3| hidden(&some, place, middle, pixel_m, deeper_m);
    let above = HEIGHTS.map(|height| middle + Vec3::Z * (height * size_m));
    let first = |p: Vec3| (hidden(p), p);
    let mut best = above.into_iter().map(first).min_by_key(|b| b.0)?;
    let mut step = FIRST_STEP;
    while step > LAST_STEP {
        let away = best.1 - middle;
        let aside = away.any_orthonormal_vector() * (step * away.length());
        let across = away.cross(aside).normalize_or_zero() * (step * away.length());
        let farther = 1.0 + ALONG * step;
        let next = [aside, -aside, across, -across].map(|shift| best.1 + shift);
        let along = [middle + away * farther, middle + away / farther];
        let better = next.into_iter().chain(along).map(first).min_by_key(|b| b.0)?;
        if better.0 < best.0 {
            best = better;
        } else {
            step *= 0.5;
        }
    }
    Some(best.1)
}

/// How many points lie more than `deeper_m` behind others, seen from a place.
fn hidden(points: &[Vec3], place: Vec3, middle: Vec3, pixel_m: f32, deeper_m: f32) -> usize {
    let away = middle - place;
    let distance_m = away.length();
    let forward = away / distance_m;
    let right = forward.any_orthonormal_vector();
    let up = right.cross(forward);
    let project = |p: &Vec3| {
        let d = *p - place;
        let depth_m = d.dot(forward);
        let scale = distance_m / (pixel_m * depth_m);
        // What lies beside or behind the camera cannot have been measured.
        (depth_m > 0.1 * d.length())
            .then(|| ([d.dot(right) * scale, d.dot(up) * scale], d.length()))
    };
    let seen: Vec<([f32; 2], f32)> = points.iter().filter_map(project).collect();
    let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for (at, _) in &seen {
        for k in 0..2 {
            low[k] = low[k].min(at[k]);
            high[k] = high[k].max(at[k]);
        }
    }
    if seen.is_empty() || (0..2).any(|k| high[k] - low[k] > WIDEST) {
        return points.len();
    }
    let width = (high[0] - low[0]) as usize + 1;
    let pixel = |at: &[f32; 2]| (at[1] - low[1]) as usize * width + (at[0] - low[0]) as usize;
    let mut nearest = vec![f32::INFINITY; width * ((high[1] - low[1]) as usize + 1)];
    for (at, range_m) in &seen {
        let at = pixel(at);
        nearest[at] = nearest[at].min(*range_m);
    }
    let behind = seen.iter().filter(|(at, range_m)| *range_m > nearest[pixel(at)] + deeper_m);
    behind.count() + points.len() - seen.len()
}

/// One point in each cell of about as many cells as points are looked at.
fn thinned(points: &[Vec3]) -> Option<Vec<Vec3>> {
    let cell_m = guess_m(points, POINTS)?;
    // Of two points as near the middle of their cell the first stays.
    let mut points = points.to_vec();
    points.sort_unstable_by(|a, b| {
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
    });
    Some(thin_from_lowest(&points, cell_m).kept.iter().map(|&i| points[i as usize]).collect())
}

/// Distance of `count` points spread over the two longer sides of the cloud.
fn guess_m(points: &[Vec3], count: usize) -> Option<f32> {
    let mut sides = Bounds::of(points.iter().copied()).size().to_array();
    sides.sort_by(f32::total_cmp);
    let guess_m = (sides[1] * sides[2] / count as f32).sqrt();
    (guess_m > 0.0).then_some(guess_m)
}

/// Median distance between neighbours, from how many lie on a disc.
fn spacing_m(points: &[Vec3]) -> Option<f32> {
    let guess_m = guess_m(points, points.len())?;
    let grid = PointGrid::new(points, 2.0 * guess_m);
    let radius_m = 3.0 * guess_m;
    let spacing = |&i: &u32| {
        let near = grid.within(points[i as usize], radius_m).len() as f32;
        radius_m * (std::f32::consts::PI / near).sqrt()
    };
    let mut all: Vec<f32> =
        thin_from_lowest(points, 8.0 * guess_m).kept.iter().map(spacing).collect();
    all.sort_by(f32::total_cmp);
    all.get(all.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor with balls on it, as a camera sees them: the first along each ray.
    fn seen_from(camera: Vec3, rays: usize) -> Vec<Vec3> {
        let balls: Vec<(Vec3, f32)> = (0..25)
            .map(|k| {
                let (x, y) = ((k % 5) as f32 * 0.2 - 0.4, (k / 5) as f32 * 0.2 - 0.4);
                (Vec3::new(x, y, 0.07), 0.07)
            })
            .collect();
        let mut points = Vec::new();
        let along = |i: usize| i as f32 / rays as f32 - 0.5;
        for i in 0..rays * rays {
            let on_floor = Vec3::new(along(i % rays), along(i / rays), 0.0);
            let ray = on_floor - camera;
            let (length, ray) = (ray.length(), ray.normalize());
            let hit = balls.iter().filter_map(|(centre, radius)| {
                let along = (*centre - camera).dot(ray);
                let off2 = (camera + ray * along - *centre).length_squared();
                (off2 < radius * radius).then(|| along - (radius * radius - off2).sqrt())
            });
            points.push(camera + ray * hit.fold(length, f32::min));
        }
        points
    }

    #[test]
    fn the_camera_is_where_the_cloud_hides_nothing() {
        // The last has more points than are looked at.
        let aside = Vec3::new(0.25, -0.1, 0.8);
        for (camera, rays) in [(Vec3::Z * 1.1, 120), (aside, 120), (aside, 280)] {
            let mut points = seen_from(camera, rays);
            let found = camera_place(&points, 0.01).unwrap();
            let off = (found.normalize().angle_between(camera.normalize())).to_degrees();
            assert!(off < 4.0, "{camera}: {found}");
            assert!((found.length() / camera.length()).ln().abs() < 0.25, "{camera}: {found}");
            points.reverse();
            assert_eq!(camera_place(&points, 0.01), Some(found));
        }
    }

    #[test]
    fn too_few_points_tell_nothing() {
        assert_eq!(camera_place(&[Vec3::ZERO; 200], 0.01), None);
        assert_eq!(camera_place(&seen_from(Vec3::Z, 120)[..50], 0.01), None);
    }
}
