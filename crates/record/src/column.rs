//! Column headers: name and unit of each column, and which column to read.

use granchain_signal::{Dimension, QuantityError, Unit};

use super::{
    MeasurementError, Place, ReadOptions, RecordKind, Sensitivity, clock,
    time_column::{self, says_time},
};

/// A column as its header (and a units row, if there is one) describes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub header: String,
    /// Name part of the header.
    pub name: String,
    /// The unit as written, if one is.
    pub unit_text: Option<String>,
    pub unit: Option<Result<Unit, QuantityError>>,
}

/// The unit `text` stands for, including the words that oscilloscopes write.
pub(super) fn parse_unit(text: &str) -> Result<Unit, QuantityError> {
    let text = text.trim().trim_start_matches(['[', '(']);
    let closes = |open: char, close: char| text.matches(close).count() > text.matches(open).count();
    let text =
        if text.ends_with(']') || (text.ends_with(')') && closes('(', ')')) { &text[..text.len() - 1] } else { text };
    match text.trim().to_lowercase().as_str() {
        "volt" | "volts" | "v" | "vdc" => Unit::parse("V"),
        "sec" | "secs" | "second" | "seconds" | "sekunden" => Unit::parse("s"),
        "usec" | "micros" | "microsec" | "microseconds" | "mikrosekunden" => Unit::parse("us"),
        "msec" | "millis" | "millisec" | "milliseconds" | "millisekunden" => Unit::parse("ms"),
        "nsec" | "nanosec" | "nanoseconds" => Unit::parse("ns"),
        "micron" | "microns" => Unit::parse("um"),
        // Underscores stand for division too: `velocity_mm_s`.
        "m_s" | "mps" => Unit::parse("m/s"),
        "mm_s" | "mmps" => Unit::parse("mm/s"),
        "um_s" | "umps" => Unit::parse("um/s"),
        // In small letters as in `pressure_kpa`; `mpa` may be either of two.
        "pa" => Unit::parse("Pa"),
        "kpa" => Unit::parse("kPa"),
        "hertz" => Unit::parse("Hz"),
        "decibel" => Unit::parse("dB"),
        "ips" => Unit::parse("in/s"),
        // A point between factors, as in French.
        lower if lower.contains(".s-") => Unit::parse(&text.trim().replace('.', "·")),
        _ => match text.trim().strip_suffix("/sec") {
            Some(unit) => Unit::parse(&format!("{unit}/s")),
            None => Unit::parse(text.trim()),
        },
    }
}

/// Position of the bracket that closes at the end of `text`; brackets may follow one another or be nested.
fn opening(text: &str, open: char, close: char) -> Option<usize> {
    let mut depth = 0;
    let mut places = text.char_indices().rev().peekable();
    places.peek().filter(|(_, letter)| *letter == close)?;
    places.find_map(|(at, letter)| {
        depth += i32::from(letter == close) - i32::from(letter == open);
        (depth == 0).then_some(at)
    })
}

/// Whether a name is that of a sample counter.
pub(super) fn is_counter(name: &str) -> bool {
    let names = ["", "#", "n", "nr", "nr.", "no", "no.", "number", "nummer", "id", "index", "row", "count", "counter"];
    names.into_iter().chain(["sample", "samples", "point", "points", "scan"]).any(|it| it == name.trim().to_lowercase())
}

impl Column {
    /// A column with the unit that a file states beside its name; without one the name is read for it.
    pub(super) fn named(name: &str, unit: &str) -> Self {
        if unit.trim().is_empty() {
            return Self::from_header(name);
        }
        Self { header: name.into(), name: name.into(), unit_text: Some(unit.into()), unit: Some(parse_unit(unit)) }
    }

