//! Convex parts of a solid by cutting it with planes: for thin walls and bores, which voxels are too coarse for.
//!
//! In: a closed mesh of about unit size and the excess allowed. Out: the hulls of the pieces. Each piece lies in a convex
//! cell of its own, so no two hulls overlap before the last step and their volumes add up: the excess is known at every
//! cut. The piece with the largest excess is cut where the hulls of its two halves are smallest; when the sum is right
//! (or there are too many), pieces whose common hull adds next to nothing are joined again.

use geom::{Mat3, MeshQuery, TriMesh, Vec3};
use parry3d::transformation::try_convex_hull;
use rayon::prelude::*;
use std::collections::HashMap;

/// Nodes of the grid along each axis that tells how much of the solid a cell holds.
const GRID: usize = 72;
/// Places tried along each direction.
const PLACES: usize = 7;
/// What an uneven cut must gain, as a share of the hull: equal gains are decided for the even one.
const EVEN: f64 = 0.01;

/// A convex cell of space and what of the solid lies in it.
#[derive(Clone, Default)]
struct Cell {
    /// Outward planes (normal, offset) of the cuts that made it.
    planes: Vec<(Vec3, f32)>,
    /// The surface inside.
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Corners of the cell that lie within the solid.
    corners: Vec<Vec3>,
    /// Grid nodes within the solid.
    inside: Vec<Vec3>,
    hull_volume: f64,
}

impl Cell {
    /// Everything whose hull is the piece's.
    fn hull_points(&self) -> Vec<Vec3> {
        self.points.iter().chain(&self.corners).copied().collect()
    }

    fn measured(mut self) -> Self {
        self.hull_volume = hull_volume(&self.hull_points());
        self
    }
}

/// Hulls whose volumes add up to at most 1 + `excess` of the mesh's where `most_parts` allow it.
pub(crate) fn plane_split(mesh: &TriMesh, excess: f64, most_parts: usize) -> Vec<Vec<Vec3>> {
    let Ok(query) = MeshQuery::new(mesh) else { return Vec::new() };
    let volume = f64::from(mesh.moments().volume_m3);
    let mut cells = vec![whole(mesh, &query)];
    let node = volume / cells[0].inside.len().max(1) as f64;
    let total = |cells: &[Cell]| cells.iter().map(|c| c.hull_volume).sum::<f64>();
    // Joining takes up a part of what is allowed.
    while total(&cells) > (1.0 + 0.7 * excess) * volume && cells.len() < most_parts {
        let over = |c: &Cell| c.hull_volume - node * c.inside.len() as f64;
        let worst = (0..cells.len())
            .max_by(|&a, &b| over(&cells[a]).total_cmp(&over(&cells[b])))
            .unwrap_or(0);
        let Some((low, high)) = best_cut(&cells[worst], &query) else { break };
        cells[worst] = low;
        cells.push(high);
    }
    let pieces: Vec<Vec<Vec3>> = cells.iter().map(Cell::hull_points).collect();
    let allowed = ((1.0 + excess) * volume).max(total(&cells) + 0.1 * excess * volume);
    joined(pieces, allowed)
}

fn whole(mesh: &TriMesh, query: &MeshQuery) -> Cell {
    let bounds = mesh.bounds();
    let step = bounds.size() / GRID as f32;
    let row = |k: usize| {
        let node = |i: usize| {
            let at = Vec3::new(i as f32, (k % GRID) as f32, (k / GRID) as f32) + Vec3::splat(0.5);
            Some(bounds.min + at * step).filter(|p| query.signed_distance_m(*p) < 0.0)
        };
        (0..GRID).filter_map(node).collect::<Vec<_>>()
    };
    let inside = (0..GRID * GRID).into_par_iter().flat_map_iter(row).collect();
    let cell = Cell {
        points: mesh.vertices.clone(),
        triangles: mesh.triangles.clone(),
        inside,
        ..Cell::default()
    };
    cell.measured()
}

