//! A pinhole camera whose image just holds a region of the scene.

use crate::range_map::Projection;
use geom::{Bounds, Vec3};

/// Position, viewing axes and image.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    pub position: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    /// Image-plane length of one pixel at depth 1.
    pixel: f32,
    /// Image-plane coordinates of the image's corner.
    corner: [f32; 2],
    size: [usize; 2],
}

/// Longest image side; beyond it pixels grow.
const LONGEST_SIDE: f32 = 4000.0;

impl Camera {
    /// A camera at `position` looking at the middle of `region`, with pixels of `pixel_m` there.
    pub fn looking_at(region: &Bounds, position: Vec3, pixel_m: f32) -> Self {
        let to = region.centre() - position;
        let forward = to.normalize();
        let reference = if forward.z.abs() > 0.99 { Vec3::Y } else { Vec3::Z };
        let right = forward.cross(reference).normalize();
        let up = right.cross(forward);
        let (low, high) = (region.min, region.max);
        let mut span = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        for i in 0..8 {
            let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
            let d =
                Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
                    - position;
            let depth = d.dot(forward).max(1e-3 * to.length());
            for (axis, direction) in [right, up].into_iter().enumerate() {
                let at = d.dot(direction) / depth;
                span[axis] = [span[axis][0].min(at), span[axis][1].max(at)];
            }
        }
        let widest = (span[0][1] - span[0][0]).max(span[1][1] - span[1][0]);
        let pixel = (pixel_m / to.length()).max(widest / LONGEST_SIDE);
        // One pixel of margin, so that points on the border have four rays around them.
        let size = span.map(|s| ((s[1] - s[0]) / pixel).ceil() as usize + 3);
        let corner = span.map(|s| s[0] - 1.5 * pixel);
        Self { position, forward, right, up, pixel, corner, size }
    }

    /// Width of a pixel at depth 1.
    pub fn pixel(&self) -> f32 {
        self.pixel
    }
}

impl Projection for Camera {
    fn size(&self) -> [usize; 2] {
        self.size
    }

    fn project(&self, point: Vec3) -> Option<[f32; 3]> {
        let d = point - self.position;
        let depth = d.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let at = |axis: Vec3, corner: f32| (d.dot(axis) / depth - corner) / self.pixel;
        Some([at(self.right, self.corner[0]), at(self.up, self.corner[1]), depth])
    }

    fn faces(&self, point: Vec3, normal: Vec3) -> bool {
        normal.dot(point - self.position) < 0.0
    }

    fn row_plane(&self, row: usize) -> (Vec3, f32) {
        let normal = self.up - self.forward * (self.corner[1] + (row as f32 + 0.5) * self.pixel);
        (normal, normal.dot(self.position))
    }

    fn ray(&self, column: usize, row: usize) -> (Vec3, Vec3) {
        let at = |i: usize, corner: f32| corner + (i as f32 + 0.5) * self.pixel;
        let direction = self.forward
            + self.right * at(column, self.corner[0])
            + self.up * at(row, self.corner[1]);
        (self.position, direction)
    }
}
