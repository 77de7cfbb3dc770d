//! `granchain scene explain`: every effect the program knows, on or off in a scene, why, what it costs, what leaving it out would change.

use std::fmt::Write as _;

use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;

use crate::{
    cli::{
        arguments::{OutputArguments, Session, usage},
        interrupt::{self, Interrupted},
        level::level,
        output::{page_results, publish, set_flags},
        progress, summary,
        timing::Timing,
    },
    measurement::shell_word,
    model::ModelError,
    report::number::{engineering, fixed, significant},
    scene::{self, Effect, Scene, WaterMethod},
    validate::{
        effects::{Advice, EffectCosts, advise, count, is_by_elements, measured},
        page::effects::{EffectsReport, sentences},
    },
};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Built-in scene or scene file
    #[arg(value_name = "NAME|FILE")]
    pub scene: String,
    /// Override one key: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Run the scene with and without each effect and print its cost and influence
    #[arg(long)]
    pub measure: bool,
    /// Accepted error, such as 1%: prints the effects it needs. Implies --measure
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    pub accuracy: Option<f64>,
    #[command(flatten)]
    pub output: OutputArguments,
}

pub fn execute(session: &Session, arguments: &Arguments, scene: &Scene) -> anyhow::Result<()> {
    let Arguments { scene: name, set, measure, accuracy, output } = arguments;
    let effects = all(scene);
    if !*measure && accuracy.is_none() {
        if output.out.is_some() {
            return Err(usage("--out needs --measure: without it there is nothing to draw"));
        }
        return session.result(listed(scene, &effects), &json!({ "scene": scene.name, "effects": effects }));
    }
    if let Some(file) = scene.pending_record() {
        bail!(
            "`drive.file` {}: effects are measured under a drive by a formula; give `--set drive.kind=tone-burst` and its keys",
            file.display()
        );
    }
    let mut timing = Timing::start();
    let folder = output.stage(&page_results("effects.json"))?;
    let bar = progress::Bar(progress::bar(session, count(), "effects"));
    let outcome = measured(scene, &bar);
    bar.0.finish_and_clear();
    let costs = match outcome {
        Err(ModelError::Stopped { .. }) if interrupt::requested() => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    timing.stage("measure");
    let advice = accuracy.map(|target| advise(&costs.effects, target));
    let text = table(&effects, &costs, advice.as_ref())?;
    let mut command_line = format!("granchain scene explain {}{} --measure", shell_word(name), set_flags(set));
    if let Some(target) = accuracy {
        write!(command_line, " --accuracy {}%", significant(100.0 * target, 3))?;
    }
    let report = EffectsReport { program: summary::program(), command_line, costs, advice };
    if let Some(folder) = folder {
        publish(folder, report.files().context("the page cannot be made")?, timing, session)?;
    }
    session.result(
        text,
        &json!({ "scene": scene.name, "effects": effects, "costs": report.costs, "advice": report.advice }),
    )
}

/// The effects of a scene, and those requested on the command line, which are off in a scene by itself.
fn all(scene: &Scene) -> Vec<Effect> {
    let mut effects = scene::effects(scene);
    let method = scene.water.as_ref().map(|water| format!("water.method = {}", water.method.name()));
    let why = method.unwrap_or_else(|| "there is no water".to_owned());
    let by_rayleigh = scene.water.as_ref().is_some_and(|water| water.method == WaterMethod::Rayleigh);
    let after = effects.iter().position(|effect| effect.name == "water behind the disc").map_or(0, |place| place + 1);
    let own = [("water by Rayleigh integral", by_rayleigh), ("water by elements", is_by_elements(scene))];
    for (offset, (name, on)) in own.into_iter().enumerate() {
        effects.insert(after + offset, Effect { name, on, why: why.clone() });
    }
    let on_request = |name, flag: &str| Effect { name, on: false, why: format!("asked for by replay {flag}") };
    effects.extend([
        on_request("fields", "--fields"),
        on_request("field of the water", "--pressure-map"),
        on_request("ensemble of perturbed runs", "--ensemble"),
    ]);
    effects
}

fn listed(scene: &Scene, effects: &[Effect]) -> String {
    let width = effects.iter().map(|effect| effect.name.chars().count()).max().unwrap_or(0);
    let mut text =
        format!("{}: {} of {} effects are on\n\n", scene.name, effects.iter().filter(|e| e.on).count(), effects.len());
    for effect in effects {
        let state = if effect.on { "on " } else { "off" };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {state}  {:width$}  {}", effect.name, effect.why);
    }
    text.push_str("\nAn effect that is off takes no time. --measure: cost and influence of each\n");
    text
}

fn table(effects: &[Effect], costs: &EffectCosts, advice: Option<&Advice>) -> anyhow::Result<String> {
    let mut text = String::new();
    let base = &costs.base;
    writeln!(
        text,
        "{} on model {}, the first {}: {} a run, {} unknowns, {} steps\n",
        costs.scene,
        costs.model,
        engineering(costs.window_s, "s", 3),
        engineering(base.run_s, "s", 3),
        base.work.unknowns,
        base.work.steps
    )?;
    let width = effects.iter().map(|effect| effect.name.chars().count()).max().unwrap_or(0);
    writeln!(
        text,
        "       {:width$}  {:>9} {:>9} {:>7}  {:>9} {:>8} {:>7} {:>9}",
        "", "unknowns", "us/step", "share", "waveform", "peak", "1/3", "pressure"
    )?;
    let percent = |value: f64| format!("{} %", significant(100.0 * value, 2));
    for effect in effects {
        let state = if effect.on { "on " } else { "off" };
        write!(text, "  {state}  {:width$}", effect.name)?;
        let row = costs.effects.iter().find(|row| row.name == effect.name);
        match row.and_then(|row| row.measured) {
            Some(measured) => {
                let change = measured.change;
                let per_step = 1e6 * measured.with.run_s / measured.with.work.steps.max(1) as f64;
                writeln!(
                    text,
                    "  {:>9} {:>9} {:>7}  {:>9} {:>8} {:>7} {:>9}",
                    format!("{:+}", measured.unknowns()),
                    significant(per_step, 3),
                    percent(measured.share()),
                    percent(change.waveform),
                    percent(change.peak),
                    change.ratio_third.map_or("–".into(), |ratio| fixed(ratio, 3)),
                    change.pressure.map_or("–".into(), percent),
                )?;
            }
            None => {
                let refused = row.and_then(|row| row.refused.clone());
                writeln!(text, "  {}", refused.unwrap_or_else(|| effect.why.clone()))?;
            }
        }
    }
    text.push_str(
        "\nunknowns, time a step and share of the time: of a run with the effect beside one without it. Then what leaving it out changes, or\n\
         would change where it is off: rms of the waveform at the last bead's centre, its peak, A(f0/3)/A(f0), peak pressure.\n",
    );
    if let Some(advice) = advice {
        text.push('\n');
        for sentence in sentences(advice) {
            writeln!(text, "{sentence}")?;
        }
    }
    Ok(text)
}
