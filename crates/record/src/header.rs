//! Values stated in comment lines such as `# bandwidth: 1.5 MHz`.

use std::borrow::Cow;

use super::{Sensitivity, scale::with_point};
use granchain_signal::{Dimension, Quantity};

/// Values that the comments of a file state.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Stated {
    /// −6 dB bandwidth of the vibrometer, Hz.
    pub bandwidth: Option<f64>,
    /// Group delay of the vibrometer, s.
    pub delay: Option<f64>,
    /// Instant of the trigger on the file's time axis, s.
    pub trigger: Option<f64>,
    /// Time recorded before the trigger, s.
    pub pretrigger: Option<f64>,
    pub drive_frequency: Option<f64>,
    /// Number of shots averaged in the record.
    pub averages: Option<usize>,
    /// Sensitivity of the vibrometer or hydrophone.
    pub sensitivity: Option<Sensitivity>,
    /// Comments with a known key and an unreadable value.
    pub puzzling: Vec<String>,
}

const SENSITIVITIES: [&str; 5] =
    ["sensitivity", "scale", "hydrophone_sensitivity", "decoder_sensitivity", "vibrometer_sensitivity"];

/// Keys for the number of averages.
const AVERAGES: [&str; 4] = ["averages", "average", "number_of_averages", "average_count"];

/// The quantity without a remark that follows it: `1.5 MHz (invented)`, `1.5 MHz, −6 dB`.
fn plain(text: &str) -> Cow<'_, str> {
    let text = with_point(text.trim());
    let end = text.find([',', ';']).unwrap_or(text.len());
    let end = text[..end].find(" (").unwrap_or(end);
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text[..end].trim()),
        Cow::Owned(text) => Cow::Owned(text[..end].trim().to_owned()),
    }
}

/// Sample intervals (s) that lines state as a rate or an interval: `Sample rate: 5 MHz`, `Time interval : ,0.2uS`.
pub(super) fn sample_intervals<'a>(lines: impl Iterator<Item = &'a String>) -> impl Iterator<Item = (&'a str, f64)> {
    lines.filter_map(|line| {
        let (key, value) = line.split_once([':', '='])?;
        let key = key.trim().to_lowercase().replace(['_', '-', ' '], "");
        let value = value.trim_matches([' ', ',', ';', '\t', ':']);
        let step = match key.as_str() {
            "samplerate" | "samplingrate" | "samplingfrequency" | "fs" => {
                let rate = value.replace("Sa/s", "Hz").replace("S/s", "Hz");
                1.0 / Quantity::parse_as(&plain(&rate), Dimension::FREQUENCY).ok()?
            }
            "timeinterval" | "sampleinterval" | "samplinginterval" | "timestep" | "deltat" | "dt" => {
                Quantity::parse_as(&plain(value).replace('S', "s"), Dimension::TIME).ok()?
            }
            _ => return None,
        };
        (step > 0.0 && step.is_finite()).then_some((line.as_str(), step))
    })
}

/// Averaging stated by the instrument: `Average Count,16`, or `Type:,average` with `Count:,16`; `Some(None)` if the
/// number is not stated.
pub(super) fn averaged(statements: &[String]) -> Option<Option<usize>> {
    let pairs = || {
        statements.iter().filter_map(|line| {
            let (key, value) = line.split_once([':', ',', '=', ';', '\t'])?;
            let trimmed = |text: &str| text.trim_matches([':', ',', '=', ';', '\t', '"', ' ']).to_lowercase();
            Some((trimmed(key), trimmed(value)))
        })
    };
    let count = |is_key: &dyn Fn(&str) -> bool| {
        pairs().filter(|(key, _)| is_key(key)).find_map(|(_, value)| value.parse::<usize>().ok())
    };
    if let Some(count) = count(&|key| key.contains("average")) {
        return (count > 1).then_some(Some(count));
    }
    let is_average = |value: &str| value.split([',', ' ']).any(|word| word == "average" || word == "averaging");
    pairs().any(|(_, value)| is_average(&value)).then(|| count(&|key| key == "count").filter(|count| *count > 1))
}