    /// Parses a header: `Velocity [mm/s]`, `Time (us)`, `t / s`, `velocity_mm_per_s`, `Velocity mm/s`, `Time`.
    pub(super) fn from_header(header: &str) -> Self {
        let header = header.trim();
        let with = |name: &str, unit: &str| {
            // Of an acceleration `g` is no gram.
            let gravities = name.to_lowercase().contains("acc");
            let of_gravity = Unit { factor: 9.80665, dimension: Dimension::ACCELERATION };
            let unit_of = match unit.trim() {
                "g" if gravities => Ok(of_gravity),
                // Some write seconds as `S`; elsewhere it is siemens.
                "S" | "mS" | "uS" | "µS" | "nS" | "US" if says_time(name) => parse_unit(&unit.to_lowercase()),
                "M/S" | "MM/S" | "UM/S" => parse_unit(&unit.to_lowercase()),
                _ => parse_unit(unit),
            };
            Self {
                header: header.into(),
                name: name.trim().trim_end_matches(['_', '-', '/', ' ']).into(),
                unit_text: Some(unit.trim().into()),
                unit: Some(unit_of),
            }
        };
        // `CH1 (in)` is an input, an inch where the name says so; `Y[1]` is the second of several.
        let is_unit = |name: &str, unit: &str| {
            let inch = unit.trim() != "in" || INCHES.iter().any(|word| name.to_lowercase().contains(word));
            inch && unit.contains(|letter: char| !letter.is_ascii_digit() && letter != ' ')
        };
        for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
            let of_quantity = |unit: &str| parse_unit(unit).is_ok_and(|unit| unit.dimension != Dimension::NONE);
            let last = opening(header, open, close);
            let parts = |from: usize| (&header[..from], &header[from + 1..header.len() - 1]);
            if let Some((name, unit)) = last.map(parts).filter(|(name, unit)| is_unit(name, unit) && of_quantity(unit))
            {
                return with(name, unit);
            }
            // `Velocity [mm/s] CH2`, `Velocity (m/s), Point: (0, 1)`.
            for (at, _) in header.match_indices(close).rev() {
                let after = &header[at + 1..];
                let Some(from) = opening(&header[..=at], open, close).filter(|_| after.starts_with([' ', ','])) else {
                    continue;
                };
                let (name, unit) = (&header[..from], &header[from + 1..at]);
                if is_unit(name, unit) && of_quantity(unit) {
                    return with(&format!("{}{after}", name.trim_end()), unit);
                }
            }
            if let Some((name, unit)) = last.map(parts).filter(|(name, unit)| is_unit(name, unit))
                && (open == '[' || open == '(' || parse_unit(unit).is_ok())
            {
                return with(name, unit);
            }
        }
        if let Some((name, unit)) = header.split_once(" / ") {
            return with(name, unit);
        }
        // Rohde & Schwarz: `in s`, `C1 in V`.
        if let Some((name, unit)) = header.rsplit_once("in ").filter(|(name, _)| name.is_empty() || name.ends_with(' '))
            && parse_unit(unit).is_ok()
        {
            return with(name, unit);
        }
        for (at, separator) in header.match_indices(['_', ' ']) {
            let unit = &header[at + separator.len()..];
            // `in` is a word before a unit or the name of an input; an inch stands in brackets or below a line.
            let word = unit.trim_start_matches(['(', '[']).strip_prefix("in");
            let word = word.is_some_and(|rest| rest.is_empty() || rest.starts_with(['_', ' ', ')', ']']));
            // `CH1_min` is the least, not minutes.
            let least = unit == "min" && !says_time(&header[..at]);
            // A pure number (`ch_1`) is part of the name.
            if at > 0 && !word && !least && parse_unit(unit).is_ok_and(|unit| unit.dimension != Dimension::NONE) {
                return with(&header[..at], unit);
            }
        }
        // `Vib-mm/s`, `t:s`: elsewhere a letter behind these signs is part of the name.
        for (at, _) in header.match_indices(['-', '.', ':']).filter(|(at, _)| *at > 0) {
            let (name, unit) = (&header[..at], &header[at + 1..]);
            if (unit.contains('/') || says_time(name))
                && parse_unit(unit).is_ok_and(|it| it.dimension != Dimension::NONE)
            {
                return with(name, unit);
            }
        }
        // ISO 80000: `t/ms`; a unit alone (`m/s`) is no name and unit.
        if let Some((name, unit)) = header.split_once('/')
            && !name.is_empty()
            && parse_unit(header).is_err()
            && parse_unit(unit).is_ok()
        {
            return with(name, unit);
        }
        // The word for a unit alone, perhaps with the number of a channel: `sec`, `Second`, `Volt1`.
        let word = header.trim_end_matches(|letter: char| letter.is_ascii_digit());
        if ["sec", "second", "ms", "us", "µs", "ns", "micros", "volt", "volts"].contains(&word.to_lowercase().as_str())
        {
            return with(header, word);
        }
        Self { header: header.into(), name: header.into(), unit_text: None, unit: None }
    }

    /// Takes the unit from a cell of the units row, unless the header has one or the cell is empty. Text in the
    /// header's brackets that is not a unit (`X(CH1)`) is overridden.
    pub(super) fn add_unit_cell(&mut self, cell: &str) {
        let cell = cell.trim();
        let puzzling = self.unit.as_ref().is_some_and(Result::is_err) && parse_unit(cell).is_ok();
        if (self.unit.is_none() || puzzling) && !cell.is_empty() {
            self.unit_text = Some(cell.into());
            self.unit = Some(parse_unit(cell));
        }
    }

    pub(super) fn override_unit(&mut self, text: &str) {
        self.unit_text = Some(text.trim().into());
        self.unit = Some(parse_unit(text));
    }

    /// Whether its cells are times of day.
    pub(super) fn is_clock(&self) -> bool {
        self.unit_text.as_deref() == Some(clock::UNIT)
    }

    /// Whether its unit is that of a current, which no unit here is made of.
    fn is_current(&self) -> bool {
        let unit = self.unit_text.as_deref().unwrap_or_default().trim_matches(['[', ']', '(', ')', ' ']);
        ["A", "mA", "uA", "µA", "nA", "kA"].contains(&unit)
            || ["amp", "amps", "ampere", "amperes", "milliampere"].contains(&unit.to_lowercase().as_str())
    }

    pub(super) fn dimension(&self) -> Option<Dimension> {
        self.unit.as_ref().and_then(|unit| unit.as_ref().ok()).map(|unit| unit.dimension)
    }

    fn is_named(&self, names: &[&str]) -> bool {
        let name = self.name.to_lowercase();
        names.contains(&name.as_str())
    }
}

