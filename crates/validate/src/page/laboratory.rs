//! Records of many laboratories with known truth: what the intervals hold, what is falsely accused, what is found wrong.

use serde::{Deserialize, Serialize};

use crate::laboratory::{LaboratoryCount, LaboratoryRecord, ParameterCount, Tally, WrongTally};
use granchain_calibration::design::wilson;
use granchain_report::{
    number::{fixed, significant},
    page::{Block, Column, Files, Page, ReportError, Table, Tone, csv_bytes, provenance},
};

/// A count is called compatible with the claim within 99 %.
const CLAIM_Z: f64 = 2.576;

const LEVEL: f64 = 0.9;

/// What was made, and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryReport {
    /// What was done, in one sentence.
    pub description: String,
    /// Name and words of every condition.
    pub conditions: Vec<(String, String)>,
    /// Summary over all synthetic records.
    pub count: LaboratoryCount,
    #[serde(rename = "twins")]
    pub synthetics: Vec<LaboratoryRecord>,
    pub version: String,
    pub seed: u64,
    pub command_line: String,
}

impl LaboratoryReport {
    /// `report.html`, `report.md` and `laboratory.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there are no synthetic records.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.synthetics.is_empty() {
            return Err(ReportError::Missing { field: "twins" });
        }
        let mut files = self.page().files()?;
        files.push(("laboratory.csv".into(), csv(&self.synthetics)?));
        Ok(files)
    }

    fn page(&self) -> Page {
        let mut blocks: Vec<Block> = self.count.all.iter().map(headline).collect();
        blocks.push(Block::Paragraph(self.description.clone()));
        blocks.extend(tables(&self.count).into_iter().map(Block::Table));
        blocks.push(Block::Heading("Conditions".into()));
        blocks.push(Block::Facts(self.conditions.clone()));
        let facts = vec![("version".into(), self.version.clone()), ("seed".into(), self.seed.to_string())];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: format!("{} records of other laboratories", self.synthetics.len()),
            subtitle: "Files written with known truth by a path that no fit shares, read and fitted as any record"
                .into(),
            blocks,
        }
    }
}

fn headline(all: &Tally) -> Block {
    let bounds = |parameter: &ParameterCount| wilson(parameter.held, parameter.count, CLAIM_Z);
    let (tone, verdict) = if all.parameters.iter().any(|parameter| bounds(parameter).1 < LEVEL) {
        (Tone::Bad, "intervals too narrow")
    } else if all.parameters.iter().any(|parameter| bounds(parameter).0 > LEVEL) {
        (Tone::Careful, "intervals wider than claimed")
    } else {
        (Tone::Good, "intervals as claimed")
    };
    let held: Vec<String> =
        all.parameters.iter().map(|it| format!("{}: {} of {}", it.name, it.held, it.count)).collect();
    let text = format!(
        "Of {} right records the 90 % intervals hold {}, whatever the verdict; {} were called outside scatter. Compatible means within 99 % of a \
         binomial count.",
        all.synthetics,
        held.join(", "),
        all.outside
    );
    Block::Headline { tone, verdict: verdict.into(), text }
}

/// The tables: right records by condition, by law, support and regime, wrong ones.
#[must_use]
pub fn tables(count: &LaboratoryCount) -> Vec<Table> {
    let mut tables = Vec::new();
    let all = || count.all.iter();
    if !count.conditions.is_empty() {
        tables.push(right(
            "Right records by condition: intervals that hold the truth whatever the verdict (of those given out), medians in ln, \
             verdicts, p",
            count.conditions.iter().chain(all().filter(|_| count.conditions.len() > 1)),
        ));
        tables.push(right(
            "The same by damping law, support and late motion of the truth",
            count.laws.iter().chain(&count.supports).chain(&count.regimes),
        ));
    }
    if !count.wrong.is_empty() {
        tables.push(wrong(&count.wrong));
    }
    tables
}

