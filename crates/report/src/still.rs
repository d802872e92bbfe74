//! A picture of points and meshes by our own z-buffer, for README, scene previews and the report's plan view.
//!
//! Drawn at twice the size and averaged; light from the upper left, a shadow map, and edges darkened where
//! the depth jumps, so that a heap of grey blocks reads as blocks.

use crate::ReportError;
use crate::colour::Rgb;
use geom::{Bounds, Pose, TriMesh, Vec2, Vec3};

/// Where one looks from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// What lies in the middle of the picture.
    pub target: Vec3,
    /// From the target towards the eye.
    pub towards_eye: Vec3,
    /// Which way is up in the picture.
    pub up: Vec3,
    /// How it is projected.
    pub lens: Lens,
}

/// Projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Parallel, showing this height, metres.
    Parallel {
        /// Height of the picture, metres.
        height_m: f32,
    },
    /// Perspective.
    Perspective {
        /// From the eye to the target, metres.
        distance_m: f32,
        /// Vertical opening, radians.
        opening_rad: f32,
    },
}

impl Camera {
    /// From the given side, as near as the whole box fits a picture of the given width over height.
    pub fn around(bounds: &Bounds, towards_eye: Vec3, width_over_height: f32) -> Self {
        let opening_rad = 0.5_f32;
        let target = bounds.centre();
        let lens = Lens::Perspective { distance_m: 1.0, opening_rad };
        let mut camera = Self { target, towards_eye: towards_eye.normalize(), up: Vec3::Z, lens };
        let (right, up, back) = camera.axes();
        let (tall, wide) =
            ((opening_rad / 2.0).tan(), (opening_rad / 2.0).tan() * width_over_height);
        let half = bounds.size() / 2.0;
        let needed = (0..8).map(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let corner = half * Vec3::new(sign(0), sign(1), sign(2));
            corner.dot(back) + (corner.dot(right).abs() / wide).max(corner.dot(up).abs() / tall)
        });
        let distance_m = needed.fold(0.0, f32::max) * 1.03;
        camera.lens = Lens::Perspective { distance_m, opening_rad };
        camera
    }

    /// Straight down on the box, north up.
    pub fn plan(bounds: &Bounds) -> Self {
        let lens = Lens::Parallel { height_m: bounds.size().y };
        Self { target: bounds.centre(), towards_eye: Vec3::Z, up: Vec3::Y, lens }
    }

    fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let back = self.towards_eye.normalize();
        let right = self.up.cross(back).normalize();
        (right, back.cross(right), back)
    }
}

/// A mesh in the picture.
#[derive(Clone, Copy, Debug)]
pub struct StillMesh<'a> {
    /// Surface.
    pub mesh: &'a TriMesh,
    /// Where it stands.
    pub pose: Pose,
    /// Its colour.
    pub colour: Rgb,
}

/// Points in the picture.
#[derive(Clone, Copy, Debug)]
pub struct StillPoints<'a> {
    /// Positions.
    pub position_m: &'a [Vec3],
    /// One colour, or one per point.
    pub colour: &'a [Rgb],
    /// Edge of a point's square in the final picture.
    pub size_px: f32,
}

/// A finished picture, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green, blue, opacity.
    pub rgba: Vec<u8>,
}

impl Image {
    /// The picture on a plain ground instead of a transparent one.
    pub fn on(mut self, ground: Rgb) -> Self {
        for pixel in self.rgba.chunks_exact_mut(4) {
            let cover = u16::from(pixel[3]);
            for k in 0..3 {
                pixel[k] = ((u16::from(pixel[k]) * cover + u16::from(ground[k]) * (255 - cover))
                    / 255) as u8;
            }
            pixel[3] = 255;
        }
        self
    }

    /// As a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(|e| ReportError::Pack(e.to_string()))?;
        writer.write_image_data(&self.rgba).map_err(|e| ReportError::Pack(e.to_string()))?;
        writer.finish().map_err(|e| ReportError::Pack(e.to_string()))?;
        Ok(bytes)
    }
}

