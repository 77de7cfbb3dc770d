//! What the pages say: their links lead somewhere, no page and no key is left out.

use std::{
    fs,
    path::{Path, PathBuf},
};

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
fn every_key_of_a_fit_definition_stands_on_the_page_of_formats() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.toml"), "no_such_key = 1\n").unwrap();
    let (code, _, said) = granchain(folder.path(), &["calibrate", "--plan", "plan.toml"]);
    let keys = said.split_once("expected one of ").map(|(_, keys)| keys.to_owned()).unwrap_or_default();
    let keys: Vec<&str> = keys.split('`').skip(1).step_by(2).collect();
    assert!(code == 1 && keys.len() > 10, "{said}");
    let page = fs::read_to_string(Path::new(PROJECT).join("docs/formats.md")).unwrap();
    let (_, definitions) = page.split_once("## Plans").unwrap();
    let missing = keys.iter().filter(|key| {
        ![format!("`{key}`"), format!("`[{key}]`"), format!("`[[{key}]]`"), format!("`[{key}.")]
            .iter()
            .any(|it| definitions.contains(it))
    });
    assert_eq!(missing.collect::<Vec<_>>(), Vec::<&&str>::new());
}

#[test]
fn the_readme_stays_short() {
    let lines = fs::read_to_string(Path::new(PROJECT).join("README.md")).unwrap().lines().count();
    assert!(lines <= 135, "{lines} lines: docs/ holds what is more than a first look");
}

/// Words that only this project ever used: ARCHITECTURE.md has those of the field.
const DIALECT: [&str; 17] = [
    "rung",
    "rungs",
    "climb",
    "climbs",
    "cloud",
    "clouds",
    "heard",
    "told",
    "untold",
    "landmark",
    "landmarks",
    "ledger",
    "anew",
    "twin",
    "twins",
    "perturbed",
    "marches",
];

/// What is left of a page without code, file names and addresses.
fn prose(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with("    ")).collect::<Vec<_>>().join("\n");
    let fenced = lines.split("```").step_by(2).collect::<Vec<_>>().join("\n");
    let inline = fenced.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let addresses = inline.split("](").map(|part| part.split_once(')').map_or(part, |(_, rest)| rest));
    addresses.collect::<Vec<_>>().join(" ")
}

#[test]
fn pages_and_help_speak_the_words_of_the_field() {
    let help = |arguments: &[&str]| {
        let (_, text, _) = granchain(Path::new(PROJECT), &[arguments, &["--help"]].concat());
        (format!("{arguments:?} --help"), text)
    };
    let commands = help(&[]).1;
    let names = commands.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = names.filter(|line| !line.starts_with("    ")).filter_map(|line| line.split_whitespace().next());
    let page = |page: String| {
        let text = fs::read_to_string(Path::new(PROJECT).join(&page)).unwrap();
        (page, prose(&text))
    };
    let pages =
        pages().into_iter().filter(|page| !page.starts_with("docs/decisions")).chain(["ARCHITECTURE.md".into()]);
    let mut wrong = Vec::new();
    for (place, text) in pages.map(page).chain(names.map(|name| help(&[name]))) {
        let words = text.split(|letter: char| !letter.is_alphabetic() && letter != '-').map(str::to_lowercase);
        wrong.extend(words.filter(|word| DIALECT.contains(&word.as_str())).map(|word| format!("{place}: {word}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Words of the glossary's left column that no name in the code has; `told` and `heard` are verbs of speech.
const NAMES: [&str; 13] = [
    "rung",
    "rungs",
    "twin",
    "twins",
    "ledger",
    "landmark",
    "cloud",
    "told",
    "untold",
    "heard",
    "confirmed",
    "books",
    "climb",
];

/// The words of a name in either case.
fn words(name: &str) -> Vec<String> {
    let mut text = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() {
            text.push('_');
        }
        text.extend(letter.to_lowercase());
    }
    text.split('_').filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

#[test]
fn names_in_the_code_are_words_of_the_field() {
    let mut folders: Vec<PathBuf> =
        ["src", "crates", "reproduction", "examples", "benches"].map(|name| Path::new(PROJECT).join(name)).into();
    let (mut wrong, mut names) = (Vec::new(), 0);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                let kinds = ["fn", "struct", "enum", "trait", "type", "mod", "const", "static"];
                let mut before = "";
                for word in text.split(|letter: char| !letter.is_alphanumeric() && letter != '_') {
                    if kinds.contains(&before) {
                        names += 1;
                        if words(word).iter().any(|part| NAMES.contains(&part.as_str())) {
                            wrong.push(format!("{}: {word}", path.display()));
                        }
                    }
                    before = word;
                }
            }
        }
    }
    assert!(names > 3000, "{names}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
