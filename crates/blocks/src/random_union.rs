//! Random solids of the armour-unit kind: unions of a few convex parts, to train what must work on any block.
//!
//! Six families cover what ports and bins hold: legs from a centre (tetrapod, hexapod), crossing bars (dolos,
//! accropode), a core with noses (core-loc, Xbloc), chamfered boxes (cubes), rings of segments with an empty middle, and
//! frames of bars with holes and posts. Half of them are as regular as real units, half are bent out of shape.

use crate::model::assemble;
use crate::symmetry::{SymmetryConfig, find_symmetry};
use geom::{ConvexSolid, Quat, SeedTree, TriMesh, Vec3};
use rand::RngExt;
use scene::{BlockModel, ConvexPart};

type Rng = rand_chacha::ChaCha8Rng;
type Corners = Vec<Vec3>;

/// A random block with d_max between 0.5 and 1.6 m. The same seed gives the same block.
pub fn random_union(seed: SeedTree) -> BlockModel {
    // A draw whose union does not close (parts that all but touch) or that is all arms is drawn again.
    (0..64)
        .find_map(|attempt| {
            draw(seed.child("attempt", attempt), &format!("random-{:016x}", seed.value()))
        })
        .unwrap_or_else(|| {
            let shape = scene::Shape::Cube { size: 1.0 };
            crate::shape_model("random-cube", shape, 2300.0)
                .expect("a cube of one metre is a block")
        })
}

fn draw(seed: SeedTree, name: &str) -> Option<BlockModel> {
    let mut rng = seed.rng();
    let regular = rng.random_bool(0.5);
    let parts = match rng.random_range(0..24) {
        0..6 => legs(&mut rng, regular),
        6..13 => bars(&mut rng, regular),
        13..17 => core_with_noses(&mut rng, regular),
        17 => vec![chamfered_box(&mut rng, regular)],
        18..22 => segments(&mut rng, regular),
        _ => frame(&mut rng, regular),
    };
    let solids: Vec<ConvexSolid> =
        parts.iter().map(|c| ConvexSolid::from_corners(c)).collect::<Option<_>>()?;
    let mesh = geom::union(&solids);
    mesh.check_solid().ok()?;
    let moments = mesh.moments();
    let d_max = mesh.vertices.iter().map(|v| (*v - moments.centroid).length()).fold(0.0, f32::max);
    // Frames 0.05, tetrapod 0.10, dolos 0.12, cube 0.37 of the ball around them.
    if moments.volume_m3 < 0.04 * 4.19 * d_max.powi(3) || !is_connected(&mesh) {
        return None;
    }
    let scale = rng.random_range(0.5..1.6) / d_max;
    let place = |v: Vec3| (v - moments.centroid) * scale;
    let mesh = mesh.map(place);
    let parts = parts
        .into_iter()
        .map(|c| ConvexPart { corners: c.into_iter().map(place).collect() })
        .collect();
    let symmetry = find_symmetry(&mesh, &SymmetryConfig::default()).ok()?;
    assemble(name, mesh, parts, 1.0, symmetry, 2300.0).ok()
}

fn is_connected(mesh: &TriMesh) -> bool {
    let mut group: Vec<usize> = (0..mesh.vertices.len()).collect();
    fn root(group: &mut [usize], mut i: usize) -> usize {
        while group[i] != i {
            group[i] = group[group[i]];
            i = group[i];
        }
        i
    }
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2])] {
            let (a, b) = (root(&mut group, a as usize), root(&mut group, b as usize));
            group[a] = b;
        }
    }
    let first = root(&mut group, 0);
    (0..mesh.vertices.len()).all(|i| root(&mut group, i) == first)
}

