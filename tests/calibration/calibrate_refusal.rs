//! Broken input through `calibrate`: exit code 1, a message that says where, what was expected and what to do, and no
//! trace of an outcome.

use std::{fs, path::Path};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};

/// One way to break an experiment.
struct Case {
    name: &'static str,
    /// Prepare the broken file; `lab/broken.csv` unless the flags say otherwise.
    prepare: fn(&Path),
    /// Flags that bring it in.
    flags: &'static [&'static str],
    /// What the message must say: where, what was expected, what to do.
    phrases: &'static [&'static str],
}

const MEASURED: &[&str] = &["--measured", "lab/broken.csv"];
const DRIVE: &[&str] = &["--measured", "lab/vib.csv", "--drive", "lab/broken.csv"];
const SCENE: &[&str] = &["--measured", "lab/vib.csv", "--scene", "broken.toml"];

/// The good record with its lines changed.
fn lines(place: &Path, change: impl Fn(&mut Vec<String>)) {
    let text = fs::read_to_string(place.join("lab/vib.csv")).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    change(&mut lines);
    fs::write(place.join("lab/broken.csv"), lines.join("\n") + "\n").unwrap();
}

/// Line 10 (from 1) with another cell of velocity.
fn cell(place: &Path, text: &str) {
    lines(place, |lines| {
        let time = lines[9].split(',').next().unwrap().to_owned();
        lines[9] = format!("{time},{text}");
    });
}

fn header(place: &Path, text: &str) {
    lines(place, |lines| lines[0] = text.into());
}

fn scene(place: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(place.join("bench.toml")).unwrap();
    assert!(text.contains(from));
    fs::write(place.join("broken.toml"), text.replacen(from, to, 1)).unwrap();
}

/// A horn-tip record of so many cycles of 73 kHz at so many samples a cycle.
fn horn(place: &Path, cycles: f64, samples: f64) {
    let step = 1.0 / (73e3 * samples);
    let count = (300e-6 / step) as i32;
    let row = |index: i32| {
        let time = f64::from(index) * step;
        let on = (0.0..cycles / 73e3).contains(&time);
        let value = if on { (std::f64::consts::TAU * 73e3 * time).sin() } else { 0.0 };
        format!("{:.9e},{value:.6}\n", time)
    };
    let rows: String = (-20..count).map(row).collect();
    fs::write(place.join("lab/broken.csv"), "time_s,displacement_um\n".to_owned() + &rows).unwrap();
}

