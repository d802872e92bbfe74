//! Policy `random`: any attitude, anywhere about the window's centre, lowered to just above the pile (the thesis' baseline).

use crate::{Settings, attitudes, silhouette, stack::Stack, windows::Window};
use geom::{Pose, Vec3};
use rand::{Rng, RngExt};
use scene::ModelId;

/// A pose to let go from; `None` when the place drawn lies off the map.
pub(crate) fn pose(
    stack: &Stack,
    settings: &Settings,
    model: ModelId,
    window: &Window,
    rng: &mut impl Rng,
) -> Option<Pose> {
    let block = stack.catalog.get(model);
    let rotation = attitudes::random(rng);
    let mut jitter = || (2.0 * rng.random::<f32>() - 1.0) * settings.jitter_m;
    let (x, y) = (window.centre.x + jitter(), window.centre.y + jitter());
    let z = silhouette::lowered_height_m(&stack.surface, block, rotation, x, y)?;
    let clearance = 0.05 * block.d_box_m;
    Some(silhouette::pose_at(block, rotation, Vec3::new(x, y, z + clearance)))
}
