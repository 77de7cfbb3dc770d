//! `granchain-validate stress`: the hard cases, each check with criterion, measured number and limit.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use granchain_calibration::predict::{Bodies, replicates::Unwatched};
use granchain_report::number::{short, significant};
use granchain_validate::stress::{CASES, Check, Limit, StressPlan, run};

#[derive(Debug, Parser)]
#[command(version, about = "Checks of the models that take longer than tests")]
struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Hard cases on every model: criterion, measured number, limit; exit code 1 if a check does not hold
    Stress {
        /// Numbers of the cases to run [default: all]
        #[arg(long, value_name = "N,…", value_delimiter = ',')]
        cases: Vec<u32>,
        /// Shorter runs and coarser meshes: at most two minutes
        #[arg(long)]
        quick: bool,
        /// Override one key of every scene, to see what breaks; repeatable
        #[arg(long = "set", value_name = "KEY=VALUE")]
        set: Vec<String>,
        #[arg(long, value_name = "N", default_value_t = 1)]
        seed: u64,
        #[arg(long)]
        markdown: bool,
    },
}

fn main() -> ExitCode {
    let What::Stress { cases, quick, set, seed, markdown } = Arguments::parse().what;
    if let Some(unknown) = cases.iter().find(|number| CASES.iter().all(|case| case.number != **number)) {
        eprintln!("error: --cases {unknown}: there is no such case; cases are 1 to {}", CASES.len());
        return ExitCode::from(2);
    }
    let plan = StressPlan { quick, cases, overrides: set, seed };
    let outcome = run(&plan, &Bodies::new(None), &Unwatched);
    let mut case = 0;
    if markdown {
        println!("| case | model | check | measured | limit |\n|---|---|---|---:|---:|");
    }
    for check in &outcome.checks {
        let (found, bound, model) = (measured(check), limit(check), check.fidelity.name());
        let verdict = if check.holds { "pass" } else { "FAIL" };
        if markdown {
            println!("| {} {} | {model} | {} | {found} | {bound} |", check.case, check.name, check.criterion);
            continue;
        }
        if check.case != case {
            case = check.case;
            println!("{case} {}", check.name);
        }
        println!("  {verdict}  {model:<19} {}: {found} ({bound})", check.criterion);
        if let Some(note) = &check.note {
            println!("        {note}");
        }
    }
    let (broken, all) = (outcome.broken().count(), outcome.checks.len());
    println!("{}{} of {all} checks hold", if markdown { "\n" } else { "" }, all - broken);
    ExitCode::from(u8::from(broken > 0))
}

/// What was measured, with its unit.
fn measured(check: &Check) -> String {
    check.measured.map_or("nothing".into(), |value| with_unit(significant(value, 3), check.unit))
}

/// What it is held against.
fn limit(check: &Check) -> String {
    match check.limit {
        Limit::AtMost(most) => with_unit(format!("at most {}", short(most)), check.unit),
        Limit::AtLeast(least) => with_unit(format!("at least {}", short(least)), check.unit),
    }
}

fn with_unit(number: String, unit: &str) -> String {
    if unit == "1" { number } else { format!("{number} {unit}") }
}
