//! Clouds and catalogues that lie in memory instead of files, as a site.

use crate::error::OrBadInput;
use crate::local_survey::{RawSurvey, local_survey};
use crate::site::bound_memory;
use crate::surveys::ground_of;
use crate::{Error, Job, Result, Settings, Site, catalogue};
use anyhow::anyhow;
use geom::{DVec3, Observer, TriMesh, Vec3};
use scene::{Catalog, CatalogSpec, DesignSurface, GroundSpec, SensorKind, Survey};
use std::collections::BTreeMap;
use std::path::Path;

/// One cloud as columns, and what is known of it.
#[derive(Clone, Debug, Default)]
pub struct Arrays {
    /// Points, site coordinates: east, north, up, metres.
    pub points: Vec<[f64; 3]>,
    /// Unit normals of the points; empty: they are estimated.
    pub normals: Vec<[f32; 3]>,
    /// Survey line of each point, 0 = unknown; empty: not known.
    pub lines: Vec<u16>,
    /// Kind of sensor.
    pub sensor: SensorKind,
    /// Where the sensor was, site coordinates; empty: straight above.
    pub sensor_positions: Vec<[f64; 3]>,
    /// `EPSG:n`; empty: a cloud without a system.
    pub crs: String,
    /// The system of the heights, in words.
    pub vertical_datum: String,
    /// Name for reports.
    pub name: String,
    /// How high the finished works should stand; `None`: nothing is planned.
    pub design: Option<DesignSurface>,
    /// The bed, where it is known.
    pub ground: Option<GroundSpec>,
}

impl Site {
    /// A site of a cloud in memory. It has no folder: its runs know no input files. Errors: columns of different lengths, a
    /// coordinate that is not a number, blocks that cannot lie in this cloud.
    pub fn of_arrays(
        arrays: Arrays,
        catalog: Catalog,
        settings: &Settings,
        job: &Job,
    ) -> Result<Self> {
        bound_memory(settings.memory, &[], true, job)?;
        let (design, ground) = (arrays.design.clone(), arrays.ground);
        let name = arrays.name.clone();
        let survey = survey_of(arrays)?;
        if let Some(design) = &design {
            design.check().or_bad_input()?;
        }
        let ground = ground.map(|g| ground_of(&g, &survey.frame));
        let site = Self {
            name,
            folder: None,
            survey_date: String::new(),
            catalog,
            survey,
            design,
            config: settings.alone()?.with_ground(ground.as_ref()),
            ground,
            review: None,
            ratings: None,
            learned: None,
            memory: settings.memory,
            entry_sizes_m: Vec::new(),
            seed: settings.seed.unwrap_or_default(),
            inputs: BTreeMap::new(),
            input_files: Vec::new(),
            records: None,
        };
        site.check()?;
        if job.is_stopped() {
            return Err(Error::stopped(anyhow!("stopped before the work began")));
        }
        Ok(site)
    }
}

/// The columns as a local survey.
pub(crate) fn survey_of(arrays: Arrays) -> Result<Survey> {
    check(&arrays)?;
    let raw = RawSurvey {
        file: "points".into(),
        position: arrays.points.iter().copied().map(DVec3::from_array).collect(),
        line: arrays.lines,
        sensor: arrays.sensor,
        sensor_position: arrays.sensor_positions.iter().copied().map(DVec3::from_array).collect(),
        ..RawSurvey::default()
    };
    drop(arrays.points);
    let mut survey = local_survey(&[raw], &arrays.crs, &arrays.vertical_datum).or_bad_input()?;
    survey.cloud.normal = arrays.normals.into_iter().map(Vec3::from_array).collect();
    Ok(survey)
}

/// Columns of another length would be another cloud's.
fn check(arrays: &Arrays) -> Result<()> {
    let points = arrays.points.len();
    for (name, length) in [("normals", arrays.normals.len()), ("lines", arrays.lines.len())] {
        if length > 0 && length != points {
            return Err(Error::bad_input(anyhow!(
                "{name}: has {length} entries, points has {points}; give one a point, or none"
            )));
        }
    }
    let finite = |v: &[f32; 3]| v.iter().all(|c| c.is_finite());
    if let Some(i) = arrays.normals.iter().position(|n| !finite(n)) {
        return Err(Error::bad_input(anyhow!(
            "normals: that of point {i} (counted from 0) is not a number; give none to have them estimated"
        )));
    }
    let seen_from = arrays.sensor_positions.iter();
    if let Some(i) = seen_from.clone().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(Error::bad_input(anyhow!("sensor_positions: row {i} is not a number")));
    }
    Ok(())
}

