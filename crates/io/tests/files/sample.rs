//! A small result with every kind of thing to export; also written by `examples/exports.rs` for other readers.

use geom::{Pose, Quat, TriMesh, Vec3};
use io::details::{Details, Unfilled};
use io::drawing::{Drawing, SectionLine};
use io::raster::Raster;
use io::tin::Tin;
use scene::{
    AreaVolume, BlockModel, Catalog, ConvexPart, Fit, Guess, InstanceId, ModelId, Placement,
    PlacementState, Recognised, SectionQuantity, SiteFrame, SymmetryGroup, Verdict,
};

/// Owns what a [`Drawing`] borrows.
pub struct Sample {
    pub frame: SiteFrame,
    pub catalog: Catalog,
    pub recognised: Vec<Recognised>,
    pub placements: Vec<Placement>,
    pub sections: Vec<SectionLine>,
}

impl Sample {
    pub fn drawing(&self) -> Drawing<'_> {
        Drawing {
            name: "Sample 積む & \"co\"",
            frame: &self.frame,
            catalog: &self.catalog,
            recognised: &self.recognised,
            placements: &self.placements,
            sections: &self.sections,
        }
    }
}

/// A wedge: no symmetry, so that a wrong axis shows.
fn wedge(name: &str, size: f32) -> BlockModel {
    let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * size;
    let vertices = vec![
        v(0.0, 0.0, 0.0),
        v(2.0, 0.0, 0.0),
        v(2.0, 1.0, 0.0),
        v(0.0, 1.0, 0.0),
        v(0.0, 0.0, 0.5),
        v(0.0, 1.0, 0.5),
    ];
    let triangles = vec![
        [0, 2, 1],
        [0, 3, 2],
        [0, 1, 4],
        [1, 2, 5],
        [1, 5, 4],
        [2, 3, 5],
        [0, 4, 5],
        [0, 5, 3],
    ];
    let mesh = TriMesh { vertices, triangles };
    mesh.check_solid().unwrap();
    let moments = mesh.moments();
    BlockModel {
        name: name.into(),
        parts: vec![ConvexPart { corners: mesh.vertices.clone() }],
        parts_volume_ratio: 1.0,
        volume_m3: moments.volume_m3,
        density_kg_m3: 2300.0,
        centre: moments.centroid,
        symmetry: SymmetryGroup::trivial(moments.centroid),
        d_max_m: mesh.vertices.iter().map(|p| (*p - moments.centroid).length()).fold(0.0, f32::max),
        d_box_m: 2.0 * size,
        mesh,
    }
}

pub fn pose(i: usize) -> Pose {
    let t = i as f32;
    let axis = Vec3::new((t * 1.3).sin(), (t * 0.7).cos(), 0.3 + t * 0.01).normalize();
    Pose::from_parts(
        Vec3::new(t * 1.75, -t * 0.5, 1.0 + t * 0.125),
        Quat::from_axis_angle(axis, t * 0.9),
    )
}

pub fn sample() -> Sample {
    let frame = SiteFrame {
        origin: [-35_600.5, -12_300.25, 2.0],
        crs: "EPSG:6679".into(),
        vertical_datum: "T.P.".into(),
    };
    let catalog = Catalog::new(vec![wedge("wedge-2m", 1.0), wedge("wedge 3m (積)", 1.5)]);
    let recognised = (0..6)
        .map(|i| {
            let fit = Fit {
                confidence: Some(0.9),
                fitness_m: Some(0.0125),
                runner_up: Some((ModelId(((i + 1) % 2) as u16), 0.25)),
                occlusion: Some(0.3),
                ..Fit::of_pose(ModelId((i % 2) as u16), pose(i))
            };
            let verdict = match i {
                5 => Verdict::NotJudged(Guess::Fit(fit)),
                _ => Verdict::Stated(fit),
            };
            Recognised { block: InstanceId(i as u32 + 1), points: Vec::new(), verdict }
        })
        .collect();
    let placements = (0..4)
        .map(|i| Placement {
            order: i as u32 + 1,
            round: 1,
            model: ModelId((i % 2) as u16),
            drop: pose(i + 10),
            rest: pose(i + 20),
            filled_m3: 1.25,
            contacts: 3,
            state: if i == 3 { PlacementState::Overflow } else { PlacementState::Kept },
            handling: scene::Handling::default(),
        })
        .collect();
    let line = |surface: &str, z: f64| SectionLine {
        chainage_m: 5.0,
        surface: surface.into(),
        points: (0..5)
            .map(|i| [-35_600.0 + f64::from(i), -12_300.0, z + f64::from(i % 2)])
            .collect(),
    };
    Sample {
        frame,
        catalog,
        recognised,
        placements,
        sections: vec![line("design", 4.0), line("as-is", 2.0)],
    }
}

/// A height map with a hole.
pub fn raster() -> Raster {
    let (columns, rows) = (7, 5);
    let value = (0..columns * rows)
        .map(|i| if i == 9 { f32::NAN } else { (i % columns) as f32 + 10.0 * (i / columns) as f32 })
        .collect();
    Raster { origin: [-35_600.25, -12_300.75], cell_m: 0.5, columns, value }
}

/// Two triangles.
pub fn tin() -> Tin {
    let v = |x: f64, y: f64, z: f64| geom::DVec3::new(x - 35_600.125, y - 12_300.0, z);
    Tin {
        vertices: vec![v(0.0, 0.0, 1.0), v(10.0, 0.0, 2.0), v(10.0, 5.0, 3.5), v(0.0, 5.0, 2.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// The same as a surface to write.
pub fn surface(name: &str) -> io::landxml::Surface {
    io::landxml::Surface { name: name.into(), note: "a \"sample\" < 1".into(), tin: tin() }
}

/// The sample with everything that belongs to works.
#[allow(dead_code)] // the hostile tests share this file and damage readers only
pub fn details() -> Details {
    Details {
        survey_date: "2026-11-30".into(),
        alignment: vec![[-35_600.0, -12_310.0], [-35_600.0, -12_290.0]],
        design_lines: vec![(
            true,
            vec![
                [-35_601.0, -12_301.0, 3.0],
                [-35_590.0, -12_301.0, 3.0],
                [-35_590.0, -12_290.0, 3.0],
            ],
        )],
        unfilled: vec![Unfilled {
            centre: [-35_595.0, -12_299.0],
            half_m: 0.5,
            void_m3: 0.75,
            reason: "too shallow".into(),
        }],
        quantities: vec![
            SectionQuantity::default(),
            SectionQuantity {
                chainage_m: 5.0,
                length_m: 5.0,
                missing: AreaVolume { area_m2: 4.0, volume_m3: 10.0 },
                ..SectionQuantity::default()
            },
        ],
    }
}
