//! Remedies in messages: what is expected, what else may be meant, and which flags help.

use granchain_signal::Dimension;

use super::{
    MeasurementError, Place, ReadOptions, RecordKind, Sensitivity,
    column::{Chosen, Column, choose},
    shell::shell_word,
    universal::UniversalError,
};

pub(super) fn listed(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

pub(super) fn wanted(kind: RecordKind) -> &'static str {
    match kind {
        RecordKind::HornTip => "a displacement such as `displacement_um` or a velocity such as `velocity_mm_per_s`",
        RecordKind::Vibrometer => "a velocity such as `velocity_mm_per_s`",
        RecordKind::Hydrophone => {
            "a pressure such as `pressure_kpa`, or volts such as `hydrophone_mv` with the hydrophone's sensitivity"
        }
    }
}

/// Example of a sensitivity of this kind, and its instrument.
pub(super) fn sensitivity(kind: RecordKind) -> (&'static str, &'static str) {
    match kind {
        RecordKind::HornTip => (
            "a velocity or a displacement",
            "the vibrometer's sensitivity; pass it as --scale '<VALUE> um/V' or '<VALUE> mm/s/V'",
        ),
        RecordKind::Vibrometer => ("a velocity", "the vibrometer's sensitivity; pass it as --scale '<VALUE> mm/s/V'"),
        RecordKind::Hydrophone => (
            "a pressure",
            "the hydrophone's sensitivity; pass it as --scale '<VALUE> mV/MPa', or write `# sensitivity: <VALUE> mV/MPa` into the file",
        ),
    }
}

/// What else a quantity may mean that a record of this kind cannot have.
pub(super) fn other_record(kind: RecordKind, found: Dimension) -> &'static str {
    match (kind, found) {
        (RecordKind::Vibrometer, Dimension::PRESSURE) => {
            "; a hydrophone's record is calibrated on with --quantity pressure, and inspected with --kind hydrophone"
        }
        (RecordKind::Hydrophone, Dimension::VELOCITY) => "; for a vibrometer record leave out --quantity pressure",
        (RecordKind::Vibrometer, Dimension::LENGTH) => {
            "; a horn tip's record is given with --drive: are the two files swapped?"
        }
        _ => "",
    }
}

/// What a strongest line at a fraction of the drive frequency may mean.
pub(super) fn subharmonic(stated: f64, found: f64) -> &'static str {
    let is = |parts: f64| (found * parts / stated - 1.0).abs() < 0.05;
    if is(2.0) || is(3.0) {
        "; the strongest line at a fraction of the drive is typical for a bead, not for a horn: are the two files swapped?"
    } else {
        ""
    }
}

fn share_a_name(candidates: &[String]) -> bool {
    candidates.iter().enumerate().any(|(i, name)| candidates[..i].contains(name))
}

/// How to choose one of several columns; by number if names are shared.
pub(super) fn by_name_or_number(flag: &str, candidates: &[String], numbers: &[usize]) -> String {
    if !share_a_name(candidates) {
        return format!("with {flag}");
    }
    let numbers: Vec<String> = numbers.iter().map(|number| with_value(flag, &number.to_string())).collect();
    format!("by its number, for they share a name: {}", numbers.join(" or "))
}

/// A flag with its value as typed; the value of `--read KEY=NAME` follows the key.
fn with_value(flag: &str, value: &str) -> String {
    match flag.strip_prefix("--read ").and_then(|setting| setting.strip_suffix("NAME")) {
        Some(key) => format!("--read {}", shell_word(&format!("{key}{value}"))),
        None => format!("{flag} {}", shell_word(value)),
    }
}

