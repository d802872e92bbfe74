//! A triangulated surface in site coordinates, and its heights on a grid.

use geom::DVec3;
use scene::DesignSurface;

/// Triangles over (east, north), f64.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tin {
    /// Vertices: east, north, up.
    pub vertices: Vec<DVec3>,
    /// Indices of each triangle's corners.
    pub triangles: Vec<[u32; 3]>,
}

/// A grid would have more nodes than this.
const NODES_LIMIT: f64 = 10e6;

impl Tin {
    /// From single triangles.
    pub fn of_faces(faces: &[[DVec3; 3]]) -> Self {
        let vertices = faces.iter().flatten().copied().collect();
        let triangles = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Self { vertices, triangles }
    }

    /// Samples the surface at the nodes of a grid (NaN outside, the higher of two where it overlaps itself).
    /// `Err` says why that cannot be done.
    pub fn on_grid(&self, cell_m: f64) -> Result<DesignSurface, String> {
        let mut corners = self.triangles.iter().flatten().map(|&i| self.vertices[i as usize]);
        let first = corners.next().ok_or("the surface has no triangles")?;
        let (low, high) = corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        let origin = [(low.x / cell_m).floor() * cell_m, (low.y / cell_m).floor() * cell_m];
        let columns = ((high.x - origin[0]) / cell_m).ceil() + 1.0;
        let rows = ((high.y - origin[1]) / cell_m).ceil() + 1.0;
        if !(columns * rows <= NODES_LIMIT) {
            return Err(format!(
                "a grid of {cell_m} m over {:.1} m × {:.1} m is too fine; choose a larger cell_m, or is the unit not metres?",
                high.x - low.x,
                high.y - low.y
            ));
        }
        let (columns, rows) = ((columns as usize).max(2), (rows as usize).max(2));
        let mut level_m = vec![f64::NAN; columns * rows];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.vertices[i as usize]);
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            if area.abs() < 1e-12 {
                continue; // a wall seen from above
            }
            let span = |axis: usize, n: usize| {
                let values = [a[axis], b[axis], c[axis]].map(|v| (v - origin[axis]) / cell_m);
                let low =
                    values.iter().copied().fold(f64::INFINITY, f64::min).ceil().max(0.0) as usize;
                let high = values.iter().copied().fold(0.0, f64::max).floor() as usize;
                low..=high.min(n - 1)
            };
            for j in span(1, rows) {
                for i in span(0, columns) {
                    let p = DVec3::new(
                        origin[0] + i as f64 * cell_m,
                        origin[1] + j as f64 * cell_m,
                        0.0,
                    )
                    .truncate();
                    let wb = (p - a.truncate()).perp_dot((c - a).truncate()) / area;
                    let wc = (b - a).truncate().perp_dot(p - a.truncate()) / area;
                    if wb < -1e-9 || wc < -1e-9 || wb + wc > 1.0 + 1e-9 {
                        continue;
                    }
                    let level = a.z + wb * (b.z - a.z) + wc * (c.z - a.z);
                    let node = &mut level_m[j * columns + i];
                    *node = node.max(level); // max passes over NaN
                }
            }
        }
        Ok(DesignSurface::Grid { origin, cell_m, columns, level_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sloping_square_has_its_plane_on_the_grid() {
        let z = |x: f64, y: f64| 3.0 - 0.5 * x + 0.25 * y;
        let v = |x: f64, y: f64| DVec3::new(x + 1000.0, y - 500.0, z(x, y));
        let tin = Tin::of_faces(&[
            [v(0.0, 0.0), v(4.0, 0.0), v(4.0, 3.0)],
            [v(0.0, 0.0), v(4.0, 3.0), v(0.0, 3.0)],
        ]);
        let surface = tin.on_grid(0.5).unwrap();
        for (x, y) in [(0.0, 0.0), (1.25, 2.75), (4.0, 3.0), (2.0, 1.5)] {
            let level = surface.level_at(1000.0 + x, -500.0 + y).unwrap();
            assert!((level - z(x, y)).abs() < 1e-9, "{x} {y}: {level}");
        }
        assert_eq!(surface.level_at(1000.0 - 0.1, -500.0), None);
        assert!(tin.on_grid(1e-6).unwrap_err().contains("too fine"));
    }
}
