//! The page of the study of dissipation: which dampers with which effects bring the printed peaks, and what thirds they have there.

use serde_json::json;

use crate::dissipation::{
    BASES, Candidate, CandidateOutcome, DissipationOutcome, Effect, Found, NOTHING, PRINTED_ALPHA, WATCHED, WEAK,
};
use granchain_calibration::predict::Spread;
use granchain_report::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{engineering, fixed, short, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, csv_bytes, provenance},
    sweep::capitalised,
};

/// The study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct DissipationReport {
    pub program: String,
    pub outcome: DissipationOutcome,
    pub command_line: String,
}

/// Candidates that a sentence names.
const NAMED: usize = 4;
/// Colours of the dampers of [`BASES`].
const COLOURS: [Colour; 3] = [Colour::Vermillion, Colour::Blue, Colour::Black];
/// Markers of none, one and two effects.
const MARKERS: [Marker; 3] = [Marker::Disc, Marker::Square, Marker::Diamond];

impl DissipationReport {
    /// `report.html`, `report.md`, the figures, `dissipation.json`, `dissipation.csv` and `points.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no candidate, or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.outcome.ranked().next().is_none() {
            return Err(ReportError::Missing { field: "candidates" });
        }
        let mut files = self.page().files()?;
        let mut json = serde_json::to_vec_pretty(&json!({"program": self.program, "outcome": self.outcome}))?;
        json.push(b'\n');
        files.push(("dissipation.json".into(), json));
        files.push(("dissipation.csv".into(), candidates_csv(&self.outcome)?));
        files.push(("points.csv".into(), points_csv(&self.outcome)?));
        Ok(files)
    }

    fn page(&self) -> Page {
        let outcome = &self.outcome;
        let mut blocks = vec![
            headline(outcome),
            Block::Paragraph(introduction(outcome)),
            Block::List(findings(outcome)),
            Block::Plates(
                [("candidates", scatter(outcome)), ("thirds", thirds(outcome))].into_iter().filter_map(plate).collect(),
            ),
            Block::Table(ranking(outcome)),
        ];
        let refused = refused(outcome);
        if !refused.rows.is_empty() {
            blocks.push(Block::Table(refused));
        }
        blocks.push(Block::Table(effects(&outcome.plan.effects)));
        blocks.push(Block::Heading("What carries this, and what does not".into()));
        blocks.push(Block::List(unknown(outcome)));
        let facts = vec![
            ("version".into(), self.program.clone()),
            ("model".into(), outcome.model.into()),
            ("seed".into(), outcome.plan.seed.to_string()),
        ];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: "Which dissipation".into(),
            subtitle: "Dampers, with none, one or two effects beside them, against the two printed peaks and the thirds of the measurement".into(),
            blocks,
        }
    }
}

/// Those within a difference of ln evidence of the best.
fn within(outcome: &DissipationOutcome, difference: f64) -> Vec<(&Candidate, &Found, f64)> {
    outcome.ranked().filter(|(_, _, behind)| -behind < difference).collect()
}

/// Both peaks agree and both thirds stand out more than with linear dampers.
fn brings_all(outcome: &DissipationOutcome, found: &Found) -> bool {
    found.agrees(outcome.plan.printed) && outcome.is_pronounced(found)
}

fn headline(outcome: &DissipationOutcome) -> Block {
    let ran = outcome.ranked().count();
    let all = outcome.ranked().filter(|(_, found, _)| brings_all(outcome, found)).count();
    let agreeing = outcome.ranked().filter(|(_, found, _)| found.agrees(outcome.plan.printed)).count();
    let (tone, verdict) = match all {
        0 => (
            Tone::Bad,
            format!("None of {ran} candidates brings both printed peaks and thirds stronger than linear dampers have."),
        ),
        _ => (
            Tone::Careful,
            format!(
                "{all} of {ran} candidates {} both printed peaks and thirds stronger than linear dampers have.",
                if all == 1 { "brings" } else { "bring" }
            ),
        ),
    };
    let weak = within(outcome, WEAK).len();
    let undecided = if weak > 1 {
        format!(
            "{weak} candidates lie within {WEAK} of ln evidence of the best: two printed numbers do not tell them apart."
        )
    } else {
        format!(
            "The best one is ahead of all others by more than {WEAK} of ln evidence, under ranges and a drive that are ours."
        )
    };
    Block::Headline { tone, verdict, text: format!(" {agreeing} bring both peaks. {undecided}") }
}

