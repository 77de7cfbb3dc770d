//! How many times faster the chain's integrator is than SciPy's LSODA on the same work.
//!
//! Same work: the rigid scene (six steel beads between rigid flats, five cycles of 73 kHz, 1 µm, 120 µs), displacement and velocity of every
//! bead on a grid of 0.1 µs, one thread, in the same run of this program. The peer is `benches/peers/lsoda_chain.py` (odeint, rtol 1e-8,
//! right-hand side compiled by numba); ours also yields the contact forces and the energy balance. Ours runs at the loosest of several
//! tolerances whose measured error, the largest of any bead's velocity over the peak, is not above the peer's own.
//!
//! Beside it a run of eight side by side at the longest fixed step whose error, of the last bead's velocity, is not above the peer's; these yield that
//! velocity alone.
//!
//! `cargo bench --bench lsoda_ratio`; needs python3 with numpy, scipy and numba. Exit code 1 if they are missing or the ratio is below 20.

use std::{
    hint::black_box,
    io::Write,
    process::{Command, ExitCode},
    time::Instant,
};

use granchain::{
    model::chain::{
        ChainModel,
        ensemble::{Ensemble, Variation},
    },
    response::Response,
    scene::{self, Integrator, Scene},
    signal::Series,
};

/// Required ratio.
const REQUIRED: f64 = 20.0;
/// Rounds of both, alternating, so that both see the same machine.
const ROUNDS: usize = 5;

fn rigid(tolerance: f64) -> Scene {
    let mut scene = scene::load("rigid", &[]).expect("the built-in scene loads");
    scene.model.integrator = Integrator::DormandPrince853 { tolerance };
    scene
}

fn run(scene: &Scene) -> Response {
    ChainModel.run(scene, &mut |_| true).expect("the scene runs")
}

/// Largest difference of any bead's velocity, over the reference's peak.
fn error(response: &Response, reference: &Response) -> f64 {
    let peak = reference.bead_velocity.iter().map(Series::peak).fold(0.0, f64::max);
    let pairs = response.bead_velocity.iter().zip(&reference.bead_velocity);
    pairs.map(|(a, b)| apart(a, b)).fold(0.0, f64::max) / peak
}

/// Largest difference of two series.
fn apart(one: &Series, other: &Series) -> f64 {
    one.values.iter().zip(&other.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The peer's time (s) and error.
fn peer(reference: &std::path::Path) -> Result<(f64, f64, serde_json::Value), String> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/lsoda_chain.py");
    let output = Command::new("python3")
        .args([script, "--repeat", "7", "--reference"])
        .arg(reference)
        .env("OMP_NUM_THREADS", "1")
        .env("NUMBA_NUM_THREADS", "1")
        .output()
        .map_err(|error| format!("python3 could not be started ({error}); install it with numpy, scipy and numba"))?;
    if !output.status.success() {
        return Err(format!(
            "the LSODA peer failed; it needs python3 with numpy, scipy and numba:\n{}",
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())?;
    let number = |key: &str| value[key].as_f64().ok_or(format!("the LSODA peer printed no `{key}`"));
    Ok((number("seconds")?, number("error")?, value.clone()))
}

/// Steps a drive period, time a run (s) and error of eight runs side by side, at the longest step whose error is not above `wanted`.
fn side_by_side(wanted: f64) -> Result<(u32, f64, f64), String> {
    for steps in [160, 240, 320, 400, 480, 560, 640, 960, 1280, 2560, 5120] {
        let mut scene = rigid(1e-13);
        scene.output_step = 1.0 / (scene.drive.frequency * f64::from(steps));
        let ensemble = Ensemble::new(&scene, steps).map_err(|error| error.to_string())?;
        let eight = vec![Variation::of(&scene); 8];
        let found = ensemble.run(&eight).pop().ok_or("no run")?.map_err(|error| error.to_string())?;
        let reference = run(&scene).pole_velocity;
        let error = apart(&found, &reference) / reference.peak();
        if error <= wanted {
            let timed = (0..200).map(|_| {
                let begin = Instant::now();
                black_box(ensemble.run(&eight));
                begin.elapsed().as_secs_f64() / 8.0
            });
            return Ok((steps, timed.fold(f64::INFINITY, f64::min), error));
        }
    }
    Err("no step down to T0/5120 reaches the peer's error".into())
}

fn compare() -> Result<f64, String> {
    let reference = run(&rigid(1e-13));
    let finer = run(&rigid(1e-14));
    println!("reference: ours at tolerance 1e-13, {:.1e} of peak from 1e-14", error(&reference, &finer));
    let mut file = tempfile::NamedTempFile::new().map_err(|error| error.to_string())?;
    for sample in 0..reference.pole_velocity.len() {
        let row: Vec<String> =
            reference.bead_velocity.iter().map(|series| format!("{:e}", series.values[sample])).collect();
        writeln!(file, "{}", row.join(",")).map_err(|error| error.to_string())?;
    }
    let (mut theirs, their_error, details) = peer(file.path())?;
    println!("LSODA: {details}");
    let tolerances = [1e-6, 5e-7, 3e-7, 2e-7, 1e-7, 5e-8, 2e-8, 1e-8];
    let found = tolerances.iter().copied().find(|tolerance| error(&run(&rigid(*tolerance)), &reference) <= their_error);
    let tolerance = found.ok_or("no tolerance down to 1e-8 reaches the peer's error")?;
    let scene = rigid(tolerance);
    let our_error = error(&run(&scene), &reference);
    // Until a larger block has been freed, glibc gives the pages of every response back to the system, to fault them in again: a tenth of a run. In
    // the peer, as in any program that has worked for a while, that was long ago.
    drop(black_box(vec![1_u8; 1 << 24]));
    let mut ours = f64::INFINITY;
    for round in 0..ROUNDS {
        for _ in 0..200 {
            let begin = Instant::now();
            black_box(run(&scene));
            ours = ours.min(begin.elapsed().as_secs_f64());
        }
        if round > 0 {
            theirs = theirs.min(peer(file.path())?.0);
        }
    }
    println!("LSODA, rtol 1e-8:      {:9.3} ms, error {their_error:.2e} of peak", theirs * 1e3);
    println!("ours, tolerance {tolerance:e}: {:8.3} ms, error {our_error:.2e} of peak", ours * 1e3);
    let (steps, lane, error) = side_by_side(their_error)?;
    println!(
        "ours, eight side by side, a run, T0/{steps}: {:.3} ms, error {error:.2e}, ratio {:.0}",
        lane * 1e3,
        theirs / lane
    );
    Ok(theirs / ours)
}

fn main() -> ExitCode {
    match compare() {
        Ok(ratio) => {
            println!("ratio: {ratio:.1} (required: {REQUIRED})");
            if ratio >= REQUIRED { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(message) => {
            eprintln!("lsoda_ratio: {message}");
            ExitCode::FAILURE
        }
    }
}
