//! Layouts of instruments and programs that were once read wrongly or refused; every number is invented.

use std::{fmt::Write as _, path::Path};

use granchain_record::{MeasurementError, ReadOptions, Record, RecordKind, Sensitivity, read_record_bytes};

/// A tone of 31 kHz at 1 MHz, volts.
pub(super) fn volts(i: usize) -> f64 {
    (2.0 * std::f64::consts::PI * 0.031 * i as f64).sin() * 4e-3
}

/// A text whose rows follow the header.
pub(super) fn file(header: &str, count: usize, row: impl Fn(usize) -> String) -> String {
    (0..count).fold(format!("{header}\n"), |mut text, i| {
        let _ = writeln!(text, "{}", row(i));
        text
    })
}

pub(super) fn read(name: &str, text: &str, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(Path::new(name), text.as_bytes(), Some(RecordKind::Vibrometer), options)
}

pub(super) fn scaled() -> ReadOptions {
    ReadOptions { scale: Sensitivity::parse("1 m/s/V").ok(), ..ReadOptions::default() }
}

pub(super) fn channel(name: &str) -> ReadOptions {
    ReadOptions { column: Some(name.into()), ..scaled() }
}

#[track_caller]
pub(super) fn assert_record(record: &Record, count: usize, start: f64, step: f64, factor: f64) {
    let series = &record.raw;
    assert_eq!(series.len(), count);
    assert!((series.step - step).abs() <= 1e-9 * step, "step {:e}", series.step);
    assert!((series.start - start).abs() <= 1e-3 * step.max(start.abs() * 1e-12), "start {:e}", series.start);
    for (i, value) in series.values.iter().enumerate() {
        assert!((value - factor * volts(i)).abs() < 6e-6 * factor.max(1.0), "{i}: {value}");
    }
}

#[test]
fn an_x_with_a_unit_of_time_is_the_instant_and_start_and_increment_are_in_it() {
    let milli = file("X,CH 1,Start,Increment\nms, V,-0.25,0.0025000000000000001", 400, |i| {
        format!("{:.9},{:.6}", -0.25 + 0.0025 * i as f64, volts(i))
    });
    assert_record(&read("a.csv", &milli, &scaled()).unwrap(), 400, -250e-6, 2.5e-6, 1.0);
    let nano = file("X,CH 1,CH 2,Start,Increment\nns, V,mV,-100000,1000", 400, |i| {
        format!("{},{:.6},{:.3}", -100_000 + 1000 * i as i64, volts(i), 500.0 * volts(i))
    });
    assert_record(&read("a.csv", &nano, &channel("CH 1 (V)")).unwrap(), 400, -100e-6, 1e-6, 1.0);
    assert_record(&read("a.csv", &nano, &channel("CH 2 (mV)")).unwrap(), 400, -100e-6, 1e-6, 0.5);
    let seconds = file("X,CH1,Start,Increment,\nSecond,Volt,-1.000000e-04,1.000000e-06", 400, |i| {
        format!("{:.6e},{:.6},", -1e-4 + 1e-6 * i as f64, volts(i))
    });
    assert_record(&read("a.csv", &seconds, &scaled()).unwrap(), 400, -100e-6, 1e-6, 1.0);
}

#[test]
fn instants_since_1970_keep_every_digit() {
    let micro = file("time_s,velocity_m_per_s", 400, |i| format!("1712345678.{i:06},{:.6}", volts(i)));
    assert_record(&read("a.csv", &micro, &ReadOptions::default()).unwrap(), 400, 1_712_345_678.0, 1e-6, 1.0);
    let nano = file("time_ns,velocity_m_per_s", 400, |i| format!("1712345678000{:06},{:.6}", 1000 * i, volts(i)));
    assert_record(&read("a.csv", &nano, &ReadOptions::default()).unwrap(), 400, 1_712_345_678.0, 1e-6, 1.0);
    // A later instant before an earlier one is refused with the instants of the file.
    let falls = file("time_s,velocity_m_per_s", 400, |i| format!("1712345678.{:06},{:.6}", 400 - i, volts(i)));
    let message = read("a.csv", &falls, &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("expected a time later than 1.71234567"), "{message}");
}

