//! Which columns of a laboratory's table are read, in which unit, and what is refused with flags that work.

use std::path::Path;

use granchain_record::{
    DecimalSign, Delimiter, MeasurementError, ReadOptions, Record, RecordKind, Sensitivity, read_record_bytes,
};

const ROWS: u32 = 60;

/// Value of row `i`: a tone of ten samples a cycle with four decimals.
fn value(i: u32) -> f64 {
    (5e3 * (2.0 * std::f64::consts::PI * f64::from(i) / 10.0).sin()).round() / 1e4
}

/// A table of `header` and a line for every row.
fn table(header: &str, row: impl Fn(u32) -> String) -> String {
    (0..ROWS).fold(format!("{header}\n"), |text, i| text + &row(i) + "\n")
}

fn read(text: &str, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(Path::new("a.csv"), text.as_bytes(), Some(RecordKind::Vibrometer), options)
}

fn of_volts() -> ReadOptions {
    ReadOptions { scale: Some(Sensitivity::parse("1 m/s/V").unwrap()), ..ReadOptions::default() }
}

fn refused(text: &str, options: &ReadOptions) -> String {
    read(text, options).expect_err(text.lines().next().unwrap_or_default()).to_string()
}

/// Checks step and values of a record of `value`.
fn assert_reads(name: &str, record: &Record, step: f64, unit: f64) {
    assert!((record.raw.step / step - 1.0).abs() < 1e-6, "{name}: {}", record.raw.step);
    assert_eq!(record.raw.len(), ROWS as usize, "{name}");
    for (i, found) in (0..).zip(&record.raw.values) {
        assert!((found - value(i) * unit).abs() < 1e-9, "{name}: row {i}: {found}");
    }
}

#[test]
fn of_several_times_the_one_beside_the_channel_is_taken() {
    for (header, channel, unit) in [
        ("Time (s),CH1 (V),Time2 (s),CH2 (V)", "CH2 (V)", None),
        ("Time,CH1 (V),Time.1,CH2 (V)", "CH2 (V)", Some("s")),
        ("Time (s),CH1 (V),Time (s),CH2 (V)", "CH2 (V)", None),
        ("Time - Horn,Amplitude - Horn,Time - Bead,Amplitude - Bead", "Amplitude - Bead", Some("s")),
        ("t_s,Horn_V,t2_s,Bead_V", "Bead_V", None),
        ("time[0],Y[0],time[1],Y[1]", "Y[1]", Some("s")),
        ("No.,t_s,Horn_V,t2_s,Bead_V", "Bead_V", None),
    ] {
        let counter = if header.starts_with("No.") { "7," } else { "" };
        let text = table(header, |i| {
            let i_s = f64::from(i);
            format!("{counter}{:.7},{:.4},{:.7},{:.4}", 2e-7 * i_s, -value(i), 4e-7 * i_s - 2e-6, value(i))
        });
        let options = ReadOptions { column: Some(channel.into()), time_unit: unit.map(str::to_owned), ..of_volts() };
        let record = read(&text, &options).unwrap();
        assert_reads(header, &record, 4e-7, 1.0);
        assert!((record.raw.start + 2e-6).abs() < 1e-12, "{header}");
        let note = format!("is taken, the one beside `{channel}`");
        assert!(record.assumptions.iter().any(|text| text.contains(&note)), "{header}: {:?}", record.assumptions);
    }
    // The other channel keeps its own.
    let text = table("Time (s),CH1 (V),Time2 (s),CH2 (V)", |i| {
        format!("{:.7},{:.4},{:.7},0", 2e-7 * f64::from(i), value(i), 4e-7 * f64::from(i))
    });
    let options = ReadOptions { column: Some("CH1 (V)".into()), ..of_volts() };
    assert_reads("CH1", &read(&text, &options).unwrap(), 2e-7, 1.0);
    // Where the instants stand to the right, nothing says which.
    let text = table("CH1 (V),Time (s),CH2 (V),Time2 (s)", |i| {
        format!("{:.4},{:.7},{:.4},{:.7}", value(i), 2e-7 * f64::from(i), value(i), 4e-7 * f64::from(i))
    });
    let options = ReadOptions { column: Some("CH2 (V)".into()), ..of_volts() };
    let message = refused(&text, &options);
    assert!(message.contains("found 2: `Time (s)`, `Time2 (s)`; choose one with --read time_column=NAME"), "{message}");
    // Names that say nothing: the remedy is the column beside the channel.
    let text = table("/in X,/in Y,/out X,/out Y", |i| {
        format!("{:.7},{:.4},{:.7},{:.4}", 2e-7 * f64::from(i), value(i), 4e-7 * f64::from(i), value(i))
    });
    let options = ReadOptions { column: Some("/out Y".into()), unit: Some("m/s".into()), ..ReadOptions::default() };
    let remedy = read(&text, &options).unwrap_err().remedy().unwrap();
    assert_eq!(remedy, "--read 'time_column=/out X' --read time_unit=UNIT");
}