/// The models of a catalogue whose meshes lie in memory, metres, by the name its entries give; meshes it names beside them are
/// looked for beside `file`. Errors: a triangle of a vertex that is not there, a surface that is not closed.
pub fn catalog_of(
    spec: &CatalogSpec,
    meshes: &BTreeMap<String, TriMesh>,
    file: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Catalog> {
    for (name, mesh) in meshes {
        let count = mesh.vertices.len();
        let missing = |t: &[u32; 3]| t.iter().copied().find(|&v| v as usize >= count);
        let refers = |(i, t)| missing(t).map(|vertex| (i, vertex));
        if let Some((triangle, vertex)) = mesh.triangles.iter().enumerate().find_map(refers) {
            return Err(Error::bad_input(anyhow!(
                "{name}: triangle {triangle} refers to vertex {vertex}, but there are only {count}"
            )));
        }
    }
    catalogue::models_with(spec, meshes, file, observer)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn catalog(json: &str) -> Result<Catalog> {
        let spec: CatalogSpec = serde_json::from_str(json).unwrap();
        catalog_of(&spec, &BTreeMap::new(), None, &geom::Silent)
    }

    fn arrays(points: Vec<[f64; 3]>) -> Arrays {
        Arrays { points, ..Arrays::default() }
    }

    fn line(arrays: Arrays) -> String {
        let blocks = r#"{"block":[{"name":"c","shape":{"kind":"cube","size":1.0}}]}"#;
        let site =
            Site::of_arrays(arrays, catalog(blocks).unwrap(), &Settings::default(), &Job::silent());
        site.map(|_| String::new()).unwrap_or_else(|e| e.line())
    }

    #[test]
    fn columns_that_do_not_fit_are_named() {
        let three = || arrays(vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 1.0]]);
        assert_eq!(line(three()), "");
        assert!(line(arrays(Vec::new())).contains("points"));
        let nan = arrays(vec![[0.0; 3], [0.0, f64::NAN, 0.0]]);
        assert!(line(nan).contains("points: point 2"));
        assert!(line(Arrays { lines: vec![1], ..three() }).contains("lines: has 1 entries"));
        let short = Arrays { normals: vec![[0.0, 0.0, 1.0]; 2], ..three() };
        assert!(line(short).contains("normals: has 2"));
        let broken = Arrays { normals: vec![[f32::NAN; 3]; 3], ..three() };
        assert!(line(broken).contains("normals: that of point 0"));
        let far = Arrays { sensor_positions: vec![[f64::INFINITY; 3]], ..three() };
        assert!(line(far).contains("sensor_positions"));
    }

    #[test]
    fn a_mesh_in_memory_is_a_block() {
        let spec = r#"{"block":[{"name":"wedge","mesh":"wedge","unit":"m"}]}"#;
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mesh = TriMesh {
            vertices: corners.iter().map(|&c| Vec3::from_array(c)).collect(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let spec: CatalogSpec = serde_json::from_str(spec).unwrap();
        let mut stray = mesh.clone();
        stray.triangles[2][1] = 9;
        let meshes = BTreeMap::from([("wedge".to_string(), mesh)]);
        let found = catalog_of(&spec, &meshes, None, &geom::Silent).unwrap();
        let volume_m3 = found.iter().next().unwrap().1.volume_m3;
        assert!((volume_m3 - 1.0 / 6.0).abs() < 1e-6, "{volume_m3}");
        let stray = BTreeMap::from([("wedge".to_string(), stray)]);
        let stray = catalog_of(&spec, &stray, None, &geom::Silent).unwrap_err();
        assert!(stray.line().contains("triangle 2 refers to vertex 9"), "{}", stray.line());
        let missing = catalog_of(&spec, &BTreeMap::new(), None, &geom::Silent).unwrap_err();
        assert!(missing.line().contains("wedge"), "{}", missing.line());
    }
}
