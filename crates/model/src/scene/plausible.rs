//! What the keys of a bench can plausibly be: a unit that was left out makes a number wrong by a thousand or more.

use granchain_signal::{Dimension, Quantity};

/// Keys (`*` for the name of a material), the least and the largest plausible value, SI, and units that are left out.
const RANGES: &[(&str, f64, f64, &[&str])] = &[
    ("duration", 0.0, 100.0, &["us", "ms"]),
    ("chain.radius", 1e-8, 0.1, &["mm", "um"]),
    ("chain.override.radius", 1e-8, 0.1, &["mm", "um"]),
    ("materials.*.youngs_modulus", 1e3, 1e15, &["GPa", "MPa"]),
    ("materials.*.density", 0.1, 1e8, &["g/cm^3"]),
    ("drive.amplitude", 0.0, 0.01, &["um", "nm"]),
    ("drive.frequency", 1.0, 1e8, &["kHz", "MHz"]),
    ("drive.ring_up", 0.0, 1.0, &["us"]),
    ("vibrometer.bandwidth", 10.0, 1e12, &["MHz", "kHz"]),
    ("water.sound_speed", 1.0, 1e5, &["km/s"]),
];

/// Why a number is implausible for a key, with what may be meant; `None` where it is plausible.
pub(super) fn doubt(key: &str, value: f64, dimension: Dimension) -> Option<(String, String)> {
    let (_, low, high, units) = RANGES.iter().find(|(name, ..)| matches(name, key))?;
    let (limit, side) = match value {
        value if value < *low => (*low, "below"),
        value if value > *high => (*high, "above"),
        _ => return None,
    };
    let mut doubt = format!("which is {side} {}", Quantity::new(limit, dimension));
    // Nobody writes a millionth of a megahertz.
    let units = units.iter().filter(|_| value.abs() >= 1e-3);
    let meant = units
        .map(|unit| format!("{value} {unit}"))
        .find(|text| Quantity::parse_as(text, dimension).is_ok_and(|value| (*low..=*high).contains(&value)));
    if let Some(meant) = meant {
        doubt.push_str(&format!("; did you mean \"{meant}\"?"));
    }
    let expected = format!("{} to {}", Quantity::new(*low, dimension), Quantity::new(*high, dimension));
    Some((expected, doubt))
}

fn matches(name: &str, key: &str) -> bool {
    match name.split_once('*') {
        None => name == key,
        Some((before, after)) => {
            key.strip_prefix(before).is_some_and(|rest| rest.strip_suffix(after).is_some_and(|own| !own.is_empty()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::load;

    #[test]
    fn numbers_without_their_unit_are_refused_with_what_is_meant() {
        for (set, parts) in [
            ("materials.chrome-steel.youngs_modulus=201", ["found 201 Pa, which is below 1 kPa", "\"201 GPa\""]),
            ("chain.radius=1.5", ["found 1.5 m, which is above 0.1 m", "\"1.5 mm\""]),
            ("drive.frequency=1e-6", ["found 1e-6 Hz, which is below 1 Hz", "expected 1 Hz to"]),
            ("duration=120", ["found 120 s, which is above 100 s", "\"120 us\""]),
            ("drive.amplitude=1", ["found 1 m, which is above", "\"1 um\""]),
        ] {
            let message = load("rigid", &[set.into()]).unwrap_err().to_string();
            for part in parts {
                assert!(message.contains(part), "{set}: {message}");
            }
        }
        load("rigid", &["materials.chrome-steel.youngs_modulus=100 TPa".into()]).unwrap();
    }
}