fn right<'a>(caption: &str, tallies: impl Iterator<Item = &'a Tally>) -> Table {
    let mut columns = vec![Column::words("Records"), Column::numbers("n")];
    let mut rows = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for tally in tallies {
        let of = &tally.parameters;
        if names.len() < of.len() {
            names = of.iter().map(|parameter| parameter.name.clone()).collect();
        }
        let mut row = vec![tally.group.clone(), tally.synthetics.to_string()];
        let cell = |value: &dyn Fn(&ParameterCount) -> String| of.iter().map(value).collect::<Vec<_>>().join(" / ");
        row.push(cell(&|it| format!("{} ({} of {})", it.held, it.quoted_held, it.quoted)));
        row.push(
            of.first().map_or_else(|| "–".into(), |it| format!("±{}", fixed(it.binomial_error * it.count as f64, 1))),
        );
        let typical = |value: f64| if value.is_finite() { significant(value, 2) } else { "–".into() };
        row.push(cell(&|it| typical(it.median_width)));
        row.push(cell(&|it| typical(it.median_error)));
        row.push(cell(&|it| typical(it.median_bias)));
        let ended = [tally.within, tally.doubtful, tally.outside, tally.not_converged, tally.refused];
        row.extend(ended.map(|count| count.to_string()));
        let fits = tally.synthetics - tally.refused;
        let [one, five] = tally.p_errors.map(|error| fixed(error * fits as f64, 1));
        let expected = [0.01, 0.05].map(|p| fixed(p * fits as f64, 1));
        row.push(format!("{} ({} ± {one})", tally.below_one_percent, expected[0]));
        row.push(format!("{} ({} ± {five})", tally.below_five_percent, expected[1]));
        rows.push(row);
    }
    let names = names.join(" / ");
    columns.extend([
        Column::words(format!("Held, {names}")),
        Column::words("binomial error at 90 %"),
        Column::words("Median width"),
        Column::words("Median error"),
        Column::words("Median bias"),
        Column::numbers("within"),
        Column::numbers("doubtful"),
        Column::numbers("outside"),
        Column::numbers("not converged"),
        Column::numbers("refused"),
        Column::words("p < 0.01 (expected)"),
        Column::words("p < 0.05 (expected)"),
    ]);
    Table { caption: caption.into(), columns, rows }
}

fn wrong(tallies: &[WrongTally]) -> Table {
    let row = |tally: &WrongTally| {
        let numbers = [tally.synthetics, tally.unmasked, tally.named, tally.warned, tally.refused];
        std::iter::once(tally.group.clone()).chain(numbers.map(|count| count.to_string())).collect()
    };
    Table {
        caption: "Wrong records and wrong benches: not within scatter; cause among the three of the diagnosis, or in the refusal; \
                  named by a warning beside the verdict"
            .into(),
        columns: vec![
            Column::words("Records"),
            Column::numbers("n"),
            Column::numbers("not within scatter"),
            Column::numbers("cause named"),
            Column::numbers("warned of"),
            Column::numbers("refused"),
        ],
        rows: tallies.iter().map(row).collect(),
    }
}

fn csv(synthetics: &[LaboratoryRecord]) -> Result<Vec<u8>, ReportError> {
    let heads = "condition,number,support,damping_kind,regime,beads,sample_rate_hz,verdict,p_value,alpha,alpha_low,alpha_median,alpha_high,damping_si,\
                 damping_low_si,damping_median_si,damping_high_si,quoted,not_within,named,warned,refusal";
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(heads.split(','))?;
    for synthetic in synthetics {
        let setting = &synthetic.setting;
        let mut cells = vec![
            setting.condition.name().to_owned(),
            setting.number.to_string(),
            setting.support.clone(),
            setting.damping_kind.clone(),
            synthetic.regime.map_or("", crate::laboratory::Regime::name).to_owned(),
            (setting.gaps.len() - 1).to_string(),
            setting.laboratory.sample_rate_hz.to_string(),
        ];
        let fit = synthetic.fit.as_ref().ok();
        cells.push(fit.map_or_else(|| "refused".into(), |fit| fit.verdict.to_string()));
        cells.push(fit.map_or_else(String::new, |fit| fit.p_value.to_string()));
        for (d, truth) in setting.values.iter().enumerate() {
            let estimate = fit.and_then(|fit| fit.estimates.get(d));
            let [low, median, high] = estimate
                .map_or([const { String::new() }; 3], |it| [it.low, it.median, it.high].map(|value| value.to_string()));
            cells.extend([truth.to_string(), low, median, high]);
        }
        cells.push(fit.map_or_else(String::new, |fit| fit.quoted.to_string()));
        cells.extend([synthetic.unmasked(), synthetic.named(), synthetic.warned()].map(|is| is.to_string()));
        cells.push(synthetic.fit.as_ref().err().cloned().unwrap_or_default());
        table.write_record(&cells)?;
    }
    csv_bytes(table)
}
