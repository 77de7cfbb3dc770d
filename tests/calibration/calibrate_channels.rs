//! Both channels of a bench in one file, and a bench whose sensitivities are typed once.

use std::{fmt::Write as _, fs, path::Path};

use crate::harness::{PROJECT, granchain};

/// One column of a shipped record.
fn column(name: &str) -> Vec<(String, f64)> {
    let text = fs::read_to_string(Path::new(PROJECT).join("measurements/twin-annulus").join(name)).unwrap();
    let rows = text.lines().filter(|line| line.starts_with(|first: char| first == '-' || first.is_ascii_digit()));
    let cells = |row: &str| row.split_once(',').map(|(time, value)| (time.to_owned(), value.parse().unwrap())).unwrap();
    rows.map(cells).collect()
}

/// What an oscilloscope writes of the synthetic record's bench: seconds and volts of both vibrometers.
fn scope(names: [&str; 2]) -> String {
    let (vibrometer, horn) = (column("vib.csv"), column("horn_tip.csv"));
    let mut text = format!("Time (us),{} (V),{} (V)\n", names[0], names[1]);
    for ((time, velocity), (same, displacement)) in vibrometer.iter().zip(&horn) {
        assert_eq!(time.parse::<f64>().unwrap(), same.parse::<f64>().unwrap());
        // 125 mm/s/V and 2 µm/V.
        writeln!(text, "{time},{:.9},{:.9}", velocity / 125.0, displacement / 2000.0).unwrap();
    }
    text
}

/// Peaks and correlation that a dry run prints, and what was assumed.
fn dry_run(folder: &Path, arguments: &[&str]) -> (String, String) {
    let common = ["calibrate", "--scene", "annulus", "--model", "chain", "--dry-run", "--force", "--out", "seen"];
    let stated = ["--drive-frequency", "73kHz"];
    let (code, out, err) = granchain(folder, &[&common[..], &stated, arguments].concat());
    assert_eq!(code, 0, "{err}");
    (out.lines().find(|line| line.contains("correlation")).unwrap().to_owned(), err)
}

#[test]
fn two_channels_of_one_file_are_the_two_files() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let synthetic = format!("{PROJECT}/measurements/twin-annulus/vib.csv");
    // The synthetic record's files state a bandwidth; the scope's do not.
    let bandwidth = ["--read", "bandwidth=1.5MHz"];
    let (apart, _) = dry_run(place.path(), &["--measured", &synthetic]);

    fs::write(at("scope.csv"), scope(["CH2", "CH1"])).unwrap();
    let flags =
        ["--channel", "CH2", "--scale", "125 mm/s/V", "--drive-read", "channel=CH1", "--drive-read", "scale=2 um/V"];
    let (one, _) = dry_run(place.path(), &[&["--measured", "scope.csv"], &flags[..], &bandwidth].concat());
    assert_eq!(one, apart);
    // Whatever else lies beside.
    fs::write(at("horn_tip.csv"), "time_us,displacement_nm\n0,1\n").unwrap();
    let (one, _) = dry_run(place.path(), &[&["--measured", "scope.csv"], &flags[..], &bandwidth].concat());
    assert_eq!(one, apart);
    fs::remove_file(at("horn_tip.csv")).unwrap();
    let named = ["--measured", "scope.csv", "--drive", "scope.csv"];
    assert_eq!(dry_run(place.path(), &[&named, &flags[..], &bandwidth].concat()).0, apart);

    // As short as the names allow.
    fs::write(at("named.csv"), scope(["Vibrometer", "Horn tip"])).unwrap();
    let scales = ["--scale", "125 mm/s/V", "--drive-read", "scale=2 um/V"];
    let (short, assumed) = dry_run(place.path(), &[&["--measured", "named.csv"], &scales[..], &bandwidth].concat());
    assert_eq!(short, apart);
    let usual = "assumed of named.csv:\n";
    assert!(
        assumed.contains(usual)
            && assumed.contains("  as nothing else is stated: no full scale, t = 0 is the trigger, no delay"),
        "{assumed}"
    );
    assert!(assumed.contains("assumed: drive: channel `Horn tip (V)` of named.csv"), "{assumed}");

    // Typed once: in a plan, and in a bench file.
    let plan = "measured = \"scope.csv\"\n[reading]\nchannel = \"CH2\"\nscale = \"125 mm/s/V\"\nbandwidth = \"1.5 MHz\"\n\
                [drive.reading]\nchannel = \"CH1\"\nscale = \"2 um/V\"\n";
    fs::write(at("plan.toml"), plan).unwrap();
    assert_eq!(dry_run(place.path(), &["--plan", "plan.toml"]).0, apart);
    let bench = "[vibrometer]\nchannel = \"CH2\"\nscale = \"125 mm/s/V\"\nbandwidth = \"1.5 MHz\"\n\
                 [horn-tip]\nchannel = \"CH1\"\nscale = \"2 um/V\"\n";
    fs::write(at("bench.toml"), bench).unwrap();
    assert_eq!(dry_run(place.path(), &["--measured", "scope.csv", "--bench", "bench.toml"]).0, apart);
    fs::write(at("by-bench.toml"), "measured = \"scope.csv\"\nbench = \"bench.toml\"\n").unwrap();
    assert_eq!(dry_run(place.path(), &["--plan", "by-bench.toml"]).0, apart);
    // A flag wins.
    let (turned, _) = dry_run(place.path(), &["--plan", "plan.toml", "--read", "invert=true"]);
    assert_ne!(turned, apart);
}

#[test]
fn what_is_missing_of_either_channel_is_said_with_the_whole_command() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("scope.csv"), scope(["CH2", "CH1"])).unwrap();
    let run = |arguments: &[&str]| {
        let (code, _, err) = granchain(place.path(), arguments);
        assert_eq!(code, 1, "{err}");
        err
    };
    let err = run(&["calibrate", "--measured", "scope.csv"]);
    let whole = "by values of your bench): granchain calibrate --measured scope.csv --channel 'CH2 (V)' --scale '<VALUE> mm/s/V'";
    assert!(err.contains(whole), "{err}");
    let err = run(&[
        "calibrate",
        "--measured",
        "scope.csv",
        "--channel",
        "CH2",
        "--scale",
        "125 mm/s/V",
        "--drive-read",
        "channel=CH1",
    ]);
    assert!(err.contains("pass it as --drive-read scale='<VALUE> um/V' or '<VALUE> mm/s/V'"), "{err}");
    assert!(err.contains("--drive-read channel=CH1 --drive-read scale='<VALUE> um/V'"), "{err}");
    fs::write(place.path().join("plan.toml"), "measured = \"scope.csv\"\n[drive.reading]\nscale = \"2 um\"\n").unwrap();
    let err = run(&["calibrate", "--plan", "plan.toml"]);
    assert!(err.contains("plan.toml: [drive.reading] `scale`"), "{err}");
}
