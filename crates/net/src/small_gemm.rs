//! Products of small dense matrices that stay in the cache, for the fused layers.
//!
//! The deep-learning library's own products are made for large tensors; a graph layer needs thousands of products of
//! a few hundred rows whose operands are in L2 already. Row-major, f32, columns of the result in multiples of 32.

use pulp::Simd;

/// Columns are padded to a multiple of this (two AVX-512 registers).
pub(crate) const COLUMNS: usize = 32;

/// `c += a · b` with `a` `[m, k]` of row stride `lda`, `b` `[k, n]` and `c` `[m, n]` dense.
#[inline(always)]
pub(crate) fn add_product<S: Simd>(
    simd: S,
    a: &[f32],
    lda: usize,
    k: usize,
    b: &[f32],
    c: &mut [f32],
    n: usize,
) {
    let m = c.len() / n;
    let mut row = 0;
    while row + 8 <= m {
        product_rows::<S, 8>(simd, &a[row * lda..], lda, k, b, &mut c[row * n..(row + 8) * n], n);
        row += 8;
    }
    while row < m {
        product_rows::<S, 1>(simd, &a[row * lda..], lda, k, b, &mut c[row * n..(row + 1) * n], n);
        row += 1;
    }
}

#[inline(always)]
fn product_rows<S: Simd, const R: usize>(
    simd: S,
    a: &[f32],
    lda: usize,
    k: usize,
    b: &[f32],
    c: &mut [f32],
    n: usize,
) {
    let rows: [&[f32]; R] = std::array::from_fn(|r| &a[r * lda..r * lda + k]);
    let lanes = S::F32_LANES;
    let step = 2 * lanes;
    let mut column = 0;
    while column < n {
        let mut acc = [[simd.splat_f32s(0.0); 2]; R];
        for p in 0..k {
            let (b0, b1) = pair(simd, &b[p * n + column..p * n + column + step]);
            for r in 0..R {
                let x = simd.splat_f32s(rows[r][p]);
                acc[r][0] = simd.mul_add_e_f32s(x, b0, acc[r][0]);
                acc[r][1] = simd.mul_add_e_f32s(x, b1, acc[r][1]);
            }
        }
        for (r, sum) in acc.iter().enumerate() {
            add_pair(simd, &mut c[r * n + column..r * n + column + step], sum);
        }
        column += step;
    }
}

/// `c += aᵀ · b` with `a` `[m, lda]` of which the first `c.len() / n` columns are used, `b` `[m, n]` dense;
/// the rows of `c` a multiple of 8.
#[inline(always)]
pub(crate) fn add_transposed_product<S: Simd>(
    simd: S,
    a: &[f32],
    lda: usize,
    b: &[f32],
    c: &mut [f32],
    n: usize,
) {
    let m = b.len() / n;
    let lanes = S::F32_LANES;
    let step = 2 * lanes;
    for row in (0..c.len() / n).step_by(8) {
        let mut column = 0;
        while column < n {
            let mut acc = [[simd.splat_f32s(0.0); 2]; 8];
            for p in 0..m {
                let (b0, b1) = pair(simd, &b[p * n + column..p * n + column + step]);
                let x: &[f32; 8] =
                    a[p * lda + row..p * lda + row + 8].try_into().expect("eight columns");
                for r in 0..8 {
                    let x = simd.splat_f32s(x[r]);
                    acc[r][0] = simd.mul_add_e_f32s(x, b0, acc[r][0]);
                    acc[r][1] = simd.mul_add_e_f32s(x, b1, acc[r][1]);
                }
            }
            for (r, sum) in acc.iter().enumerate() {
                let at = (row + r) * n + column;
                add_pair(simd, &mut c[at..at + step], sum);
            }
            column += step;
        }
    }
}

#[inline(always)]
fn pair<S: Simd>(_simd: S, row: &[f32]) -> (S::f32s, S::f32s) {
    let (vectors, _) = S::as_simd_f32s(row);
    (vectors[0], vectors[1])
}

#[inline(always)]
fn add_pair<S: Simd>(simd: S, row: &mut [f32], sum: &[S::f32s; 2]) {
    let (vectors, _) = S::as_mut_simd_f32s(row);
    vectors[0] = simd.add_f32s(vectors[0], sum[0]);
    vectors[1] = simd.add_f32s(vectors[1], sum[1]);
}

/// `exp` of non-positive numbers to 2 ulp, branch-free so that it vectorises; below −87 it gives about 1e-38.
#[inline(always)]
pub(crate) fn exp_nonpositive(x: f32) -> f32 {
    const ROUND: f32 = 12_582_912.0;
    let x = if x < -87.0 { -87.0 } else { x };
    let t = x * std::f32::consts::LOG2_E + ROUND;
    let n = t - ROUND;
    let r = (x - n * 0.693_359_4) - n * -2.121_944_4e-4;
    let p = 1.987_569_1e-4;
    let p = p * r + 1.398_199_9e-3;
    let p = p * r + 8.333_452e-3;
    let p = p * r + 4.166_579_6e-2;
    let p = p * r + 1.666_666_5e-1;
    let p = p * r + 0.5;
    let y = p * (r * r) + r + 1.0;
    y * f32::from_bits((t.to_bits() << 23).wrapping_add(0x3f80_0000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_close() {
        for i in 0..8000 {
            let x = -(i as f32) * 0.01;
            let (mine, exact) = (exp_nonpositive(x), x.exp());
            assert!((mine - exact).abs() <= 3e-7 * exact + 1e-37, "{x}: {mine} {exact}");
        }
        assert!(exp_nonpositive(-1e30) < 1e-37);
        assert_eq!(exp_nonpositive(0.0), 1.0);
    }

    #[test]
    fn products_equal_the_definition() {
        let (m, k, n, lda) = (21, 10, 64, 16);
        let value = |i: usize| ((i * 37 % 101) as f32 - 50.0) / 50.0;
        let a: Vec<f32> = (0..m * lda).map(value).collect();
        let b: Vec<f32> = (0..k * n).map(|i| value(i + 7)).collect();
        let mut c = vec![0.5; m * n];
        pulp::Arch::new().dispatch(Product { a: &a, lda, k, b: &b, c: &mut c, n });
        for i in 0..m {
            for j in 0..n {
                let want = 0.5 + (0..k).map(|p| a[i * lda + p] * b[p * n + j]).sum::<f32>();
                assert!((c[i * n + j] - want).abs() < 1e-5);
            }
        }
        let b: Vec<f32> = (0..m * n).map(|i| value(i + 3)).collect();
        let mut c = vec![0.0; lda * n];
        pulp::Arch::new().dispatch(Transposed { a: &a, lda, b: &b, c: &mut c, n });
        for i in 0..lda {
            for j in 0..n {
                let want = (0..m).map(|p| a[p * lda + i] * b[p * n + j]).sum::<f32>();
                assert!((c[i * n + j] - want).abs() < 1e-5);
            }
        }
    }

    struct Product<'a> {
        a: &'a [f32],
        lda: usize,
        k: usize,
        b: &'a [f32],
        c: &'a mut [f32],
        n: usize,
    }

    impl pulp::WithSimd for Product<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            add_product(simd, self.a, self.lda, self.k, self.b, self.c, self.n);
        }
    }

    struct Transposed<'a> {
        a: &'a [f32],
        lda: usize,
        b: &'a [f32],
        c: &'a mut [f32],
        n: usize,
    }

    impl pulp::WithSimd for Transposed<'_> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            add_transposed_product(simd, self.a, self.lda, self.b, self.c, self.n);
        }
    }
}
