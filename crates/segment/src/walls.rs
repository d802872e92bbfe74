//! Floor and walls of a bin among the planes of a cloud.
//!
//! In: points, the smallest and the largest block. Out: the planes that are surfaces of their own. Nothing is seen through a bin, so
//! that hardly anything lies behind them; parts that lie side by side may have such a plane too, and are told from it by where their
//! points face, how far they go on without a gap, and whether they lie on one smooth surface.

use geom::{Plane, SeedTree, Vec3, find_walls};
use std::collections::{BTreeMap, BTreeSet};

/// How far from a wall's plane points are still of the wall, in units of the smallest d_max.
const WALL_THICKNESS: f32 = 0.08;
/// A piece of wall is longer than this, in units of the largest d_box: flat sides of parts are not.
const PIECE_LENGTH: f32 = 1.25;
/// Of the points near a wall so many face the way it does. A plane that touches round parts has points that face anywhere.
const FACING_SHARE: f32 = 0.6;
/// Points face the way a wall does up to this cosine.
const FACING: f32 = 0.9;
/// Of the facing points so many lie in pieces longer than any part: parts that lie flat side by side make many short ones. Of floors
/// under many parts it was 0.24 and more, half of them above 0.8; parts that lay on nothing made one by gaps of a few points.
const LONG_SHARE: f32 = 0.3;
/// Points of one piece lie nearer than this, in units of their spacing and, at least and at most, of the largest d_box.
const GAP_SPACINGS: f32 = 3.0;
const LEAST_GAP: f32 = 0.05;
const MOST_GAP: f32 = 0.15;
/// The longest piece of a wall scatters about a smooth surface by this at most, in units of [`WALL_THICKNESS`]: walls and floors of our
/// own camera by 0.13, tops of parts side by side by 0.2 and more.
const SMOOTH: f32 = 0.15;
/// Or by this many times what neighbouring points scatter, however much that is: bad cameras see walls too.
const SCATTERS: f32 = 3.0;
/// A stereo camera makes waves of a wall: of eight real scans walls scattered by 0.19 to 0.36, 2 to 6 times what neighbouring points do.
/// Of 24 false ones of our own most did so by more, for each top by itself is flat.
const WAVY: f32 = 0.3;
const WAVES: f32 = 6.0;
/// Of walls that face one way within this cosine only the farthest back is one: the others are what lies on it.
const ONE_WAY: f32 = 0.95;
/// Normals are those of neighbours this near, in units of the smallest d_max.
const NORMAL_RADIUS: f32 = 0.12;
/// A wall has at most this share of the points behind it: what multiple reflections and edges put there.
const BEHIND: f32 = 0.02;

/// The walls of a cloud.
pub(crate) struct Walls {
    /// Planes that face the contents.
    pub planes: Vec<Plane>,
    /// How far from them points are of the wall, metres.
    pub thickness_m: f32,
}

impl Walls {
    /// Looks for them among parts whose smallest d_max is `smallest_m` and whose largest d_box is `largest_m`.
    pub fn of(points: &[Vec3], smallest_m: f32, largest_m: f32, seed: SeedTree) -> Self {
        let thickness_m = WALL_THICKNESS * smallest_m;
        let mut planes = find_walls(points, thickness_m, seed);
        let normals = geom::normals(points, NORMAL_RADIUS * smallest_m, &|_| Vec3::Z);
        planes.retain(|wall| is_wall(wall, points, &normals, thickness_m, largest_m));
        // Nothing is seen through a bin: a plane with points behind it is the parts' own.
        let behind = |wall: &Plane| {
            points.iter().filter(|&&p| wall.distance_m(p) < -3.0 * thickness_m).count() as f32
        };
        planes.retain(|wall| behind(wall) <= BEHIND * points.len() as f32);
        farthest_back(&mut planes, geom::Bounds::of(points.iter().copied()).centre());
        Self { planes, thickness_m }
    }
}

