//! How dense a pile is: porosity of the bulk, blocks per area, and the handbook formula that cross-checks a count.

/// Share of the bulk volume that is not concrete; `None` without bulk.
pub fn porosity(solid_m3: f64, bulk_m3: f64) -> Option<f64> {
    (bulk_m3 > 0.0).then(|| 1.0 - solid_m3 / bulk_m3)
}

/// Blocks on a square metre of slope; `None` without area.
pub fn packing_density_per_m2(blocks: usize, area_m2: f64) -> Option<f64> {
    (area_m2 > 0.0).then(|| blocks as f64 / area_m2)
}

/// The count a handbook expects: N = φ·A·V^(−2/3) with φ = n·k_Δ·(1 − P), `layers` n, layer coefficient k_Δ and
/// porosity P.
pub fn expected_blocks(
    area_m2: f64,
    volume_m3: f64,
    layers: f64,
    layer_coefficient: f64,
    porosity: f64,
) -> f64 {
    layers * layer_coefficient * (1.0 - porosity) * area_m2 * volume_m3.powf(-2.0 / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        assert_eq!(porosity(50.0, 100.0), Some(0.5));
        assert_eq!(porosity(1.0, 0.0), None);
        assert_eq!(packing_density_per_m2(30, 60.0), Some(0.5));
        // Two layers of 8 m³ tetrapods, k = 1.04, P = .5: φ = 1.04, N = 1.04 · 100 / 4 = 26.
        assert!((expected_blocks(100.0, 8.0, 2.0, 1.04, 0.5) - 26.0).abs() < 1e-9);
    }
}
