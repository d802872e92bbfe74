//! Why two epochs cannot be compared.

/// Names what is wrong, the value and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MonitorError {
    /// Different coordinate reference systems.
    #[error(
        "the earlier epoch is in `{earlier}`, the later one in `{later}`; transform one survey so that both sites name the same crs"
    )]
    OtherCrs {
        /// Of the earlier epoch.
        earlier: String,
        /// Of the later one.
        later: String,
    },
    /// A survey without points.
    #[error("the {epoch} epoch holds no points; there is nothing to compare")]
    NoPoints {
        /// `earlier` or `later`.
        epoch: &'static str,
    },
    /// The named stable ground lies elsewhere.
    #[error(
        "the stable ground holds {points} points of the {epoch} survey, {least} are needed; check its polygons' coordinates (east, north of the site), or leave it out"
    )]
    NoStableGround {
        /// `earlier` or `later`.
        epoch: &'static str,
        /// Points within the polygons.
        points: usize,
        /// Points needed.
        least: usize,
    },
    /// The surveys lie apart.
    #[error(
        "the two surveys do not overlap: {gap_m:.0} m lie between them; check that both are of the same place and in the same coordinates"
    )]
    NoOverlap {
        /// Distance of their bounds, metres.
        gap_m: f64,
    },
    /// The surveys differ by more than a datum may.
    #[error(
        "the later survey lies {what} {value:.3} {unit} off the earlier one, more than {limit:.3} {unit}; correct its coordinates, or raise registration.{key}"
    )]
    TooFarOff {
        /// shifted, turned or scaled by.
        what: &'static str,
        /// How much.
        value: f64,
        /// Unit of value and limit.
        unit: &'static str,
        /// What is allowed.
        limit: f64,
        /// The key.
        key: &'static str,
    },
    /// The blocks of both epochs have nothing in common.
    #[error(
        "only {agreeing} of {blocks} blocks agree on where the later survey lies; are both surveys of the same place? `--fixed` compares without registration"
    )]
    NoCommonBlocks {
        /// Blocks that agree.
        agreeing: usize,
        /// Blocks of the smaller epoch.
        blocks: usize,
    },
    /// The blocks of a plan are of another catalogue, or a model is missing.
    #[error(
        "block {block} is of model {model}, but the catalogue has {known}; compare epochs of one catalogue"
    )]
    UnknownModel {
        /// The block.
        block: u32,
        /// Its model.
        model: u16,
        /// Models there are.
        known: usize,
    },
    /// A setting out of range.
    #[error("{key} = {value} is not allowed: {why}")]
    BadSetting {
        /// The key.
        key: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        why: &'static str,
    },
    /// The assignment failed: a bug.
    #[error("the assignment of {blocks} blocks has no solution; please report this")]
    Assignment {
        /// Blocks of the component.
        blocks: usize,
    },
    /// The observer asked to stop.
    #[error("stopped")]
    Stopped,
}
