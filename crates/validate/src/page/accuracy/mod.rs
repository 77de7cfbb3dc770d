//! The page of what accuracy costs: errors against time and against work, the settings in a table, the references and how far they converged.

mod figures;
mod tables;

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::accuracy::{
    Accuracy, Cost, is_processor_time,
    ladder::{FidelityLevel, Varied},
    stored::{Measured, OwnErrors, Stored},
};
use granchain_report::{
    number::{engineering, short, significant},
    page::{Block, Files, Page, Plate, ReportError, Tone, provenance},
};

/// The levels that are answered.
const LEVELS: [f64; 3] = [0.05, 0.01, 0.001];

/// A ladder measured, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyReport {
    pub program: String,
    /// Command line that makes the same page, its times those of another machine.
    pub command_line: String,
    /// Whether there is something new to be stored: references computed again.
    pub store: bool,
    pub accuracy: Accuracy,
}

/// A relative error as one says it, `0.45 %`.
#[must_use]
pub fn percent(error: f64) -> String {
    format!("{} %", significant(100.0 * error, 2))
}

/// Model and what tells the setting from others of it.
#[must_use]
pub fn setting_of(measured: &Measured) -> String {
    let (fidelity, setting) = (measured.setting.fidelity.name(), measured.setting.to_string());
    if setting.is_empty() { fidelity.to_owned() } else { format!("{fidelity}, {setting}") }
}

/// Seconds of bodies made and of one run.
#[must_use]
pub fn seconds(cost: &Cost) -> String {
    let (setup, run) = (engineering(cost.setup_s.least, "s", 2), engineering(cost.run_s.least, "s", 2));
    // What has no bodies to make.
    if cost.setup_s.least < 1e-4 { format!("{run} a run") } else { format!("{setup} to make the bodies, {run} a run") }
}

/// The cheapest setting within each level, a sentence each.
#[must_use]
pub fn sentence(found: &Stored) -> String {
    let level = |level: f64| match found.cheapest_within(level, |_| true) {
        Some(measured) => {
            format!(
                "within {}: {} ({}; {})",
                percent(level),
                setting_of(measured),
                percent(measured.error),
                seconds(&measured.cost)
            )
        }
        None if found.least_quotable() > level => {
            format!(
                "within {}: none that could be shown, the reference is known to {}",
                percent(level),
                percent(found.least_quotable())
            )
        }
        None => format!("within {}: none of the ladder", percent(level)),
    };
    let answers: Vec<String> = LEVELS.map(level).to_vec();
    format!("Cheapest {}. Chaos floor {}.", answers.join("; "), percent(found.chaos.floor))
}

/// The table for a terminal.
#[must_use]
pub fn text(accuracy: &Accuracy) -> String {
    let found = &accuracy.found;
    let front = found.front();
    let names: Vec<String> = found.measured.iter().map(setting_of).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max("model and setting".len());
    let mut text = format!("  {:<width$}{:>8}{:>10}{:>9}\n", "model and setting", "error", "setup s", "run s");
    for (index, (name, measured)) in names.iter().zip(&found.measured).enumerate() {
        let mark = if front.contains(&index) { "*" } else { " " };
        let old = if accuracy.fresh.get(index) == Some(&true) { "" } else { " †" };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{mark} {name:<width$}{:>8}{:>10}{:>9}{old}",
            percent(measured.error),
            significant(measured.cost.setup_s.least, 2),
            significant(measured.cost.run_s.least, 2)
        );
    }
    if !found.measured.iter().enumerate().all(|(index, _)| accuracy.fresh.get(index) == Some(&true)) {
        text.push_str("† as stored with the program\n");
    }
    let _ = writeln!(text, "* nothing is both cheaper and more accurate; errors over {}", window(found));
    for own in &found.own {
        let _ = writeln!(text, "{}", order_said(own));
    }
    let _ = writeln!(
        text,
        "the reference ({}) changes by {} to the next level; least error quoted {}",
        found.references.first().map_or(String::new(), |best| best.setting.to_string()),
        percent(found.references.first().map_or(0.0, |best| best.change)),
        percent(found.least_quotable())
    );
    let _ = writeln!(text, "{}", sentence(found));
    text
}

fn window(found: &Stored) -> String {
    format!("the first {}", engineering(found.window_s, "s", 3))
}

/// What a line is of.
fn line_name(own: &OwnErrors) -> &'static str {
    if own.key == "contact-force" { "static contact force" } else { own.fidelity.name() }
}

fn order_said(own: &OwnErrors) -> String {
    let order = own.order.map_or("no order".to_owned(), |order| format!("order {}", significant(order, 2)));
    format!("{}: {order} in the {}", line_name(own), own.varied.name())
}

