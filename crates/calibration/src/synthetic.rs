//! Files of synthetic records, as a laboratory stores them.

use std::fmt::Write;

use granchain_signal::Series;

/// Sensitivity of the hydrophone, as stated in a header, and in V/Pa.
const HYDROPHONE: (&str, f64) = ("250 nV/Pa", 250e-9);

/// A horn-tip file as a laboratory stores it: µs and nm, resolution 0.01 nm, after `comments`.
pub fn horn_tip_csv(displacement: &Series, comments: &[String]) -> Vec<u8> {
    file(displacement, comments, "time_us,displacement_nm", [1, 2], |value| value * 1e9)
}

/// A vibrometer file as a laboratory stores it: µs and mm/s, resolution 1 µm/s, after `comments`.
pub fn vibrometer_csv(velocity: &Series, comments: &[String]) -> Vec<u8> {
    file(velocity, comments, "time_us,velocity_mm_per_s", [4, 3], |value| value * 1e3)
}

/// A hydrophone file as a laboratory stores it: µs and mV of an instrument of 250 nV/Pa, resolution 0.1 µV (0.4 Pa),
/// after `comments`.
pub fn hydrophone_csv(pressure: &Series, comments: &[String]) -> Vec<u8> {
    let head = format!("# sensitivity: {}\ntime_us,hydrophone_mV", HYDROPHONE.0);
    file(pressure, comments, &head, [4, 4], |value| value * HYDROPHONE.1 * 1e3)
}

/// A file of instants (µs) and values with so many decimals each.
fn file(series: &Series, comments: &[String], head: &str, decimals: [usize; 2], shown: fn(f64) -> f64) -> Vec<u8> {
    let mut text: String = comments.iter().map(|comment| format!("# {comment}\n")).collect();
    let _ = writeln!(text, "{head}");
    for (index, value) in series.values.iter().enumerate() {
        let _ = writeln!(text, "{:.*},{:.*}", decimals[0], series.time(index) * 1e6, decimals[1], shown(*value));
    }
    text.into_bytes()
}