#[test]
fn numbers_from_9_9e37_on_mark_over_range() {
    for mark in ["9.9E+37", "+9.91E+37", "-9.99999E+37", "1E+38", "9.9E+99"] {
        let text = file("x-axis,1\nsecond,Volt", 400, |i| {
            format!("{}E-06,{}", i, if i == 200 { mark.to_owned() } else { format!("{:.6}", volts(i)) })
        });
        let refused = read("a.csv", &text, &scaled());
        assert!(matches!(refused, Err(MeasurementError::Infinite { .. })), "{mark}: {refused:?}");
    }
}

#[test]
fn a_sample_rate_that_contradicts_the_instants_is_warned_of() {
    let of = |rate: &str| {
        let header = format!(
            "#Digilent WaveForms Oscilloscope Acquisition\n#Sample rate: {rate}\n#Samples: 400\n\nTime (s),Channel 1 (V)"
        );
        let text = file(&header, 400, |i| format!("{:.6},{:.6}", 1e-6 * i as f64, volts(i)));
        read("a.csv", &text, &scaled()).unwrap()
    };
    let warned =
        |record: &Record| record.warnings.iter().any(|warning| warning.contains("the instants one every 1.0000e-6 s"));
    assert!(warned(&of("500000Hz")) && !warned(&of("1000000Hz")));
    assert_record(&of("500000Hz"), 400, 0.0, 1e-6, 1.0);
}

/// `value` with `digits` digits, halves away from 0.
fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let unit = 10f64.powi((value.abs().log10() + 1e-9).floor() as i32 + 1 - digits);
    let units = (value.abs() / unit + 0.5 + 1e-9).floor() * value.signum();
    units * unit
}

#[test]
fn the_roundest_clock_that_explains_rounded_instants_is_taken() {
    for (name, count, start, step) in
        [("ties", 1600, -40e-6, 50e-9), ("decade", 4000, 0.0, 2e-6), ("step", 4000, -4e-3, 2e-6)]
    {
        let instant = |i: usize| rounded(start + step * i as f64, 3);
        let text = file("Time (s),CH1 (V)", count, |i| format!("{:.2E},{:.6}", instant(i), volts(i)));
        let record = read(name, &text, &scaled()).unwrap_or_else(|error| panic!("{error}"));
        assert_record(&record, count, start, step, 1.0);
        let is_noted = |assumption: &String| {
            assumption.contains("is rounded: one sample every") && assumption.contains("roundest")
        };
        assert!(record.assumptions.iter().any(is_noted), "{:?}", record.assumptions);
    }
    // `%.6g` leaves the zeros at the end out.
    let text =
        file("Time (s),CH1 (V)", 4000, |i| format!("{},{:.6}", rounded(0.01 + 1e-8 * i as f64, 6) as f32, volts(i)));
    assert!(text.contains("\n0.01,"), "{text}");
    assert_record(&read("g.csv", &text, &scaled()).unwrap(), 4000, 0.01, 1e-8, 1.0);
}

const LVM: &str =
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tNo\n";

#[test]
fn a_channel_of_labview_is_read_with_its_own_clock() {
    let head = |columns: &str| {
        format!(
            "{LVM}X_Columns\t{columns}\n***End_of_Header***\t\n\t\nChannels\t2\nSamples\t400\t400\nY_Unit_Label\tVolts\tVolts\n\
             X0\t0.0E+0\t-1.0E-4\nDelta_X\t2.0E-6\t1.0E-6\n***End_of_Header***\t\t\nX_Value\tslow\tfast\tComment"
        )
    };
    let row = |i: usize| format!("{:.6}\t{:.6}", 0.5 * volts(i), volts(i));
    let one = file(&head("One"), 400, |i| format!("{:.6}\t{}", 2e-6 * i as f64, row(i)));
    let none = file(&head("No"), 400, |i| format!("\t{}", row(i)));
    for text in [one, none] {
        assert_record(&read("a.lvm", &text, &channel("fast (Volts)")).unwrap(), 400, -1e-4, 1e-6, 1.0);
        assert_record(&read("a.lvm", &text, &channel("slow (Volts)")).unwrap(), 400, 0.0, 2e-6, 0.5);
    }
}

