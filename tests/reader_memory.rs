//! Reading takes at most ten times the size of a file in memory, whatever is in it; a spectrum of a scope's long memory four times, and what is no text next to
//! nothing.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::{fmt::Write as _, path::Path, process::Stdio};

use granchain::{
    measurement::{
        ByteOrder, Precision, ReadOptions, RecordKind, RecordedQuantity, Samples, TimeResponse, UniversalForm,
        read_record_bytes,
    },
    signal::Series,
};

/// Largest resident size of this process so far, bytes.
fn high_water() -> usize {
    high_water_of("self").unwrap()
}

/// Of any process; `None` once it has ended.
fn high_water_of(process: &str) -> Option<usize> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().trim_end_matches("kB").trim().parse::<usize>().unwrap())
}

/// Largest resident size of the program while it ran, bytes, and whether it ended well.
fn program(arguments: &[&str], file: &Path) -> (usize, bool) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_granchain"));
    let mut child = command.args(arguments).arg(file).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let process = child.id().to_string();
    let mut largest = 0;
    loop {
        largest = largest.max(high_water_of(&process).unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            return (largest, status.success());
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// What the program takes of itself.
const ITSELF: usize = 16 << 20;

#[test]
fn a_spectrum_of_a_long_memory_takes_four_times_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vib.csv");
    let mut text = String::from("time_us,velocity_mm_per_s\n");
    for i in 0..1_500_000 {
        writeln!(text, "{:.2},{:.2}", 0.05 * f64::from(i), 1e3 * value(i as usize)).unwrap();
    }
    std::fs::write(&path, &text).unwrap();
    let (memory, read) = program(&["spectrum", "--json"], &path);
    println!("{:.1} times {} bytes", memory as f64 / text.len() as f64, text.len());
    assert!(read && memory > text.len(), "{memory}");
    assert!(memory <= 4 * text.len() + ITSELF, "{memory} bytes for {} of file", text.len());
}

#[test]
fn what_is_no_text_is_refused_by_its_first_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for (name, head) in
        [("zeros.csv", &b""[..]), ("book.csv", b"PK\x03\x04"), ("late.csv", b"time_s,velocity_m_per_s\n0,1\n")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, head).unwrap();
        // Sparse: zeros that take no room on the disk.
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(1 << 30).unwrap();
        for subcommand in ["inspect", "spectrum"] {
            let (memory, read) = program(&[subcommand], &path);
            assert!(!read && memory < 2 * ITSELF, "{subcommand} {name}: {memory} bytes");
        }
    }
}

/// Names the file that a child process is to read.
const FILE: &str = "GRANCHAIN_MEMORY_TEST_FILE";

/// Many enough that what reading takes of itself does not count.
const ROWS: usize = 200_000;

fn value(i: usize) -> f64 {
    (0.2 * i as f64).sin() * 0.3 + 1e-3 * (i as f64 * 12.9898).sin()
}

/// In a process of its own, for memory that was given back is not counted twice: bytes that reading takes per byte of the
/// file, and whether it was read.
fn child(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    let before = high_water();
    let kind = if path.to_string_lossy().contains("horn") { RecordKind::HornTip } else { RecordKind::Vibrometer };
    let options = ReadOptions {
        sample_rate: path.to_string_lossy().contains("no-time").then_some(2e6),
        ..ReadOptions::default()
    };
    let read = read_record_bytes(path, &bytes, Some(kind), &options);
    println!("cost {} {}", (high_water() - before) as f64 / bytes.len() as f64, read.is_ok());
}

