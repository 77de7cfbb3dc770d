//! The coupling across a body as a few products.
//!
//! V ≈ Σ_r u_r v_rᵀ by cross approximation with full pivoting: the row and the column of the largest entry are taken off, until what is left
//! is below a billionth of the largest. What a force at one pole does at the other is smooth over both patches, of size r₀ ≪ 2a each, so
//! that the terms fall as (r₀/2a)², and two or three suffice.
//!
//! Bebendorf (2000), *Numer. Math.* 86, 565.

/// Largest entry left over, over the largest there was, 1: what solving for the compliances leaves of noise.
const LEFT_OVER: f64 = 1e-9;

/// V of a body: back points × front points.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Crossing {
    /// u_r at the points of its back, √(m/N).
    pub(super) back: Vec<Vec<f64>>,
    /// v_r at the points of its front, √(m/N).
    pub(super) front: Vec<Vec<f64>>,
}

impl Crossing {
    /// Of the matrix V, row by row, m/N.
    pub(super) fn of(mut matrix: Vec<f64>, columns: usize) -> Self {
        let mut crossing = Self::default();
        let largest = |matrix: &[f64]| matrix.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let limit = LEFT_OVER * largest(&matrix);
        loop {
            let Some((place, &pivot)) = matrix.iter().enumerate().max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()))
            else {
                return crossing;
            };
            if pivot.abs() <= limit {
                return crossing;
            }
            let (row, column) = (place / columns, place % columns);
            let scale = pivot.abs().sqrt();
            let front: Vec<f64> = matrix[row * columns..(row + 1) * columns].iter().map(|v| v / scale).collect();
            let back: Vec<f64> =
                matrix.iter().skip(column).step_by(columns).map(|v| v * pivot.signum() / scale).collect();
            for (line, u) in matrix.chunks_exact_mut(columns).zip(&back) {
                line.iter_mut().zip(&front).for_each(|(value, v)| *value -= u * v);
            }
            crossing.back.push(back);
            crossing.front.push(front);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_two_products_is_found_again_with_two_terms() {
        let (rows, columns) = (7, 5);
        let entry = |i: usize, j: usize| -3e-9 * (1.0 + 0.1 * i as f64) + 1e-11 * (i * i) as f64 * (2.0 - j as f64);
        let matrix: Vec<f64> = (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect();
        let crossing = Crossing::of(matrix, columns);
        assert_eq!((crossing.back.len(), crossing.front.len()), (2, 2));
        for i in 0..rows {
            for j in 0..columns {
                let value: f64 = (0..2).map(|r| crossing.back[r][i] * crossing.front[r][j]).sum();
                assert!((value - entry(i, j)).abs() < 1e-22, "{i} {j}: {value:e} {:e}", entry(i, j));
            }
        }
    }

    #[test]
    fn no_coupling_has_no_terms() {
        assert_eq!(Crossing::of(vec![0.0; 6], 3), Crossing::default());
        assert_eq!(Crossing::of(Vec::new(), 3), Crossing::default());
    }
}
