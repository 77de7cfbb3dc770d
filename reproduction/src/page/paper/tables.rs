//! Tables of the study of the paper, for the page and as CSV.

use std::fmt::Write as _;

use crate::paper::{
    Judgement, LAWS, PaperOutcome, ReadingOutcome, Verdict, chose_the_readings,
    statements::{Claim, Subject},
};
use crate::portrait::{LINES, PRESENT_LEVEL, PRESENT_PROMINENCE, Trait};
use granchain_calibration::predict::Spread;
use granchain_report::{
    number::{fixed, significant},
    page::{Column, Table},
};

use super::millimetres;

/// What a statement is about, kept on one line.
pub(super) fn subject(subject: Subject) -> &'static str {
    match subject {
        Subject::Measurement => "measured",
        Subject::Linear => "FEA,\u{a0}linear",
        Subject::KuwabaraKono => "FEA,\u{a0}K.–Kono",
        Subject::Rigid => "FEA,\u{a0}rigid",
        Subject::Water => "FEA,\u{a0}water",
        Subject::Companion => "companion",
    }
}

pub(super) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Agrees => "agrees",
        Verdict::Differs => "differs",
        Verdict::NotTested => "not\u{a0}tested",
    }
}

/// Its verdict, marked where the agreeing number chose the default readings.
fn verdict_of(judgement: &Judgement) -> String {
    let chosen = judgement.verdict == Verdict::Agrees && chose_the_readings(&judgement.statement);
    format!("{}{}", verdict(judgement.verdict), if chosen { " (chosen)" } else { "" })
}

/// Every printed statement beside ours.
pub(super) fn statements(judgements: &[Judgement]) -> Table {
    let rows = judgements.iter().map(|judgement| {
        let statement = &judgement.statement;
        let cells = |spread: &Spread| {
            let sensitivity =
                format!("{} ± {}", millimetres(spread.sensitivity), fixed(1e3 * spread.sensitivity_error, 1));
            (millimetres(spread.mean), fixed(1e3 * spread.scatter, 1), sensitivity)
        };
        let (ours, scatter, sensitivity) = match &judgement.ours {
            Some(spread) => cells(spread),
            None => ("–".into(), "–".into(), "–".into()),
        };
        let peak = matches!(statement.claim, Claim::PositivePeak(_) | Claim::NegativePeak(_));
        let found = if peak || judgement.verdict != Verdict::NotTested {
            judgement.found.clone()
        } else {
            format!("({})", judgement.found)
        };
        vec![
            subject(statement.subject).to_owned(),
            statement.said.to_owned(),
            ours,
            scatter,
            sensitivity,
            found,
            verdict_of(judgement),
        ]
    });
    Table {
        caption: format!(
            "Every number and every spectral statement the paper prints of its scenes, beside ours. Mean and scatter (standard deviation \
                  of a single run) over perturbed runs; the change for +1 % of drive with its standard error. A printed velocity agrees where it \
                  lies within two scatters plus that change plus half a printed digit of our mean. The measurement is held against the linear \
                  law at α = 0.5, as in the paper. Lines are present from {PRESENT_LEVEL} of the drive line and {PRESENT_PROMINENCE:.0} times the floor on."
        ),
        columns: vec![
            Column::words("Of"),
            Column::words("Printed"),
            Column::numbers("Ours").unit("mm/s"),
            Column::numbers("Scatter").unit("mm/s"),
            Column::numbers("Per +1 % drive").unit("mm/s"),
            Column::words("Found"),
            Column::words("Verdict"),
        ],
        rows: rows.collect(),
    }
}

/// Lines of both laws: level and prominence.
pub(super) fn lines(outcome: &PaperOutcome) -> Table {
    let rows = LINES.iter().map(|line| {
        let mut row = vec![line.to_string()];
        for law in &outcome.laws {
            let level = law.spread(Trait::Level(*line));
            let prominence = law.moments.get(Trait::Prominence(*line));
            row.push(level.map_or("–".into(), |level| fixed(level.mean, 3)));
            row.push(level.map_or("–".into(), |level| fixed(level.scatter, 3)));
            row.push(prominence.map_or("–".into(), |prominence| significant(prominence.mean, 2)));
            row.push(if law.moments.has_line(*line) { "present" } else { "–" }.into());
        }
        row
    });
    let mut columns = vec![Column::words("f/f0")];
    for law in &outcome.laws {
        columns.push(Column::numbers(format!("{}: A/A(f0)", law.law.name)));
        columns.push(Column::numbers("scatter"));
        columns.push(Column::numbers("over the floor"));
        columns.push(Column::words("verdict"));
    }
    Table {
        caption: format!(
            "Lines of the pole’s velocity at the paper’s α, means over perturbed runs. A line counts as present from {PRESENT_LEVEL} of the \
             drive line (−30 dB) and {PRESENT_PROMINENCE:.0} times the floor around it on; the paper prints no amplitudes."
        ),
        columns,
        rows: rows.collect(),
    }
}

