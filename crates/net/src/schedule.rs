//! Learning rate: linear warm-up, then a cosine to almost nothing.

/// The rate at `step` of `steps`.
pub fn cosine_with_warmup(peak: f64, warmup: u64, step: u64, steps: u64) -> f64 {
    if step < warmup {
        return peak * (step + 1) as f64 / warmup as f64;
    }
    let part = (step - warmup) as f64 / (steps.saturating_sub(warmup)).max(1) as f64;
    let floor = 0.01;
    peak * (floor + (1.0 - floor) * 0.5 * (1.0 + (std::f64::consts::PI * part.min(1.0)).cos()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rises_then_falls() {
        let at = |s| cosine_with_warmup(1.0, 10, s, 110);
        assert!((at(0) - 0.1).abs() < 1e-12);
        assert!((at(10) - 1.0).abs() < 1e-12);
        assert!((at(60) - 0.505).abs() < 1e-9);
        assert!((at(110) - 0.01).abs() < 1e-9);
    }
}
