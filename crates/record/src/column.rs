//! What a header says: name and unit of each column, and which column is which.

use std::path::Path;

use granchain_signal::{Dimension, QuantityError, Unit};

use super::{MeasurementError, Place, ReadOptions, RecordKind, Sensitivity};

/// A column as its header (and a units row, if there is one) describes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    /// The header as written.
    pub header: String,
    /// The part of it that is a name.
    pub name: String,
    /// The unit as written, if one is.
    pub unit_text: Option<String>,
    /// What that unit is.
    pub unit: Option<Result<Unit, QuantityError>>,
}

/// The unit that `text` stands for; words that oscilloscopes write are understood too.
pub(super) fn parse_unit(text: &str) -> Result<Unit, QuantityError> {
    let text = text.trim().trim_start_matches(['[', '(']);
    let closes = |open: char, close: char| text.matches(close).count() > text.matches(open).count();
    let text =
        if text.ends_with(']') || (text.ends_with(')') && closes('(', ')')) { &text[..text.len() - 1] } else { text };
    match text.trim().to_lowercase().as_str() {
        "volt" | "volts" | "v" => Unit::parse("V"),
        "sec" | "second" | "seconds" => Unit::parse("s"),
        "microseconds" | "usec" => Unit::parse("us"),
        "milliseconds" | "msec" => Unit::parse("ms"),
        _ => Unit::parse(text.trim()),
    }
}

impl Column {
    /// Understand a header: `Velocity [mm/s]`, `Time (us)`, `t / s`, `velocity_mm_per_s`, `Velocity mm/s`, `Time`.
    pub(super) fn from_header(header: &str) -> Self {
        let header = header.trim();
        let with = |name: &str, unit: &str| Self {
            header: header.into(),
            name: name.trim().trim_end_matches(['_', '-']).into(),
            unit_text: Some(unit.trim().into()),
            unit: Some(parse_unit(unit)),
        };
        for (open, close) in [('[', ']'), ('(', ')')] {
            if let (Some(from), true) = (header.find(open), header.ends_with(close)) {
                let unit = &header[from + 1..header.len() - 1];
                if !unit.trim().is_empty() {
                    return with(&header[..from], unit);
                }
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
            // A pure number (`ch_1`) is part of the name.
            if at > 0 && parse_unit(unit).is_ok_and(|unit| unit.dimension != Dimension::NONE) {
                return with(&header[..at], unit);
            }
        }
        Self { header: header.into(), name: header.into(), unit_text: None, unit: None }
    }

    /// Take the unit from a cell of the units row, unless the header has one or the cell is empty. What stands in the header's brackets and is
    /// none (`X(CH1)`) gives way to one.
    pub(super) fn add_unit_cell(&mut self, cell: &str) {
        let cell = cell.trim();
        let puzzling = self.unit.as_ref().is_some_and(Result::is_err) && parse_unit(cell).is_ok();
        if (self.unit.is_none() || puzzling) && !cell.is_empty() {
            self.unit_text = Some(cell.into());
            self.unit = Some(parse_unit(cell));
        }
    }

    fn override_unit(&mut self, text: &str) {
        self.unit_text = Some(text.trim().into());
        self.unit = Some(parse_unit(text));
    }

    fn dimension(&self) -> Option<Dimension> {
        self.unit.as_ref().and_then(|unit| unit.as_ref().ok()).map(|unit| unit.dimension)
    }

    fn is_named(&self, names: &[&str]) -> bool {
        let name = self.name.to_lowercase();
        names.contains(&name.as_str())
    }
}

const TIME_NAMES: [&str; 5] = ["time", "t", "times", "zeit", "seconds"];
const MOTION_NAMES: [&str; 10] = ["velocity", "vel", "v", "speed", "vib", "displacement", "disp", "u", "x", "position"];
const PRESSURE_NAMES: [&str; 6] = ["pressure", "p", "hydrophone", "sound pressure", "acoustic pressure", "druck"];

fn names(kind: RecordKind) -> &'static [&'static str] {
    match kind {
        RecordKind::HornTip | RecordKind::Vibrometer => &MOTION_NAMES,
        RecordKind::Hydrophone => &PRESSURE_NAMES,
    }
}

