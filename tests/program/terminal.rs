//! What a terminal shows: no line wider than 80 columns, no more digits than mean something, the model by its name.

use std::{path::Path, process::Command};

use crate::harness::{PROJECT, code, stderr, stdout};

fn on_terminal(folder: &Path, words: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    let words = shell_words::split(words).unwrap();
    let output = command.args(words).env("COLUMNS", "80").current_dir(folder).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    stdout(&output) + &stderr(&output)
}

/// A folder with the shipped synthetic record's two files.
fn bench() -> tempfile::TempDir {
    let bench = tempfile::tempdir().unwrap();
    for file in ["vib.csv", "horn_tip.csv"] {
        std::fs::copy(Path::new(PROJECT).join("measurements/twin-annulus").join(file), bench.path().join(file))
            .unwrap();
    }
    bench
}

const COMMANDS: [&str; 20] = [
    "start vib.csv horn_tip.csv",
    "calibrate --measured vib.csv --model chain --dry-run --out look",
    "inspect vib.csv",
    "inspect .",
    "spectrum vib.csv",
    "scene list",
    "scene show annulus",
    "scene show water",
    "scene keys",
    "scene check annulus",
    "scene explain water",
    "replay --scene annulus --model chain --ensemble 2",
    "replay --scene water --set duration=60us",
    "replay --scene rigid --accuracy 5%",
    "sweep --scene annulus --model chain --vary alpha=0.3,0.5 --vary damping.coefficient=0.3,0.37",
    "sweep --scene water --vary drive.amplitude=1um,2um",
    "mesh --scene annulus --density 6",
    "accuracy --scene rigid",
    "scene explain rigid --measure",
    "doctor",
];

/// The longest run of digits behind a decimal point, leading zeros aside.
fn most_digits(line: &str) -> usize {
    let decimals = line.split('.').skip(1);
    let digits = decimals.map(|rest| rest.chars().take_while(char::is_ascii_digit).collect::<String>());
    digits.map(|digits| digits.trim_start_matches('0').len()).max().unwrap_or(0)
}

#[test]
fn no_line_is_wider_than_80_columns_and_no_number_has_more_than_8_digits_behind_its_point() {
    let bench = bench();
    let mut wrong = Vec::new();
    for command in COMMANDS {
        for line in on_terminal(bench.path(), command).lines() {
            let to_type = line.trim_start().starts_with("granchain ");
            let unbreakable = line.split_whitespace().any(|word| word.len() >= 64);
            if line.chars().count() > 80 && !to_type && !unbreakable {
                wrong.push(format!("{command}: {} columns: {line}", line.chars().count()));
            }
            // Comments and first lines of a file are shown as they stand there.
            if most_digits(line) > 8 && !line.starts_with("  # ") && !line.starts_with("  | ") {
                wrong.push(format!("{command}: digits: {line}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn help_keeps_to_80_columns_and_begins_with_what_comes_first() {
    let folder = tempfile::tempdir().unwrap();
    let commands = on_terminal(folder.path(), "--help");
    let names = commands.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<&str> = names
        .filter(|line| !line.starts_with("    "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert_eq!(&names[..4], ["start", "inspect", "convert", "spectrum"]);
    let mut wrong = Vec::new();
    for name in names {
        let help = on_terminal(folder.path(), &format!("{name} --help"));
        wrong.extend(
            help.lines()
                .filter(|line| line.chars().count() > 80 && !line.trim_start().starts_with("granchain "))
                .map(|line| format!("{name}: {line}")),
        );
        assert!(help.contains("Example"), "{name}: {help}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_run_names_its_model() {
    let bench = bench();
    for (command, model) in [
        ("replay --scene rigid --model chain", "  model      chain: Hertz contacts, adaptive steps"),
        ("replay --scene rigid", "  model      reduced: mesh density 16"),
        (
            "replay --scene rigid --model fea --set model.mesh_density=3 --set duration=10us",
            "  model      fea: mesh density 3, trapezoid",
        ),
        ("sweep --scene rigid --model chain --vary alpha=0.5,1", "Model chain: Hertz contacts"),
        ("calibrate --measured vib.csv --model chain --dry-run --out look", "Uncalibrated response of the chain"),
    ] {
        let shown = on_terminal(bench.path(), command);
        assert!(shown.lines().any(|line| line.contains(model)), "{command}: {shown}");
    }
}