impl AccuracyReport {
    /// `report.html`, `report.md`, the figures, `accuracy.json`, `accuracy.csv`; with references computed again also `stored-SCENE.json`, which
    /// is what the program keeps of a built-in scene.
    ///
    /// # Errors
    /// [`ReportError`] when nothing was measured, or an error is not finite.
    pub fn files(&self) -> Result<Files, ReportError> {
        let found = &self.accuracy.found;
        if found.measured.is_empty() {
            return Err(ReportError::Missing { field: "settings" });
        }
        if let Some(wrong) = found.measured.iter().find(|measured| !measured.error.is_finite()) {
            let field = format!("error of {}", setting_of(wrong));
            return Err(ReportError::NotFinite { field, found: wrong.error });
        }
        let mut files = self.page().files()?;
        let mut json = serde_json::to_vec_pretty(&without_times(self.json()))?;
        json.push(b'\n');
        files.push(("accuracy.json".into(), json));
        files.push(("accuracy.csv".into(), self.csv().into_bytes()));
        if self.store {
            files.push((format!("stored-{}.json", found.scene.replace(['/', '\\'], "_")).into(), found.to_json()?));
        }
        Ok(files)
    }

    /// All that was found, times and memory included, waveforms left out.
    #[must_use]
    pub fn json(&self) -> Value {
        let found = &self.accuracy.found;
        let reference = |reference: &crate::accuracy::stored::Reference| json!({"key": reference.key, "setting": reference.setting, "next": reference.next, "change": reference.change});
        let setting = |(measured, fresh): (&Measured, &bool)| {
            let mut value = json!(measured);
            value["measured_now"] = json!(fresh);
            value
        };
        let cheapest = LEVELS.map(
            |level| json!({"within": level, "setting": found.cheapest_within(level, |_| true).map(|measured| &measured.setting)}),
        );
        json!({
            "program": self.program,
            "scene": found.scene,
            "watched": found.watched,
            "window_s": found.window_s,
            "references": found.references.iter().map(reference).collect::<Vec<_>>(),
            "least_error_quoted": found.least_quotable(),
            "chaos": found.chaos,
            "own_errors": found.own,
            "settings": found.measured.iter().zip(&self.accuracy.fresh).map(setting).collect::<Vec<_>>(),
            "front": found.front().into_iter().map(|place| &found.measured[place].setting).collect::<Vec<_>>(),
            "cheapest": cheapest,
        })
    }

    /// What each setting took, for `timing.json`.
    #[must_use]
    pub fn timing(&self) -> Value {
        let found = &self.accuracy.found;
        let settings = found.measured.iter().zip(&self.accuracy.fresh).filter(|(_, fresh)| **fresh);
        let settings: Vec<Value> = settings
            .map(|(measured, _)| json!({"setting": measured.setting, "error": measured.error, "cost": measured.cost}))
            .collect();
        let timing = json!({"processor": found.processor, "processor_time": is_processor_time(), "measured": settings});
        timing
    }

