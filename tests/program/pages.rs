//! Pages that show commands: each is run as it stands there, and what the page quotes of its output is compared with what it prints.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::harness::{PROJECT, code, stderr, stdout};

/// What takes a minute or more, or needs a file that nobody ships; the program must take it, but does not run it here.
const NOT_RUN: [&str; 4] = [
    "verify DIR",
    "calibrate --plan plan.toml --out fit",
    "start FILE",
    "coverage --plan plan.toml --model chain --count 40",
];

/// A page as one reads it down.
enum Part {
    /// Words behind `granchain`.
    Command(Vec<String>),
    /// Lines quoted of what the commands since the last quotation printed.
    Quoted(Vec<String>),
}

/// The indented commands, the `text` blocks and the `console` blocks (commands behind `$`, and what they print) of a page.
fn parts(page: &str) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut quoted: Option<Vec<String>> = None;
    for line in page.lines() {
        match (&mut quoted, line) {
            (None, "```text" | "```console") => quoted = Some(Vec::new()),
            (Some(_), "```") => parts.extend(quoted.take().map(Part::Quoted)),
            (Some(lines), line) => match line.strip_prefix("$ granchain ") {
                Some(command) => parts.push(Part::Command(shell_words::split(command).unwrap())),
                None => lines.push(line.to_owned()),
            },
            (None, line) => {
                let bin = line
                    .strip_prefix("    cargo run --release --bin calibrate -- ")
                    .map(|rest| format!("calibrate {rest}"));
                let command = bin.or_else(|| line.strip_prefix("    granchain ").map(str::to_owned));
                parts.extend(command.map(|command| Part::Command(shell_words::split(&command).unwrap())));
            }
        }
    }
    parts
}

/// A folder with the shipped records and fit definitions where the pages have them, and a laboratory's pair of files, also as a scope writes it.
fn bench() -> tempfile::TempDir {
    let bench = tempfile::tempdir().unwrap();
    for folder in ["measurements", "calibrations"] {
        copy(&Path::new(PROJECT).join(folder), &bench.path().join(folder));
    }
    let synthetic = Path::new(PROJECT).join("measurements/twin-annulus");
    let rows = ["vib.csv", "horn_tip.csv"].map(|file| {
        fs::copy(synthetic.join(file), bench.path().join(file)).unwrap();
        let text = fs::read_to_string(synthetic.join(file)).unwrap();
        let cells = text.lines().filter_map(|line| line.split_once(','));
        cells.filter_map(|(time, value)| Some((time.parse().ok()?, value.parse().ok()?))).collect::<Vec<(f64, f64)>>()
    });
    let mut scope = String::from("Time (s),CH1 (V),CH2 (V)\n");
    for (bead, horn) in rows[0].iter().zip(&rows[1]) {
        scope.push_str(&format!("{:e},{:e},{:e}\n", 1e-6 * bead.0, horn.1 / 2.0, bead.1 / 125.0));
    }
    fs::write(bench.path().join("scope.csv"), scope).unwrap();
    bench
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path: PathBuf = entry.unwrap().path();
        let place = to.join(path.file_name().unwrap());
        if path.is_dir() { copy(&path, &place) } else { _ = fs::copy(&path, place).unwrap() }
    }
}

/// The first quoted line that is not printed behind those before it; `…` stands for any lines.
fn missing<'a>(quoted: &'a [String], printed: &str) -> Option<&'a String> {
    let mut left = printed.lines();
    quoted.iter().find(|line| *line != "…" && !left.any(|printed| printed == line.as_str()))
}

