//! The command line: arguments → checked plan → pipeline. No formulas here.
//!
//! Exit codes: 0 done; 1 input or run failed, or a check does not hold; 2 usage; 3 finished unconverged; 4 outside scatter, with
//! `--strict`; 130 stopped by Ctrl-C.
//! Results go to standard output, everything else (progress, notes, errors) to standard error; with `--json` standard
//! output holds the summary and nothing else. A closed pipe (`granchain … | head`) ends the run quietly.

pub mod accuracy;
pub mod arguments;
pub mod calibrate;
mod calibrated;
mod calibrated_drive;
mod completions;
pub mod convert;
pub mod coverage;
mod doctor;
pub mod experiment;
pub mod forecast;
pub mod inspect;
pub mod interrupt;
pub mod mesh;
pub mod output;
pub mod parts;
pub mod progress;
pub mod reading;
mod removed;
pub mod replay;
pub mod scene;
mod slip;
pub mod spectrum;
pub mod start;
pub mod summary;
pub mod sweep;
pub mod sweep_table;
pub mod timing;
pub mod verify;

use std::{ffi::OsString, io::Write, process::ExitCode, sync::OnceLock};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use self::arguments::{OutputArguments, Session};
use crate::{
    calibration::{fit::Verdict, parameter::Parameter},
    measurement::{MeasurementError, shell_line},
    signal::visible,
};

/// How a command ended that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything requested was done: exit code 0.
    Done,
    /// A search finished without converging; its results are written: exit code 3.
    Unconverged,
    /// A check does not hold; its results are written: exit code 1.
    Broken,
    /// No model explains the record, and that was to be a failure; the results are written: exit code 4.
    Unexplained,
}

impl Outcome {
    /// How a fit with this verdict ended: one that does not explain the record is an answer unless `strict`, one still moving is none.
    fn of(verdict: Verdict, strict: bool) -> Self {
        match verdict {
            Verdict::NotConverged => Self::Unconverged,
            Verdict::OutsideScatter if strict => Self::Unexplained,
            _ => Self::Done,
        }
    }

    fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Unconverged => 3,
            Self::Broken => 1,
            Self::Unexplained => 4,
        }
    }
}

#[derive(Debug, Parser)]
#[command(name = "granchain", bin_name = "granchain", version, about, max_term_width = output::WIDEST, after_help = EXIT_CODES)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    session: Session,
    // A command that writes no folder takes it too and has no use for it.
    #[arg(long, global = true, hide = true)]
    force: bool,
}

/// The flags of every command, which only the program's own `--help` lists.
const SESSION: [&str; 6] = ["json", "quiet", "threads", "cache", "seed", "no_limits"];

/// What stands below the flags of a command.
const SESSION_FLAGS: &str =
    "Session flags of every command: --json --quiet --threads N --seed N --cache DIR --no-limits (granchain --help)";

const OUT_OF_CALIBRATE: &str = "Folder for the results, written as a whole or not at all [default: calibrations/NAME]";
const BENCH_OF_ANY_KIND: &str = "File that says how each channel is read (docs/formats.md), not what stands on the bench; flags win over it; needs --kind";
const DRIVE_OF_CALIBRATE: &str = "Horn-tip record that drives the piston; `none`: always the scene's drive [default: horn_tip.csv in the folder of \
                                  the record, else the scene's drive]";
const MODEL_OF_CALIBRATE: &str =
    "Model that gives the values [default: the scene's, else reduced; chain for several records, a pressure, a disc]";

fn fit_of_calibrate() -> String {
    let names = Parameter::names().join(", ");
    format!("Parameters to fit; the others keep the scene's value. Names: {names} [default: alpha,damping]")
}

/// The command line, with session flags listed once.
fn command_line() -> clap::Command {
    let of_calibrate = |command: clap::Command| {
        command
            .mut_arg("out", |out| out.help(OUT_OF_CALIBRATE))
            .mut_arg("drive", |drive| drive.help(DRIVE_OF_CALIBRATE))
            .mut_arg("model", |model| model.help(MODEL_OF_CALIBRATE))
            .mut_arg("fit", |fit| fit.help(fit_of_calibrate()))
    };
    let of_any_kind = |command: clap::Command, name: &str| {
        command.mut_subcommand(name, |command| command.mut_arg("bench", |bench| bench.help(BENCH_OF_ANY_KIND)))
    };
    let command = CommandLine::command().mut_subcommand("calibrate", of_calibrate);
    let mut command = ["inspect", "convert", "spectrum"].into_iter().fold(command, of_any_kind);
    // What is global stands in every command only then.
    command.build();
    command.mut_subcommands(brief)
}