fn introduction(outcome: &DissipationOutcome) -> String {
    let plan = &outcome.plan;
    let (first, last) = (plan.alphas[0], plan.alphas[plan.alphas.len() - 1]);
    format!(
        "The annulus scene on model `{}` with the paper’s linear dampers (c = 0.3 N·s/m), its Kuwabara–Kono dampers (γ = 3660 N·s·m⁻³ᐟ²) and none; each \
         alone, with each effect at {} strengths and with each pair of effects at {} × {}, over {} amplitude scales α from {} to {}; {} perturbed runs at each \
         point. The evidence is that of the two printed peaks, {} and {} mm/s, over the whole range of α and of every strength, flat in their logarithms: a \
         candidate that must be tuned pays for it. Where the peaks are likeliest each is run {} times again, at that drive and 1 % above and below.",
        outcome.model,
        plan.alone,
        plan.paired,
        plan.paired,
        plan.alphas.len(),
        short(first),
        short(last),
        plan.replicates,
        signed(1e3 * plan.printed.positive_m_per_s),
        signed(1e3 * plan.printed.negative_m_per_s),
        plan.confirming,
    )
}

fn findings(outcome: &DissipationOutcome) -> Vec<String> {
    let mut said = Vec::new();
    let (alike, weakly) = (within(outcome, NOTHING), within(outcome, WEAK));
    said.push(format!(
        "Most evidence: {}. {} within {NOTHING} of it, a difference that means nothing, and {} within {WEAK}, which is weak.",
        named(alike.iter().map(|own| own.0.name())),
        candidates_in_words(alike.len()),
        weakly.len()
    ));
    for base in &BASES {
        if let Some((rank, (candidate, found, behind))) =
            place(outcome, |own| own.base == *base && own.effects.is_empty())
        {
            said.push(format!(
                "{} alone: rank {rank}, Δ ln evidence {}; likeliest at α = {} with {} and {} mm/s.",
                capitalised(&candidate.name()),
                fixed(behind, 1),
                significant(found.alpha, 2),
                millimetres(found.there[0]),
                millimetres(found.there[1])
            ));
        }
    }
    for effect in &outcome.plan.effects {
        let best = place(outcome, |own| own.effects.len() == 1 && own.effects[0] == *effect);
        if let Some((rank, (candidate, found, behind))) = best {
            let gain = place(outcome, |own| own.base == candidate.base && own.effects.is_empty());
            let gain = gain.map_or_else(String::new, |(_, (_, _, bare))| {
                format!(", {} of the dampers alone", gained(behind - bare))
            });
            said.push(format!(
                "{}, at its best with {} dampers: rank {rank}, Δ ln evidence {}{gain}; {}, α = {}.",
                capitalised(effect.name),
                candidate.base.name,
                fixed(behind, 1),
                strengths(candidate, found),
                significant(found.alpha, 2)
            ));
        }
    }
    let single = place(outcome, |own| own.effects.len() < 2);
    let pair = place(outcome, |own| own.effects.len() == 2);
    if let (Some((_, (one, _, single))), Some((_, (two, _, pair)))) = (single, pair) {
        let gain = pair - single;
        let verdict = if gain >= WEAK {
            "a second effect is asked for"
        } else if gain >= NOTHING {
            "a second effect is asked for, weakly"
        } else {
            "a second effect is not asked for"
        };
        said.push(format!(
            "The best pair ({}) against the best of fewer effects ({}): ln evidence {}; {verdict}.",
            two.name(),
            one.name(),
            signed_to(gain, 1)
        ));
    }
    let all: Vec<String> = outcome
        .ranked()
        .filter(|(_, found, _)| brings_all(outcome, found))
        .map(|(candidate, _, behind)| format!("{} ({})", candidate.name(), fixed(behind, 1)))
        .collect();
    if !all.is_empty() {
        said.push(format!("Both peaks and stronger thirds (Δ ln evidence): {}.", named(all.into_iter())));
    }
    said.push(largest_at(outcome));
    let mut errors: Vec<f64> = outcome.ranked().filter_map(|(_, found, _)| found.log_evidence_error).collect();
    errors.sort_by(f64::total_cmp);
    if let Some(median) = errors.get(errors.len() / 2) {
        said.push(format!(
            "The few runs a point leave a standard error of {} in ln evidence (median over the candidates; jackknife).",
            significant(*median, 2)
        ));
    }
    let (runs, failed) =
        outcome.ranked().fold((0, 0), |sum, (_, found, _)| (sum.0 + found.runs.0, sum.1 + found.runs.1));
    if failed > 0 {
        let first = outcome.ranked().find_map(|(_, found, _)| found.failure.as_deref()).unwrap_or_default();
        said.push(format!("{failed} of {runs} runs failed, the first because: {first}."));
    }
    said
}