/// Parts of names whose unit `in` is an inch.
const INCHES: [&str; 5] = ["disp", "pos", "length", "distance", "weg"];
const MOTION_NAMES: [&str; 10] = ["velocity", "vel", "v", "speed", "vib", "displacement", "disp", "u", "x", "position"];
const PRESSURE_NAMES: [&str; 6] = ["pressure", "p", "hydrophone", "sound pressure", "acoustic pressure", "druck"];

/// Words that identify a column of this kind of record.
fn hints(kind: RecordKind) -> &'static [&'static str] {
    match kind {
        RecordKind::HornTip => &["horn", "tip", "drive", "sonotrode", "piston"],
        RecordKind::Vibrometer => &["vib", "ldv", "laser", "bead", "chain"],
        RecordKind::Hydrophone => &["hydrophone", "pressure"],
    }
}

/// Whether a header identifies its column as this kind of record.
pub(super) fn is_of(header: &str, kind: RecordKind) -> bool {
    let header = header.to_lowercase();
    let mut words = header.split(|letter: char| !letter.is_alphanumeric());
    words.any(|word| hints(kind).iter().any(|hint| word.starts_with(hint)))
}

/// The candidates whose names identify this kind of record; if there are none, all candidates except those of other
/// kinds.
fn meant(columns: &[Column], found: Vec<usize>, kind: RecordKind) -> Vec<usize> {
    if found.len() < 2 {
        return found;
    }
    let is_plain = |i: &usize| !is_peak_detect(&columns[*i]) && !is_counter(&columns[*i].name);
    let plain: Vec<usize> = found.iter().copied().filter(is_plain).collect();
    let found = if plain.is_empty() { found } else { plain };
    let says = |kind| found.iter().copied().filter(|&i| is_of(&columns[i].header, kind)).collect::<Vec<usize>>();
    let own = says(kind);
    if !own.is_empty() {
        return own;
    }
    let kinds = [RecordKind::HornTip, RecordKind::Vibrometer, RecordKind::Hydrophone];
    let others: Vec<usize> = kinds.into_iter().filter(|other| *other != kind).flat_map(says).collect();
    let left: Vec<usize> = found.iter().copied().filter(|i| !others.contains(i)).collect();
    if left.is_empty() { found } else { left }
}

