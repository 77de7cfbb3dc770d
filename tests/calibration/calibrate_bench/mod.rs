//! A bench small enough to be calibrated in a second: two beads on the annulus, a short burst, and a record of it made by
//! the chain itself with seeded noise.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use granchain::{model, report::page::without_times, scene, signal::Series};
use serde_json::Value;
use tempfile::TempDir;

/// α behind the record.
pub const ALPHA: f64 = 0.6;

/// c behind the record, N·s/m.
pub const DAMPING: f64 = 0.4;

const SCENE: &str = r#"extends = "annulus"
name = "bench"
description = "two beads on the annulus, short burst"
alpha = 0.6
duration = "420 us"

[chain]
beads = 2

[drive]
cycles = 20

[model]
kind = "chain"

[damping]
coefficient = 0.4
"#;

/// A folder with `bench.toml` and `lab/vib.csv`, in which commands are run.
pub struct Bench {
    place: TempDir,
}

impl Bench {
    /// Make the record again; about a tenth of a second.
    pub fn new() -> Self {
        Self::of(&[])
    }

    /// The same with a record of a bench of which these keys are not as stated.
    pub fn of(sets: &[&str]) -> Self {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("bench.toml"), SCENE).unwrap();
        fs::create_dir(place.path().join("lab")).unwrap();
        let bench = Self { place };
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let scene = scene::load(bench.text("bench.toml"), &sets).unwrap();
        let response = model::run(&scene, &mut |_| true).unwrap();
        bench.write("lab/vib.csv", table("velocity_mm_per_s", &response.pole_velocity, 1e3, 3.0));
        bench
    }

    /// Let the record's clock go by so many seconds a second.
    pub fn on_clock(&self, second: f64) {
        let text = fs::read_to_string(self.path("lab/vib.csv")).unwrap();
        let (head, rows) = text.split_once('\n').unwrap();
        let row = |row: &str| {
            let (time, value) = row.split_once(',').unwrap();
            format!("{:.6},{value}\n", second * time.parse::<f64>().unwrap())
        };
        self.write("lab/vib.csv", format!("{head}\n{}", rows.lines().map(row).collect::<String>()));
    }

    /// Put the horn-tip record of the same burst beside the record.
    pub fn add_horn_tip(&self) {
        let scene = scene::load(self.text("bench.toml"), &[]).unwrap();
        let motion = scene.drive.motion(1.0);
        let values = (0..4200).map(|index| motion.at(f64::from(index) * 1e-7).0).collect();
        let displacement = Series::new(0.0, 1e-7, values);
        self.write("lab/horn_tip.csv", table("displacement_um", &displacement, 1e6, 0.0));
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.place.path().join(name)
    }

    fn text(&self, name: &str) -> &'static str {
        // Leaked once or twice a test: `scene::load` wants a text.
        Box::leak(self.path(name).display().to_string().into_boxed_str())
    }

    /// Write a file in the folder.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    /// `granchain calibrate --scene bench.toml --evaluations 200 --measured lab/vib.csv` and `more`, ready to be run here.
    pub fn command(&self, more: &[&str]) -> Command {
        let mut command = self.granchain(&["calibrate", "--scene", "bench.toml", "--measured", "lab/vib.csv"]);
        if !more.contains(&"--evaluations") {
            command.args(["--evaluations", "200"]);
        }
        command.args(more);
        command
    }

    /// The same, run to its end.
    pub fn calibrate(&self, more: &[&str]) -> Output {
        self.command(more).output().unwrap()
    }

    /// `granchain` with these arguments, ready to be run here.
    pub fn granchain(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
        command.current_dir(self.place.path()).args(arguments);
        command
    }

    /// Every path below the folder, sorted.
    pub fn tree(&self) -> Vec<String> {
        paths(self.place.path())
    }

    /// `calibration.json` of an outcome.
    pub fn outcome(&self, folder: &str) -> Value {
        serde_json::from_slice(&fs::read(self.path(folder).join("calibration.json")).unwrap()).unwrap()
    }

    /// Every file of an outcome but the one that holds times, pages without theirs.
    pub fn contents(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        let folder = self.path(folder);
        paths(&folder)
            .into_iter()
            .filter(|name| name != "timing.json" && folder.join(name).is_file())
            .map(|name| (name.clone(), without_times(&fs::read(folder.join(&name)).unwrap()).into_owned()))
            .collect()
    }
}

fn paths(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(place) = open.pop() {
        for entry in fs::read_dir(&place).unwrap() {
            let path = entry.unwrap().path();
            found.push(path.strip_prefix(folder).unwrap().display().to_string());
            if path.is_dir() {
                open.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A record at 5 MHz with 40 µs of pre-trigger and seeded noise of standard deviation `noise`, in units of the file.
pub fn table(column: &str, series: &Series, factor: f64, noise: f64) -> String {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    // The sum of 12 uniform numbers is as good as normal here.
    let mut draw = move || noise * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
    let mut text = format!("time_us,{column}\n");
    for index in -200..0 {
        writeln!(text, "{:.1},{:.4}", f64::from(index) * 0.2, draw()).unwrap();
    }
    for (index, value) in series.values.iter().step_by(2).enumerate() {
        writeln!(text, "{:.1},{:.4}", index as f64 * 0.2, factor * value + draw()).unwrap();
    }
    text
}
