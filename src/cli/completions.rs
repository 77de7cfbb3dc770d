//! `granchain completions SHELL`, `granchain man DIR`: what shells and readers of manuals want.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, CommandFactory};

use super::{CommandLine, Outcome, arguments::Session, output::print};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  granchain completions bash > ~/.local/share/bash-completion/completions/granchain\n  \
                        granchain completions zsh > ~/.zfunc/_granchain\n  granchain completions fish > ~/.config/fish/completions/granchain.fish"
)]
pub struct Arguments {
    /// Which shell
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain man ~/.local/share/man/man1")]
pub struct ManArguments {
    /// Folder for `granchain.1` and a page for each subcommand
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut CommandLine::command(), "granchain", &mut script);
    print(String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

pub fn execute_man(arguments: ManArguments, session: &Session) -> anyhow::Result<Outcome> {
    let ManArguments { folder } = arguments;
    let unwritten = || format!("{}: the pages cannot be written", folder.display());
    std::fs::create_dir_all(&folder).with_context(unwritten)?;
    clap_mangen::generate_to(CommandLine::command(), &folder).with_context(unwritten)?;
    session.note(format_args!(
        "pages written to {}; read one with: man -l {}",
        folder.display(),
        folder.join("granchain.1").display()
    ));
    Ok(Outcome::Done)
}
