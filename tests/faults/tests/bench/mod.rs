//! Commands small enough to be ended some hundred times, and what is asked of them afterwards.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    os::unix::process::{CommandExt, ExitStatusExt},
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::OnceLock,
};

use tempfile::TempDir;

/// A command that writes the folder `out`.
pub struct Case {
    pub name: &'static str,
    pub arguments: &'static [&'static str],
    /// Whether it has `--resume`.
    pub resumes: bool,
    /// A call that keeps a batch of work: its name, and the end of its last path.
    pub keeps: Option<(&'static str, &'static str)>,
}

pub const SWEEP: Case = Case {
    name: "sweep",
    arguments: &[
        "sweep",
        "--scene",
        "rigid",
        "--model",
        "chain",
        "--set",
        "duration=100us",
        "--vary",
        "alpha=0.5,0.7,0.9,1.1",
    ],
    resumes: true,
    keeps: Some(("fdatasync", "/state/runs.jsonl")),
};
/// Writes into the folder of reduced bodies too.
pub const REDUCED: Case = Case {
    name: "sweep, reduced",
    arguments: &[
        "sweep",
        "--scene",
        "rigid",
        "--model",
        "reduced",
        "--set",
        "duration=100us",
        "--vary",
        "alpha=0.5,0.7",
    ],
    resumes: true,
    keeps: Some(("fdatasync", "/state/runs.jsonl")),
};
pub const CALIBRATE: Case = Case {
    name: "calibrate",
    arguments: &[
        "calibrate",
        "--scene",
        "bench.toml",
        "--measured",
        "lab/vib.csv",
        "--evaluations",
        "200",
        "--fit",
        "alpha",
    ],
    resumes: true,
    keeps: Some(("rename", "/state/linear.json")),
};
pub const FEA: Case = Case {
    name: "replay --model fea",
    arguments: &[
        "replay",
        "--scene",
        "rigid",
        "--model",
        "fea",
        "--set",
        "model.mesh_density=3",
        "--set",
        "duration=10us",
        "--fields",
        "5us",
        "--checkpoint",
        "5us",
    ],
    resumes: true,
    keeps: Some(("rename", "/state/checkpoint.json")),
};
pub const COVERAGE: Case = Case {
    name: "coverage",
    arguments: &["coverage", "--scenario", "pretrigger", "--count", "1", "--evaluations", "200"],
    resumes: false,
    keeps: None,
};

const SCENE: &str = r#"extends = "annulus"
name = "bench"
description = "one bead on the annulus, short burst"
alpha = 0.6
duration = "150 us"

[chain]
beads = 1

[drive]
cycles = 5

[model]
kind = "chain"

[damping]
coefficient = 0.4
"#;

/// What is done at call K.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    None,
    Kill,
    Tear,
    Full,
    FullOnce,
    Broken,
    BrokenOnce,
}

impl Fault {
    fn word(self) -> &'static str {
        match self {
            Self::None => "count",
            Self::Kill => "kill",
            Self::Tear => "tear",
            Self::Full => "full",
            Self::FullOnce => "full-once",
            Self::Broken => "broken",
            Self::BrokenOnce => "broken-once",
        }
    }
}

/// A call that changes something, as the loaded library tells it.
#[derive(Debug, Clone)]
pub struct Change {
    pub call: String,
    pub paths: Vec<String>,
}

impl Change {
    fn is(&self, (call, end): (&str, &str)) -> bool {
        self.call == call && self.paths.last().is_some_and(|path| path.ends_with(end))
    }
}

/// The log of a run.
fn log(path: &Path) -> Vec<Change> {
    let log = fs::read_to_string(path).unwrap_or_default();
    let changes = log.lines().map(|line| {
        let mut parts = line.split('\t').skip(1).map(String::from);
        Change { call: parts.next().unwrap(), paths: parts.filter(|path| !path.is_empty()).collect() }
    });
    changes.collect()
}

/// How often the log holds that call.
pub fn count(log: &[Change], keeps: Option<(&str, &str)>) -> usize {
    log.iter().filter(|change| keeps.is_some_and(|keeps| change.is(keeps))).count()
}

/// A folder with `work`, where commands are run, `tmp` and `cache`; outside of what is counted, `log`.
pub struct Place(TempDir);

pub type Contents = BTreeMap<String, Vec<u8>>;

