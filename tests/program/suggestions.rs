//! Every command that a refused file makes the program propose, typed as it is printed.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::harness::PROJECT;

/// Commands typed after one another until a file is read.
const MOST_TYPED: usize = 3;

/// Standard error of a line in a shell that finds the program, and whether it succeeded.
fn typed(line: &str) -> (bool, String) {
    let folder = Path::new(env!("CARGO_BIN_EXE_granchain")).parent().unwrap();
    let path = env::join_paths(
        [folder.to_path_buf()].into_iter().chain(env::split_paths(&env::var_os("PATH").unwrap_or_default())),
    );
    let output =
        Command::new("sh").args(["-c", line]).current_dir(PROJECT).env("PATH", path.unwrap()).output().unwrap();
    (output.status.success(), String::from_utf8(output.stderr).unwrap())
}

/// The command that a message proposes, with values of this bench in place of what it says to replace.
fn proposed(message: &str, line: &str) -> Option<String> {
    let (_, command) =
        message.lines().find_map(|line| line.trim_start().strip_prefix("then type (")?.split_once("): "))?;
    // What was typed comes back as it was, and flags after it.
    let flags = command.strip_prefix(line).unwrap_or_else(|| panic!("{line}\n{command}"));
    // The last of the columns that are listed: a first one without a unit may be a counter.
    let columns = ["expected one column to read", "; found the columns"]
        .into_iter()
        .find_map(|said| message.split_once(said))
        .map_or("", |(_, rest)| rest.split(';').next().unwrap());
    let name = columns.rsplit('`').nth(1).unwrap_or_default();
    // The last part of several.
    let count: String = message
        .split_once(" to read, found ")
        .map_or("", |(_, rest)| rest)
        .chars()
        .take_while(char::is_ascii_digit)
        .collect();
    let flags = flags
        .replace("dataset=N", &format!("dataset={count}"))
        .replace("<VALUE> mm/s/V", "100 mm/s/V")
        .replace("<VALUE> um/V", "2 um/V")
        .replace("<VALUE> mV/MPa", "50 mV/MPa")
        .replace("time_unit=UNIT", "time_unit=us")
        .replace("--unit UNIT", "--unit mm/s")
        .replace("=UNIT", "=um")
        .replace("sample_rate=RATE", "sample_rate=5MHz")
        .replace("--sample-rate RATE", "--sample-rate 2MHz")
        .replace("NAME", &format!("'{name}'"));
    assert!(!flags.contains('<') && !flags.contains("UNIT") && !flags.contains("RATE"), "{flags}");
    let mut seen: Vec<&str> = Vec::new();
    for word in flags.split(' ').filter(|word| word.starts_with("--") && !word.ends_with("read")) {
        assert!(!seen.contains(&word) && !line.contains(&format!("{word} ")), "{word} twice: {line}{flags}");
        seen.push(word);
    }
    Some(format!("{line}{flags}"))
}

/// Types `line` and what is then proposed; the last message if it ends in a refusal without a proposal.
fn follow(line: &str) -> Result<usize, String> {
    let mut line = line.to_owned();
    for count in 0..=MOST_TYPED {
        let (read, message) = typed(&line);
        if read {
            return Ok(count);
        }
        line = proposed(&message, &line).ok_or(message)?;
    }
    panic!("no end of proposals: {line}");
}

/// Files that no flag makes a record of a vibrometer: the beginning of what they are refused with.
const REFUSED: [(&str, &str); 6] = [
    ("gwinstek-fast.csv", "the file has converter counts, not volts"),
    ("rto.csv", "expected samples, found settings alone"),
    ("spectrum.csv", "found a spectrum"),
    ("falling.csv", "the instants fall or jump"),
    ("contradiction.h5", "they contradict each other"),
    ("contradiction.npz", "they contradict each other"),
];

