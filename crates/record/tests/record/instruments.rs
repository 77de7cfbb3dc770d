//! The layouts of makers, each with made-up numbers: 100 samples of one bench as every instrument would write them.

use std::{fmt::Write as _, fs, path::Path};

use granchain_record::{
    MeasurementError, ReadOptions, Record, RecordKind, Sensitivity, read_record, read_record_bytes,
};

const COUNT: usize = 100;
const START: f64 = -1e-5;
const STEP: f64 = 5e-7;

/// Quiet, then a tone.
fn volts(index: usize) -> f64 {
    if index < 20 { 0.0 } else { 0.4 * (0.9 * index as f64).sin() }
}

fn time(index: usize) -> f64 {
    START + STEP * index as f64
}

fn options() -> ReadOptions {
    ReadOptions { scale: Some(Sensitivity::parse("100 mm/s/V").unwrap()), ..ReadOptions::default() }
}

fn read_with(text: &str, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(Path::new("scope.csv"), text.as_bytes(), Some(RecordKind::Vibrometer), options)
}

fn refused(text: &str) -> String {
    read_with(text, &options()).unwrap_err().to_string()
}

/// The rows of a file from those of the bench.
fn rows(row: impl Fn(usize) -> String) -> String {
    (0..COUNT).fold(String::new(), |mut text, index| {
        let _ = writeln!(text, "{}", row(index));
        text
    })
}

/// Instants and velocities are those of the bench, and the assumptions say these.
fn is_the_bench(name: &str, record: &Record, notes: &[&str]) {
    let series = &record.raw;
    assert_eq!(series.len(), COUNT, "{name}");
    assert!((series.start - START).abs() < 1e-11 && (series.step / STEP - 1.0).abs() < 1e-9, "{name}: {series:?}");
    for (index, value) in series.values.iter().enumerate() {
        assert!((value - 0.1 * volts(index)).abs() < 1e-9, "{name}: sample {index}: {value:e}");
    }
    for part in notes {
        assert!(record.assumptions.iter().any(|text| text.contains(part)), "{name}: {part}: {:?}", record.assumptions);
    }
}

fn reads(name: &str, text: &str, notes: &[&str]) {
    is_the_bench(name, &read_with(text, &options()).unwrap_or_else(|error| panic!("{name}: {error}")), notes);
}

fn channel(name: &str) -> ReadOptions {
    ReadOptions { column: Some(name.into()), ..options() }
}

#[test]
fn rigol_with_start_and_increment_in_the_header() {
    let grid = format!("{START:e},{STEP:e}");
    let counted =
        format!("X,CH1,Start,Increment,\nSequence,Volt,{grid}\n") + &rows(|i| format!("{i},{:.12},", volts(i)));
    reads("with X", &counted, &["instants from the header: -10 µs and every 0.5 µs", "(Rigol)"]);
    let plain = format!("CH1,Start,Increment,\nVolt,{grid}\n") + &rows(|i| format!("{:.12},", volts(i)));
    reads("without X", &plain, &["(Rigol)"]);
    let filled =
        format!("X,CH1,Start,Increment\nSequence,VOLT,{grid}\n") + &rows(|i| format!("{i},{:.12},,", volts(i)));
    reads("filled up", &filled, &[]);
    let two = format!("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,{grid}\n")
        + &rows(|i| format!("{i},9.5,{:.12},", volts(i)));
    let message = refused(&two);
    assert!(
        message.contains("CH1 (Volt)") && message.contains("CH2 (Volt)") && message.contains("--channel"),
        "{message}"
    );
    is_the_bench("two", &read_with(&two, &channel("CH2")).unwrap(), &[]);
    let inline = format!("CH1V,t0 ={START:e}, tInc = {STEP:e},\n") + &rows(|i| format!("{:.12},", volts(i)));
    reads("t0 and tInc", &inline, &["(Rigol)"]);
    let timed = format!("Time(s),CH1V,t0 ={START:e}, tInc = {STEP:e},\n") + &rows(|i| format!(",{:.12},,", volts(i)));
    reads("a blank column of time", &timed, &["(Rigol)"]);
}

