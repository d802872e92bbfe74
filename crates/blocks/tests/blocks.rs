//! The catalogue as a caller sees it.

use blocks::convex_parts::{ConvexConfig, convex_parts};
use blocks::symmetry::{SymmetryConfig, find_symmetry};
use blocks::{BlockError, catalog, mesh_model, random_union, shape_model, warnings};
use geom::union_volume_m3;
use geom::{ConvexSolid, MeshError, Quat, SeedTree, TriMesh, Vec3};
use scene::{BlockModel, BlockSpec, Catalog, CatalogSpec, LengthUnit, Shape};
use std::path::Path;

const SHAPES: [(Shape, f32, usize); 4] = [
    (Shape::Tetrapod { size: 2.0 }, 0.280, 12),
    (Shape::Dolos { size: 2.0 }, 0.16, 4),
    (Shape::Cube { size: 2.0 }, 1.0, 24),
    (Shape::Antifer { size: 2.0 }, 1.0247, 4),
];

fn shape(shape: Shape) -> BlockModel {
    shape_model("unit", shape, 2300.0).unwrap()
}

fn solids(model: &BlockModel) -> Vec<ConvexSolid> {
    model.parts.iter().map(|p| ConvexSolid::from_corners(&p.corners).unwrap()).collect()
}

fn spec(shape: Option<Shape>, mesh: Option<&str>, unit: Option<LengthUnit>) -> BlockSpec {
    BlockSpec {
        name: "unit".into(),
        shape,
        mesh: mesh.map(Into::into),
        unit,
        density_kg_m3: 2300.0,
    }
}

#[test]
fn volumes_are_the_published_ones_to_one_percent() {
    for (s, volume, _) in SHAPES {
        let ratio = shape(s).volume_m3 / 8.0 / volume;
        assert!((ratio - 1.0).abs() < 0.01, "{s:?}: {ratio}");
    }
}

#[test]
fn the_parts_of_a_shape_are_the_shape() {
    for (s, ..) in SHAPES {
        let model = shape(s);
        let parts = solids(&model);
        let ratio = union_volume_m3(&parts, 200) as f32 / model.volume_m3;
        assert!((ratio - 1.0).abs() < 0.002, "{s:?}: {ratio}");
        let joined = geom::union(&parts);
        assert_eq!(joined.check_solid(), Ok(()), "{s:?}");
        assert!((joined.moments().volume_m3 / model.volume_m3 - 1.0).abs() < 1e-3);
    }
}

#[test]
fn symmetry_found_on_the_mesh_is_the_one_built_in() {
    let turn = Quat::from_rotation_x(0.3) * Quat::from_rotation_z(1.0);
    for (s, _, order) in SHAPES {
        let model = shape(s);
        assert_eq!(model.symmetry.order(), order);
        let moved = model.mesh.map(|v| turn * v + Vec3::new(4.0, -5.0, 6.0));
        let found = find_symmetry(&moved, &SymmetryConfig::default()).unwrap();
        assert_eq!(found.order(), order, "{s:?}");
        assert!(found.is_closed(1e-2) && found.axis().is_none());
        assert!((found.centre() - turn * model.centre - Vec3::new(4.0, -5.0, 6.0)).length() < 1e-3);
        // The same rotations, seen in the moved coordinates.
        for &q in found.rotations() {
            let back = turn.inverse() * q * turn;
            let nearest = model
                .symmetry
                .rotations()
                .iter()
                .map(|g| back.angle_between(*g))
                .fold(9.0, f32::min);
            assert!(nearest < 0.01, "{s:?}: {nearest}");
        }
    }
}

/// A prism with many sides; `top` < 1 makes it a frustum without equal ends.
fn round(sides: u32, half_m: f32, top: f32) -> TriMesh {
    let ring = |z: f32, r: f32| {
        (0..sides).map(move |i| {
            let (sin, cos) = (i as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
            Vec3::new(r * cos, r * sin, z)
        })
    };
    let corners: Vec<Vec3> = ring(-half_m, 1.0).chain(ring(half_m, top)).collect();
    geom::union(&[ConvexSolid::from_corners(&corners).unwrap()])
}

#[test]
fn bodies_of_revolution_are_flagged() {
    let cylinder = find_symmetry(&round(64, 1.5, 1.0), &SymmetryConfig::default()).unwrap();
    assert_eq!(cylinder.order(), 72);
    assert!(cylinder.axis().unwrap().z.abs() > 0.9999);
    let cone = find_symmetry(&round(64, 1.5, 0.5), &SymmetryConfig::default()).unwrap();
    assert_eq!(cone.order(), 36);
    let prism = find_symmetry(&round(6, 1.5, 0.5), &SymmetryConfig::default()).unwrap();
    assert_eq!((prism.order(), prism.axis()), (6, None));
}

#[test]
fn a_block_with_no_symmetry_has_the_identity() {
    let corners =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.3, 1.1, 0.0], [0.1, 0.4, 0.9]].map(Vec3::from_array);
    let wedge = geom::union(&[ConvexSolid::from_corners(&corners).unwrap()]);
    assert_eq!(find_symmetry(&wedge, &SymmetryConfig::default()).unwrap().order(), 1);
}