/// Run the commands of a page in their order, in one folder, on a terminal of 80 columns; returns how many ran.
fn holds(name: &str) -> usize {
    let bench = bench();
    let page = fs::read_to_string(Path::new(PROJECT).join(name)).unwrap();
    let (mut printed, mut ran, mut wrong) = (String::new(), 0, Vec::new());
    let run = |words: &[String]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
        command.args(words).env("COLUMNS", "80").current_dir(bench.path()).output().unwrap()
    };
    for part in parts(&page) {
        match part {
            Part::Command(words) => {
                let command = words.join(" ");
                if NOT_RUN.iter().any(|long| command.starts_with(long)) {
                    // A number of threads is read last and refused, everything before it is taken.
                    let refused = run(&[words, vec!["--threads=0".into()]].concat());
                    if !stderr(&refused).contains("'0' for '--threads <N>'") {
                        wrong.push(format!("{name}: granchain {command}\n{}", stderr(&refused)));
                    }
                    continue;
                }
                let output = run(&words);
                if code(&output) != 0 {
                    wrong.push(format!(
                        "{name}: granchain {command} ended with {}\n{}",
                        code(&output),
                        stderr(&output)
                    ));
                }
                printed.push_str(&stdout(&output));
                ran += 1;
            }
            Part::Quoted(quoted) => {
                if let Some(line) = missing(&quoted, &printed) {
                    wrong.push(format!("{name}: no command above prints, in this place,\n{line}\nbut\n{printed}"));
                }
                printed.clear();
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    ran
}

#[test]
fn the_readme_runs_as_it_is_written_and_quotes_what_is_printed() {
    assert!(holds("README.md") >= 4);
    let page = fs::read_to_string(Path::new(PROJECT).join("README.md")).unwrap();
    for command in
        ["cargo run --release --bin calibrate -- --measured measurements/annulus-73khz/vib.csv", "cargo test --release"]
    {
        assert!(page.lines().any(|line| line.trim() == command), "{command}");
    }
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn the_tutorial_runs_as_it_is_written_and_quotes_what_is_printed() {
    assert!(holds("docs/tutorial.md") >= 10);
}

/// Numbers with a point of at least three digits outside the blocks of a page and its comments, as they are written.
fn in_prose(page: &str) -> BTreeSet<String> {
    let mut in_block = false;
    let prose = page.lines().filter(|line| {
        let fence = line.starts_with("```");
        in_block ^= fence;
        !(in_block || fence || line.starts_with("    ")) || line.starts_with("# ") && in_block
    });
    let is_number = |word: &&str| word.contains('.') && word.bytes().filter(u8::is_ascii_digit).count() >= 3;
    let words = |line: &str| -> Vec<String> {
        let words =
            line.split(|letter: char| !letter.is_ascii_digit() && letter != '.').map(|word| word.trim_matches('.'));
        words.filter(is_number).map(str::to_owned).collect()
    };
    prose.flat_map(words).collect()
}

/// Numbers in the prose of a page that no command of it prints: limits of ranges, a frequency of a bead.
const STATED: [&str; 3] = ["0.01", "0.017", "2.65"];

/// What a page says in a sentence, or another page of the tutorial's fits, stands in a quotation of the tutorial, which a test compares with what is
/// printed.
#[test]
fn a_number_in_prose_is_one_that_is_quoted() {
    let page = |name: &str| fs::read_to_string(Path::new(PROJECT).join(name)).unwrap();
    let quoted: String = parts(&page("docs/tutorial.md"))
        .into_iter()
        .filter_map(|part| if let Part::Quoted(lines) = part { Some(lines.join("\n")) } else { None })
        .collect();
    for name in ["docs/tutorial.md", "docs/python.md"] {
        let stray: Vec<String> = in_prose(&page(name))
            .into_iter()
            .filter(|number| !STATED.contains(&number.as_str()) && !quoted.contains(number.as_str()))
            .collect();
        assert!(stray.is_empty(), "{name}: not quoted of what a command prints: {stray:?}");
    }
    assert_eq!(
        in_prose("α 0.6995\n```python\n# 0.7037, 1.5\nx = 0.123\n```\n    y 0.456\n"),
        BTreeSet::from(["0.6995".into(), "0.7037".into()])
    );
}

#[test]
fn a_quotation_out_of_order_or_off_by_a_digit_is_seen() {
    let page = "    granchain scene list\n\n```text\none 1.5\n…\ntwo\n```\n";
    let [Part::Command(words), Part::Quoted(quoted)] = &parts(page)[..] else { panic!("a command and a quotation") };
    assert_eq!(words, &["scene", "list"]);
    assert_eq!(missing(quoted, "zero\none 1.5\nbetween\ntwo\n"), None);
    assert_eq!(missing(quoted, "two\none 1.5\n"), Some(&"two".to_owned()));
    assert_eq!(missing(quoted, "one 1.6\ntwo\n"), Some(&"one 1.5".to_owned()));
}
