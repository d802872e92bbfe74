//! Which settings of a comparison make sense.

use crate::{CompareConfig, MonitorError};

/// Samples of a block's surface beyond which nothing more is seen, only time and memory are spent.
const MOST_SAMPLES: usize = 100_000;

impl CompareConfig {
    /// Refuses values with which a comparison would say nothing, or never end. Errors: [`MonitorError::BadSetting`], by key.
    pub fn check(&self) -> Result<(), MonitorError> {
        let Self { registration: r, matching: m, detection: d, single: s, breakage: b } = self;
        let positive = [
            ("registration.most_shift_m", r.most_shift_m),
            ("registration.most_turn_rad", r.most_turn_rad),
            ("registration.most_scale", r.most_scale),
            ("registration.cluster_blocks", r.cluster_blocks),
            ("matching.gate_blocks", m.gate_blocks),
            ("matching.rise_blocks", m.rise_blocks),
            ("matching.move_sd_blocks", m.move_sd_blocks),
            ("matching.alone", m.alone),
            ("detection.sunk_turn_rad", d.sunk_turn_rad),
            ("breakage.times_usual", b.times_usual),
        ];
        let not_negative = [
            ("detection.sunk_sideways", d.sunk_sideways),
            ("detection.least_margin", d.least_margin),
            ("single.unexplained_blocks2", f64::from(s.unexplained_blocks2)),
            ("breakage.least_patch_blocks2", f64::from(b.least_patch_blocks2)),
            ("breakage.least_face_blocks2", f64::from(b.least_face_blocks2)),
        ];
        let shares = [
            ("matching.moved_share", m.moved_share),
            ("detection.false_discovery", d.false_discovery),
            ("detection.least_confidence", d.least_confidence),
            ("single.through", s.through),
            ("single.still_there", s.still_there),
            ("single.partly", s.partly),
            ("single.room[0]", s.room[0]),
            ("single.room[1]", s.room[1]),
            ("single.through_despite_room", s.through_despite_room),
            ("breakage.least_rest", b.least_rest),
            ("breakage.least_cos", f64::from(b.least_cos)),
        ];
        let samples = [("single.samples", s.samples), ("breakage.samples", b.samples)];
        all(&positive, |v| v > 0.0 && v.is_finite(), "it must be a number above 0")?;
        all(&not_negative, |v| v >= 0.0 && v.is_finite(), "it must be a number from 0 on")?;
        all(&shares, |v| (0.0..=1.0).contains(&v), "it must lie between 0 and 1")?;
        let samples = samples.map(|(key, v)| (key, v as f64));
        all(&samples, |v| v >= 1.0 && v <= MOST_SAMPLES as f64, "it must lie between 1 and 100000")
    }
}

fn all(
    values: &[(&'static str, f64)],
    holds: impl Fn(f64) -> bool,
    why: &'static str,
) -> Result<(), MonitorError> {
    match values.iter().find(|(_, v)| !holds(*v)) {
        Some(&(key, value)) => Err(MonitorError::BadSetting { key, value, why }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BreakageConfig, MatchConfig};

    #[test]
    fn slips_are_named_and_the_defaults_hold() {
        assert_eq!(CompareConfig::default().check(), Ok(()));
        let said = |config: CompareConfig| config.check().unwrap_err().to_string();
        let matching = MatchConfig { gate_blocks: -1.0, ..MatchConfig::default() };
        let wrong = said(CompareConfig { matching, ..CompareConfig::default() });
        assert!(wrong.contains("matching.gate_blocks = -1"), "{wrong}");
        let breakage = BreakageConfig { samples: 4_000_000_000, ..BreakageConfig::default() };
        let wrong = said(CompareConfig { breakage, ..CompareConfig::default() });
        assert!(wrong.contains("breakage.samples"), "{wrong}");
    }
}
