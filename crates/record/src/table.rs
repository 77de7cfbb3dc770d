//! Reader of tables: bytes → two columns of numbers in SI, with the line of every error.
//!
//! Text in any [`encoding`](super::encoding) and [`dialect`](super::dialect), below the preamble of an instrument or not,
//! lines ended by LF or CR LF. Lines that begin with `#` are comments and are kept. The first other line is the header; a
//! line of units may follow it. Blank lines are passed over. Memory: the file itself and 16 bytes a row.

use std::{borrow::Cow, path::Path};

use csv::{ByteRecord, ReaderBuilder};

use super::{
    Delimiter, MeasurementError, Place, ReadOptions, RecordKind, Sensitivity, binary, clock,
    column::{Chosen, Column, is_counter},
    decimal::{self, Exact, number},
    dialect::{self, Dialect},
    encoding::{self, Decoded, Encoding},
    header,
    names::{Header, counts, has_numbers, rises},
    place::SampleLines,
    preamble::{self, Preamble},
    remedy::{choose_or_propose, listed},
    samples::{BRIDGED, Gap, Taking},
    sampling, separated,
    universal::{self, UniversalText},
};
use granchain_signal::number::time;

/// Lines shown by `inspect`, and letters of each.
const FIRST_LINES: usize = 6;
const LONGEST_LINE: usize = 160;
/// Most letters of a column name.
const LONGEST_NAME: usize = 1000;
/// Most columns of a table.
const MOST_COLUMNS: usize = 1000;
const MOST_COMMENTS: usize = 10_000;

/// Content of a record file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    pub form: Form,
    /// The first lines that are no comments.
    pub first_lines: Vec<String>,
    /// Comment lines without the `#`.
    pub comments: Vec<String>,
    pub columns: Vec<Column>,
    pub chosen: Chosen,
    /// Times, s; empty if `grid` gives them.
    pub times: Vec<f64>,
    /// Time subtracted from all `times` (as written, and in s) if a double cannot hold them: seconds since 1970.
    pub origin: Option<(Exact, f64)>,
    /// First instant and step (s) of rows without a time.
    pub grid: Option<(f64, f64)>,
    /// Sample interval that comments state, s.
    pub stated_step: Option<f64>,
    /// Unit of the last digit of uneven instants, s; 0 if they are even, or if unknown.
    pub digit: f64,
    pub values: Vec<f64>,
    /// Line of each sample, if the file has lines.
    pub lines: SampleLines,
    pub bridged: usize,
    /// Rows without a value at either end, which are left out.
    pub blank_ends: usize,
    /// Assumptions and warnings about the instants.
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
    /// Whether the last line has no line end.
    pub open_end: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Form {
    Text(Box<TextForm>),
    Universal(Box<UniversalText>),
}

impl Form {
    pub(super) fn text(&self) -> Option<&TextForm> {
        match self {
            Self::Text(form) => Some(form),
            Self::Universal(_) => None,
        }
    }

    pub(super) fn preamble(&self) -> Option<&Preamble> {
        self.text().and_then(|form| form.preamble.as_ref())
    }
}

/// Format of a table of text.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TextForm {
    pub encoding: Encoding,
    /// Line and byte of the first character that is not UTF-8.
    pub foreign: Option<(u64, u8)>,
    pub dialect: Dialect,
    pub preamble: Option<Preamble>,
    /// Line of the header; `None` if there was none.
    pub header_line: Option<u64>,
    /// Line of the units row, if there was one.
    pub units_line: Option<u64>,
    /// Whether every row ends with a delimiter.
    pub trailing: bool,
    /// Number of the segment read, and of all segments.
    pub segment: Option<(usize, usize)>,
    /// Whether runs of blanks separate the cells.
    pub blanks: bool,
}

