//! The tree of folders is a promise about what may know what; these tests read the sources against it.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// Room → what it may import of its own crate. Data flows down: imports point at data, never at its maker. Between crates the
/// compiler sees to it.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("crates/model/src/scene", &["scene"]),
    ("crates/model/src/response", &["response"]),
    (
        "src/cli",
        &[
            "signal",
            "measurement",
            "scene",
            "response",
            "model",
            "feature",
            "calibration",
            "study",
            "validate",
            "report",
            "cli",
        ],
    ),
];

/// Crate → the only folder of its package that may use it.
const OWNED_CRATES: &[(&str, &str)] = &[
    ("clap", "src/cli"),
    ("anyhow", "src/cli"),
    ("indicatif", "src/cli"),
    ("console", "src/cli"),
    ("textwrap", "src/cli"),
    ("ctrlc", "src/cli"),
    ("signal_hook", "src/cli"),
];

const MEANINGLESS_NAMES: &[&str] = &["utils", "util", "common", "helpers", "helper", "types", "base", "misc"];

const LONGEST_FILE: usize = 600;

fn sources(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)];
    while let Some(place) = open.pop() {
        let Ok(entries) = fs::read_dir(&place) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn relative(path: &Path) -> String {
    path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().display().to_string()
}

/// The code without comments (doc examples are outside users).
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Modules named right behind `crate::`, alone or in a `{…}` group.
fn imported_modules(code: &str) -> BTreeSet<String> {
    let mut modules = BTreeSet::new();
    for (at, path) in code.match_indices("crate::") {
        if code[..at].ends_with(|before: char| before.is_alphanumeric() || before == '_' || before == '$') {
            continue;
        }
        let rest = &code[at + path.len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut name = String::new();
            for letter in group.chars() {
                match letter {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => modules.extend(first_name(&std::mem::take(&mut name))),
                    _ if depth == 0 => name.push(letter),
                    _ => {}
                }
            }
            modules.extend(first_name(&name));
        } else {
            modules.extend(first_name(rest));
        }
    }
    modules
}

fn first_name(path: &str) -> Option<String> {
    let name: String = path.trim().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
    (!name.is_empty()).then_some(name)
}

#[test]
fn groups_and_single_imports_are_both_read() {
    let code = "use crate::signal::Series;\nuse crate::{\n    model::{Model, chain::X},\n    scene::Scene,\n};\nfn f() { $crate::no(); crate::feature::thd() }";
    let expected = ["feature", "model", "scene", "signal"].map(str::to_owned);
    assert_eq!(imported_modules(code).into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn every_room_imports_only_what_lies_above_it() {
    let mut wrong = Vec::new();
    for (room, allowed) in MAY_IMPORT {
        for path in sources(room) {
            for module in imported_modules(&code(&path)) {
                if !allowed.contains(&module.as_str()) {
                    wrong.push(format!("{}: `{room}` may not import `{module}`", relative(&path)));
                }
            }
        }
    }
    for path in sources("crates/signal/src").iter().filter(|path| !relative(path).contains("/feature/")) {
        if imported_modules(&code(path)).contains("feature") {
            wrong.push(format!("{}: a signal knows nothing of its features", relative(path)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn plotting_html_and_terminal_crates_stay_in_their_folder() {
    let mut wrong = Vec::new();
    for path in sources("src") {
        let code = code(&path);
        for (name, owner) in OWNED_CRATES {
            let used = code.contains(&format!("{name}::")) || code.contains(&format!("use {name};"));
            if used && !relative(&path).starts_with(owner) {
                wrong.push(format!("{}: `{name}` belongs to `{owner}`", relative(&path)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_module_is_named_for_nothing() {
    let wrong: Vec<String> = ["src", "crates", "reproduction"]
        .into_iter()
        .flat_map(sources)
        .map(|path| relative(&path))
        .filter(|path| path.trim_end_matches(".rs").split('/').any(|part| MEANINGLESS_NAMES.contains(&part)))
        .collect();
    assert!(wrong.is_empty(), "name the concept: {}", wrong.join(", "));
}

#[test]
fn no_source_file_holds_more_than_one_concept_can_need() {
    let wrong: Vec<String> = ["src", "crates", "reproduction", "tests", "benches", "examples"]
        .into_iter()
        .flat_map(sources)
        .filter_map(|path| {
            let lines = fs::read_to_string(&path).unwrap().lines().count();
            (lines > LONGEST_FILE).then(|| format!("{} has {lines} lines", relative(&path)))
        })
        .collect();
    assert!(wrong.is_empty(), "look for the second concept inside: {}", wrong.join(", "));
}
