//! `granchain convergence`: the same scene on several meshes and steps, held against a refined run.

use std::fmt::Write as _;

use anyhow::Context;
use clap::Args;

use super::study::set_flags;
use super::{
    Outcome,
    arguments::{OutputArguments, Session, ValueError, positive_time, time, usage},
    interrupt::{self, Interrupted},
    output::{OutputFolder, page_results},
    progress, summary,
    timing::{self, Timing},
};
use crate::{
    measurement::shell_word,
    model::Estimate,
    report::{
        convergence::{ConvergenceReport, name},
        number::{fixed, significant},
    },
    scene,
    study::convergence::{Convergence, ConvergenceError, ConvergencePlan, Resolution, converge, cost},
};

/// Arguments of `granchain convergence`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain convergence --scene rigid --out convergence")]
pub struct Arguments {
    /// Built-in scene (see `granchain scene list`) or scene file
    #[arg(long, value_name = "NAME|FILE", default_value = "rigid", help_heading = "Scene")]
    pub scene: String,
    /// Override one key of the scene: a plain number is SI, else with its unit; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Mesh densities
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "8,12,16", help_heading = "Study")]
    pub densities: Vec<u32>,
    /// Steps, each with its unit
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = positive_time, default_value = "0.1us,0.05us,0.02us",
          help_heading = "Study")]
    pub steps: Vec<f64>,
    /// Mesh density of the refined run
    #[arg(long, value_name = "N", default_value_t = 16, help_heading = "Study")]
    pub reference_density: u32,
    /// Step of the refined run
    #[arg(long, value_name = "TIME", value_parser = positive_time, default_value = "0.01us", help_heading = "Study")]
    pub reference_step: f64,
    /// Windows of time in which errors are measured: FROM:TO with units
    #[arg(long, value_name = "FROM:TO,…", value_delimiter = ',', value_parser = window,
          default_value = "0us:30us,30us:60us,60us:70us", help_heading = "Study")]
    pub windows: Vec<(f64, f64)>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

fn window(text: &str) -> Result<(f64, f64), ValueError> {
    let (from, to) = text.split_once(':').ok_or_else(|| ValueError::NoWindow { found: text.into() })?;
    Ok((time(from)?, positive_time(to)?))
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scene or the plan; a run that fails; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { scene: source, set, densities, steps, reference_density, reference_step, windows, output, session } =
        arguments;
    let mut timing = Timing::start();
    let overrides: Vec<String> = std::iter::once("model.kind=fea".to_owned()).chain(set.iter().cloned()).collect();
    let scene = scene::load(&source, &overrides)?.with_limits(session.limits());
    let check = |more: &[String]| -> anyhow::Result<()> {
        Ok(Estimate::of(&scene::load(&source, more)?).check(&scene.model.limits)?)
    };
    // A density or step that no scene may have is refused as one of the scene is, before anything runs.
    for density in densities.iter().chain([&reference_density]) {
        let more = [&overrides[..], &[format!("model.mesh_density={density}")]].concat();
        check(&more)?;
    }
    for step in steps.iter().chain([&reference_step]) {
        let more = [&overrides[..], &[format!("model.step={step}"), format!("output_step={step}")]].concat();
        check(&more)?;
    }
    let plan = ConvergencePlan {
        densities,
        steps_s: steps,
        reference: Resolution { density: reference_density, step_s: reference_step },
        windows_s: windows,
        ..ConvergencePlan::default()
    };
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("convergence.json"), output.force))
        .transpose()?;
    timing.stage("read");

    let bar = progress::Bar(progress::bar(&session, cost(&plan), "runs"));
    let outcome = converge(&scene, &plan, &bar);
    bar.0.finish_and_clear();
    let convergence = match outcome {
        Ok(convergence) => convergence,
        Err(ConvergenceError::Stopped) => return Err(Interrupted.into()),
        Err(error @ (ConvergenceError::CoarseReference { .. } | ConvergenceError::Window { .. })) => {
            return Err(usage(error.to_string()));
        }
        Err(error) => return Err(error.into()),
    };
    timing.stage("run");

    let report = ConvergenceReport {
        program: summary::program(),
        scene: scene.name.clone(),
        description: scene.description.clone(),
        convergence,
        command_line: command_line(&source, &set, &plan),
    };
    if let Some(folder) = folder {
        for (name, bytes) in report.files().context("the report cannot be made")? {
            folder.write(name, bytes)?;
            interrupt::check()?;
        }
        folder.write("scene.toml", scene.to_toml())?;
        timing.stage("write");
        folder.write(timing::FILE, timing.to_json())?;
        let place = folder.finish()?;
        session.note(format_args!("written to {}", place.display()));
    }
    session.result(text(&report.convergence, output.out.is_none()), &report.convergence)?;
    Ok(Outcome::Done)
}

fn command_line(source: &str, set: &[String], plan: &ConvergencePlan) -> String {
    let list = |values: &[f64]| values.iter().map(|value| in_microseconds(*value)).collect::<Vec<_>>().join(",");
    let densities: Vec<String> = plan.densities.iter().map(u32::to_string).collect();
    let windows: Vec<String> =
        plan.windows_s.iter().map(|&(from, to)| format!("{}:{}", in_microseconds(from), in_microseconds(to))).collect();
    let mut text = format!("granchain convergence --scene {}{}", shell_word(source), set_flags(set));
    let _ = write!(
        text,
        " --densities {} --steps {} --reference-density {} --reference-step {} --windows {}",
        densities.join(","),
        list(&plan.steps_s),
        plan.reference.density,
        in_microseconds(plan.reference.step_s),
        windows.join(",")
    );
    text
}

/// A time as typed, with no more digits than it was given.
fn in_microseconds(time: f64) -> String {
    let digits: f64 = format!("{:.11e}", 1e6 * time).parse().unwrap_or(1e6 * time);
    format!("{digits}us")
}

fn text(convergence: &Convergence, nothing_written: bool) -> String {
    let mut text = format!("{:>8}{:>10}{:>11}{:>13}", "density", "step us", "unknowns", "entries read");
    for (from, to) in &convergence.plan.windows_s {
        let _ = write!(
            text,
            "{:>14}",
            format!(
                "{}-{} us",
                in_microseconds(*from).trim_end_matches("us"),
                in_microseconds(*to).trim_end_matches("us")
            )
        );
    }
    text.push('\n');
    for run in &convergence.runs {
        let Resolution { density, step_s } = run.resolution;
        let step = in_microseconds(step_s);
        let _ = write!(
            text,
            "{density:>8}{:>10}{:>11}{:>13}",
            step.trim_end_matches("us"),
            run.unknowns,
            format!("{:.2e}", run.entries_read as f64)
        );
        for error in &run.errors {
            let _ = write!(text, "{:>14}", format!("{} %", fixed(100.0 * error, 2)));
        }
        text.push('\n');
    }
    let _ =
        writeln!(text, "against {}; rms in the window over the reference's", name(&convergence.reference.resolution));
    if let Some(lead) = &convergence.lead {
        let microseconds = |seconds: f64| significant(1e6 * seconds, 2);
        let _ = writeln!(
            text,
            "lead of the finite elements in the first pulse: {} us; of a chain with contacts {} % stiffer: {} us",
            microseconds(lead.fea_s),
            fixed(100.0 * lead.excess, 1),
            microseconds(lead.stiffened_s)
        );
    }
    if nothing_written {
        text.push_str("Nothing was written; pass --out DIR for the page, the figures and the tables.\n");
    }
    text
}
