//! One scene: bed, pile, survey, in that order (METHOD §1).

use crate::SynthError;
use crate::bed::{bed, bed_mesh};
use crate::pile::drop_pile;
use crate::recipe::{Recipe, Resolved, Site};
use crate::sensor::Scan;
use crate::targets::Targets;
use geom::{PointCloud, SeedTree, TriMesh, Vec3};
use scene::{Catalog, Scene, SiteFrame, Survey};

/// Width of a strip of the scan in largest blocks,
const STRIP: f32 = 0.25;
/// and its steps in strips. Free choices: only the order of the points depends on them.
const STEP: f32 = 0.1;

/// A pile, its survey and what nobody knows of a real one.
#[derive(Clone, Debug)]
pub struct SynthScene {
    /// Blocks with their true poses, numbered from 1, and the ground.
    pub scene: Scene,
    /// What the sensor measured, local frame.
    pub survey: Survey,
    /// Block of each point; 0 for the bed and for points that lie on no block.
    pub instance: Vec<u32>,
    /// Occlusion of each block, in the order of `scene.blocks`: 1 − visible surface / whole surface (Eq. 3.14).
    pub occlusion: Vec<f32>,
    /// Piles thrown away because they failed a check, each with its reason.
    pub redraws: Vec<String>,
}

/// Makes the scene of a seed: the same bytes on any number of threads.
///
/// Labels are written when a point is made. Errors: an impossible recipe, or no pile that passes the checks.
pub fn scene(recipe: &Recipe, catalog: &Catalog, seed: SeedTree) -> Result<SynthScene, SynthError> {
    let resolved = recipe.resolve(catalog)?;
    let mut redraws = Vec::new();
    for attempt in 0..u64::from(recipe.most_attempts) {
        let ground = ground(recipe, &resolved, seed.child("bed", attempt));
        match drop_pile(recipe, &resolved, catalog, &ground, seed.child("pile", attempt))? {
            Ok(pile) => {
                let scene = Scene { blocks: pile.blocks, ground };
                return measure(
                    recipe,
                    &resolved,
                    catalog,
                    scene,
                    redraws,
                    seed.child("scan", attempt),
                );
            }
            Err(reason) => redraws.push(reason),
        }
    }
    let last = redraws.pop().unwrap_or_default();
    Err(SynthError::NoPile { attempts: recipe.most_attempts, last })
}

fn ground(recipe: &Recipe, resolved: &Resolved, seed: SeedTree) -> scene::Ground {
    match recipe.site {
        // A measured bin has a flat floor.
        _ if recipe.bin.measured => scene::Ground::Level { z_m: 0.0 },
        Site::Bin { .. } => scene::Ground::Level { z_m: 0.0 },
        Site::Pen { .. } | Site::Strip { .. } => bed(&recipe.bed, resolved, seed),
    }
}

pub(crate) fn measure(
    recipe: &Recipe,
    resolved: &Resolved,
    catalog: &Catalog,
    scene: Scene,
    redraws: Vec<String>,
    seed: SeedTree,
) -> Result<SynthScene, SynthError> {
    let with_bed = recipe.bed.measured && !matches!(recipe.site, Site::Bin { .. });
    let mut around = if recipe.bin.measured {
        recipe.bin.mesh(resolved)
    } else if with_bed {
        bed_mesh(&scene.ground, resolved.size_m)
    } else {
        TriMesh::default()
    };
    let top_m = top_m(&scene, catalog);
    recipe.around.add(&mut around, &scene.ground, &recipe.bed, resolved, top_m);
    let targets = Targets::new(&scene, catalog, around);
    let mut scan = recipe.sensor.scan(&targets, resolved, recipe.visibility, seed)?;
    recipe.delivery.of(&mut scan, resolved, seed.child("delivery", 0));
    let Scan { points, line, occlusion, positions } = in_scan_order(scan, resolved);
    let (position_m, instance) = points.into_iter().unzip();
    let survey = Survey {
        cloud: PointCloud::from_positions(position_m),
        frame: SiteFrame::default(),
        sensor: recipe.sensor.kind(),
        sensor_positions: positions,
        line,
        walls: Vec::new(),
    };
    Ok(SynthScene { scene, survey, instance, occlusion, redraws })
}

/// Highest point any block can reach, metres; 0 without blocks.
fn top_m(scene: &Scene, catalog: &Catalog) -> f32 {
    let top = |b: &scene::PlacedBlock| {
        let model = catalog.get(b.model);
        let corner = |v: &Vec3| b.site_from_block.transform_point(*v).z;
        model.mesh.vertices.iter().map(corner).fold(f32::NEG_INFINITY, f32::max)
    };
    scene.blocks.iter().map(top).fold(0.0, f32::max)
}

/// Points in strips, as surveys come, so that neither the order tells the block nor neighbours lie far apart in memory.
fn in_scan_order(mut scan: Scan, resolved: &Resolved) -> Scan {
    let strip = STRIP * resolved.largest_m;
    let key = |p: &Vec3| ((p.y / strip).floor(), (p.x / (STEP * strip)).floor());
    let mut order: Vec<usize> = (0..scan.points.len()).collect();
    // A stable sort: ties keep the order in which the sensor made them, which is random.
    order.sort_by(|&a, &b| {
        let (a, b) = (key(&scan.points[a].0), key(&scan.points[b].0));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    if !scan.line.is_empty() {
        scan.line = order.iter().map(|&i| scan.line[i]).collect();
    }
    scan.points = order.into_iter().map(|i| scan.points[i]).collect();
    scan
}
