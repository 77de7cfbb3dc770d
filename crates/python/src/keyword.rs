//! Flags of the program as keywords of the package, both ways.

use clap::{Arg, ArgAction, Args, Command, Parser};
use granchain::cli::{calibrate, inspect};
use pyo3::prelude::*;

use crate::error::refused;

/// A line of flags and nothing else.
#[derive(Debug, Parser)]
#[command(name = "granchain", no_binary_name = true, disable_help_flag = true)]
struct Line<A: Args> {
    #[command(flatten)]
    arguments: A,
}

/// The arguments that flags say.
///
/// # Errors
/// As the program says it, in keywords.
pub fn arguments<A: Args>(flags: &[String]) -> PyResult<A> {
    Line::<A>::try_parse_from(flags).map(|line| line.arguments).map_err(|error| refused(&error))
}

/// A text in which flags are written as keywords: `--unit mm/s` as `unit='mm/s'`, `--drive-read invert=true` as `drive_invert=True`.
pub fn in_keywords(text: &str) -> String {
    let known =
        [calibrate::Arguments::augment_args(Command::new("")), inspect::Arguments::augment_args(Command::new(""))];
    let find = |name: &str| known.iter().flat_map(Command::get_arguments).find(|it| it.get_long() == Some(name));
    let mut parts = text.split("--");
    let mut written = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(part.len());
        let (name, rest) = part.split_at(end);
        if let Some(of) = ["read", "drive-read"].iter().position(|known| *known == name) {
            written.push_str(&setting(["", "drive_"][of], rest));
            continue;
        }
        match find(name) {
            Some(argument) => written.push_str(&keyword(argument, rest)),
            None => {
                written.push_str("--");
                written.push_str(part);
            }
        }
    }
    written
}

/// A key of a reading as a keyword, with what follows it: ` KEY=VALUE …`, ` 'KEY=VALUE' …`, ` KEY='VALUE' …` or a key alone.
fn setting(prefix: &str, rest: &str) -> String {
    let rest = rest.trim_start();
    let (whole, behind) = match rest.strip_prefix('\'').and_then(|quoted| quoted.split_once('\'')) {
        Some((whole, behind)) => (whole.to_owned(), behind),
        None => {
            let mut quoted = false;
            let end = rest.find(|c: char| {
                quoted ^= c == '\'';
                !quoted && (c.is_whitespace() || ",;)".contains(c))
            });
            let (whole, behind) = rest.split_at(end.unwrap_or(rest.len()));
            (whole.replace('\'', ""), behind)
        }
    };
    match whole.split_once('=') {
        Some((key, "true")) => format!("{prefix}{key}=True{behind}"),
        Some((key, value)) => format!("{prefix}{key}='{value}'{behind}"),
        None => format!("{prefix}{whole}{behind}"),
    }
}

/// A flag's keyword, with what follows the flag.
fn keyword(argument: &Arg, rest: &str) -> String {
    let name = argument.get_long().unwrap_or_default().replace('-', "_");
    if name == "no_limits" {
        return format!("limits=False{rest}");
    }
    if !matches!(argument.get_action(), ArgAction::Set | ArgAction::Append) {
        return format!("{name}=True{rest}");
    }
    let Some(behind) = rest.strip_prefix(' ') else { return format!("{name}{rest}") };
    if let Some(quoted) = behind.strip_prefix('\'')
        && let Some((value, rest)) = quoted.split_once('\'')
    {
        return format!("{name}='{value}'{rest}");
    }
    let end = behind.find(|c: char| c.is_whitespace() || ",;)".contains(c)).unwrap_or(behind.len());
    let value = behind[..end].trim_end_matches(':');
    let rest = &behind[value.len()..];
    let chosen = argument.get_possible_values().iter().any(|possible| possible.matches(value, false));
    let placeholder = value.len() > 1 && value.chars().all(|c| c.is_ascii_uppercase());
    if chosen || placeholder || value.contains(|c: char| c.is_ascii_digit()) {
        return format!("{name}='{value}'{rest}");
    }
    format!("{name} {behind}")
}
