//! Sentences of the study before water: what was found, never what was hoped for.

use super::tables::name;
use crate::water::{
    CombinationOutcome, Companion, DRIVE_SPREAD, Explained, LEVEL_TOLERANCE_DB, PRINTED_DRIVE, PRINTED_PRESSURE, TENTH,
    WaterOutcome, WaterPlan,
};
use granchain_report::{
    number::{engineering, fixed, significant},
    page::{Block, Tone},
};

/// Whether the printed numbers come together anywhere, and what the printed drive gives.
pub(super) fn headline(outcome: &WaterOutcome) -> Block {
    let at_printed = outcome.combinations.iter().filter_map(CombinationOutcome::printed);
    let agreeing = at_printed.filter(|cell| cell.has_pressure() && cell.has_level()).count();
    let printed = outcome.combinations.iter().filter_map(CombinationOutcome::printed);
    let medians: Vec<f64> = printed.filter_map(|cell| Some(cell.pressure_pa?.median)).collect();
    let (low, high) = ends(&medians);
    let both = outcome.combinations.iter().filter(|own| !own.with_both().is_empty()).count();
    let drives: Vec<f64> = outcome.combinations.iter().flat_map(CombinationOutcome::with_both).collect();
    let elsewhere = if drives.is_empty() {
        "No combination has both at any drive run.".to_owned()
    } else {
        let (from, to) = ends(&drives);
        format!(
            "{both} of {} combinations have both, at {} of drive.",
            outcome.combinations.len(),
            range(1e6 * from, 1e6 * to, "µm")
        )
    };
    let (tone, verdict) = if agreeing > 0 {
        (
            Tone::Careful,
            format!(
                "At the printed 3.96 µm, {agreeing} of {} combinations give 14 kPa and −21 dB.",
                outcome.combinations.len()
            ),
        )
    } else {
        (Tone::Bad, "The printed 3.96 µm gives 14 kPa and −21 dB under no reading tried.".to_owned())
    };
    Block::Headline {
        tone,
        verdict,
        text: format!(" It gives {} instead. {elsewhere}", range(1e-3 * low, 1e-3 * high, "kPa")),
    }
}

pub(super) fn introduction(plan: &WaterPlan, model: &str) -> String {
    format!(
        "Six 1 mm steel beads between a piston (73 kHz, 30 cycles under a Gaussian) and a disc of vitreous carbon, 2 mm wide and 0.25 mm thick, \
         on a half-space of water; pressure on the axis 1 mm into it; model {model}. The paper prints neither the disc’s mount nor what lies around \
         it nor whether the piston’s and the disc’s contacts have dampers, so all of these are varied. Each cell holds {} runs spread evenly over \
         ±{} % of drive. The spectra are Hann’s over the half-height of the burst. A rigid baffle is computed by the Rayleigh integral, a soft one by \
         acoustic elements of {} mm. The drive of {} µm is a hypothesis: the paper writes “3.96 m”, and a tenth of 3.96 µm may have been meant.",
        plan.replicates,
        fixed(100.0 * DRIVE_SPREAD, 0),
        significant(1e3 * plan.soft_side_m, 2),
        significant(1e6 * TENTH, 3)
    )
}

/// What the combinations have in common, and what parts them.
pub(super) fn findings(outcome: &WaterOutcome) -> Vec<String> {
    let mut said = Vec::new();
    for own in &outcome.combinations {
        for drive in own.with_both() {
            said.push(format!(
                "{}: 14 kPa and, within {LEVEL_TOLERANCE_DB} dB, −21 dB at {} µm, {} of the printed drive.",
                name(&own.combination),
                significant(1e6 * drive, 2),
                fraction(drive / PRINTED_DRIVE)
            ));
        }
    }
    let missing: Vec<String> = outcome
        .combinations
        .iter()
        .filter(|own| own.crossing.is_some() && own.with_both().is_empty())
        .filter_map(|own| Some((own, own.crossing?)))
        .map(|(own, crossing)| {
            format!(
                "{} ({} dB at {} µm)",
                name(&own.combination),
                fixed(crossing.level_db, 0),
                significant(1e6 * crossing.drive_m, 2)
            )
        })
        .collect();
    if !missing.is_empty() {
        said.push(format!(
            "The pressure but not the level (more than {LEVEL_TOLERANCE_DB} dB off) at the drive that gives 14 kPa: {}.",
            missing.join("; ")
        ));
    }
    let never: Vec<String> = outcome
        .combinations
        .iter()
        .filter(|own| own.crossing.is_none() && own.with_both().is_empty())
        .map(|own| {
            let medians: Vec<f64> = own.cells.iter().filter_map(|cell| Some(cell.pressure_pa?.median)).collect();
            let (low, high) = ends(&medians);
            let side = if own.begins_above() { "above at" } else { "below at" };
            format!("{} ({side} every drive, {})", name(&own.combination), range(1e-3 * low, 1e-3 * high, "kPa"))
        })
        .collect();
    if !never.is_empty() {
        said.push(format!("The medians do not pass 14 kPa between the drives run: {}.", never.join("; ")));
    }
    let failed: usize = outcome.combinations.iter().flat_map(|own| &own.cells).map(|cell| cell.failures.len()).sum();
    if failed > 0 {
        let first = outcome.combinations.iter().flat_map(|own| &own.cells).find_map(|cell| cell.failures.first());
        said.push(format!("{failed} runs failed, the first because: {}.", first.map_or("", String::as_str)));
    }
    said
}

