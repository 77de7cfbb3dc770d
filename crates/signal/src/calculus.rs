//! Running integral of a series, of sixth order in the step.

use super::Series;

/// Weights ×1440 of the integral over one step of the quintic through six points, for the first, second and third step.
const INTEGRAL: [[f64; 6]; 3] = [
    [475.0, 1427.0, -798.0, 482.0, -173.0, 27.0],
    [-27.0, 637.0, 1022.0, -258.0, 77.0, -11.0],
    [11.0, -93.0, 802.0, 802.0, -93.0, 11.0],
];

/// ∫x dt from the first sample on, at the same instants, zero at the first; unit of x times second.
///
/// Each step adds the integral of the quintic through the six samples around it (error of the sum of order step⁶); fewer
/// than six samples: trapezia. An offset of x becomes a drift: remove the baseline first and what drift is left after.
pub fn integral(series: &Series) -> Series {
    let (x, n) = (&series.values, series.len());
    let sum = |from: usize, weights: &[f64; 6]| -> f64 {
        weights.iter().zip(&x[from..from + 6]).map(|(w, x)| w * x).sum::<f64>() * series.step / 1440.0
    };
    let mut total = 0.0;
    let values = (0..n)
        .map(|i| {
            if i > 0 {
                total += if n < 6 {
                    0.5 * (x[i - 1] + x[i]) * series.step
                } else if i < 3 {
                    sum(0, &INTEGRAL[i - 1])
                } else if i + 2 >= n {
                    let mut weights = INTEGRAL[n - 1 - i];
                    weights.reverse();
                    sum(n - 6, &weights)
                } else {
                    sum(i - 3, &INTEGRAL[2])
                };
            }
            total
        })
        .collect();
    Series::new(series.start, series.step, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(n: usize, f: impl Fn(f64) -> f64) -> Series {
        let step = 3.0 / (n - 1) as f64;
        Series::new(0.5, step, (0..n).map(|i| f(0.5 + i as f64 * step)).collect())
    }

    fn worst(a: &Series, b: &Series) -> f64 {
        a.values.iter().zip(&b.values).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
    }

    #[test]
    fn integral_of_a_quintic_is_exact_up_to_the_ends() {
        let x = sampled(20, |t| t.powi(5) - t);
        let expected = sampled(20, |t| t.powi(6) / 6.0 - t * t / 2.0 - (0.5f64.powi(6) / 6.0 - 0.125));
        assert!(worst(&integral(&x), &expected) < 1e-11);
    }

    #[test]
    fn integral_converges_with_at_least_the_sixth_power_of_the_step() {
        let expected = |t: f64| (1.5f64.cos() - (3.0 * t).cos()) / 3.0;
        let error = |n| worst(&integral(&sampled(n, |t| (3.0 * t).sin())), &sampled(n, expected));
        let order = (error(101) / error(201)).log2();
        assert!((order - 6.0).abs() < 0.15, "{order}");
    }

    #[test]
    fn few_samples_are_no_trouble() {
        for n in 0..8 {
            let line = Series::new(0.0, 0.5, (0..n).map(f64::from).collect());
            let end = f64::from(n - 1) * 0.5;
            assert!(n == 0 || (integral(&line).values[n as usize - 1] - end * end).abs() < 1e-12, "{n}");
        }
    }
}