impl Place {
    pub fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        for folder in ["root/work", "root/tmp", "root/cache"] {
            fs::create_dir_all(place.0.path().join(folder)).unwrap();
        }
        place
    }

    /// With the scene and the record of the calibration.
    pub fn with_bench() -> Self {
        static RECORD: OnceLock<String> = OnceLock::new();
        let place = Self::new();
        fs::write(place.work("bench.toml"), SCENE).unwrap();
        let record = RECORD.get_or_init(|| record(&place));
        fs::create_dir(place.work("lab")).unwrap();
        fs::write(place.work("lab/vib.csv"), record).unwrap();
        place
    }

    /// One that is right for the case.
    pub fn of(case: &Case) -> Self {
        if case.name == CALIBRATE.name { Self::with_bench() } else { Self::new() }
    }

    /// The same files again.
    pub fn copy(&self) -> Self {
        let copy = Self::new();
        copy_below(&self.root(), &copy.root());
        copy
    }

    pub fn root(&self) -> PathBuf {
        self.0.path().join("root")
    }

    pub fn work(&self, name: &str) -> PathBuf {
        self.root().join("work").join(name)
    }

    /// Run; with it what was changed.
    pub fn run(&self, arguments: &[&[&str]], fault: Fault, at: usize) -> (Output, Vec<Change>) {
        let output = self.faulty(arguments, fault.word(), at).output().unwrap();
        (output, log(&self.0.path().join("log")))
    }

    /// Run, stopped before every change and in the middle of every write: `see` receives which, and whether it is half done. What stands
    /// on disk then is what a kill at this instant leaves.
    #[allow(clippy::zombie_processes, reason = "waited for by its number, which tells of stops too")]
    pub fn stopped(&self, arguments: &[&[&str]], mut see: impl FnMut(&Change, bool)) {
        let path = self.0.path().join("log");
        let mut command = self.faulty(arguments, "stop", 1);
        // In a group of its own: one that is orphaned with a stopped process in it is hung up.
        let child = command.process_group(0).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let process = child.id() as libc::pid_t;
        let mut seen = 0;
        loop {
            let mut status = 0;
            // SAFETY: our child, which nobody else waits for, and a place for its status.
            assert_eq!(unsafe { libc::waitpid(process, &raw mut status, libc::WUNTRACED) }, process);
            if !libc::WIFSTOPPED(status) {
                assert_eq!(status, 0, "the run that was stopped and continued failed");
                return;
            }
            let changes = log(&path);
            see(changes.last().unwrap(), changes.len() == seen);
            seen = changes.len();
            // SAFETY: the same child.
            assert_eq!(unsafe { libc::kill(process, libc::SIGCONT) }, 0);
        }
    }

    fn faulty(&self, arguments: &[&[&str]], act: &str, at: usize) -> Command {
        let log = self.0.path().join("log");
        let _ = fs::remove_file(&log);
        let mut command = self.command(arguments);
        command.env("LD_PRELOAD", library()).env("FAULTS_ROOT", self.root()).env("FAULTS_LOG", &log);
        command.env("FAULTS_AT", at.to_string()).env("FAULTS_DO", act);
        command
    }

    /// Run without counting.
    pub fn plain(&self, arguments: &[&[&str]]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn command(&self, arguments: &[&[&str]]) -> Command {
        let mut command = Command::new(program());
        command.args(arguments.concat()).args(["--threads", "1", "--quiet"]).current_dir(self.work(""));
        command.env("XDG_CACHE_HOME", self.root().join("cache")).env("TMPDIR", self.root().join("tmp"));
        command
    }

    /// Every file and folder below a folder of the root, but for times; a folder ends in `/`.
    pub fn contents(&self, folder: &str) -> Contents {
        let folder = self.root().join(folder);
        let (mut found, mut open) = (Contents::new(), vec![folder.clone()]);
        while let Some(place) = open.pop() {
            for path in fs::read_dir(place).into_iter().flatten().map(|entry| entry.unwrap().path()) {
                let name = path.strip_prefix(&folder).unwrap().display().to_string();
                if path.is_dir() {
                    found.insert(name + "/", Vec::new());
                    open.push(path);
                } else if path.file_name().unwrap() != "timing.json" {
                    found.insert(name, fs::read(&path).unwrap());
                }
            }
        }
        found
    }
}

fn copy_below(from: &Path, to: &Path) {
    for path in fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path()) {
        let copy = to.join(path.file_name().unwrap());
        if path.is_dir() {
            fs::create_dir_all(&copy).unwrap();
            copy_below(&path, &copy);
        } else {
            fs::copy(&path, &copy).unwrap();
        }
    }
}