#[test]
fn a_mesh_in_millimetres_becomes_a_block_in_metres() {
    let mesh = shape(Shape::Antifer { size: 1.0 }).mesh.map(|v| v * 1000.0);
    // As STL has it: every corner repeated, and inside out.
    let mut soup = TriMesh::default();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        soup.append(&TriMesh { vertices: vec![a, c, b], triangles: vec![[0, 1, 2]] });
    }
    let list = CatalogSpec { block: vec![spec(None, Some("unit.stl"), Some(LengthUnit::Mm))] };
    let found = catalog(&list, &|path| {
        assert_eq!(path, Path::new("unit.stl"));
        Ok(soup.clone())
    })
    .unwrap();
    let model = found.get(found.find("unit").unwrap());
    assert!((model.volume_m3 / 1.0247 - 1.0).abs() < 0.01);
    assert!((model.d_box_m - 1.086).abs() < 1e-4);
    assert!((model.mass_kg() / 2357.0 - 1.0).abs() < 0.01);
    assert_eq!(model.symmetry.order(), 4);
    assert!((model.parts_volume_ratio - 1.0).abs() < 0.03, "{}", model.parts_volume_ratio);
    assert!(warnings(&found).is_empty());
}

#[test]
fn parts_of_a_tetrapod_mesh_keep_its_volume() {
    let model = shape(Shape::Tetrapod { size: 2.0 });
    let (parts, ratio) = convex_parts(&model.mesh, &ConvexConfig::default());
    assert!((ratio - 1.0).abs() < 0.025, "{ratio}");
    assert!(parts.len() <= 32);
}

