//! From a universal file to a table of two columns.

use std::path::Path;

use granchain_signal::{Dimension, Unit};

use super::{
    super::{
        MeasurementError, Place, ReadOptions, RecordKind,
        column::{Chosen, Column, choose, parse_unit},
        place::SampleLines,
        table::{Form, Table, guess_kind},
    },
    ByteOrder, Precision, UniversalError,
    block::{Axis, Binary, Cursor, Head, is_mark, length_factor, text},
    number::Numbers,
};

/// How a universal file is written, and what was assumed and suspected on reading it.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct UniversalText {
    pub written: String,
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
}

/// Whether `bytes` begin with a line `    -1` and the number of a data set.
pub(in super::super) fn is_universal(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut cursor = Cursor { at: 0, line: 1 };
    while let Some((line, _)) = cursor.next_line(bytes) {
        if line.trim_ascii().is_empty() {
            continue;
        }
        // A table may begin with the number -1, but not behind spaces and above a bare whole number.
        let set = cursor.next_line(bytes).map(|(line, _)| text(line).trim().to_owned()).unwrap_or_default();
        let digits = set.bytes().take_while(u8::is_ascii_digit).count();
        let rest = &set[digits..];
        return is_mark(line)
            && line.first() == Some(&b' ')
            && (1..=5).contains(&digits)
            && (rest.is_empty() || rest.starts_with(['b', 'B', ' ']));
    }
    false
}

/// The functions of a file, and the last statement of units before each.
struct Functions {
    heads: Vec<(Head, Option<f64>)>,
    /// Numbers of the other data sets.
    others: Vec<String>,
}

/// Most functions and other data sets that are kept.
const MOST: usize = 100_000;

fn functions(path: &Path, bytes: &[u8]) -> Result<Functions, UniversalError> {
    let mut cursor = Cursor { at: 0, line: 1 };
    let mut found = Functions { heads: Vec::new(), others: Vec::new() };
    let mut units = None;
    while let Some((line, _)) = cursor.next_line(bytes) {
        if !is_mark(line) {
            continue;
        }
        let Some((id, number)) = cursor.next_line(bytes) else { break };
        let id = text(id);
        let word = id.split_whitespace().next().unwrap_or_default().to_lowercase();
        if word == "58" || word == "58b" {
            let head = Head::read(path, bytes, &mut cursor, (&id, number))?;
            if head.binary.is_some() {
                let end = binary_span(path, bytes, &head)?.end;
                cursor.pass_over(bytes, end);
            }
            if found.heads.len() < MOST {
                found.heads.push((head, units));
            }
        } else {
            if word == "164" {
                units = length_factor(bytes, &mut cursor);
            }
            if found.others.len() < 20 && !found.others.contains(&word) {
                found.others.push(word);
            }
        }
        // To the mark that ends the data set.
        while let Some((line, _)) = cursor.next_line(bytes) {
            if is_mark(line) {
                break;
            }
        }
    }
    Ok(found)
}

