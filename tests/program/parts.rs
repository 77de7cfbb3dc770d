//! `--part K/N` and `merge`: parts that any worker may run give the bytes of the whole run. With a real cluster: `tests/cluster/run`.

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use serde_json::{Value, json};

use super::harness::{code, granchain, stderr};

const SWEEP: [&str; 8] = ["sweep", "--scene", "annulus", "--model", "chain", "--vary", "alpha=0.3:0.9:0.1", "--quiet"];

/// Run part `number` of `of` of a command into `NUMBER.part`.
fn part(folder: &Path, command: &[&str], number: usize, of: usize) {
    let (part, file) = (format!("{number}/{of}"), format!("{number}.part"));
    let (code, _, error) = granchain(folder, &[command, &["--part", &part, "--out", &file]].concat());
    assert_eq!(code, 0, "{error}");
}

/// Every file of a folder but the times.
fn bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let kept = entries.filter(|path| path.is_file() && !["timing.json", ".granchain"].contains(&name(path).as_str()));
    kept.map(|path| (name(&path), fs::read(&path).unwrap())).collect()
}

fn refused(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let (code, _, error) = granchain(folder, arguments);
    assert_eq!(code, 1, "{arguments:?}: {error}");
    for text in expected {
        assert!(error.contains(text), "{arguments:?}: expected `{text}` in\n{error}");
    }
}

/// A part file with `change` made in it.
fn forged(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut file: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    change(&mut file);
    fs::write(path, serde_json::to_vec(&file).unwrap()).unwrap();
}

#[test]
fn parts_run_in_any_order_and_twice_give_the_bytes_of_the_whole_run() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let (code, here, _) = granchain(folder, &[&SWEEP[..], &["--out", "here"]].concat());
    assert_eq!(code, 0);
    for number in [3, 1] {
        part(folder, &SWEEP, number, 3);
    }
    refused(folder, &["merge", "1.part", "3.part", "--out", "far"], &["expected 3 parts, found 2", "missing: 2/3"]);
    let kept = fs::read(folder.join("1.part")).unwrap();
    // Other threads change nothing, and a part that is there is not run again.
    part(folder, &[&SWEEP[..], &["--threads", "1"]].concat(), 1, 3);
    assert_eq!(fs::read(folder.join("1.part")).unwrap(), kept);
    part(folder, &SWEEP, 2, 3);
    let (code, far, error) = granchain(folder, &["merge", "2.part", "3.part", "1.part", "--out", "far", "--quiet"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(far, here);
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("here")));
    assert_eq!(fs::read(folder.join("1.part")).unwrap(), kept, "parts stay");
    refused(folder, &["merge", "1.part", "./1.part", "--out", "far"], &["part 1/3 was given already"]);
}

#[test]
fn parts_of_different_commands_inputs_or_numbers_are_not_merged() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let drive = super::harness::PROJECT.to_owned() + "/measurements/twin-annulus/horn_tip.csv";
    let drive = fs::read_to_string(drive).unwrap();
    fs::write(folder.join("horn.csv"), &drive).unwrap();
    let driven = [&SWEEP[..], &["--drive", "horn.csv"]].concat();
    part(folder, &driven, 1, 3);
    part(folder, &SWEEP, 2, 3);
    refused(folder, &["merge", "1.part", "2.part", "--out", "far"], &["2.part", "same work as 1.part", "part 2/3"]);
    fs::remove_file(folder.join("2.part")).unwrap();
    part(folder, &driven, 2, 2);
    refused(folder, &["merge", "1.part", "2.part", "--out", "far"], &["another number of parts"]);
    fs::remove_file(folder.join("2.part")).unwrap();
    fs::write(folder.join("horn.csv"), drive.replacen("0.0", "0.1", 1) + "\n").unwrap();
    part(folder, &driven, 2, 3);
    refused(folder, &["merge", "1.part", "2.part", "--out", "far"], &["other inputs"]);
    fs::write(folder.join("horn.csv"), &drive).unwrap();
    fs::remove_file(folder.join("2.part")).unwrap();
    for number in [2, 3] {
        part(folder, &driven, number, 3);
    }
    let merge = ["merge", "1.part", "2.part", "3.part", "--out", "far"];
    // Changed behind the parts, then gone.
    fs::write(folder.join("horn.csv"), drive.replacen("0.0", "0.1", 1) + "\n").unwrap();
    refused(folder, &merge, &["has changed since"]);
    fs::remove_file(folder.join("horn.csv")).unwrap();
    refused(folder, &merge, &["in the folder in which the parts were run", "horn.csv"]);
    fs::write(folder.join("horn.csv"), &drive).unwrap();
    let whole = fs::read(folder.join("2.part")).unwrap();
    for length in (0..whole.len()).step_by(197) {
        fs::write(folder.join("2.part"), &whole[..length]).unwrap();
        refused(folder, &merge, &["2.part: expected a file that --part wrote"]);
    }
    assert!(!folder.join("far").exists());
    fs::write(folder.join("2.part"), whole).unwrap();
    assert_eq!(granchain(folder, &merge).0, 0);
}

