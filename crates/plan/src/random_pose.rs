//! Policy `random`: any attitude, anywhere about the window's centre, lowered to just above the pile (the thesis' baseline).

use crate::{Settings, attitudes, silhouette, stack::Stack, windows::Window};
use geom::{Pose, Vec3};
use rand::{Rng, RngExt};
use scene::ModelId;

/// Poses drawn until one lies inside the boundary.
const DRAWS: usize = 8;

/// A pose to let go from; `None` when none drawn lies inside the boundary.
pub(crate) fn pose(
    stack: &Stack,
    settings: &Settings,
    model: ModelId,
    window: &Window,
    rng: &mut impl Rng,
) -> Option<Pose> {
    let block = stack.catalog.get(model);
    let clearance_m = 0.05 * block.d_box_m;
    for _ in 0..DRAWS {
        let rotation = attitudes::random(rng);
        let mut jitter_m = || (2.0 * rng.random::<f32>() - 1.0) * settings.jitter_m;
        let (x, y) = (window.centre.x + jitter_m(), window.centre.y + jitter_m());
        let height_m = silhouette::lowered_height_m(&stack.surface, block, rotation, x, y);
        let pose = height_m.map(|z| silhouette::pose_at(block, rotation, Vec3::new(x, y, z + clearance_m)));
        // A crane lets nothing go outside.
        if let Some(pose) = pose.filter(|p| stack.is_inside(model, p, settings.inside)) {
            return Some(pose);
        }
    }
    None
}
