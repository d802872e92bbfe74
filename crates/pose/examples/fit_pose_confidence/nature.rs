//! Surveys without a block: land, stones, steps, plants, stairs, waves and mounds.

use geom::{PointCloud, SeedTree, Vec3};
use rand::RngExt;
use scene::{Catalog, SensorKind, Survey};

/// What [`nature`] makes.
pub const KINDS: [&str; 5] = ["land", "stones", "steps", "plants", "stairs"];

/// A survey from above of 5 × 5 block lengths without a block: of one of [`KINDS`].
pub fn nature(kind: usize, catalog: &Catalog, seed: SeedTree) -> Survey {
    let (_, model) = catalog.iter().next().expect("one block");
    let d = model.d_box_m;
    let mut rng = seed.rng();
    let mut r = |low: f32, high: f32| rng.random_range(low..high);
    let side = 5.0 * d;
    let waves: Vec<[f32; 4]> = (0..24)
        .map(|k| {
            let length = d * r(0.5, 1.0) * 1.25_f32.powi(k % 12);
            let turn = r(0.0, std::f32::consts::TAU);
            let k = std::f32::consts::TAU / length;
            [k * turn.cos(), k * turn.sin(), r(0.0, 6.3), 0.035 * length * r(0.2, 1.0)]
        })
        .collect();
    let land = |x: f32, y: f32| {
        waves.iter().map(|w| w[3] * (w[0] * x + w[1] * y + w[2]).sin()).sum::<f32>()
    };
    // Lumps: centre, half axes, turn about z.
    let lumps: Vec<(Vec3, Vec3, f32)> = (0..if kind == 1 { 45 } else { 20 })
        .map(|_| {
            let (x, y, size) = (r(0.0, side), r(0.0, side), d * r(0.15, 0.6));
            let axes = size * Vec3::new(r(0.6, 1.2), r(0.6, 1.2), r(0.5, 1.0));
            let up = if kind == 3 { r(0.3, 2.0) * d } else { 0.3 * axes.z };
            (Vec3::new(x, y, land(x, y) + up), axes, r(0.0, 3.1))
        })
        .collect();
    let boxes: Vec<[f32; 5]> = (0..9)
        .map(|_| [r(0.0, side), r(0.0, side), d * r(0.3, 2.0), d * r(0.3, 2.0), d * r(0.2, 1.2)])
        .collect();
    let (run, rise) = (d * r(0.3, 1.6), d * r(0.15, 1.1));
    let count = (700.0 * side * side / (d * d)) as usize;
    let mut points = Vec::with_capacity(count);
    for _ in 0..count {
        let (x, y) = (r(0.0, side), r(0.0, side));
        let mut z = land(x, y);
        match kind {
            1 => {
                for (c, axes, turn) in &lumps {
                    let (u, v) = (x - c.x, y - c.y);
                    let (u, v) = (u * turn.cos() + v * turn.sin(), v * turn.cos() - u * turn.sin());
                    let inside = 1.0 - (u / axes.x).powi(2) - (v / axes.y).powi(2);
                    if inside > 0.0 {
                        // Squared off: stones have faces.
                        z = z.max(c.z + axes.z * inside.powf(0.35));
                    }
                }
            }
            2 => {
                z *= 0.2;
                for b in &boxes {
                    if (x - b[0]).abs() < b[2] && (y - b[1]).abs() < b[3] {
                        z = z.max(b[4]);
                    }
                }
            }
            4 => {
                // Steps of a stair with a wall beside it, rise and run of half a block to a whole one.
                z = (y / run).floor() * rise;
                if r(0.0, 1.0) < rise / (rise + run) {
                    let step = (y / run).floor() * run;
                    points.push(Vec3::new(x, step + r(-0.01, 0.01), z - r(0.0, rise)));
                    continue;
                }
                if (x - 0.45 * side).abs() < 0.1 * d {
                    z = z.max(2.5 * d);
                }
            }
            3 if r(0.0, 1.0) < 0.6 => {
                let (c, axes, _) = lumps[(r(0.0, 1.0) * lumps.len() as f32) as usize % lumps.len()];
                let dir = Vec3::new(r(-1.0, 1.0), r(-1.0, 1.0), r(-1.0, 1.0)).normalize_or(Vec3::Z);
                points.push(c + dir * axes * 1.6 * r(0.3, 1.0).sqrt());
                continue;
            }
            _ => {}
        }
        points.push(Vec3::new(x, y, z + 0.01 * (r(-1.0, 1.0) + r(-1.0, 1.0))));
    }
    Survey {
        cloud: PointCloud::from_positions(points),
        sensor: SensorKind::Uav,
        ..Default::default()
    }
}

/// What [`bumps`] makes: crests and hollows in a pattern, and mounds here and there.
pub const BUMPS: [&str; 2] = ["waves", "mounds"];

/// A survey from above of 5 × 5 block lengths of smooth ground whose bumps are about as large as the block; `kind` of [`BUMPS`].
/// From hardly any noise to 2 % of the block, from thin to dense.
pub fn bumps(kind: usize, catalog: &Catalog, seed: SeedTree) -> Survey {
    let (_, model) = catalog.iter().next().expect("one block");
    let d = model.d_box_m;
    let mut rng = seed.rng();
    let mut r = |low: f32, high: f32| rng.random_range(low..high);
    let side = 5.0 * d;
    let (along, across) = (d * r(0.7, 2.6), d * r(0.7, 2.6));
    let (turn, height) = (r(0.0, 3.1), 0.5 * along.min(across) * r(0.2, 0.7));
    let mounds: Vec<(f32, f32, f32, f32)> = (0..30)
        .map(|_| {
            let width = d * r(0.25, 0.7);
            (r(0.0, side), r(0.0, side), width, width * r(0.5, 1.6))
        })
        .collect();
    let dome = r(0.0, 0.1) / d;
    let surface = |x: f32, y: f32| {
        let (u, v) = (x * turn.cos() + y * turn.sin(), y * turn.cos() - x * turn.sin());
        let (a, b) = (std::f32::consts::TAU / along, std::f32::consts::TAU / across);
        let middle = 0.5 * side;
        let whole = -dome * ((x - middle).powi(2) + (y - middle).powi(2));
        let part = match kind {
            0 => height * (a * u).sin() * (b * v).sin(),
            _ => mounds
                .iter()
                .map(|m| m.3 * (-((x - m.0).powi(2) + (y - m.1).powi(2)) / (m.2 * m.2)).exp())
                .fold(0.0, f32::max),
        };
        whole + part
    };
    let count = (r(120.0, 700.0) * side * side / (d * d)) as usize;
    let noise_m = 0.02 * d * r(0.0, 1.0).powi(2);
    let points = (0..count)
        .map(|_| {
            let (x, y) = (r(0.0, side), r(0.0, side));
            Vec3::new(x, y, surface(x, y) + noise_m * (r(-1.0, 1.0) + r(-1.0, 1.0)))
        })
        .collect();
    Survey {
        cloud: PointCloud::from_positions(points),
        sensor: SensorKind::Uav,
        ..Default::default()
    }
}