/// What of the printed pressure a compliant tip explains.
pub(super) fn tips(outcome: &WaterOutcome) -> String {
    let Some(found) = outcome.explained() else {
        let reason = outcome.tips.iter().find_map(|tip| tip.cell.failures.first());
        return format!(
            "What of the printed pressure is explained by a compliant tip is not known: none of these cells could be run{}.",
            reason.map_or_else(String::new, |reason| format!(", the first because: {reason}"))
        );
    };
    let Explained { prescribed_pa, least: (index, least), share } = found;
    let tip = &outcome.tips[index];
    let start = format!(
        "The paper’s 3.96 µm may be the free motion of a horn that the chain loads. Under a tip that moves as prescribed ours is {} kPa",
        significant(1e-3 * prescribed_pa, 2)
    );
    if share <= 0.0 {
        return format!(
            "{start}, and no tip tried makes it less: nothing of the factor to the printed 14 kPa is explained by one that gives way."
        );
    }
    let held: Vec<String> = outcome
        .tips
        .iter()
        .filter(|tip| tip.cell.has_pressure())
        .map(|tip| format!("{} with Q {}", engineering(1e3 * tip.mass_kg, "g", 2), fixed(tip.quality, 0)))
        .collect();
    let verdict = if held.is_empty() {
        let beyond = if least < PRINTED_PRESSURE { "passes" } else { "does not reach" };
        format!("a compliant tip {beyond} the printed 14 kPa, and no tip tried holds it within its runs")
    } else {
        format!("the printed 14 kPa lies within the runs of {}", held.join(", "))
    };
    format!(
        "{start}; the least of the tips below, {} with Q {}, gives {} kPa, a factor {} of the {} between ours and the printed 14 kPa ({} % of its logarithm): {verdict}. \
         A tip as light as a bead is no horn: of one of 0.1 g and more, {}.",
        engineering(1e3 * tip.mass_kg, "g", 2),
        fixed(tip.quality, 0),
        significant(1e-3 * least, 2),
        significant(prescribed_pa / least, 2),
        significant(prescribed_pa / PRINTED_PRESSURE, 2),
        fixed(100.0 * share, 0),
        heavy(outcome, prescribed_pa)
    )
}

/// What tips of 0.1 g and more leave of the pressure under a prescribed motion.
fn heavy(outcome: &WaterOutcome, prescribed_pa: f64) -> String {
    let heavy = outcome.tips.iter().filter(|tip| tip.mass_kg >= 0.1e-3);
    let medians: Vec<f64> = heavy.filter_map(|tip| Some(tip.cell.pressure_pa?.median / prescribed_pa)).collect();
    let (low, high) = ends(&medians);
    if medians.is_empty() {
        "none could be run".into()
    } else {
        format!("{} of the pressure is left", range(100.0 * low, 100.0 * high, "%"))
    }
}

/// How the companion's beads compare.
pub(super) fn companion(companion: &Companion) -> String {
    let widths: Vec<f64> = companion.cells.iter().filter_map(|cell| Some(cell.band_width_hz?.median)).collect();
    let distortions: Vec<f64> = companion.cells.iter().filter_map(|cell| Some(cell.thd?.median)).collect();
    let (narrow, wide) = ends(&widths);
    let (least, most) = ends(&distortions);
    format!(
        "The companion work is known by its abstract: six aluminium beads into water through carbon, measured and modelled. Its drive, precompression \
         and mount are not printed, and its records are not published, so that no similarity to its hydrophone can be computed here. Over the drives \
         below ours have {} THD and a −6 dB width of {}; theirs are 73 % and 280 kHz measured, 78 % and 252 kHz modelled. How alike our own pressures \
         are with the disc clamped and supported stands beside the similarity of 83 % that they print of model and hydrophone: it says how much \
         of such a number the mount alone decides.",
        range(100.0 * least, 100.0 * most, "%"),
        range(1e-3 * narrow, 1e-3 * wide, "kHz")
    )
}

pub(super) fn unknown(plan: &WaterPlan) -> Vec<String> {
    vec![
        "The paper prints “3.96 m” of drive; 3.96 µm is our reading.".into(),
        "Mount and baffle of the disc are not printed. A free disc is pushed away by the first hits and loses the chain.".into(),
        "The width of the Gaussian is not printed; ours is exp(−½(2.5 x)²), x from −1 to 1 over the 30 cycles.".into(),
        format!(
            "Whether the printed {} kPa is a peak of the whole record or of what the figure shows, and how its spectrum was windowed, is not said. A \
             level is read with ±{LEVEL_TOLERANCE_DB} dB.",
            fixed(1e-3 * PRINTED_PRESSURE, 0)
        ),
        "The factor between the printed drive and the one that gives the printed pressure is unexplained.".into(),
        format!(
            "The soft baffle’s elements of {} mm do not resolve the singularity at the disc’s edge: its pressures are good to a few per cent.",
            significant(1e3 * plan.soft_side_m, 2)
        ),
    ]
}

fn ends(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

fn range(low: f64, high: f64, unit: &str) -> String {
    let (from, to) = (significant(low, 2), significant(high, 2));
    if from == to { format!("{from} {unit}") } else { format!("{from} to {to} {unit}") }
}

/// `an eighth`, or the quotient where it is no plain fraction.
fn fraction(share: f64) -> String {
    format!("1/{}", significant(1.0 / share, 2))
}