/// Readings of both laws by rank.
pub(super) fn readings(outcome: &PaperOutcome) -> Vec<Table> {
    LAWS.iter()
        .zip(&outcome.readings)
        .map(|(law, readings)| {
            let rows = readings.iter().enumerate().map(|(index, reading)| {
                let mut row = vec![(index + 1).to_string(), reading_name(reading)];
                match &reading.changes {
                    Some(changes) => {
                        for (place, change) in changes.iter().enumerate() {
                            let (value, scatter) = if place < 2 {
                                (millimetres(change.mean), fixed(1e3 * change.scatter, 0))
                            } else {
                                (fixed(change.mean, 2), fixed(change.scatter, 2))
                            };
                            row.push(format!("{value} ± {scatter}"));
                        }
                        row.push(significant(100.0 * reading.shift, 2));
                        row.push(significant(reading.significance, 2));
                    }
                    None => row.extend(std::iter::repeat_n("–".to_owned(), 5)),
                }
                row.push(reading.largest_at.map_or("–".into(), |alpha| alpha.to_string()));
                row
            });
            Table {
                caption: format!(
                    "{} dampers at α = {}: the readings by rank. Shift: rms of the relative changes of both peaks and of the change of \
                     A({}·f0)/A(f0). Significance: rms of the same changes over the scatter of both sides; below 2 it cannot be distinguished from none. \
                     Last column: α of a sweep at which this ratio is largest.",
                    capitalised(law.name),
                    law.alpha,
                    law.own_line
                ),
                columns: vec![
                    Column::numbers("Rank"),
                    Column::words("Reading"),
                    Column::numbers("Positive peak").unit("mm/s"),
                    Column::numbers("Negative peak").unit("mm/s"),
                    Column::numbers(format!("A({}·f0)/A(f0)", law.own_line)),
                    Column::numbers("Shift").unit("%"),
                    Column::numbers("Significance"),
                    Column::numbers(format!("A({}·f0) largest at α", law.own_line)),
                ],
                rows: rows.collect(),
            }
        })
        .collect()
}

/// Name of a reading; those that only the chain runs say so.
pub(super) fn reading_name(reading: &ReadingOutcome) -> String {
    let name = reading.reading.name;
    if reading.reading.chain_only { format!("{name} (chain)") } else { name.to_owned() }
}

/// Models before the rigid wall.
pub(super) fn rigid(outcome: &PaperOutcome) -> Table {
    let finest = outcome.rigid.runs.first().map_or("", |run| run.model);
    let rows = outcome.rigid.runs.iter().map(|run| {
        let mut row =
            vec![run.model.to_owned(), millimetres(run.positive_peak_m_per_s), millimetres(run.negative_peak_m_per_s)];
        row.extend(
            run.differences.iter().map(|difference| {
                if run.model == finest { "–".to_owned() } else { significant(100.0 * difference, 2) }
            }),
        );
        row
    });
    let mut columns = vec![
        Column::words("Model"),
        Column::numbers("Positive peak").unit("mm/s"),
        Column::numbers("Negative peak").unit("mm/s"),
    ];
    columns.extend(
        outcome
            .rigid
            .windows_s
            .iter()
            .map(|(from, to)| Column::numbers(format!("{:.0}–{:.0} µs", 1e6 * from, 1e6 * to)).unit("%")),
    );
    Table {
        caption: format!(
            "Last bead before the rigid wall, first 70 µs, through a moving average of 0.4 µs: peaks, and rms difference from model {finest} \
             over its rms in three windows."
        ),
        columns,
        rows: rows.collect(),
    }
}

pub(super) fn capitalised(text: &str) -> String {
    granchain_report::sweep::capitalised(text)
}

/// Without what would need quoting.
fn plain(text: &str) -> String {
    text.replace(['"', '\n', '\u{a0}'], " ")
}

pub(super) fn statements_csv(judgements: &[Judgement]) -> String {
    let mut text = String::from(
        "key,place,printed,mean_m_per_s,scatter_m_per_s,sensitivity_m_per_s,allowance_m_per_s,verdict,found\n",
    );
    for judgement in judgements {
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:e}"));
        let ours = judgement.ours.as_ref();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},\"{}\",\"{}\",{},{},{},{},{},\"{}\"",
            judgement.statement.key,
            plain(judgement.statement.place),
            plain(judgement.statement.said),
            number(ours.map(|spread| spread.mean)),
            number(ours.map(|spread| spread.scatter)),
            number(ours.map(|spread| spread.sensitivity)),
            number(judgement.allowance),
            plain(verdict(judgement.verdict)),
            plain(&judgement.found)
        );
    }
    text
}

pub(super) fn sweep_csv(outcome: &PaperOutcome) -> String {
    let traits = Trait::all();
    let mut text = String::from("law,alpha");
    for what in &traits {
        let _ = write!(text, ",{0},scatter_{0}", what.key());
    }
    text.push('\n');
    for (law, sweep) in LAWS.iter().zip(&outcome.sweeps) {
        for point in sweep {
            let _ = write!(text, "{},{}", law.kind, point.alpha);
            for what in &traits {
                match point.moments.get(*what) {
                    Some(moments) => {
                        let _ = write!(text, ",{:e},{:e}", moments.mean, moments.deviation);
                    }
                    None => text.push_str(",,"),
                }
            }
            text.push('\n');
        }
    }
    text
}

pub(super) fn readings_csv(outcome: &PaperOutcome) -> String {
    let mut text = String::from(
        "law,rank,reading,overrides,shift,significance,positive_peak_m_per_s,negative_peak_m_per_s,own_line_ratio,change_positive,change_negative,change_ratio,own_line_largest_at_alpha\n",
    );
    for (law, readings) in LAWS.iter().zip(&outcome.readings) {
        for (index, reading) in readings.iter().enumerate() {
            let _ = write!(
                text,
                "{},{},\"{}\",{},",
                law.kind,
                index + 1,
                reading.reading.name,
                reading.reading.overrides.join(" ")
            );
            match &reading.changes {
                Some(changes) => {
                    let _ = write!(text, "{:e},{:e}", reading.shift, reading.significance);
                    changes.iter().for_each(|change| {
                        let _ = write!(text, ",{:e}", change.mean);
                    });
                    changes.iter().for_each(|change| {
                        let _ = write!(text, ",{:e}", change.change);
                    });
                }
                None => text.push_str(",,,,,,,"),
            }
            text.push(',');
            let _ = reading.largest_at.map(|alpha| write!(text, "{alpha}"));
            text.push('\n');
        }
    }
    text
}
