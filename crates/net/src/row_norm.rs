//! Layer normalisation of rows with the same sums on every processor, and the relu after it.
//!
//! In: rows of `c` numbers, gain and bias. Out: relu((x − mean) / sd · gain + bias). The deep-learning library adds a row in as many
//! partial sums as a register of the machine has places, so that the last digit of a pose followed from the machine. Here
//! there are sixteen partial sums everywhere, whether they fill one register, two or four, and they are added in one order.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Partial sums: the places of the widest register.
const SUMS: usize = 16;
/// Rows a thread works on at a time.
const ROWS: usize = 64;

/// Weights of the normalisation.
#[derive(Clone, Copy, Debug)]
pub struct NormWeights<'a> {
    /// `[c]`.
    pub gain: &'a [f32],
    /// `[c]`.
    pub bias: &'a [f32],
    /// Added to the variance.
    pub epsilon: f32,
}

/// Normalises rows `[n, c]` in place. Runs on the current rayon pool.
pub fn normalise(rows: &mut [f32], weights: NormWeights<'_>) {
    let c = weights.gain.len();
    assert!(
        weights.bias.len() == c && rows.len().is_multiple_of(c.max(1)),
        "rows of one number a gain"
    );
    let arch = pulp::Arch::new();
    rows.par_chunks_mut(ROWS * c).for_each(|rows| arch.dispatch(Normalise { rows, weights }));
}

struct Normalise<'a> {
    rows: &'a mut [f32],
    weights: NormWeights<'a>,
}

impl WithSimd for Normalise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let NormWeights { gain, bias, epsilon } = self.weights;
        let c = gain.len();
        for row in self.rows.chunks_exact_mut(c) {
            let mean = sum(simd, row, |simd, sum, x| simd.add_f32s(sum, x), |x| x) / c as f32;
            let off = simd.splat_f32s(mean);
            let squares = sum(
                simd,
                row,
                |simd, sum, x| {
                    let d = simd.sub_f32s(x, off);
                    simd.mul_add_e_f32s(d, d, sum)
                },
                |x| (x - mean) * (x - mean),
            );
            let inverse_sd = 1.0 / (squares / c as f32 + epsilon).sqrt();
            for ((x, g), b) in row.iter_mut().zip(gain).zip(bias) {
                let y = (*x - mean) * (inverse_sd * g) + b;
                *x = if y > 0.0 { y } else { 0.0 };
            }
        }
    }
}

/// Sum over a row: whole groups of sixteen side by side, then across, then the rest one by one.
#[inline(always)]
fn sum<S: Simd>(
    simd: S,
    row: &[f32],
    add: impl Fn(S, S::f32s, S::f32s) -> S::f32s,
    of_rest: impl Fn(f32) -> f32,
) -> f32 {
    let mut partial = [simd.splat_f32s(0.0); SUMS];
    let groups = row.chunks_exact(SUMS);
    let rest = groups.remainder();
    for group in groups {
        let (registers, _) = S::as_simd_f32s(group);
        for (sum, x) in partial.iter_mut().zip(registers) {
            *sum = add(simd, *sum, *x);
        }
    }
    let mut places = [0.0_f32; SUMS];
    for (place, sum) in S::as_mut_simd_f32s(&mut places).0.iter_mut().zip(partial) {
        *place = sum;
    }
    let mut half = SUMS / 2;
    while half > 0 {
        for i in 0..half {
            places[i] += places[i + half];
        }
        half /= 2;
    }
    rest.iter().fold(places[0], |sum, x| sum + of_rest(*x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::SeedTree;
    use rand::RngExt;

    fn numbers(count: usize, stream: u64) -> Vec<f32> {
        let mut rng = SeedTree::new(stream).rng();
        (0..count).map(|_| (rng.random::<f32>() - 0.4) * 3.0).collect()
    }

    #[test]
    fn rows_are_normalised() {
        for c in [3, 16, 40, 64, 96] {
            let (rows, gain, bias) = (numbers(7 * c, 1), numbers(c, 2), numbers(c, 3));
            let mut found = rows.clone();
            normalise(&mut found, NormWeights { gain: &gain, bias: &bias, epsilon: 1e-5 });
            for (row, found) in rows.chunks(c).zip(found.chunks(c)) {
                let mean = row.iter().map(|&x| f64::from(x)).sum::<f64>() / c as f64;
                let variance =
                    row.iter().map(|&x| (f64::from(x) - mean).powi(2)).sum::<f64>() / c as f64;
                for (((x, g), b), y) in row.iter().zip(&gain).zip(&bias).zip(found) {
                    let exact = (f64::from(*x) - mean) / (variance + 1e-5).sqrt() * f64::from(*g)
                        + f64::from(*b);
                    assert!((exact.max(0.0) - f64::from(*y)).abs() < 1e-5, "{exact} {y}");
                }
            }
        }
    }

    /// Poses once differed in their last digit between processors with registers of eight and of sixteen places.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn the_width_of_a_register_changes_no_bit() {
        let (Some(eight), Some(sixteen)) = (pulp::x86::V3::try_new(), pulp::x86::V4::try_new())
        else {
            return;
        };
        for c in [5, 16, 33, 64, 130] {
            let (rows, gain, bias) = (numbers(50 * c, 4), numbers(c, 5), numbers(c, 6));
            let weights = NormWeights { gain: &gain, bias: &bias, epsilon: 1e-5 };
            let (mut a, mut b) = (rows.clone(), rows);
            pulp::Simd::vectorize(eight, Normalise { rows: &mut a, weights });
            pulp::Simd::vectorize(sixteen, Normalise { rows: &mut b, weights });
            assert!(a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits()), "{c} columns");
        }
    }
}
