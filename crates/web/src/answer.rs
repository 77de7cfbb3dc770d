//! What the page asks for: the calls of `granchain start` and `granchain calibrate`.

use std::{path::Path, sync::Arc};

use granchain::{
    calibration::{
        Schedule,
        multi_record::{StatedFrequency, at_one_frequency},
    },
    cli::{
        self,
        arguments::Session,
        calibrate::{
            Job, Preview,
            files::{Reported, Stop},
            prepare, preview,
        },
        inspect::Summary,
        start,
        timing::Timing,
    },
    measurement::drive_frequency_line,
    report::calibration::CalibrationReport,
    scene::{self, BUILT_IN},
};
use serde::Serialize;
use serde_json::{Value, json};

use crate::{
    form::Form,
    word::{Fill, fields_in, in_page_words},
};

/// Why there is no answer: where, what was expected, what was found, what to do, in the page's words.
#[derive(Debug, Serialize)]
pub struct Refused {
    pub message: String,
    /// Fields that the message names.
    pub fields: Vec<&'static str>,
    pub fill: Fill,
}

impl Refused {
    pub fn new(message: String) -> Self {
        Self { fields: fields_in(&message), message, fill: Fill::default() }
    }

    /// What the parser of flags refuses.
    pub fn of_flags(error: &clap::Error) -> Self {
        let text = error.to_string();
        let about = text.split("\n\nUsage:").next().unwrap_or(&text);
        let about = about.split("\n\nFor more information").next().unwrap_or(about);
        Self::new(in_page_words(about.trim_start_matches("error: ").trim()))
    }
}

impl From<anyhow::Error> for Refused {
    fn from(error: anyhow::Error) -> Self {
        let mut message = cli::with_causes(&error);
        if let Some(end) = message.find("\n\nFor more information, try '--help'.") {
            message.truncate(end);
        }
        let remedy = error.chain().find_map(cli::remedy);
        let fill = remedy.as_deref().map(Fill::of).unwrap_or_default();
        if let Some(remedy) = remedy {
            message.push_str(&format!("\n  so enter {}", remedy.trim_start_matches("pass ")));
        }
        Self { fill, ..Self::new(in_page_words(&message)) }
    }
}

/// A built-in bench whose last bead can be recorded.
#[derive(Debug, Serialize)]
pub struct BuiltInBench {
    name: &'static str,
    description: String,
    damping: &'static str,
}

/// The built-in benches, but those that a striker hits.
pub fn benches() -> Vec<BuiltInBench> {
    let of = |name: &'static str| {
        let scene = scene::load(name, &[]).ok().filter(|scene| scene.drive.kind.striker().is_none())?;
        Some(BuiltInBench { name, damping: scene.damping.kind.name(), description: scene.description })
    };
    BUILT_IN.iter().filter_map(|built_in| of(built_in.name)).collect()
}

/// What was understood of the files.
#[derive(Debug, Serialize)]
pub struct Looked {
    /// Name of the horn's file, and why it is that.
    horn: Option<String>,
    why: String,
    /// Column of the horn in the only file.
    tip_channel: Option<String>,
    /// What `granchain inspect --json` says of each.
    records: Vec<Summary>,
    warnings: Vec<String>,
    command: String,
}

/// Read the files, and tell the horn's from the bead's.
pub fn look(form: &Form) -> Result<Looked, Refused> {
    let mut form = form.clone();
    let tip_channel = form.horn_column().filter(|_| form.tip.channel.is_empty());
    form.tip.channel.extend(tip_channel.as_deref());
    let files = form.files();
    let found = start::read(&form.start()?, &start::InMemory(&files))?;
    let records = [Some(&found.bead), found.horn.as_ref()].into_iter().flatten();
    let own = records.clone().flat_map(|record| {
        let place = record.path.display().to_string();
        record.warnings.iter().map(move |text| format!("{place}: {text}"))
    });
    let warnings: Vec<String> = own.chain(found.swapped()).map(|text| in_page_words(&text)).collect();
    let horn = found.horn.as_ref().map(|horn| horn.path.display().to_string());
    form.horn = horn.clone().unwrap_or_default();
    Ok(Looked {
        records: records.map(|record| Summary::of(record, None)).collect(),
        warnings,
        command: form.command()?,
        horn: horn.filter(|_| form.files.len() > 1),
        why: in_page_words(&found.why),
        tip_channel,
    })
}

/// A report, and what was assumed for it.
#[derive(Debug, Serialize)]
pub struct Shown {
    /// `report.html`, to be kept.
    html: String,
    /// In a few words.
    text: String,
    /// The answer, as `calibration.json` or `dry-run.json` has it.
    result: Value,
    assumptions: Vec<String>,
    warnings: Vec<String>,
}

fn shown(job: &Job, report: &CalibrationReport, text: String, result: Value) -> Result<Shown, Refused> {
    let in_words = |texts: &[String]| texts.iter().map(|text| in_page_words(text)).collect();
    Ok(Shown {
        html: report.html().map_err(anyhow::Error::from)?,
        text,
        result,
        assumptions: in_words(&job.problem.assumptions),
        warnings: in_words(&job.problem.warnings()),
    })
}

fn job(form: &Form) -> Result<(Job, Session), Refused> {
    let (arguments, typed, in_memory) = form.calibrate()?;
    let session = arguments.session.clone();
    let job = prepare(arguments, typed, &in_memory)?;
    check_frequency(form, &job)?;
    Ok((job, session))
}

/// Refuses a record whose header states another frequency than the horn's. The program reads the header for it, of a file on the disk.
fn check_frequency(form: &Form, job: &Job) -> Result<(), Refused> {
    let run = job.problem.lead();
    let Some(drive) = &run.bench.drive else { return Ok(()) };
    let files = form.files();
    let line = |path: &Path| {
        let (_, bytes) = files.iter().find(|(name, _)| name == path)?;
        drive_frequency_line(&String::from_utf8_lossy(bytes))
    };
    let stated = |path: &Path, line, frequency| StatedFrequency { path: path.into(), line, frequency };
    let horn = &drive.input.path;
    let of_horn = stated(horn, line(horn).map(|(line, _)| line), drive.motion.drive_frequency);
    let bead = run.measured.path();
    let of_bead = line(bead).map(|(line, frequency)| stated(bead, Some(line), frequency));
    let both: Vec<_> = std::iter::once(of_horn).chain(of_bead).collect();
    Ok(at_one_frequency(&both).map_err(anyhow::Error::from)?)
}

/// The unfitted chain against the record.
pub fn dry_run(form: &Form) -> Result<Shown, Refused> {
    let (job, _) = job(form)?;
    let Preview { report, features, text } = preview(&job)?;
    shown(&job, &report, text, json!(features))
}

/// Fit, confirm, report; `progress` hears how much of how much is done.
pub fn fit(form: &Form, progress: impl Fn(u64, u64) + Send + Sync + 'static) -> Result<Shown, Refused> {
    let (job, session) = job(form)?;
    let work = job.problem.work();
    let watch = Arc::new(move |done| {
        progress(done, work);
        true
    });
    let schedule = Schedule { bodies: None, saved: Vec::new(), watch };
    let fitted = job.problem.fit(schedule).map_err(anyhow::Error::from)?;
    let mut timing = Timing::start();
    let Reported { outcome, report } = Reported::of(&job, &fitted, &session, &mut timing, &Stop(Arc::new(|| false)))?;
    let text = format!("{}", outcome.best.verdict);
    shown(&job, &report, text, json!(outcome))
}