/// Draws the scene on a transparent ground.
pub fn still(
    width: usize,
    height: usize,
    camera: &Camera,
    meshes: &[StillMesh],
    points: &[StillPoints],
) -> Image {
    const FINER: usize = 2;
    let (w, h) = (width * FINER, height * FINER);
    let view = View::new(camera, w, h);
    let placed: Vec<TriMesh> =
        meshes.iter().map(|m| m.mesh.map(|v| m.pose.transform_point(v))).collect();
    let shadow = Shadow::new(&placed, camera);
    let mut canvas =
        Canvas { w, h, depth: vec![f32::INFINITY; w * h], colour: vec![[0.0; 3]; w * h] };
    for (mesh, look) in placed.iter().zip(meshes) {
        for t in 0..mesh.triangles.len() {
            let normal = mesh.triangle_normal(t);
            let corners = mesh.corners(t);
            let Some(projected) = view.triangle(corners) else { continue };
            let diffuse = normal.dot(shadow.light).max(0.0);
            let sky = 0.5 + 0.5 * normal.z;
            canvas.triangle(projected, |at| {
                let lit =
                    if diffuse > 0.0 { diffuse * shadow.lit(at(corners), normal) } else { 0.0 };
                let shade = 0.30 + 0.25 * sky + 0.55 * lit;
                look.colour.map(|c| linear(c) * shade)
            });
        }
    }
    for set in points {
        for (i, p) in set.position_m.iter().enumerate() {
            let colour = if set.colour.len() == 1 { set.colour[0] } else { set.colour[i] };
            if let Some(at) = view.project(*p) {
                canvas.square(at, set.size_px * FINER as f32, colour.map(linear));
            }
        }
    }
    canvas.darken_edges(view.scale_m, FINER);
    canvas.averaged(width, height, FINER)
}

fn linear(c: u8) -> f32 {
    (f32::from(c) / 255.0).powf(2.2)
}

/// Projection to pixels.
struct View {
    right: Vec3,
    up: Vec3,
    back: Vec3,
    target: Vec3,
    lens: Lens,
    middle: Vec2,
    px: f32,
    /// Metres per pixel at the target.
    scale_m: f32,
}

impl View {
    fn new(camera: &Camera, w: usize, h: usize) -> Self {
        let (right, up, back) = camera.axes();
        let span_m = match camera.lens {
            Lens::Parallel { height_m } => height_m,
            Lens::Perspective { distance_m, opening_rad } => {
                2.0 * distance_m * (opening_rad / 2.0).tan()
            }
        };
        let px = h as f32 / span_m.max(1e-9);
        let middle = Vec2::new(w as f32, h as f32) / 2.0;
        Self {
            right,
            up,
            back,
            target: camera.target,
            lens: camera.lens,
            middle,
            px,
            scale_m: 1.0 / px,
        }
    }

    /// Pixel and depth (metres from the target, growing away from the eye); `None` behind the eye.
    fn project(&self, p: Vec3) -> Option<Vec3> {
        let d = p - self.target;
        let (x, y, depth) = (d.dot(self.right), d.dot(self.up), -d.dot(self.back));
        let shrink = match self.lens {
            Lens::Parallel { .. } => 1.0,
            Lens::Perspective { distance_m, .. } => {
                let away = distance_m + depth;
                if away < 0.01 * distance_m {
                    return None;
                }
                distance_m / away
            }
        };
        Some(Vec3::new(
            self.middle.x + x * self.px * shrink,
            self.middle.y - y * self.px * shrink,
            depth,
        ))
    }

    fn triangle(&self, corners: [Vec3; 3]) -> Option<[Vec3; 3]> {
        Some([self.project(corners[0])?, self.project(corners[1])?, self.project(corners[2])?])
    }
}

/// Depth seen from the light.
struct Shadow {
    light: Vec3,
    view: View,
    depth: Canvas,
}

impl Shadow {
    const EDGE: usize = 1400;

    fn new(meshes: &[TriMesh], camera: &Camera) -> Self {
        let (right, up, back) = camera.axes();
        let light = (back * 0.5 + up * 0.6 - right * 0.75 + Vec3::Z * 0.9).normalize();
        let bounds = Bounds::of(meshes.iter().flat_map(|m| m.vertices.iter().copied()));
        let bounds =
            if bounds.is_empty() { Bounds { min: Vec3::ZERO, max: Vec3::ONE } } else { bounds };
        let lens = Lens::Parallel { height_m: bounds.size().length() };
        let from_light = Camera {
            target: bounds.centre(),
            towards_eye: light,
            up: light.any_orthonormal_vector(),
            lens,
        };
        let view = View::new(&from_light, Self::EDGE, Self::EDGE);
        let n = Self::EDGE * Self::EDGE;
        let mut depth = Canvas {
            w: Self::EDGE,
            h: Self::EDGE,
            depth: vec![f32::INFINITY; n],
            colour: Vec::new(),
        };
        for mesh in meshes {
            for t in 0..mesh.triangles.len() {
                if let Some(corners) = view.triangle(mesh.corners(t)) {
                    depth.depth_only(corners);
                }
            }
        }
        Self { light, view, depth }
    }

