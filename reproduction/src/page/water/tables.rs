//! Tables of the study before water, for the page and as CSV.

use std::fmt::Write as _;

use crate::water::{Cell, Combination, Companion, PRINTED_LEVEL_DB, PRINTED_PRESSURE, Quantiles, WaterOutcome};
use granchain_report::{
    number::{engineering, fixed, significant},
    page::{Column, Table},
    sweep::capitalised,
};

/// A combination in a few words.
pub(super) fn name(combination: &Combination) -> String {
    let Combination { rim, baffle, placement } = combination;
    let dampers = if *placement == "all" { "at all contacts" } else { "between beads" };
    format!("{rim}, {baffle} baffle, dampers {dampers}")
}

/// Median and ends, `14.5 (12.1 to 16.0)`.
fn spread(found: Option<Quantiles>, factor: f64, say: impl Fn(f64) -> String) -> String {
    found.map_or("–".into(), |Quantiles { median, lowest, highest }| {
        format!("{} ({} to {})", say(factor * median), say(factor * lowest), say(factor * highest))
    })
}

/// Drives with both printed numbers, in µm.
fn both_at(drives: &[f64]) -> String {
    if drives.is_empty() {
        return "–".to_owned();
    }
    drives.iter().map(|drive| significant(1e6 * drive, 2)).collect::<Vec<_>>().join(", ")
}

fn three(value: f64) -> String {
    significant(value, 3)
}

fn whole(value: f64) -> String {
    fixed(value, 0)
}

/// Where each combination passes the printed pressure.
pub(super) fn crossings(outcome: &WaterOutcome) -> Table {
    let rows = outcome.combinations.iter().map(|own| {
        let printed = own.printed();
        let none = if own.begins_above() { "below all" } else { "never" };
        let (drive, level) = own.crossing.map_or((none.into(), "–".into()), |crossing| {
            (significant(1e6 * crossing.drive_m, 2), fixed(crossing.level_db, 0))
        });
        vec![
            own.combination.rim.to_owned(),
            own.combination.baffle.to_owned(),
            if own.combination.placement == "all" { "all contacts" } else { "between beads" }.to_owned(),
            drive,
            level,
            both_at(&own.with_both()),
            printed.and_then(|cell| cell.pressure_pa).map_or("–".into(), |found| three(1e-3 * found.median)),
            printed
                .and_then(|cell| cell.pressure_pa)
                .map_or("–".into(), |found| significant(found.median / PRINTED_PRESSURE, 2)),
        ]
    });
    Table {
        caption: format!(
            "Where the median peak pressure passes the printed {} kPa with rising drive, the level around 0.95 MHz there (printed: {} dB re the \
             fundamental), and what the printed drive of 3.96 µm gives. Both interpolated between the drives run. “Both at”: drives with 14 kPa and, within 3 dB, −21 dB.",
            fixed(1e-3 * PRINTED_PRESSURE, 0),
            fixed(PRINTED_LEVEL_DB, 0)
        ),
        columns: vec![
            Column::words("Rim"),
            Column::words("Baffle"),
            Column::words("Dampers"),
            Column::numbers("14 kPa at").unit("µm"),
            Column::numbers("0.95 MHz there").unit("dB"),
            Column::words("Both at (µm)"),
            Column::numbers("At 3.96 µm").unit("kPa"),
            Column::numbers("of 14 kPa").unit("1"),
        ],
        rows: rows.collect(),
    }
}

/// One table a combination: every drive.
pub(super) fn combinations(outcome: &WaterOutcome) -> Vec<Table> {
    outcome.combinations.iter().map(|own| cells(&capitalised(&name(&own.combination)), &own.cells)).collect()
}

fn cells(title: &str, cells: &[Cell]) -> Table {
    let rows = cells.iter().map(|cell| {
        vec![
            significant(1e6 * cell.drive_m, 3),
            spread(cell.pressure_pa, 1e-3, three),
            spread(cell.level_db, 1.0, whole),
            spread(cell.content_hz, 1e-3, whole),
            spread(cell.velocity_m_per_s, 1e3, whole),
            holds(cell),
        ]
    });
    Table {
        caption: format!(
            "{title}. Median (lowest to highest) over the runs: peak pressure, level around 0.95 MHz and content at −21 dB re the fundamental, \
             largest velocity of the last bead’s pole; which printed number lies within the runs."
        ),
        columns: vec![
            Column::numbers("Drive").unit("µm"),
            Column::words("Pressure (kPa)"),
            Column::words("0.95 MHz (dB)"),
            Column::words("Content (kHz)"),
            Column::words("Pole (mm/s)"),
            Column::words("Holds"),
        ],
        rows: rows.collect(),
    }
}