/// Flags that name a column of time and its unit; of a likely one as they are typed.
pub(super) fn time_flags(likely: Option<&(String, &'static str)>) -> String {
    match likely {
        Some((column, unit)) => format!("{} --read time_unit={unit}", with_value("--read time_column=NAME", column)),
        None => "--read time_column=NAME and --read time_unit=UNIT".into(),
    }
}

pub(super) fn times(announced: usize, found: usize) -> String {
    format!("{found}, {} times as many", found / announced.max(1))
}

/// Chooses as `column::choose` does. Where a column of time is missing, the error names the `likely` one with its likely unit, and what is missing
/// besides once that is the time.
pub(super) fn choose_or_propose(
    place: &Place,
    columns: &mut [Column],
    kind: RecordKind,
    options: &ReadOptions,
    timed: bool,
    stated: Option<Sensitivity>,
    likely: impl FnOnce(&[Column]) -> Option<(usize, &'static str)>,
) -> Result<Chosen, MeasurementError> {
    let mut untouched = columns.to_vec();
    choose(place, columns, kind, options, timed, stated).map_err(|error| {
        let Some((at, unit)) = likely(&untouched).filter(|_| error.lacks_time()) else { return error };
        let header = untouched[at].header.clone();
        let columns = untouched.iter().map(|column| column.header.clone()).collect();
        let lacking = MeasurementError::NoTime { place: place.clone(), columns, likely: Some((header.clone(), unit)) };
        let then = ReadOptions { time_column: Some(header), time_unit: Some("s".into()), ..options.clone() };
        match choose(place, &mut untouched, kind, &then, true, stated) {
            Ok(_) => lacking,
            Err(MeasurementError::Several(rest)) => {
                MeasurementError::of_all([lacking].into_iter().chain(rest).collect())
            }
            Err(rest) => MeasurementError::of_all(vec![lacking, rest]),
        }
    })
}

/// The flags that resolve all errors; `None` if no flag resolves one of them.
pub(super) fn remedies(errors: &[MeasurementError]) -> Option<String> {
    errors.iter().map(MeasurementError::remedy).collect::<Option<Vec<_>>>().map(|flags| flags.join(" "))
}

impl MeasurementError {
    pub(super) fn of_all(mut errors: Vec<Self>) -> Self {
        if errors.len() == 1 { errors.remove(0) } else { Self::Several(errors) }
    }

    /// Whether a column of time is missing, alone or among others.
    pub(super) fn lacks_time(&self) -> bool {
        match self {
            Self::NoTime { .. } => true,
            Self::Several(errors) => errors.iter().any(Self::lacks_time),
            _ => false,
        }
    }

    /// Flags that resolve the error, with placeholders such as `<VALUE>` for what only the user knows; `None` if no
    /// flag helps.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        Some(match self {
            Self::Several(errors) => return remedies(errors),
            Self::Ambiguous { flag, candidates, numbers, .. } => {
                // What has no unit may be anything, also a time or a counter: then nothing is proposed.
                let known = Column::from_header(candidates.first()?).unit.is_some_and(|unit| unit.is_ok());
                match (known, share_a_name(candidates)) {
                    (false, _) => with_value(flag, "NAME"),
                    (true, true) => with_value(flag, &numbers.first()?.to_string()),
                    (true, false) => with_value(flag, candidates.first()?),
                }
            }
            Self::Volts { kind, .. } => match kind {
                RecordKind::HornTip => "--scale '<VALUE> um/V'".into(),
                RecordKind::Vibrometer => "--scale '<VALUE> mm/s/V'".into(),
                RecordKind::Hydrophone => "--scale '<VALUE> mV/MPa'".into(),
            },
            Self::NoQuantity { open, .. } => match &open[..] {
                [] => return None,
                [only] => format!("--channel {} --unit UNIT", shell_word(only)),
                _ => "--channel NAME --unit UNIT".into(),
            },
            Self::Segments { wanted: None, .. } | Self::Universal(UniversalError::Several { wanted: None, .. }) => {
                "--read dataset=N".into()
            }
            Self::NoTime { likely: likely @ Some(_), .. } => time_flags(likely.as_ref()),
            Self::Ramp { .. } => "--channel NAME".into(),
            Self::NoTime { .. } => "--sample-rate RATE".into(),
            Self::NoUnit { flag: "--read time_unit=UNIT", .. } => "--read time_unit=UNIT".into(),
            Self::NoUnit { flag: "--unit", .. } => "--unit UNIT".into(),
            Self::NoHeader { flags, .. } => flags.clone(),
            _ => return None,
        })
    }
}
