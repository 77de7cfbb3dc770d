//! What was probably meant where the command line cannot be parsed: quotes round a quantity with a blank, a flag before a file.

use std::path::Path;

use clap::error::{ContextKind, ContextValue};

use crate::{measurement::shell_word, scene::BUILT_IN, signal::Unit};

/// Take hidden commands out of what an error proposes.
pub fn without_hidden(error: &mut clap::Error, command: &clap::Command) {
    let hidden = |name: &String| command.find_subcommand(name).is_some_and(clap::Command::is_hide_set);
    let shown = match error.get(ContextKind::SuggestedSubcommand) {
        Some(ContextValue::String(name)) if hidden(name) => Vec::new(),
        Some(ContextValue::Strings(names)) => names.iter().filter(|name| !hidden(name)).cloned().collect(),
        _ => return,
    };
    error.remove(ContextKind::SuggestedSubcommand);
    if !shown.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(shown));
    }
}

/// What to type instead, in a sentence. `typed` is all that was typed behind the program.
pub fn meant(error: &clap::Error, typed: &[String], command: &clap::Command) -> Option<String> {
    unquoted(typed).or_else(|| without_flag(error, typed, command))
}

/// A quantity in two words, such as `--scale 125 mm/s/V` or `--set duration=1 ms`.
fn unquoted(typed: &[String]) -> Option<String> {
    let at = typed.windows(2).position(|pair| {
        let number = pair[0].rsplit('=').next().unwrap_or_default();
        let is_unit =
            pair[1].starts_with(|first: char| first.is_alphabetic() || first == '%') && Unit::parse(&pair[1]).is_ok();
        is_unit && number.parse::<f64>().is_ok() && !Path::new(&pair[1]).exists()
    })?;
    let value = format!("{} {}", typed[at], typed[at + 1]);
    let flag = typed[..at].last().filter(|word| word.starts_with("--") && !word.contains('='));
    let flag = flag.map_or_else(String::new, |flag| format!("{flag} "));
    Some(format!("a quantity with a blank needs quotes: {flag}{}", shell_word(&value)))
}

/// A file or scene whose flag was left out.
fn without_flag(error: &clap::Error, typed: &[String], command: &clap::Command) -> Option<String> {
    let Some(ContextValue::String(found)) = error.get(ContextKind::InvalidArg) else { return None };
    let command = typed.iter().find_map(|word| command.find_subcommand(word))?;
    let takes = |name: &str| command.get_arguments().any(|it| it.get_long() == Some(name));
    let ends = |end: &str| Path::new(found).extension().is_some_and(|it| it.eq_ignore_ascii_case(end));
    let is_scene = BUILT_IN.iter().any(|scene| scene.name == found);
    let flag = match () {
        () if found.starts_with('-') => return None,
        () if takes("plan") && ends("toml") => "plan",
        () if takes("scene") && (is_scene || ends("toml")) => "scene",
        () if takes("measured") => "measured",
        () if takes("drive") && Path::new(found).is_file() => "drive",
        () => return None,
    };
    let horn = if flag == "measured" { " (and the horn's with --drive FILE)" } else { "" };
    let word = shell_word(found);
    Some(format!("`{}` takes no file or scene without a flag: type --{flag} {word}{horn}", command.get_name()))
}