/// The printed drive as the free motion of a compliant tip.
pub(super) fn tips(outcome: &WaterOutcome) -> Table {
    let rows = outcome.tips.iter().map(|tip| {
        let refused = tip.cell.failures.first().filter(|_| tip.cell.pressure_pa.is_none());
        vec![
            engineering(1e3 * tip.mass_kg, "g", 2),
            fixed(tip.quality, 0),
            spread(tip.cell.pressure_pa, 1e-3, three),
            spread(tip.cell.level_db, 1.0, whole),
            spread(tip.cell.velocity_m_per_s, 1e3, whole),
            refused.map_or_else(|| holds(&tip.cell), |reason| format!("not run: {reason}")),
        ]
    });
    Table {
        caption: "A tip of this modal mass and Q, resonant at the drive, whose free motion is the printed 3.96 µm: clamped disc, rigid baffle, dampers at all \
                  contacts. The lightest has the mass of a bead."
            .into(),
        columns: vec![
            Column::words("Tip"),
            Column::numbers("Q"),
            Column::words("Pressure (kPa)"),
            Column::words("0.95 MHz (dB)"),
            Column::words("Pole (mm/s)"),
            Column::words("Holds"),
        ],
        rows: rows.collect(),
    }
}

/// Which printed number lies within the runs of a cell, and how many of them failed.
fn holds(cell: &Cell) -> String {
    let failed = cell.failures.len();
    let verdict = match (cell.has_pressure(), cell.has_level()) {
        (true, true) => "both",
        (true, false) => "pressure",
        (false, true) => "level",
        (false, false) => "–",
    };
    if failed > 0 { format!("{verdict}; {failed} failed") } else { verdict.to_owned() }
}

/// The companion's beads beside what is known of them.
pub(super) fn companion(companion: &Companion) -> Table {
    let mut rows: Vec<Vec<String>> = companion
        .cells
        .iter()
        .map(|cell| {
            let alike = companion.mount_similarity.iter().find(|(drive, _)| *drive == cell.drive_m);
            vec![
                significant(1e6 * cell.drive_m, 3),
                spread(cell.pressure_pa, 1e-3, three),
                spread(cell.thd, 100.0, whole),
                spread(cell.band_width_hz, 1e-3, whole),
                alike.map_or("–".into(), |(_, value)| fixed(100.0 * value, 0)),
            ]
        })
        .collect();
    let published = |who: &str, thd: &str, width: &str, alike: &str| {
        vec![who.to_owned(), "–".to_owned(), thd.to_owned(), width.to_owned(), alike.to_owned()]
    };
    rows.push(published("hydrophone", "73", "280", "–"));
    rows.push(published("their model", "78", "252", "83 (to the hydrophone)"));
    Table {
        caption: format!(
            "Six aluminium beads, disc {}: median (lowest to highest) of our runs. THD is the rms of the harmonics over the total rms; the −6 dB \
             width is that of the strongest band. Similarity is the peak of the normalised cross-correlation: ours of the clamped with the \
             supported disc, theirs of model and hydrophone.",
            name(&companion.combination)
        ),
        columns: vec![
            Column::words("Drive (µm)"),
            Column::words("Pressure (kPa)"),
            Column::words("THD (%)"),
            Column::words("−6 dB width (kHz)"),
            Column::words("Similarity (%)"),
        ],
        rows,
    }
}

/// All cells, one row a combination and drive.
pub(super) fn csv(outcome: &WaterOutcome) -> String {
    let mut text = String::from("material,rim,baffle,dampers,drive_m");
    for name in ["pressure_pa", "level_0.95mhz_db", "content_hz", "band_width_hz", "thd", "pole_velocity_m_per_s"] {
        // Writing to a string cannot fail.
        let _ = write!(text, ",median_{name},lowest_{name},highest_{name}");
    }
    text.push_str(",failed_runs\n");
    let mut rows = |material: &str, combination: &Combination, cells: &[Cell]| {
        for cell in cells {
            let Combination { rim, baffle, placement } = combination;
            let _ = write!(text, "{material},{rim},{baffle},{placement},{:e}", cell.drive_m);
            let found =
                [cell.pressure_pa, cell.level_db, cell.content_hz, cell.band_width_hz, cell.thd, cell.velocity_m_per_s];
            for found in found {
                let _ = match found {
                    Some(Quantiles { median, lowest, highest }) => write!(text, ",{median:e},{lowest:e},{highest:e}"),
                    None => write!(text, ",,,"),
                };
            }
            let _ = writeln!(text, ",{}", cell.failures.len());
        }
    };
    for own in &outcome.combinations {
        rows("chrome-steel", &own.combination, &own.cells);
    }
    rows("aluminium", &outcome.companion.combination, &outcome.companion.cells);
    text
}