fn largest_at(outcome: &DissipationOutcome) -> String {
    let alphas = &outcome.plan.alphas;
    let step = alphas.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let near = |found: &Found| found.largest_third_at.is_some_and(|alpha| (alpha - PRINTED_ALPHA).abs() <= step * 1.01);
    let ran = outcome.ranked().count();
    let there = outcome.ranked().filter(|(_, found, _)| near(found)).count();
    let exactly = outcome.ranked().filter(|(_, found, _)| found.largest_third_at == Some(PRINTED_ALPHA)).count();
    let own = place(outcome, |own| own.base == BASES[0] && own.effects.is_empty())
        .and_then(|(_, (_, found, _))| found.largest_third_at);
    format!(
        "A(f0/3)/A(f0) is printed to be largest over α at {PRINTED_ALPHA} with linear dampers; ours with linear dampers alone is largest at {}. At its likeliest \
         strength {exactly} of {ran} candidates have it largest at {PRINTED_ALPHA}, {there} there or one step of {} beside.",
        own.map_or_else(|| "no α".into(), short),
        short(step)
    )
}

fn unknown(outcome: &DissipationOutcome) -> Vec<String> {
    let chosen: Vec<String> = outcome
        .plan
        .effects
        .iter()
        .filter(|effect| !effect.beside.is_empty())
        .map(|effect| format!("{} for {}", effect.beside.join(", "), effect.name))
        .collect();
    vec![
        "Two printed numbers carry the ranking, with two to four quantities free: that a candidate can meet them says little, and how little of its range meets them is all \
         that the evidence weighs."
            .into(),
        "The drive is invented: no record of the horn is published, and the ring-up, the length of the burst and the noise are those of our reconstruction. The peaks \
         move by ±10 % with the ring-up alone, which may change the order of the table."
            .into(),
        format!(
            "A difference of ln evidence below {NOTHING} is nothing, below {WEAK} weak. The ranges of strengths are ours: ten times the range, where it does not help, \
             costs ln 10 = 2.3."
        ),
        "That thirds are more pronounced in the measurement is printed without a number: it is no part of the evidence and stands beside it, against linear dampers at α = \
         0.5 in our own model."
            .into(),
        "Between the points of a grid means and variances are multilinear, and by how much a mean misses the line between its neighbours along α is part of its variance. Where a candidate is likeliest it is run for real; a row whose peaks differ there was likely between \
         the points only."
            .into(),
        format!("Chosen and not varied: {}.", if chosen.is_empty() { "nothing".into() } else { chosen.join("; ") }),
    ]
}

/// A plate, where there is anything to draw: a burst too short to resolve the thirds has none.
fn plate((name, (figure, drawn)): (&str, (Figure, bool))) -> Option<Plate> {
    drawn.then(|| Plate::new(name, figure))
}

