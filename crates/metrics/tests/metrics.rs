//! Pose scores on hand-made cases and the laws of symmetry.

use geom::{Pose, Quat, TriMesh, Vec3};
use metrics::{PoseCriteria, TrueBlock, model_distances_m, score_poses};
use proptest::prelude::*;
use scene::{
    BlockModel, Catalog, Fit, Guess, InstanceId, ModelId, PlacedBlock, PosedModel, Recognised,
    SymmetryGroup, Verdict,
};

/// A 2 m cube whose file's origin is a corner, with the four rotations about z.
fn cube() -> BlockModel {
    let vertices = (0..8)
        .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0)
        .collect::<Vec<_>>();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let centre = Vec3::ONE;
    let turns =
        (0..4).map(|k| Quat::from_rotation_z(k as f32 * std::f32::consts::FRAC_PI_2)).collect();
    BlockModel {
        name: "cube".into(),
        mesh: TriMesh { vertices, triangles },
        parts: Vec::new(),
        parts_volume_ratio: 1.0,
        volume_m3: 8.0,
        density_kg_m3: 2300.0,
        centre,
        symmetry: SymmetryGroup::new(centre, turns),
        d_max_m: 3.0_f32.sqrt(),
        d_box_m: 2.0,
    }
}

fn at(x: f32, turn_deg: f32) -> Pose {
    // Turned about the block's centre, which lies at (x + 1, 1, 1).
    let rotation = Quat::from_rotation_x(turn_deg.to_radians());
    Pose::from_parts(Vec3::new(x, 0.0, 0.0) + Vec3::ONE - rotation * Vec3::ONE, rotation)
}

fn stated(pose: Pose) -> Recognised {
    let fit = Fit { confidence: Some(0.5), ..Fit::of_pose(ModelId(0), pose) };
    Recognised::of_fit(InstanceId(1), Vec::new(), fit)
}

fn not_judged(pose: Pose) -> Recognised {
    let guess = Guess::Fit(Fit::of_pose(ModelId(0), pose));
    Recognised { verdict: Verdict::NotJudged(guess), ..stated(pose) }
}

fn truth(pose: Pose, occlusion: f32) -> TrueBlock {
    TrueBlock {
        placed: PlacedBlock { block: InstanceId(1), model: ModelId(0), site_from_block: pose },
        occlusion,
    }
}

#[test]
fn counts_by_hand() {
    let catalog = Catalog::new(vec![cube()]);
    let truths = [
        truth(at(0.0, 0.0), 0.3),
        truth(at(5.0, 0.0), 0.9),
        truth(at(10.0, 0.0), 0.5),
        truth(at(15.0, 0.0), 0.2),
    ];
    let estimates = [
        stated(at(0.1, 3.0)),      // true positive: 0.1 m ≤ 0.2 m, 3° ≤ 5°
        stated(at(0.15, 0.0)),     // second on the same truth: false positive
        stated(at(5.0, 0.0)),      // meets a 90 % occluded truth: neither
        stated(at(10.0, 6.0)),     // 6°: false positive, and the truth is missed
        not_judged(at(15.0, 0.0)), // no statement: the truth is missed
    ];
    let score = score_poses(&estimates, &truths, &catalog, &PoseCriteria::default());
    assert_eq!(
        (score.counts.true_positives, score.counts.false_positives, score.counts.false_negatives),
        (1, 2, 2)
    );
    assert_eq!((score.ignored, score.types_right), (1, 1));
    assert!((score.mean_displacement_m().unwrap() - 0.1).abs() < 1e-5);
    assert!((score.mean_rotation_rad().unwrap().to_degrees() - 3.0).abs() < 1e-3);
}

#[test]
fn distances_to_two_cubes() {
    let catalog = Catalog::new(vec![cube()]);
    let blocks = [truth(at(0.0, 0.0), 0.0).placed, truth(at(5.0, 0.0), 0.0).placed];
    let points = [
        Vec3::new(1.0, 1.0, 2.25),
        Vec3::new(4.9, 1.0, 1.0),
        Vec3::new(1.0, 1.0, 1.5),
        Vec3::new(0.0, 9.0, 0.0),
    ];
    let distance = model_distances_m(&points, &blocks, &catalog, 0.5);
    for (got, want) in distance.iter().zip([0.25, 0.1, 0.5]) {
        assert!((got - want).abs() < 1e-5, "{distance:?}");
    }
    assert_eq!(distance[3], f32::INFINITY);
}

/// Values of `tools/oracle/surface_distance.py`: plain summation over 960,000 surface points.
#[test]
fn surface_distance_agrees_with_the_oracle() {
    let model = cube();
    let moments = metrics::SurfaceMoments::of(&model.mesh);
    let turn = |axis: [f32; 3], deg: f32| {
        Quat::from_axis_angle(Vec3::from_array(axis).normalize(), deg.to_radians())
    };
    let pose = |t: [f32; 3], q: Quat| Pose::from_parts(Vec3::from_array(t), q);
    let cases = [
        (pose([0.3, -0.4, 0.0], Quat::IDENTITY), Pose::IDENTITY, 0.5),
        (pose([0.0; 3], turn([0.0, 0.0, 1.0], 100.0)), Pose::IDENTITY, 2.174_478),
        (
            pose([0.1, 0.2, 0.3], turn([1.0, 2.0, 3.0], 40.0)),
            pose([0.5, 0.0, -0.2], turn([0.0, 1.0, -1.0], 70.0)),
            2.905_642,
        ),
    ];
    for (a, b, want) in cases {
        let got = metrics::surface_distance_m(&model, &moments, &a, &b);
        assert!((got - want).abs() < 1e-3, "{got} for {want}");
    }
}

proptest! {
    /// The estimate is compared with R̄G: an equivalent pose has no error, and a turn about the centre shows as itself.
    #[test]
    fn equivalent_poses_have_no_error(
        axis in prop::array::uniform3(-1.0_f32..1.0), angle in -3.0_f32..3.0, k in 0_usize..4, extra in 0.0_f32..0.5,
    ) {
        let model = cube();
        let axis = Vec3::from_array(axis).try_normalize().unwrap_or(Vec3::X);
        let rotation = Quat::from_axis_angle(axis, angle);
        let truth = Pose::from_parts(Vec3::new(3.0, -2.0, 1.0), rotation);
        let same = truth * model.symmetry.element(k);
        let error = PosedModel::new(&model, same).error(&PosedModel::new(&model, truth));
        prop_assert!(error.displacement_m < 1e-4 && error.rotation_rad < 1e-3, "{:?}", error);
        let turn = Quat::from_rotation_x(extra);
        let turned = same * Pose::from_parts(model.centre - turn * model.centre, turn);
        let error = PosedModel::new(&model, turned).error(&PosedModel::new(&model, truth));
        prop_assert!((error.rotation_rad - extra).abs() < 1e-3, "{:?} {}", error, extra);
        prop_assert!(error.displacement_m < 1e-4);
    }
}