/// Reads `key: value` or `key = value` comments. The unit follows the value or, after an underscore, ends the key
/// (`bandwidth_hz: 1.5e6`).
pub(super) fn stated(comments: &[String]) -> Stated {
    let mut stated = Stated::default();
    for comment in comments {
        let Some((key, value)) = comment.split_once(':').or_else(|| comment.split_once('=')) else { continue };
        let key: String = key.trim().to_lowercase().replace([' ', '-'], "_");
        if SENSITIVITIES.contains(&key.as_str()) {
            match Sensitivity::parse(&plain(value)) {
                Ok(sensitivity) => stated.sensitivity = Some(sensitivity),
                Err(_) => stated.puzzling.push(comment.clone()),
            }
            continue;
        }
        if AVERAGES.contains(&key.as_str()) {
            match plain(value).parse() {
                Ok(count) if count > 0 => stated.averages = Some(count),
                _ => stated.puzzling.push(comment.clone()),
            }
            continue;
        }
        for (names, dimension, target) in [
            (
                &["bandwidth", "decoder_bandwidth", "vibrometer_bandwidth"][..],
                Dimension::FREQUENCY,
                &mut stated.bandwidth,
            ),
            (&["delay", "decoder_delay", "vibrometer_delay"], Dimension::TIME, &mut stated.delay),
            (&["trigger", "trigger_time", "trigger_at"], Dimension::TIME, &mut stated.trigger),
            (&["pretrigger", "pre_trigger"], Dimension::TIME, &mut stated.pretrigger),
            (&["drive_frequency", "excitation_frequency", "f0"], Dimension::FREQUENCY, &mut stated.drive_frequency),
        ] {
            let Some(suffix) = names.iter().find_map(|name| key.strip_prefix(name)) else { continue };
            let text = match suffix {
                "" => value.trim().to_owned(),
                unit if unit.starts_with('_') => {
                    let unit = match &unit[1..] {
                        "hz" => "Hz",
                        "khz" => "kHz",
                        "mhz" => "MHz",
                        other => other,
                    };
                    format!("{} {unit}", value.trim())
                }
                // Another word that begins alike.
                _ => continue,
            };
            match Quantity::parse_as(&plain(&text), dimension) {
                Ok(value) => *target = Some(value),
                Err(_) => stated.puzzling.push(comment.clone()),
            }
            break;
        }
    }
    stated
}

/// Line (from 1) and value (Hz) of the drive frequency that a text states. Only comments (`#`) are searched.
///
/// ```
/// use granchain_record::drive_frequency_line;
///
/// let text = "# vibrometer\n# drive frequency: 73 kHz\ntime_us,velocity_mm_per_s\n";
/// assert_eq!(drive_frequency_line(text), Some((2, 73e3)));
/// ```
#[must_use]
pub fn drive_frequency_line(text: &str) -> Option<(usize, f64)> {
    let stated_in = |(index, line): (usize, &str)| {
        let comment = line.trim().strip_prefix('#')?.trim().to_owned();
        Some((index + 1, stated(&[comment]).drive_frequency?))
    };
    // As in `stated`, the last statement holds.
    text.lines().enumerate().filter_map(stated_in).last()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_are_read_from_an_instrument_s_own_lines() {
        let of = |lines: &[&str]| averaged(&lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>());
        assert_eq!(of(&["Type:,average", "Count:,16"]), Some(Some(16)));
        assert_eq!(of(&["Type:,raw", "Count:,1"]), None);
        assert_eq!(of(&["Average Count,64"]), Some(Some(64)));
        assert_eq!(of(&["\"Waveform\";\"Ch1, DC coupling, 10000 points, Average mode\""]), Some(None));
        assert_eq!(of(&["Ch1, DC coupling, 10000 points, Sample mode", "Averages,1"]), None);
    }

    #[test]
    fn plain_statements_are_understood_and_prose_is_left_alone() {
        let comments: Vec<String> = [
            "Laser vibrometer, 2019",
            "Bandwidth: 1.5 MHz (invented)",
            "decoder delay = 4.2 us",
            "trigger_us: 12",
            "pretrigger: a while",
            "Averages: 16",
            "drive frequency: 73 kHz, nominal",
            "delayed until: Tuesday",
            "hydrophone sensitivity: 250 nV/Pa (at 1 MHz, certificate of 2019)",
        ]
        .map(String::from)
        .into();
        let stated = stated(&comments);
        assert_eq!(stated.bandwidth, Some(1.5e6));
        assert_eq!(stated.delay, Some(4.2e-6));
        assert_eq!(stated.trigger, Some(12e-6));
        assert_eq!(stated.drive_frequency, Some(73e3));
        assert_eq!(stated.pretrigger, None);
        assert_eq!(stated.averages, Some(16));
        assert_eq!(stated.sensitivity, Sensitivity::parse("4 MPa/V").ok());
        assert_eq!(stated.puzzling, ["pretrigger: a while"]);
    }
}