/// A record of the bench made by the chain itself, with a regular disturbance in place of noise.
fn record(place: &Place) -> String {
    assert!(place.plain(&[&["replay", "--scene", "bench.toml", "--out", "record"]]).status.success());
    let response = fs::read_to_string(place.work("record/response.csv")).unwrap();
    let mut lines = response.lines();
    let column = lines.next().unwrap().split(',').position(|name| name == "pole_velocity_m_per_s").unwrap();
    let mut text = String::from("time_s,velocity_mm_per_s\n");
    let mut state = 1_u64;
    let mut noise = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    // 40 µs before the drive, as an oscilloscope has them; every other sample.
    for number in 0..200 {
        writeln!(text, "{},{}", f64::from(number) * 2e-7 - 40e-6, 10.0 * noise()).unwrap();
    }
    for line in lines.step_by(2) {
        let parts: Vec<f64> = line.split(',').map(|part| part.parse().unwrap()).collect();
        writeln!(text, "{},{}", parts[0], 1e3 * parts[column] + 10.0 * noise()).unwrap();
    }
    fs::remove_dir_all(place.work("record")).unwrap();
    text
}

/// The program: `GRANCHAIN`, or what cargo builds of the project.
fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        if let Some(path) = std::env::var_os("GRANCHAIN") {
            return path.into();
        }
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
        let built =
            Command::new(cargo).current_dir(&project).args(["build", "--release", "--bin", "granchain"]).status();
        assert!(built.unwrap().success());
        let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
        project.join(target).join("release/granchain")
    })
}

/// The library of this crate, which cargo puts beside its tests.
fn library() -> PathBuf {
    let tests = std::env::current_exe().unwrap();
    let found = tests.ancestors().map(|folder| folder.join("libgranchain_faults.so")).find(|path| path.is_file());
    found.expect("the library is built with the tests")
}

pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A process that ended by itself, without a panic.
pub fn ended(output: &Output) -> Result<i32, String> {
    match output.status.code() {
        Some(code) if code != 101 && !said(output).contains("panicked") => Ok(code),
        _ => Err(format!("{}: {}", output.status, said(output))),
    }
}

pub fn was_killed(output: &Output) -> bool {
    output.status.signal() == Some(9)
}

/// How a run after a fault came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recovery {
    /// By `--resume`.
    Resumed,
    /// There was nothing to resume: by the command again.
    Again,
}

/// Do what a user does after a fault; with it what the run that ended well changed.
pub fn recover(place: &Place, arguments: &[&[&str]], resumes: bool) -> Result<(Recovery, Vec<Change>), String> {
    if resumes {
        let (output, log) = place.run(&[arguments, &[&["--resume"]]].concat(), Fault::None, 0);
        match ended(&output)? {
            0 => return Ok((Recovery::Resumed, log)),
            1 if said(&output).contains("found no unfinished run") => {}
            code => return Err(format!("--resume was refused with {code}: {}", said(&output))),
        }
    }
    let (output, log) = place.run(arguments, Fault::None, 0);
    match ended(&output)? {
        0 => Ok((Recovery::Again, log)),
        code => Err(format!("the command again was refused with {code}: {}", said(&output))),
    }
}

/// Remove the results that could not be put in their place and of which the message says where they are kept: they are the user's.
pub fn drop_kept(place: &Place, message: &str) {
    for path in fs::read_dir(place.work("")).unwrap().map(|entry| entry.unwrap().path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        if name.starts_with(".out.kept-") && message.contains(name) {
            fs::remove_dir_all(&path).unwrap();
        }
    }
}

/// The numbers of the changes, without those to the result files between the first and the last two: each is written as these are.
pub fn representative(whole: &[Change]) -> Vec<usize> {
    let is_result = |change: &Change| change.paths.iter().any(|path| path.contains("/results"));
    let results: Vec<usize> = (1..=whole.len()).filter(|at| is_result(&whole[at - 1])).collect();
    let taken = |at: &usize| results.binary_search(at).map_or(true, |place| place < 8 || place + 14 > results.len());
    (1..=whole.len()).filter(taken).collect()
}

/// What is not as it should be below a folder of the root.
pub fn compare(place: &Place, folder: &str, expected: &Contents) -> Result<(), String> {
    let found = place.contents(folder);
    let differs = |name: &&String| found.get(*name) != expected.get(*name);
    let names: std::collections::BTreeSet<&String> = found.keys().chain(expected.keys()).collect();
    let differing: Vec<String> = names
        .into_iter()
        .filter(differs)
        .map(|name| match (found.get(name), expected.get(name)) {
            (Some(_), None) => format!("left over: {name}"),
            (None, _) => format!("missing: {name}"),
            _ => format!("differs: {name}"),
        })
        .collect();
    if differing.is_empty() { Ok(()) } else { Err(format!("{folder}: {}", differing.join(", "))) }
}

/// Say what failed and fail, if anything did.
pub fn judge(what: &str, failures: &[String]) {
    for failure in failures.iter().take(20) {
        println!("  ! {failure}");
    }
    assert!(failures.is_empty(), "{what}: {} failures, the first: {}", failures.len(), failures[0]);
}
