//! What goes wrong most is answered with its place and what to do, in the words of the page.

use std::{fs, path::Path};

use granchain_web::{
    answer::{self, Refused},
    form::{Channel, Form},
};

fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../measurements").join(name);
    fs::read_to_string(&path).unwrap()
}

/// The form of a bead's record and a horn's.
fn form(bead: &str, horn: &str) -> Form {
    Form {
        files: vec!["vib.csv".into(), "horn_tip.csv".into()],
        horn: "horn_tip.csv".into(),
        bytes: vec![bead.as_bytes().to_vec(), horn.as_bytes().to_vec()],
        scene: "annulus".into(),
        ..Form::default()
    }
}

/// Every row of numbers of a table changed.
fn rows(table: &str, change: impl Fn(&str) -> Option<String>) -> String {
    let of = |line: &str| {
        if line.starts_with(['-', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']) {
            change(line)
        } else {
            Some(line.into())
        }
    };
    table.lines().filter_map(of).map(|line| line + "\n").collect()
}

/// All that the page says of a form before a fit.
fn said(form: &Form) -> String {
    let looked = answer::look(form).map(|looked| serde_json::to_value(looked).unwrap());
    let run = || answer::dry_run(form).map(|shown| serde_json::to_value(shown).unwrap());
    match looked.and_then(|looked| Ok((looked, run()?))) {
        Err(Refused { message, .. }) => message,
        Ok((looked, run)) => format!("{}\n{}", looked["warnings"], run["warnings"]),
    }
}

/// The message about a form contains all of `parts`, and no flag of the program.
#[track_caller]
fn says(form: &Form, parts: &[&str]) {
    let said = said(form);
    for part in parts {
        assert!(said.contains(part), "expected `{part}` in: {said}");
    }
    assert!(!said.contains("--"), "{said}");
}

#[test]
fn the_commonest_mistakes_are_answered_with_place_and_remedy_in_the_pages_words() {
    let (bead, horn) = (text("twin-annulus/vib.csv"), text("twin-annulus/horn_tip.csv"));
    let of_bead = |bead: &str| form(bead, &horn);
    let with = |channel: Channel| Form { bead: channel, ..form(&bead, &horn) };
    let cell = |line: &str| line.split_once(',').map(|(time, value)| (time.to_owned(), value.to_owned())).unwrap();

    // A wrong unit: of another quantity, and of the wrong size.
    let unit = |unit: &str| with(Channel { unit: unit.into(), ..Channel::default() });
    says(&unit("kg"), &["“Unit of the bead”", "expected the unit of a velocity", "found that of a mass"]);
    says(
        &unit("m/s"),
        &["vib.csv: expected a peak of at most 50 m/s, found 274 m/s", "correct the unit (“Unit of the bead”"],
    );
    // The two files swapped.
    let swapped = Form { horn: "vib.csv".into(), ..form(&bead, &horn) };
    says(
        &swapped,
        &[
            "horn_tip.csv:3: column `displacement_nm`: expected a velocity, found the unit `nm` of a length",
            "“Which file is the horn's”: are the two files swapped?",
        ],
    );
    // The horn of another experiment.
    let slower =
        |line: &str| Some(format!("{:.4},{}", cell(line).0.parse::<f64>().unwrap() * 73.0 / 51.0, cell(line).1));
    let foreign = rows(&horn, slower).replace("73 kHz", "51 kHz");
    says(
        &form(&bead, &foreign),
        &["vib.csv:4: expected a drive of 51.0000 kHz as horn_tip.csv:2 states", "enter “Drive frequency”"],
    );
    // An empty file, and none of text.
    says(&of_bead(""), &["vib.csv: expected a header line", "found an empty file; export it again"]);
    says(&of_bead("\u{89}PNG\r\n\u{1a}\n\0\0"), &["vib.csv: expected text, found", "export the record as CSV text"]);
    // No trigger: the record begins when the beads already move.
    let late = |line: &str| (cell(line).0.parse::<f64>().unwrap() >= 120.0).then(|| line.to_owned());
    says(
        &of_bead(&rows(&bead, late)),
        &["vib.csv: the record begins inside the response", "record from before the burst on"],
    );
    // Decimal commas between commas.
    let commas = rows(&bead, |line| Some(line.replace('.', ",")));
    says(
        &of_bead(&commas),
        &["vib.csv:7: expected 2 cells as in the header, found 4", "export with semicolons, or with decimal points"],
    );
    // A wrong frequency, and one without unit.
    let frequency = |text: &str| Form { frequency: text.into(), ..form(&bead, &horn) };
    says(
        &frequency("37kHz"),
        &[
            "horn_tip.csv: expected a strongest line at the drive frequency of 37.0000 kHz (“Drive frequency”)",
            "“More on the horn's file” force_frequency=true",
        ],
    );
    says(&frequency("73"), &["“Drive frequency”", "found `73` without a unit"]);
    // Volts without the sensitivity.
    says(
        &of_bead(&bead.replace("velocity_mm_per_s", "CH1 (V)")),
        &[
            "vib.csv:6: column `CH1 (V)`: expected a velocity, found volts",
            "enter it as “Sensitivity, bead” '<VALUE> mm/s/V'",
        ],
    );
    // Half a file: of the bead, and of the horn.
    says(&of_bead(&bead[..bead.len() / 2]), &["vib.csv:2151: ", "the transfer was cut short: copy it again"]);
    says(
        &form(&bead, &horn[..horn.len() / 2]),
        &["horn_tip.csv: the horn's record ends inside the burst", "record the horn to the end of the burst"],
    );
}

#[test]
fn decimal_commas_between_semicolons_are_read() {
    let (bead, horn) = (text("twin-annulus/vib.csv"), text("twin-annulus/horn_tip.csv"));
    let read =
        |bead: &str| serde_json::to_value(answer::look(&form(bead, &horn)).unwrap()).unwrap()["records"][0].clone();
    let european = rows(&bead, |line| Some(line.replace(',', ";").replace('.', ","))).replace("time_us,", "time_us;");
    for key in ["positive_peak", "negative_peak", "rms", "samples", "noise_rms"] {
        assert_eq!(read(&european)[key], read(&bead)[key], "{key}");
    }
}

#[test]
fn of_one_file_in_volts_the_columns_are_filled_in_and_the_sensitivities_asked_for() {
    let values = |name: &str| {
        let table = text(name);
        let rows = table
            .lines()
            .filter_map(|line| line.split_once(','))
            .filter_map(|(t, x)| Some((t.parse::<f64>().ok()?, x.parse::<f64>().ok()?)));
        rows.collect::<Vec<_>>()
    };
    let both = values("twin-annulus/vib.csv").into_iter().zip(values("twin-annulus/horn_tip.csv"));
    let rows: String =
        both.map(|((time, bead), (_, horn))| format!("{time},{},{}\n", horn / 2000.0, bead / 125.0)).collect();
    let mut form = Form {
        files: vec!["scope.csv".into()],
        bytes: vec![format!("time_us,CH1 (V),CH2 (V)\n{rows}").into_bytes()],
        scene: "annulus".into(),
        ..Form::default()
    };
    let Err(refused) = answer::look(&form) else { panic!("volts were read without a sensitivity") };
    assert_eq!(
        refused.fill.filled.clone().into_iter().collect::<Vec<_>>(),
        [("channel", "CH2 (V)".to_owned()), ("tip-channel", "CH1 (V)".to_owned())]
    );
    assert_eq!(refused.fill.open.keys().copied().collect::<Vec<_>>(), ["scale", "tip-scale"]);
    form.bead = Channel { channel: "CH2 (V)".into(), scale: "125 mm/s/V".into(), ..Channel::default() };
    form.tip = Channel { channel: "CH1 (V)".into(), scale: "2 um/V".into(), ..Channel::default() };
    let looked = serde_json::to_value(answer::look(&form).unwrap()).unwrap();
    let peak = looked["records"][0]["positive_peak"].as_f64().unwrap();
    assert!((peak - 0.2738).abs() < 1e-4, "{peak}");
    assert!((looked["records"][1]["strongest_line_hz"].as_f64().unwrap() - 73e3).abs() < 10.0, "{looked}");
}