/// A row of cells and its line.
pub(super) struct Rows<'a> {
    pub bytes: &'a [u8],
    pub reader: csv::Reader<&'a [u8]>,
    pub record: ByteRecord,
    counted_to: usize,
    pub line: u64,
    /// Whether empty rows count: without a time column they are instants.
    blanks_count: bool,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(bytes: &'a [u8], first: u64, delimiter: Delimiter) -> Self {
        let mut builder = ReaderBuilder::new();
        builder.has_headers(false).flexible(true).comment(Some(b'#')).delimiter(delimiter.byte());
        let reader = builder.from_reader(bytes);
        Self { bytes, reader, record: ByteRecord::new(), counted_to: 0, line: first, blanks_count: false }
    }

    /// Read the next row that is not blank; false at the end.
    pub(crate) fn advance(&mut self) -> bool {
        // Reading from memory with flexible rows has nothing to fail at.
        while matches!(self.reader.read_byte_record(&mut self.record), Ok(true)) {
            // The byte after the row is known, the line is counted from it: comments and blank lines have been passed over.
            let end = usize::try_from(self.reader.position().byte()).unwrap_or(usize::MAX).min(self.bytes.len());
            let last = end.saturating_sub(1).max(self.counted_to);
            self.line += self.bytes[self.counted_to..last].iter().filter(|&&byte| byte == b'\n').count() as u64;
            self.counted_to = last;
            let counts = self.blanks_count && self.record.len() > 1;
            if counts || self.record.iter().any(|cell| !cell.trim_ascii().is_empty()) {
                return true;
            }
        }
        false
    }

    /// The cells of a header, cut to the longest name.
    pub(crate) fn cells(&self) -> Vec<String> {
        self.record.iter().map(|cell| shortened(text(cell), LONGEST_NAME)).collect()
    }

    /// Whether this row is the last line and the file ends within it.
    pub(super) fn is_cut(&self) -> bool {
        self.reader.position().byte() as usize >= self.bytes.len() && open_end(self.bytes)
    }
}

/// A cell of the current row.
pub(super) fn text_of<'a>(rows: &'a Rows<'_>, column: usize) -> &'a str {
    text(rows.record.get(column).unwrap_or_default())
}

fn open_end(bytes: &[u8]) -> bool {
    !matches!(bytes.last(), Some(b'\n' | b'\r') | None)
}

pub(super) fn text(cell: &[u8]) -> &str {
    // The whole input is UTF-8, and delimiters and quotes never split a character.
    std::str::from_utf8(cell).unwrap_or_default().trim()
}

pub(super) fn is_missing(cell: &str) -> bool {
    // Nearly every cell begins like a number: the rest is looked at letter by letter.
    if cell.starts_with(|letter: char| letter.is_ascii_digit()) {
        return false;
    }
    ["", "n/a", "na", "nan", "-nan", "+nan", "-", "--", "null", "none", "missing"]
        .iter()
        .any(|word| cell.eq_ignore_ascii_case(word))
}

