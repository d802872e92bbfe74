//! The pose distance of the Siléane evaluator (Brégier et al., "Symmetry aware evaluation of 3D object detection and
//! pose estimation in scenes of many parts in bulk", 2017), for comparison with bin-picking figures.
//!
//! d(P, Q)² = min over the proper symmetries G of (1/S) ∫ ‖P x − Q G x‖² dS over the object's surface: the root mean
//! square way of a surface point. With the surface's centroid and second moment the integral has a closed form.
//! Their evaluator counts a detection as right below a tenth of the diameter of the smallest bounding sphere.

use geom::{DVec3, Pose, TriMesh, Vec3};
use scene::BlockModel;

/// Area centroid and second moments of a surface, the same for every pose: prepare once.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceMoments {
    centroid: DVec3,
    /// (1/S) ∫ (x−c)(x−c)ᵀ dS, rows.
    second: [[f64; 3]; 3],
}

impl SurfaceMoments {
    /// Exact moments of the triangles; zero for a mesh without area.
    pub fn of(mesh: &TriMesh) -> Self {
        let (mut area, mut first) = (0.0_f64, DVec3::ZERO);
        let mut second = [[0.0_f64; 3]; 3];
        for t in 0..mesh.triangles.len() {
            let corners = mesh.corners(t).map(|v| v.as_dvec3());
            let [a, b, c] = corners;
            let patch = (b - a).cross(c - a).length() / 2.0;
            let sum = a + b + c;
            area += patch;
            first += sum * (patch / 3.0);
            for i in 0..3 {
                for j in 0..3 {
                    let own: f64 = corners.iter().map(|v| v[i] * v[j]).sum();
                    second[i][j] += patch / 12.0 * (own + sum[i] * sum[j]);
                }
            }
        }
        if area <= 0.0 {
            return Self { centroid: DVec3::ZERO, second: [[0.0; 3]; 3] };
        }
        let centroid = first / area;
        for (i, row) in second.iter_mut().enumerate() {
            for (j, m) in row.iter_mut().enumerate() {
                *m = *m / area - centroid[i] * centroid[j];
            }
        }
        Self { centroid, second }
    }
}

/// Root mean square way of the surface between two poses of a block, metres, modulo its proper symmetries.
pub fn surface_distance_m(
    model: &BlockModel,
    moments: &SurfaceMoments,
    estimate: &Pose,
    truth: &Pose,
) -> f64 {
    let group = &model.symmetry;
    (0..group.order())
        .map(|k| squared_m2(moments, estimate, &(*truth * group.element(k))))
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

fn squared_m2(moments: &SurfaceMoments, a: &Pose, b: &Pose) -> f64 {
    let place = |p: &Pose| p.rotation.as_dquat() * moments.centroid + p.translation.as_dvec3();
    let shift = (place(a) - place(b)).length_squared();
    // ‖(A − B) x‖² summed over the second moment: trace of (A−B) M (A−B)ᵀ.
    let column = |axis: Vec3| {
        a.rotation.as_dquat() * axis.as_dvec3() - b.rotation.as_dquat() * axis.as_dvec3()
    };
    let d = [column(Vec3::X), column(Vec3::Y), column(Vec3::Z)];
    let mut turn = 0.0;
    for i in 0..3 {
        for j in 0..3 {
            turn += moments.second[i][j] * d[i].dot(d[j]);
        }
    }
    shift + turn.max(0.0)
}
