//! What a user's files say, as the values the stages take.

use crate::exit::{Exit, OrBadInput};
use crate::progress::Terminal;
use anyhow::{Context, anyhow};
use geom::{DVec3, Event, Observer};
use io::blocks_csv::BlockRow;
use io::manifest::Entry;
use io::{IoError, RawCloud};
use pipeline::survey::{RawSurvey, local_survey};
use scene::{
    Area, AxisOrder, BlockModel, Catalog, CatalogSpec, DesignSurface, Fit, Ground, GroundSpec,
    InstanceId, Recognised, SensorKind, SiteFrame, Survey,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reads `catalog.toml` and the meshes it names.
pub fn catalog(file: &Path, observer: &dyn Observer) -> Result<Catalog, Exit> {
    let spec = io::site::load_catalog(file).or_bad_input()?;
    models(&spec, file, observer)
}

/// The models of a catalogue whose meshes lie beside `file`.
pub fn models(spec: &CatalogSpec, file: &Path, observer: &dyn Observer) -> Result<Catalog, Exit> {
    let load = io::site::mesh_loader(file);
    let catalog = blocks::catalog(spec, &load)
        .map_err(|e| Exit::bad_input(anyhow!(e).context(file.display().to_string())))?;
    for warning in blocks::warnings(&catalog) {
        observer.event(Event::Warned(warning));
    }
    for (_, model) in catalog.iter() {
        observer.event(Event::Noted { stage: "catalogue", message: describe(model) });
    }
    Ok(catalog)
}

/// What an engineer checks against the drawing.
fn describe(model: &BlockModel) -> String {
    let c = model.centre;
    format!(
        "{}: {:.4} m³, {:.1} kg, largest edge {:.3} m, centre of mass ({:.3}, {:.3}, {:.3}) m, {} rotations map it onto itself, {} convex parts of {:.1} % of its volume",
        model.name,
        model.volume_m3,
        model.mass_kg(),
        model.d_box_m,
        c.x,
        c.y,
        c.z,
        model.symmetry.order(),
        model.parts.len(),
        100.0 * model.parts_volume_ratio
    )
}

/// A cloud, or what of it lies in the area; of a COPC only the tiles that touch it are read.
fn cloud(
    file: &Path,
    area: Option<&Area>,
    axes: AxisOrder,
    terminal: &Terminal,
) -> Result<RawCloud, Exit> {
    let Some(area) = area else { return io::points::read(file, terminal).or_bad_input() };
    area.check().or_bad_input()?;
    let [low, high] = area.corners(axes);
    let cloud = io::points::read_box(file, low, high, terminal).map_err(|e| match e {
        IoError::NoPoints { path } => Exit::bad_input(anyhow!(
            "{}: none of its points lies in the area (east {} to {}, north {} to {}); is the axis order right?",
            path.display(),
            area.west,
            area.east,
            area.south,
            area.north
        )),
        e => Exit::bad_input(e),
    })?;
    let message = format!("{}: {} points in the area", file.display(), cloud.len());
    terminal.event(Event::Noted { stage: "read", message });
    Ok(cloud)
}

/// Files of one survey each, as one local survey; columns other than the positions are dropped.
pub fn loose_survey(
    files: &[PathBuf],
    sensor: SensorKind,
    sensor_positions: &[[f64; 3]],
    area: Option<&Area>,
    terminal: &Terminal,
) -> Result<Survey, Exit> {
    let mut crs = String::new();
    let mut raw = Vec::new();
    for file in files {
        let cloud = cloud(file, area, AxisOrder::EastNorth, terminal)?;
        if let Some(code) = &cloud.crs {
            crs.clone_from(code);
        }
        let sensors = match sensor_positions {
            [] => cloud.sensor_positions,
            given => given.iter().copied().map(DVec3::from_array).collect(),
        };
        raw.push(RawSurvey {
            file: file.display().to_string(),
            position: cloud.position,
            line: cloud.line.unwrap_or_default(),
            sensor,
            sensor_position: sensors,
            vertical_offset_m: 0.0,
        });
    }
    local_survey(&raw, AxisOrder::EastNorth, &crs, "").or_bad_input()
}

/// Everything a site folder holds.
pub struct SiteInputs {
    /// The folder's files as written.
    pub site: io::site::Site,
    /// Block types.
    pub catalog: Catalog,
    /// All surveys in one local frame.
    pub survey: Survey,
    /// Size and hash of every input file as it was before it was read.
    pub hashes: BTreeMap<PathBuf, Entry>,
}

/// Reads a site folder: site.toml, its catalogue, its surveys.
pub fn site(folder: &Path, terminal: &Terminal) -> Result<SiteInputs, Exit> {
    let site = io::site::load(folder).or_bad_input()?;
    let hashed = |name: PathBuf| Ok((name.clone(), io::manifest::entry(&site.folder.join(name))?));
    let hashes =
        site.inputs().into_iter().map(hashed).collect::<Result<_, io::IoError>>().or_bad_input()?;
    let catalog = models(&site.catalog, &site.catalog_file, terminal)?;
    let survey = site_survey(&site, terminal)?;
    Ok(SiteInputs { site, catalog, survey, hashes })
}

fn site_survey(site: &io::site::Site, terminal: &Terminal) -> Result<Survey, Exit> {
    let mut raw = Vec::new();
    for (spec, file) in site.spec.survey.iter().zip(&site.survey_files) {
        let cloud = cloud(file, site.spec.area.as_ref(), site.spec.axis_order, terminal)?;
        let mut sensors: Vec<DVec3> = spec.sensors().map(DVec3::from_array).collect();
        if sensors.is_empty() {
            sensors = cloud.sensor_positions;
        }
        raw.push(RawSurvey {
            file: file.display().to_string(),
            position: cloud.position,
            line: cloud.line.unwrap_or_default(),
            sensor: spec.sensor,
            sensor_position: sensors,
            vertical_offset_m: spec.vertical_offset_m.unwrap_or(0.0),
        });
    }
    local_survey(&raw, site.spec.axis_order, &site.spec.crs, &site.spec.vertical_datum)
        .or_bad_input()
}

/// The design surface of a site, checked; `None` when it has none.
pub fn design(
    site: &io::site::Site,
    observer: &dyn Observer,
) -> Result<Option<DesignSurface>, Exit> {
    if let (Some(file), Some(spec)) = (&site.design_file, &site.spec.design_file) {
        return Ok(Some(
            io::design_file::read(file, spec.cell_m, site.spec.axis_order, observer)
                .or_bad_input()?,
        ));
    }
    let Some(design) = &site.spec.design else { return Ok(None) };
    design
        .check()
        .with_context(|| site.folder.join("site.toml").display().to_string())
        .or_bad_input()?;
    Ok(Some(design.clone()))
}

/// The bed as the site states it, in the local frame; `None`: to be estimated.
pub fn ground(site: &io::site::Site, survey: &Survey) -> Option<Ground> {
    let origin = survey.frame.origin;
    site.spec.ground.map(|ground| match ground {
        GroundSpec::Level { level_m } => Ground::Level { z_m: (level_m - origin[2]) as f32 },
        GroundSpec::Plane(plane) => {
            let (sin, cos) = plane.falls_towards_deg.to_radians().sin_cos();
            let normal =
                DVec3::new(sin / plane.slope_m, cos / plane.slope_m, 1.0).normalize().as_vec3();
            let point = DVec3::new(plane.point[0], plane.point[1], plane.level_m);
            Ground::Plane { point: survey.frame.local_from_site(point), normal }
        }
    })
}

/// A row of `blocks.csv` or `truth.csv` as a stated block.
pub fn recognised(
    row: &BlockRow,
    catalog: &Catalog,
    frame: &SiteFrame,
    file: &Path,
) -> Result<Recognised, Exit> {
    let model = catalog.find(&row.model).ok_or_else(|| {
        let known: Vec<_> = catalog.iter().map(|(_, m)| m.name.as_str()).collect();
        Exit::bad_input(anyhow!(
            "{}: block {} is a `{}`, but the catalogue has {}",
            file.display(),
            row.block_id,
            row.model,
            known.join(", ")
        ))
    })?;
    let second = row.runner_up.as_deref().and_then(|name| catalog.find(name));
    let fit = Fit {
        type_judged: row.type_judged.unwrap_or(true),
        confidence: row.confidence.map(|v| v as f32),
        fitness_m: row.fitness_m.map(|v| v as f32),
        runner_up: second.zip(row.runner_up_fitness_m.map(|v| v as f32)),
        occlusion: row.occlusion.map(|v| v as f32),
        ..Fit::of_pose(model, row.pose.local(frame))
    };
    Ok(Recognised::of_fit(InstanceId(row.block_id), Vec::new(), fit))
}