/// The two halves with the smallest hulls; `None` for a piece that cannot be cut.
fn best_cut(cell: &Cell, query: &MeshQuery) -> Option<(Cell, Cell)> {
    let mut planes = Vec::new();
    for normal in directions(&cell.inside) {
        let along = || cell.points.iter().map(|p| normal.dot(*p));
        let (low, high) =
            (along().fold(f32::INFINITY, f32::min), along().fold(f32::NEG_INFINITY, f32::max));
        if high - low > 1e-4 {
            let at = |k: usize| low + (high - low) * k as f32 / (PLACES + 1) as f32;
            planes.extend((1..=PLACES).map(|k| (normal, at(k))));
        }
    }
    let cut = |&plane: &(Vec3, f32)| {
        let (low, high) = (half(cell, plane, 1.0, query), half(cell, plane, -1.0, query));
        let all = cell.inside.len().max(1) as f64;
        let uneven = (low.inside.len() as f64 - high.inside.len() as f64).abs() / all;
        let useful = low.hull_volume > 0.0 && high.hull_volume > 0.0;
        let cost = (low.hull_volume + high.hull_volume) / cell.hull_volume + EVEN * uneven;
        (if useful { cost } else { f64::INFINITY }, low, high)
    };
    let halves: Vec<_> = planes.par_iter().map(cut).collect();
    let best = halves.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    best.0.is_finite().then_some((best.1, best.2))
}

/// Axes, their diagonals, and the piece's own principal axes.
fn directions(inside: &[Vec3]) -> Vec<Vec3> {
    let mut all: Vec<Vec3> = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [0.0, 1.0, 1.0],
        [0.0, 1.0, -1.0],
    ]
    .into_iter()
    .map(|d| Vec3::from_array(d).normalize())
    .collect();
    if inside.len() > 8 {
        all.extend(principal_axes(inside));
    }
    all
}

/// Eigenvectors of the covariance by Jacobi rotations.
fn principal_axes(points: &[Vec3]) -> [Vec3; 3] {
    let mean = points.iter().copied().sum::<Vec3>() / points.len() as f32;
    let mut a = [[0.0_f64; 3]; 3];
    for p in points {
        let d = (*p - mean).as_dvec3().to_array();
        for i in 0..3 {
            for j in 0..3 {
                a[i][j] += d[i] * d[j];
            }
        }
    }
    let mut axes = Mat3::IDENTITY;
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].abs() < 1e-15 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
            }
            let (u, v) = (axes.col(p), axes.col(q));
            *axes.col_mut(p) = u * c as f32 - v * s as f32;
            *axes.col_mut(q) = u * s as f32 + v * c as f32;
        }
    }
    [axes.x_axis, axes.y_axis, axes.z_axis].map(Vec3::normalize)
}