#[test]
fn ten_times_the_file_are_enough() {
    if let Some(path) = std::env::var_os(FILE) {
        return child(Path::new(&path));
    }
    let folder = tempfile::tempdir().unwrap();
    let mut plain = String::from("time_us,velocity_mm_per_s\n");
    for i in 0..ROWS {
        writeln!(plain, "{:.1},{:.3}", 0.5 * i as f64, 1e3 * value(i)).unwrap();
    }
    let short = (0..ROWS).fold(String::from("time_us,velocity_mm_per_s\n"), |mut text, i| {
        writeln!(text, "{i},{}", (i * i / 7) % 10).unwrap();
        text
    });
    let shortest = (0..20 * ROWS).fold(String::from("velocity_mm_per_s\n"), |mut text, i| {
        writeln!(text, "{}", (i * i / 7) % 10).unwrap();
        text
    });
    let blanks = plain.replace(',', "   ").replace("time_us", "time (us)").replace("velocity_mm_per_s", "v (mm/s)");
    let returns = plain.replace('\n', "\r");
    // Instants of a unit and a third of a unit apart.
    let rounded = (0..ROWS).fold(String::from("time_us,velocity_mm_per_s\n"), |mut text, i| {
        writeln!(text, "{:.0},{:.3}", 1.33 * i as f64, 1e3 * value(i)).unwrap();
        text
    });
    let counted = (0..ROWS).fold(String::from("X,v,Start,Increment\nSequence,mm/s,-1e-3,5e-7\n"), |mut text, i| {
        writeln!(text, "{i},{:.3},", 1e3 * value(i)).unwrap();
        text
    });
    let german = plain.replace(',', ";").replace('.', ",");
    let wide: Vec<u8> = german.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let series = Series::new(0.0, 5e-7, (0..ROWS).map(value).collect());
    let response = TimeResponse { title: "", quantity: RecordedQuantity::Velocity, samples: Samples::Even(&series) };
    let binary = response.to_bytes(UniversalForm { precision: Precision::Double, binary: Some(ByteOrder::Little) });
    let text = response.to_bytes(UniversalForm { precision: Precision::Single, binary: None });
    let columns = format!("{}\n", "a,".repeat(2_000_000));
    let comments = "#\n".repeat(2_000_000) + "t,v\n";
    let quotes = format!("time_s,velocity_m_per_s\n\"{}", "1,2\n".repeat(1_000_000));
    let name = vec![0xff; 4_000_000];
    let promises = String::from_utf8(text.clone()).unwrap().replace(&format!("{ROWS:>10}"), "1999999999");
    for (name, bytes, read) in [
        ("plain", plain.as_bytes(), true),
        ("German", german.as_bytes(), true),
        ("UTF-16", &wide, true),
        ("blanks", blanks.as_bytes(), true),
        ("CR", returns.as_bytes(), true),
        ("rounded instants", rounded.as_bytes(), true),
        ("counter", counted.as_bytes(), true),
        ("short rows", short.as_bytes(), true),
        ("no-time", shortest.as_bytes(), true),
        ("58b", &binary, true),
        ("58", &text, true),
        ("many columns", columns.as_bytes(), false),
        ("many comments", comments.as_bytes(), false),
        ("one long name", &name, false),
        ("open quotes", quotes.as_bytes(), false),
        ("a count beyond the file", promises.as_bytes(), false),
    ] {
        for kind in ["vib", "horn"] {
            let path = folder.path().join(format!("{kind}-{name}"));
            std::fs::write(&path, bytes).unwrap();
            let mut child = std::process::Command::new(std::env::current_exe().unwrap());
            let output = child
                .args(["--nocapture", "--exact", "ten_times_the_file_are_enough"])
                .env(FILE, &path)
                .output()
                .unwrap();
            let said = String::from_utf8(output.stdout).unwrap();
            let (_, said) = said.split_once("cost ").expect("the child says what it cost");
            let (cost, done) = said.lines().next().unwrap().split_once(' ').unwrap();
            let cost: f64 = cost.parse().unwrap();
            println!("{name}, {kind}: {cost:.1} times {} bytes", bytes.len());
            assert_eq!(done.parse(), Ok(read), "{name}");
            // Of rows of two bytes, a velocity of the horn, its integral and the same without drift are eight bytes a row each, half the file again and again.
            let limit = if (name, kind) == ("no-time", "horn") { 13.0 } else { 10.0 };
            assert!(cost <= limit, "{name}, {kind}: {cost:.1} times the file");
        }
    }
}