/// Third-line ratio against the distance from the printed peaks, and whether there is any.
fn scatter(outcome: &DissipationOutcome) -> (Figure, bool) {
    let known = |found: &Found| {
        found.distance(outcome.plan.printed).is_some() && found.thirds_over(&outcome.reference)[0].is_some()
    };
    let drawn = outcome.ranked().any(|(_, found, _)| known(found));
    let x = Axis::new("Distance from the printed peaks", "mm/s").times(1e3).logarithmic();
    let y = Axis::new("A(f0/3)/A(f0) over that of linear dampers at α = 0.5", "1");
    let panel = Panel::new(x, y).height(70.0).mark_y(1.0, "", Stroke::new(Colour::Grey).dash(Dash::Dotted));
    let groups = BASES.iter().zip(COLOURS).flat_map(|(base, colour)| {
        MARKERS.iter().enumerate().map(move |(count, marker)| (*base, count, colour, *marker))
    });
    let panel = groups.fold(panel, |panel, (base, count, colour, marker)| {
        let points: Vec<(f64, f64)> = outcome
            .ranked()
            .filter(|(candidate, _, _)| candidate.base == base && candidate.effects.len() == count)
            // Below a tenth of a millimetre a second nothing is known.
            .filter_map(|(_, found, _)| {
                Some((found.distance(outcome.plan.printed)?.max(1e-4), found.thirds_over(&outcome.reference)[0]?))
            })
            .collect();
        let label = if count == 1 { format!("{} dampers", base.name) } else { String::new() };
        panel.points(label, points, colour, marker)
    });
    let figure = Figure::new(
        "Each candidate where its peaks are likeliest, as it was run there: how far the two peaks lie from the printed ones (root of squares), and how much stronger its line at \
         1/3 is than with linear dampers at α = 0.5. The measurement lies far left and above the dotted line. Disc: dampers alone; square: one effect; diamond: two.",
    )
    .sized(PAGE_WIDTH_MM, 1)
    .panel(panel);
    (figure, drawn)
}

/// A(f0/3)/A(f0) over α: linear dampers alone and the first of the rank.
fn thirds(outcome: &DissipationOutcome) -> (Figure, bool) {
    let drawn = outcome.ranked().any(|(_, found, _)| found.largest_third_at.is_some());
    let linear = place(outcome, |own| own.base == BASES[0] && own.effects.is_empty()).map(|(_, own)| own);
    let first = outcome.ranked().filter(|own| Some(own.0) != linear.map(|own| own.0)).take(NAMED);
    let panel =
        Panel::new(Axis::new("α", "1"), Axis::new("A(f0/3)/A(f0)", "1")).height(60.0).mark_x(PRINTED_ALPHA, "printed");
    let curves = linear.into_iter().chain(first).zip(Colour::CYCLE.into_iter().zip([
        Marker::Disc,
        Marker::Square,
        Marker::Diamond,
        Marker::Disc,
        Marker::Square,
    ]));
    let panel = curves.fold(panel, |panel, ((candidate, found, _), (colour, marker))| {
        let points: Vec<(f64, f64)> =
            found.third_over_alpha.iter().filter_map(|(alpha, own)| Some((*alpha, own.as_ref()?.mean))).collect();
        panel.line("", points.clone(), Stroke::new(colour).width(0.7)).points(candidate.name(), points, colour, marker)
    });
    let figure = Figure::new(format!(
        "Mean A(f0/3)/A(f0) over α at the likeliest strengths: linear dampers alone and the first {NAMED} of the table. The paper finds its linear dampers’ largest at {PRINTED_ALPHA}."
    ))
    .sized(PAGE_WIDTH_MM, 1)
    .panel(panel);
    (figure, drawn)
}

