//! Cost of the contact finite element analysis on the rigid scene (120 µs in steps of 0.1 µs), one thread, in CPU seconds.
//!
//! - `cargo bench --bench fea`: all of what follows; exit code 1 where a ratio is missed
//! - `… -- run`: two mesh densities, with a table of where the time goes
//! - `… -- peer`: against `benches/peers/fea_skfem.py` on the same mesh, in turn; fails below 2. Needs python3 with numpy, scipy and scikit-fem
//! - `… -- scaling`: time of a step over the non-zeros of the factor from 10k to 200k unknowns; fails where it varies by more than 1.5
//! - `… -- mesh FILE DENSITY`: write the mesh of a bead for the peer

use std::{
    io::Write,
    path::Path,
    process::{Command, ExitCode},
    time::Instant,
};

use granchain::{
    model::fea::{
        Control, Simulation,
        mesh::{BeadMesh, bead},
        profile::Profile,
    },
    response::Response,
    scene::{self, Scene},
};

/// Required ratio to the peer.
const REQUIRED: f64 = 2.0;
/// Most that the time of a step over the factor's non-zeros may vary.
const MOST_SPREAD: f64 = 1.5;
/// Rounds of each timing.
const ROUNDS: usize = 3;

/// Time this thread spent on a processor, s: other programs on the machine do not count. Only Linux tells; elsewhere the clock on the wall.
fn processor_time(start: Instant) -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|line| line.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

struct Timed {
    /// Meshing to factors, s.
    setup: f64,
    /// All steps, s.
    steps: f64,
    profile: Profile,
    factor_nonzeros: usize,
    response: Response,
}

impl Timed {
    fn all(&self) -> f64 {
        self.setup + self.steps
    }

    fn per_step(&self) -> f64 {
        self.steps / self.response.work.steps as f64
    }
}

fn rigid(density: u32, duration: &str) -> Scene {
    let overrides = ["model.kind=fea".into(), format!("model.mesh_density={density}"), format!("duration={duration}")];
    scene::load("rigid", &overrides).expect("the built-in scene loads")
}

fn once(scene: &Scene) -> Timed {
    let clock = Instant::now();
    let start = processor_time(clock);
    let mut simulation = Simulation::new(scene, Control::default()).expect("the scene is meshed and factored");
    let ready = processor_time(clock);
    while !simulation.is_done() {
        simulation.advance().expect("the scene runs");
    }
    let steps = processor_time(clock) - ready;
    Timed {
        setup: ready - start,
        steps,
        profile: *simulation.profile(),
        factor_nonzeros: simulation.factor_nonzeros(),
        response: simulation.response(),
    }
}

/// The fastest of several.
fn fastest(scene: &Scene, rounds: usize) -> Timed {
    let mut best = once(scene);
    for _ in 1..rounds {
        let next = once(scene);
        if next.all() < best.all() {
            best = next;
        }
    }
    best
}

fn run() {
    println!("rigid scene, 120 us in 1200 steps of 0.1 us, one thread, fastest of {ROUNDS}");
    println!("density  unknowns  factor non-zeros   CPU s   of it setup   ms/step   wanted");
    let mut tables = Vec::new();
    for (density, wanted) in [(10, 3.0), (12, 4.0)] {
        let timed = fastest(&rigid(density, "120 us"), ROUNDS);
        println!(
            "{density:7} {:9} {:17} {:7.2} {:13.2} {:9.2}   at most {wanted} s",
            timed.response.work.unknowns,
            timed.factor_nonzeros,
            timed.all(),
            timed.setup,
            1e3 * timed.per_step()
        );
        tables.push((density, timed));
    }
    for (density, timed) in tables {
        println!("where the time goes at density {density} (wall clock):");
        let sum: f64 = timed.profile.stages().iter().map(|(_, time)| time.as_secs_f64()).sum();
        for (name, time) in timed.profile.stages() {
            println!("  {name:24} {:7.3} s {:5.1} %", time.as_secs_f64(), 100.0 * time.as_secs_f64() / sum);
        }
    }
}

fn write_mesh(path: &Path, density: usize) -> Result<(), String> {
    let mesh = bead(0.5e-3, &BeadMesh::of_density(density)).map_err(|error| error.to_string())?;
    let boundary = |name: &str| mesh.boundary(name).map(|boundary| boundary.nodes.clone());
    let value = serde_json::json!({
        "nodes": mesh.nodes,
        "quadrilaterals": mesh.elements,
        "front": boundary("front"),
        "back": boundary("back"),
    });
    std::fs::write(path, value.to_string()).map_err(|error| format!("{}: {error}", path.display()))
}

