//! A triangle mesh and what follows from it alone.

use crate::{Bounds, Mat3, Vec3};
use rand::{Rng, RngExt};
use std::collections::HashMap;

/// Vertices (metres) and counter-clockwise triangles seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertices.
    pub vertices: Vec<Vec3>,
    /// Indices of each triangle's corners.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a mesh cannot be the surface of a solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// No triangles.
    #[error("the mesh has no triangles")]
    Empty,
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} refers to vertex {vertex}, but there are only {count}")]
    BadIndex {
        /// Triangle number, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a number")]
    NotFinite {
        /// Vertex number, from 0.
        vertex: usize,
    },
    /// Edges with a triangle on one side only, or more than two triangles.
    #[error(
        "the mesh is not watertight: {open} of {edges} edges do not have exactly two triangles; close the holes in your CAD or mesh program"
    )]
    Open {
        /// Edges without exactly two opposite triangles.
        open: usize,
        /// All edges.
        edges: usize,
    },
    /// Closed, but encloses no volume.
    #[error("the mesh encloses no volume ({volume_m3} m³)")]
    NoVolume {
        /// Signed volume.
        volume_m3: f32,
    },
}

/// Volume, centre of mass and second moments of a solid of density 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidMoments {
    /// Volume, m³; negative when the triangles face inwards.
    pub volume_m3: f32,
    /// Centre of mass.
    pub centroid: Vec3,
    /// Covariance integral ∫ (p−c)(p−c)ᵀ dV about the centroid, m⁵.
    pub covariance_m5: Mat3,
}