fn ranking(outcome: &DissipationOutcome) -> Table {
    let rows = outcome.ranked().map(|(candidate, found, behind)| {
        let times =
            found.thirds_over(&outcome.reference).map(|own| own.map_or("–".into(), |own| significant(own, 2)));
        let [one, two] = times;
        vec![
            candidate.base.name.to_owned(),
            if candidate.effects.is_empty() { "–".into() } else { strengths(candidate, found) },
            fixed(behind, 1),
            found.log_evidence_error.map_or("–".into(), |error| fixed(error, 1)),
            significant(found.alpha, 2),
            peak(found.there[0]),
            peak(found.there[1]),
            if found.agrees(outcome.plan.printed) { "agree" } else { "differ" }.to_owned(),
            one,
            two,
            found.largest_third_at.map_or("–".into(), short),
        ]
    });
    Table {
        caption: format!(
            "Candidates by the evidence of the printed peaks, less that of the best: below {NOTHING} nothing, below {WEAK} weak; ± its standard error from the few runs. α and \
             strengths: where the peaks are likeliest; peaks as run there, mean ± scatter of a single run, and whether both agree as the study of the paper judges it. Thirds: \
             over those of linear dampers at α = 0.5. Last column: α of the largest A(f0/3)/A(f0) at the nearest strengths run (printed for linear dampers: {PRINTED_ALPHA})."
        ),
        columns: vec![
            Column::words("Dampers"),
            Column::words("Beside them"),
            Column::numbers("Δ ln evidence"),
            Column::numbers("±"),
            Column::numbers("α"),
            Column::words("Positive peak").unit("mm/s"),
            Column::words("Negative peak").unit("mm/s"),
            Column::words("Peaks"),
            Column::numbers("1/3 over linear’s"),
            Column::numbers("2/3 over linear’s"),
            Column::numbers("1/3 largest at α"),
        ],
        rows: rows.collect(),
    }
}

/// What could not be run, one row a reason.
fn refused(outcome: &DissipationOutcome) -> Table {
    let mut rows: Vec<(String, String, usize)> = Vec::new();
    let refused = outcome.candidates.iter().filter_map(|own| Some((&own.candidate, own.refused.as_ref()?)));
    // An effect that is refused takes its pairs with it: fewest effects first.
    let mut refused: Vec<(&Candidate, &String)> = refused.collect();
    refused.sort_by_key(|(candidate, _)| candidate.effects.len());
    for (candidate, reason) in refused {
        match rows.iter_mut().find(|row| row.1 == *reason) {
            Some(row) => row.2 += 1,
            None => rows.push((candidate.name(), reason.clone(), 1)),
        }
    }
    Table {
        caption: "What the model could not run: the first candidate, how many for the same reason (with other dampers, in pairs), and the reason.".into(),
        columns: vec![Column::words("Not run"), Column::numbers("Candidates"), Column::words("Why")],
        rows: rows.into_iter().map(|(name, reason, count)| vec![capitalised(&name), count.to_string(), reason]).collect(),
    }
}

fn effects(effects: &[Effect]) -> Table {
    let rows = effects.iter().map(|effect| {
        let [first, .., last] = effect.strengths;
        vec![
            capitalised(effect.name),
            effect.key.to_owned(),
            format!("{} to {}", quantity(effect, first), quantity(effect, last)),
            if effect.beside.is_empty() { "–".into() } else { effect.beside.join(", ") },
        ]
    });
    Table {
        caption: "The effects, the key of the strength of each, the range over which it is flat in its logarithm, and what is set beside it.".into(),
        columns: vec![Column::words("Effect"), Column::words("Key"), Column::words("Range"), Column::words("Beside it")],
        rows: rows.collect(),
    }
}

/// Rank and numbers of the first that `choose` takes.
fn place(
    outcome: &DissipationOutcome,
    choose: impl Fn(&Candidate) -> bool,
) -> Option<(usize, (&Candidate, &Found, f64))> {
    outcome.ranked().enumerate().find(|(_, own)| choose(own.0)).map(|(index, own)| (index + 1, own))
}

fn strengths(candidate: &Candidate, found: &Found) -> String {
    let own = candidate.effects.iter().zip(&found.strengths);
    own.map(|(effect, strength)| format!("{} {}", effect.name, quantity(effect, *strength)))
        .collect::<Vec<_>>()
        .join(", ")
}

fn quantity(effect: &Effect, strength: f64) -> String {
    match effect.unit {
        "1" => significant(strength, 2),
        // A prefix before gram, not before kilogram.
        "kg" => engineering(1e3 * strength, "g", 2),
        unit => engineering(strength, unit, 2),
    }
}

fn named(names: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(NAMED);
    let listed = names.into_iter().take(NAMED).collect::<Vec<_>>().join("; ");
    if more > 0 { format!("{listed}; and {more} more") } else { listed }
}

fn candidates_in_words(count: usize) -> String {
    if count == 1 { "One candidate lies".into() } else { format!("{count} candidates lie") }
}