/// One run of the peer: its summary and the last bead's velocity.
fn peer(mesh: &Path, velocity: &Path) -> Result<(serde_json::Value, Vec<f64>), String> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/fea_skfem.py");
    let output = Command::new("python3")
        .arg(script)
        .arg("--mesh")
        .arg(mesh)
        .arg("--out")
        .arg(velocity)
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .output()
        .map_err(|error| {
            format!("python3 could not be started ({error}); install it with `pip install numpy scipy scikit-fem`")
        })?;
    if !output.status.success() {
        return Err(format!(
            "the peer failed; it needs `pip install numpy scipy scikit-fem`:\n{}",
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    let summary = serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())?;
    let text = std::fs::read_to_string(velocity).map_err(|error| error.to_string())?;
    let values = text.lines().map(|line| line.trim().parse().map_err(|_| format!("`{line}` is no number")));
    Ok((summary, values.collect::<Result<_, _>>()?))
}

fn against_peer() -> Result<bool, String> {
    let density = 10;
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let (mesh, velocity) = (folder.path().join("bead.json"), folder.path().join("velocity.txt"));
    write_mesh(&mesh, density as usize)?;
    let scene = rigid(density, "120 us");
    let (mut ours, mut theirs, mut last) = (f64::INFINITY, f64::INFINITY, None);
    for _ in 0..ROUNDS {
        let timed = once(&scene);
        let (summary, values) = peer(&mesh, &velocity)?;
        let seconds = summary["seconds"]["all"].as_f64().ok_or("the peer printed no `seconds`")?;
        (ours, theirs) = (ours.min(timed.all()), theirs.min(seconds));
        last = Some((timed, summary, values));
    }
    let (timed, summary, values) = last.ok_or("no round was run")?;
    let own = &timed.response.bead_velocity[5];
    let peak = own.peak();
    let within = |until: f64| {
        let pairs = own.values.iter().zip(&values).enumerate().take_while(|(i, _)| own.time(*i) <= until);
        pairs.map(|(_, (a, b))| (a - b).abs()).fold(0.0, f64::max) / peak
    };
    println!(
        "scikit-fem and SciPy on the same mesh, {} unknowns, both with set-up, fastest of {ROUNDS}",
        summary["unknowns"]
    );
    println!("  theirs {theirs:.2} s of CPU; stages of the last round: {}", summary["seconds"]);
    println!("  non-zeros of their factor (L of LU) {}, of ours {}", summary["factor_nonzeros"], timed.factor_nonzeros);
    println!(
        "  largest difference of the last bead's velocity over its peak: {:.1e} up to 30 us, {:.1e} up to 70 us",
        within(30e-6),
        within(70e-6)
    );
    let ratio = theirs / ours;
    println!("  ours {ours:.2} s; ratio {ratio:.1}, wanted {REQUIRED}");
    Ok(ratio >= REQUIRED)
}

fn scaling() -> bool {
    println!("time of a step over the factor's non-zeros, six beads, fastest of {ROUNDS}");
    println!("density  unknowns  factor non-zeros   ms/step   ns/step/non-zero");
    let mut costs = Vec::new();
    for density in [4, 6, 8, 12, 16, 22] {
        // The first 20 µs: all beads are under way.
        let timed = fastest(&rigid(density, "20 us"), ROUNDS);
        let cost = 1e9 * timed.per_step() / timed.factor_nonzeros as f64;
        println!(
            "{density:7} {:9} {:17} {:9.3} {cost:18.2}",
            timed.response.work.unknowns,
            timed.factor_nonzeros,
            1e3 * timed.per_step()
        );
        costs.push(cost);
    }
    let spread = costs.iter().copied().fold(0.0, f64::max) / costs.iter().copied().fold(f64::INFINITY, f64::min);
    println!("varies by {spread:.2}, wanted at most {MOST_SPREAD}");
    spread <= MOST_SPREAD
}

fn all(words: &[&str]) -> Result<bool, String> {
    if let ["mesh", path, density] = words {
        let density = density.parse().map_err(|_| format!("expected a density such as 10, found `{density}`"))?;
        write_mesh(Path::new(path), density)?;
        return Ok(true);
    }
    if let Some(unknown) = words.iter().find(|word| !["run", "peer", "scaling"].contains(word)) {
        return Err(format!("expected `run`, `peer`, `scaling` or `mesh FILE DENSITY`, found `{unknown}`"));
    }
    let wanted = |word: &str| words.is_empty() || words.contains(&word);
    let mut met = true;
    if wanted("run") {
        run();
    }
    if wanted("scaling") {
        met &= scaling();
    }
    if wanted("peer") {
        met &= against_peer()?;
    }
    Ok(met)
}

fn main() -> ExitCode {
    // Cargo adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match all(&words) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            let _ = writeln!(std::io::stderr(), "{message}");
            ExitCode::FAILURE
        }
    }
}