/// Whether a column holds the extremes between samples that an oscilloscope adds in Peak Detect mode.
pub(super) fn is_peak_detect(column: &Column) -> bool {
    column.header.to_lowercase().replace(['-', '_'], " ").contains("peak detect")
}

fn names(kind: RecordKind) -> &'static [&'static str] {
    match kind {
        RecordKind::HornTip | RecordKind::Vibrometer => &MOTION_NAMES,
        RecordKind::Hydrophone => &PRESSURE_NAMES,
    }
}

/// Example header of a column of this kind, with its unit.
fn example(kind: RecordKind) -> &'static str {
    match kind {
        RecordKind::HornTip | RecordKind::Vibrometer => "velocity_mm_per_s",
        RecordKind::Hydrophone => "pressure_kpa",
    }
}

/// The columns to read, with their units in SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chosen {
    /// `None` if the rows have no time.
    pub time: Option<usize>,
    /// Whether others may be time too.
    pub several: bool,
    pub value: usize,
    pub time_factor: f64,
    /// Unit of the recorded quantity.
    pub value_unit: Unit,
    /// If the column is in volts: its unit, and the sensitivity used.
    pub volts: Option<(Unit, Sensitivity)>,
}

/// Finds the time column and the column of the recorded quantity. Units given by flags are written into `columns`.
/// Rows with known instants (`timed`) need no time column. A sensitivity in the file applies to a column in volts
/// unless the options state another.
pub(super) fn choose(
    place: &Place,
    columns: &mut [Column],
    kind: RecordKind,
    options: &ReadOptions,
    timed: bool,
    stated: Option<Sensitivity>,
) -> Result<Chosen, MeasurementError> {
    let times = time_column::candidates(place, columns, options);
    let found = times.as_deref().unwrap_or_default();
    let value = match &options.column {
        Some(wanted) => find(place, columns, wanted, "--channel"),
        None => choose_value(place, columns, found, kind, options, stated),
    };
    let value = value.map_err(|error| envelope(place, columns, &error).unwrap_or(error));
    let several = found.len() > 1;
    let near = match &value {
        Ok(value) => *value,
        Err(MeasurementError::Ambiguous { numbers, .. }) => numbers[0] - 1,
        Err(_) => columns.len(),
    };
    let time = times.and_then(|found| time_column::beside(place, columns, &found, near, timed));
    if let (Some(unit), Ok(Some(time))) = (&options.time_unit, &time) {
        columns[*time].override_unit(unit);
    }
    if let (Some(unit), Ok(value)) = (&options.unit, &value) {
        columns[*value].override_unit(unit);
    }
    if let (true, Ok(value)) = (options.scale.is_some(), &value) {
        // A sensitivity is for volts: what it is given for is in volts, or in parts of full scale.
        let column = &mut columns[*value];
        if column.unit.is_none() {
            column.override_unit("V");
        } else if let Some(scale) = options.scale.filter(|scale| scale.is_of_full_scale()) {
            let unit = column.unit_text.clone().unwrap_or_default();
            return Err(MeasurementError::NoFullScale {
                place: place.of(&column.header),
                scale: scale.to_string(),
                unit,
            });
        }
    }
    let time_factor = match &time {
        Err(_) | Ok(None) => Ok(1.0),
        Ok(Some(time)) => unit_of(place, &columns[*time], "time_s", "--read time_unit=UNIT").and_then(|unit| {
            let of_time = unit.dimension == Dimension::TIME;
            let wrong = || wrong(place, &columns[*time], unit, ("a time", kind), "--read time_column=NAME");
            if of_time { Ok(unit.factor) } else { Err(wrong()) }
        }),
    };
    let scaled = options.scale.or(stated).is_some();
    let volts_of = |column: &Column| MeasurementError::Volts {
        place: place.of(&column.header),
        kind,
        unit: column.unit_text.clone().unwrap_or_default(),
    };
    let unscaled = |column: &Column| column.dimension() == Some(Dimension::VOLTAGE) && !scaled;
    let value_unit = match &value {
        Ok(value) if unscaled(&columns[*value]) => Err(volts_of(&columns[*value])),
        Ok(value) if columns[*value].is_current() => {
            let unit = columns[*value].unit_text.clone().unwrap_or_default();
            Err(MeasurementError::Current { place: place.of(&columns[*value].header), kind, unit })
        }
        Ok(value) => unit_of(place, &columns[*value], example(kind), "--unit"),
        // Whichever is chosen: a sensitivity is missing besides.
        Err(MeasurementError::Ambiguous { numbers, .. })
            if numbers.iter().all(|number| unscaled(&columns[number - 1])) =>
        {
            Err(volts_of(&columns[numbers[0] - 1]))
        }
        Err(_) => Ok(Unit { factor: 1.0, dimension: Dimension::NONE }),
    };
    let (time, value, time_factor, mut value_unit) = match (time, value, time_factor, value_unit) {
        (Ok(time), Ok(value), Ok(time_factor), Ok(value_unit)) => (time, value, time_factor, value_unit),
        (time, value, time_factor, value_unit) => {
            // Of a spectrum nothing else matters.
            if let Err(spectrum @ MeasurementError::Spectrum { .. }) = time {
                return Err(spectrum);
            }
            let errors = [time.err(), value.err(), time_factor.err(), value_unit.err()];
            return Err(MeasurementError::of_all(errors.into_iter().flatten().collect()));
        }
    };
    let column = &columns[value];
    let is_volts = value_unit.dimension == Dimension::VOLTAGE;
    if options.scale.is_some() && !is_volts {
        return Err(MeasurementError::ScaleWithoutVolts {
            place: place.of(&column.header),
            unit: column.unit_text.clone().unwrap_or_default(),
        });
    }
    let volts = options.scale.or(stated).filter(|_| is_volts).map(|scale| (value_unit, scale));
    if let Some((volts, scale)) = volts {
        value_unit = scale.unit_of(volts);
    }
    match (value_unit.dimension, kind) {
        (Dimension::VELOCITY, RecordKind::Vibrometer | RecordKind::HornTip)
        | (Dimension::LENGTH, RecordKind::HornTip)
        | (Dimension::PRESSURE, RecordKind::Hydrophone) => {}
        (found, _) if volts.is_some() => {
            let scale = volts.map_or_else(String::new, |(_, scale)| scale.to_string());
            let place = place.of(&column.header);
            return Err(MeasurementError::WrongSensitivity { place, kind, scale, found });
        }
        _ => {
            let expected = match kind {
                RecordKind::HornTip => "a displacement or a velocity",
                RecordKind::Vibrometer => "a velocity",
                RecordKind::Hydrophone => "a pressure",
            };
            return Err(wrong(place, column, value_unit, (expected, kind), "--channel"));
        }
    }
    Ok(Chosen { time, several, value, time_factor, value_unit, volts })
}

