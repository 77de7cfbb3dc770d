//! `granchain scene explain`: every effect the program knows, on or off in a scene, why, what it costs, what leaving it out would change.

use std::fmt::Write as _;

use anyhow::Context;
use clap::Args;
use serde_json::json;

use crate::{
    calibration::design::variations::{Purpose, Study},
    cli::{
        accuracy::{level, stoppable},
        arguments::{OutputArguments, SceneArguments, Session, usage},
        experiment,
        output::{aligned, page_results, publish, set_flags},
        progress,
        reading::ReadArguments,
        summary,
        timing::Timing,
    },
    measurement::shell_word,
    report::{
        accuracy::{AccuracyReport, advice},
        number::significant,
    },
    scene::{self, Effect, ModelKind, Scene, WaterMethod, simulated, without_each},
};

#[derive(Debug, Args)]
pub struct Arguments {
    /// Built-in scene or scene file
    #[arg(value_name = "NAME|FILE")]
    pub scene: String,
    /// Override one key: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Run the scene without each of its effects and print what that saves and changes
    #[arg(long)]
    pub measure: bool,
    /// Accepted change of the waveform, such as 1%: prints the effects that are below it. Implies --measure
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
    let mut timing = Timing::start();
    // With the record of its horn, where it names one.
    let flags = SceneArguments { scene: Some(name.clone()), set: set.clone(), ..SceneArguments::default() };
    let mut bench = experiment::read(&flags, &ReadArguments::default(), None, ModelKind::Reduced)?;
    bench.limits = session.limits();
    let scene = bench.scene_with(&[])?;
    let folder = output.stage(&page_results("effects.json"))?;
    let study = Study::new(&scene, Purpose::default())?;
    let bar = progress::Bar(progress::bar(session, without_each(&scene).len() as u64, "effects"));
    let outcome = study.effects(&bar);
    bar.0.finish_and_clear();
    let costs = stoppable(outcome)?;
    timing.stage("measure");
    let mut command_line = format!("granchain scene explain {}{} --measure", shell_word(name), set_flags(set));
    if let Some(target) = accuracy {
        write!(command_line, " --accuracy {}%", significant(100.0 * target, 3))?;
    }
    let advice = advice(&costs, *accuracy);
    let report = AccuracyReport {
        program: summary::program(),
        command_line,
        simulated: simulated(&scene),
        calibrated: None,
        accuracy: costs,
    };
    let mut text = advice.join("\n") + "\n\n" + &report.effect_tables().map(|table| aligned(&table)).join("\n");
    text += "\ntime: of a run with its bodies, – below the noise of the measurement. Then what leaving the effect out changes: rms of the waveform, peaks, \
             A(f0/3)/A(f0), A(2f0/3)/A(f0), α and damping of a fit.\n";
    text += &format!("{}.\n", report.simulated);
    text.extend(report.left_out().into_iter().map(|line| line + "\n"));
    if let Some(folder) = folder {
        timing.settings(report.timing());
        publish(folder, report.files("effects", &advice).context("the page cannot be made")?, timing, session)?;
    }
    session.result(text, &json!({ "scene": scene.name, "effects": effects, "costs": report.json(), "advice": advice }))
}

/// The effects of a scene, and those requested on the command line, which are off in a scene by itself.
fn all(scene: &Scene) -> Vec<Effect> {
    let mut effects = scene::effects(scene);
    let method = scene.water.as_ref().map(|water| format!("water.method = {}", water.method.name()));
    let why = method.unwrap_or_else(|| "there is no water".to_owned());
    let by_rayleigh = scene.water.as_ref().is_some_and(|water| water.method == WaterMethod::Rayleigh);
    let after = effects.iter().position(|effect| effect.name == "water behind the disc").map_or(0, |place| place + 1);
    let by_elements = scene.water.is_some() && !by_rayleigh;
    let own = [("water by Rayleigh integral", by_rayleigh), ("water by elements", by_elements)];
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