fn brief(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|argument| {
        let hidden = argument.is_hide_set() || SESSION.contains(&argument.get_id().as_str());
        argument.hide(hidden)
    });
    let with_session = |text: &clap::builder::StyledStr| format!("{text}\n\n{SESSION_FLAGS}");
    let after = command.get_after_help().map_or_else(|| SESSION_FLAGS.into(), with_session);
    let long = command.get_after_long_help().map(with_session);
    let command = command.after_help(after).mut_subcommands(brief);
    if let Some(long) = long { command.after_long_help(long) } else { command }
}

impl CommandLine {
    fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let matches = command_line().try_get_matches_from(words)?;
        let mut innermost = &matches;
        while let Some((_, below)) = innermost.subcommand() {
            innermost = below;
        }
        Ok(Self { session: Session::from_arg_matches(innermost)?, ..Self::from_arg_matches(&matches)? })
    }
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 input or run failed; 2 usage; 3 finished unconverged; 4 outside scatter, with --strict; 130, 143, 129 stopped by \
Ctrl-C, SIGTERM, SIGHUP.\nFlags need units: 73kHz, 0.5um, \"0.3 N s/m\"; `--set`, `--bounds`, `--uncertainty` take SI where none is given.\n\
Also: `granchain completions SHELL`, `granchain man`.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Start here: read the files of a laboratory and write a plan for them
    Start(start::Arguments),
    /// Print how granchain reads a record: columns, units, time, and what it assumes
    Inspect(inspect::Arguments),
    /// Write a record of any form as a universal file or a table
    Convert(convert::Arguments),
    /// Print the spectral lines, peaks and bandwidth of a record
    Spectrum(spectrum::Arguments),
    /// List, show, check or start scene files
    Scene(scene::Arguments),
    /// Fit α (motion of the horn's face at the first bead divided by that of the recorded point) and the contact damping to a record
    Calibrate(Box<calibrate::Arguments>),
    /// Run one scene and write its response
    Replay(replay::Arguments),
    /// Run a scene over a grid of values and compare the responses
    Sweep(sweep::Arguments),
    /// Join the parts of a sweep or coverage that were run with --part K/N into one result
    Merge(parts::Arguments),
    /// Draw, count and write the finite element mesh of a scene
    Mesh(mesh::Arguments),
    /// Print error and run time of every model and setting of a scene
    Accuracy(accuracy::Arguments),
    /// Fit synthetic records with known true values and count how often the intervals contain these
    Coverage(coverage::Arguments),
    /// Run a calibration again from its recorded inputs and compare every number
    Verify(verify::Arguments),
    /// Print version, processor, threads and cache as found on this machine
    Doctor(doctor::Arguments),
    /// Print the completions of a shell
    #[command(hide = true)]
    Completions(completions::Arguments),
    /// Write manual pages
    #[command(hide = true)]
    Man(completions::ManArguments),
}

impl Command {
    fn execute(self, session: &Session) -> anyhow::Result<Outcome> {
        match self {
            Self::Start(arguments) => start::execute(arguments, session),
            Self::Calibrate(arguments) => calibrate::execute(*arguments),
            Self::Replay(arguments) => replay::execute(arguments, session),
            Self::Sweep(arguments) => sweep::execute(arguments, session),
            Self::Spectrum(arguments) => spectrum::execute(arguments, session),
            Self::Inspect(arguments) => inspect::execute(arguments, session),
            Self::Convert(arguments) => convert::execute(arguments, session),
            Self::Mesh(arguments) => mesh::execute(arguments, session),
            Self::Accuracy(arguments) => accuracy::execute(arguments, session),
            Self::Verify(arguments) => verify::execute(arguments, session),
            Self::Scene(arguments) => scene::execute(arguments, session),
            Self::Coverage(arguments) => coverage::execute(arguments, session),
            Self::Merge(arguments) => parts::execute(arguments, session),
            Self::Doctor(_) => doctor::execute(session),
            Self::Completions(arguments) => completions::execute(arguments),
            Self::Man(arguments) => completions::execute_man(arguments, session),
        }
    }
}

/// The work that the arguments of a part file name. Only its seed is taken of their session flags; where results go and all else is said by `merge`.
fn divisible(
    arguments: &[String],
    output: &OutputArguments,
    session: &Session,
) -> anyhow::Result<Box<dyn parts::Divisible>> {
    let words = std::iter::once("granchain").chain(arguments.iter().map(String::as_str));
    let CommandLine { command, session: own, .. } = CommandLine::of(words)?;
    if own.no_limits && !session.no_limits {
        return Err(arguments::usage("the parts were run with --no-limits; pass it to `merge` too"));
    }
    let session = Session { seed: own.seed, ..session.clone() };
    let output = output.clone();
    match command {
        Command::Sweep(flags) => Ok(Box::new(sweep::Study::new(sweep::Arguments { output, ..flags }, session)?)),
        Command::Coverage(flags) => coverage::divisible(coverage::Arguments { output, ..flags }, session, arguments),
        _ => {
            let found = arguments.first().map_or("nothing", String::as_str);
            anyhow::bail!("expected the arguments of sweep or coverage, found `{found}`")
        }
    }
}

