//! The roll-up along the structure: counts, sinking, crest, section and grade of each span.
//!
//! Damage numbers are those of the literature (van der Meer 1988, Rock Manual 2007): with Dn the cube root of a block's volume,
//! N_od = displaced blocks · Dn / length, a block being displaced when it is gone or moved by more than one Dn; S = eroded
//! section area / Dn².

use crate::change::{Change, Class};
use crate::compare::Comparison;
use crate::grades::{Grade, GradeRules, Indicators};
use crate::heights::Heights;
use geom::{DVec3, Vec3};
use scene::{Catalog, DesignSurface, SiteFrame};
use serde::{Deserialize, Serialize};

/// How the structure is cut and graded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpanConfig {
    /// Length of a span along the alignment, metres.
    pub span_m: f64,
    /// Cell of the height grids, in block lengths.
    pub cell_blocks: f32,
    /// A block counts as displaced from this many Dn on.
    pub displaced_dn: f64,
    /// Alignment that chainage runs along, site coordinates (east, north); empty: that of the design, else the longest axis
    /// of the blocks.
    pub alignment: Vec<[f64; 2]>,
    /// When a span gets which grade.
    pub grades: GradeRules,
}

impl Default for SpanConfig {
    fn default() -> Self {
        Self {
            span_m: 10.0,
            cell_blocks: 0.12,
            displaced_dn: 1.0,
            alignment: Vec::new(),
            grades: GradeRules::default(),
        }
    }
}

/// One span. Lengths in metres, areas and volumes in m² and m³.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Span {
    /// Chainage where it begins and ends.
    pub chainage_m: [f64; 2],
    /// Blocks of each class, in the order of [`Class::ALL`].
    pub counts: [usize; 9],
    /// Median change of height of the blocks seen in both epochs; `None` without such blocks.
    pub height_change_m: Option<f64>,
    /// Level of detection of it: what registration and sensors leave open for all blocks together.
    pub height_level_m: f64,
    /// Height that the highest twentieth of the surface exceeds, earlier and later, site datum.
    pub crest_m: Option<[f64; 2]>,
    /// Volume lost and gained beyond the level of each cell.
    pub lost_m3: f64,
    /// Gained.
    pub gained_m3: f64,
    /// What registration leaves open of either.
    pub volume_level_m3: f64,
    /// Section below the design, earlier and later, m² (per metre of length); `None` without a design.
    pub below_design_m2: Option<[f64; 2]>,
    /// Section above the design.
    pub above_design_m2: Option<[f64; 2]>,
    /// Displaced blocks in a strip one Dn wide.
    pub n_od: f64,
    /// Damage level.
    pub s: f64,
    /// The grade and what gave it.
    pub grade: Grade,
    /// Why.
    pub reason: String,
}

/// Rolls a comparison up. `frame` is the earlier survey's, `earlier` its points.
pub fn spans(
    comparison: &Comparison,
    earlier: &[Vec3],
    frame: &SiteFrame,
    catalog: &Catalog,
    design: Option<&DesignSurface>,
    config: &SpanConfig,
) -> Vec<Span> {
    let axis = Axis::of(comparison, frame, design, config);
    let size_m = catalog.iter().map(|(_, m)| m.d_box_m).fold(0.0, f32::max);
    let cell_m = config.cell_blocks * size_m;
    let heights = Heights::of(earlier, &comparison.later_points, cell_m);
    let chainages: Vec<Option<f64>> =
        comparison.changes.iter().map(|c| axis.chainage_m(centre(c))).collect();
    let known = || chainages.iter().flatten().copied().filter(|v| v.is_finite());
    let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(0.0, f64::max));
    if !low.is_finite() {
        return Vec::new();
    }
    let first = (low / config.span_m).floor() as i64;
    let last = (high / config.span_m).floor() as i64;
    let input =
        Input { comparison, frame, catalog, design, config, axis: &axis, heights: &heights };
    let of = |k: i64| {
        let members: Vec<&Change> = comparison
            .changes
            .iter()
            .zip(&chainages)
            .filter(|(_, s)| s.is_some_and(|s| (s / config.span_m).floor() as i64 == k))
            .map(|(c, _)| c)
            .collect();
        input.span(k, &members)
    };
    (first..=last).map(of).collect()
}

fn centre(change: &Change) -> Vec3 {
    change.centre_earlier.or(change.centre_later).expect("a block is seen in one epoch at least")
}

struct Input<'a> {
    comparison: &'a Comparison,
    frame: &'a SiteFrame,
    catalog: &'a Catalog,
    design: Option<&'a DesignSurface>,
    config: &'a SpanConfig,
    axis: &'a Axis,
    heights: &'a Heights,
}