#[test]
fn a_remark_behind_a_row_of_labview_is_no_cell() {
    let head = format!(
        "{LVM}X_Columns\tOne\n***End_of_Header***\t\n\t\nChannels\t1\nSamples\t400\nY_Unit_Label\tVolts\nX0\t0.0E+0\nDelta_X\t1.0E-6\n\
         ***End_of_Header***\t\t\nX_Value\tvibrometer\tComment"
    );
    let text = file(&head, 400, |i| {
        format!("{:.6}\t{:.6}{}", 1e-6 * i as f64, volts(i), if i == 0 { "\tshot 12, gain 2" } else { "" })
    });
    assert_record(&read("a.lvm", &text, &scaled()).unwrap(), 400, 0.0, 1e-6, 1.0);
}

#[test]
fn a_trace_of_yokogawa_is_read_with_its_own_clock() {
    let head = "\"Header Size\"           ,15\n\"TraceName\"             ,\"vib           \",\"slow          \"\n\"BlockSize\"             ,400,400\n\
                \"VUnit\"                 ,\"V             \",\"mV            \"\n\"HResolution\"           ,1.0E-06,2.0E-06\n\
                \"HOffset\"               ,-1.0E-04,0.0E+00\n\"HUnit\"                 ,\"s             \",\"s             \"\n";
    let text = file(head, 400, |i| format!(",{:+.5E},{:+.5E}", volts(i), 500.0 * volts(i)));
    assert_record(&read("a.csv", &text, &channel("vib (V)")).unwrap(), 400, -1e-4, 1e-6, 1.0);
    assert_record(&read("a.csv", &text, &channel("slow (mV)")).unwrap(), 400, 0.0, 2e-6, 0.5);
}

#[test]
fn units_behind_a_slash_alone_and_of_other_countries_are_understood() {
    let options = scaled();
    for (header, time, factor, options) in [
        ("t/ms,v/(mm/s)", 1e3, 1e3, &ReadOptions::default()),
        ("Time (s),Velocity (in/s)", 1.0, 1.0 / 0.0254, &ReadOptions::default()),
        ("Time (s),Velocity (ft/s)", 1.0, 1.0 / 0.3048, &ReadOptions::default()),
        ("Time (s),Velocity (ips)", 1.0, 1.0 / 0.0254, &ReadOptions::default()),
        ("Temps (s),Vitesse (m.s-1)", 1.0, 1.0, &ReadOptions::default()),
        ("sec,Volt", 1.0, 1.0, &options),
        ("ms,Volt1", 1e3, 1.0, &options),
        ("Record Length,Analog:400\nSample Rate,1000000.0\nVertical Scale,CH1: 0.20\nSecond,Volt", 1.0, 1.0, &options),
    ] {
        let text = file(header, 400, |i| format!("{:.9},{:.6}", time * (1e-6 * i as f64 - 1e-4), factor * volts(i)));
        let record = read("a.csv", &text, options).unwrap_or_else(|error| panic!("{header}: {error}"));
        assert_record(&record, 400, -1e-4, 1e-6, 1.0);
    }
    for (unit, pascal) in [("t/us,p/kPa", 1e3), ("Time (us),Pressure (psi)", 6894.757)] {
        let text = file(unit, 400, |i| format!("{},{:.6}", i, volts(i)));
        let record = read_record_bytes(
            Path::new("a.csv"),
            text.as_bytes(),
            Some(RecordKind::Hydrophone),
            &ReadOptions::default(),
        );
        let value = record.unwrap_or_else(|error| panic!("{unit}: {error}")).raw.values[8];
        assert!((value / (pascal * volts(8)) - 1.0).abs() < 1e-3, "{unit}: {value}");
    }
    // `in` between a name and its unit is a word.
    let text = file("time_in_us,velocity_in_mm_per_s", 400, |i| format!("{},{:.6}", i, 1e3 * volts(i)));
    assert_record(&read("a.csv", &text, &ReadOptions::default()).unwrap(), 400, 0.0, 1e-6, 1.0);
}

