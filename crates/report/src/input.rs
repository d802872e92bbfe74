//! What a report shows. Everything is computed elsewhere.

use crate::Text;
use geom::{HeightMap, Pose, Vec2, Vec3, Warning};
use scene::{Catalog, ModelId, Plan, Ratings, Recognised, Review, SIGNS, Survey};

/// The content of one report. Start from [`ReportInput::new`] and fill in what there is.
#[derive(Clone, Debug)]
pub struct ReportInput<'a> {
    /// Heading: the site's name.
    pub title: String,
    /// Name and version of the program.
    pub program: String,
    /// Points and frame.
    pub survey: &'a Survey,
    /// Block types.
    pub catalog: &'a Catalog,
    /// Blocks found.
    pub recognised: &'a [Recognised],
    /// The review that the blocks apply: the page's own goes on from it.
    pub review: Option<&'a Review>,
    /// Blocks to add, if planned.
    pub plan: Option<&'a Plan>,
    /// Distance of each survey point from the surface of its block, metres; NaN where it has none; or empty.
    pub point_fit_m: &'a [f32],
    /// Distance of each survey point below (+) or above (−) the design, metres; NaN where nothing is designed; or empty.
    pub point_distance_m: &'a [f32],
    /// How many blocks the works need.
    pub count: Option<Count>,
    /// Whether a plan on ground without a recognised block was asked for: only then does such a plan state a count.
    pub bare_ground: bool,
    /// How far the answer may be trusted, most important first; empty: judged by the input's own figures
    /// ([`crate::lights`]).
    pub lights: Vec<Light>,
    /// Day of the survey as it is to be printed, or empty.
    pub survey_date: String,
    /// Key figures, most important first.
    pub figures: Vec<Figure>,
    /// Lines on the plan view and in 3D: design outline, boundary, alignment.
    pub outlines: Vec<Outline>,
    /// Design, survey and plan as height maps: what free sections, areas and volumes are measured on.
    pub surfaces: Option<Surfaces<'a>>,
    /// The line sections stand on; without it the page has only the sections in `sections`.
    pub alignment: Option<Alignment>,
    /// Places that stay below the design, and why.
    pub unfilled: Vec<UnfilledWindow>,
    /// What a foreman may rate; `None`: no plan, or none of policy `search`.
    pub rating: Option<Rating<'a>>,
    /// Heat maps: deficit before and after, distance.
    pub maps: Vec<MapLayer<'a>>,
    /// Cross-sections.
    pub sections: Vec<Section>,
    /// Distributions: fit error, confidence, distance to the design.
    pub histograms: Vec<Histogram>,
    /// What was assumed.
    pub assumptions: Vec<Text>,
    /// What went wrong without stopping the run.
    pub warnings: Vec<Warning>,
    /// Names and values that identify the run: seed, hash of the manifest, model card.
    pub provenance: Vec<(Text, String)>,
    /// Most points the 3D view holds; more are thinned evenly, and the page says so.
    pub max_points: usize,
}

impl<'a> ReportInput<'a> {
    /// A report of a survey alone.
    pub fn new(title: impl Into<String>, survey: &'a Survey, catalog: &'a Catalog) -> Self {
        Self {
            title: title.into(),
            program: String::new(),
            survey,
            catalog,
            recognised: &[],
            review: None,
            plan: None,
            point_fit_m: &[],
            point_distance_m: &[],
            count: None,
            bare_ground: false,
            lights: Vec::new(),
            survey_date: String::new(),
            figures: Vec::new(),
            outlines: Vec::new(),
            surfaces: None,
            alignment: None,
            unfilled: Vec::new(),
            rating: None,
            maps: Vec::new(),
            sections: Vec::new(),
            histograms: Vec::new(),
            assumptions: Vec::new(),
            warnings: Vec::new(),
            provenance: Vec::new(),
            max_points: 2_000_000,
        }
    }
}

/// The number of blocks to order, with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Count {
    /// The plan's number.
    pub blocks: u32,
    /// Tenth and ninetieth percentile over repeated plans, when computed.
    pub p10_p90: Option<(u32, u32)>,
    /// How the range was obtained, or why there is none.
    pub basis: Text,
}

/// How far one side of the answer may be trusted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Light {
    /// What is judged, e.g. recognition.
    pub name: Text,
    /// The judgement.
    pub state: LightState,
    /// Why, with the figure that decided.
    pub reason: Text,
}