#[test]
fn one_column_of_decimal_commas_is_not_two_of_whole_numbers() {
    let comma = |i| format!("{:.4}", value(i)).replace('.', ",");
    let text = (0..ROWS).fold(String::new(), |text, i| text + &comma(i) + "\n");
    let message = refused(&text, &ReadOptions::default());
    for part in [
        "a.csv:1: expected a header or a decimal point, found `0,0000` and one comma in every row",
        "pass --read decimal=comma --sample-rate RATE --unit UNIT for one column",
        "--read delimiter=comma --sample-rate RATE --channel 1 --unit UNIT for two columns",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    // A column chosen by number does not say which.
    let sampled = ReadOptions { sample_rate: Some(5e6), unit: Some("m/s".into()), ..ReadOptions::default() };
    let chosen = ReadOptions { column: Some("1".into()), ..sampled.clone() };
    assert!(matches!(read(&text, &chosen), Err(MeasurementError::OneComma { .. })));
    let commas = ReadOptions { decimal: Some(DecimalSign::Comma), ..sampled.clone() };
    assert_reads("one column", &read(&text, &commas).unwrap(), 2e-7, 1.0);
    let two = ReadOptions { delimiter: Some(Delimiter::Comma), ..chosen };
    assert_eq!(read(&text, &two).unwrap().raw.values[2], 0.0);
    // Below a name it is one column.
    let named = format!("Velocity [m/s]\n{text}");
    let without = ReadOptions { sample_rate: Some(5e6), ..ReadOptions::default() };
    let message = refused(&named, &without);
    assert!(message.contains("for one column of decimal commas pass --read decimal=comma"), "{message}");
    let commas = ReadOptions { decimal: Some(DecimalSign::Comma), ..without };
    assert_reads("one name", &read(&named, &commas).unwrap(), 2e-7, 1.0);
    // Two names are two columns.
    let pair = table("time_us,velocity_mm_per_s", |i| format!("{i},{}", i % 7));
    let commas = ReadOptions { decimal: Some(DecimalSign::Comma), ..ReadOptions::default() };
    assert!((read(&pair, &commas).unwrap().raw.step - 1e-6).abs() < 1e-15);
    // Two columns whose times have their unit are two.
    let whole = (0..ROWS).fold(String::new(), |text, i| text + &format!("{i},{}\n", i % 7));
    let timed = ReadOptions { time_unit: Some("us".into()), unit: Some("mm/s".into()), ..ReadOptions::default() };
    assert!((read(&whole, &timed).unwrap().raw.step - 1e-6).abs() < 1e-15);
}

#[test]
fn an_input_is_no_inch_and_a_least_value_no_minute() {
    let rows = |i| format!("{:.7},{:.4},{:.4}", 2e-7 * f64::from(i), value(i) / 2.0, value(i));
    for header in ["Time (s),CH1 (in),CH2 (out)", "time_s,V(in),V(out)"] {
        let text = table(header, rows);
        let message = read_record_bytes(Path::new("a.csv"), text.as_bytes(), None, &ReadOptions::default());
        let message = message.expect_err(header).to_string();
        assert!(!message.contains("inch") && message.contains("--unit"), "{header}: {message}");
    }
    let text = table("Time (s),Displacement (in)", |i| format!("{:.7},{:.4}", 2e-7 * f64::from(i), value(i)));
    let record = read_record_bytes(Path::new("a.csv"), text.as_bytes(), None, &ReadOptions::default()).unwrap();
    assert!((record.raw.values[2] - 0.0254 * value(2)).abs() < 1e-12);
    for header in ["time_s,CH1_min,CH1_max", "Time (s),Min (V),Max (V)", "Time (s),CH1 max (V),CH1 min (V)"] {
        let message = refused(&table(header, rows), &of_volts());
        assert!(message.contains("found an envelope: `") && message.contains("record again without"), "{message}");
    }
    let minutes = table("Elapsed_min,velocity_mm_per_s", |i| format!("{i},{:.4}", value(i)));
    assert_reads("minutes", &read(&minutes, &ReadOptions::default()).unwrap(), 60.0, 1e-3);
}

#[test]
fn units_are_understood_in_the_spellings_of_laboratories() {
    for (header, step, unit) in [
        ("Time (uS),Velocity (mm/s)", 1e-6, 1e-3),
        ("Time(S),Velocity(mm/s)", 1.0, 1e-3),
        ("Time (mS),Velocity [m/sec]", 1e-3, 1.0),
        ("Time [microsec],vel_mm_s", 1e-6, 1e-3),
        ("micros,velocity_m_s", 1e-6, 1.0),
        ("Zeit (Mikrosekunden),vel_mmps", 1e-6, 1e-3),
        ("t_nsec,vel_um_s", 1e-9, 1e-6),
        ("Time-us,Velocity-mm/s", 1e-6, 1e-3),
        ("Time.us,Velocity.mm/s", 1e-6, 1e-3),
        ("t:s,v:m/s", 1.0, 1.0),
        ("Time - us,vel_mps", 1e-6, 1.0),
        ("TIME (US),VELOCITY (MM/S)", 1e-6, 1e-3),
        ("Time {us},Velocity <mm/s>", 1e-6, 1e-3),
        ("Time (us) rel,Velocity [mm/s] CH2", 1e-6, 1e-3),
    ] {
        let text = table(header, |i| format!("{i},{:.4}", value(i)));
        assert_reads(header, &read(&text, &ReadOptions::default()).unwrap(), step, unit);
    }
    let text = table("time_us,tip [microns]", |i| format!("{i},{:.4}", value(i)));
    let record = read_record_bytes(Path::new("a.csv"), text.as_bytes(), None, &ReadOptions::default()).unwrap();
    assert!((record.raw.values[2] - 1e-6 * value(2)).abs() < 1e-15);
    // Milliseconds may be meant, or metres a second.
    let text = table("time_us,velocity_ms", |i| format!("{i},{:.4}", value(i)));
    assert!(refused(&text, &ReadOptions::default()).contains("found the unit `ms` of a time"));
}

#[test]
fn the_name_of_a_file_says_the_kind_by_whole_words() {
    let text = table("time_us,velocity_mm_per_s", |i| format!("{i},{:.4}", value(i)));
    for (name, kind) in [
        ("multiple_shots.csv", RecordKind::Vibrometer),
        ("tip_3.csv", RecordKind::HornTip),
        ("FreeHorn.csv", RecordKind::HornTip),
    ] {
        let record = read_record_bytes(Path::new(name), text.as_bytes(), None, &ReadOptions::default());
        assert_eq!(record.unwrap().kind, kind, "{name}");
    }
}

#[test]
fn what_programs_write_around_a_table_is_understood() {
    let rows = |sep: &str| (0..ROWS).fold(String::new(), |text, i| text + &format!("{i}{sep}{:.4}\n", value(i)));
    let comma = |text: String| text.replace('.', ",");
    let plain = |header: &str| format!("{header}\n{}", rows(","));
    let quoted = comma(rows(".5;")).replace(';', "\",\"").replace('\n', "\"\n\"");
    for (name, text) in [
        ("sep=;", format!("sep=;\r\nZeit [µs];v [mm/s]\r\n{}", comma(rows(";")))),
        ("quoted sep", format!("\"sep=,\"\n{}", plain("X [us],Y [mm/s]"))),
        ("NULs", format!("{}\0\0\0\0", plain("time_us,velocity_mm_per_s"))),
        ("Ctrl-Z", format!("{}\x1a\r\n", plain("time_us,velocity_mm_per_s"))),
        ("blanks", format!("# time_us velocity_mm_per_s\n{}", rows(" "))),
        ("units in brackets", format!("# t [us]  v [mm/s]\n{}", rows(" "))),
        ("names of several words", format!("Time (us)  Laser 1 (mm/s)\n{}", rows(" "))),
        ("COMSOL", format!("% Time (us)    Velocity (mm/s)\n{}", rows("   "))),
        ("commas above tabs", format!("# t (us), v (mm/s)\n{}", rows("\t"))),
        ("blank row below units", comma(table("t;v\nus;mm/s\n;", |i| format!("{i}.0;{:.4}", value(i))))),
        ("dash", table("Time,Trigger,Velocity\nus,-,mm/s", |i| format!("{i},1,{:.4}", value(i)))),
        ("quoted", format!("\"Zeit (us)\",\"v (mm/s)\"\n\"{}", quoted.trim_end_matches('"'))),
        ("words", comma(table("Zeit (us);v (mm/s);Status", |i| format!("{i}.0;{:.4};ok", value(i))))),
    ] {
        let record = read(&text, &ReadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_reads(name, &record, 1e-6, 1e-3);
        let padded = record.warnings.iter().any(|text| text.contains("bytes of padding"));
        assert_eq!(padded, text.contains(['\0', '\x1a']), "{name}: {:?}", record.warnings);
    }
}

#[test]
fn decimal_commas_may_begin_after_a_quiet_lead() {
    let text = (0..200).fold("t [ns];v [mm/s]\n".to_owned(), |text, i| {
        text + &if i < 80 { format!("{};0\n", 200 * i) } else { format!("{};{},5\n", 200 * i, 1 + i % 9) }
    });
    let record = read(&text, &ReadOptions::default()).unwrap();
    assert!((record.raw.values[85] - 5.5e-3).abs() < 1e-12);
    // What may be thousands is still asked for.
    let grouped = text.replace(",5\n", ",567\n");
    assert!(matches!(read(&grouped, &ReadOptions::default()), Err(MeasurementError::AmbiguousNumber { .. })));
}

#[test]
fn times_of_day_are_instants_since_the_first() {
    for (name, header, step, at) in [
        ("clock", "Time,Velocity (mm/s)", 1e-6, "10:11:12."),
        ("ISO 8601", "timestamp,velocity_mm_per_s", 1e-6, "2019-11-21T10:11:12."),
        ("blank", "Time,velocity_mm_per_s", 1e-6, "2019-11-21 10:11:12."),
        ("American", "Scan,Time,v [mm/s]", 1e-6, "1,11/21/2019 10:11:12:"),
    ] {
        let zone = if name == "ISO 8601" { "Z" } else { "" };
        let text = table(header, |i| format!("{at}{i:06}{zone},{:.4}", value(i)));
        let record = read(&text, &ReadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_reads(name, &record, step, 1e-3);
        assert_eq!(record.raw.start, 0.0, "{name}");
        assert!(record.assumptions.iter().any(|text| text.contains("is a time of day")), "{name}");
    }
    // Steps of less than the last digit are known from all instants, as with other rounded times.
    let text = (0..4000)
        .fold("Time,Velocity (mm/s)\n".to_owned(), |text, i| text + &format!("10:11:12.{:06},{}\n", i * 4 / 10, i % 7));
    let record = read(&text, &ReadOptions::default()).unwrap();
    assert!((record.raw.step - 4e-7).abs() < 1e-12, "{}", record.raw.step);
    // Beside a rate, other words are no time.
    let text = table("time,Velocity (mm/s)", |i| format!("21st of November,{:.4}", value(i)));
    let sampled = ReadOptions { sample_rate: Some(5e6), ..ReadOptions::default() };
    assert_reads("words", &read(&text, &sampled).unwrap(), 2e-7, 1e-3);
    // A column of seconds beside is taken.
    let text = table("Start,Elapsed (s),Velocity (mm/s)", |i| format!("10:11:12,{i},{:.4}", value(i)));
    assert_reads("beside", &read(&text, &ReadOptions::default()).unwrap(), 1.0, 1e-3);
}

#[test]
fn text_above_rows_without_names_is_passed_over() {
    let rows = |row: &dyn Fn(u32) -> String| (0..ROWS).fold(String::new(), |text, i| text + &row(i) + "\n");
    let of = |time: Option<&str>, unit: &str| ReadOptions {
        time_unit: time.map(str::to_owned),
        sample_rate: time.is_none().then_some(1e6),
        unit: Some(unit.into()),
        ..ReadOptions::default()
    };
    let pairs = rows(&|i| format!("{i}\t{:.4}", value(i)));
    let text = format!("Vibrometer OFV-5000\nRange 100 mm/s/V\nShot 12\n{pairs}");
    assert!(refused(&text, &ReadOptions::default()).contains("or pass --read time_unit=UNIT --unit UNIT"));
    let record = read(&text, &of(Some("us"), "mm/s")).unwrap();
    assert_reads("pairs", &record, 1e-6, 1e-3);
    let note = "lines 1 to 3 above the rows are passed over";
    assert!(record.assumptions.iter().any(|text| text == note), "{:?}", record.assumptions);
    let numbered = rows(&|i| format!("{i}\t{i}E-06\t{:.4}", value(i)));
    let text = format!("Header Size:\t20\nDate:\t21/11/2019\nX-Axis\n{numbered}");
    let options = ReadOptions { time_column: Some("2".into()), column: Some("3".into()), ..of(Some("s"), "m/s") };
    assert_reads("three columns", &read(&text, &options).unwrap(), 1e-6, 1.0);
    let keys = "catman\nZeit\tLaser\nSR=5 MHz\tSR=5 MHz\ns\tmm/s\nT0=21.11.2019\tT0=21.11.2019\n";
    assert_reads("keys", &read(&(keys.to_owned() + &pairs), &of(Some("us"), "mm/s")).unwrap(), 1e-6, 1e-3);
    let single = rows(&|i| format!("{:.4}", value(i)));
    let text = format!("Start Address: -50\nSample Rate: 5 MS/s\nInput Range: +/- 1 V\nData:\n{single}");
    assert_reads("one column", &read(&text, &of(None, "m/s")).unwrap(), 1e-6, 1.0);
    let text = format!("Vibrometer OFV-5000\nShot 12\nVelocity (mm/s)\n{single}");
    let named = ReadOptions { sample_rate: Some(1e6), ..ReadOptions::default() };
    assert_reads("one name", &read(&text, &named).unwrap(), 1e-6, 1e-3);
}

#[test]
fn a_counter_is_no_time_and_the_stated_rate_is_taken() {
    let rows = |step: u32| (0..ROWS).fold(String::new(), |text, i| text + &format!("{},{:.4}\n", step * i, value(i)));
    for (name, above) in [
        ("interval", "Channel :,CH1\nTime interval : ,0.20000uS\nindex,Velocity (mm/s)"),
        ("rate", "# Sample rate: 5 MHz\nSample,Velocity (mm/s)"),
        ("samples a second", "# Sampling rate = 5 MS/s\nNo.,Velocity (mm/s)"),
    ] {
        let record = read(&format!("{above}\n{}", rows(1)), &ReadOptions::default()).unwrap();
        assert_reads(name, &record, 2e-7, 1e-3);
        assert!(record.assumptions.iter().any(|text| text.contains("as the lines above the rows state")), "{name}");
    }
    // Every tenth sample, or no rate: nothing is known, and the counter is not proposed.
    for text in
        [format!("# Sample rate: 5 MHz\nSample,Velocity (mm/s)\n{}", rows(10)), format!("index,v_mm_s\n{}", rows(1))]
    {
        assert_eq!(read(&text, &ReadOptions::default()).unwrap_err().remedy().unwrap(), "--sample-rate RATE");
    }
}

#[test]
fn a_channel_with_a_cell_in_every_second_row_is_read() {
    for stride in [2, 8] {
        let text = (0..stride * ROWS).fold("Time (us),Fast (V),Velocity (mm/s)\n".to_owned(), |text, i| {
            let slow = if i % stride == 0 { format!("{:.4}", value(i / stride)) } else { String::new() };
            text + &format!("{i},0.1,{slow}\n")
        });
        let record = read(&text, &ReadOptions::default()).unwrap();
        assert_reads("sparse", &record, 1e-6 * f64::from(stride), 1e-3);
        // A row lost between is still refused.
        let at = text.match_indices(&format!("{},0.1,", 8 * stride)).next().unwrap().0;
        let lost = format!("{}{}", &text[..at], text[at..].split_once('\n').unwrap().1);
        assert!(read(&lost, &ReadOptions::default()).is_err());
    }
}

#[test]
fn instruments_of_laboratories_are_recognised() {
    let rows = |row: &dyn Fn(u32) -> String| (0..ROWS).fold(String::new(), |text, i| text + &row(i) + "\n");
    let single = rows(&|i| format!("{:.4}", value(i)));
    let keysight = format!(
        "File Format, WaveformYValues\nPoints, {ROWS}\nXOrg, -1e-05\nXInc, 2e-07\nX Units, Second\nY Units, Volt\nData,\nfloat\n{single}"
    );
    let pairs = rows(&|i| format!("{:.9E},{:.4}", 2e-7 * f64::from(i) - 1e-5, value(i)));
    let both = keysight.replace("YValues", "XYValues").replace(&single, &pairs).replace("float", "float,float");
    let hioki = format!(
        "\"COMMENT\",\"8807 MEM DATA\"\n\"NUM_SIGS\",2\n\"HORZ_UNITS\",\"S\"\n\"VERT_UNITS\",\"S\",\"V\"\n\"SIGNAL\",\"TIME\",\"ACH1\"\n\"DATA\"\n{}",
        rows(&|i| format!("{:+.4E}, {:+.4E}", 2e-7 * f64::from(i) - 1e-5, value(i)))
    );
    let time = "21/11/2019 10:11:12.123";
    let labview = format!(
        "waveform\t[0]\t[1]\nt0\t{time}\t{time}\ndelta t\t2E-7\t2E-7\n\ntime\tY[0]\tY[1]\n{}",
        rows(&|i| format!("{time}\t0\t{:.4}", value(i)))
    );
    for (name, text, channel, start) in [
        ("Keysight", keysight, None, -1e-5),
        ("Keysight", both, None, -1e-5),
        ("HIOKI", hioki, None, -1e-5),
        ("LabVIEW", labview, Some("Y[1]"), 0.0),
    ] {
        let options = ReadOptions { column: channel.map(str::to_owned), ..of_volts() };
        let record = read(&text, &options).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_reads(name, &record, 2e-7, 1.0);
        assert!((record.raw.start - start).abs() < 1e-12, "{name}");
        assert!(record.form.contains(name), "{name}: {}", record.form);
    }
}

#[test]
fn keys_of_an_rto_say_unit_columns_and_envelope() {
    let folder = tempfile::tempdir().unwrap();
    let keys = "XStart:-1e-05:\nResolution:2e-07:\nRecordLength:60:\nVerticalUnit:m/s:\n";
    let rows = |row: &dyn Fn(u32) -> String| (0..ROWS).fold(String::new(), |text, i| text + &row(i) + "\n");
    let read = |keys: &str, values: String| {
        std::fs::write(folder.path().join("a.csv"), keys).unwrap();
        std::fs::write(folder.path().join("a.Wfm.csv"), &values).unwrap();
        read_record_bytes(&folder.path().join("a.Wfm.csv"), values.as_bytes(), None, &ReadOptions::default())
    };
    let record = read(keys, rows(&|i| format!("{:.4}", value(i)))).unwrap();
    assert_reads("unit", &record, 2e-7, 1.0);
    let timed = rows(&|i| format!("{:.9e};{:.4}", 2e-7 * f64::from(i) - 1e-5, value(i)));
    assert_reads("horizontal values", &read(keys, timed).unwrap(), 2e-7, 1.0);
    let both = rows(&|i| format!("{:.4};{:.4}", value(i) - 0.01, value(i) + 0.01));
    let message = read(&format!("{keys}ValuesPerXInterval:2:\n"), both).unwrap_err().to_string();
    assert!(message.contains("expected one sample at every instant, found two"), "{message}");
}

#[test]
fn sensitivities_in_comments_and_rows_of_channels() {
    let comma = |text: String| text.replace('.', ",");
    for (comment, volt) in [("8 mV/(mm/s)", 0.125), ("0,125 m/s/V", 0.125), ("0.125 m/s/V, set by hand", 0.125)] {
        let rows = comma(table("Time (us);Vib (V)", |i| format!("{i}.0;{:.4}", value(i))));
        let record = read(&format!("# sensitivity: {comment}\n{rows}"), &ReadOptions::default()).unwrap();
        assert_reads(comment, &record, 1e-6, volt);
    }
    let row = |of: &dyn Fn(u32) -> String| (0..ROWS).map(of).collect::<Vec<_>>().join(",");
    let (times, values) = (row(&|i| i.to_string()), row(&|i| format!("{:.4}", value(i))));
    for text in [format!("time_us,{times}\nvelocity,{values}\n"), format!("{times}\n{values}\n")] {
        assert!(refused(&text, &ReadOptions::default()).contains("for every channel; transpose the table"), "{text}");
    }
    let flat = table("Time (s),Velocity (mm/s)", |i| format!("0.000,{:.4}", value(i)));
    assert!(refused(&flat, &ReadOptions::default()).contains("the time column needs more digits"));
}