fn gained(difference: f64) -> String {
    format!(
        "{} that",
        if difference >= 0.0 {
            format!("{} above", fixed(difference, 1))
        } else {
            format!("{} below", fixed(-difference, 1))
        }
    )
}

fn peak(found: Option<Spread>) -> String {
    found.map_or("–".into(), |own| format!("{} ± {}", fixed(1e3 * own.mean, 0), fixed(1e3 * own.scatter, 0)))
}

fn millimetres(found: Option<Spread>) -> String {
    found.map_or("–".into(), |own| signed(1e3 * own.mean))
}

fn signed(value: f64) -> String {
    signed_to(value, 0)
}

fn signed_to(value: f64, digits: usize) -> String {
    if value > 0.0 { format!("+{}", fixed(value, digits)) } else { fixed(value, digits) }
}

/// One row a candidate, in the order of the table.
fn candidates_csv(outcome: &DissipationOutcome) -> Result<Vec<u8>, ReportError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut head: Vec<String> =
        ["damping", "effect_1", "strength_1_si", "effect_2", "strength_2_si", "log_evidence_less_best"]
            .map(str::to_owned)
            .into();
    head.extend(["log_evidence_error", "alpha"].map(str::to_owned));
    for what in WATCHED {
        head.extend([what.key(), format!("scatter_{}", what.key()), format!("per_percent_drive_{}", what.key())]);
    }
    head.extend(["peaks_agree", "largest_third_at_alpha", "runs", "failed_runs", "refused"].map(str::to_owned));
    table.write_record(&head)?;
    let best = outcome.ranked().next().map_or(0.0, |(_, found, _)| found.log_evidence);
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:e}"));
    for CandidateOutcome { candidate, found, refused } in &outcome.candidates {
        let found = found.as_ref();
        let mut row = named_strengths(candidate, |index| found.map(|found| found.strengths[index]));
        row.push(number(found.map(|found| found.log_evidence - best)));
        row.push(number(found.and_then(|found| found.log_evidence_error)));
        row.push(number(found.map(|found| found.alpha)));
        for index in 0..WATCHED.len() {
            let own = found.and_then(|found| found.there[index]);
            row.extend(
                [own.map(|own| own.mean), own.map(|own| own.scatter), own.map(|own| own.sensitivity)].map(number),
            );
        }
        row.push(found.map_or_else(String::new, |found| found.agrees(outcome.plan.printed).to_string()));
        row.push(number(found.and_then(|found| found.largest_third_at)));
        let runs = found.map_or((0, 0), |found| found.runs);
        row.extend([runs.0.to_string(), runs.1.to_string(), refused.clone().unwrap_or_default()]);
        table.write_record(&row)?;
    }
    csv_bytes(table)
}

/// Every point of every grid.
fn points_csv(outcome: &DissipationOutcome) -> Result<Vec<u8>, ReportError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let mut head: Vec<String> =
        ["damping", "effect_1", "strength_1_si", "effect_2", "strength_2_si", "alpha", "failed_runs"]
            .map(str::to_owned)
            .into();
    head.extend(WATCHED.iter().flat_map(|what| [what.key(), format!("scatter_{}", what.key())]));
    table.write_record(&head)?;
    for (candidate, found, _) in outcome.ranked() {
        for point in &found.points {
            let mut row = named_strengths(candidate, |index| Some(point.strengths[index]));
            row.extend([point.alpha.to_string(), point.failed.to_string()]);
            for own in &point.moments {
                let numbers = [own.map(|own| own.mean), own.map(|own| own.deviation)];
                row.extend(numbers.map(|value| value.map_or_else(String::new, |value| format!("{value:e}"))));
            }
            table.write_record(&row)?;
        }
    }
    csv_bytes(table)
}

/// Dampers, then two effects with their strengths, empty where there are fewer.
fn named_strengths(candidate: &Candidate, strength: impl Fn(usize) -> Option<f64>) -> Vec<String> {
    let mut row = vec![candidate.base.name.to_owned()];
    for index in 0..2 {
        let effect = candidate.effects.get(index);
        row.push(effect.map_or_else(String::new, |effect| effect.key.to_owned()));
        row.push(effect.and_then(|_| strength(index)).map_or_else(String::new, |value| format!("{value:e}")));
    }
    row
}
