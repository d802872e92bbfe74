//! A bin that is looked at again and again: weights and block types stay ready. One cloud in, the parts out in the order in
//! which to take them.

use crate::recognition::RecogniseOptions;
use crate::surveys::Clouds;
use crate::weights::{self, Chosen};
use crate::{Arrays, Error, Job, Result, Settings, arrays};
use anyhow::anyhow;
use geom::{MeshQuery, SeedTree, Vec3};
use pipeline::{Config, Recogniser, Recognition, Templates};
use rayon::prelude::*;
use scene::{Catalog, Fit, InstanceId, ModelId, Recognised, SiteFrame, Survey};

/// What stays from one cloud to the next.
///
/// ```no_run
/// # fn main() -> tsumu::Result<()> {
/// use tsumu::{Arrays, Bin, BinOptions, Job};
/// let (job, options) = (Job::silent(), BinOptions::default());
/// let catalog = tsumu::read_catalog("catalog.toml".as_ref(), &job)?;
/// let bin = Bin::new(&catalog, &options, &job)?;
/// for points in [vec![[0.0; 3]]] {
///     let seen = bin.look(Arrays { points, ..Arrays::default() }, &job)?;
///     println!("take {:?}", seen.grasps.first());
/// }
/// # Ok(()) }
/// ```
pub struct Bin<'a> {
    catalog: &'a Catalog,
    chosen: Chosen,
    config: Config,
    ready: Templates<'a>,
    surfaces: Vec<Surface>,
    seed: u64,
}

/// What a bin may be told.
#[derive(Clone, Debug, Default)]
pub struct BinOptions {
    /// Which weights.
    pub recognise: RecogniseOptions,
    /// Settings of all stages.
    pub settings: Settings,
}

/// A part that may be taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    /// Number of the part in what was recognised.
    pub block: InstanceId,
    /// Type.
    pub model: ModelId,
    /// Pose, confidence, occlusion; local frame.
    pub fit: Fit,
    /// Share of its surface towards the sensor with no other part over it, in [0, 1].
    pub free: f32,
}

/// What was seen in one cloud.
#[derive(Clone, Debug)]
pub struct BinLook {
    /// The frame of all poses.
    pub frame: SiteFrame,
    /// The stated parts, that to take first at the front: by free share × confidence, then by height.
    pub grasps: Vec<Grasp>,
    /// Everything recognised, places not judged included.
    pub blocks: Vec<Recognised>,
}

/// A type's surface: samples with their normals, and whom a ray meets; block coordinates.
struct Surface {
    samples: Vec<(Vec3, Vec3)>,
    query: MeshQuery,
}

/// Samples of a type's surface: steps of a percent or so of what is free.
const SAMPLES: usize = 300;
/// A sample looks towards the sensor if the cosine between the two is larger.
const TOWARDS: f32 = 0.3;

impl<'a> Bin<'a> {
    /// Reads the weights and makes the types ready: seconds, once. Errors: weights or a mesh that cannot be used.
    pub fn new(catalog: &'a Catalog, options: &BinOptions, job: &Job) -> Result<Self> {
        let config = options.settings.alone()?;
        let chosen = weights::choose(options.recognise.weights.as_deref(), catalog, job)?;
        let ready = Templates::new(catalog, &config.pose).map_err(pipeline::PipelineError::from)?;
        let surface = |(id, model): (ModelId, &scene::BlockModel)| -> Result<Surface> {
            let mut rng = SeedTree::new(0).child("bin", u64::from(id.0)).rng();
            let samples = model.mesh.sample_surface(SAMPLES, &mut rng);
            let query = MeshQuery::new(&model.mesh).map_err(Error::bad_input)?;
            Ok(Surface { samples, query })
        };
        let surfaces = catalog.iter().map(surface).collect::<Result<Vec<_>>>()?;
        let seed = options.settings.seed.unwrap_or_default();
        Ok(Self { catalog, chosen, config, ready, surfaces, seed })
    }

    /// Its types.
    pub fn catalog(&self) -> &Catalog {
        self.catalog
    }

    /// Looks at a cloud in memory. Errors: columns that do not fit, a cloud in which the parts cannot lie.
    pub fn look(&self, cloud: Arrays, job: &Job) -> Result<BinLook> {
        if cloud.design.is_some() || cloud.ground.is_some() {
            return Err(Error::bad_input(anyhow!("a bin has no design and no ground of its own")));
        }
        self.look_at(&arrays::survey_of(cloud)?, job)
    }

    /// Looks at a cloud of a file, or of several.
    pub fn look_at_files(&self, clouds: &Clouds, job: &Job) -> Result<BinLook> {
        self.look_at(&clouds.survey(job)?.survey, job)
    }

    fn look_at(&self, survey: &Survey, job: &Job) -> Result<BinLook> {
        let recogniser = Recogniser {
            catalog: self.catalog,
            model: &self.chosen.model,
            config: &self.config,
            seed: SeedTree::new(self.seed),
            observer: job,
        };
        job.install(|| {
            let segments = recogniser.foreground_segments(survey)?;
            let found: Recognition = recogniser.blocks_with(survey, segments, Some(&self.ready))?;
            let grasps = self.grasps(&found.blocks, survey);
            Ok(BinLook { frame: survey.frame.clone(), grasps, blocks: found.blocks })
        })
    }