/// A header of a column of this kind with its unit.
fn example(kind: RecordKind) -> &'static str {
    match kind {
        RecordKind::HornTip | RecordKind::Vibrometer => "velocity_mm_per_s",
        RecordKind::Hydrophone => "pressure_kpa",
    }
}

/// The columns to read, with their units in SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chosen {
    /// `None` where the rows have no time.
    pub time: Option<usize>,
    pub value: usize,
    pub time_factor: f64,
    /// Unit of the recorded quantity.
    pub value_unit: Unit,
    /// Unit of the volts that a sensitivity made that quantity, and the sensitivity.
    pub volts: Option<(Unit, Sensitivity)>,
}

/// Find the column of time and that of the recorded quantity. Units given by flags are written into `columns`. Rows whose
/// instants are known (`timed`) need no column of time. A sensitivity that the file states counts for a column in volts unless the options have one.
pub(super) fn choose(
    path: &Path,
    line: u64,
    columns: &mut [Column],
    kind: RecordKind,
    options: &ReadOptions,
    timed: bool,
    stated: Option<Sensitivity>,
) -> Result<Chosen, MeasurementError> {
    let headers = || columns.iter().map(|column| column.header.clone()).collect::<Vec<_>>();
    let header_line = || Place::line(path, line);

    let time = match &options.time_column {
        Some(wanted) => Some(find(path, line, columns, wanted, "--time-column")?),
        None => {
            let by_unit = |column: &Column| column.dimension() == Some(Dimension::TIME);
            let by_name = |column: &Column| column.dimension().is_none() && column.is_named(&TIME_NAMES);
            let mut found = positions(columns, |column| by_unit(column) || by_name(column));
            if found.len() > 1 {
                let named: Vec<_> = found.iter().copied().filter(|&i| columns[i].is_named(&TIME_NAMES)).collect();
                if named.len() == 1 {
                    found = named;
                }
            }
            match found[..] {
                [only] => Some(only),
                // Two columns without names for either: the first is time when its unit is given.
                [] if columns.len() == 2 && options.time_unit.is_some() && columns[0].unit.is_none() => Some(0),
                [] if timed => None,
                [] => return Err(MeasurementError::NoTime { place: header_line(), columns: headers() }),
                _ => {
                    let candidates = found.iter().map(|&i| columns[i].header.clone()).collect();
                    return Err(MeasurementError::Ambiguous {
                        place: header_line(),
                        flag: "--time-column",
                        candidates,
                    });
                }
            }
        }
    };
    if let (Some(unit), Some(time)) = (&options.time_unit, time) {
        columns[time].override_unit(unit);
    }
    let value = match &options.column {
        Some(wanted) => find(path, line, columns, wanted, "--column")?,
        None => choose_value(path, line, columns, time, kind, options, stated)?,
    };
    if let Some(unit) = &options.unit {
        columns[value].override_unit(unit);
    }

    let time_factor = match time {
        None => 1.0,
        Some(time) => {
            let unit = unit_of(path, line, &columns[time], "time_s", "--time-unit")?;
            if unit.dimension != Dimension::TIME {
                return Err(wrong(path, line, &columns[time], unit, ("a time", kind), "--time-column"));
            }
            unit.factor
        }
    };
    let column = &mut columns[value];
    if options.scale.is_some() && column.unit.is_none() {
        // A sensitivity is for volts: what it is given for is in volts.
        column.override_unit("V");
    }
    let mut value_unit = unit_of(path, line, column, example(kind), "--unit")?;
    let is_volts = value_unit.dimension == Dimension::VOLTAGE;
    if options.scale.is_some() && !is_volts {
        return Err(MeasurementError::ScaleWithoutVolts {
            place: Place::cell(path, line, &column.header),
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
        (Dimension::VOLTAGE, _) => {
            return Err(MeasurementError::Volts {
                place: Place::cell(path, line, &column.header),
                kind,
                unit: column.unit_text.clone().unwrap_or_default(),
            });
        }
        (found, _) if volts.is_some() => {
            let scale = volts.map_or_else(String::new, |(_, scale)| scale.to_string());
            let place = Place::cell(path, line, &column.header);
            return Err(MeasurementError::WrongSensitivity { place, kind, scale, found });
        }
        (_, RecordKind::HornTip) => {
            return Err(wrong(path, line, column, value_unit, ("a displacement or a velocity", kind), "--column"));
        }
        (_, RecordKind::Vibrometer) => {
            return Err(wrong(path, line, column, value_unit, ("a velocity", kind), "--column"));
        }
        (_, RecordKind::Hydrophone) => {
            return Err(wrong(path, line, column, value_unit, ("a pressure", kind), "--column"));
        }
    }
    Ok(Chosen { time, value, time_factor, value_unit, volts })
}

fn choose_value(
    path: &Path,
    line: u64,
    columns: &[Column],
    time: Option<usize>,
    kind: RecordKind,
    options: &ReadOptions,
    stated: Option<Sensitivity>,
) -> Result<usize, MeasurementError> {
    let others = |accept: &dyn Fn(&Column) -> bool| -> Vec<usize> {
        let named = |column: &Column| !column.header.is_empty() && accept(column);
        positions(columns, named).into_iter().filter(|&i| Some(i) != time).collect()
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
        found = others(&|column| column.unit.is_none());
    }
    if found.is_empty() {
        found = others(&|column| column.unit.as_ref().is_some_and(Result::is_err) && column.is_named(names(kind)));
    }
    if found.is_empty() {
        found = others(&|column| column.dimension() == Some(Dimension::VOLTAGE));
    }
    let named = columns.iter().filter(|column| !column.header.is_empty()).count();
    if found.is_empty() && named == 1 + usize::from(time.is_some()) {
        found = others(&|_| true);
    }
    match found[..] {
        [only] => Ok(only),
        [] => Err(MeasurementError::NoQuantity {
            place: Place::line(path, line),
            kind,
            columns: columns.iter().map(|column| column.header.clone()).collect(),
        }),
        _ => Err(MeasurementError::Ambiguous {
            place: Place::line(path, line),
            flag: "--column",
            candidates: found.iter().map(|&i| columns[i].header.clone()).collect(),
        }),
    }
}

fn positions(columns: &[Column], accept: impl Fn(&Column) -> bool) -> Vec<usize> {
    columns.iter().enumerate().filter(|(_, column)| accept(column)).map(|(i, _)| i).collect()
}

/// The column that a flag names: its whole header, else the name part of it, else its number from 1.
fn find(
    path: &Path,
    line: u64,
    columns: &[Column],
    wanted: &str,
    flag: &'static str,
) -> Result<usize, MeasurementError> {
    let same = |a: &str| a.trim().to_lowercase() == wanted.trim().to_lowercase();
    if let Some(i) = columns.iter().position(|column| same(&column.header)) {
        return Ok(i);
    }
    if let [only] = positions(columns, |column| same(&column.name))[..] {
        return Ok(only);
    }
    match wanted.trim().parse::<usize>() {
        Ok(number) if (1..=columns.len()).contains(&number) => Ok(number - 1),
        _ => Err(MeasurementError::NoSuchColumn {
            place: Place::line(path, line),
            flag,
            wanted: wanted.into(),
            columns: columns.iter().map(|column| column.header.clone()).collect(),
        }),
    }
}

fn unit_of(
    path: &Path,
    line: u64,
    column: &Column,
    example: &'static str,
    flag: &'static str,
) -> Result<Unit, MeasurementError> {
    match &column.unit {
        Some(Ok(unit)) => Ok(*unit),
        Some(Err(source)) => Err(MeasurementError::UnknownUnit {
            place: Place::cell(path, line, &column.header),
            flag,
            source: source.clone(),
        }),
        None => Err(MeasurementError::NoUnit { place: Place::cell(path, line, &column.header), example, flag }),
    }
}

fn wrong(
    path: &Path,
    line: u64,
    column: &Column,
    unit: Unit,
    (expected, kind): (&'static str, RecordKind),
    flag: &'static str,
) -> MeasurementError {
    MeasurementError::WrongQuantity {
        place: Place::cell(path, line, &column.header),
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