#[test]
fn rigol_of_older_kinds_writes_a_column_of_time() {
    let row = |i| format!("{:.9e},{:.12}, ", time(i), volts(i));
    reads("a comma and a blank", &("X,CH1\nSecond,Volt,\n".to_owned() + &rows(row)), &["line 2 is a row of units"]);
    reads(
        "Time,X(CH1)",
        &("Time,X(CH1),\nSecond,Volt,\n".to_owned() + &rows(|i| format!("{:.9e},{:.12},", time(i), volts(i)))),
        &[],
    );
    let keys = "\"Model Number\",\"DS1102E\"\n\"Sampling Rate\",\"2.000MSa\"\n\n\"Time (s)\",\"Voltage (V)\"\n";
    reads(
        "quoted keys",
        &(keys.to_owned() + &rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)))),
        &["lines 1 to 3"],
    );
}

#[test]
fn siglent_with_its_preamble_and_instants_of_two_digits() {
    let keys = format!(
        "Record Length,Analog:{COUNT}\nSample Interval,CH1:{STEP}\nVertical Units,CH1:V,,,\nVertical Scale,CH1:0.50,,,\n\
         Vertical Offset,CH1:0.00,,,\nHorizontal Units,s\nHorizontal Scale,0.00001\nModel Number,SDS1104X-E\nSource,CH1\nSecond,Volt\n"
    );
    let text = keys.clone() + &rows(|i| format!(" {:.2},{:.12}", time(i), volts(i)));
    let record = read_with(&text, &options()).unwrap();
    assert!((record.raw.step - STEP).abs() < 1e-15 && record.raw.len() == COUNT);
    assert!(
        record
            .assumptions
            .iter()
            .any(|it| it.contains("is rounded: one sample every 0.5 µs by the preamble's interval")),
        "{:?}",
        record.assumptions
    );
    reads("more digits", &(keys + &rows(|i| format!(" {:.9},{:.12}", time(i), volts(i)))), &["(Siglent)"]);
}

#[test]
fn keysight_leaves_values_blank_where_its_memory_ends() {
    let text = "x-axis,1\nsecond,Volt\n".to_owned()
        + &(1..=3).rev().map(|i| format!("{:.9e},\n", START - STEP * f64::from(i))).collect::<String>()
        + &rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)))
        + &(0..4).map(|i| format!("{:.9e},\n", time(COUNT + i))).collect::<String>();
    reads("InfiniiVision", &text, &["7 rows without a value at the ends are left out"]);
    let hole = text.replace(&format!("{:.9e},{:.12}\n", time(40), volts(40)), &format!("{:.9e},\n", time(40)));
    assert!(refused(&hole).contains("scope.csv:46: column `1`"), "{}", refused(&hole));
}

#[test]
fn tektronix_of_few_digits_and_with_two_waveforms_side_by_side() {
    let keys = format!(
        "Model,MSO2024\nSample Interval,{STEP:e}\nRecord Length,{COUNT}\nVertical Units,V\nHorizontal Units,S\n\nTIME,CH1\n"
    );
    let text = keys + &rows(|i| format!("{:.1e},{:.12}", time(i), volts(i)));
    let record = read_with(&text, &options()).unwrap();
    assert!((record.raw.step - STEP).abs() < 1e-15 && record.raw.len() == COUNT, "{:?}", record.raw.step);
    assert!(record.assumptions.iter().any(|it| it.contains("is rounded")), "{:?}", record.assumptions);
    // A clock that loses rows is no rounded one.
    let lost: String =
        text.lines().enumerate().filter(|(i, _)| !(40..45).contains(i)).map(|(_, line)| format!("{line}\n")).collect();
    assert!(read_with(&lost, &options()).is_err());

    let beside = rows(|i| {
        let keys = match i {
            0 => [format!("Record Length,{COUNT}"), format!("Record Length,{COUNT}")],
            1 => [format!("Sample Interval,{STEP:e}"), format!("Sample Interval,{STEP:e}")],
            2 => ["Source,CH1".into(), "Source,CH2".into()],
            3 => ["Vertical Units,V".into(), "Vertical Units,V".into()],
            4 => ["Horizontal Units,s".into(), "Horizontal Units,s".into()],
            _ => [",".into(), ",".into()],
        };
        format!("{},,{:.9e},9.5,,{},,{:.9e},{:.12},", keys[0], time(i), keys[1], time(i), volts(i))
    });
    let message = refused(&beside);
    assert!(message.contains("CH1") && message.contains("CH2"), "{message}");
    is_the_bench("side by side", &read_with(&beside, &channel("CH2")).unwrap(), &["written by Tektronix"]);
}

