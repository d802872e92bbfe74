//! The vocabulary: what the stages say to each other. Types and their invariants, no algorithms.
//!
//! Everything is in the site's local frame (f32 metres, z up) unless a name says `site`;
//! [`SiteFrame`] goes between local and projected coordinates.

pub mod catalog;
pub mod complaint;
pub mod design;
pub mod instance;
pub mod memory;
pub mod model;
pub mod name;
pub mod nominal;
pub mod pile;
pub mod plan;
pub mod point_mark;
pub mod quantity;
pub mod ratings;
pub mod recognised;
pub mod review;
pub mod same_block;
pub mod shape_signature;
pub mod site;
pub mod survey;
pub mod symmetry;

pub use catalog::{BlockSpec, CatalogSpec, LengthUnit, Shape};
pub use complaint::{Complaint, Severity};
pub use design::{DesignSurface, MOST_CORNERS, SlopingPlane};
pub use instance::{CentreHypothesis, InstanceId, LabelledCloud, Segmentation};
pub use memory::{MemoryBound, MemoryError};
pub use model::{BlockModel, Catalog, ConvexPart, MOST_PARTS_ERROR, ModelId};
pub use name::{LONGEST_NAME, NameError, check_name};
pub use nominal::{
    HOLLOW_TETRAHEDRON_VOLUME, NominalBlock, SIX_LEG_VOLUME, nominal_blocks, shape_of_name,
};
pub use pile::{Ground, PlacedBlock, Scene};
pub use plan::{Handling, PatternNode, Placement, PlacementState, Plan, PlanSummary, Reset};
pub use point_mark::{PointFlag, PointMark};
pub use quantity::{AreaVolume, SectionQuantity};
pub use ratings::{Better, BlockRating, RatedBlock, RatedPair, RatedPlace, Ratings, SIGNS};
pub use recognised::{Covariance, Fit, Guess, Legs, Recognised, Verdict, stated};
pub use review::{Decision, PlacementDecision, Review, ReviewedBlock, ReviewedPlacement};
pub use same_block::{PoseError, PoseLimits, PosedModel, is_right, same_block};
pub use shape_signature::ShapeSignature;
pub use site::{AlignmentFile, Area, DesignFile, GroundSpec, SiteError, SiteSpec, SurveySpec};
pub use survey::{AxisOrder, SensorKind, SiteFrame, Survey};
pub use symmetry::SymmetryGroup;
