//! A still of a whole site or scene: survey points under the blocks, added blocks in their colour.

use crate::colour::{ADDED, Rgb, of_type, ramp};
use crate::{Camera, Image, ReportInput, StillMesh, StillPoints, still};
use geom::{Bounds, Vec3};
use scene::{Catalog, PlacedBlock};

/// Blocks a survey shows, and those to add, seen from the south-west; points where no block stands for them. A block
/// that is not judged is no block here: it may be anything.
pub fn site_picture(input: &ReportInput, width: usize, height: usize) -> Image {
    let grey = |c: Rgb| c.map(|v| (u16::from(v) / 4 + 150) as u8);
    let found = scene::stated(input.recognised).map(|(_, fit)| StillMesh {
        mesh: &input.catalog.get(fit.model).mesh,
        pose: fit.site_from_block,
        colour: grey(of_type(fit.model.0)),
    });
    let added = input.plan.iter().flat_map(|p| &p.placements).map(|p| StillMesh {
        mesh: &input.catalog.get(p.model).mesh,
        pose: p.rest,
        colour: ADDED,
    });
    let meshes: Vec<StillMesh> = found.chain(added).collect();
    let points = &input.survey.cloud.position_m;
    let (low, high) =
        points.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.z), h.max(p.z)));
    let colour: Vec<Rgb> = points
        .iter()
        .map(|p| ramp((p.z - low) / (high - low).max(1e-3)).map(|v| v / 2 + 110))
        .collect();
    let bounds = if meshes.is_empty() { input.survey.cloud.bounds() } else { around(&meshes) };
    if bounds.is_empty() {
        return still(
            width,
            height,
            &Camera::plan(&Bounds { min: Vec3::ZERO, max: Vec3::ONE }),
            &[],
            &[],
        );
    }
    let camera =
        Camera::around(&bounds, Vec3::new(-0.55, -1.0, 0.75), width as f32 / height.max(1) as f32);
    let cloud = StillPoints { position_m: points, colour: &colour, size_px: 1.2 };
    still(width, height, &camera, &meshes, &[cloud])
}

/// A pile alone, by type.
pub fn pile_picture(
    blocks: &[PlacedBlock],
    catalog: &Catalog,
    width: usize,
    height: usize,
) -> Image {
    let mesh = |b: &PlacedBlock| {
        let colour = of_type(b.model.0).map(|v| (u16::from(v) / 3 + 140) as u8);
        (catalog.get(b.model), b.site_from_block, colour)
    };
    let list: Vec<_> = blocks.iter().map(mesh).collect();
    let meshes: Vec<StillMesh> = list
        .iter()
        .map(|(m, pose, colour)| StillMesh { mesh: &m.mesh, pose: *pose, colour: *colour })
        .collect();
    let bounds = if meshes.is_empty() {
        Bounds { min: Vec3::ZERO, max: Vec3::ONE }
    } else {
        around(&meshes)
    };
    let camera =
        Camera::around(&bounds, Vec3::new(-0.55, -1.0, 0.75), width as f32 / height.max(1) as f32);
    still(width, height, &camera, &meshes, &[])
}

fn around(meshes: &[StillMesh]) -> Bounds {
    Bounds::of(
        meshes.iter().flat_map(|m| m.mesh.vertices.iter().map(|v| m.pose.transform_point(*v))),
    )
}