impl TriMesh {
    /// Smallest box around the vertices.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.vertices.iter().copied())
    }

    /// Corner positions of triangle `t`.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|i| self.vertices[i as usize])
    }

    /// Outward unit normal of triangle `t`; zero for a degenerate one.
    pub fn triangle_normal(&self, t: usize) -> Vec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Area of triangle `t`, m².
    pub fn triangle_area_m2(&self, t: usize) -> f32 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a).length() * 0.5
    }

    /// Whole surface, m².
    pub fn area_m2(&self) -> f32 {
        (0..self.triangles.len()).map(|t| self.triangle_area_m2(t)).sum()
    }

    /// The mesh with every vertex mapped by `f`.
    pub fn map(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        Self {
            vertices: self.vertices.iter().map(|&v| f(v)).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Vertices closer than `tolerance_m` become one (STL repeats every corner); degenerate triangles go.
    pub fn welded(&self, tolerance_m: f32) -> Self {
        let cell = tolerance_m.max(f32::MIN_POSITIVE);
        let key = |v: Vec3| {
            let q = (v.as_dvec3() / f64::from(cell)).round();
            [q.x as i64, q.y as i64, q.z as i64]
        };
        let mut first: HashMap<[i64; 3], u32> = HashMap::with_capacity(self.vertices.len());
        let mut vertices = Vec::new();
        let remap: Vec<u32> = self
            .vertices
            .iter()
            .map(|&v| {
                *first.entry(key(v)).or_insert_with(|| {
                    vertices.push(v);
                    (vertices.len() - 1) as u32
                })
            })
            .collect();
        let triangles = self
            .triangles
            .iter()
            .map(|t| t.map(|i| remap[i as usize]))
            .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
            .collect();
        Self { vertices, triangles }
    }

    /// Checks that the mesh bounds a solid: valid indices, finite, every edge shared by two opposite triangles.
    pub fn check_solid(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(vertex) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        let count = self.vertices.len();
        for (triangle, t) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = t.iter().find(|&&i| i as usize >= count) {
                return Err(MeshError::BadIndex { triangle, vertex, count });
            }
        }
        let mut balance: HashMap<(u32, u32), (i32, u32)> = HashMap::new();
        for t in &self.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let entry = balance.entry((a.min(b), a.max(b))).or_default();
                entry.0 += if a < b { 1 } else { -1 };
                entry.1 += 1;
            }
        }
        // An even number of triangles, as many each way: also what a CAD union with touching edges gives.
        let open = balance.values().filter(|(sum, n)| *sum != 0 || n % 2 != 0).count();
        if open > 0 {
            return Err(MeshError::Open { open, edges: balance.len() });
        }
        let volume_m3 = self.moments().volume_m3;
        if volume_m3.abs() <= f32::MIN_POSITIVE {
            return Err(MeshError::NoVolume { volume_m3 });
        }
        Ok(())
    }

    /// Volume, centroid and covariance by the divergence theorem; meaningful for a closed mesh.
    pub fn moments(&self) -> SolidMoments {
        let reference = self.bounds().centre().as_dvec3();
        let (mut volume, mut first) = (0.0_f64, glamx::DVec3::ZERO);
        let mut second = [[0.0_f64; 3]; 3];
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t).map(|v| v.as_dvec3() - reference);
            let v = a.dot(b.cross(c)) / 6.0;
            let sum = a + b + c;
            volume += v;
            first += sum * (v / 4.0);
            for i in 0..3 {
                for j in 0..3 {
                    let own = a[i] * a[j] + b[i] * b[j] + c[i] * c[j];
                    second[i][j] += v / 20.0 * (own + sum[i] * sum[j]);
                }
            }
        }
        let centre = if volume.abs() > 0.0 { first / volume } else { glamx::DVec3::ZERO };
        let column = |j: usize| {
            let at = |i: usize| (second[i][j] - volume * centre[i] * centre[j]) as f32;
            Vec3::new(at(0), at(1), at(2))
        };
        SolidMoments {
            volume_m3: volume as f32,
            centroid: (centre + reference).as_vec3(),
            covariance_m5: Mat3::from_cols(column(0), column(1), column(2)),
        }
    }

    /// `count` points drawn uniformly over the surface, with the outward normal of their triangle.
    pub fn sample_surface(&self, count: usize, rng: &mut impl Rng) -> Vec<(Vec3, Vec3)> {
        let mut cumulative = Vec::with_capacity(self.triangles.len());
        let mut total = 0.0_f64;
        for t in 0..self.triangles.len() {
            total += f64::from(self.triangle_area_m2(t));
            cumulative.push(total);
        }
        if total <= 0.0 {
            return Vec::new();
        }
        (0..count)
            .map(|_| {
                let u = rng.random::<f64>() * total;
                let t = cumulative.partition_point(|&c| c < u).min(self.triangles.len() - 1);
                let [a, b, c] = self.corners(t);
                let (mut v, mut w) = (rng.random::<f32>(), rng.random::<f32>());
                if v + w > 1.0 {
                    (v, w) = (1.0 - v, 1.0 - w);
                }
                (a + (b - a) * v + (c - a) * w, self.triangle_normal(t))
            })
            .collect()
    }

    /// The mesh with only the vertices its triangles use, in their order.
    pub fn without_loose_vertices(&self) -> Self {
        let mut used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
        let mut next = 0;
        let remap: Vec<u32> = used
            .iter()
            .map(|&u| {
                next += u32::from(u);
                next.wrapping_sub(1)
            })
            .collect();
        let vertices =
            self.vertices.iter().zip(&used).filter(|(_, u)| **u).map(|(v, _)| *v).collect();
        Self {
            vertices,
            triangles: self.triangles.iter().map(|t| t.map(|i| remap[i as usize])).collect(),
        }
    }

    /// The mesh with every triangle once: a shell that was exported twice is one shell.
    pub fn without_doubles(&self) -> Self {
        // Turned so that the least index stands first: the same triangle whichever corner it begins with.
        let key = |t: &[u32; 3]| {
            let first = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
            [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
        };
        let mut seen = std::collections::HashSet::with_capacity(self.triangles.len());
        let triangles = self.triangles.iter().filter(|t| seen.insert(key(t))).copied().collect();
        Self { vertices: self.vertices.clone(), triangles }
    }

    /// Every triangle turned to face the other way.
    pub fn flipped(&self) -> Self {
        Self {
            vertices: self.vertices.clone(),
            triangles: self.triangles.iter().map(|t| [t[0], t[2], t[1]]).collect(),
        }
    }

    /// The other mesh's triangles appended.
    pub fn append(&mut self, other: &Self) {
        let offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriMesh {
        TriMesh {
            vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }
    }

    #[test]
    fn moments_of_a_tetrahedron() {
        let m = tetrahedron().moments();
        assert!((m.volume_m3 - 1.0 / 6.0).abs() < 1e-6);
        assert!((m.centroid - Vec3::splat(0.25)).length() < 1e-6);
        // ∫x² over the unit tetrahedron is 1/60; about the centroid 1/60 − V/16 = 1/160.
        assert!((m.covariance_m5.x_axis.x - 1.0 / 160.0).abs() < 1e-6);
    }

    #[test]
    fn an_open_mesh_is_named() {
        let mut mesh = tetrahedron();
        assert_eq!(mesh.check_solid(), Ok(()));
        mesh.triangles.pop();
        assert_eq!(mesh.check_solid(), Err(MeshError::Open { open: 3, edges: 6 }));
    }

    #[test]
    fn welding_an_stl_soup_closes_it() {
        let solid = tetrahedron();
        let mut soup = TriMesh::default();
        for t in 0..4 {
            soup.append(&TriMesh {
                vertices: solid.corners(t).to_vec(),
                triangles: vec![[0, 1, 2]],
            });
        }
        assert!(soup.check_solid().is_err());
        assert_eq!(soup.welded(1e-5).check_solid(), Ok(()));
    }
}