/// The four answers of a [`Light`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightState {
    /// Can be relied on.
    Good,
    /// Read the reason first.
    Fair,
    /// Not to be relied on.
    Bad,
    /// Nobody looked.
    Unknown,
}

/// Height maps of the works, local frame.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<'a> {
    /// The design; NaN outside the works.
    pub design: Option<&'a HeightMap>,
    /// As surveyed.
    pub surveyed: Option<&'a HeightMap>,
    /// With the plan's blocks.
    pub planned: Option<&'a HeightMap>,
    /// What the blocks lie on.
    pub ground: Option<&'a HeightMap>,
}

/// The line that chainages run along.
#[derive(Clone, Debug, PartialEq)]
pub struct Alignment {
    /// Its corners, local frame; at least two.
    pub line: Vec<Vec2>,
    /// How far sections reach left and right of it, metres.
    pub reach_m: [f32; 2],
    /// From section to section, metres; `None`: a round number near a twelfth of its length.
    pub spacing_m: Option<f32>,
}

/// A square place that stays below the design.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfilledWindow {
    /// Its middle, local frame.
    pub centre: Vec2,
    /// Half its edge, metres.
    pub half_m: f32,
    /// Volume missing in it, m³.
    pub void_m3: f32,
    /// Why no block went there; places of the same words share a colour.
    pub reason: Text,
}

/// What the page asks people who build.
#[derive(Clone, Debug)]
pub struct Rating<'a> {
    /// Name of the site, as `ratings.json` has it.
    pub site: &'a str,
    /// Signs of every placement of the plan, in its order.
    pub signs: Vec<[f32; SIGNS.len()]>,
    /// Two places for a block, of which one may be chosen.
    pub pairs: Vec<[RatingPlace; 2]>,
    /// What was said before.
    pub given: Option<&'a Ratings>,
    /// Weights that it moved.
    pub weights: Vec<RatingWeight>,
}

/// A weight before and after learning.
#[derive(Clone, Debug, PartialEq)]
pub struct RatingWeight {
    /// Its sign, one of [`SIGNS`].
    pub sign: String,
    /// Before.
    pub today: f32,
    /// After, and its standard deviation.
    pub learned: [f32; 2],
    /// Ratings that made it larger, and smaller.
    pub moved_by: [u32; 2],
}

/// Where a block could go.
#[derive(Clone, Copy, Debug)]
pub struct RatingPlace {
    /// Its type.
    pub model: ModelId,
    /// Pose at rest, local frame.
    pub pose: Pose,
    /// Its signs.
    pub signs: [f32; SIGNS.len()],
}

/// A number with its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What it is.
    pub label: Text,
    /// The value as it is to be printed.
    pub value: String,
    /// Unit, or empty.
    pub unit: String,
    /// Where it comes from, or empty.
    pub note: Text,
}

impl Figure {
    /// The same with what it means.
    pub fn with_note(self, note: Text) -> Self {
        Self { note, ..self }
    }

    /// A figure without a note.
    pub fn new(label: Text, value: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label, value: value.into(), unit: unit.into(), note: Text::default() }
    }
}

/// A line in space, local frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// What it is.
    pub label: Text,
    /// Its corners.
    pub points: Vec<Vec3>,
    /// Whether the last joins the first.
    pub closed: bool,
}

/// A raster to show on the plan view.
#[derive(Clone, Debug)]
pub struct MapLayer<'a> {
    /// What it shows.
    pub label: Text,
    /// Unit of the values.
    pub unit: String,
    /// Values; NaN is left blank.
    pub values: &'a HeightMap,
}

/// A vertical cut through the site.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Its name, e.g. the chainage `No.3+12.0`.
    pub label: Text,
    /// Where it runs in plan, local frame.
    pub from: Vec2,
    /// Its other end.
    pub to: Vec2,
    /// What is cut.
    pub lines: Vec<SectionLine>,
}

/// One line of a section.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionLine {
    /// What it is.
    pub kind: SectionLineKind,
    /// (offset along the section, level in the site's datum), metres; NaN breaks the line.
    pub points: Vec<[f32; 2]>,
}

/// The lines a section knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SectionLineKind {
    /// The design surface.
    Design,
    /// The surface as surveyed.
    AsIs,
    /// The surface after the plan.
    Planned,
    /// What the blocks lie on.
    Ground,
}

/// Values to show as a histogram.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// What they are.
    pub label: Text,
    /// Their unit.
    pub unit: String,
    /// The values; those that are not numbers are left out and counted beside the bars.
    pub values: Vec<f32>,
}