pub(super) fn ambiguous(place: &Place, columns: &[Column], found: &[usize], flag: &'static str) -> MeasurementError {
    MeasurementError::Ambiguous {
        place: place.clone(),
        flag,
        candidates: found.iter().map(|&i| columns[i].header.clone()).collect(),
        numbers: found.iter().map(|&i| i + 1).collect(),
    }
}

fn choose_value(
    place: &Place,
    columns: &[Column],
    times: &[usize],
    kind: RecordKind,
    options: &ReadOptions,
    stated: Option<Sensitivity>,
) -> Result<usize, MeasurementError> {
    let others = |accept: &dyn Fn(&Column) -> bool| -> Vec<usize> {
        let named = |column: &Column| !column.header.is_empty() && accept(column);
        positions(columns, named).into_iter().filter(|i| !times.contains(i)).collect()
    };
    let fits = |column: &Column| match column.dimension() {
        Some(Dimension::VELOCITY) => kind != RecordKind::Hydrophone,
        Some(Dimension::LENGTH) => kind == RecordKind::HornTip,
        Some(Dimension::PRESSURE) => kind == RecordKind::Hydrophone,
        _ => false,
    };
    let mut found = others(&fits);
    if found.is_empty() {
        // Nothing has a fitting unit: what has none yet, by name if names help.
        found = others(&|column| column.unit.is_none() && column.is_named(names(kind)));
    }
    if found.is_empty() && (options.scale.is_some() || stated.is_some()) {
        found = others(&|column| column.dimension() == Some(Dimension::VOLTAGE));
    }
    if found.is_empty() && (options.unit.is_some() || options.scale.is_some()) {
        found = others(&|column| column.unit.is_none() && !is_counter(&column.name));
    }
    if found.is_empty() {
        found = others(&|column| column.unit.as_ref().is_some_and(Result::is_err) && column.is_named(names(kind)));
    }
    if found.is_empty() {
        found = others(&|column| column.dimension() == Some(Dimension::VOLTAGE));
    }
    let named = columns.iter().filter(|column| !column.header.is_empty()).count();
    if found.is_empty() && named == 1 + times.len() {
        found = others(&|_| true);
    }
    match meant(columns, found, kind)[..] {
        [only] => Ok(only),
        [] => Err(MeasurementError::NoQuantity {
            place: place.clone(),
            kind,
            columns: columns.iter().map(|column| column.header.clone()).collect(),
            open: others(&|column| column.unit.is_none()).into_iter().map(|i| columns[i].header.clone()).collect(),
        }),
        ref several => Err(ambiguous(place, columns, several, "--channel")),
    }
}