/// What lies on the side of the plane where `side`·(n·p − offset) ≤ 0.
fn half(cell: &Cell, (normal, offset): (Vec3, f32), side: f32, query: &MeshQuery) -> Cell {
    let plane = (normal * side, offset * side);
    let above = |p: Vec3| plane.0.dot(p) - plane.1;
    let mut made = Cell { planes: cell.planes.clone(), ..Cell::default() };
    let mut index: HashMap<[u32; 3], u32> = HashMap::new();
    let mut put = |p: Vec3, points: &mut Vec<Vec3>| {
        *index.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
            points.push(p);
            points.len() as u32 - 1
        })
    };
    for t in &cell.triangles {
        let corners = t.map(|i| cell.points[i as usize]);
        let heights = corners.map(above);
        if heights.iter().all(|h| *h > 0.0) {
            continue;
        }
        let mut polygon: Vec<u32> = Vec::with_capacity(4);
        for i in 0..3 {
            let j = (i + 1) % 3;
            if heights[i] <= 0.0 {
                polygon.push(put(corners[i], &mut made.points));
            }
            if (heights[i] <= 0.0) != (heights[j] <= 0.0) {
                // The two triangles of an edge must cut it in the same bits: always from its lower end.
                let (a, b) =
                    if corners[i].to_array() < corners[j].to_array() { (i, j) } else { (j, i) };
                let cut = corners[a].lerp(corners[b], heights[a] / (heights[a] - heights[b]));
                polygon.push(put(cut, &mut made.points));
            }
        }
        for k in 2..polygon.len() {
            made.triangles.push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
    made.inside = cell.inside.iter().copied().filter(|p| above(*p) <= 0.0).collect();
    made.corners = cell.corners.iter().copied().filter(|p| above(*p) <= 0.0).collect();
    for (i, a) in cell.planes.iter().enumerate() {
        for b in &cell.planes[..i] {
            let Some(corner) = meet([plane, *a, *b]) else { continue };
            let in_cell = cell.planes.iter().all(|(n, d)| n.dot(corner) <= d + 1e-5);
            if in_cell && query.signed_distance_m(corner) < 0.0 {
                made.corners.push(corner);
            }
        }
    }
    made.planes.push(plane);
    made.measured()
}

/// The point on three planes.
fn meet(planes: [(Vec3, f32); 3]) -> Option<Vec3> {
    let [a, b, c] = planes.map(|(n, _)| n);
    let spanned = a.dot(b.cross(c));
    (spanned.abs() > 1e-3).then(|| {
        (b.cross(c) * planes[0].1 + c.cross(a) * planes[1].1 + a.cross(b) * planes[2].1) / spanned
    })
}

fn hull_volume(points: &[Vec3]) -> f64 {
    if points.len() < 4 {
        return 0.0;
    }
    let Ok((corners, triangles)) = try_convex_hull(points) else { return 0.0 };
    let corner = |i: u32| (corners[i as usize] - corners[0]).as_dvec3();
    triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])))).sum::<f64>().abs()
        / 6.0
}

/// Joins the pair of touching pieces whose common hull adds least, as long as the hulls' volumes stay within `allowed`.
fn joined(pieces: Vec<Vec<Vec3>>, allowed: f64) -> Vec<Vec<Vec3>> {
    let on_hull =
        |p: &Vec<Vec3>| try_convex_hull(p).map(|(corners, _)| corners).unwrap_or_default();
    let mut pieces: Vec<Vec<Vec3>> = pieces.iter().map(on_hull).filter(|p| p.len() > 3).collect();
    let mut volumes: Vec<f64> = pieces.iter().map(|p| hull_volume(p)).collect();
    let common = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { on_hull(&[a, b].concat()) };
    let added = |pieces: &[Vec<Vec3>], volumes: &[f64], i: usize, j: usize| {
        let touch = geom::Bounds::of(pieces[i].iter().copied()).grown(1e-3);
        let near = pieces[j].iter().any(|p| touch.contains(*p));
        if near {
            hull_volume(&common(&pieces[i], &pieces[j])) - volumes[i] - volumes[j]
        } else {
            f64::INFINITY
        }
    };
    let pairs: Vec<(usize, usize)> =
        (0..pieces.len()).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let costs: Vec<f64> = pairs.par_iter().map(|&(i, j)| added(&pieces, &volumes, i, j)).collect();
    let mut pairs: Vec<((usize, usize), f64)> = pairs.into_iter().zip(costs).collect();
    let mut total: f64 = volumes.iter().sum();
    while let Some(&((i, j), cost)) = pairs.iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
        if total + cost > allowed || !cost.is_finite() {
            break;
        }
        let both = common(&pieces[i], &pieces[j]);
        // The pair becomes piece i; piece j stays behind empty.
        total += cost;
        volumes[i] = hull_volume(&both);
        pieces[i] = both;
        pieces[j].clear();
        pairs.retain(|((a, b), _)| *a != j && *b != j);
        for ((a, b), cost) in pairs.iter_mut().filter(|((a, b), _)| *a == i || *b == i) {
            *cost = added(&pieces, &volumes, *a, *b);
        }
    }
    pieces.retain(|p| !p.is_empty());
    pieces
}
