//! What to write instead of a command or a flag of an earlier version.

use clap::error::{ContextKind, ContextValue};

/// Commands that are gone, and what takes their place.
const COMMANDS: [(&str, &str); 8] = [
    (
        "batch",
        "run `sweep` or `coverage` with --part K/N --out FILE for K from 1 to N, then `granchain merge FILES --out DIR`",
    ),
    ("twins", "`cargo run --release -p granchain-validate -- coverage --scenario NAMES`"),
    ("report", "`granchain verify DIR`"),
    ("contact", "the example `cargo run --release --example contact_statics`"),
    ("convergence", "the measurement `cargo bench --bench convergence`, or `granchain accuracy`"),
    ("stress", "`cargo test --release --test stability`, or read docs/stability.md"),
    ("study", "`cargo run --release -p granchain-reproduction -- NAME`"),
    ("studies", "`cargo run --release -p granchain-reproduction -- NAME`"),
];

/// Flags that are gone, and what takes their place.
const FLAGS: [(&str, &str); 26] = [
    ("--resume", "nothing: a replay that is stopped begins again"),
    ("--checkpoint", "nothing: a replay that is stopped begins again"),
    ("--on", "--part K/N --out FILE for K from 1 to N under any scheduler, then `granchain merge FILES --out DIR`"),
    ("--chunk", "--part K/N --out FILE for K from 1 to N under any scheduler, then `granchain merge FILES --out DIR`"),
    ("--column", "--channel NAME"),
    ("--drive-column", "--drive-read channel=NAME"),
    ("--drive-channel", "--drive-read channel=NAME"),
    ("--force-frequency", "--read force_frequency=true, of a drive --drive-read force_frequency=true"),
    ("--input", "--drive FILE, once for each record in their order"),
    ("--scene-drive", "--drive none"),
    ("--record-set", "`set` of a [[record]] in a plan (--plan)"),
    ("--confirm", "--model fea, which answers by finite elements"),
    ("--search", "nothing: the search is the one whose intervals were tested"),
    ("--scenario", "`cargo run --release -p granchain-validate -- coverage --scenario NAMES`"),
    ("--coverage", "`granchain coverage --plan FILE --count N`"),
    ("--laboratory", "`cargo run --release -p granchain-validate -- coverage --scenario NAMES`"),
    ("--levels", "`coverage --plan FILE` with several [[record]]"),
    ("--records", "`coverage --plan FILE` with several [[record]]"),
    ("--quantity", "`quantity = \"pressure\"` in the plan (--plan FILE)"),
    ("--parameters", "--fit NAMES"),
    ("--fit", "`fit = [\"alpha\"]` in the plan (--plan FILE)"),
    ("--animation", "--fields INTERVAL, played by ParaView"),
    ("--calibration", "`granchain coverage` to test intervals (replay and sweep take --calibration)"),
    ("--features", "`features = \"paper\"` in a plan (--plan FILE)"),
    ("--mount", "`mount = [\"clamped\", \"free\"]` in a plan (--plan FILE)"),
    ("--whole", "nothing: every run is made again"),
];

/// Keys of a reading that were flags, with a drive's behind `--drive-`.
const KEYS: [&str; 16] = [
    "time-unit",
    "time-column",
    "baseline",
    "bandwidth",
    "delay",
    "trigger",
    "missing",
    "delimiter",
    "decimal",
    "range",
    "dataset",
    "averages",
    "mask",
    "unit",
    "scale",
    "sample-rate",
];

/// The same without a value.
const SWITCHES: [&str; 2] = ["invert", "resample"];

/// The line behind clap's error, where the word that it does not know was one of an earlier version.
pub fn instead_of(error: &clap::Error) -> Option<String> {
    let found = error.get(ContextKind::InvalidSubcommand).or_else(|| error.get(ContextKind::InvalidArg))?;
    let ContextValue::String(found) = found else { return None };
    instead(found).map(|instead| format!("`{found}` is gone; instead of it write {instead}"))
}

fn instead(found: &str) -> Option<String> {
    if let Some((_, instead)) = COMMANDS.iter().chain(&FLAGS).find(|(word, _)| *word == found) {
        return Some((*instead).to_owned());
    }
    let name = found.strip_prefix("--")?;
    let (flag, name) = name.strip_prefix("drive-").map_or(("--read", name), |name| ("--drive-read", name));
    let key = name.replace('-', "_");
    let value = match (KEYS.contains(&name), SWITCHES.contains(&name)) {
        (true, _) => "VALUE",
        (_, true) => "true",
        _ => return None,
    };
    Some(format!("{flag} {key}={value}"))
}

#[cfg(test)]
mod tests {
    use super::instead;

    #[test]
    fn flags_of_a_reading_are_named_by_their_key() {
        for (gone, expected) in [
            ("--time-unit", "--read time_unit=VALUE"),
            ("--drive-invert", "--drive-read invert=true"),
            ("--drive-scale", "--drive-read scale=VALUE"),
            ("--mount", "`mount = [\"clamped\", \"free\"]` in a plan (--plan FILE)"),
            ("twins", "`cargo run --release -p granchain-validate -- coverage --scenario NAMES`"),
        ] {
            assert_eq!(instead(gone).as_deref(), Some(expected));
        }
        assert_eq!(instead("--colour"), None);
    }
}