#[test]
fn binary_files_of_instruments_are_named() {
    for (bytes, name) in [
        (&b"TDSm\x0e\0\0\0"[..], "TDMS"),
        (b"\x93NUMPY\x01\0", "NumPy"),
        (b":WFMPRE:BYT_NR 2", ".isf"),
        (b"#9000010346WAVEDESC\0\0", "LeCroy"),
        (b"\x0f\x0f:WFM#003", ".wfm"),
    ] {
        let refused =
            read_record_bytes(Path::new("a.bin"), bytes, None, &ReadOptions::default()).unwrap_err().to_string();
        assert!(refused.contains(name), "{refused}");
    }
}

#[test]
fn what_stands_below_the_rows_is_named_and_passed_over() {
    let rows = file("x-axis,1\nsecond,Volt", 400, |i| format!("{}E-06,{:.6}", i, volts(i)));
    let spectrum = file("x-axis,F1\nHertz,decibel", 50, |i| format!("{:+.3}E+03,{:.4E}", 2.5 * (i + 1) as f64, -40.0));
    for below in [
        &spectrum,
        "Anlg Ch State  Units/Div  Position\n Ch 1:    On     200mV/    0.0V\n\nTime Time Ref Main S/div\n Main Center  40.00us/\n",
        "EOF\n",
        "Max,4.0e-3\n",
    ] {
        let record = read("a.csv", &format!("{rows}{below}"), &scaled()).unwrap_or_else(|error| panic!("{error}"));
        assert_record(&record, 400, 0.0, 1e-6, 1.0);
        let named = |warning: &String| warning.contains("the rows end above line 403");
        assert!(record.warnings.iter().any(named), "{:?}", record.warnings);
    }
    // A word between rows that go on in time, and a second record, are refused.
    for below in ["abc,0.1\n400E-06,0.1\n", &rows] {
        assert!(read("a.csv", &format!("{rows}{below}"), &scaled()).is_err(), "{below}");
    }
}

#[test]
fn the_last_of_several_lines_of_percent_signs_names_the_columns() {
    let moku = file("% Moku:Go Oscilloscope\n% Input 1, DC coupling\n% Time (s), Input 1 (V), Input 2 (V)", 400, |i| {
        format!("{:.10e}, {:.6e}, {:.6e}", 1e-6 * i as f64 - 1e-4, volts(i), 0.5 * volts(i))
    });
    assert_record(&read("a.csv", &moku, &channel("Input 1 (V)")).unwrap(), 400, -1e-4, 1e-6, 1.0);
    let comsol =
        file("% Model:              horn.mph\n% Time (s)              Velocity, z component (m/s)", 400, |i| {
            format!("{:.10E}       {:.10E}", 1e-6 * i as f64, volts(i))
        });
    assert_record(&read("a.txt", &comsol, &ReadOptions::default()).unwrap(), 400, 0.0, 1e-6, 1.0);
}

#[test]
fn a_spectrum_in_hertz_and_decibel_is_called_one() {
    let text = file("x-axis,F1\nHertz,decibel", 200, |i| format!("{:+.3}E+03,{:.4E}", 2.5 * i as f64, -41.5));
    let message = read("a.csv", &text, &scaled()).unwrap_err().to_string();
    assert!(message.contains("found a spectrum"), "{message}");
}