#[test]
fn hantek_writes_settings_first_and_millivolts() {
    let text = "#timebase=80000000(ps)\n,#voltbase=2000000(uV)\n#size=100\n".to_owned()
        + &rows(|i| format!("{:.9e},{:.9}", time(i), 1e3 * volts(i)));
    reads("Hantek", &text, &["time taken in s, amplitude in mV"]);
    let other = "#speed=1\n,#gain=7\n".to_owned() + &rows(|i| format!("{:.9e},{:.9}", time(i), volts(i)));
    assert!(
        refused(&other).contains("settings such as") && refused(&other).contains("delete lines 1 to 2"),
        "{}",
        refused(&other)
    );
}

#[test]
fn records_parted_by_comments_are_not_joined() {
    let frame = |k: usize| format!("#Frame,{k},of,3\n") + &rows(|i| format!("{:.12}", volts(i) * k as f64));
    let text = "v (V)\n".to_owned() + &(1..=3).map(frame).collect::<String>();
    let timed = ReadOptions { sample_rate: Some(1.0 / STEP), ..options() };
    let message = read_with(&text, &timed).unwrap_err().to_string();
    assert!(message.contains("found 3") && message.contains("--read dataset=1…3"), "{message}");
    for k in 1..=3 {
        let record = read_with(&text, &ReadOptions { dataset: Some(k), ..timed.clone() }).unwrap();
        assert_eq!(record.raw.len(), COUNT);
        assert!((record.raw.values[30] - 0.1 * volts(30) * k as f64).abs() < 1e-12, "{k}");
    }
    let frame = |_| rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)));
    let text = "t (s),v (V)\n".to_owned() + &(1..=2).map(frame).collect::<Vec<_>>().join("#next\n");
    assert!(refused(&text).contains("found 2"), "{}", refused(&text));
}

#[test]
fn gw_instek_in_detail_and_fast() {
    let keys = format!(
        "Memory Length,{COUNT},\nTrigger Level,0,\nSource,CH1,\nVertical Units,V,\nVertical Scale,5.0E-02,\nHorizontal Units,S,\n\
         Sampling Period,{STEP:e},\n"
    );
    let text =
        format!("{keys}Mode,Detail,\nWaveform Data,\n") + &rows(|i| format!("{:.9e},{:.12},", time(i), volts(i)));
    reads("detail", &text, &["(GW Instek)"]);
    let fast = format!("{keys}Mode,Fast,\nWaveform Data,\n") + &rows(|i| format!("{},", i % 25));
    assert!(refused(&fast).contains("volts are counts × 5.0E-02 / 25"), "{}", refused(&fast));
}