/// Words of a command line without some flags, and without some that have a value.
fn without(words: impl Iterator<Item = String>, flags: &[&str], with_value: &[&str]) -> Vec<String> {
    let (mut kept, mut is_value) = (Vec::new(), false);
    for word in words {
        if std::mem::take(&mut is_value) {
            continue;
        }
        let name = word.split('=').next().unwrap_or_default();
        if with_value.contains(&name) {
            is_value = !word.contains('=');
        } else if !flags.contains(&name) {
            kept.push(word);
        }
    }
    kept
}

/// Run `granchain` with the process's own arguments.
pub fn run() -> ExitCode {
    run_process(None)
}

fn run_process(subcommand: Option<&str>) -> ExitCode {
    share_freed_memory();
    ExitCode::from(run_typed(std::env::args_os().collect(), subcommand))
}

/// Lets all threads allocate from one heap. By default glibc gives each thread its own, which keeps what the thread has freed: a calibration on two
/// threads then needs 40 % more memory. No step of a run allocates, so threads do not wait for each other.
#[allow(unsafe_code, reason = "there is no safe wrapper of mallopt")]
fn share_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: called first, before there is another thread; it sets a number in the allocator.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}

/// What was typed, the program first; the process's own arguments are another's where the program is run from a Python.
static TYPED: OnceLock<Vec<OsString>> = OnceLock::new();

/// What was typed as text, the program first: what is no UTF-8 in it is shown as U+FFFD.
fn typed() -> impl Iterator<Item = String> {
    TYPED.get().into_iter().flatten().map(|argument| argument.to_string_lossy().into_owned())
}

/// Run `granchain SUBCOMMAND …` with the process's own arguments behind it.
pub fn run_as_subcommand(subcommand: &str) -> ExitCode {
    run_process(Some(subcommand))
}

/// Run `granchain` with what was typed, the program first, behind `subcommand` where one is meant; once in a process. Returns the exit code.
pub fn run_typed(typed: Vec<OsString>, subcommand: Option<&str>) -> u8 {
    let typed = TYPED.get_or_init(|| typed).clone();
    let mut given = typed.into_iter();
    let program = given.next().unwrap_or_else(|| OsString::from("granchain"));
    let arguments = std::iter::once(program).chain(subcommand.map(OsString::from)).chain(given);
    let CommandLine { command, session, .. } = match CommandLine::of(arguments) {
        Ok(line) => line,
        Err(usage) => return explain(usage),
    };
    let outcome = interrupt::watch()
        .map_err(anyhow::Error::from)
        .and_then(|()| session.start())
        .and_then(|()| command.execute(&session));
    match outcome {
        Ok(outcome) => outcome.exit_code(),
        Err(error) if output::is_closed_pipe(&error) => 0,
        Err(error) if error.is::<arguments::UsageError>() => {
            report_failure(&error);
            2
        }
        Err(error) => {
            report_failure(&error);
            interrupt::exit_code().unwrap_or(1)
        }
    }
}

/// Print help or version, or why what was typed is no command and what was probably meant; returns the exit code.
fn explain(mut usage: clap::Error) -> u8 {
    if !usage.use_stderr() {
        let printed = usage.print().and_then(|()| std::io::stdout().flush());
        return match printed {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                report_failure(&anyhow::Error::from(error).context("standard output cannot be written"));
                1
            }
            _ => 0,
        };
    }
    let command = command_line();
    slip::without_hidden(&mut usage, &command);
    let typed: Vec<String> = typed().skip(1).collect();
    let instead = removed::instead_of(&usage).or_else(|| slip::meant(&usage, &typed, &command));
    let instead = instead.map(|instead| format!("\n{instead}\n")).unwrap_or_default();
    // Without a standard error there is nobody left to tell.
    let _ = write!(std::io::stderr().lock(), "{}{}", visible(&usage.render().to_string()), visible(&instead));
    u8::try_from(usage.exit_code()).unwrap_or(2)
}

/// What went wrong, then one `  because …` line for each cause that says something new.
pub fn with_causes(error: &anyhow::Error) -> String {
    let mut message = error.to_string();
    let mut previous = message.clone();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !previous.contains(&cause) {
            message.push_str("\n  because ");
            message.push_str(&cause);
        }
        previous = cause;
    }
    message
}