/// Read the function that `options` choose, or the only one.
pub(in super::super) fn read(
    path: &Path,
    bytes: &[u8],
    kind: Option<RecordKind>,
    options: &ReadOptions,
) -> Result<(Table, RecordKind), MeasurementError> {
    let Functions { heads, others } = functions(path, bytes)?;
    let wanted = options.dataset;
    let several = heads.len() > 1;
    let in_time_alone =
        |(_, (head, _)): &(usize, &(Head, Option<f64>))| in_time(&Place::file(path), head, false).is_ok();
    let timed: Vec<usize> = heads.iter().enumerate().filter(in_time_alone).map(|(at, _)| at).collect();
    let at = match wanted {
        None if several && timed.is_empty() => {
            let (first, _) = &heads[0];
            return Err(UniversalError::Spectra {
                place: Place::file(path),
                count: heads.len(),
                first: first.described(1),
            }
            .into());
        }
        // The only one that is a record.
        None if several && timed.len() == 1 => timed[0],
        Some(number) if (1..=heads.len()).contains(&number) => number - 1,
        None if heads.len() == 1 => 0,
        _ if heads.is_empty() => {
            let found = match &others[..] {
                [] => "none".to_owned(),
                others => format!("the data sets {}", others.join(", ")),
            };
            return Err(UniversalError::NoFunction { place: Place::file(path), found }.into());
        }
        _ => {
            let described = heads.iter().zip(1..).take(50);
            let functions = described.map(|((head, _), number)| head.described(number)).collect();
            return Err(UniversalError::Several { place: Place::file(path), functions, wanted }.into());
        }
    };
    let (head, units) = &heads[at];
    let place = Place::line(path, head.line);
    in_time(&place, head, several)?;
    let mut form = UniversalText { written: String::new(), assumptions: Vec::new(), warnings: Vec::new() };
    form.written = written(head);
    if several || wanted.is_some() {
        form.assumptions.push(format!(
            "function {} of {} ({}): {}",
            at + 1,
            heads.len(),
            if wanted.is_some() { "dataset" } else { "the only one in time" },
            head.described(at + 1)
        ));
    }
    let numbers = match head.binary {
        Some(_) => binary_values(path, bytes, head, &mut form)?,
        None => text_values(path, bytes, head, &mut form)?,
    };
    let mut columns = vec![axis_column(&head.abscissa, "abscissa"), axis_column(&head.ordinate, "ordinate")];
    unit_of_time(&mut columns[0], head, &mut form);
    unit_of_ordinate(&place, &mut columns[1], head, *units, options, &mut form)?;
    let kind = kind.unwrap_or_else(|| guess_kind(path, &columns, options, None));
    // The columns are known, whatever their names.
    let known = ReadOptions { time_column: Some("1".into()), column: Some("2".into()), ..options.clone() };
    let chosen = choose(&place, &mut columns, kind, &known, false, None)?;
    let (times, values, grid) = scaled(path, head, &chosen, numbers)?;
    if let Some((_, step)) = grid {
        // Half a unit of the last digit, at the last sample.
        let decade = 10f64.powi(step.abs().log10().floor() as i32 + 1 - head.digits.clamp(1, 17) as i32);
        let late = 0.5 * decade * values.len() as f64;
        form.assumptions.push(format!(
            "the step stands in the file with {} digits: the last instant is known to {:.0e} s, {:.1e} of a step",
            head.digits,
            late,
            late / step
        ));
    }
    let table = Table {
        blank_ends: 0,
        assumptions: Vec::new(),
        warnings: Vec::new(),
        form: Form::Universal(Box::new(form)),
        first_lines: Vec::new(),
        comments: Vec::new(),
        columns,
        chosen,
        times,
        origin: None,
        grid,
        digit: 0.0,
        stated_step: None,
        values,
        lines: SampleLines::default(),
        bridged: 0,
        open_end: false,
    };
    Ok((table, kind))
}

fn written(head: &Head) -> String {
    let precision = if head.precision == Precision::Single { "single" } else { "double" };
    let spacing = if head.even { "even" } else { "uneven" };
    match head.binary {
        Some(Binary { order: ByteOrder::Little, .. }) => {
            format!("universal file, 58b, {precision}, little-endian, {spacing}")
        }
        Some(Binary { order: ByteOrder::Big, .. }) => {
            format!("universal file, 58b, {precision}, big-endian, {spacing}")
        }
        None => format!("universal file, 58, {precision}, {spacing}"),
    }
}

/// Quantities of an axis (specific data types).
const GENERAL: i64 = 1;
const DISPLACEMENT: i64 = 8;
const VELOCITY: i64 = 11;
const TIME: i64 = 17;

/// Refuse spectra, complex values, ratios.
fn in_time(place: &Place, head: &Head, several: bool) -> Result<(), UniversalError> {
    let found = if !matches!(head.function, 0 | 1) {
        format!("a function of type {} ({})", head.function, head.kind())
    } else if head.complex {
        "complex values".into()
    } else if !matches!(head.abscissa.quantity, 0 | GENERAL | TIME) {
        format!("an abscissa of quantity {}", head.abscissa.quantity)
    } else if !matches!(head.denominator.quantity, 0 | GENERAL) {
        format!("a ratio with a denominator of quantity {}", head.denominator.quantity)
    } else {
        return Ok(());
    };
    Err(UniversalError::NotInTime { place: place.clone(), found, several })
}

