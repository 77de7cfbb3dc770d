//! How do small waves travel along a precompressed chain of two to a thousand beads, and where does it stop passing them?
//!
//! Pressed together, Hertz contacts are springs for small motions, K = (3/2) k^(2/3) F₀^(1/3), and the chain is a lattice:
//!
//! ω(q) = 2 √(K/m) |sin(q/2)|, q in radians a bead; above the cut-off f_c = (1/π) √(K/m) nothing travels, and a motion at f falls by
//! exp(−2 arcosh(f/f_c)) from bead to bead.
//!
//! Measured in three ways, on the chain's own nonlinear equations at amplitudes of 10⁻⁷ of the static overlap:
//!
//! - frequencies of modes: N beads between rigid flats, the first struck; the velocities projected onto mode j (q = jπ/N) swing at one
//!   frequency, found from cos ωh = Σ y(t) (y(t+h) + y(t−h))/2Σ y(t)²;
//! - below the cut-off: phase from bead to bead behind a piston that moves at f;
//! - above: how much less each bead moves than the one before it.
//!
//! ```text
//! cargo run --release --example dispersion [-- DIR]
//! ```
//!
//! writes `dispersion.svg` and `dispersion.png` into DIR, `out/dispersion` by default.

use std::{error::Error, f64::consts::PI, fs, path::PathBuf};

use granchain::{
    model::{
        analytical::{cutoff_frequency, mode_frequency},
        chain::{ChainModel, InitialState},
        contact_law::bead_pair_stiffness,
    },
    report::figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    scene::{self, Integrator, Scene},
    signal::Series,
};

/// Static force, N.
const FORCE: f64 = 1.0;
/// Velocity of the strike and of the piston, m/s: overlaps change by some 1e-7 of the static one. At 1e-6 the lowest mode of
/// a thousand beads is ten times as far from the linear limit.
const SMALL: f64 = 1e-7;
/// Samples a period of the cut-off.
const SAMPLING: f64 = 8.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("out/dispersion"), PathBuf::from);
    let cutoff = {
        let bead = pressed(2)?.chain.beads[0].clone();
        cutoff_frequency(bead.mass(), bead_pair_stiffness(&bead, &bead), FORCE)
    };
    println!("cut-off {:.3} kHz: steel beads of 1 mm under {FORCE} N\n", cutoff * 1e-3);

    println!("modes of N beads between rigid flats, f = f_c sin(jπ/2N)");
    println!("   N     j   measured kHz   closed form   difference");
    let (mut few, mut many) = (Vec::new(), Vec::new());
    let mut differences: Vec<f64> = Vec::new();
    for beads in [2, 3, 5, 10, 30, 100, 300, 1000] {
        let modes = if beads <= 10 { (1..=beads).collect() } else { spread(beads, 24) };
        let shown = [1, beads.div_ceil(4), beads.div_ceil(2), beads];
        for (mode, found) in modes_of(beads, cutoff, &modes)? {
            let expected = mode_frequency(cutoff, mode, beads);
            differences.push((found / expected - 1.0).abs());
            if shown.contains(&mode) {
                let (found, expected, difference) = (found * 1e-3, expected * 1e-3, found / expected - 1.0);
                println!("{beads:>4} {mode:>5} {found:>14.5} {expected:>13.5} {difference:>12.1e}");
            }
            let into = if beads <= 10 { &mut few } else { &mut many };
            into.push((mode as f64 / beads as f64, found / cutoff));
        }
    }
    differences.sort_by(f64::total_cmp);
    let (count, largest) = (differences.len(), differences[differences.len() - 1]);
    println!(
        "{count} modes measured, differences at most {largest:.1e}, {:.1e} in the median\n",
        differences[count / 2]
    );

    println!("a thousand beads behind a piston: phase, or fall, from bead to bead");
    println!("  f/f_c   measured   closed form   difference");
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for ratio in [0.2, 0.4, 0.6, 0.8, 0.9] {
        let (found, _) = driven(cutoff, ratio, 40)?;
        let expected = 2.0 * ratio.asin();
        println!("{ratio:>7} {found:>10.6} {expected:>13.6} {:>12.1e}   phase, rad", found / expected - 1.0);
        below.push((found / PI, ratio));
    }
    for ratio in [1.05, 1.2, 1.5, 2.0] {
        let (_, found) = driven(cutoff, ratio, 4)?;
        let expected = 2.0 * f64::acosh(ratio);
        println!("{ratio:>7} {found:>10.6} {expected:>13.6} {:>12.1e}   fall, ln", found / expected - 1.0);
        above.push((found, ratio));
    }

    let curve = |from: f64, to: f64, of: &dyn Fn(f64) -> f64| {
        (0..=200).map(|i| from + (to - from) * f64::from(i) / 200.0).map(|x| (x, of(x))).collect::<Vec<_>>()
    };
    let theory = Stroke::new(Colour::Black).width(0.8);
    let passing =
        Panel::new(Axis::new("Phase a bead over π", "1"), Axis::new("Frequency over the cut-off", "1").range(0.0, 2.1))
            .titled("(a) waves that travel")
            .height(62.0)
            .line("closed form", curve(0.0, 1.0, &|x| (0.5 * PI * x).sin()), theory)
            .points("modes of 30 to 1000 beads", many, Colour::SkyBlue, Marker::Dot)
            .points("modes of 2 to 10 beads", few, Colour::Blue, Marker::Ring)
            .points("driven, 1000 beads", below, Colour::Orange, Marker::Cross);
    let stopped = Panel::new(
        Axis::new("Fall of ln amplitude a bead", "1"),
        Axis::new("Frequency over the cut-off", "1").range(0.0, 2.1),
    )
    .titled("(b) motions that do not")
    .height(62.0)
    .line("closed form", curve(0.0, 2.7, &|x| (0.5 * x).cosh()), theory.dash(Dash::Dashed))
    .points("driven, 1000 beads", above, Colour::Orange, Marker::Cross);
    let figure = Figure::new("Dispersion of precompressed chains of 2 to 1000 beads, run and closed form.")
        .sized(PAGE_WIDTH_MM, 2)
        .panel(passing)
        .panel(stopped);
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("dispersion.svg"), figure.to_svg()?)?;
    fs::write(folder.join("dispersion.png"), figure.to_png()?)?;
    println!("\nfigure: {}", folder.join("dispersion.svg").display());
    Ok(())
}