#[test]
fn labview_measurement_files() {
    let head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tCOLUMNS\nTime_Pref\tRelative\n\
                ***End_of_Header***\t\n\nChannels\t2\nSamples\t100\t100\nY_Unit_Label\tVolts\tVolts\nX_Dimension\tTime\tTime\n\
                X0\tSTART\tSTART\nDelta_X\tSTEP\tSTEP\n***End_of_Header***\t\t\t\nX_Value\tA\tB\tComment\n";
    let head = head.replace("START", &format!("{START:E}")).replace("STEP", &format!("{STEP:E}"));
    let none = head.replace("COLUMNS", "No") + &rows(|i| format!("\t9.5\t{:.12}", volts(i)));
    is_the_bench("no X", &read_with(&none, &channel("B")).unwrap(), &["instants from X0 and Delta_X"]);
    let one = head.replace("COLUMNS", "One") + &rows(|i| format!("{:.9e}\t9.5\t{:.12}\t", time(i), volts(i)));
    is_the_bench("one X", &read_with(&one, &channel("B")).unwrap(), &["(LabVIEW)"]);
    let comma = one.replace("Decimal_Separator\t.", "Decimal_Separator\t,").replace('.', ",");
    is_the_bench("decimal commas", &read_with(&comma, &channel("B")).unwrap(), &[]);
    let second = none.clone() + &none[none.find("Channels").unwrap()..].replace("\t9.5\t0.0", "\t9.5\t7.0");
    assert!(refused(&second).contains("found 2"), "{}", refused(&second));
    let chosen = ReadOptions { dataset: Some(1), ..channel("B") };
    is_the_bench("first segment", &read_with(&second, &chosen).unwrap(), &["segment 1 of 2"]);
    let chosen = ReadOptions { dataset: Some(2), ..channel("B") };
    assert!((read_with(&second, &chosen).unwrap().raw.values[0] - 0.7).abs() < 1e-9);
}

#[test]
fn yokogawa_in_columns_below_quoted_keys() {
    let keys = format!(
        "\"Header Size\",16\n\"Model Name\",\"DL850\"\n\"TraceName\",\"CH1   \",\"CH2   \"\n\"BlockSize\",{COUNT},{COUNT}\n\
         \"VUnit\",\"V    \",\"V    \"\n\"SampleRate\",2.0E+06,2.0E+06\n\"HResolution\",{STEP:E},{STEP:E}\n\"HOffset\",{START:E},{START:E}\n\n"
    );
    let text = keys.clone() + &rows(|i| format!("9.5,{:.12},", volts(i)));
    is_the_bench("below", &read_with(&text, &channel("CH2")).unwrap(), &["instants from HOffset and HResolution"]);
    let text = keys + &rows(|i| format!(",9.5,{:.12}", volts(i)));
    is_the_bench("beside", &read_with(&text, &channel("CH2")).unwrap(), &["(Yokogawa)"]);
}

#[test]
fn rohde_und_schwarz_parts_values_from_keys() {
    let bench = tempfile::tempdir().unwrap();
    let keys =
        format!("SignalFormat:FLOAT:\nXStart:{START:e}:\nXStop:4e-5:\nResolution:{STEP:e}:\nRecordLength:{COUNT}:\n");
    fs::write(bench.path().join("rto.csv"), keys).unwrap();
    fs::write(bench.path().join("rto.Wfm.csv"), rows(|i| format!("{:.12}", volts(i)))).unwrap();
    let read = |name: &str| read_record(&bench.path().join(name), RecordKind::Vibrometer, &options());
    is_the_bench("RTO", &read("rto.Wfm.csv").unwrap(), &["rto.csv: -10 µs and every 0.5 µs"]);
    let message = read("rto.csv").unwrap_err().to_string();
    assert!(message.contains("rto.Wfm.csv: name that file"), "{message}");
    fs::remove_file(bench.path().join("rto.csv")).unwrap();
    assert!(read("rto.Wfm.csv").unwrap_err().to_string().contains("without `.Wfm` beside it"));
}

#[test]
fn blanks_and_carriage_returns_are_separators_too() {
    let blanks = "Time (s)   CH1 (V)\n".to_owned() + &rows(|i| format!("  {:.9e}   {:.12}", time(i), volts(i)));
    reads("blanks", &blanks, &["cells separated by blanks"]);
    let lines = "time_s,ch1 (V)\n".to_owned() + &rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)));
    reads("CR", &lines.replace('\n', "\r"), &[]);
    let long: String = (0..5000).map(|i| format!("{:.9e},{:.12}\r", time(i), volts(i))).collect();
    assert_eq!(read_with(&format!("time_s,ch1 (V)\r{long}"), &options()).unwrap().raw.len(), 5000);
}

