//! The share of a block nobody sees (Eq. 3.14).

/// 1 − visible model points / all model points; 1 for a model without points.
pub fn occlusion_rate(visible: usize, all: usize) -> f32 {
    if all == 0 { 1.0 } else { 1.0 - visible.min(all) as f32 / all as f32 }
}

#[cfg(test)]
mod tests {
    use super::occlusion_rate;

    #[test]
    fn by_hand() {
        assert_eq!(occlusion_rate(25, 100), 0.75);
        assert_eq!(occlusion_rate(0, 0), 1.0);
    }
}