#[test]
fn names_without_cells_are_no_columns() {
    let columns = |bare: &str| format!("X_Value\tvibrometer (V)\thorn (V){bare}");
    let timed = ReadOptions { time_unit: Some("s".into()), ..channel("2") };
    for remark in ["", "\tshot 12, gain 2"] {
        let text = file(&columns("\tComment"), 400, |i| {
            let first = if i == 0 { remark } else { "" };
            format!("{:.6}\t{:.6}\t{:.6}{first}", 1e-6 * i as f64, volts(i), 0.5 * volts(i))
        });
        let record = read("a.lvm", &text, &timed).unwrap();
        assert_record(&record, 400, 0.0, 1e-6, 1.0);
        assert!(record.assumptions.iter().any(|it| it.contains("`Comment`") && it.contains("passed over")));
    }
    // Rigol, its row of start and step cut off.
    let text = file("CH1,CH2,Start,Increment,", 400, |i| format!("{:.6},{:.6},", volts(i), 0.5 * volts(i)));
    let given = ReadOptions { sample_rate: Some(1e6), unit: Some("V".into()), ..channel("CH1") };
    assert_record(&read("a.csv", &text, &given).unwrap(), 400, 0.0, 1e-6, 1.0);
    // A name with cells, if only in some rows, and one that says something, stay.
    let remarked = file("Time (s),CH1 (V),comment", 400, |i| {
        format!("{:.6},{:.6},{}", 1e-6 * i as f64, volts(i), if i == 9 { "bump" } else { "" })
    });
    assert_record(&read("a.csv", &remarked, &channel("2")).unwrap(), 400, 0.0, 1e-6, 1.0);
    for text in [
        file("Time (s),CH1 (V),Start", 400, |i| format!("{:.6},{:.6},1", 1e-6 * i as f64, volts(i))),
        file("Time (s),CH1 (V),CH2 (V)", 400, |i| format!("{:.6},{:.6}", 1e-6 * i as f64, volts(i))),
    ] {
        let outcome = read("a.csv", &text, &channel("2"));
        assert!(outcome.map_or(true, |record| !record.assumptions.iter().any(|it| it.contains("without cells"))));
    }
}

#[test]
fn the_minus_sign_of_typography_is_a_minus() {
    let text = file("Time (s);Velocity (mm/s)", 400, |i| {
        format!("{:.6};{:.3}", 1e-6 * i as f64 - 1e-4, 1e3 * volts(i)).replace('-', "\u{2212}").replace('.', ",")
    });
    assert!(text.contains("\n\u{2212}0,000100;"));
    assert_record(&read("a.csv", &text, &ReadOptions::default()).unwrap(), 400, -1e-4, 1e-6, 1.0);
}

#[test]
fn a_table_without_a_header_asks_for_what_is_missing_and_for_nothing_twice() {
    let two = file("", 400, |i| format!("{:.7},{:.5}", 1e-6 * i as f64 - 1e-4, volts(i)));
    let four = file("", 400, |i| format!("{:.6}\t{:.5}\t{:.5}\t0", 1e-4 * i as f64, volts(i), 0.5 * volts(i)));
    let falling = file("", 400, |i| format!("{:.5},{:.5}", volts(i), 0.5 * volts(i)));
    let remedy = |text: &str, options: &ReadOptions| read("a.csv", text.trim_start(), options).unwrap_err().remedy();
    let with = |time_unit: Option<&str>, unit: Option<&str>| ReadOptions {
        time_unit: time_unit.map(Into::into),
        unit: unit.map(Into::into),
        ..ReadOptions::default()
    };
    for (text, options, flags) in [
        (&two, with(None, None), "--read time_unit=UNIT --unit UNIT"),
        (&two, with(Some("s"), None), "--unit UNIT"),
        (&two, with(None, Some("m/s")), "--read time_unit=UNIT"),
        (&two, ReadOptions { sample_rate: Some(1e6), ..scaled() }, "--channel 2"),
        (&four, with(None, None), "--read time_column=1 --read time_unit=UNIT --channel 2 --unit UNIT"),
        (&four, with(Some("s"), Some("m/s")), "--read time_column=1 --channel 2"),
        (&falling, with(None, None), "--sample-rate RATE --channel 1 --unit UNIT"),
    ] {
        assert_eq!(remedy(text, &options).as_deref(), Some(flags), "{options:?}");
    }
    let all = ReadOptions { time_column: Some("1".into()), column: Some("2".into()), ..with(Some("s"), Some("m/s")) };
    assert_record(&read("a.csv", four.trim_start(), &all).unwrap(), 400, 0.0, 1e-4, 1.0);
}

