//! Small dense symmetric systems: Cholesky factors of N × N matrices, N known when compiled.

/// A square matrix, row by row.
pub(crate) type Matrix<const N: usize> = [[f64; N]; N];

/// All zeros.
pub(crate) fn zeros<const N: usize>() -> Matrix<N> {
    [[0.0; N]; N]
}

/// Lower Cholesky factor; `None` unless positive definite.
pub(crate) fn cholesky<const N: usize>(a: &Matrix<N>) -> Option<Matrix<N>> {
    let mut l = zeros::<N>();
    for i in 0..N {
        for k in 0..=i {
            let mut sum = a[i][k];
            for m in 0..k {
                sum -= l[i][m] * l[k][m];
            }
            if i == k {
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][k] = sum / l[k][k];
            }
        }
    }
    Some(l)
}

/// Solution of L·y = b.
pub(crate) fn forward<const N: usize>(l: &Matrix<N>, b: &[f64; N]) -> [f64; N] {
    let mut y = *b;
    for i in 0..N {
        for k in 0..i {
            y[i] -= l[i][k] * y[k];
        }
        y[i] /= l[i][i];
    }
    y
}

/// Solution of L·Lᵀ·x = b.
pub(crate) fn solve<const N: usize>(l: &Matrix<N>, b: &[f64; N]) -> [f64; N] {
    let mut x = forward(l, b);
    for i in (0..N).rev() {
        for k in i + 1..N {
            x[i] -= l[k][i] * x[k];
        }
        x[i] /= l[i][i];
    }
    x
}

/// Inverse of a positive definite matrix.
pub(crate) fn inverse<const N: usize>(a: &Matrix<N>) -> Option<Matrix<N>> {
    let l = cholesky(a)?;
    let mut out = zeros::<N>();
    for k in 0..N {
        let mut unit = [0.0; N];
        unit[k] = 1.0;
        let column = solve(&l, &unit);
        for i in 0..N {
            out[i][k] = column[i];
        }
    }
    Some(out)
}

/// Logarithm of the determinant, from the Cholesky factor.
pub(crate) fn log_det<const N: usize>(l: &Matrix<N>) -> f64 {
    (0..N).map(|i| 2.0 * l[i][i].ln()).sum()
}

/// dᵀ·(L·Lᵀ)⁻¹·d.
pub(crate) fn distance2<const N: usize>(l: &Matrix<N>, d: &[f64; N]) -> f64 {
    forward(l, d).iter().map(|v| v * v).sum()
}

/// a + b.
pub(crate) fn sum<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut out = *a;
    for i in 0..N {
        for k in 0..N {
            out[i][k] += b[i][k];
        }
    }
    out
}

/// j·c·jᵀ.
pub(crate) fn carried<const M: usize, const N: usize>(
    j: &[[f64; N]; M],
    c: &Matrix<N>,
) -> Matrix<M> {
    let mut jc = [[0.0; N]; M];
    for i in 0..M {
        for k in 0..N {
            jc[i][k] = (0..N).map(|m| j[i][m] * c[m][k]).sum();
        }
    }
    let mut out = zeros::<M>();
    for i in 0..M {
        for k in 0..M {
            out[i][k] = (0..N).map(|m| jc[i][m] * j[k][m]).sum();
        }
    }
    out
}

/// The 3 × 3 part whose first row and column is `at`.
pub(crate) fn part(a: &Matrix<6>, at: usize) -> Matrix<3> {
    let mut out = zeros::<3>();
    for i in 0..3 {
        for k in 0..3 {
            out[i][k] = a[at + i][at + k];
        }
    }
    out
}

/// dᵀ·A·d for a unit direction.
pub(crate) fn along(a: &Matrix<3>, direction: [f64; 3]) -> f64 {
    (0..3).map(|i| (0..3).map(|k| direction[i] * a[i][k] * direction[k]).sum::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_times_its_matrix_is_one() {
        let a = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let b = inverse(&a).unwrap();
        for i in 0..3 {
            for k in 0..3 {
                let v: f64 = (0..3).map(|m| a[i][m] * b[m][k]).sum();
                assert!((v - f64::from(u8::from(i == k))).abs() < 1e-12);
            }
        }
        let l = cholesky(&a).unwrap();
        assert!((log_det(&l) - 20.89_f64.ln()).abs() < 1e-9, "{}", log_det(&l).exp());
    }
}
