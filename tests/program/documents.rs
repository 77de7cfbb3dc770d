//! What the pages say: their links lead somewhere, the tutorial's commands run and print what it shows.

use std::{fs, path::Path};

use super::harness::{PROJECT, granchain};

/// Every page of the project.
fn pages() -> Vec<String> {
    let mut pages = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/decisions"] {
        let entries = fs::read_dir(Path::new(PROJECT).join(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        pages.extend(names.filter(|name| name.ends_with(".md")).map(|name| format!("{folder}/{name}")));
    }
    pages
}

/// Lower-case words of a heading joined by hyphens, as the anchors of rendered pages are.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect::<String>().replace(' ', "-")
}

#[test]
fn every_link_leads_to_a_file_and_to_a_heading_in_it() {
    let mut wrong = Vec::new();
    for page in pages() {
        let text = fs::read_to_string(Path::new(PROJECT).join(&page)).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.starts_with("http") || link.contains(' ') {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let here = Path::new(PROJECT).join(&page);
            let target = if file.is_empty() { here } else { here.with_file_name("").join(file) };
            let Ok(found) = fs::metadata(&target) else {
                wrong.push(format!("{page}: {link}"));
                continue;
            };
            if heading.is_empty() || found.is_dir() {
                continue;
            }
            let text = fs::read_to_string(&target).unwrap();
            if !text.lines().any(|line| line.starts_with('#') && anchor(line) == heading) {
                wrong.push(format!("{page}: {link}: no such heading"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_page_of_the_documentation_stands_in_its_index() {
    let index = fs::read_to_string(Path::new(PROJECT).join("docs/README.md")).unwrap();
    let missing = pages().into_iter().filter_map(|page| {
        let name = page.strip_prefix("docs/").filter(|name| !name.contains('/') && *name != "README.md")?.to_owned();
        (!index.contains(&format!("]({name})"))).then_some(name)
    });
    assert_eq!(missing.collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn the_readme_stays_short() {
    let lines = fs::read_to_string(Path::new(PROJECT).join("README.md")).unwrap().lines().count();
    assert!(lines <= 150, "{lines} lines: docs/ holds what is more than a first look");
}

/// The commands in their order, in one folder with the two files; what the page shows of them stands in what they print.
#[test]
fn the_tutorial_runs_as_it_is_written() {
    let bench = tempfile::tempdir().unwrap();
    for file in ["vib.csv", "horn_tip.csv"] {
        let shipped = Path::new(PROJECT).join("measurements/twin-annulus").join(file);
        fs::copy(shipped, bench.path().join(file)).unwrap();
    }
    let page = fs::read_to_string(Path::new(PROJECT).join("docs/tutorial.md")).unwrap();
    let (mut printed, mut shown, mut commands) = (String::new(), false, 0);
    for line in page.lines() {
        if line.starts_with("```") {
            shown = line.ends_with("text");
        } else if shown {
            assert!(printed.contains(line), "no command above prints\n{line}\nbut\n{printed}");
        } else if let Some(command) = line.strip_prefix("    granchain ") {
            let arguments: Vec<&str> = command.split(' ').collect();
            let (code, out, err) = granchain(bench.path(), &arguments);
            assert_eq!(code, 0, "{command}\n{err}");
            printed.push_str(&out);
            commands += 1;
        }
    }
    assert!(commands >= 10, "{commands}");
    assert!(bench.path().join("fit/report.html").is_file() && bench.path().join("look").is_dir());
}
