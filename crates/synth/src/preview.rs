//! A picture of a scene to judge it by eye: the cloud from above and at a slant, one colour a block, grey for the rest.

use crate::SynthScene;
use geom::Vec3;
use std::io;

/// Pixels of one side of each of the two views.
const SIDE: usize = 700;

/// The picture as a PNG file: plan view on the left, slanted view on the right.
pub fn preview_png(scene: &SynthScene) -> io::Result<Vec<u8>> {
    let mut rgb = vec![255_u8; 2 * SIDE * SIDE * 3];
    let down = Vec3::NEG_Z;
    let slant = Vec3::new(-0.45, 0.55, -0.7).normalize();
    for (panel, (forward, up)) in [(down, Vec3::Y), (slant, Vec3::Z)].into_iter().enumerate() {
        draw(scene, forward, up, panel * SIDE, &mut rgb);
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 2 * SIDE as u32, SIDE as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(file)
}

/// Parallel projection of all points, nearest on top, into the square that starts at column `left`.
fn draw(scene: &SynthScene, forward: Vec3, up: Vec3, left: usize, rgb: &mut [u8]) {
    let right = forward.cross(up).normalize();
    let up = right.cross(forward);
    let points = &scene.survey.cloud.position_m;
    let middle = scene.survey.cloud.bounds().centre();
    let flat = |p: &Vec3| {
        let d = *p - middle;
        [d.dot(right), d.dot(up), d.dot(forward)]
    };
    let reach = points.iter().map(|p| flat(p)[0].abs().max(flat(p)[1].abs())).fold(1e-6, f32::max);
    let scale = 0.48 * SIDE as f32 / reach;
    let mut nearest = vec![f32::INFINITY; SIDE * SIDE];
    // Points grow so that a whole face closes.
    let splat = (0.6 * SIDE as f32 / (points.len() as f32).sqrt()).ceil().clamp(1.0, 6.0) as i32;
    for (p, &block) in points.iter().zip(&scene.instance) {
        let [x, y, depth] = flat(p);
        let (u, v) =
            ((SIDE as f32 / 2.0 + x * scale) as i32, (SIDE as f32 / 2.0 - y * scale) as i32);
        let colour = shade(block, (p.z - middle.z) / reach);
        for (u, v) in (0..splat * splat).map(|k| (u + k % splat, v + k / splat)) {
            if !(0..SIDE as i32).contains(&u) || !(0..SIDE as i32).contains(&v) {
                continue;
            }
            let (u, v) = (u as usize, v as usize);
            if depth < nearest[v * SIDE + u] {
                nearest[v * SIDE + u] = depth;
                let at = (v * 2 * SIDE + left + u) * 3;
                rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
    }
}

/// A colour a block (hues by the golden ratio, so that neighbours in number differ), brighter with height.
fn shade(block: u32, height: f32) -> [u8; 3] {
    let light = (0.75 + 0.6 * height).clamp(0.35, 1.0);
    if block == 0 {
        return [(150.0 * light) as u8; 3];
    }
    let hue = (block as f32 * 0.618_034).fract() * 6.0;
    let channel = |shift: f32| {
        let h = (hue + shift).rem_euclid(6.0);
        (255.0 * light * (1.0 - 0.8 * (h.min(4.0 - h).clamp(0.0, 1.0)))) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}
