//! Questions on a terminal, in place of what was not typed.

use std::{
    io::{IsTerminal, stderr, stdin},
    path::Path,
};

use anyhow::Context;
use dialoguer::{Input, Select};

use crate::scene::{self, BUILT_IN};

pub trait Ask {
    /// A text; `proposed` stands there to be edited.
    fn text(&mut self, question: &str, proposed: &str) -> anyhow::Result<String>;
    /// One of several, by its number from 0.
    fn choice(&mut self, question: &str, among: &[String], usual: usize) -> anyhow::Result<usize>;
    /// What is wrong with an answer.
    fn tell(&mut self, what: &str);
}

/// The person at the terminal.
pub struct Terminal;

/// The person at the terminal, where there is one who sees questions and can answer.
pub fn terminal() -> Option<Terminal> {
    (stdin().is_terminal() && stderr().is_terminal()).then_some(Terminal)
}

impl Ask for Terminal {
    fn text(&mut self, question: &str, proposed: &str) -> anyhow::Result<String> {
        let prompt = Input::<String>::new().with_prompt(question).with_initial_text(proposed).allow_empty(true);
        prompt.interact_text().context("the terminal gave no answer")
    }

    fn choice(&mut self, question: &str, among: &[String], usual: usize) -> anyhow::Result<usize> {
        let prompt = Select::new().with_prompt(question).items(among).default(usual);
        prompt.interact().context("the terminal gave no answer")
    }

    fn tell(&mut self, what: &str) {
        eprintln!("  {what}");
    }
}

/// The words that could have been typed behind `start`: files, bench, what differs on it.
pub fn words(ask: &mut dyn Ask) -> anyhow::Result<Vec<String>> {
    let mut words = vec![file(ask, "Record of the last bead, or of a hydrophone (a file)", false)?];
    words.push(file(
        ask,
        "Record of the horn's tip (a file; nothing if it is in the same one, or there is none)",
        true,
    )?);
    words.retain(|word| !word.is_empty());
    let scenes: Vec<String> = BUILT_IN
        .iter()
        .map(|built_in| Ok(format!("{}: {}", built_in.name, scene::load(built_in.name, &[])?.description)))
        .collect::<anyhow::Result<_>>()?;
    let usual = BUILT_IN.iter().position(|built_in| built_in.name == "annulus").unwrap_or(0);
    let name = BUILT_IN[ask.choice("The bench nearest to yours", &scenes, usual)?].name;
    words.extend(["--scene".to_owned(), name.to_owned()]);
    let mut sets = Vec::new();
    loop {
        let set = ask.text("What differs on yours, such as chain.beads=8 (nothing: go on)", "")?;
        if set.trim().is_empty() {
            break;
        }
        let with = [&sets[..], std::slice::from_ref(&set)].concat();
        match scene::load(name, &with) {
            Ok(_) => sets = with,
            Err(error) => ask.tell(&error.to_string()),
        }
    }
    words.extend(sets.into_iter().flat_map(|set| ["--set".to_owned(), set]));
    Ok(words)
}

/// A file that is there.
fn file(ask: &mut dyn Ask, question: &str, may_be_none: bool) -> anyhow::Result<String> {
    loop {
        let answer = ask.text(question, "")?.trim().trim_matches(['\'', '"']).to_owned();
        if answer.is_empty() && may_be_none || Path::new(&answer).is_file() {
            return Ok(answer);
        }
        ask.tell(&format!("`{answer}`: expected a file, found none of that name"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers in their order, and the messages shown.
    struct Prepared(Vec<&'static str>, Vec<String>);

    impl Ask for Prepared {
        fn text(&mut self, _: &str, _: &str) -> anyhow::Result<String> {
            Ok(self.0.remove(0).to_owned())
        }

        fn choice(&mut self, _: &str, among: &[String], _: usize) -> anyhow::Result<usize> {
            let wanted = self.0.remove(0);
            Ok(among.iter().position(|one| one.starts_with(wanted)).unwrap())
        }

        fn tell(&mut self, what: &str) {
            self.1.push(what.to_owned());
        }
    }

    #[test]
    fn answers_become_what_could_have_been_typed_and_wrong_ones_are_asked_for_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "").unwrap();
        let path: &'static str = Box::leak(path.display().to_string().into_boxed_str());
        let answers = vec!["nowhere.csv", path, "", "rigid", "chain.bead=8", "chain.beads=8", ""];
        let mut prompt = Prepared(answers, Vec::new());
        assert_eq!(words(&mut prompt).unwrap(), [path, "--scene", "rigid", "--set", "chain.beads=8"]);
        assert!(
            prompt.1[0].contains("`nowhere.csv`") && prompt.1[1].contains("did you mean `chain.beads`"),
            "{:?}",
            prompt.1
        );
    }
}
