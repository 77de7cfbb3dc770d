//! What a calibration and a plan say of the user's own bench: widened intervals, a further record.

use std::fs;

use crate::{calibrate_bench::Bench, harness::granchain};
use serde_json::Value;

/// The small bench with `plan.toml`: so many beads on the chain, and `more`.
fn planned(beads: u32, more: &str) -> Bench {
    let bench = Bench::new();
    bench.add_horn_tip();
    let text = "measured = 'lab/vib.csv'\nscene = 'bench.toml'\nset = ['model.kind=chain', 'chain.beads=";
    bench.write("plan.toml", format!("{text}{beads}']\n{more}"));
    bench
}

/// Terminal and `calibration.json` of a fit of that plan in 200 runs, in `out`.
fn calibrated(place: &Bench, more: &[&str]) -> (String, Value) {
    let fit = ["calibrate", "--plan", "plan.toml", "--evaluations", "200", "--quiet", "--out", "out", "--force"];
    let (code, out, error) = granchain(place.path(""), &[&fit, more].concat());
    assert_eq!(code, 0, "{error}");
    (out, serde_json::from_slice(&fs::read(place.path("out/calibration.json")).unwrap()).unwrap())
}

fn refused(place: &Bench, arguments: &[&str], expected: &str) {
    let (code, _, error) = granchain(place.path(""), arguments);
    assert!(code == 2 && error.contains(expected), "{arguments:?} {code}: {error}");
    assert!(!place.path("no").exists());
}

#[test]
fn intervals_are_widened_about_their_medians_by_flag_or_plan_and_it_is_said() {
    let (place, asked) = (planned(2, ""), planned(2, "widen = 1.5\n"));
    let (said, own) = calibrated(&place, &[]);
    assert!(own.get("widened").is_none() && !said.contains("widened"), "{said}");
    for (place, flag, factor) in
        [(&asked, &[][..], 1.5), (&asked, &["--widen", "2"], 2.0), (&place, &["--widen", "1"], 1.0)]
    {
        let (said, wide) = calibrated(place, flag);
        let report = fs::read_to_string(place.path("out/report.md")).unwrap();
        assert_eq!(wide["widened"], factor);
        assert!([&said, &report].iter().all(|text| text.contains(&format!("widened {factor} times"))), "{said}");
        for name in ["alpha", "damping"] {
            let end = |of: &Value, key: &str| of["parameters"][name][key].as_f64().unwrap().ln();
            for side in ["low", "high"] {
                let ratio = (end(&wide, side) - end(&wide, "median")) / (end(&own, side) - end(&own, "median"));
                assert!((ratio / factor - 1.0).abs() < 1e-6, "{name} {side}: {ratio}");
            }
            assert_eq!(wide["parameters"][name]["value"], own["parameters"][name]["value"]);
        }
    }
    for factor in ["0.9", "inf", "NaN"] {
        let arguments = ["calibrate", "--plan", "plan.toml", "--widen", factor, "--out", "no"];
        refused(&place, &arguments, &format!("expected a factor from 1 to 100 on the intervals, found {factor}"));
    }
}

#[test]
fn a_further_record_narrows_what_is_known_and_both_widths_are_stated() {
    let place = planned(2, "");
    let study = ["coverage", "--plan", "plan.toml", "--evaluations", "200", "--vary", "drive=1,1.2", "--quiet"];
    let made = |more: &[&str]| {
        let (code, out, error) = granchain(place.path(""), &[&study, more].concat());
        assert_eq!(code, 0, "{error}");
        out
    };
    let study_of = |more: &[&str]| -> Value { serde_json::from_str(&made(&[more, &["--json"]].concat())).unwrap() };
    let widths = |of: &Value, key: &str| -> Vec<[f64; 2]> {
        let both = |it: &Value| [0, 1].map(|d| it["parameters"][d][key].as_f64().unwrap());
        of["count"].as_array().unwrap().iter().map(both).collect()
    };
    let (alone, both) = (study_of(&[]), study_of(&["--add-record", "--out", "out"]));
    let (alone, quick) = (widths(&alone, "expected_width"), widths(&both, "expected_width"));
    assert_eq!((both["count"][0]["name"].as_str(), quick.len()), (Some("as recorded"), 3));
    assert_eq!(both["count"][1]["name"], "as recorded + drive=1");
    // The second experiment of the study without the existing record is the first here: the same records are made.
    assert!((quick[0][0] / alone[0][0] - 1.0).abs() < 1e-9, "{quick:?} {alone:?}");
    // Horn scales of two horn records are independent, that of two shots under one (it has no noise here) and the mass are common.
    let [shot, further] = [1, 2].map(|number| quick[number][0] / quick[0][0]);
    assert!((0.68..0.9).contains(&further) && (0.9..1.0).contains(&shot) && quick[2][1] < quick[0][1], "{quick:?}");
    let said = fs::read_to_string(place.path("out/report.md")).unwrap();
    assert!(said.contains("Narrowest interval of alpha: as recorded + drive=") && said.contains("; now ±"), "{said}");
    // Both records fitted together.
    let fitted = widths(&study_of(&["--add-record", "--count", "1", "--model", "chain"]), "fitted_width");
    assert!(fitted.len() == 3 && fitted[2][0] < fitted[0][0], "{fitted:?}");
    for (fitted, quick) in fitted.iter().flatten().zip(quick.iter().flatten()) {
        assert!((0.75..1.33).contains(&(fitted / quick)), "{fitted} {quick}");
    }
    let above = ["--add-record", "--count", "1", "--model", "reduced"];
    refused(&place, &[&study[..], &above].concat(), "leave --count out");
    refused(&place, &["coverage", "--plan", "plan.toml", "--add-record"], "--vary");
}