const CASES: &[Case] = &[
    Case {
        name: "empty file",
        prepare: |place| fs::write(place.join("lab/broken.csv"), "").unwrap(),
        flags: MEASURED,
        phrases: &["lab/broken.csv", "expected a header", "empty", "export it again"],
    },
    Case {
        name: "header only",
        prepare: |place| lines(place, |lines| lines.truncate(1)),
        flags: MEASURED,
        phrases: &["lab/broken.csv:1", "expected rows", "record again"],
    },
    Case {
        name: "a record of another drive beside the horn's",
        prepare: |place| {
            horn(place, 20.0, 40.0);
            // 35 of 73 kHz is near a half.
            let row = |index: i32| {
                let (time, envelope) = (f64::from(index) * 2e-7, (f64::from(index.clamp(0, 600)) / 600.0));
                let tone = |multiple: f64| (std::f64::consts::TAU * 35e3 * multiple * time).sin();
                format!("{:.1},{:.4}\n", 1e6 * time, 80.0 * envelope * (tone(1.0) + 0.5 * tone(2.0)))
            };
            let rows: String = (-200..3000).map(row).collect();
            fs::write(place.join("elsewhere.csv"), format!("time_us,velocity_mm_per_s\n{rows}")).unwrap();
        },
        flags: &["--measured", "elsewhere.csv", "--drive", "lab/broken.csv"],
        phrases: &[
            "elsewhere.csv",
            "lines of a drive at 73.0",
            "as in lab/broken.csv",
            "strongest line at 34.99",
            "--drive",
        ],
    },
    Case {
        name: "text in a number column",
        prepare: |place| cell(place, "hello"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:10: column `velocity_mm_per_s`", "expected a number", "`hello`", "correct the cell"],
    },
    Case {
        name: "NaN",
        prepare: |place| cell(place, "NaN"),
        flags: MEASURED,
        phrases: &[
            "lab/broken.csv:10: column `velocity_mm_per_s`",
            "expected a finite number",
            "--read missing=interpolate",
        ],
    },
    Case {
        name: "infinity",
        prepare: |place| cell(place, "inf"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:10: column `velocity_mm_per_s`", "expected a finite number", "record it again"],
    },
    Case {
        name: "missing column",
        prepare: |place| header(place, "time_us,pressure_kPa"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:1: column `pressure_kPa`", "expected a velocity", "--channel"],
    },
    Case {
        name: "ragged row",
        prepare: |place| cell(place, "1.0,2.0"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:10", "expected 2 cells", "found 3", "complete the row"],
    },
    Case {
        name: "unknown unit",
        prepare: |place| header(place, "time_us,Velocity [furlong/h]"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:1: column `Velocity [furlong/h]`", "furlong/h", "--unit"],
    },
    Case {
        name: "bare volts",
        prepare: |place| header(place, "time_us,signal_V"),
        flags: MEASURED,
        phrases: &["lab/broken.csv:1: column `signal_V`", "expected a velocity", "volts", "sensitivity"],
    },
    Case {
        name: "repeated time",
        prepare: |place| lines(place, |lines| lines[9] = lines[8].clone()),
        flags: MEASURED,
        phrases: &["lab/broken.csv:10: column `time_us`", "expected a time later than", "the row is there twice"],
    },
    Case {
        name: "decreasing time",
        prepare: |place| lines(place, |lines| lines.swap(9, 20)),
        flags: MEASURED,
        phrases: &["lab/broken.csv:11: column `time_us`", "expected a time later than", "the instants fall or jump"],
    },
    Case {
        name: "uneven sampling",
        prepare: |place| lines(place, |lines| drop(lines.drain(30..33))),
        flags: MEASURED,
        phrases: &["lab/broken.csv:31: column `time_us`", "the samples are not evenly spaced", "restore the rows"],
    },
    Case {
        name: "truncated last line",
        prepare: |place| {
            lines(place, |_| {});
            let text = fs::read_to_string(place.join("lab/broken.csv")).unwrap();
            let cut = text.trim_end().rfind(',').unwrap();
            fs::write(place.join("lab/broken.csv"), &text[..cut]).unwrap();
        },
        flags: MEASURED,
        phrases: &["lab/broken.csv:2302", "expected 2 cells", "found 1", "copy it again"],
    },
    Case {
        name: "binary file",
        prepare: |place| fs::write(place.join("lab/broken.csv"), b"\x7fELF\x02\x01\x00\x00\xff\xfe").unwrap(),
        flags: MEASURED,
        phrases: &["lab/broken.csv", "expected text, found byte 0x7f", "export the record as CSV"],
    },
    Case {
        name: "missing file",
        prepare: |_| {},
        flags: &["--measured", "lab/vub.csv"],
        phrases: &["lab/vub.csv", "expected a record", "no such file", "`vib.csv`"],
    },
    Case {
        name: "a folder",
        prepare: |_| {},
        flags: &["--measured", "lab"],
        phrases: &["lab: expected a file, found a folder", "`vib.csv`"],
    },
    Case {
        name: "a missing drive",
        prepare: |_| {},
        flags: DRIVE,
        phrases: &["lab/broken.csv", "no such file", "check the path"],
    },
    Case {
        name: "drive shorter than two cycles",
        prepare: |place| horn(place, 1.5, 60.0),
        flags: DRIVE,
        phrases: &["lab/broken.csv", "expected a drive of at least two cycles", "record a longer burst"],
    },
    Case {
        name: "drive sampled below 4 times its frequency",
        prepare: |place| horn(place, 15.0, 3.7),
        flags: &["--measured", "lab/vib.csv", "--drive", "lab/broken.csv", "--drive-frequency", "73kHz"],
        phrases: &["lab/broken.csv", "needs a sample rate of at least", "record it faster"],
    },
    Case {
        name: "record sampled below 4 times the drive",
        prepare: |place| {
            lines(place, |lines| {
                let mut index = 0;
                lines.retain(|line| {
                    index += 1;
                    line.starts_with("time") || index % 18 == 0
                });
            });
        },
        flags: MEASURED,
        phrases: &["lab/broken.csv", "needs a sample rate of at least", "the record has 277.8 kHz", "record it faster"],
    },
    Case {
        name: "scene with an unknown key",
        prepare: |place| scene(place, "beads = 2", "beads = 2\nraduis = \"0.5 mm\""),
        flags: SCENE,
        phrases: &["broken.toml:9", "raduis", "radius"],
    },
    Case {
        name: "negative radius",
        prepare: |place| scene(place, "beads = 2", "beads = 2\nradius = \"-0.5 mm\""),
        flags: SCENE,
        phrases: &["broken.toml:9", "chain.radius", "expected"],
    },
    Case {
        name: "no beads",
        prepare: |place| scene(place, "beads = 2", "beads = 0"),
        flags: SCENE,
        phrases: &["broken.toml:8", "chain.beads", "expected"],
    },
    Case {
        name: "two beads overlapping at the start",
        prepare: |place| scene(place, "beads = 2", "beads = 2\ngaps = [0, -1e-6, 0]"),
        flags: SCENE,
        phrases: &["broken.toml:9", "chain.gaps", "overlap"],
    },
    Case {
        name: "a record that ends before its onset can be followed",
        prepare: |place| lines(place, |lines| lines.truncate(480)),
        flags: MEASURED,
        phrases: &["lab/broken.csv", "drive periods after its onset", "record longer"],
    },
    Case {
        name: "a disconnected input",
        prepare: |place| {
            lines(place, |lines| {
                for line in lines.iter_mut().skip(1) {
                    *line = format!("{},7.0", line.split(',').next().unwrap());
                }
            });
        },
        flags: MEASURED,
        phrases: &["lab/broken.csv", "every sample", "connected"],
    },
    Case {
        name: "m/s written for mm/s",
        prepare: |place| header(place, "time_us,velocity_m_per_s"),
        flags: MEASURED,
        phrases: &["lab/broken.csv", "at most 50 m/s, found", "--unit, such as mm/s"],
    },
];

#[test]
fn broken_input_is_refused_with_place_reason_and_remedy_and_leaves_no_folder() {
    let bench = Bench::new();
    let place = bench.path(".");
    let mut wrong = Vec::new();
    for Case { name, prepare, flags, phrases } in CASES {
        let _ = fs::remove_file(bench.path("lab/broken.csv"));
        prepare(&place);
        let before = bench.tree();
        let mut command = bench.granchain(&["calibrate", "--quiet", "--evaluations", "200"]);
        if !flags.contains(&"--scene") {
            command.args(["--scene", "bench.toml"]);
        }
        let output = command.args(*flags).output().unwrap();
        let said = stderr(&output);
        let missing: Vec<&&str> = phrases.iter().filter(|expected| !said.contains(**expected)).collect();
        if code(&output) != 1 || !output.stdout.is_empty() || !said.starts_with("error: ") || !missing.is_empty() {
            wrong.push(format!("{name}: exit code {}, missing {missing:?} in: {said}", code(&output)));
        }
        if bench.tree() != before {
            wrong.push(format!("{name}: left {:?}", bench.tree()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