fn axis_column(axis: &Axis, name: &str) -> Column {
    let name = if axis.label.is_empty() { name } else { &axis.label };
    let mut column = Column { header: name.into(), name: name.into(), unit_text: None, unit: None };
    if !axis.unit.is_empty() {
        column.unit_text = Some(axis.unit.clone());
        column.unit = Some(parse_unit(&axis.unit));
    }
    column
}

/// Give a column the unit that its quantity stands for.
fn assume(column: &mut Column, unit: Unit, text: &str) {
    column.unit_text = Some(text.into());
    column.unit = Some(Ok(unit));
}

fn unit_of_time(column: &mut Column, head: &Head, form: &mut UniversalText) {
    if column.unit.is_none() && head.abscissa.quantity == TIME {
        assume(column, Unit { factor: 1.0, dimension: Dimension::TIME }, "s");
        form.assumptions.push("the abscissa has no unit label: quantity 17 (time) in s".into());
    }
}

/// The unit label, the quantity and data set 164 must say the same; `--unit` and `--scale` settle it.
fn unit_of_ordinate(
    place: &Place,
    column: &mut Column,
    head: &Head,
    units: Option<f64>,
    options: &ReadOptions,
    form: &mut UniversalText,
) -> Result<(), UniversalError> {
    let (dimension, name) = match head.ordinate.quantity {
        DISPLACEMENT => (Some(Dimension::LENGTH), "displacement"),
        VELOCITY => (Some(Dimension::VELOCITY), "velocity"),
        _ => (None, ""),
    };
    let quantity = head.ordinate.quantity;
    let [length, force, temperature] = head.ordinate.exponents;
    if quantity == GENERAL && (length, force, temperature) != (0, 0, 0) {
        form.assumptions.push(format!(
            "the ordinate is a general quantity with exponents {length} of length, {force} of force, {temperature} of \
             temperature; its unit is that of label or --unit"
        ));
    }
    if options.unit.is_some() {
        return Ok(());
    }
    let length_factor = units.map_or(1.0, |factor| 1.0 / factor);
    match (&column.unit, dimension) {
        (Some(Ok(label)), Some(dimension)) => {
            let first = format!("the label `{}`", head.ordinate.unit);
            if label.dimension != dimension {
                let second = format!("quantity {quantity} ({name})");
                return Err(UniversalError::MixedUnits { place: place.clone(), first, second });
            }
            if units.is_some() && !((label.factor - length_factor).abs() <= 1e-6 * length_factor) {
                let second = format!("lengths of {length_factor} m (data set 164)");
                return Err(UniversalError::MixedUnits { place: place.clone(), first, second });
            }
        }
        (None, Some(dimension)) => {
            let per = if dimension == Dimension::VELOCITY { "/s" } else { "" };
            let text = match units {
                Some(_) if length_factor != 1.0 => format!("{length_factor} m{per}"),
                _ => format!("m{per}"),
            };
            assume(column, Unit { factor: length_factor, dimension }, &text);
            let from = if units.is_some() { "data set 164" } else { "SI, as nothing else is stated" };
            form.assumptions
                .push(format!("the ordinate has no unit label: quantity {quantity} ({name}) in {text} ({from})"));
        }
        _ => {}
    }
    Ok(())
}

/// Times, values and even grid in SI.
type Scaled = (Vec<f64>, Vec<f64>, Option<(f64, f64)>);

fn scaled(path: &Path, head: &Head, chosen: &Chosen, mut numbers: Vec<f64>) -> Result<Scaled, MeasurementError> {
    let (factor, seconds) = (chosen.value_unit.factor, chosen.time_factor);
    if head.even {
        for value in &mut numbers {
            *value *= factor;
        }
        return Ok((Vec::new(), numbers, Some((head.start * seconds, head.step * seconds))));
    }
    let times: Vec<f64> = numbers.iter().step_by(2).map(|time| time * seconds).collect();
    if let Some(at) = times.windows(2).position(|pair| !(pair[1] > pair[0])) {
        let place = Place { line: Some(head.data_line), ..Place::cell(path, 0, "abscissa") };
        return Err(MeasurementError::TimeNotIncreasing { place, previous: times[at], found: times[at + 1] });
    }
    let values = numbers.iter().skip(1).step_by(2).map(|value| value * factor).collect();
    Ok((times, values, None))
}

