//! Kinds of layouts that were once read wrongly or refused, each in more than one form; every number is invented.

use std::{fs, path::Path};

use granchain_record::{ReadOptions, Reading, RecordKind, read_record_bytes};

use super::laboratory_cases::{assert_record, channel, file, read, scaled, volts};

/// Instant of a row, s: from −100 µs on, every microsecond.
fn instant(i: usize) -> f64 {
    1e-6 * i as f64 - 1e-4
}

fn unit(unit: &str, options: ReadOptions) -> ReadOptions {
    ReadOptions { unit: Some(unit.into()), ..options }
}

#[test]
fn a_blank_before_quotes_is_no_letter_of_the_cell() {
    for (header, between) in [
        (r#""Time [ms]", "vib.V [mV]""#, ", "),
        (r#""Time [ms]";  "vib; 2 [mV]""#, "; "),
        ("\"Time [ms]\",\"note, free [K]\", \"vib, V [mV]\"", ", 300, "),
    ] {
        let text = file(header, 400, |i| format!("{:.3}{between}{:.3}", 1e3 * instant(i), 1e3 * volts(i)));
        let record = read("a.csv", &text, &scaled()).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert_record(&record, 400, -1e-4, 1e-6, 1.0);
    }
    let quoted = file("Time [s], v [m/s]", 400, |i| format!("\"{:.6}\", \"{:.6}\"", instant(i), volts(i)));
    assert_record(&read("a.csv", &quoted, &ReadOptions::default()).unwrap(), 400, -1e-4, 1e-6, 1.0);
}

#[test]
fn a_counter_beside_the_instants_is_neither_time_nor_record() {
    let row = |i: usize| format!("{}\t{:e}\t{:e}", i + 1, instant(i), volts(i));
    let bare = file("", 400, row);
    let error = read("a.txt", bare.trim_start(), &ReadOptions::default()).unwrap_err();
    let flags = "--read time_column=2 --read time_unit=UNIT --channel 3 --unit UNIT";
    assert_eq!(error.remedy().as_deref(), Some(flags));
    let timed =
        |time: &str| ReadOptions { time_column: Some(time.into()), time_unit: Some("s".into()), ..Default::default() };
    let typed = |time: &str, value: &str| unit("m/s", ReadOptions { column: Some(value.into()), ..timed(time) });
    assert_record(&read("a.txt", bare.trim_start(), &typed("2", "3")).unwrap(), 400, -1e-4, 1e-6, 1.0);
    // What rises evenly is no record.
    let message = read("a.txt", bare.trim_start(), &typed("1", "2")).unwrap_err().to_string();
    assert!(message.contains("rise or fall evenly") && message.contains("--channel NAME"), "{message}");
    // Named columns without units.
    let named = file("A\tB\tv (m/s)", 400, row);
    let error = read("a.txt", &named, &ReadOptions::default()).unwrap_err();
    assert_eq!(error.remedy().as_deref(), Some("--read time_column=B --read time_unit=UNIT"));
    assert_record(&read("a.txt", &named, &timed("B")).unwrap(), 400, -1e-4, 1e-6, 1.0);
}

#[test]
fn axes_of_bruel_and_kjaer_say_what_their_columns_are() {
    let head = |unit: &str| {
        format!(
            "Header Begin\nTitle:\tBurst\nNumber of points:\t400\nX-Axis title:\tTime\nX-Axis unit:\t{unit}\nY-Axis title:\tVibrometer\n\
             Y-Axis unit:\tm/s\nX-Axis delta:\t1.0E-06\nHeader End"
        )
    };
    type Row = fn(usize) -> String;
    let rows: [(Row, f64); 3] = [
        (|i| format!("{}\t{:e}\t{:e}", i + 1, instant(i), volts(i)), -1e-4),
        (|i| format!("{:e}\t{:e}", instant(i), volts(i)), -1e-4),
        (|i| format!("{}\t{:e}", i + 1, volts(i)), 0.0),
    ];
    for (row, start) in rows {
        let record = read("a.txt", &file(&head("s"), 400, row), &ReadOptions::default()).unwrap();
        assert_record(&record, 400, start, 1e-6, 1.0);
    }
    let spectrum = read("a.txt", &file(&head("Hz"), 400, rows[1].0), &ReadOptions::default()).unwrap_err();
    assert!(spectrum.to_string().contains("found a spectrum"), "{spectrum}");
}

#[test]
fn lines_above_that_state_two_rates_are_refused_and_one_is_a_clock() {
    let of = |lines: &str| {
        file(&format!("{lines}\nCH1 (V),CH2 (V)"), 400, |i| format!("{:.6},{:.6}", volts(i), 0.5 * volts(i)))
    };
    let one = of("# Sample rate: 1 MHz");
    assert_record(&read("a.csv", &one, &channel("CH1")).unwrap(), 400, 0.0, 1e-6, 1.0);
    let two = of("# fs: 1 MHz\n# dt: 1 ms");
    let message = read("a.csv", &two, &channel("CH1")).unwrap_err().to_string();
    assert!(message.contains("`fs: 1 MHz`") && message.contains("`dt: 1 ms`"), "{message}");
    let stated = ReadOptions { sample_rate: Some(1e6), ..channel("CH1") };
    assert_record(&read("a.csv", &two, &stated).unwrap(), 400, 0.0, 1e-6, 1.0);
    // Instants in the rows are what was measured.
    let timed = file("# fs: 1 MHz\n# dt: 1 ms\ntime_s,CH1 (V)", 400, |i| format!("{:.6},{:.6}", instant(i), volts(i)));
    assert_record(&read("a.csv", &timed, &scaled()).unwrap(), 400, -1e-4, 1e-6, 1.0);
    for (stated, contradicts) in [("1 MHz", false), ("1 kHz", true)] {
        let head = format!("# Sample rate: {stated}\ntime_s,CH1 (V)");
        let record =
            read("a.csv", &file(&head, 400, |i| format!("{:.6},{:.6}", instant(i), volts(i))), &scaled()).unwrap();
        assert_record(&record, 400, -1e-4, 1e-6, 1.0);
        assert_eq!(record.warnings.iter().any(|it| it.contains("check which is right")), contradicts, "{stated}");
    }
}

#[test]
fn rounded_instants_are_as_fine_as_each_is_written() {
    // Three digits below 100 µs, fixed decimals above.
    let two = |i: usize| {
        let at = 34.6e-9 + 50e-9 * i as f64;
        let written = format!("{at:.2E}");
        if at < 1e-4 { written } else { format!("{at:.9}") }
    };
    let text = file("time_s,CH1 (V)", 2600, |i| format!("{},{:.6}", two(i), volts(i)));
    assert_record(&read("a.csv", &text, &scaled()).unwrap(), 2600, 34.6e-9, 50e-9, 1.0);
    // A row that was lost among them is refused.
    let mut lines: Vec<&str> = text.lines().collect();
    lines.drain(900..905);
    assert!(read("a.csv", &(lines.join("\n") + "\n"), &scaled()).is_err());
}

#[test]
fn digits_are_those_of_the_record_and_not_of_what_stands_below_or_above() {
    let rows = |head: &str| file(head, 1600, |i| format!("{:.2E},{:.6}", 5e-5 * i as f64 - 4e-2, volts(i)));
    let spectrum = file("x-axis,F1\nHertz,decibel", 50, |i| format!("{:+.3}E+03,{:.4E}", 2.5 * (i + 1) as f64, -40.0));
    let text = rows("x-axis,1\nsecond,Volt") + &spectrum;
    assert_record(&read("a.csv", &text, &scaled()).unwrap(), 1600, -4e-2, 5e-5, 1.0);
    // The second of two blocks.
    let other = file("time_s,CH1 (V)", 400, |i| format!("{:.9},{:.6}", 1e-9 * i as f64, volts(i)));
    let text = format!("{other}# second\n{}", rows("").trim_start());
    let second = ReadOptions { dataset: Some(2), ..scaled() };
    assert_record(&read("a.csv", &text, &second).unwrap(), 1600, -4e-2, 5e-5, 1.0);
}

#[test]
fn lines_that_begin_with_other_signs_are_comments() {
    let rows = |head: &str| file(head, 400, |i| format!("{:.6},{:.6}", volts(i), 0.5 * volts(i)));
    for head in [
        "; a program\n; Samplerate: 1 MHz\nCH1,CH2",
        "! a program\n!Sample rate: 1 MHz\nCH1,CH2",
        "// Sample rate: 1 MHz\nCH1,CH2",
    ] {
        let record =
            read("a.csv", &rows(head), &unit("V", channel("CH1"))).unwrap_or_else(|error| panic!("{head}: {error}"));
        assert_record(&record, 400, 0.0, 1e-6, 1.0);
    }
    let named = file("; made up\n; Time (s),Velocity (m/s)", 400, |i| format!("{:.6},{:.6}", instant(i), volts(i)));
    assert_record(&read("a.csv", &named, &ReadOptions::default()).unwrap(), 400, -1e-4, 1e-6, 1.0);
    // A first cell that is empty.
    let empty = file(";time_s;velocity_m_per_s", 400, |i| format!("{i};{:.6};{:.6}", instant(i), volts(i)));
    assert_record(&read("a.csv", &empty, &ReadOptions::default()).unwrap(), 400, -1e-4, 1e-6, 1.0);
}

#[test]
fn a_comma_in_the_quotes_of_a_commented_header_parts_nothing() {
    for head in [
        "% Model,horn.mph\n% Time (s),\"Velocity, z (m/s), Point: 1\"",
        "# Time (s),\"Velocity, z (m/s), Point: (0, 1)\"",
        "% Time (s),\"Velocity, z (m/s)\"",
    ] {
        let text = file(head, 400, |i| format!("{:e},{:e}", instant(i), volts(i)));
        let record = read("a.csv", &text, &ReadOptions::default()).unwrap_or_else(|error| panic!("{head}: {error}"));
        assert_record(&record, 400, -1e-4, 1e-6, 1.0);
    }
}

#[test]
fn waveforms_of_labview_have_the_clock_that_stands_above_them() {
    let comma = |text: String| text.replace('.', ",");
    let row = |i: usize, value: f64| {
        comma(format!("01.03.2026 10:00:00.{i:06}\t{value:e}")).replacen("01,03,2026", "01.03.2026", 1)
    };
    let one = file("waveform\t[0]\nt0\t01.03.2026 10:00:00,000000\ndelta t\t1,000000E-6\n\ntime[0]\tY[0]", 400, |i| {
        row(i, volts(i))
    });
    assert_record(&read("a.txt", &one, &unit("V", scaled())).unwrap(), 400, 0.0, 1e-6, 1.0);
    let head = "waveform\t[0]\t\t[1]\t\nt0\t01.03.2026 10:00:00,000000\t\t01.03.2026 10:00:00,000000\t\n\
                delta t\t1,0E-6\t\t2,0E-6\t\n\ntime[0]\tY[0]\ttime[1]\tY[1]";
    let two = file(head, 400, |i| format!("{}\t{}", row(i, volts(i)), row(i, 0.5 * volts(i))));
    assert_record(&read("a.txt", &two, &unit("V", channel("Y[0]"))).unwrap(), 400, 0.0, 1e-6, 1.0);
    assert_record(&read("a.txt", &two, &unit("V", channel("Y[1]"))).unwrap(), 400, 0.0, 2e-6, 0.5);
}

#[test]
fn waveforms_side_by_side_keep_the_names_of_their_header() {
    let head = |step: &str| {
        format!(
            "Model,MSO58\nChannel,CH6,,Channel,MATH1,,Channel,MATH2\nWaveform Type,DIGITAL,,Waveform Type,ANALOG,,Waveform Type,ANALOG\n\
             Horizontal Units,s,,Horizontal Units,s,,Horizontal Units,s\nSample Interval,1.0e-06,,Sample Interval,1.0e-06,,Sample Interval,{step}\n\
             Record Length,400,,Record Length,400,,Record Length,400\nVertical Units,None,,Vertical Units,V,,Vertical Units,mV\n,,,,,,,\n\n\
             TIME,CH6_D1,CH6_D0,,TIME,MATH1,,TIME,MATH2"
        )
    };
    for (step, written) in [(1e-6, "1.0e-06"), (2e-6, "2.0e-06")] {
        let text = file(&head(written), 400, |i| {
            let (at, own) = (format!("{:.8e}", instant(i)), format!("{:.8e}", step * i as f64 - 1e-4));
            format!("{at},{},{},,{at},{:.6e},,{own},{:.6e}", i % 2, i / 2 % 2, volts(i), 500.0 * volts(i))
        });
        assert_record(&read("a.csv", &text, &channel("MATH1")).unwrap(), 400, -1e-4, 1e-6, 1.0);
        let record = read("a.csv", &text, &channel("MATH2")).unwrap();
        assert_record(&record, 400, -1e-4, step, 0.5);
        assert!(!record.warnings.iter().any(|it| it.contains("the preamble states")), "{:?}", record.warnings);
    }
}

#[test]
fn a_unit_of_time_that_is_wrong_by_powers_of_ten_is_warned_of() {
    let of =
        |factor: f64| file("time_ms,velocity_m_per_s", 400, |i| format!("{:e},{:.6}", factor * instant(i), volts(i)));
    let warned = |factor: f64, options: &ReadOptions| {
        read("a.csv", &of(factor), options)
            .unwrap()
            .warnings
            .iter()
            .any(|it| it.contains("check the unit of time (--read time_unit=s"))
    };
    let driven = ReadOptions { drive_frequency: Some(31e3), ..ReadOptions::default() };
    assert!(!warned(1e3, &ReadOptions::default()) && !warned(1e3, &driven));
    assert!(warned(1.0, &ReadOptions::default()) && warned(1.0, &driven));
    // Microseconds in a column of milliseconds: a line of 31 Hz.
    assert!(warned(1e6, &ReadOptions::default()));
    let typed = ReadOptions { time_unit: Some("s".into()), ..driven };
    assert!(!warned(1.0, &typed));
}

#[test]
fn a_current_is_called_one_and_another_column_is_taken() {
    for unit in ["A", "mA", "Ampere"] {
        let text = file(&format!("time_us,CH1 ({unit})"), 400, |i| format!("{i},{:.6}", volts(i)));
        let message = read("a.csv", &text, &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("a current") && !message.contains("did you mean"), "{message}");
    }
    let text = file("time_us,CH1 (A),CH2 (V)", 400, |i| format!("{i},1.5,{:.6}", volts(i)));
    assert_record(&read("a.csv", &text, &scaled()).unwrap(), 400, 0.0, 1e-6, 1.0);
}

#[test]
fn a_response_stands_in_a_file_as_on_the_command_line() {
    let place = tempfile::tempdir().unwrap();
    let table = place.path().join("hydrophone response.txt");
    let rows = (1..=116).map(|k| {
        format!(" {:.3}\t {:.2}\t  {:.3E}\n", 0.2 + 0.05 * f64::from(k), -251.0 + 0.01 * f64::from(k), 2.8e-7)
    });
    let head = "# Calibration\nHYD_MODEL\tX1\n# Freq(MHz) Sens(dB re. 1V/uPa) Sens(V/Pa)\nDATA_FIELDS\t3\n";
    fs::write(&table, head.to_owned() + &rows.collect::<String>()).unwrap();
    let reading = |response: &Path| Reading { response: Some(response.display().to_string()), ..Reading::default() };
    let options = reading(&table).below(ReadOptions::default()).unwrap();
    let text = file("time_us,pressure_kpa", 400, |i| format!("{i},{:.6}", volts(i)));
    let record =
        read_record_bytes(Path::new("a.csv"), text.as_bytes(), Some(RecordKind::Hydrophone), &options).unwrap();
    let noted = |note: &String| note.contains("116 rows from 250.0 kHz to 6.000 MHz");
    assert!(record.assumptions.iter().any(noted), "{:?}", record.assumptions);
    let message = reading(Path::new("none.txt")).below(ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("none.txt") && message.contains("no file"), "{message}");
    fs::write(&table, "0.1 52\n0.2 51\n").unwrap();
    let message = reading(&table).below(ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("Frequency (MHz)"), "{message}");
}

#[test]
fn containers_that_hold_no_record_as_text_are_named() {
    for (head, name) in [
        (&b"SQLite format 3\0\x10\0"[..], "SQLite"),
        (b"fLaC\0\0\0\x22", "FLAC"),
        (b"FORM\0\0\x10\0AIFF", "AIFF"),
        (b"riff\x2e\x91\xcf\x11", "Wave64"),
        (b"CDF\x01\0\0\0\0", "netCDF"),
    ] {
        let refused = read_record_bytes(Path::new("a.bin"), head, None, &ReadOptions::default()).unwrap_err();
        assert!(refused.to_string().contains(name), "{refused}");
    }
}