/// The refusal of the columns that an envelope's extremes stand in, `CH1_min` and `CH1_max`, instead of samples.
fn envelope(place: &Place, columns: &[Column], error: &MeasurementError) -> Option<MeasurementError> {
    let MeasurementError::Ambiguous { numbers, flag: "--channel", .. } = error else { return None };
    let words = |number: usize| -> Vec<String> {
        let name = columns[number - 1].name.to_lowercase();
        name.split(|letter: char| !letter.is_alphanumeric()).map(str::to_owned).collect()
    };
    let greatest = |word: &String| if word == "min" { "max".to_owned() } else { word.clone() };
    let pair = |&least: &usize| {
        let wanted: Vec<String> = words(least).iter().map(greatest).collect();
        let is_pair = |&&other: &&usize| words(other) == wanted && words(other) != words(least);
        numbers.iter().find(is_pair).map(|other| [least, *other].map(|number| columns[number - 1].header.clone()))
    };
    let [least, greatest] = numbers.iter().find_map(pair)?;
    Some(MeasurementError::Envelope { place: place.clone(), least, greatest })
}

pub(super) fn positions(columns: &[Column], accept: impl Fn(&Column) -> bool) -> Vec<usize> {
    columns.iter().enumerate().filter(|(_, column)| accept(column)).map(|(i, _)| i).collect()
}

