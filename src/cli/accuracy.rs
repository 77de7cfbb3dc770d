//! `granchain accuracy`: what models, meshes and steps of one's own scene cost, and what they are worth; `--accuracy LEVEL` of other commands.

use std::{path::PathBuf, time::Duration};

use anyhow::{Context, bail};
use clap::Args;

use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, expected, usage},
    calibrate::definition::refused,
    calibrated::Calibrated,
    experiment,
    forecast::rough_time,
    interrupt::{self, Interrupted},
    output::{aligned, page_results, publish, set_flags},
    progress,
    reading::ReadArguments,
    summary,
    timing::Timing,
};
use crate::{
    calibration::{
        Plan, Problem,
        design::variations::{Accuracy, Method, Purpose, Study},
    },
    measurement::{
        read_back::{SMALL, read_back_text},
        sha256, shell_word,
    },
    model::{ModelError, reduced::Cache},
    report::{accuracy::AccuracyReport, number::significant},
    scene::{ModelKind, Scene, simulated},
};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  granchain accuracy bench.toml\n  granchain accuracy --plan plan.toml --calibration fit --out accuracy"
)]
pub struct Arguments {
    /// Built-in scene or scene file
    #[arg(value_name = "NAME|FILE", conflicts_with_all = ["scene", "plan"])]
    pub bench: Option<String>,
    /// The same, as a flag [default: rigid]
    #[arg(long, value_name = "NAME|FILE", conflicts_with = "plan", help_heading = "Scene")]
    pub scene: Option<String>,
    /// Plan of a fit: its scene, its horn record, the noise of its record
    #[arg(long, value_name = "FILE", help_heading = "Scene")]
    pub plan: Option<PathBuf>,
    /// Use α, damping, scene and horn record of a calibration, and compare shifts with its intervals
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub calibration: Option<PathBuf>,
    /// Horn-tip record that drives the piston
    #[arg(long, value_name = "FILE", conflicts_with = "plan", help_heading = "Scene")]
    pub drive: Option<PathBuf>,
    /// Override one key of the scene: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Also run finite elements
    #[arg(long, help_heading = "Study")]
    pub fea: bool,
    /// Gone: everything is measured now, of any scene
    #[arg(long, hide = true)]
    pub full: bool,
    /// Gone: nothing is stored with the program
    #[arg(long, hide = true)]
    pub stored: bool,
    #[command(flatten)]
    pub output: OutputArguments,
}

impl Arguments {
    /// The scene, what its runs are compared for, and the command line.
    fn read(&self, session: &Session) -> anyhow::Result<(Scene, Purpose, Option<Calibrated>)> {
        let calibrated = self.calibration.as_deref().map(Calibrated::read).transpose()?;
        let mut purpose = Purpose { fea: self.fea, ..Purpose::default() };
        let mut bench = None;
        if let Some(path) = &self.plan {
            let problem = Problem::read(&Plan::read(path)?).map_err(refused)?;
            let lead = problem.lead();
            purpose = Purpose { fea: self.fea, ..Purpose::of_record(&lead.comparison, lead.uncertainty) };
            bench = Some(lead.bench.clone());
        }
        let mut bench = match bench {
            Some(mut bench) => {
                bench.overrides.extend(calibrated.iter().flat_map(|calibrated| calibrated.overrides.iter().cloned()));
                bench.overrides.extend(self.set.iter().cloned());
                bench
            }
            None => {
                let own = || calibrated.is_none().then(|| "rigid".to_owned());
                let flags = SceneArguments {
                    scene: self.bench.clone().or_else(|| self.scene.clone()).or_else(own),
                    drive: self.drive.iter().cloned().collect(),
                    set: self.set.clone(),
                    ..SceneArguments::default()
                };
                experiment::read(&flags, &ReadArguments::default(), calibrated.as_ref(), ModelKind::Reduced)?
            }
        };
        bench.limits = session.limits();
        session.assumed(&bench.assumptions);
        session.warn(bench.warnings());
        Ok((bench.scene_with(&[])?, purpose, calibrated))
    }

    fn command_line(&self) -> String {
        let mut text = "granchain accuracy".to_owned();
        let mut named = |flag: &str, value: Option<String>| {
            if let Some(value) = value {
                text += &format!("{flag} {}", shell_word(&value));
            }
        };
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        named("", self.bench.clone());
        named(" --scene", self.scene.clone());
        named(" --plan", path(&self.plan));
        named(" --calibration", path(&self.calibration));
        named(" --drive", path(&self.drive));
        text + &set_flags(&self.set) + if self.fea { " --fea" } else { "" }
    }
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    for (given, flag) in [(arguments.full, "--full"), (arguments.stored, "--stored")] {
        if given {
            return Err(usage(format!("{flag} has gone: all settings are measured, of any scene; leave it out")));
        }
    }
    let mut timing = Timing::start();
    let (scene, purpose, calibrated) = arguments.read(session)?;
    let folder = arguments.output.stage(&page_results("accuracy.json"))?;
    timing.stage("read");
    let accuracy = measured(&scene, purpose, session)?;
    timing.stage("measure");
    keep(session, &scene, &accuracy);
    let report = AccuracyReport {
        program: summary::program(),
        command_line: arguments.command_line(),
        simulated: simulated(&scene),
        calibrated: calibrated.and_then(|calibrated| calibrated.half_widths()),
        accuracy,
    };
    let mut text = format!("{}.\n\n", report.compared());
    text += &report.tables().map(|table| aligned(&table)).join("\n");
    text += &format!("\n{}\n{}.\n", report.legend(), report.simulated);
    text.extend(report.left_out().into_iter().map(|line| line + "\n"));
    if let Some(folder) = folder {
        timing.settings(report.timing());
        publish(folder, report.files("accuracy", &[]).context("the page cannot be made")?, timing, session)?;
    } else {
        text += "Nothing was written; pass --out DIR for the page, the figure and the tables.\n";
    }
    session.result(text, &report.json())?;
    Ok(Outcome::Done)
}

