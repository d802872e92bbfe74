//! The bed under the pile: level, sloping, smooth or of rubble stones.

use crate::recipe::{Bed, Resolved};
use geom::{SeedTree, TriMesh, Vec3};
use rand::RngExt;
use scene::Ground;

/// Distance of the stones' lattice in stones: closer than a stone, so that the bed is closed. Free choice.
const SPACING: f32 = 0.8;

/// Grid nodes across one stone.
const NODES_PER_STONE: f32 = 2.5;
/// How far the bed continues past the site, in lengths of the largest block.
const MARGIN: f32 = 1.0;

/// The ground of a scene. Rubble is a grid whose stones are half-sunk ellipsoids on a jittered lattice.
pub(crate) fn bed(bed: &Bed, resolved: &Resolved, seed: SeedTree) -> Ground {
    let (sin, cos) = bed.falls_towards_deg.to_radians().sin_cos();
    let fall = if bed.slope_m > 0.0 { 1.0 / bed.slope_m } else { 0.0 };
    let plane = |x: f32, y: f32| match bed.toe_blocks {
        Some(_) => bed.plane_m(x, y, resolved.largest_m),
        None => -fall * (x * cos + y * sin),
    };
    if bed.stone_blocks == 0.0 && !(bed.toe_blocks.is_some() && fall > 0.0) {
        if fall == 0.0 {
            return Ground::Level { z_m: 0.0 };
        }
        return Ground::Plane {
            point: Vec3::ZERO,
            normal: Vec3::new(fall * cos, fall * sin, 1.0).normalize(),
        };
    }
    let stone_m = bed.stone_blocks * resolved.largest_m;
    // A smooth slope with a toe needs nodes too.
    let smooth = stone_m == 0.0;
    let cell_m = if smooth { 0.1 * resolved.largest_m } else { stone_m / NODES_PER_STONE };
    let margin = MARGIN * resolved.largest_m;
    let half = resolved.size_m.map(|s| s / 2.0 + margin);
    let [nx, ny] = half.map(|h| (2.0 * h / cell_m).ceil() as usize + 1);
    let origin = [-half[0], -half[1]];
    let mut z_m: Vec<f32> = (0..nx * ny)
        .map(|i| {
            plane(origin[0] + (i % nx) as f32 * cell_m, origin[1] + (i / nx) as f32 * cell_m)
                - 0.5 * stone_m
        })
        .collect();
    if smooth {
        return Ground::Grid { origin, cell_m, nx, z_m };
    }
    let mut rng = seed.rng();
    let lattice = SPACING * stone_m;
    let [mx, my] = half.map(|h| (2.0 * h / lattice).ceil() as usize + 1);
    for k in 0..mx * my {
        let mut jitter = || rng.random_range(-0.4..0.4) * lattice;
        let (x, y) = (
            origin[0] + (k % mx) as f32 * lattice + jitter(),
            origin[1] + (k / mx) as f32 * lattice + jitter(),
        );
        let radius: [f32; 3] = std::array::from_fn(|_| stone_m * rng.random_range(0.4..0.75));
        // The tops lie within a third of a stone of the plane.
        let centre = plane(x, y) - radius[2] + stone_m * rng.random_range(-0.2..0.15);
        let range = |c: f32, r: f32, o: f32, n: usize| {
            let low = ((c - r - o) / cell_m).ceil().max(0.0) as usize;
            low..(((c + r - o) / cell_m).floor() + 1.0).clamp(0.0, n as f32) as usize
        };
        for iy in range(y, radius[1], origin[1], ny) {
            for ix in range(x, radius[0], origin[0], nx) {
                let dx = (origin[0] + ix as f32 * cell_m - x) / radius[0];
                let dy = (origin[1] + iy as f32 * cell_m - y) / radius[1];
                let inside = 1.0 - dx * dx - dy * dy;
                if inside > 0.0 {
                    let z = &mut z_m[iy * nx + ix];
                    *z = z.max(centre + radius[2] * inside.sqrt());
                }
            }
        }
    }
    Ground::Grid { origin, cell_m, nx, z_m }
}

/// Position of a node of the bed by column and row.
type Node<'a> = Box<dyn Fn(usize, usize) -> Vec3 + 'a>;

/// The ground inside the site as triangles facing up.
pub(crate) fn bed_mesh(ground: &Ground, size_m: [f32; 2]) -> TriMesh {
    let (columns, rows, node): (usize, usize, Node) = match ground {
        Ground::Level { .. } | Ground::Plane { .. } => {
            let corner = move |i: usize, j: usize| {
                let (x, y) = ((i as f32 - 0.5) * size_m[0], (j as f32 - 0.5) * size_m[1]);
                Vec3::new(x, y, ground.height_m(x, y))
            };
            (2, 2, Box::new(corner))
        }
        Ground::Grid { origin, cell_m, nx, z_m } => {
            let index = move |size: f32, start: f32, up: bool| {
                let at = ((if up { 0.5 } else { -0.5 }) * size - start) / cell_m;
                if up { at.ceil() as usize } else { at.floor().max(0.0) as usize }
            };
            let (x0, y0) = (index(size_m[0], origin[0], false), index(size_m[1], origin[1], false));
            let (x1, y1) = (
                index(size_m[0], origin[0], true).min(nx - 1),
                index(size_m[1], origin[1], true).min(z_m.len() / nx - 1),
            );
            let node = move |i: usize, j: usize| {
                let (ix, iy) = (x0 + i, y0 + j);
                Vec3::new(
                    origin[0] + ix as f32 * cell_m,
                    origin[1] + iy as f32 * cell_m,
                    z_m[iy * nx + ix],
                )
            };
            (x1 - x0 + 1, y1 - y0 + 1, Box::new(node))
        }
    };
    let mut mesh = TriMesh::default();
    mesh.vertices.extend((0..rows * columns).map(|k| node(k % columns, k / columns)));
    for j in 0..rows as u32 - 1 {
        for i in 0..columns as u32 - 1 {
            let a = j * columns as u32 + i;
            let b = a + columns as u32;
            mesh.triangles.push([a, a + 1, b + 1]);
            mesh.triangles.push([a, b + 1, b]);
        }
    }
    mesh
}