#[test]
fn a_part_replaces_nothing_that_is_not_this_part() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    fs::write(folder.join("thesis.tex"), "years of work").unwrap();
    fs::create_dir(folder.join("folder")).unwrap();
    part(folder, &SWEEP, 1, 2);
    let kept = fs::read(folder.join("1.part")).unwrap();
    let second = |out: &str, text: &[&str]| {
        refused(folder, &[&SWEEP[..], &["--part", "2/2", "--out", out]].concat(), text);
    };
    for out in ["thesis.tex", "folder", "1.part"] {
        second(out, &[out, "expected no file, or part 2/2 of this command", "left as it is"]);
    }
    #[cfg(unix)]
    for (link, to) in [("to-thesis", "thesis.tex"), ("to-nowhere", "nowhere"), ("to-zero", "/dev/zero")] {
        std::os::unix::fs::symlink(to, folder.join(link)).unwrap();
        second(link, &[link, "left as it is"]);
    }
    assert!(!folder.join("nowhere").exists());
    assert_eq!(fs::read(folder.join("thesis.tex")).unwrap(), b"years of work");
    assert_eq!(fs::read(folder.join("1.part")).unwrap(), kept);
}

#[test]
fn a_forged_part_neither_writes_elsewhere_nor_lasts() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    part(folder, &SWEEP, 1, 2);
    part(folder, &SWEEP, 2, 2);
    let whole = [1, 2].map(|number| fs::read(folder.join(format!("{number}.part"))).unwrap());
    let merge = ["merge", "1.part", "2.part", "--out", "far", "--quiet"];
    let forge = |change: &dyn Fn(&mut Value)| {
        for (number, bytes) in (1..).zip(&whole) {
            let path = folder.join(format!("{number}.part"));
            fs::write(&path, bytes).unwrap();
            forged(&path, change);
        }
    };
    // Flags in the file that say where something goes are not followed.
    let (out, cache) = (folder.join("elsewhere"), folder.join("cache"));
    let more = ["--out", out.to_str().unwrap(), "--force", "--cache", cache.to_str().unwrap(), "--threads", "9999"];
    forge(&|file| file["arguments"].as_array_mut().unwrap().extend(more.map(Value::from)));
    let (code, _, error) = granchain(folder, &merge);
    assert!(code == 0 && folder.join("far/sweep.csv").is_file(), "{error}");
    assert!(!out.exists() && !cache.exists());
    fs::remove_dir_all(folder.join("far")).unwrap();
    // Another command is not run.
    forge(&|file| file["arguments"] = json!(["replay", "--scene", "rigid", "--out", "elsewhere"]));
    refused(folder, &merge, &["found `replay`"]);
    forge(&|file| file["arguments"] = json!(["sweep", "--help"]));
    refused(folder, &merge, &["which cannot be read"]);
    forge(&|file| file["arguments"] = json!([]));
    refused(folder, &merge, &["which cannot be read"]);
    #[cfg(unix)]
    for device in ["--drive=/dev/zero", "--scene=/dev/zero"] {
        forge(&|file| file["arguments"].as_array_mut().unwrap().push(device.into()));
        refused(folder, &merge, &["/dev/zero: expected a plain file"]);
    }
    // Numbers that nobody can count.
    for (points, of) in [(u64::MAX, 2), (u64::MAX, u64::MAX), (0, 0), (7, 0), (7, 8), (1_000_000_000_000, 1)] {
        forge(&|file| (file["points"], file["part"]["of"]) = (json!(points), json!(of)));
        refused(folder, &merge, &["1.part"]);
    }
    forge(&|file| file["points"] = serde_json::from_str("1e19").unwrap());
    refused(folder, &merge, &["1.part: expected a file that --part wrote"]);
    forge(&|file| {
        (file["points"], file["part"]["of"]) = (json!(u64::MAX), json!(u64::MAX));
        file["runs"].as_array_mut().unwrap().truncate(1);
    });
    refused(folder, &merge, &["missing: 3/18446744073709551615", ", …"]);
    // Runs of another kind, too few, none.
    forge(&|file| file["runs"][0] = json!({ "wall": 1 }));
    refused(folder, &merge, &["1.part: expected runs of its command"]);
    forge(&|file| drop(file["runs"].as_array_mut().unwrap().pop()));
    refused(folder, &merge, &["1.part: expected the runs of part 1/2 of 7 points, found 2 runs"]);
    forge(&|file| file["program"] = "granchain 0.0.9".into());
    refused(folder, &merge, &["found one of granchain 0.0.9"]);
    for (number, bytes) in (1..).zip(&whole) {
        fs::write(folder.join(format!("{number}.part")), bytes).unwrap();
    }
    #[cfg(unix)]
    {
        fs::remove_file(folder.join("2.part")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", folder.join("2.part")).unwrap();
        refused(folder, &merge, &["2.part", "found a device"]);
        fs::remove_file(folder.join("2.part")).unwrap();
        fs::File::create(folder.join("2.part")).unwrap().set_len(1 << 40).unwrap();
        refused(folder, &merge, &["2.part", "at most 4294967296 bytes, found 1099511627776 bytes"]);
    }
    assert!(!folder.join("far").exists() && !folder.join("elsewhere").exists());
}