impl Input<'_> {
    fn span(&self, k: i64, members: &[&Change]) -> Span {
        let length_m = self.config.span_m;
        let chainage_m = [k as f64 * length_m, (k + 1) as f64 * length_m];
        let counts = Class::ALL.map(|class| members.iter().filter(|c| c.class == class).count());
        let cells: Vec<usize> = (0..self.heights.cells())
            .filter(|&i| {
                let at = self.axis.chainage_m(self.heights.place(i));
                at.is_some_and(|s| (s / length_m).floor() as i64 == k)
            })
            .collect();
        let registration = &self.comparison.reference;
        let height_level_m =
            1.96 * registration.sd()[2].hypot(self.comparison.common_error.height_sd_m);
        let volume = self.heights.volumes(&cells, height_level_m);
        let both: Vec<f64> = members
            .iter()
            .filter(|c| c.earlier_id.is_some() && c.later_id.is_some())
            .map(|c| c.shift_m[2])
            .collect();
        let height_change_m = median(both);
        let dn_m = self.dn_m(members);
        let displaced = members.iter().filter(|c| self.is_displaced(c, dn_m)).count();
        let n_od = displaced as f64 * dn_m / length_m;
        let s = volume.lost_m3 / length_m / (dn_m * dn_m);
        let against = self.design.map(|d| self.against_design(d, &cells, length_m));
        let area_m2 = volume.area_m2;
        let (grade, reason) = self.config.grades.grade(&Indicators {
            lost_layers: if area_m2 > 0.0 { volume.lost_m3 / area_m2 / dn_m } else { 0.0 },
            gone_share: share(members, &[Class::Missing, Class::PossiblyBroken]),
            moved_share: share(members, &[Class::Moved, Class::Turned, Class::Sunk]),
            sinking_layers: height_change_m
                .filter(|h| -h > height_level_m)
                .map_or(0.0, |h| -h / dn_m),
        });
        Span {
            chainage_m,
            counts,
            height_change_m,
            height_level_m,
            crest_m: self.heights.crest(&cells).map(|c| c.map(|z| z + self.frame.origin[2])),
            lost_m3: volume.lost_m3,
            gained_m3: volume.gained_m3,
            volume_level_m3: area_m2 * 1.96 * registration.sd()[2],
            below_design_m2: against.map(|a| a.0),
            above_design_m2: against.map(|a| a.1),
            n_od,
            s,
            grade,
            reason,
        }
    }

    /// Mean cube root of the volume of the span's blocks, of the catalogue's first block where there are none.
    fn dn_m(&self, members: &[&Change]) -> f64 {
        let dn = |c: &&Change| f64::from(self.catalog.get(c.model).volume_m3).cbrt();
        if members.is_empty() {
            return self.catalog.iter().next().map_or(1.0, |(_, m)| f64::from(m.volume_m3).cbrt());
        }
        members.iter().map(dn).sum::<f64>() / members.len() as f64
    }

    fn is_displaced(&self, change: &Change, dn_m: f64) -> bool {
        change.class == Class::Missing
            || (matches!(change.class, Class::Moved | Class::Sunk)
                && change.distance_m > self.config.displaced_dn * dn_m)
    }

    /// Section below and above the design in both epochs, m².
    fn against_design(
        &self,
        design: &DesignSurface,
        cells: &[usize],
        length_m: f64,
    ) -> ([f64; 2], [f64; 2]) {
        let (mut below, mut above) = ([0.0; 2], [0.0; 2]);
        let area_m2 = f64::from(self.heights.cell_m()).powi(2);
        for &i in cells {
            let Some(z) = self.heights.both(i) else { continue };
            let at = self.frame.site_from_local(self.heights.place(i));
            let Some(level) = design.level_at(at.x, at.y) else { continue };
            for (e, z) in z.into_iter().enumerate() {
                let gap = level - (f64::from(z) + self.frame.origin[2]);
                below[e] += gap.max(0.0) * area_m2 / length_m;
                above[e] += (-gap).max(0.0) * area_m2 / length_m;
            }
        }
        (below, above)
    }
}

fn share(members: &[&Change], classes: &[Class]) -> f64 {
    let there = members.iter().filter(|c| c.earlier_id.is_some()).count();
    let some = members.iter().filter(|c| classes.contains(&c.class)).count();
    if there == 0 { 0.0 } else { some as f64 / there as f64 }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The line that chainage runs along, earlier epoch's local frame.
struct Axis {
    points: Vec<DVec3>,
}

impl Axis {
    fn of(
        comparison: &Comparison,
        frame: &SiteFrame,
        design: Option<&DesignSurface>,
        config: &SpanConfig,
    ) -> Self {
        let given = match (config.alignment.as_slice(), design) {
            ([], Some(DesignSurface::Section { alignment, .. })) => alignment.as_slice(),
            (alignment, _) => alignment,
        };
        let origin = DVec3::from_array(frame.origin);
        let flat = |p: &[f64; 2]| (DVec3::new(p[0], p[1], 0.0) - origin).with_z(0.0);
        if given.len() >= 2 {
            return Self { points: given.iter().map(flat).collect() };
        }
        let centres: Vec<DVec3> =
            comparison.changes.iter().map(|c| centre(c).as_dvec3().with_z(0.0)).collect();
        let n = centres.len().max(1) as f64;
        let mean = centres.iter().sum::<DVec3>() / n;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for c in &centres {
            let d = *c - mean;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let along = |c: &DVec3| (*c - mean).dot(direction);
        let low = centres.iter().map(along).fold(0.0, f64::min);
        let high = centres.iter().map(along).fold(0.0, f64::max);
        Self { points: vec![mean + direction * (low - 1e-6), mean + direction * (high + 1e-3)] }
    }

    /// Chainage of the nearest place of the line; the first and last piece go on beyond its ends.
    fn chainage_m(&self, p: Vec3) -> Option<f64> {
        let p = p.as_dvec3().with_z(0.0);
        let (mut best, mut start) = (None::<(f64, f64)>, 0.0);
        let last = self.points.len() - 2;
        for (i, ends) in self.points.windows(2).enumerate() {
            let (d, length) = (ends[1] - ends[0], (ends[1] - ends[0]).length());
            if length == 0.0 {
                continue;
            }
            let t = (p - ends[0]).dot(d) / (length * length);
            let t = t.clamp(if i == 0 { t } else { 0.0 }, if i == last { t.max(0.0) } else { 1.0 });
            let away = (p - ends[0] - d * t).length();
            if best.is_none_or(|(b, _)| away < b) {
                best = Some((away, start + t * length));
            }
            start += length;
        }
        best.map(|b| b.1)
    }
}