/// Numbers of a function in time: one a value, two with its instant.
fn wanted(head: &Head) -> usize {
    head.count.saturating_mul(if head.even { 1 } else { 2 })
}

fn text_values(path: &Path, bytes: &[u8], head: &Head, form: &mut UniversalText) -> Result<Vec<f64>, UniversalError> {
    let wanted = wanted(head);
    let mut cursor = head.data;
    let mut values = Vec::with_capacity(wanted.min((bytes.len() - cursor.at) / 6));
    let mut padding = 0;
    let end = loop {
        let Some((line, number)) = cursor.next_line(bytes) else { break "the end of the file" };
        // The last value may be -1 too, but then values are still missing.
        if is_mark(line) && (values.len() >= wanted || line.starts_with(b"    -1")) {
            break "-1";
        }
        for value in Numbers::new(&text(line)) {
            let place = || Place::line(path, number);
            match value {
                Ok(_) if values.len() == wanted => padding += 1,
                Ok(value) if value.is_finite() => values.push(value),
                Ok(value) => return Err(UniversalError::Value { place: place(), found: value.to_string() }),
                Err(found) => {
                    return Err(UniversalError::Value { place: place(), found: found.chars().take(40).collect() });
                }
            }
        }
    };
    if end != "-1" && padding == 0 && bytes.last().is_some_and(|byte| !byte.is_ascii_whitespace() && *byte != 0) {
        // The last number may be cut as well.
        values.pop();
    }
    if values.len() < wanted {
        let place = Place::line(path, cursor.line.saturating_sub(1).max(1));
        return Err(UniversalError::Truncated { place, expected: wanted, found: values.len(), what: "values", end });
    }
    if padding > 0 {
        form.assumptions
            .push(format!("{padding} numbers behind the {wanted} announced fill the last lines and are passed over"));
    }
    if end != "-1" {
        form.warnings.push("the `-1` at the end is missing: the file was cut short behind the values".into());
    }
    Ok(values)
}

/// How the bytes of 58b are laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    /// Byte behind the values and what fills them up.
    end: usize,
    /// Bytes of an instant (0 without) and of a value.
    widths: (usize, usize),
    /// Whether a CR stands before every LF and has to go.
    swollen: bool,
    /// Whether the mark that ends the data set is there.
    closed: bool,
}

/// Most bytes of line ends, blanks and zeros between values and mark.
const MOST_FILL: usize = 32;

/// Whether behind `at` comes `-1` on a line, after line ends, blanks and zeros; or the end of the file.
fn closes(bytes: &[u8], at: usize) -> Option<bool> {
    let rest = bytes.get(at..)?;
    let fill = rest.iter().take(MOST_FILL).take_while(|byte| matches!(byte, b'\r' | b'\n' | b' ' | 0)).count();
    let rest = &rest[fill..];
    if rest.is_empty() {
        return Some(false);
    }
    let tail = rest.strip_prefix(b"-1")?;
    let line = tail.iter().position(|&byte| byte == b'\n').map_or(tail, |end| &tail[..end]);
    line.trim_ascii().is_empty().then_some(true)
}