fn report_failure(error: &anyhow::Error) {
    let mut message = format!("error: {}", with_causes(error));
    if let Some(remedy) = error.chain().find_map(remedy) {
        let typed = shell_line(std::iter::once(program()).chain(typed().skip(1)));
        message.push_str(&format!(
            "\n  then type (replace {} by values of your bench): {typed} {remedy}",
            if remedy.contains('<') { "what is in <>" } else { "words in capitals" }
        ));
    }
    // Without a standard error there is nobody left to tell.
    let _ = writeln!(std::io::stderr().lock(), "{}", output::shown_on(&console::Term::stderr(), &message));
}

/// The name that the program was called by.
fn program() -> String {
    let path = typed().next().unwrap_or_default();
    std::path::Path::new(&path)
        .file_name()
        .map_or_else(|| "granchain".into(), |name| name.to_string_lossy().into_owned())
}

/// The flags that would settle an error in reading a record.
pub fn remedy(error: &(dyn std::error::Error + 'static)) -> Option<String> {
    if let Some(reading::DriveUnread(error)) = error.downcast_ref() {
        return Some(reading::DriveUnread::flags_of_drive(&error.remedy()?));
    }
    if let Some(unread) = error.downcast_ref::<start::Unread>() {
        return Some(unread.flags.clone());
    }
    error.downcast_ref::<MeasurementError>()?.remedy()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::{Outcome, Verdict};

    #[test]
    fn only_a_fit_that_was_still_moving_ends_with_3() {
        let codes = |strict| {
            let verdicts = [Verdict::WithinScatter, Verdict::OutsideScatter, Verdict::NotConverged];
            verdicts.map(|verdict| Outcome::of(verdict, strict).exit_code())
        };
        assert_eq!([codes(false), codes(true)], [[0, 0, 3], [0, 4, 3]]);
    }

    #[test]
    fn every_subcommand_shows_an_example_that_it_takes() {
        for subcommand in super::CommandLine::command().get_subcommands() {
            let help = subcommand.get_after_help().map(ToString::to_string).unwrap_or_default();
            let lines = help.lines().filter_map(|line| line.trim().strip_prefix("granchain "));
            let mut examples = 0;
            for line in lines {
                let line = line.split(" > ").next().unwrap_or_default();
                let arguments = std::iter::once("granchain".to_owned()).chain(shell_words::split(line).unwrap());
                if let Err(error) = super::CommandLine::of(arguments) {
                    panic!("{line}: {error}");
                }
                examples += 1;
            }
            assert!(examples > 0, "{} has no example", subcommand.get_name());
        }
    }

    #[test]
    fn the_argument_tree_is_consistent() {
        super::command_line().debug_assert();
    }

    /// Arguments that `--help` of a command lists, and of those below it.
    fn listed(command: &mut clap::Command, counts: &mut Vec<(String, usize)>) {
        let help = command.render_long_help().to_string();
        let is_argument = |line: &str| {
            let text = line.trim_start();
            let indent = line.len() - text.len();
            (2..=6).contains(&indent) && (text.starts_with("--") || text.starts_with('-') && text.contains(", --"))
        };
        counts.push((command.get_name().to_owned(), help.lines().filter(|line| is_argument(line)).count()));
        for below in command.get_subcommands_mut().filter(|below| !below.is_hide_set() && below.get_name() != "help") {
            listed(below, counts);
        }
    }

    #[test]
    fn the_command_line_stays_small() {
        let mut command = super::command_line();
        command.build();
        let visible: Vec<&str> = command
            .get_subcommands()
            .filter(|below| !below.is_hide_set() && below.get_name() != "help")
            .map(clap::Command::get_name)
            .collect();
        assert_eq!(visible.len(), 14, "{visible:?}");
        let mut counts = Vec::new();
        listed(&mut command, &mut counts);
        let all: usize = counts.iter().map(|(_, count)| count).sum();
        let of_calibrate = counts.iter().find(|(name, _)| name == "calibrate").map(|(_, count)| *count);
        assert!(of_calibrate.is_some_and(|count| count <= 30), "{counts:?}");
        assert!(all <= 230, "{all}: {counts:?}");
    }

    #[test]
    fn session_flags_stand_before_or_behind_the_command() {
        for line in ["granchain --seed 3 doctor", "granchain doctor --seed 3", "granchain --seed 3 scene list"] {
            let parsed = super::CommandLine::of(line.split(' ')).unwrap();
            assert_eq!(parsed.session.seed, Some(3), "{line}");
        }
    }
}