    fn csv(&self) -> String {
        let found = &self.accuracy.found;
        let mut text =
            "model,setting,error,energy,unknowns,steps,rejected_steps,evaluations,events,solves,contact_sweeps,active_sets"
                .to_owned();
        for feature in &found.chaos.features {
            let _ = write!(text, ",{}_{}", feature.key, feature.unit.replace('/', "_per_"));
        }
        text.push('\n');
        for measured in &found.measured {
            let (fidelity, setting, work) = (measured.setting.fidelity.name(), &measured.setting, measured.work);
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\"{fidelity}\",\"{setting}\",{:e},{:e},{},{},{},{},{},{},{},{}",
                measured.error,
                measured.energy,
                work.unknowns,
                work.steps,
                work.rejected_steps,
                work.evaluations,
                work.events,
                work.solves,
                work.contact_sweeps,
                work.active_sets
            );
            for value in &measured.features {
                let _ = write!(text, ",{}", value.map_or(String::new(), |value| format!("{value:e}")));
            }
            text.push('\n');
        }
        text
    }

    /// Errors against time, against work, and of each line against its own limit.
    #[must_use]
    pub fn plates(&self) -> Vec<Plate> {
        let found = &self.accuracy.found;
        vec![
            Plate::new("work-precision", figures::against_time(found)),
            Plate::new("error-work", figures::against_work(found)),
            Plate::new("own-errors", figures::own_errors(found)),
        ]
    }

    fn page(&self) -> Page {
        let found = &self.accuracy.found;
        let answered = LEVELS.iter().filter(|level| found.cheapest_within(**level, |_| true).is_some()).count();
        let tone = if answered >= 2 { Tone::Good } else { Tone::Careful };
        let verdict = format!("{answered} of {} levels are reached", LEVELS.len());
        let mut blocks = vec![
            Block::Headline { tone, verdict, text: format!(" {}", sentence(found)) },
            Block::Paragraph(format!(
                "Scene `{}`; compared is this: {}; over {}, in which a waveform can be compared at all; errors are rms of the difference over rms \
                 of the reference. The chaos floor is the change by gaps jittered by 0.3 nm and a drive jittered by 10⁻⁴, rms over {} copies: \
                 what lies below it buys nothing in the laboratory.",
                found.scene,
                found.watched,
                window(found),
                found.chaos.replicates
            )),
            Block::Paragraph(self.clock_said()),
        ];
        let mut plates = self.plates();
        let own = plates.split_off(2);
        blocks.extend([
            Block::Plates(plates),
            Block::Table(tables::settings(&self.accuracy)),
            Block::Heading("Own errors and their orders".into()),
            Block::Plates(own),
            Block::Table(tables::orders(found)),
            Block::List(orders_explained(found)),
        ]);
        blocks.extend([
            Block::Heading("Beyond the window".into()),
            Block::Table(tables::features(found)),
            Block::Heading("References".into()),
            Block::Table(tables::references(found)),
        ]);
        let facts = vec![
            ("version".into(), self.program.clone()),
            ("references made by".into(), found.program.clone()),
            ("processor".into(), found.processor.clone()),
            ("seed of the jitters".into(), found.chaos.seed.to_string()),
        ];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: format!("What accuracy costs, scene {}", found.scene),
            subtitle: "Every setting of the ladder: its error, its time, its work".into(),
            blocks,
        }
    }

    fn clock_said(&self) -> String {
        let clock = if is_processor_time() { "processor time of one thread" } else { "time that passes" };
        let stored = self.accuracy.fresh.iter().filter(|fresh| !**fresh).count();
        let old = if stored == 0 {
            String::new()
        } else if stored == self.accuracy.fresh.len() {
            " Nothing was run now: all of it is stored, with the seconds of the machine that measured it.".to_owned()
        } else {
            format!(
                " {stored} settings that take longest were not run now: their rows are stored, with the seconds of the machine that \
                 measured them."
            )
        };
        format!(
            "Seconds are {clock}, on {}; each setting is repeated two to nine times, bodies made again each time.{old}",
            self.accuracy.found.processor
        )
    }
}

/// Why an order is not what theory says, where it is not.
fn orders_explained(found: &Stored) -> Vec<String> {
    // Without dashpots the reduced model's order in the step is two.
    let reduced = found.own.iter().find(|own| own.fidelity == FidelityLevel::Reduced && own.varied == Varied::Step);
    let is_damped = reduced.and_then(|own| own.order).is_some_and(|order| order < 1.85);
    let explained = found.own.iter().filter_map(|own| {
        let order = own.order.map_or("none".to_owned(), |order| significant(order, 2));
        let off = own.order.is_none_or(|order| (order - 2.0).abs() > 0.15);
        let jumps = "a contact opens and closes inside a step, and a dashpot’s force jumps there: the error of that step is of first order, of \
                     either sign.";
        let reason = match (own.varied, own.fidelity) {
            (Varied::Tolerance, _) => {
                "the error of a step is held below the tolerance, so that the error of a run falls about as the tolerance itself, by stairs where a \
                 tolerance is met with room to spare."
            }
            (Varied::Step, FidelityLevel::Fea | FidelityLevel::FeaDamped) if off && !is_damped => {
                "at 0.1 µs the lowest mode of a bead, 2.65 MHz, turns by 1.7 rad a step, which is not small; with shorter steps the order rises to 2."
            }
            (Varied::Step, _) if off => jumps,
            (Varied::Density, FidelityLevel::FiniteBody) => {
                "two constants of a law are fitted over many approaches; what the mesh leaves in them is a tenth of a per cent and of either sign."
            }
            (Varied::Density, _) if off && own.key != "contact-force" => {
                "at every instant the edge of a contact lies otherwise between two points, and the chain magnifies what comes of it; the static force, \
                 averaged over approaches, shows the order of the elements."
            }
            _ => return None,
        };
        Some(format!("{}, {}: {order}; {reason}", line_name(own), own.varied.name()))
    });
    explained.collect()
}

/// JSON without what differs from machine to machine.
fn without_times(mut json: Value) -> Value {
    if let Some(settings) = json["settings"].as_array_mut() {
        for setting in settings {
            if let Some(setting) = setting.as_object_mut() {
                setting.remove("cost");
            }
        }
    }
    if let Some(all) = json.as_object_mut() {
        all.remove("front");
        all.remove("cheapest");
    }
    json
}

/// A value of what is varied, with its unit.
fn value_said(varied: Varied, value: f64) -> String {
    match varied {
        Varied::Tolerance => short(value),
        Varied::Step => engineering(value, "s", 3),
        Varied::WaterMesh => engineering(value, "m", 2),
        Varied::Density | Varied::Modes => format!("{value}"),
    }
}