/// A prism or frustum with `sides` corners along `axis`, between distances `from` and `to`, radii at both ends.
fn frustum(axis: Vec3, sides: usize, from: (f32, f32), to: (f32, f32), spin: f32) -> Corners {
    let (u, v) = axis.any_orthonormal_pair();
    [from, to]
        .into_iter()
        .flat_map(|(t, radius)| {
            (0..sides).map(move |i| {
                let (sin, cos) = (spin + i as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
                axis * t + (u * cos + v * sin) * radius
            })
        })
        .collect()
}

fn direction(rng: &mut Rng) -> Vec3 {
    let z: f32 = rng.random_range(-1.0..1.0);
    let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

fn sides(rng: &mut Rng) -> usize {
    [4, 6, 8, 8, 12][rng.random_range(0..5)]
}

fn legs(rng: &mut Rng, regular: bool) -> Vec<Corners> {
    let count = rng.random_range(3..=6);
    let mut axes: Vec<Vec3> = match count {
        3 => (0..3)
            .map(|k| Quat::from_rotation_z(k as f32 * std::f32::consts::TAU / 3.0) * Vec3::X)
            .collect(),
        4 => crate::tetrapod::leg_axes().to_vec(),
        5 => {
            let ring = (0..3)
                .map(|k| Quat::from_rotation_z(k as f32 * std::f32::consts::TAU / 3.0) * Vec3::X);
            ring.chain([Vec3::Z, Vec3::NEG_Z]).collect()
        }
        _ => vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z],
    };
    if !regular {
        axes.iter_mut().for_each(|a| *a = (*a + direction(rng) * 0.35).normalize());
    }
    let (n, root, taper) = (sides(rng), rng.random_range(0.28..0.45), rng.random_range(0.55..1.0));
    let spin = rng.random_range(0.0..1.0);
    axes.into_iter()
        .map(|axis| {
            let length = if regular { 1.0 } else { rng.random_range(0.7..1.1) };
            let radius = if regular { root } else { root * rng.random_range(0.85..1.15) };
            frustum(axis, n, (-0.4 * radius, radius), (length, radius * taper), spin)
        })
        .collect()
}

fn bars(rng: &mut Rng, regular: bool) -> Vec<Corners> {
    let n = sides(rng);
    let width = rng.random_range(0.2..0.36);
    let spin = std::f32::consts::PI / n as f32;
    let taper = rng.random_range(0.6..1.0);
    let arrangement = rng.random_range(0..3);
    let mut bar = |axis: Vec3, centre: Vec3, half: f32| -> Corners {
        let bend = if regular { Vec3::ZERO } else { direction(rng) * 0.2 };
        let axis = (axis + bend).normalize();
        let mut corners = frustum(axis, n, (-half, width * taper), (half, width * taper), spin);
        corners.extend(frustum(axis, n, (-width, width), (width, width), spin));
        corners.into_iter().map(|c| c + centre).collect()
    };
    let offset = 0.7;
    let mut parts = vec![bar(Vec3::X, Vec3::ZERO, 1.0)];
    match arrangement {
        0 => parts
            .extend([bar(Vec3::Y, Vec3::X * offset, 0.9), bar(Vec3::Z, Vec3::NEG_X * offset, 0.9)]),
        1 => {
            parts.extend([bar(Vec3::Y, Vec3::Z * 0.15, 0.9), bar(Vec3::Z, Vec3::NEG_Y * 0.1, 0.8)])
        }
        _ => parts.extend([bar(Vec3::Y, Vec3::X * 0.2, 1.0)]),
    }
    parts
}

fn core_with_noses(rng: &mut Rng, regular: bool) -> Vec<Corners> {
    let half = Vec3::new(0.55, rng.random_range(0.4..0.6), rng.random_range(0.3..0.55));
    let mut parts = vec![cut_box(half, rng.random_range(0.05..0.2))];
    let faces = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let (n, root, taper) = (sides(rng), rng.random_range(0.2..0.32), rng.random_range(0.5..0.95));
    for axis in faces {
        if regular || rng.random_bool(0.7) {
            let reach = half.dot(axis.abs())
                + rng.random_range(0.25..0.5) * if regular { 1.0 } else { 1.3 };
            parts.push(frustum(axis, n, (0.0, root), (reach, root * taper), 0.37));
        }
    }
    parts
}

/// A ring, an oval or a part of one: wedges around an empty middle.
fn segments(rng: &mut Rng, regular: bool) -> Vec<Corners> {
    let all = rng.random_range(5..=14);
    let count = if rng.random_bool(0.7) { all } else { all * rng.random_range(5..9) / 10 };
    let inner = rng.random_range(0.45..0.75);
    let half = rng.random_range(0.1..0.35);
    let oval = if regular { 1.0 } else { rng.random_range(0.6..1.0) };
    let lean = if regular { 0.0 } else { rng.random_range(-0.15..0.15) };
    (0..count)
        .map(|i| {
            let corner = |k: usize, r: f32, z: f32| {
                let (sin, cos) = (k as f32 / all as f32 * std::f32::consts::TAU).sin_cos();
                Vec3::new(r * cos, oval * r * sin, z + lean * r * cos)
            };
            [(i, 1.0), (i, inner), (i + 1, 1.0), (i + 1, inner)]
                .into_iter()
                .flat_map(|(k, r)| [corner(k, r, half), corner(k, r, -half)])
                .collect()
        })
        .collect()
}

/// Two rails, two to four rungs between them, and perhaps a post that stands out.
fn frame(rng: &mut Rng, regular: bool) -> Vec<Corners> {
    let bar = |low: Vec3, high: Vec3| -> Corners {
        (0..8)
            .map(|i| {
                let pick = |bit: usize, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
                Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
            })
            .collect()
    };
    let (wide, thick, half) =
        (rng.random_range(0.35..0.8), rng.random_range(0.12..0.25), rng.random_range(0.08..0.2));
    let mut parts = vec![
        bar(Vec3::new(-1.0, wide - thick, -half), Vec3::new(1.0, wide, half)),
        bar(Vec3::new(-1.0, -wide, -half), Vec3::new(1.0, -wide + thick, half)),
    ];
    let rungs = rng.random_range(2..=4);
    for r in 0..rungs {
        let at = -1.0 + thick / 2.0 + (2.0 - thick) * r as f32 / (rungs - 1) as f32;
        let at = if regular {
            at
        } else {
            (at + rng.random_range(-0.15..0.15)).clamp(-1.0 + thick / 2.0, 1.0 - thick / 2.0)
        };
        let (a, b) = (at - thick / 2.0, at + thick / 2.0);
        parts.push(bar(Vec3::new(a, thick - wide, -half), Vec3::new(b, wide - thick, half)));
    }
    if rng.random_bool(0.6) {
        let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let (x, y) = (
            rng.random_range(-0.9..0.7),
            if regular { wide - thick } else { rng.random_range(-wide..wide - thick) },
        );
        let (top, bottom) = (rng.random_range(0.4..0.9), half * 0.5);
        let z = if side > 0.0 { [bottom, top] } else { [-top, -bottom] };
        parts.push(bar(Vec3::new(x, y, z[0]), Vec3::new(x + thick, y + thick, z[1])));
    }
    parts
}

fn chamfered_box(rng: &mut Rng, regular: bool) -> Corners {
    let edge = |rng: &mut Rng| if regular { 0.5 } else { rng.random_range(0.3..0.6) };
    let half = Vec3::new(edge(rng), edge(rng), edge(rng));
    let taper = rng.random_range(0.8..1.0);
    let cut = rng.random_range(0.02..0.12);
    cut_box(half, cut)
        .into_iter()
        .map(|c| {
            let narrow = 1.0 - (1.0 - taper) * (c.z / half.z + 1.0) / 2.0;
            Vec3::new(c.x * narrow, c.y * narrow, c.z)
        })
        .collect()
}

/// Corners of a box with every corner cut off.
fn cut_box(half: Vec3, cut: f32) -> Corners {
    (0..8)
        .flat_map(|i| {
            let sign = Vec3::new(
                1.0 - 2.0 * (i & 1) as f32,
                1.0 - 2.0 * (i >> 1 & 1) as f32,
                1.0 - 2.0 * (i >> 2) as f32,
            );
            [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (half - axis * cut) * sign)
        })
        .collect()
}