/// Whether a plane with nothing behind it is a surface of its own and not a plane that touches the parts.
fn is_wall(wall: &Plane, points: &[Vec3], normals: &[Vec3], thickness_m: f32, part_m: f32) -> bool {
    let near: Vec<usize> =
        (0..points.len()).filter(|&i| wall.distance_m(points[i]).abs() <= thickness_m).collect();
    let facing: Vec<Vec3> = near
        .iter()
        .filter(|&&i| normals[i].dot(wall.normal).abs() > FACING)
        .map(|&i| points[i])
        .collect();
    if (facing.len() as f32) < FACING_SHARE * near.len() as f32 {
        return false;
    }
    let gap_m = GAP_SPACINGS * spacing_m(&facing, thickness_m);
    let pieces = pieces(wall, &facing, gap_m.clamp(LEAST_GAP * part_m, MOST_GAP * part_m));
    let long: Vec<&Vec<Vec3>> =
        pieces.iter().filter(|piece| length_m(piece) > PIECE_LENGTH * part_m).collect();
    let on_long: usize = long.iter().map(|piece| piece.len()).sum();
    on_long as f32 > LONG_SHARE * facing.len() as f32
        && long.iter().max_by_key(|piece| piece.len()).is_some_and(|p| is_smooth(p, thickness_m))
}

/// Whether points lie on one smooth surface as neighbours do. Tops of parts lie side by side at heights of their own.
fn is_smooth(piece: &[Vec3], thickness_m: f32) -> bool {
    let Some(scatter_m) = geom::scatter_about_patch_m(piece) else { return false };
    if scatter_m <= SMOOTH * thickness_m {
        return true;
    }
    let spacing_m = spacing_m(piece, thickness_m);
    let near_m = geom::scatter(piece, spacing_m, f32::MAX).overall_m;
    near_m.is_some_and(|near_m| {
        scatter_m <= (SCATTERS * near_m).max((WAVES * near_m).min(WAVY * thickness_m))
    })
}

/// How far the points of a surface lie apart, metres: from the cubes of edge `cell_m` that they fill.
fn spacing_m(points: &[Vec3], cell_m: f32) -> f32 {
    let cell = |p: &Vec3| (*p / cell_m).floor().to_array().map(|x| x as i32);
    let cells = points.iter().map(cell).collect::<BTreeSet<_>>().len();
    cell_m * (cells as f32 / points.len().max(1) as f32).sqrt()
}

/// Of walls that face one way the one farthest back.
fn farthest_back(walls: &mut Vec<Plane>, middle: Vec3) {
    let all = walls.clone();
    let behind = |a: &Plane, b: &Plane| {
        a.normal.dot(b.normal) > ONE_WAY && b.distance_m(middle) > a.distance_m(middle)
    };
    walls.retain(|wall| !all.iter().any(|other| behind(wall, other)));
}

/// Points of a plane in connected pieces: cells of the plane that touch.
fn pieces(wall: &Plane, points: &[Vec3], cell_m: f32) -> Vec<Vec<Vec3>> {
    let along = wall.normal.any_orthonormal_vector();
    let across = wall.normal.cross(along);
    let mut cells: BTreeMap<(i32, i32), Vec<Vec3>> = BTreeMap::new();
    for &p in points {
        let cell = |axis: Vec3| (axis.dot(p) / cell_m).floor() as i32;
        cells.entry((cell(along), cell(across))).or_default().push(p);
    }
    let mut found = Vec::new();
    while let Some((first, own)) = cells.pop_first() {
        let (mut piece, mut open) = (own, vec![first]);
        while let Some((x, y)) = open.pop() {
            for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
                let next = (x + i, y + j);
                if let Some(own) = cells.remove(&next) {
                    piece.extend(own);
                    open.push(next);
                }
            }
        }
        found.push(piece);
    }
    found
}

/// How far points reach, metres: twice the distance from their middle that hardly any exceeds.
fn length_m(points: &[Vec3]) -> f32 {
    let middle = points.iter().copied().sum::<Vec3>() / points.len().max(1) as f32;
    let mut far: Vec<f32> = points.iter().map(|p| (*p - middle).length()).collect();
    far.sort_by(f32::total_cmp);
    2.0 * far.get(far.len() * 98 / 100).copied().unwrap_or(0.0)
}