#[test]
fn different_processors_are_named() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    for number in [1, 2] {
        part(folder, &SWEEP, number, 2);
    }
    forged(&folder.join("2.part"), |file| file["processor"] = "another processor".into());
    let (code, _, error) = granchain(folder, &["merge", "1.part", "2.part", "--out", "far"]);
    assert!(code == 0 && error.contains("warning") && error.contains("another processor"), "{error}");
}

#[test]
fn what_is_gone_or_makes_no_sense_is_refused_with_what_to_write_instead() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let usage = |arguments: &[&str], expected: &[&str]| {
        let (code, _, error) = granchain(folder, arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        for text in expected {
            assert!(error.contains(text), "{arguments:?}: expected `{text}` in\n{error}");
        }
    };
    let coverage = ["coverage", "--plan", "plan.toml", "--count", "2"];
    let gone = ["--part K/N --out FILE", "granchain merge FILES --out DIR"];
    usage(&["batch", "plan", "s.batch", "--chunk", "2", "--", "sweep"], &gone);
    for flag in [&["--on", "slurm"][..], &["--on=hyperqueue"], &["--chunk", "3"]] {
        usage(&[&SWEEP[..], &["--out", "far"], flag].concat(), &gone);
        usage(&[&coverage[..], &["--out", "far"], flag].concat(), &gone);
        usage(&[&["calibrate", "--measured", "vib.csv"], flag].concat(), &gone);
    }
    usage(&[&SWEEP[..], &["--part", "1/3"]].concat(), &["--out"]);
    usage(&[&SWEEP[..], &["--part", "4/3", "--out", "x"]].concat(), &["expected K/N with K from 1 to N", "4/3"]);
    usage(&[&SWEEP[..], &["--part", "1/8", "--out", "x"]].concat(), &["at most 7 parts, one per point"]);
    for flag in ["--resume", "--force"] {
        usage(&[&SWEEP[..], &["--part", "1/3", "--out", "x", flag]].concat(), &["--part"]);
    }
    part(folder, &SWEEP, 1, 1);
    usage(&["merge", "1.part"], &["--out DIR"]);
    usage(&["merge", "1.part", "--out", "far", "--seed", "3"], &["--seed would do nothing"]);
    usage(&["merge", "--out", "far"], &["FILE"]);
    refused(
        folder,
        &["merge", "none.part", "--out", "far"],
        &["none.part: expected a file written by --part, found none"],
    );
    assert_eq!(fs::read_dir(folder).unwrap().count(), 1);
}

#[test]
#[cfg(unix)]
fn a_part_that_finds_no_room_leaves_no_file_and_says_so() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    // Files of at most 512 bytes: a write fails where a full disk makes it fail.
    let line =
        format!("trap '' XFSZ; ulimit -f 1; exec \"$0\" {} --part 1/2 --out 1.part --cache none", SWEEP.join(" "));
    let mut limited = Command::new("sh");
    let output = limited.args(["-c", &line, env!("CARGO_BIN_EXE_granchain")]).current_dir(folder).output().unwrap();
    let error = stderr(&output);
    assert!(code(&output) == 1 && error.contains("1.part: cannot write"), "{error}");
    assert_eq!(fs::read_dir(folder).unwrap().count(), 0, "nothing is left");
}

