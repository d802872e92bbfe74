//! What the kernels are timed on: one made-up row of tetrapods, the same every time.

use geom::{PointCloud, Pose, Quat, SeedTree, Vec3};
use rand::RngExt;
use scene::{BlockModel, Catalog, CentreHypothesis, Segmentation, SensorKind, Shape, Survey};

/// Points on a block; two thirds of them face the sensor.
const POINTS_A_BLOCK: usize = 2000;

/// A tetrapod two metres high.
pub fn tetrapod() -> BlockModel {
    blocks::shape_model("tetrapod", Shape::Tetrapod { size: 2.0 }, 2300.0)
        .expect("a shape of the program's own")
}

/// `count` points in a box 20 × 20 × 2 m.
pub fn scattered(count: usize) -> Vec<Vec3> {
    let mut rng = SeedTree::new(1).rng();
    let mut draw = |edge_m: f32| rng.random::<f32>() * edge_m;
    (0..count).map(|_| Vec3::new(draw(20.0), draw(20.0), draw(2.0))).collect()
}

/// `count` tetrapods in a row, each seen from above, with its own true segment.
pub struct Row {
    /// The points, measured by a drone.
    pub survey: Survey,
    /// The true segments.
    pub segmentation: Segmentation,
    /// The one type there is.
    pub catalog: Catalog,
}

/// Makes a [`Row`].
pub fn row(count: u32) -> Row {
    let model = tetrapod();
    let mut rng = SeedTree::new(2).rng();
    let mut row = Row {
        survey: Survey { sensor: SensorKind::Uav, ..Default::default() },
        segmentation: Segmentation { instances: count as usize, ..Default::default() },
        catalog: Catalog::new(vec![model.clone()]),
    };
    let mut position = Vec::new();
    for k in 0..count {
        let turn = Quat::from_rotation_x(0.7 * k as f32) * Quat::from_rotation_z(1.1 * k as f32);
        let site_from_block = Pose::from_parts(Vec3::new(3.0 * k as f32, 0.0, 1.2), turn);
        let first = position.len() as u32;
        let seen = model.mesh.sample_surface(POINTS_A_BLOCK, &mut rng).into_iter();
        let up = seen.filter(|(_, normal)| (site_from_block.rotation * *normal).z > -0.2);
        position.extend(up.map(|(p, _)| site_from_block * p));
        let points = (first..position.len() as u32).collect();
        let centre = site_from_block * model.centre;
        row.segmentation.hypotheses.push(CentreHypothesis { centre, score: 0.9, points });
        row.segmentation.instance.resize(position.len(), k + 1);
    }
    row.segmentation.confidence = vec![1.0; position.len()];
    row.survey.cloud = PointCloud::from_positions(position);
    row
}