/// The columns of a table of text according to its first bytes; `bytes` end with a line.
pub(super) fn columns(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Column>, MeasurementError> {
    let text = plain(encoding::decode(path, bytes)?.text);
    let preamble = preamble::recognise(path, &text, options.dataset)?;
    let from = preamble.as_ref().map_or(0, |preamble| preamble.body);
    let body = separated::by_tabs(text.get(from..).unwrap_or_default(), options);
    let dialect = dialect::detect(path, &body, 1, options)?;
    let mut rows = Rows::new(body.as_bytes(), 1, dialect.delimiter);
    rows.advance();
    Ok(Header::read(path, &mut rows, preamble.as_ref(), dialect, options)?.columns)
}

fn plain(text: Cow<'_, str>) -> Cow<'_, str> {
    let text = separated::with_hyphens(separated::with_line_ends(text));
    let text = separated::with_comment_signs(separated::without_excel_line(text));
    separated::without_blanks_before_quotes(text)
}

/// Read the columns that `options` and the header choose.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    kind: impl Into<Option<RecordKind>>,
    options: &ReadOptions,
) -> Result<(Table, RecordKind), MeasurementError> {
    let kind = kind.into();
    if let Some(found) = binary::read(path, bytes, kind, options) {
        return found;
    }
    let lines = separated::with_line_feeds(bytes);
    if universal::is_universal(&lines) {
        return universal::read(path, &lines, kind, options);
    }
    let Decoded { text, encoding, foreign, padding } = encoding::decode(path, bytes)?;
    let text = plain(text);
    let preamble = preamble::recognise(path, &text, options.dataset)?;
    let (from, first_line) = preamble.as_ref().map_or((0, 1), |it| (it.body, it.body_line.max(1)));
    let until = preamble.as_ref().and_then(|it| it.end).unwrap_or(text.len());
    let body = separated::by_tabs(text.get(from..until).unwrap_or_default(), options);
    let blanks = matches!(body, Cow::Owned(_));
    let body = body.as_ref();
    let dialect = dialect::detect(path, body, first_line, options)?;
    let comments = text.lines().filter_map(|line| line.strip_prefix('#')).take(MOST_COMMENTS);
    let comments: Vec<String> = comments.map(|comment| comment.trim_start_matches('#').trim().to_owned()).collect();
    let stated = header::stated(&comments).sensitivity;

    let first_lines = text.lines().filter(|line| !line.starts_with('#')).take(FIRST_LINES);
    let first_lines = first_lines.map(|line| shortened(line, LONGEST_LINE)).collect();

    let blocks = separated::blocks(body, dialect, first_line);
    let whole = body.as_bytes();
    refuse_rows(path, body, first_line, dialect)?;
    refuse_width(path, whole, first_line, dialect.delimiter)?;
    let several = blocks.len() > 1;
    let bytes = match (&blocks[..], options.dataset) {
        ([first, _, ..], Some(_)) => &whole[..first.to],
        _ => whole,
    };
    let mut rows = Rows::new(bytes, first_line, dialect.delimiter);
    if !rows.advance() {
        return Err(MeasurementError::Empty { path: path.into() });
    }
    let header = Header::read(path, &mut rows, preamble.as_ref(), dialect, options)?;
    let Header { mut columns, line: header_line, units_line, commented, bare } = header;
    let kind = kind.unwrap_or_else(|| guess_kind(path, &columns, options, stated));
    let header_at = units_line.or(header_line).unwrap_or(rows.line);
    let grid = preamble.as_ref().and_then(|preamble| preamble.grid);
    let grid = grid.or_else(|| options.sample_rate.map(|rate| (0.0, 1.0 / rate)));
    // A first column that rises without a name is rather the time; names say that it counts.
    let untimed = columns.len() == 1
        || !rises(&rows, dialect, 0)
        || columns.first().is_some_and(|it| is_counter(&it.name)) && counts(&rows, dialect);
    let lines = comments.iter().chain(preamble.iter().flat_map(|it| &it.statements));
    let stated_step = sampling::agreed(header::sample_intervals(lines)).map(|step| step.map(|(_, step)| step));
    let clocks = preamble.as_ref().map_or(&[][..], |preamble| &preamble.clocks);
    let by_lines = grid.is_none() && untimed && stated_step != Ok(None);
    let timed = grid.is_some() || by_lines || clocks.iter().any(Option::is_some);
    let place = Place::line(path, header_at);
    let likely = |columns: &[Column]| {
        // A first column that rises, or the second beside a counter; of pairs the one beside the value, where it rises too.
        let is_open = |at: usize| columns[at].unit.is_none() && !is_counter(&columns[at].name);
        let value = options.column.as_ref().and_then(|wanted| columns.iter().position(|it| it.header == *wanted));
        let beside = value.and_then(|at| at.checked_sub(1)).filter(|at| at % 2 == 0);
        let second = (columns.len() > 2 && counts(&rows, dialect)).then_some(1);
        let mut likely = beside.into_iter().chain(second).chain([0]);
        let found = likely.find(|&at| columns.len() > 1 && is_open(at) && rises(&rows, dialect, at));
        found.map(|at| (at, "UNIT"))
    };
    let chosen = choose_or_propose(&place, &mut columns, kind, options, timed, stated, likely);
    let mut chosen =
        chosen.map_err(|error| if has_numbers(&rows, dialect) { error } else { MeasurementError::NoRows { place } })?;
    let own = clocks.get(chosen.value).copied().flatten();
    if own.is_some() {
        chosen.time = None;
    }
    let refused = |text| MeasurementError::Instrument { path: path.into(), text };
    let by_lines = by_lines && chosen.time.is_none() && own.is_none();
    let header_step = if by_lines { stated_step.clone().map_err(refused)? } else { None };
    let grid = own.or(grid).or(header_step.map(|step| (0.0, step)));

    let counter = preamble.as_ref().and_then(|preamble| preamble.counter).filter(|it| chosen.time == Some(it.0));
    if let Some((_, _, step)) = counter {
        chosen.time_factor *= step;
    }
    let mut segment = None;
    let mut passed_over = 0;
    if let Some((count, size)) = preamble.as_ref().and_then(|preamble| preamble.segments).filter(|it| it.0 > 1) {
        match options.dataset {
            Some(wanted) if (1..=count).contains(&wanted) => {
                segment = Some((wanted, count));
                passed_over = (wanted - 1).saturating_mul(size);
            }
            wanted => {
                return Err(MeasurementError::Segments {
                    place: Place::line(path, 2),
                    count,
                    size: Some(size),
                    wanted,
                });
            }
        }
    } else if several {
        let count = blocks.len();
        let refused =
            |wanted| MeasurementError::Segments { place: Place::line(path, blocks[1].line), count, size: None, wanted };
        match options.dataset {
            Some(wanted) if (1..=count).contains(&wanted) => {
                segment = Some((wanted, count));
                if wanted > 1 {
                    let block = &blocks[wanted - 1];
                    rows = Rows::new(&whole[block.from..block.to], block.line, dialect.delimiter);
                    rows.advance();
                }
            }
            // Where instants run on through the comments it is one record.
            None if chosen.time.is_some() => {}
            wanted => return Err(refused(wanted)),
        }
    } else if let Some(chosen) = preamble.as_ref().and_then(|preamble| preamble.segment) {
        segment = Some(chosen);
    } else if let Some(wanted) = options.dataset.filter(|wanted| *wanted != 1) {
        return Err(MeasurementError::NoDatasets { path: path.into(), wanted });
    }
    let longest = match (segment, preamble.as_ref().and_then(|preamble| preamble.segments)) {
        (Some(_), Some((_, size))) => size,
        _ => usize::MAX,
    };

    let remarks = preamble.as_ref().is_some_and(|preamble| preamble.remarks)
        || bare.iter().any(|name| name.eq_ignore_ascii_case("comment"));
    // Some rows end with delimiters, some are filled up to the width of a longer header.
    let beyond = rows.record.iter().skip(columns.len());
    let trailing = rows.record.len() > columns.len() && beyond.into_iter().all(|cell| cell.trim_ascii().is_empty());
    // As many samples as lines; what is reserved is at most twice the file for each of time and value.
    let rows_at_most = 1 + bytes.iter().filter(|&&byte| byte == b'\n').count();
    let expected = rows_at_most.min(bytes.len() / 4).min(longest);
    let mut table = Table {
        form: Form::Text(Box::new(TextForm {
            encoding,
            foreign,
            dialect,
            preamble,
            header_line,
            units_line,
            trailing,
            segment,
            blanks,
        })),
        first_lines,
        comments,
        columns,
        times: Vec::with_capacity(if chosen.time.is_some() { expected } else { 0 }),
        origin: None,
        grid: grid.filter(|_| chosen.time.is_none()),
        digit: 0.0,
        stated_step: stated_step.unwrap_or_default(),
        chosen,
        values: Vec::with_capacity(expected),
        lines: SampleLines::default(),
        bridged: 0,
        blank_ends: 0,
        assumptions: commented.then(|| "the comment above the rows is their header".to_owned()).into_iter().collect(),
        warnings: Vec::new(),
        open_end: open_end(whole),
    };
    if padding > 0 {
        let text = format!(
            "{padding} bytes of padding (NUL or Ctrl-Z) at the end are passed over: was the transfer complete?"
        );
        table.warnings.push(text);
    }
    if let Some(step) = header_step {
        table
            .assumptions
            .push(format!("one sample every {}, as the lines above the rows state; the first at 0", time(step)));
    }
    if let Some((start, step)) = own {
        let name = &table.columns[table.chosen.value].header;
        let text = format!(
            "instants from the clock that the preamble states of `{name}`: {} and every {}",
            time(start),
            time(step)
        );
        table.assumptions.push(text);
    }
    if !bare.is_empty() {
        table.assumptions.push(format!("{} at the end of the header: without cells, passed over", listed(&bare)));
    }
    rows.blanks_count = table.chosen.time.is_none();
    let sparse = table.is_sparse(&rows, dialect);
    let taking = Taking { path, dialect, trailing, missing: options.missing, remarks };
    let (mut gap, mut pending, mut row) = (Gap::default(), true, 0);
    while pending && row < passed_over.saturating_add(longest) {
        if row >= passed_over && table.is_over(&rows, dialect) {
            let line = rows.line;
            let found = shortened(text_of(&rows, 0), LONGEST_NAME);
            table
                .warnings
                .push(format!("the rows end above line {line} (`{found}`): what stands from there on is passed over"));
            break;
        }
        if row >= passed_over && !(sparse && text_of(&rows, table.chosen.value).is_empty()) {
            table.take(&taking, &rows, &mut gap).map_err(|error| match error {
                MeasurementError::TimeNotIncreasing { .. } if several => MeasurementError::Segments {
                    place: Place::line(path, blocks[1].line),
                    count: blocks.len(),
                    size: None,
                    wanted: None,
                },
                error => error,
            })?;
        }
        row += 1;
        pending = rows.advance();
    }
    // A memory that does not fill the screen leaves values blank at its ends.
    let ended = gap.times.len();
    if ended > 0 && gap.blank == ended {
        table.blank_ends += ended;
    } else if ended > 0 {
        let place = table.cell(path, gap.line, table.chosen.value);
        return Err(MeasurementError::GapTooLong { place, found: ended, limit: BRIDGED });
    }
    if let Some((_, start, _)) = counter {
        table.times.iter_mut().for_each(|time| *time += start);
    }
    if let Some(announced) = table.form.preamble().and_then(|preamble| preamble.points) {
        let found = table.values.len();
        if found > announced && found.is_multiple_of(announced.max(1)) {
            return Err(MeasurementError::MoreThanAnnounced { place: Place::file(path), announced, found });
        }
    }
    let lines = table.lines.clone();
    table.settle_times(path, gap.standing, options, |column| {
        let mut rows = Rows::new(whole, first_line, dialect.delimiter);
        let mut digits = decimal::LastDigits::default();
        let mut taken = 0;
        while rows.advance() {
            // Other rows stand in other segments, or below the record.
            while lines.get(taken).is_some_and(|line| line < rows.line) {
                taken += 1;
            }
            if lines.get(taken) == Some(rows.line) {
                digits.add(clock::seconds(text_of(&rows, column)), dialect.decimal);
            }
        }
        digits.units()
    })?;
    Ok((table, kind))
}

impl Table {
    /// Whether a channel has a cell in every second, third … row, as one recorded beside a faster one.
    fn is_sparse(&mut self, rows: &Rows<'_>, dialect: Dialect) -> bool {
        const STRIDE: usize = 64;
        let from = usize::try_from(rows.reader.position().byte()).unwrap_or(usize::MAX).min(rows.bytes.len());
        let mut below = Rows::new(&rows.bytes[from..], rows.line, dialect.delimiter);
        let mut filled = vec![!text_of(rows, self.chosen.value).is_empty()];
        let mut is_open = |most: usize, filled: &mut Vec<bool>| {
            while filled.len() < most && below.advance() {
                filled.push(!text_of(&below, self.chosen.value).is_empty());
            }
        };
        is_open(STRIDE, &mut filled);
        if self.chosen.time.is_none() || filled.iter().all(|it| *it) {
            return false;
        }
        is_open(usize::MAX, &mut filled);
        let at: Vec<usize> = filled.iter().enumerate().filter(|(_, it)| **it).map(|(at, _)| at).collect();
        let steps = at.windows(2).map(|pair| pair[1] - pair[0]);
        let stride = steps.clone().next().unwrap_or(1);
        let sparse = at.len() >= sampling::FEWEST && stride > 1 && steps.clone().all(|step| step == stride);
        if sparse {
            let name = &self.columns[self.chosen.value].header;
            self.assumptions
                .push(format!("`{name}` has a cell in one of {stride} rows: the others are no samples of it"));
        }
        sparse
    }

    /// Whether the record ends at a row of words, before text or another table with its own header. If rows below
    /// continue in time, the row is a wrong cell of the same table; a repeated header starts another record.
    fn is_over(&self, rows: &Rows<'_>, dialect: Dialect) -> bool {
        let Some(time) = self.chosen.time else { return false };
        // Keys may stand beside the rows.
        let first = text_of(rows, time);
        let is_word = |cell: &str| cell.starts_with(char::is_alphabetic) && !is_missing(cell);
        if self.values.len() < sampling::FEWEST || !is_word(first) || number(first, dialect.decimal).is_some() {
            return false;
        }
        let same = |(at, cell): (usize, &[u8])| self.columns.get(at).is_some_and(|column| column.header == text(cell));
        if rows.record.iter().enumerate().all(same) || rows.is_cut() {
            return false;
        }
        let from = usize::try_from(rows.reader.position().byte()).unwrap_or(usize::MAX).min(rows.bytes.len());
        let mut below = Rows::new(&rows.bytes[from..], rows.line, dialect.delimiter);
        let is_row = |row: &Rows<'_>| {
            row.record.len() >= self.columns.len()
                && row.record.iter().all(|cell| number(text(cell), dialect.decimal).is_some())
        };
        let mut words = 1;
        while below.advance() {
            if is_row(&below) {
                let instant =
                    number(text_of(&below, time), dialect.decimal).map_or(f64::NAN, |it| it * self.chosen.time_factor);
                // A header and its units, or instants that begin again.
                return words > 1 || self.times.last().is_some_and(|last| instant <= last + self.origin());
            }
            words += 1;
        }
        true
    }
}

