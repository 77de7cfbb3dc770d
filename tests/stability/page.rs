//! `docs/stability.md`: what every case measures, written and compared case by case.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use granchain_report::number::significant;

use super::{CASES, Case, Check, Limit};

/// Share of a limit below which a number is rounding, not a measurement.
const NOTHING: f64 = 0.01;

/// Relative difference of two numbers that are said to be the same; twice that of the last digit.
const SAME: f64 = 0.1;

/// Tests write the page one after the other.
static PAGE: Mutex<()> = Mutex::new(());

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stability.md")
}

/// The section of a case is that of the page; with `STABILITY=write` it becomes it.
pub fn compare(case: &Case, checks: &[Check]) {
    let _turn = PAGE.lock().unwrap_or_else(PoisonError::into_inner);
    let (page, made) = (fs::read_to_string(file()).unwrap(), section(case, checks));
    let heading = format!("## {}. ", case.number);
    let from = page.find(&heading).unwrap_or(page.len());
    let to = page[from..].find("\n## ").map_or(page.len(), |more| from + more + 1);
    if std::env::var("STABILITY").is_ok_and(|mode| mode == "write") {
        // A case that has no section yet comes before those of higher numbers.
        let mut later = (case.number + 1..=CASES.len() as u32).map(|number| page.find(&format!("## {number}. ")));
        let (from, to) = if from == page.len() {
            let place = later.find_map(|place| place).unwrap_or(page.len());
            (place, place)
        } else {
            (from, to)
        };
        fs::write(file(), format!("{}{made}{}", &page[..from], &page[to..])).unwrap();
        return;
    }
    let differences: Vec<String> = differences(page[from..to].trim(), made.trim());
    assert!(
        differences.is_empty(),
        "docs/stability.md differs; if that is intended, write it again: STABILITY=write cargo test --release --test stability -- --include-ignored\n{}",
        differences.join("\n")
    );
}

/// Lines of two sections whose words differ, or whose numbers differ by more than their last digit.
fn differences(page: &str, made: &str) -> Vec<String> {
    let words = |line: &str| -> Vec<String> { line.split_whitespace().map(str::to_owned).collect() };
    let alike = |a: &String, b: &String| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= SAME * a.abs().max(b.abs()),
        _ => a == b,
    };
    let same = |a: &str, b: &str| {
        let (a, b) = (words(a), words(b));
        a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| alike(a, b))
    };
    let (page, made): (Vec<&str>, Vec<&str>) = (page.lines().collect(), made.lines().collect());
    let longest = page.len().max(made.len());
    let line = |of: &[&str], index: usize| of.get(index).copied().unwrap_or("").to_owned();
    let pairs = (0..longest).map(|index| (line(&page, index), line(&made, index)));
    pairs.filter(|(page, made)| !same(page, made)).map(|(page, made)| format!("page  {page}\nfound {made}")).collect()
}

/// One row for each criterion and limit: of its checks the one nearest to the limit.
fn section(case: &Case, checks: &[Check]) -> String {
    let mut rows: Vec<(String, Limit, &str, Vec<&Check>)> = Vec::new();
    for check in checks {
        let criterion = check.criterion.split_once(": ").map_or(&*check.criterion, |(_, what)| what);
        match rows.iter_mut().find(|(name, limit, ..)| *name == criterion && *limit == check.limit) {
            Some((.., of)) => of.push(check),
            None => rows.push((criterion.to_owned(), check.limit, check.unit, vec![check])),
        }
    }
    let count = checks.len();
    let mut text = format!("## {}. {} ({count} checks)\n\n{}\n\n", case.number, case.name, case.what);
    text.push_str("| criterion | model | checks | measured | limit |\n|---|---|---:|---:|---:|\n");
    for (criterion, limit, unit, of) in rows {
        let mut models: Vec<&str> = of.iter().map(|check| check.fidelity.name()).collect();
        models.dedup();
        let measured = of.iter().filter_map(|check| check.measured);
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        let (worst, limit) = match limit {
            Limit::AtMost(most) => {
                let worst = measured.fold(f64::NEG_INFINITY, f64::max);
                let rounding = most > 0.0 && worst <= NOTHING * most;
                let worst = if rounding { format!("< {}", number(NOTHING * most)) } else { number(worst) };
                (worst, format!("≤ {}", number(most)))
            }
            Limit::AtLeast(least) => (number(measured.fold(f64::INFINITY, f64::min)), format!("≥ {}", number(least))),
        };
        let (models, count) = (models.join("; "), of.len());
        text.push_str(&format!("| {criterion} | {models} | {count} | {worst}{unit} | {limit}{unit} |\n"));
    }
    text + "\n"
}

/// Two digits that can be read back.
fn number(value: f64) -> String {
    let plain = value == 0.0 || (0.01..1e4).contains(&value.abs());
    if plain { significant(value, 2) } else { format!("{value:.1e}") }
}

#[test]
fn the_number_of_checks_on_the_first_page_is_that_of_the_sections() {
    let page = fs::read_to_string(file()).unwrap();
    let count = |line: &str| line.strip_suffix(" checks)")?.rsplit_once('(')?.1.parse::<usize>().ok();
    let counts: Vec<usize> = page.lines().filter_map(count).collect();
    let all: usize = counts.iter().sum();
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    assert!(readme.contains(&format!("{} hard cases with {all} checks", counts.len())), "{all}");
}

#[test]
fn a_number_that_moves_by_more_than_its_last_digit_is_found() {
    assert!(differences("| a | 1.2 | ≤ 3 |", "| a | 1.25 | ≤ 3 |").is_empty());
    assert_eq!(differences("| a | 1.2 |", "| a | 1.4 |").len(), 1);
    assert_eq!(differences("| a | 1.2 |", "| b | 1.2 |").len(), 1);
}