/// The bytes of the values: as record 7 says, instants also in single precision or everything in double precision, as some
/// write them; as long as the identifier says, where more than the values stand there; or with a CR before every LF, as a
/// transfer as text leaves them. Whichever is followed by the mark.
fn binary_span(path: &Path, bytes: &[u8], head: &Head) -> Result<Span, UniversalError> {
    let width = match head.precision {
        Precision::Single => 4,
        Precision::Double => 8,
    };
    let parts = if head.complex { 2 } else { 1 };
    let instants: &[usize] = if head.even { &[0] } else { &[width, 4, 8] };
    let layouts = instants.iter().map(|&instant| (instant, width)).chain([(if head.even { 0 } else { 8 }, 8)]);
    let from = head.data.at;
    let long = |(instant, value): (usize, usize)| head.count.checked_mul(instant + parts * value);
    let announced = head.binary.map_or(0, |binary| binary.bytes);
    let mut open = None;
    for widths in layouts {
        let Some(length) = long(widths) else { continue };
        for length in [length, announced].into_iter().filter(|it| *it >= length) {
            let Some(end) = from.checked_add(length) else { continue };
            match closes(bytes, end) {
                Some(true) => return Ok(Span { end, widths, swollen: false, closed: true }),
                Some(false) if open.is_none() => open = Some(Span { end, widths, swollen: false, closed: false }),
                _ => {}
            }
        }
        if let Some(end) = unswollen_end(bytes, from, length).filter(|end| closes(bytes, *end) == Some(true)) {
            return Ok(Span { end, widths, swollen: true, closed: true });
        }
    }
    if let Some(span) = open {
        return Ok(span);
    }
    let expected = long((instants[0], width)).unwrap_or(usize::MAX);
    let found = bytes.len() - from;
    let place = Place::line(path, head.data_line);
    Err(if found < expected {
        UniversalError::Truncated { place, expected, found, what: "bytes of values", end: "the end of the file" }
    } else {
        UniversalError::Layout { place, expected }
    })
}

/// Where `length` bytes end that have been given a CR before every LF, if every LF has one and there is any.
fn unswollen_end(bytes: &[u8], from: usize, length: usize) -> Option<usize> {
    let (mut at, mut taken, mut removed) = (from, 0, 0);
    while taken < length {
        match bytes.get(at..)? {
            [b'\r', b'\n', ..] => {
                at += 2;
                removed += 1;
            }
            [b'\n', ..] | [] => return None,
            _ => at += 1,
        }
        taken += 1;
    }
    (removed > 0).then_some(at)
}

fn binary_values(path: &Path, bytes: &[u8], head: &Head, form: &mut UniversalText) -> Result<Vec<f64>, UniversalError> {
    let span = binary_span(path, bytes, head)?;
    let from = head.data.at;
    let whole;
    let data = if span.swollen {
        form.warnings.push(
            "the file was changed on its way as if it were text, with a CR before every LF; they were taken out again, but \
             transfer it as binary"
                .into(),
        );
        whole = without_inserted(&bytes[from..span.end]);
        &whole[..]
    } else {
        &bytes[from..span.end]
    };
    if !span.closed {
        form.warnings.push("the `-1` at the end is missing: the file was cut short behind the values".into());
    }
    let (instant, value) = span.widths;
    let needed = head.count * (instant + value);
    if data.len() > needed {
        form.assumptions
            .push(format!("{} bytes behind the values fill up the data and are passed over", data.len() - needed));
    }
    let declared = if head.precision == Precision::Single { 4 } else { 8 };
    if (!head.even && instant != declared) || value != declared {
        form.assumptions.push(format!(
            "values of {value} bytes{}, unlike what record 7 says, for so the data end at `-1`",
            if head.even { String::new() } else { format!(" and instants of {instant}") }
        ));
    }
    let order = head.binary.map_or(ByteOrder::Little, |binary| binary.order);
    let mut numbers = Vec::with_capacity(wanted(head));
    for record in data[..needed].chunks_exact(instant + value) {
        let (time, ordinate) = record.split_at(instant);
        for part in [time, ordinate].into_iter().filter(|part| !part.is_empty()) {
            let number = float(part, order);
            if !number.is_finite() {
                let place = Place::line(path, head.data_line);
                return Err(UniversalError::Value { place, found: number.to_string() });
            }
            numbers.push(number);
        }
    }
    Ok(numbers)
}

fn without_inserted(data: &[u8]) -> Vec<u8> {
    let mut plain = Vec::with_capacity(data.len());
    for (i, &byte) in data.iter().enumerate() {
        if !(byte == b'\r' && data.get(i + 1) == Some(&b'\n')) {
            plain.push(byte);
        }
    }
    plain
}

fn float(bytes: &[u8], order: ByteOrder) -> f64 {
    let little = order == ByteOrder::Little;
    if let Ok(four) = <[u8; 4]>::try_from(bytes) {
        f64::from(if little { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) })
    } else if let Ok(eight) = <[u8; 8]>::try_from(bytes) {
        if little { f64::from_le_bytes(eight) } else { f64::from_be_bytes(eight) }
    } else {
        f64::NAN
    }
}