pub(super) fn shortened(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// Refuses a line of numbers for each channel.
fn refuse_rows(path: &Path, body: &str, first: u64, dialect: Dialect) -> Result<(), MeasurementError> {
    const WIDEST: usize = 32;
    let says = |(line, _): &(&str, u64)| !line.starts_with('#') && !line.trim().is_empty();
    let mut lines = body.lines().zip(first..).filter(says);
    let Some((line, at)) = lines.next() else { return Ok(()) };
    let mut cells = line.split(dialect.delimiter.character());
    let width = cells.clone().count();
    let others = cells.by_ref().skip(1).filter(|cell| !is_missing(cell.trim()));
    let is_row = width > WIDEST && others.into_iter().all(|cell| number(cell.trim(), dialect.decimal).is_some());
    if is_row && 4 * (1 + lines.count()) <= width {
        return Err(MeasurementError::Transposed { place: Place::line(path, at), found: width });
    }
    Ok(())
}

/// Refuses lines with too many cells before memory is allocated for them.
fn refuse_width(path: &Path, bytes: &[u8], first: u64, delimiter: Delimiter) -> Result<(), MeasurementError> {
    let long = bytes.split(|&byte| byte == b'\n').zip(first..).filter(|(line, _)| line.len() > MOST_COLUMNS);
    for (line, number) in long {
        let found = 1 + line.iter().filter(|&&byte| byte == delimiter.byte()).count();
        if found > MOST_COLUMNS {
            let place = Place::line(path, number);
            return Err(MeasurementError::TooManyColumns { place, limit: MOST_COLUMNS, found });
        }
    }
    Ok(())
}

/// A record of unstated kind is a horn-tip record if its name says so or if it holds a displacement and no velocity,
/// and a hydrophone record if its name says so or if it holds a pressure and no motion.
pub(super) fn guess_kind(
    path: &Path,
    columns: &[Column],
    options: &ReadOptions,
    stated: Option<Sensitivity>,
) -> RecordKind {
    use granchain_signal::Dimension;
    let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    // `multiple` has a tip within.
    let mut words = name.split(|letter: char| !letter.is_alphabetic());
    let named_horn =
        name.contains("horn") || words.any(|word| ["tip", "drive"].iter().any(|hint| word.starts_with(hint)));
    let named_hydrophone = name.contains("hydrophone") || name.contains("pressure");
    let has = |wanted| columns.iter().any(|column| column.dimension() == Some(wanted));
    // A sensitivity that the file states is for volts; a file of another unit may state it as a remark.
    let of_volts =
        stated.filter(|_| ![Dimension::VELOCITY, Dimension::LENGTH, Dimension::PRESSURE].iter().any(|it| has(*it)));
    if let Some(scale) = options.scale.or(of_volts) {
        return match scale.dimension() {
            Dimension::PRESSURE => RecordKind::Hydrophone,
            Dimension::LENGTH => RecordKind::HornTip,
            _ if named_horn => RecordKind::HornTip,
            _ => RecordKind::Vibrometer,
        };
    }
    let flag = options.unit.as_deref().and_then(|unit| super::column::parse_unit(unit).ok()).map(|unit| unit.dimension);
    let displacement = match flag {
        Some(dimension) => dimension == Dimension::LENGTH,
        None => has(Dimension::LENGTH) && !has(Dimension::VELOCITY),
    };
    let motion = has(Dimension::VELOCITY) || has(Dimension::LENGTH);
    let pressure = match flag {
        Some(dimension) => dimension == Dimension::PRESSURE,
        None => !motion && (has(Dimension::PRESSURE) || named_hydrophone),
    };
    if pressure {
        RecordKind::Hydrophone
    } else if named_horn || displacement {
        RecordKind::HornTip
    } else {
        RecordKind::Vibrometer
    }
}