/// The files of the project, and some that are written: without a header, with names alone, in counts of time.
fn files(folder: &Path) -> Vec<PathBuf> {
    let rows = |header: &str, row: &dyn Fn(usize) -> String| {
        (0..200).fold(format!("{header}\n"), |text, i| format!("{text}{}\n", row(i))).trim_start().to_owned()
    };
    let wave = |i: usize| 3.0 * (0.4 * i as f64).sin();
    for (name, text) in [
        ("headerless.csv", rows("", &|i| format!("{},{:.4}", i, wave(i)))),
        ("headerless-four.txt", rows("", &|i| format!("{}\t{:.4}\t{:.4}\t{:.4}", i, wave(i), -wave(i), 0.5 * wave(i)))),
        ("headerless-values.csv", rows("", &|i| format!("{:.4},{:.4}", wave(i), -wave(i)))),
        ("untimed.csv", rows("CH1,CH2,Start,Increment,", &|i| format!("{:.4},{:.4},", wave(i), -wave(i)))),
        ("names-alone.csv", rows("Time,Signal", &|i| format!("{i},{:.4}", wave(i)))),
        (
            "it's two words.csv",
            rows("sec,Volt1,Volt2", &|i| format!("{:.6},{:.4},{:.4}", 1e-6 * i as f64, wave(i), -wave(i))),
        ),
        (
            "remark.lvm",
            rows("X_Value\tvibrometer (V)\tComment", &|i| format!("{:.6}\t{:.4}", 1e-6 * i as f64, wave(i))),
        ),
        ("spectrum.csv", rows("Frequency (Hz),Magnitude (dB)", &|i| format!("{},{:.2}", 100 * (i + 1), -wave(i)))),
        ("falling.csv", rows("time_us,velocity_mm_per_s", &|i| format!("{},{:.4}", 300 - i, wave(i)))),
    ] {
        fs::write(folder.join(name), text).unwrap();
    }
    let of = |folder: PathBuf| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = ["tests/dialects", "tests/instruments"]
        .into_iter()
        .flat_map(|name| of(Path::new(PROJECT).join(name)))
        .chain(of(folder.to_path_buf()))
        .filter(|path| path.extension().is_some_and(|extension| extension != "py"))
        .collect();
    files.sort();
    files
}

fn shell_word(path: &Path) -> String {
    granchain::measurement::shell_word(path.to_str().unwrap()).into_owned()
}

#[test]
fn every_proposal_of_inspect_reads_its_file() {
    let place = tempfile::tempdir().unwrap();
    let mut followed = 0;
    for path in files(place.path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let outcome = follow(&format!("granchain inspect {}", shell_word(&path)));
        match (&outcome, REFUSED.iter().find(|(refused, _)| *refused == name)) {
            (Ok(count), None) => followed += count,
            (Err(message), Some((_, expected))) if message.contains(expected) => {}
            _ => panic!("{name}: {outcome:?}"),
        }
    }
    assert!(followed > 30, "{followed}");
}

#[test]
fn every_proposal_of_calibrate_goes_on_to_the_fit() {
    let place = tempfile::tempdir().unwrap();
    let mut followed = 0;
    for path in files(place.path()) {
        // The scene takes the place of a horn's record; what comes after reading is another matter than the file.
        let line = format!("granchain calibrate --measured {} --drive none --dry-run", shell_word(&path));
        let mut line = line;
        for _ in 0..=MOST_TYPED {
            let (read, message) = typed(&format!("{line} --out {}", shell_word(&place.path().join("out"))));
            if read {
                break;
            }
            let out = format!(" --out {}", shell_word(&place.path().join("out")));
            match proposed(&message.replace(&out, ""), &line) {
                Some(next) => (line, followed) = (next, followed + 1),
                None => break,
            }
        }
    }
    assert!(followed > 30, "{followed}");
}

#[test]
fn every_proposal_of_a_drive_s_record_reads_it() {
    let place = tempfile::tempdir().unwrap();
    let wave = |i: usize| (2.0 * std::f64::consts::PI * 73e3 * 2e-7 * i as f64).sin();
    let mut followed = 0;
    for (name, header, row) in [
        (
            "lower.csv",
            "time_us,horn_v,other_v",
            (&|i| format!("{:.1},{:.5},0", 0.2 * i as f64, wave(i))) as &dyn Fn(usize) -> String,
        ),
        ("two.csv", "time_us,left_v,right_v", &|i| {
            format!("{:.1},{:.5},{:.5}", 0.2 * i as f64, wave(i), 0.5 * wave(i))
        }),
        ("headerless.csv", "", &|i| format!("{:.1},{:.5},0", 0.2 * i as f64, wave(i))),
        ("untimed.csv", "displacement_um", &|i| format!("{:.5}", wave(i))),
        ("open.csv", "time,my signal", &|i| format!("{:.1},{:.5}", 0.2 * i as f64, wave(i))),
        ("axis.csv", "my axis,displacement_um", &|i| format!("{:.1},{:.5}", 0.2 * i as f64, wave(i))),
    ] {
        let text = (0..3000).fold(format!("{header}\n"), |text, i| format!("{text}{}\n", row(i)));
        let path = place.path().join(name);
        fs::write(&path, text.trim_start()).unwrap();
        let out = place.path().join(format!("out-{name}"));
        let line = format!(
            "granchain calibrate --dry-run --measured measurements/annulus-73khz/vib.csv --out {} --drive {}",
            shell_word(&out),
            shell_word(&path)
        );
        followed += follow(&line).unwrap_or_else(|message| panic!("{name}: {message}"));
    }
    assert!(followed >= 6, "{followed}");
}