#[test]
fn where_no_flag_helps_none_is_proposed() {
    let text = file("Frequency (Hz),Channel 1 Magnitude (dB)", 40, |i| format!("{},{}", 1000 + 100 * i, -3));
    let error = read("a.csv", &text, &ReadOptions::default()).unwrap_err();
    let message = error.to_string();
    assert!(
        error.remedy().is_none() && message.contains("found a spectrum") && !message.contains("all at once"),
        "{message}"
    );
    // A time without a unit, and nothing to read.
    let text = file("Time,Temperature (K),Mass (kg)", 40, |i| format!("{i},{i},{i}"));
    let error = read("a.csv", &text, &ReadOptions::default()).unwrap_err();
    assert!(error.remedy().is_none() && !error.to_string().contains("all at once"), "{error}");
}

#[test]
fn a_column_without_a_unit_is_proposed_where_nothing_else_is_there() {
    let text = file("CH1,CH2,Start,Increment,", 400, |i| format!("{:.6},{:.6},", volts(i), 0.5 * volts(i)));
    let remedy = |options: &ReadOptions| read("a.csv", &text, options).unwrap_err().remedy().unwrap();
    assert_eq!(remedy(&ReadOptions::default()), "--sample-rate RATE --channel NAME --unit UNIT");
    let timed = ReadOptions { sample_rate: Some(1e6), ..ReadOptions::default() };
    assert_eq!(remedy(&timed), "--channel NAME --unit UNIT");
    let one = file("time_s,A,Temperature (K)", 400, |i| format!("{:.6},{:.6},300", 1e-6 * i as f64, volts(i)));
    let remedy = read("a.csv", &one, &ReadOptions::default()).unwrap_err().remedy();
    assert_eq!(remedy.as_deref(), Some("--channel A --unit UNIT"));
}

#[test]
fn a_first_column_that_rises_is_proposed_as_time() {
    let of = |header: &str, sign: f64| {
        file(header, 400, |i| format!("{:.8},{:.6},{:.6}", sign * (1e-6 * i as f64 - 1e-4), volts(i), 0.5 * volts(i)))
    };
    let remedy = |text: &str| read("a.csv", text, &channel("2")).unwrap_err().remedy().unwrap();
    assert_eq!(remedy(&of("X,CH 1 (V),CH 2 (V)", 1.0)), "--read time_column=X --read time_unit=UNIT");
    assert_eq!(remedy(&of("my axis,CH 1 (V),CH 2 (V)", 1.0)), "--read 'time_column=my axis' --read time_unit=UNIT");
    assert_eq!(remedy(&of("X,CH 1 (V),CH 2 (V)", -1.0)), "--sample-rate RATE");
    // A quarter of a period rises too.
    let slow = file("A,B", 400, |i| format!("{:.6},{:.6}", (0.01 * i as f64).sin(), volts(i)));
    assert_eq!(remedy(&slow), "--sample-rate RATE");
    let typed = ReadOptions { time_column: Some("X".into()), time_unit: Some("s".into()), ..channel("2") };
    assert_record(&read("a.csv", &of("X,CH 1 (V),CH 2 (V)", 1.0), &typed).unwrap(), 400, -1e-4, 1e-6, 1.0);
}

#[test]
fn a_text_without_rows_of_numbers_asks_for_no_flag() {
    let text = "Model:Scope 2000\nSerial:12 345\nCH1:On\nScale:5.0e-02 V\n";
    let error = read("a.txt", text, &scaled()).unwrap_err();
    assert!(error.remedy().is_none() && error.to_string().contains("expected rows of numbers"), "{error}");
}