    /// Share of the light that reaches a point, softened over neighbouring cells.
    fn lit(&self, p: Vec3, normal: Vec3) -> f32 {
        let lifted = p + normal * (2.5 * self.view.scale_m);
        let Some(at) = self.view.project(lifted) else { return 1.0 };
        let mut open = 0;
        for (dx, dy) in [(0.0, 0.0), (1.2, 0.0), (-1.2, 0.0), (0.0, 1.2), (0.0, -1.2)] {
            let (x, y) = ((at.x + dx) as usize, (at.y + dy) as usize);
            let seen = x >= Self::EDGE
                || y >= Self::EDGE
                || at.z <= self.depth.depth[y * Self::EDGE + x] + 2.0 * self.view.scale_m;
            open += u32::from(seen);
        }
        open as f32 / 5.0
    }
}

struct Canvas {
    w: usize,
    h: usize,
    depth: Vec<f32>,
    colour: Vec<[f32; 3]>,
}

impl Canvas {
    /// Calls `hit` with (pixel, depth, barycentric weights) for every pixel the triangle is nearest in.
    fn cover(&mut self, [a, b, c]: [Vec3; 3], mut hit: impl FnMut(&mut Self, usize, [f32; 3])) {
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area.abs() < 1e-9 || !area.is_finite() {
            return;
        }
        let range = |lo: f32, hi: f32, n: usize| {
            (lo.floor().max(0.0) as usize)..(hi.ceil().clamp(0.0, n as f32) as usize)
        };
        let (w, h) = (self.w, self.h);
        for y in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), h) {
            for x in range(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), w) {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let wb = ((px - a.x) * (c.y - a.y) - (py - a.y) * (c.x - a.x)) / area;
                let wc = ((b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x)) / area;
                let wa = 1.0 - wb - wc;
                if wa < 0.0 || wb < 0.0 || wc < 0.0 {
                    continue;
                }
                let depth = wa * a.z + wb * b.z + wc * c.z;
                let i = y * w + x;
                if depth < self.depth[i] {
                    self.depth[i] = depth;
                    hit(self, i, [wa, wb, wc]);
                }
            }
        }
    }

    fn depth_only(&mut self, corners: [Vec3; 3]) {
        self.cover(corners, |_, _, _| {});
    }

    fn triangle(
        &mut self,
        projected: [Vec3; 3],
        colour: impl Fn(&dyn Fn([Vec3; 3]) -> Vec3) -> [f32; 3],
    ) {
        self.cover(projected, |canvas, i, [wa, wb, wc]| {
            canvas.colour[i] = colour(&|[a, b, c]| a * wa + b * wb + c * wc);
        });
    }

    fn square(&mut self, at: Vec3, size: f32, colour: [f32; 3]) {
        let from = |v: f32| (v - size / 2.0).round().max(0.0) as usize;
        let to = |v: f32, n: usize| ((v + size / 2.0).round().max(0.0) as usize).min(n);
        for y in from(at.y)..to(at.y, self.h) {
            for x in from(at.x)..to(at.x, self.w) {
                let i = y * self.w + x;
                if at.z < self.depth[i] {
                    self.depth[i] = at.z;
                    self.colour[i] = colour;
                }
            }
        }
    }

    /// Darkens pixels by how much nearer their neighbours are (after eye-dome lighting, Boucheny 2009).
    fn darken_edges(&mut self, scale_m: f32, finer: usize) {
        let reach = finer as isize;
        let shade: Vec<f32> = (0..self.w * self.h)
            .map(|i| {
                let here = self.depth[i];
                if !here.is_finite() {
                    return 1.0;
                }
                let (x, y) = ((i % self.w) as isize, (i / self.w) as isize);
                let mut nearer = 0.0;
                for (dx, dy) in
                    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)]
                {
                    let (x, y) = (x + dx * reach, y + dy * reach);
                    if x >= 0 && y >= 0 && (x as usize) < self.w && (y as usize) < self.h {
                        let there = self.depth[y as usize * self.w + x as usize];
                        nearer += ((here - there) / (scale_m * 24.0)).clamp(0.0, 1.0);
                    }
                }
                (-0.16 * nearer).exp()
            })
            .collect();
        for (c, s) in self.colour.iter_mut().zip(shade) {
            *c = c.map(|v| v * s);
        }
    }

    fn averaged(&self, width: usize, height: usize, finer: usize) -> Image {
        let mut rgba = Vec::with_capacity(width * height * 4);
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut covered) = ([0.0; 3], 0.0);
                for k in 0..finer * finer {
                    let i = (y * finer + k / finer) * self.w + x * finer + k % finer;
                    if self.depth[i].is_finite() {
                        covered += 1.0;
                        (0..3).for_each(|c| sum[c] += self.colour[i][c]);
                    }
                }
                let byte = |v: f32| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
                rgba.extend(sum.map(|v| if covered > 0.0 { byte(v / covered) } else { 0 }));
                rgba.push((covered / (finer * finer) as f32 * 255.0) as u8);
            }
        }
        Image { width, height, rgba }
    }
}