/// The column that a flag names: by its whole header, else its name, else its number from 1.
pub(super) fn find(
    place: &Place,
    columns: &[Column],
    wanted: &str,
    flag: &'static str,
) -> Result<usize, MeasurementError> {
    let same = |a: &str| a.trim().to_lowercase() == wanted.trim().to_lowercase();
    for found in [positions(columns, |column| same(&column.header)), positions(columns, |column| same(&column.name))] {
        match found[..] {
            [] => {}
            [only] => return Ok(only),
            // A name that several have chooses none of them.
            _ => return Err(ambiguous(place, columns, &found, flag)),
        }
    }
    match wanted.trim().parse::<usize>() {
        Ok(number) if (1..=columns.len()).contains(&number) => Ok(number - 1),
        _ => Err(MeasurementError::NoSuchColumn {
            place: place.clone(),
            flag,
            wanted: wanted.into(),
            columns: columns.iter().map(|column| column.header.clone()).collect(),
        }),
    }
}

fn unit_of(
    place: &Place,
    column: &Column,
    example: &'static str,
    flag: &'static str,
) -> Result<Unit, MeasurementError> {
    match &column.unit {
        Some(Ok(unit)) => Ok(*unit),
        Some(Err(source)) => {
            Err(MeasurementError::UnknownUnit { place: place.of(&column.header), flag, source: source.clone() })
        }
        None => Err(MeasurementError::NoUnit { place: place.of(&column.header), example, flag }),
    }
}

fn wrong(
    place: &Place,
    column: &Column,
    unit: Unit,
    (expected, kind): (&'static str, RecordKind),
    flag: &'static str,
) -> MeasurementError {
    MeasurementError::WrongQuantity {
        place: place.of(&column.header),
        expected,
        unit: column.unit_text.clone().unwrap_or_default(),
        actual: unit.dimension,
        flag,
        kind,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_understood_in_all_their_forms() {
        for (header, name, dimension, factor) in [
            ("time_s", "time", Dimension::TIME, 1.0),
            ("Time (us)", "Time", Dimension::TIME, 1e-6),
            ("Time [\u{b5}s]", "Time", Dimension::TIME, 1e-6),
            ("Time [\u{3bc}s]", "Time", Dimension::TIME, 1e-6),
            ("t / ms", "t", Dimension::TIME, 1e-3),
            ("Time (sec)", "Time", Dimension::TIME, 1.0),
            ("velocity_mm_per_s", "velocity", Dimension::VELOCITY, 1e-3),
            ("Velocity [mm/s]", "Velocity", Dimension::VELOCITY, 1e-3),
            ("Velocity(m/s)", "Velocity", Dimension::VELOCITY, 1.0),
            ("v / mm/s", "v", Dimension::VELOCITY, 1e-3),
            ("Velocity mm/s", "Velocity", Dimension::VELOCITY, 1e-3),
            ("Velocity (mm s^(-1))", "Velocity", Dimension::VELOCITY, 1e-3),
            ("pole_velocity_m_per_s", "pole_velocity", Dimension::VELOCITY, 1.0),
            ("displacement_um", "displacement", Dimension::LENGTH, 1e-6),
            ("horn tip displacement nm", "horn tip displacement", Dimension::LENGTH, 1e-9),
            ("CH1 (V)", "CH1", Dimension::VOLTAGE, 1.0),
            ("Signal [mV]", "Signal", Dimension::VOLTAGE, 1e-3),
            ("in s", "", Dimension::TIME, 1.0),
            ("C1 in V", "C1", Dimension::VOLTAGE, 1.0),
            ("Measurement (DC) (V)", "Measurement (DC)", Dimension::VOLTAGE, 1.0),
        ] {
            let column = Column::from_header(header);
            assert_eq!(column.name, name, "{header}");
            let unit = column.unit.unwrap().unwrap();
            assert_eq!((unit.dimension, unit.factor), (dimension, factor), "{header}");
        }
        for header in ["Time", "ch_1", "Velocity", "", "_", "( )", "bead_6", "Bead in front"] {
            assert!(Column::from_header(header).unit.is_none(), "{header}");
        }
        assert!(Column::from_header("velocity [furlong/s]").unit.unwrap().is_err());
    }
}
