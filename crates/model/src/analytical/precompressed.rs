//! Small motions of a precompressed chain of equal beads.

use std::f64::consts::PI;

/// Upper band edge f_cut = (1/π) √(K/m), Hz, with the tangent stiffness K = (3/2) k^(2/3) F₀^(1/3) of the bead–bead contacts.
///
/// - `mass`: m, kg
/// - `hertz_stiffness`: k, N·m^(-3/2)
/// - `precompression`: F₀, N, positive
///
/// Valid for motions far smaller than the static overlap. Brillouin (1953), *Wave Propagation in Periodic Structures*, §5; Coste, Falcon,
/// Fauve (1997), *Phys. Rev. E* 56, 6104.
pub fn cutoff_frequency(mass: f64, hertz_stiffness: f64, precompression: f64) -> f64 {
    let tangent_stiffness = 1.5 * hertz_stiffness.powf(2.0 / 3.0) * precompression.cbrt();
    (tangent_stiffness / mass).sqrt() / PI
}

/// Frequency of mode j = 1…N of N equal beads between two rigid flats, f_j = f_cut sin(jπ/2N), Hz.
///
/// A rigid flat is 2√2 times as stiff as a bead in k, hence twice as stiff in tangent at the same force: just what a mirror image of the
/// chain behind the flat amounts to, so the modes are cosines with their antinodes half a spacing outside the end beads.
pub fn mode_frequency(cutoff_frequency: f64, mode: usize, beads: usize) -> f64 {
    cutoff_frequency * (mode as f64 * PI / (2 * beads) as f64).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_steel_beads_under_one_newton_have_the_tabulated_frequencies() {
        let cutoff = cutoff_frequency(4.101_349_209e-6, 2.328_270_365e9, 1.0);
        // Mass and stiffness carry ten digits.
        assert!((cutoff / 255_139.002_072 - 1.0).abs() < 1e-9, "{cutoff}");
        let table =
            [66_034.832_885, 127_569.501_036, 180_410.518_510, 220_956.857_291, 246_445.351_395, 255_139.002_072];
        for (index, expected) in table.into_iter().enumerate() {
            assert!((mode_frequency(cutoff, index + 1, 6) / expected - 1.0).abs() < 1e-9);
        }
    }
}