#[test]
fn a_second_channel_is_recognised_by_its_name_or_listed_with_all_that_is_missing() {
    let two = |first: &str, second: &str| {
        format!("Time (s),{first},{second}\n") + &rows(|i| format!("{:.9e},{:.12},7.5", time(i), volts(i)))
    };
    reads("by name", &two("Vibrometer (V)", "Horn (V)"), &[]);
    let horn = read_record_bytes(
        Path::new("scope.csv"),
        two("LDV (V)", "horn tip (V)").replace(",7.5", ",0.5").as_bytes(),
        Some(RecordKind::Vibrometer),
        &ReadOptions { column: Some("horn tip".into()), ..options() },
    );
    assert_eq!(horn.unwrap().value_column.0, "horn tip (V)");
    let bare = two("CH1 (V)", "CH2 (V)");
    let error = read_with(&bare, &ReadOptions::default()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("choose one with --channel") && message.contains("found volts"), "{message}");
    assert_eq!(error.remedy().unwrap(), "--channel 'CH1 (V)' --scale '<VALUE> mm/s/V'");
    let same = two("CH (V)", "CH (V)");
    let message = refused(&same);
    assert!(message.contains("by its number, for they share a name: --channel 2 or --channel 3"), "{message}");
    assert!(read_with(&same, &channel("CH (V)")).is_err());
    is_the_bench("by number", &read_with(&same, &channel("2")).unwrap(), &[]);
    let untimed = bare.lines().map(|line| line.split_once(',').unwrap().1.to_owned() + "\n").collect::<String>();
    let remedy = read_with(&untimed, &ReadOptions::default()).unwrap_err().remedy().unwrap();
    assert_eq!(remedy, "--sample-rate RATE --channel 'CH1 (V)' --scale '<VALUE> mm/s/V'");
}

