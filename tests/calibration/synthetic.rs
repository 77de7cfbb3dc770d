//! The shipped synthetic record is recovered.

use assert_cmd::Command;

#[test]
fn the_shipped_synthetic_record_is_recovered() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("twin");
    Command::cargo_bin("calibrate")
        .unwrap()
        .args(["--measured", "measurements/twin-annulus/vib.csv", "--model", "chain", "--quiet", "--out"])
        .arg(&out)
        .assert()
        .success();
    let text = std::fs::read_to_string(out.join("calibration.json")).unwrap();
    let outcome: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(outcome["verdict"], "within scatter");
    // measurements/twin-annulus/truth.toml
    for (name, truth) in [("alpha", 0.7), ("damping", 0.6)] {
        let fitted = &outcome["parameters"][name];
        let (low, high) = (fitted["low"].as_f64().unwrap(), fitted["high"].as_f64().unwrap());
        assert!(low <= truth && truth <= high && high / low < 1.1, "{name}: {fitted}");
    }
}