/// N beads between rigid flats under [`FORCE`], the piston at rest.
fn pressed(beads: usize) -> Result<Scene, Box<dyn Error>> {
    let keys = [format!("chain.beads={beads}"), format!("chain.precompression={FORCE}N"), "damping.kind=none".into()];
    let mut scene = scene::load("rigid", &keys)?;
    scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-9 };
    scene.amplitude_scale = 0.0;
    Ok(scene)
}

/// About `count` of the modes 1…N, both ends among them.
fn spread(beads: usize, count: usize) -> Vec<usize> {
    let mut modes: Vec<usize> = (0..=count).map(|i| 1 + i * (beads - 1) / count).collect();
    modes.extend([beads.div_ceil(4), beads.div_ceil(2)]);
    modes.sort_unstable();
    modes.dedup();
    modes
}

/// Number and measured frequency (Hz) of these modes.
fn modes_of(beads: usize, cutoff: f64, modes: &[usize]) -> Result<Vec<(usize, f64)>, Box<dyn Error>> {
    let mut scene = pressed(beads)?;
    scene.output_step = 1.0 / (SAMPLING * cutoff);
    // One and a half periods of the lowest mode, at least forty of the cut-off.
    scene.duration = (1.5 / mode_frequency(cutoff, 1, beads)).max(40.0 / cutoff);
    let mut struck = InitialState::at_rest(beads);
    struck.velocities[0] = SMALL;
    let response = ChainModel.run_from(&scene, &struck, &mut |_| true)?;
    let samples = response.pole_velocity.len();
    let measured = modes.iter().map(|&mode| {
        let shape: Vec<f64> =
            (0..beads).map(|bead| ((bead as f64 + 0.5) * mode as f64 * PI / beads as f64).sin()).collect();
        let mut swing = vec![0.0; samples];
        for (weight, velocity) in shape.iter().zip(&response.bead_velocity) {
            swing.iter_mut().zip(&velocity.values).for_each(|(sum, value)| *sum += weight * value);
        }
        (mode, frequency(&swing, scene.output_step, mode_frequency(cutoff, mode, beads)))
    });
    Ok(measured.collect())
}

/// Frequency of a swing, Hz, from samples a good radian of `near` apart.
fn frequency(swing: &[f64], step: f64, near: f64) -> f64 {
    let stride = ((1.0 / (2.0 * PI * near * step)).round() as usize).max(1);
    let (mut product, mut square) = (0.0, 0.0);
    for middle in stride..swing.len() - stride {
        product += swing[middle] * (swing[middle - stride] + swing[middle + stride]);
        square += 2.0 * swing[middle] * swing[middle];
    }
    (product / square).acos() / (2.0 * PI * step * stride as f64)
}

/// Phase (rad) by which each bead lags the one before it, and by how much less it moves (ln), behind a piston at f = `ratio` f_c; over the
/// first `beads` of a thousand, once they move evenly and before the far end is heard.
fn driven(cutoff: f64, ratio: f64, beads: usize) -> Result<(f64, f64), Box<dyn Error>> {
    let mut scene = pressed(1000)?;
    let drive = ratio * cutoff;
    scene.drive.frequency = drive;
    scene.drive.amplitude = SMALL / (2.0 * PI * drive);
    scene.amplitude_scale = 1.0;
    // The front runs at π f_c beads a second: there and back in 0.6 N/f_c.
    scene.duration = 600.0 / cutoff;
    scene.drive.kind = scene::DriveKind::ToneBurst { cycles: 2.0 * scene.duration * drive, ring_up: 50.0 / cutoff };
    scene.output_step = 1.0 / (SAMPLING * drive);
    let still = InitialState::at_rest(1000);
    let response = ChainModel.run_from(&scene, &still, &mut |_| true)?;
    let amplitudes: Vec<(f64, f64)> =
        response.bead_velocity[..=beads].iter().map(|velocity| line(velocity, drive, 60)).collect();
    let steps = amplitudes.windows(2).map(|pair| {
        let ((a, b), (c, d)) = (pair[0], pair[1]);
        // The next over this one, as complex numbers.
        let (re, im) = ((c * a + d * b), (d * a - c * b));
        (-(im.atan2(re)), -0.5 * ((c * c + d * d) / (a * a + b * b)).ln())
    });
    let (phase, fall) = steps.fold((0.0, 0.0), |sum, step| (sum.0 + step.0, sum.1 + step.1));
    Ok((phase / beads as f64, fall / beads as f64))
}

/// The line at f over the last `periods` whole periods, real and imaginary part.
fn line(series: &Series, frequency: f64, periods: usize) -> (f64, f64) {
    let count = (periods as f64 * SAMPLING) as usize;
    let first = series.len() - count;
    (first..series.len()).fold((0.0, 0.0), |(re, im), index| {
        let (sin, cos) = (2.0 * PI * frequency * series.time(index)).sin_cos();
        (re + series.values[index] * cos, im - series.values[index] * sin)
    })
}
