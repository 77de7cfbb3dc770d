//! `granchain start …` as a person runs it who has two files of unknown names.

use std::{fmt::Write as _, fs, path::Path};

use crate::harness::granchain;

const RECORDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/measurements/annulus-73khz/");

/// Columns of a shipped record, behind its header: time in µs, value.
fn rows(name: &str) -> Vec<(f64, f64)> {
    let text = fs::read_to_string(Path::new(RECORDS).join(name)).unwrap();
    let cells = text.lines().filter_map(|line| line.split_once(','));
    cells.filter_map(|(time, value)| Some((time.parse().ok()?, value.parse().ok()?))).collect()
}

fn write(folder: &Path, name: &str, header: &str, rows: impl Iterator<Item = Vec<f64>>) {
    let mut text = format!("{header}\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    fs::write(folder.join(name), text).unwrap();
}

/// `calibrate --dry-run` with the plan that was written.
fn looked_at(folder: &Path) -> String {
    let (code, out, err) = granchain(folder, &["calibrate", "--plan", "plan.toml", "--dry-run", "--out", "look"]);
    assert_eq!(code, 0, "{err}");
    out + &err
}

#[test]
fn two_files_of_any_name_and_order_become_a_plan_that_calibrate_takes() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(Path::new(RECORDS).join("vib.csv"), folder.path().join("a.csv")).unwrap();
    fs::copy(Path::new(RECORDS).join("horn_tip.csv"), folder.path().join("b.csv")).unwrap();
    let (code, out, err) = granchain(folder.path(), &["start", "b.csv", "a.csv", "--set", "chain.precompression=1 mN"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("last bead  a.csv") && out.contains("horn tip   b.csv") && out.contains("73.00 kHz"), "{out}");
    assert!(looked_at(folder.path()).contains("record +289 and -246 mm/s"));
    let (code, shown, _) = granchain(folder.path(), &["scene", "show", "annulus"]);
    assert_eq!(code, 0);
    let plan = fs::read_to_string(folder.path().join("plan.toml")).unwrap();
    assert!(plan.contains("\n    'chain.precompression=1 mN',\n"), "{plan}");
    // Every key of the bench stands in it once, as a choice or as given.
    for key in shown.lines().filter_map(|line| line.split_whitespace().next()).filter(|key| key.starts_with("chain.")) {
        assert_eq!(plan.matches(&format!("'{key}=")).count(), 1, "{key}: {plan}");
    }
    // The bench is drawn beside it, and checked.
    assert!(fs::read(folder.path().join("plan.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(out.contains("scene check of annulus: valid") && out.contains("mass of a bead"), "{out}");
    assert!(out.contains("granchain calibrate --plan plan.toml --out fit"), "{out}");
    // It is nobody's to overwrite.
    let (code, _, err) = granchain(folder.path(), &["start", "a.csv", "b.csv"]);
    assert!(code == 1 && err.contains("plan.toml: the file exists"), "{err}");
    assert_eq!(fs::read_to_string(folder.path().join("plan.toml")).unwrap(), plan);
}

#[test]
fn of_two_velocities_the_horn_is_the_sine_and_two_alike_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let horn = rows("horn_tip.csv");
    let slope = |pair: &[(f64, f64)]| vec![pair[0].0, 1e3 * (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)];
    write(folder.path(), "ch1.csv", "time_us,velocity_mm_per_s", horn.windows(2).map(slope));
    fs::copy(Path::new(RECORDS).join("vib.csv"), folder.path().join("ch2.csv")).unwrap();
    let (code, out, err) = granchain(folder.path(), &["start", "ch2.csv", "ch1.csv"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("last bead  ch2.csv") && out.contains("the horn's motion is a sine"), "{out}");
    let arguments = ["start", "ch2.csv", "ch2.csv", "--out", "other.toml"];
    let (code, _, err) = granchain(folder.path(), &arguments);
    assert!(code == 1 && err.contains("say which is the horn's with --horn FILE"), "{err}");
    let swapped = ["start", "ch1.csv", "ch2.csv", "--horn", "ch2.csv", "--out", "other.toml"];
    let (code, _, err) = granchain(folder.path(), &swapped);
    assert!(code == 1 && err.contains("are the two files swapped?"), "{err}");
    assert!(!folder.path().join("other.toml").exists());
    let (code, out, err) = granchain(folder.path(), &[&arguments[..], &["--horn", "ch1.csv"]].concat());
    assert!(code == 2 && err.contains("--horn ch1.csv: expected one of the two files"), "{out}{err}");
}

#[test]
fn what_was_said_of_two_channels_in_volts_is_kept_in_the_plan() {
    let folder = tempfile::tempdir().unwrap();
    let (bead, horn) = (rows("vib.csv"), rows("horn_tip.csv"));
    assert_eq!(bead.len(), horn.len());
    // 125 mm/s/V and 2 µm/V.
    let volts = bead.iter().zip(&horn).map(|(bead, horn)| vec![1e-6 * bead.0, horn.1 / 2.0, bead.1 / 125.0]);
    write(folder.path(), "scope.csv", "Time (s),CH1 (V),CH2 (V)", volts);
    let (code, _, err) = granchain(folder.path(), &["start", "scope.csv"]);
    assert!(code == 1 && err.contains("--channel 'CH1 (V)' --scale"), "{err}");
    assert!(!folder.path().join("plan.toml").exists());
    let said = [
        "--channel",
        "CH2",
        "--scale",
        "125 mm/s/V",
        "--drive-read=channel=CH1",
        "--drive-read",
        "scale=2 um/V",
        "--read=delay=3us",
    ];
    let (code, out, err) = granchain(folder.path(), &[&["start", "scope.csv"][..], &said].concat());
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("73.00 kHz"), "{out}");
    let plan = fs::read_to_string(folder.path().join("plan.toml")).unwrap();
    for line in [
        "reading.scale = '125 mm/s/V'",
        "reading.delay = '3us'",
        "drive.reading.scale = '2 um/V'",
        "drive.reading.channel = 'CH1'",
    ] {
        assert!(plan.contains(&format!("\n{line}\n")), "{line}: {plan}");
    }
    assert!(looked_at(folder.path()).contains("record +289 and -24"));
}

#[test]
fn without_files_it_says_what_to_type() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, err) = granchain(folder.path(), &["start"]);
    assert!(code == 2 && err.contains("found none; type: granchain start vib.csv horn_tip.csv"), "{err}");
}

/// The command that a refusal proposes, as a shell parts it.
fn proposed(err: &str) -> Vec<String> {
    let line = err.lines().find_map(|line| line.split_once("by values of your bench): granchain "));
    shell_words::split(line.unwrap_or_else(|| panic!("{err}")).1).unwrap()
}

fn typed_as_proposed(folder: &Path, first: &[&str]) -> String {
    let (code, _, err) = granchain(folder, first);
    assert_eq!(code, 1, "{err}");
    assert!(!err.contains("--scale '1") && !err.contains("-scale '2"), "{err}");
    let filled = |word: String| match word.as_str() {
        "<VALUE> mm/s/V" => "125 mm/s/V".into(),
        "<VALUE> um/V" => "2 um/V".into(),
        "scale=<VALUE> um/V" => "scale=2 um/V".into(),
        _ => word,
    };
    let words: Vec<String> = proposed(&err).into_iter().map(filled).collect();
    let (code, out, err) = granchain(folder, &words.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(code, 0, "{words:?}: {err}");
    out
}

#[test]
fn two_files_in_volts_list_all_that_is_missing_at_once_and_the_proposed_command_runs() {
    let folder = tempfile::tempdir().unwrap();
    let volts = |rows: Vec<(f64, f64)>, each: f64| rows.into_iter().map(move |row| vec![1e-6 * row.0, row.1 / each]);
    write(folder.path(), "first.csv", "Time (s),CH1 (V)", volts(rows("vib.csv"), 125.0));
    write(folder.path(), "second.csv", "Time (s),CH1 (V)", volts(rows("horn_tip.csv"), 2.0));
    let out = typed_as_proposed(folder.path(), &["start", "first.csv", "second.csv"]);
    assert!(
        out.contains("last bead  first.csv") && out.contains("peak 288.9 mm/s") && out.contains("73.00 kHz"),
        "{out}"
    );
    assert!(looked_at(folder.path()).contains("record +289 and -24"));
}

#[test]
fn one_file_in_volts_is_asked_for_both_its_channels_at_once() {
    // The horn's channel is told by its sine, whichever comes first.
    for horn_is_first in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let both = rows("vib.csv").into_iter().zip(rows("horn_tip.csv"));
        let volts = both.map(|(bead, horn)| {
            let (v, u) = (bead.1 / 125.0, horn.1 / 2.0);
            [vec![1e-6 * bead.0], if horn_is_first { vec![u, v] } else { vec![v, u] }].concat()
        });
        write(folder.path(), "scope.csv", "Time (s),CH1 (V),CH2 (V)", volts);
        let out = typed_as_proposed(folder.path(), &["start", "scope.csv"]);
        assert!(out.contains("horn tip   scope.csv") && out.contains("73.00 kHz"), "{out}");
        assert!(looked_at(folder.path()).contains("record +289 and -24"));
    }
}

#[test]
fn another_frequency_and_other_beads_become_a_plan_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let slower = |rows: Vec<(f64, f64)>| rows.into_iter().map(|row| vec![1.46 * row.0, row.1]);
    write(folder.path(), "vib.csv", "time_us,velocity_mm_per_s", slower(rows("vib.csv")));
    write(folder.path(), "horn.csv", "time_us,displacement_um", slower(rows("horn_tip.csv")));
    let bench = ["--scene", "rigid", "--set", "chain.beads=8", "--set", "chain.radius=1mm"];
    let (code, out, err) = granchain(folder.path(), &[&["start", "vib.csv", "horn.csv"][..], &bench].concat());
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("50.00 kHz") && out.contains("length of the chain             16 mm"), "{out}");
    looked_at(folder.path());
}

#[test]
fn a_scene_with_a_striker_is_left_to_granchain_impact_and_still_replayed() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, instead) in [
        (&["start", "hit.csv", "--scene", "impact"][..], "granchain-impact fit"),
        (&["calibrate", "--measured", "hit.csv", "--scene", "impact"], "granchain-impact fit"),
        (&["calibrate", "--measured", "hit.csv", "--scene", "impact", "--fit", "support_loss"], "granchain-impact fit"),
    ] {
        let (code, _, err) = granchain(folder.path(), arguments);
        assert!(code == 2 && err.contains(instead) && err.lines().count() <= 3, "{arguments:?}: {code} {err}");
    }
    let (code, _, err) = granchain(folder.path(), &["replay", "--scene", "impact", "--out", "run", "--quiet"]);
    assert_eq!(code, 0, "{err}");
    assert!(fs::read_to_string(folder.path().join("run/response.csv")).unwrap().contains("sensor_force_n"));
}