    /// The stated parts in the order in which to take them.
    fn grasps(&self, blocks: &[Recognised], survey: &Survey) -> Vec<Grasp> {
        let stated: Vec<(&Recognised, &Fit)> = scene::stated(blocks).collect();
        let one = |k: usize| {
            let (block, fit) = stated[k];
            Grasp {
                block: block.block,
                model: fit.model,
                fit: fit.clone(),
                free: self.free(k, &stated, survey),
            }
        };
        let mut grasps: Vec<Grasp> = (0..stated.len()).into_par_iter().map(one).collect();
        let worth = |g: &Grasp| g.free * g.fit.confidence.unwrap_or(0.0);
        let height_m = |g: &Grasp| g.fit.centre(self.catalog.get(g.model)).z;
        grasps.sort_by(|a, b| {
            let by_worth = worth(b).total_cmp(&worth(a));
            by_worth.then(height_m(b).total_cmp(&height_m(a))).then(a.block.0.cmp(&b.block.0))
        });
        grasps
    }

    /// Share of the surface towards the sensor with no other part over it.
    fn free(&self, own: usize, stated: &[(&Recognised, &Fit)], survey: &Survey) -> f32 {
        let fit = stated[own].1;
        let model = self.catalog.get(fit.model);
        let centre = fit.centre(model);
        let up = towards(centre, survey);
        let reach_m = |f: &Fit| self.catalog.get(f.model).d_max_m;
        // Another part is over this one only if its ball meets the tube of this one's ball.
        let over: Vec<&Fit> = (0..stated.len())
            .filter(|&k| k != own)
            .map(|k| stated[k].1)
            .filter(|f| {
                let away = f.centre(self.catalog.get(f.model)) - centre;
                let height_m = away.dot(up);
                let reach_m = reach_m(f) + model.d_max_m;
                height_m > -reach_m && (away - up * height_m).length() < reach_m
            })
            .collect();
        let surface = &self.surfaces[usize::from(fit.model.0)];
        let facing = surface.samples.iter().filter_map(|(p, n)| {
            let normal = fit.site_from_block.rotation * *n;
            (normal.dot(up) > TOWARDS).then(|| fit.site_from_block * *p)
        });
        let (mut open, mut all) = (0, 0);
        for place in facing {
            all += 1;
            open += usize::from(!over.iter().any(|f| self.covers(f, place, up)));
        }
        if all == 0 { 0.0 } else { open as f32 / all as f32 }
    }

    /// Whether a part lies on the way from a place towards the sensor.
    fn covers(&self, fit: &Fit, place: Vec3, up: Vec3) -> bool {
        let block_from_site = fit.site_from_block.inverse();
        let far_m = 4.0 * self.catalog.d_max_m();
        let (from, along) = (block_from_site * place, block_from_site.rotation * up);
        self.surfaces[usize::from(fit.model.0)].query.cast_ray(from, along, far_m).is_some()
    }
}

/// The direction from a place to the nearest sensor; straight up where none is known.
fn towards(place: Vec3, survey: &Survey) -> Vec3 {
    let away = |s: &Vec3| (*s - place).length();
    let nearest = survey.sensor_positions.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.map_or(Vec3::Z, |s| (*s - place).normalize_or(Vec3::Z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::{Pose, Quat, Silent};
    use std::collections::BTreeMap;

    #[test]
    fn what_lies_on_top_is_taken_first() {
        let spec = r#"{"block":[{"name":"cube","shape":{"kind":"cube","size":1.0}}]}"#;
        let spec = serde_json::from_str(spec).unwrap();
        let catalog = arrays::catalog_of(&spec, &BTreeMap::new(), None, &Silent).unwrap();
        let job = Job::silent();
        let bin = Bin::new(&catalog, &BinOptions::default(), &job).unwrap();
        let cube = |id: u32, at: [f32; 3], confidence: f32| {
            let pose = Pose::from_parts(Vec3::from_array(at), Quat::IDENTITY);
            let fit = Fit { confidence: Some(confidence), ..Fit::of_pose(ModelId(0), pose) };
            Recognised::of_fit(InstanceId(id), Vec::new(), fit)
        };
        // 1 lies under 2 whole, 3 under 4 by half, 5 alone and doubtful.
        let blocks = [
            cube(1, [0.0, 0.0, 0.0], 1.0),
            cube(2, [0.0, 0.0, 1.01], 1.0),
            cube(3, [5.0, 0.0, 0.0], 1.0),
            cube(4, [5.5, 0.0, 1.01], 0.9),
            cube(5, [9.0, 0.0, 0.0], 0.3),
        ];
        let grasps = bin.grasps(&blocks, &Survey::default());
        let order: Vec<u32> = grasps.iter().map(|g| g.block.0).collect();
        assert_eq!(order, [2, 4, 3, 5, 1]);
        let free = |id: u32| grasps.iter().find(|g| g.block.0 == id).unwrap().free;
        assert!(free(1) == 0.0 && free(2) == 1.0 && (free(3) - 0.5).abs() < 0.1, "{grasps:?}");
    }
}