fn measured(scene: &Scene, purpose: Purpose, session: &Session) -> anyhow::Result<Accuracy> {
    let study = Study::new(scene, purpose)?;
    let [all, fea] = study.expected_seconds();
    let of_fea = if fea > 0.0 { format!(", {} of it finite elements", about(fea)) } else { String::new() };
    session.note(format_args!("measuring takes about {}{of_fea}, on one thread", about(all)));
    let bar = progress::Bar(progress::work(session, study.cost(), "settings"));
    let outcome = study.measure(session.cache().as_ref(), &bar);
    bar.0.finish_and_clear();
    stoppable(outcome)
}

fn about(seconds: f64) -> String {
    rough_time(Duration::from_secs_f64(seconds.max(1.0)))
}

/// What a study measured; stopped by Ctrl-C, an end of its own.
pub fn stoppable(outcome: Result<Accuracy, ModelError>) -> anyhow::Result<Accuracy> {
    match outcome {
        Err(ModelError::Stopped { .. }) if interrupt::requested() => Err(Interrupted.into()),
        outcome => Ok(outcome?),
    }
}

/// File of what was measured of a scene: the program's version and the scene with its drive decide.
fn kept_as(cache: &Cache, scene: &Scene) -> PathBuf {
    let key = sha256(format!("{} {}", summary::program(), summary::scene_digest(scene)).as_bytes());
    cache.folder().join(format!("accuracy-{key}.json"))
}

/// Keep it beside the bodies. What cannot be kept is measured again.
fn keep(session: &Session, scene: &Scene, accuracy: &Accuracy) {
    let Some(cache) = session.cache() else { return };
    let kept = || -> anyhow::Result<()> {
        std::fs::create_dir_all(cache.folder())?;
        let mut file = tempfile::NamedTempFile::new_in(cache.folder())?;
        serde_json::to_writer(&mut file, accuracy)?;
        file.persist(kept_as(&cache, scene))?;
        Ok(())
    };
    if let Err(error) = kept() {
        session.note(format_args!("what was measured cannot be kept: {error:#}"));
    }
}

fn found(session: &Session, scene: &Scene) -> Option<Accuracy> {
    let text = read_back_text(&kept_as(&session.cache()?, scene), SMALL).ok()?;
    serde_json::from_str(&text).ok()
}

/// A setting for `--accuracy LEVEL`.
pub struct Choice {
    /// The overrides, below those of the caller.
    pub sets: Vec<String>,
    /// Which setting, what it is worth and what it takes.
    pub note: String,
}

/// The cheapest setting of a scene whose error, √(total² + own²), is at most `level`, of those of `models`: by what was measured of this very scene, now
/// if it never was.
pub fn choose(scene: &Scene, level: f64, models: &[ModelKind], session: &Session) -> anyhow::Result<Choice> {
    let accuracy = match found(session, scene) {
        Some(accuracy) => accuracy,
        None => {
            session.note("--accuracy: nothing is measured of this scene yet");
            let accuracy = measured(scene, Purpose::default(), session)?;
            keep(session, scene, &accuracy);
            accuracy
        }
    };
    let takes = |method: Method| {
        models.contains(&match method {
            Method::Hertz | Method::FiniteBody => ModelKind::Chain,
            Method::Reduced => ModelKind::Reduced,
            Method::Fea | Method::Effect => ModelKind::Fea,
        })
    };
    let percent = |error: f64| format!("{} %", significant(100.0 * error, 2));
    let Some(chosen) = accuracy.cheapest_within(level, takes) else {
        let best = accuracy.most_accurate(takes).map_or(String::new(), |(best, error)| {
            format!("; the most accurate, {}, is within {}", best.label(), percent(error))
        });
        bail!("--accuracy {}: no setting of this scene is shown to be as accurate{best}", percent(level));
    };
    let note = format!(
        "{}, by --accuracy {}: error {}, of step and mesh {}, over the first {:.0} us of this scene; about {} s",
        chosen.label(),
        percent(level),
        percent(chosen.total.max(accuracy.reference_error)),
        percent(chosen.own.unwrap_or_default()),
        1e6 * accuracy.window_s[1],
        significant(chosen.seconds(), 2)
    );
    Ok(Choice { sets: chosen.sets.clone(), note })
}

/// Value parser of a level: `1%` or `0.01`, above 0 and below 1.
pub fn level(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, factor) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim_end(), 0.01));
    match number.parse::<f64>() {
        Ok(value) if value > 0.0 && value * factor < 1.0 => Ok(value * factor),
        _ => Err(expected("a level such as `1%` or `0.01`, above 0 and below 100 %", text)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_a_percentage_or_a_fraction() {
        for (text, value) in [("1%", 0.01), ("0.1 %", 0.001), ("0.05", 0.05)] {
            assert!((level(text).unwrap() - value).abs() < 1e-15);
        }
        for text in ["0", "-1%", "1", "100%", "much", "nan", "inf"] {
            assert!(level(text).is_err(), "{text}");
        }
    }
}