/// A tube along z: `sides` facets, outer radius 1, open at both ends.
fn tube(sides: u32, inner: f32, height: f32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for (radius, z) in [(1.0, 0.0), (1.0, height), (inner, height), (inner, 0.0)] {
        mesh.vertices.extend((0..sides).map(|k| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / sides as f32).sin_cos();
            Vec3::new(radius * cos, radius * sin, z)
        }));
    }
    for ring in 0..4 {
        for k in 0..sides {
            let at = |ring: u32, k: u32| (ring % 4) * sides + k % sides;
            let (a, b, c, d) = (at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[test]
fn thin_walls_are_cut_until_their_parts_are_the_solid() {
    let bracket = {
        let slab = |size: Vec3| {
            ConvexSolid::from_corners(
                &(0..8)
                    .map(|i| size * Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32))
                    .collect::<Vec<_>>(),
            )
        };
        geom::union(&[
            slab(Vec3::new(1.0, 0.6, 0.1)).unwrap(),
            slab(Vec3::new(0.1, 0.6, 0.8)).unwrap(),
        ])
    };
    let cut_only = ConvexConfig { steps: Vec::new(), ..Default::default() };
    for (mesh, most) in
        [(tube(24, 0.85, 1.5), 40), (bracket, 8), (shape(Shape::Dolos { size: 2.0 }).mesh, 40)]
    {
        assert_eq!(mesh.check_solid(), Ok(()));
        let (parts, ratio) = convex_parts(&mesh, &cut_only);
        assert!((ratio - 1.0).abs() < 0.085, "{} parts, {ratio}", parts.len());
        assert!(parts.len() <= most, "{} parts, {ratio}", parts.len());
        assert_eq!(convex_parts(&mesh, &cut_only).0, parts, "the same on every run");
    }
    let (_, ratio) = convex_parts(&tube(24, 0.85, 1.5), &ConvexConfig::default());
    assert!((ratio - 1.0).abs() < 0.085, "{ratio}");
}

#[test]
fn parts_that_are_not_the_solid_are_warned_about() {
    let mut model = shape(Shape::Cube { size: 1.0 });
    model.parts_volume_ratio = 1.07;
    assert!(warnings(&Catalog::new(vec![model.clone()]))[0].message.contains("107 %"));
    model.parts_volume_ratio = 1.3;
    assert!(warnings(&Catalog::new(vec![model]))[0].message.contains("too far off to make piles"));
}

#[test]
fn what_is_wrong_is_named() {
    let none = |_: &Path| Err("unit.stl: no such file".to_string());
    let fails =
        |block: Vec<BlockSpec>| catalog(&CatalogSpec { block }, &none).unwrap_err().to_string();
    let cube = Some(Shape::Cube { size: 1.0 });
    assert!(fails(vec![]).contains("no [[block]]"));
    assert!(fails(vec![spec(None, None, None)]).contains("either `shape` or `mesh`"));
    assert!(fails(vec![spec(None, Some("unit.stl"), None)]).contains("add `unit"));
    assert!(
        fails(vec![spec(None, Some("unit.stl"), Some(LengthUnit::M))]).contains("no such file")
    );
    assert!(fails(vec![spec(cube, None, None), spec(cube, None, None)]).contains("twice"));
    assert!(
        fails(vec![spec(Some(Shape::Dolos { size: f32::NAN }), None, None)])
            .contains("not between 1 mm and 100 m")
    );

    let mut open = shape(Shape::Cube { size: 1.0 }).mesh;
    open.triangles.pop();
    let error = mesh_model("unit", &open, 2300.0).unwrap_err();
    assert!(matches!(error, BlockError::Mesh { source: MeshError::Open { .. }, .. }));
    assert!(error.to_string().contains("not watertight"));
    let mut nan = shape(Shape::Cube { size: 1.0 }).mesh;
    nan.vertices[3].y = f32::NAN;
    assert!(mesh_model("unit", &nan, 2300.0).unwrap_err().to_string().contains("vertex 3"));
    assert!(
        mesh_model("unit", &TriMesh::default(), 2300.0)
            .unwrap_err()
            .to_string()
            .contains("no triangles")
    );
}

#[test]
fn random_unions_are_solid_compact_and_repeatable() {
    for i in 0..10 {
        let seed = SeedTree::new(5).child("block", i);
        let model = random_union(seed);
        assert_eq!(model.mesh.check_solid(), Ok(()));
        assert!((0.49..1.61).contains(&model.d_max_m), "{}", model.d_max_m);
        assert!(model.symmetry.is_closed(0.02));
        let ratio = union_volume_m3(&solids(&model), 120) as f32 / model.volume_m3;
        assert!((ratio - 1.0).abs() < 0.01, "{i}: {ratio}");
        assert_eq!(model.mesh, random_union(seed).mesh);
    }
    let catalog = Catalog::new(vec![random_union(SeedTree::new(1))]);
    assert!(warnings(&catalog).is_empty());
}

/// A dolos of 1e-40 m once ended in a panic, for a hull of corners that fall together.
#[test]
fn no_size_of_any_shape_is_a_fault() {
    let shapes: [fn(f32) -> Shape; 13] = [
        |size| Shape::Tetrapod { size },
        |size| Shape::Dolos { size },
        |size| Shape::Cube { size },
        |size| Shape::Antifer { size },
        |size| Shape::CoreLocLike { size },
        |size| Shape::XblocLike { size },
        |size| Shape::AccropodeLike { size },
        |size| Shape::SixLegLike { size },
        |size| Shape::EyeBolt { size },
        |size| Shape::GearShaft { size },
        |size| Shape::HoledPlate { size },
        |size| Shape::HookPlate { size },
        |size| Shape::Bracket { size },
    ];
    for shape in shapes {
        // At both ends of what is allowed a shape is a block or is refused by name.
        for size in [0.001, 0.0013, 0.02, 99.0, 100.0] {
            if let Err(error) = blocks::shape_model("b", shape(size), 2300.0) {
                assert!(error.to_string().contains('b'), "{:?}: {error}", shape(size));
            }
        }
        assert!(blocks::shape_model("b", shape(2.0), 2300.0).is_ok(), "{:?}", shape(2.0));
        let beyond =
            [1e-40, 1e-30, 9.9e-4, 100.1, 1e30, f32::MAX, f32::INFINITY, f32::NAN, -1.0, 0.0];
        for size in beyond {
            let error = blocks::shape_model("b", shape(size), 2300.0).err();
            assert!(error.is_some(), "{:?} is taken", shape(size));
        }
    }
}

/// `shell-twice.stl`: a cube, every triangle twice, was once 16 m³ instead of 8.
#[test]
fn shell_twice() {
    let cube = shape(Shape::Cube { size: 2.0 }).mesh;
    let twice = TriMesh {
        vertices: cube.vertices.clone(),
        triangles: [cube.triangles.clone(), cube.triangles.clone()].concat(),
    };
    let block = mesh_model("twice", &twice, 2300.0).unwrap();
    assert!((block.volume_m3 - 8.0).abs() < 1e-3, "{}", block.volume_m3);
    // One shell in the other, turned the same way, is no solid of either volume.
    let inner = cube.map(|v| v * 0.5);
    let offset = cube.vertices.len() as u32;
    let both = TriMesh {
        vertices: [cube.vertices, inner.vertices].concat(),
        triangles: cube
            .triangles
            .iter()
            .copied()
            .chain(inner.triangles.iter().map(|t| t.map(|v| v + offset)))
            .collect(),
    };
    assert!(matches!(mesh_model("both", &both, 2300.0), Err(BlockError::Shells { .. })));
}

/// `far-from-origin.obj`: what a mesh becomes does not depend on how finely its file rounds the corners, but for a convex part more
/// or less of those a concave solid is cut into.
#[test]
fn rounded_corners_make_the_same_block() {
    let exact = shape(Shape::Tetrapod { size: 2.0 }).mesh;
    let rounded = exact.map(|v| (v * 1e6).round() / 1e6);
    let (a, b) = (
        mesh_model("exact", &exact, 2300.0).unwrap(),
        mesh_model("rounded", &rounded, 2300.0).unwrap(),
    );
    assert_eq!(a.symmetry.order(), b.symmetry.order());
    assert!(a.parts.len().abs_diff(b.parts.len()) <= 1, "{} {}", a.parts.len(), b.parts.len());
    assert!((a.volume_m3 - b.volume_m3).abs() < 1e-4);
    assert!((a.parts_volume_ratio - b.parts_volume_ratio).abs() < 0.02);
}