/// The same from parts as from one run.
fn same_in_parts(command: &[&str], of: usize) {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let command = [command, &["--quiet"]].concat();
    let (code, here, error) = granchain(folder, &[&command[..], &["--out", "here"]].concat());
    assert_eq!(code, 0, "{error}");
    for number in (1..=of).rev() {
        part(folder, &command, number, of);
    }
    let files: Vec<String> = (1..=of).map(|number| format!("{number}.part")).collect();
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let (code, far, error) = granchain(folder, &[&["merge", "--out", "far", "--quiet"], &files[..]].concat());
    assert_eq!(code, 0, "{error}");
    assert_eq!(far, here);
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("here")));
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn coverage_of_ones_own_bench_is_the_same_in_parts_and_its_intervals_are_as_wide_as_expected() {
    let place = tempfile::tempdir().unwrap();
    let twin = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/twin-annulus/vib.csv");
    let plan = |name: &str, beads: u32| {
        let text = format!("measured = '{}'\nset = ['chain.beads={beads}', 'model.kind=chain']\n", twin.display());
        fs::write(place.path().join(name), text).unwrap();
        place.path().join(name).display().to_string()
    };
    let (six, five) = (plan("six.toml", 6), plan("five.toml", 5));
    let own = ["coverage", "--plan", &six, "--vary", "drive=0.8,1.2", "--evaluations", "200"];
    same_in_parts(&[&own[..], &["--count", "1"]].concat(), 2);
    let counted = |more: &[&str]| -> Value {
        let (code, out, error) = granchain(place.path(), &[&own[..], more, &["--quiet", "--json"]].concat());
        assert_eq!(code, 0, "{error}");
        serde_json::from_str(&out).unwrap()
    };
    let (quick, full) = (counted(&[]), counted(&["--count", "2", "--seed", "5"]));
    for (experiment, parameter) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let width = |of: &Value, key: &str| of["count"][experiment]["parameters"][parameter][key].as_f64();
        let (expected, fitted) = (width(&quick, "expected_width").unwrap(), width(&full, "fitted_width").unwrap());
        assert!((0.8..1.25).contains(&(expected / fitted)), "{experiment} {parameter}: {expected} {fitted}");
        // A factor of 1.05 and the runs' own differences lie between a fit and the bound; the drive level is in both.
        assert!(
            (0.9..1.25).contains(&width(&full, "width_over_bound").unwrap()) && width(&quick, "fitted_width").is_none()
        );
    }
    refused(place.path(), &["coverage", "--plan", &five, "--count", "1"], &["the plan's own fit is `outside scatter`"]);
    refused(
        place.path(),
        &["coverage", "--plan", &six, "--vary", "chain.radius=1kg"],
        &["--vary chain.radius=1 kg: `chain.radius`: expected a length", "which is a mass"],
    );
    for wrong in [&["--vary", "drive=0,1", "--plan", &six][..], &["--vary", "drive=1"], &["--wrong"]] {
        assert_eq!(granchain(place.path(), &[&["coverage"], wrong].concat()).0, 2, "{wrong:?}");
    }
}

/// Largest memory of a process, kB.
#[cfg(target_os = "linux")]
fn peak_kb(folder: &Path, arguments: &[&str]) -> u64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_granchain"));
    let mut child = child.args(arguments).current_dir(folder).stdout(std::process::Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak =
            line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).map_or(peak, |kb: u64| peak.max(kb));
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    peak
}

#[test]
#[ignore = "slow, run by .ci/full"]
#[cfg(target_os = "linux")]
fn ten_times_the_points_take_hardly_more_memory() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let bench = [
        "sweep",
        "--scene",
        "annulus",
        "--model",
        "chain",
        "--set",
        "duration=2us",
        "--set",
        "chain.beads=1",
        "--quiet",
    ];
    let sweep = |damping: &str, out: &str| {
        let grid = ["--vary", "alpha=0.2:1.19:0.01", "--vary", damping, "--out", out].map(String::from);
        bench.map(String::from).into_iter().chain(grid).collect::<Vec<_>>()
    };
    let peak = |arguments: &[String]| peak_kb(folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let few = peak(&sweep("damping.coefficient=0.1:0.29:0.01", "few"));
    let many = sweep("damping.coefficient=0.1:0.299:0.001", "many");
    let here = peak(&many);
    // 20,000 points in place of 2,000 take some 75 bytes each, most of it their places; as much is shown of either. All runs in memory take 600 bytes
    // each, 11 MB more.
    assert!(here < few + 6_000, "{few} {here}");
    let part = |number: usize| [&many[..], &["--part".into(), format!("{number}/10")]].concat();
    for number in 1..=10 {
        let mut words = part(number);
        *words.iter_mut().find(|word| *word == "many").unwrap() = format!("{number}.part");
        peak(&words);
    }
    let files = (1..=10).map(|number| format!("{number}.part"));
    let merge = ["merge", "--out", "far", "--quiet"].map(String::from).into_iter().chain(files);
    let merged = peak(&merge.collect::<Vec<_>>());
    assert!(merged < few + 12_000, "{few} {merged}");
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("many")));
}
