//! A survey from above, and the difference of two: height as colour, slopes as shade.

use crate::Image;
use crate::colour::{Rgb, diverging, ramp};
use geom::{HeightMap, Vec3};

/// Where the light comes from: north-west, 45° high, as maps have it.
const LIGHT: Vec3 = Vec3::new(-0.5, 0.5, std::f32::consts::FRAC_1_SQRT_2);
/// Shade of a face turned away.
const DARKEST: f32 = 0.35;

/// The map as a picture, north up, one pixel a cell; `range_m` is darkest and lightest height. Cells without a height stay
/// transparent.
pub fn relief(map: &HeightMap, range_m: [f32; 2]) -> Image {
    let [low, high] = range_m;
    picture(map, |x, y, z| {
        let shade = shade(map, x, y);
        ramp((z - low) / (high - low).max(1e-3)).map(|v| (f32::from(v) * shade) as u8)
    })
}

/// How much higher `later` is than `earlier`, two maps over the same cells; blue is lower, orange is higher, full colour from
/// `limit_m` on. Cells that one of them lacks stay transparent.
pub fn difference(earlier: &HeightMap, later: &HeightMap, limit_m: f32) -> Image {
    picture(later, |x, y, z| diverging((z - earlier.at(x, y)) / limit_m.max(1e-6)))
        .without(|x, y| !earlier.at(x, y).is_finite(), later.ny)
}

fn picture(map: &HeightMap, colour: impl Fn(usize, usize, f32) -> Rgb) -> Image {
    let mut rgba = Vec::with_capacity(4 * map.nx * map.ny);
    for y in (0..map.ny).rev() {
        for x in 0..map.nx {
            let z = map.at(x, y);
            let pixel = if z.is_finite() {
                let [r, g, b] = colour(x, y, z);
                [r, g, b, 255]
            } else {
                [0; 4]
            };
            rgba.extend(pixel);
        }
    }
    Image { width: map.nx, height: map.ny, rgba }
}

impl Image {
    /// Makes the cells transparent for which `empty` holds; rows of cells count from the south.
    fn without(mut self, empty: impl Fn(usize, usize) -> bool, rows: usize) -> Self {
        for (i, pixel) in self.rgba.chunks_exact_mut(4).enumerate() {
            if empty(i % self.width, rows - 1 - i / self.width) {
                pixel.fill(0);
            }
        }
        self
    }
}

/// Light on a cell, from [`DARKEST`] to 1.
fn shade(map: &HeightMap, x: usize, y: usize) -> f32 {
    let own = map.at(x, y);
    let at = |x: usize, y: usize| Some(map.at(x, y)).filter(|z| z.is_finite()).unwrap_or(own);
    let east = at((x + 1).min(map.nx - 1), y) - at(x.saturating_sub(1), y);
    let north = at(x, (y + 1).min(map.ny - 1)) - at(x, y.saturating_sub(1));
    let normal = Vec3::new(-east, -north, 2.0 * map.cell_m).normalize_or(Vec3::Z);
    DARKEST + (1.0 - DARKEST) * normal.dot(LIGHT).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::Vec2;

    fn map(height_m: impl Fn(f32, f32) -> f32) -> HeightMap {
        let mut map = HeightMap::empty(Vec2::ZERO, Vec2::new(4.0, 3.0), 1.0);
        map.fill_with(height_m);
        map
    }

    #[test]
    fn north_is_up_and_the_light_comes_from_the_north_west() {
        let high_in_the_north = map(|_, y| if y > 2.0 { 9.0 } else { f32::NAN });
        let picture = relief(&high_in_the_north, [0.0, 9.0]);
        assert_eq!((picture.width, picture.height), (high_in_the_north.nx, high_in_the_north.ny));
        assert_eq!(picture.rgba[3], 255, "the first row is the northernmost");
        assert_eq!(*picture.rgba.last().unwrap(), 0, "nothing was measured in the south");
        let facing = |sign: f32| relief(&map(|x, y| sign * (x - y)), [-1e6, 1.0]).rgba[20];
        assert!(facing(1.0) > facing(-1.0), "a face to the north-west is lit");
    }

    #[test]
    fn what_sank_is_blue_and_what_is_unknown_is_nothing() {
        let before = map(|x, _| if x > 3.0 { f32::NAN } else { 1.0 });
        let after = map(|_, y| if y > 1.5 { 0.5 } else { 1.5 });
        let picture = difference(&before, &after, 0.5);
        let pixel = |x: usize, y: usize| &picture.rgba[4 * (y * picture.width + x)..][..4];
        assert!(pixel(0, 0)[2] > pixel(0, 0)[0] && pixel(0, picture.height - 1)[0] > 100);
        assert_eq!(pixel(picture.width - 1, 0)[3], 0);
    }
}