#[test]
fn spectra_accelerations_and_small_letters_are_known_for_what_they_are() {
    let table = |header: &str| format!("{header}\n") + &rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)));
    let message = read_with(&table("Frequency (Hz),Velocity (m/s)"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("found a spectrum"), "{message}");
    let message = read_with(&table("t (s),acc (g)"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("`g` of an acceleration"), "{message}");
    for (header, factor) in [("time_s,pressure_kpa", 1e3), ("time_s,pressure_pa", 1.0), ("time_s,p_bar", 1e5)] {
        let text = table(header);
        let kind = Some(RecordKind::Hydrophone);
        let read = read_record_bytes(Path::new("a.csv"), text.as_bytes(), kind, &ReadOptions::default()).unwrap();
        assert!((read.raw.values[30] - factor * volts(30)).abs() < 1e-6 * factor, "{header}");
    }
}

#[test]
fn what_no_bench_shows_is_warned_of() {
    let loud = |header: &str, kind, factor: f64| {
        let text = format!("{header}\n") + &rows(|i| format!("{:.9e},{:.12}", time(i), factor * volts(i)));
        let record =
            read_record_bytes(Path::new("a.csv"), text.as_bytes(), Some(kind), &ReadOptions::default()).unwrap();
        record.warnings.iter().any(|text| text.contains("check the unit"))
    };
    for (header, kind, limit) in [
        ("time_s,velocity_m_per_s", RecordKind::Vibrometer, 20.0),
        ("time_s,displacement_m", RecordKind::HornTip, 2e-4),
        ("time_s,pressure_Pa", RecordKind::Hydrophone, 1e8),
    ] {
        assert!(loud(header, kind, 3.0 * limit), "{header}");
        assert!(!loud(header, kind, 2.0 * limit), "{header}");
    }
}

#[test]
fn peak_detect_is_no_sampling() {
    let beside = "TIME (s),CH1 (V),CH1 Peak Detect (V)\n".to_owned()
        + &rows(|i| format!("{:.9e},{:.12},{:.12}", time(i), volts(i), volts(i) + 0.1));
    reads(
        "a column more",
        &beside,
        &["`CH1 Peak Detect (V)` (extremes between samples, mode Peak Detect) is passed over"],
    );
    let twice = "TIME (s),CH1 (V)\n".to_owned() + &rows(|i| format!("{:.9e},{:.12}", time(i / 2 * 2), volts(i)));
    assert!(refused(&twice).contains("Peak Detect"), "{}", refused(&twice));
}

#[test]
fn a_stated_rate_wins_and_rounded_instants_are_never_resampled() {
    let fine = |i: usize| 1.6e-6 * i as f64 - 0.1;
    let few = |count: usize| {
        let row = |i: usize| format!("{:.4e},{:.12}\n", fine(i), (0.05 * i as f64).sin());
        "t (s),v (V)\n".to_owned() + &(0..count).map(row).collect::<String>()
    };
    // Five digits of −0.1 s: ten microseconds, six samples to an instant.
    let record = read_with(&few(12_500), &ReadOptions { resample: true, ..options() }).unwrap();
    assert_eq!(record.raw.len(), 12_500);
    assert!((record.raw.step / 1.6e-6 - 1.0).abs() < 1e-3, "{:e}", record.raw.step);
    let rate = ReadOptions { sample_rate: Some(625e3), ..options() };
    let record = read_with(&few(200), &rate).unwrap();
    assert!(
        (record.raw.step - 1.6e-6).abs() < 1e-18 && record.assumptions.iter().any(|it| it.contains("--sample-rate"))
    );
    let record = read_with(&few(12_500), &ReadOptions { sample_rate: Some(1e6), ..options() }).unwrap();
    assert!(record.warnings.iter().any(|text| text.contains("one sample every 1.6")), "{:?}", record.warnings);
    // Rows are lost: what is left is interpolated onto the clock, not onto a rounded step.
    let row = |i: usize| format!("{:.6e},{:.12}\n", 1.37e-6 * i as f64 + 1.0, (0.02 * i as f64).sin());
    let lost = (0..5000).filter(|i| !(2000..2002).contains(i)).map(row).collect::<String>();
    let record = read_with(&format!("t (s),v (V)\n{lost}"), &ReadOptions { resample: true, ..options() }).unwrap();
    assert_eq!(record.raw.len(), 5000);
    assert!((record.raw.values[4500] - 0.1 * (0.02 * 4500f64).sin()).abs() < 2e-3);
}

#[test]
fn what_overloads_a_picoscope_is_an_overload() {
    let row =
        |i| format!("{:.6},{}", 1e6 * time(i), if i == 40 { "-∞".to_owned() } else { format!("{:.9}", volts(i)) });
    let message = refused(&("Time,Channel A\n(us),(V)\n\n".to_owned() + &rows(row)));
    assert!(message.contains("scope.csv:44") && message.contains("the input was overloaded"), "{message}");
}

#[test]
fn headers_are_found_where_programs_put_them() {
    let timed = rows(|i| format!("{:.9e},{:.12}", time(i), volts(i)));
    reads(
        "a comment, as numpy writes it",
        &format!("# made by a script\n# t (s),v (V)\n{timed}"),
        &["the comment above the rows"],
    );
    reads(
        "with a counter",
        &("#,Time(s),CH1(V)\n".to_owned() + &rows(|i| format!("{i},{:.9e},{:.12}", time(i), volts(i)))),
        &[],
    );
    assert!(refused(&format!("# 3 kHz, loud\n{timed}")).contains("expected a header"));
    reads("Tektronix without keys", &format!("TIME,CH2\n{timed}"), &["time taken in s, amplitude in V"]);
    reads("brackets in a name", &format!("t (s),Voltage (DC) (V)\n{timed}"), &[]);
    // A handheld oscilloscope: keys, then a counter and millivolts.
    let keys = "Channel   :,CH1\nFrequency :,F=  ?\nTime interval:,8000.00uS\n\nindex,CH1_Voltage(mV)\n";
    let text = keys.to_owned() + &rows(|i| format!("{i},{:.9}", 1e3 * volts(i)));
    let stated = read_with(&text, &options()).unwrap();
    assert!((stated.raw.step - 8e-3).abs() < 1e-12, "{:e}", stated.raw.step);
    let unstated = text.replace("Time interval:,8000.00uS", "Time interval:,?");
    assert!(refused(&unstated).contains("scope.csv:5: expected a column of time"), "{}", refused(&unstated));
    let record = read_with(&text, &ReadOptions { sample_rate: Some(1.0 / STEP), ..options() }).unwrap();
    assert!((record.raw.values[30] - 0.1 * volts(30)).abs() < 1e-9);
    let remedy = read_with("nr,time_s,ch1,ch2\n0,0,1,2\n1,1,2,3\n", &options()).unwrap_err().remedy();
    assert_eq!(remedy.unwrap(), "--channel NAME");
}

#[test]
fn what_was_cut_thinned_joined_or_left_blank_is_not_shifted_in_silence() {
    let head = format!("X,CH1,Start,Increment,\nSequence,Volt,{START:e},{STEP:e}\n");
    let counted =
        |counts: &dyn Fn(usize) -> usize| head.clone() + &rows(|i| format!("{},{:.12},", counts(i), volts(i)));
    let thinned = read_with(&counted(&|i| 2 * i), &options()).unwrap();
    assert!((thinned.raw.step - 2.0 * STEP).abs() < 1e-15, "{:e}", thinned.raw.step);
    let cut = read_with(&counted(&|i| i + 10), &options()).unwrap();
    assert!((cut.raw.start - (START + 10.0 * STEP)).abs() < 1e-12, "{:e}", cut.raw.start);
    for joined in [counted(&|i| i % 50), counted(&|i| if i < 30 { i } else { i + 3 }), counted(&|i| (i + 50) % 100)] {
        assert!(read_with(&joined, &options()).is_err());
    }
    let hole = format!("CH1,Start,Increment,\nVolt,{START:e},{STEP:e}\n")
        + &rows(|i| if i == 40 { ",".into() } else { format!("{:.12},", volts(i)) });
    assert!(refused(&hole).contains("scope.csv:43"), "{}", refused(&hole));
    let twice = format!(
        "\"TraceName\",\"CH1\"\n\"BlockSize\",50\n\"VUnit\",\"V\"\n\"HResolution\",{STEP:E}\n\"HOffset\",{START:E}\n\n"
    ) + &rows(|i| format!("{:.12},", volts(i)));
    assert!(refused(&twice).contains("found 100, 2 times as many"), "{}", refused(&twice));
    let overrange = "t (s),v (V)\n".to_owned()
        + &rows(|i| format!("{:.9e},{}", time(i), if i == 50 { "9.9E+37".into() } else { format!("{:.9}", volts(i)) }));
    assert!(refused(&overrange).contains("overloaded"), "{}", refused(&overrange));
}

#[test]
fn channels_of_other_units_and_clocks_keep_theirs() {
    let keys = format!(
        "Model,MDO3014\nSample Interval,{STEP:e}\nRecord Length,{COUNT}\nVertical Units,V,mV\nHorizontal Units,s\n\nTIME,CH1,CH2\n"
    );
    let text = keys + &rows(|i| format!("{:.9e},9.5,{:.9}", time(i), 1e3 * volts(i)));
    is_the_bench("CH2 in mV", &read_with(&text, &channel("CH2")).unwrap(), &[]);
    let bench = tempfile::tempdir().unwrap();
    let keys = format!(
        "XStart:1:\nResolution:9:\nRecordLength:40:\nHardwareXStart:{START:e}:\nSignalResolution:{STEP:e}:\nSignalHardwareRecordLength:{COUNT}:\n"
    );
    fs::write(bench.path().join("rte.csv"), &keys).unwrap();
    fs::write(bench.path().join("rte.Wfm.csv"), rows(|i| format!("{:.12}", volts(i)))).unwrap();
    let read = || read_record(&bench.path().join("rte.Wfm.csv"), RecordKind::Vibrometer, &options());
    is_the_bench("RTE", &read().unwrap(), &[]);
    fs::write(bench.path().join("rte.csv"), keys + "SignalType:FFT\n").unwrap();
    assert!(read().unwrap_err().to_string().contains("found a spectrum"));
}
