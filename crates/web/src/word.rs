//! Flags of the program as fields of the page, in both directions.

use std::collections::BTreeMap;

use clap::{Args, Command};
use granchain::cli::calibrate;
use serde::Serialize;

/// A field: its `id` in the page, the label beside it, and the flag that says the same.
pub struct Field {
    pub id: &'static str,
    pub label: &'static str,
    pub flag: &'static str,
}

const fn field(id: &'static str, label: &'static str, flag: &'static str) -> Field {
    Field { id, label, flag }
}

/// Of flags that begin alike, the longest first.
pub const FIELDS: [Field; 15] = [
    field("channel", "Channel of the bead", "--channel"),
    field("unit", "Unit of the bead", "--unit"),
    field("scale", "Sensitivity, bead", "--scale"),
    field("keys", "More on the bead's file", "--read"),
    field("tip-channel", "Channel of the horn", "--drive-read channel"),
    field("tip-unit", "Unit of the horn", "--drive-read unit"),
    field("tip-scale", "Sensitivity, horn", "--drive-read scale"),
    field("tip-keys", "More on the horn's file", "--drive-read"),
    field("scene", "Bench", "--scene"),
    field("settings", "What differs from it", "--set"),
    field("frequency", "Drive frequency", "--drive-frequency"),
    field("damping", "Damping law", "--damping"),
    field("horn", "Which file is the horn's", "--horn"),
    field("horn", "Which file is the horn's", "--drive"),
    field("further", FURTHER, "--further"),
];

const FURTHER: &str = "Further flags";

/// What would settle an error: values to fill in, and fields whose value only the user knows, with an example of its form.
#[derive(Debug, Default, PartialEq, Serialize)]
pub struct Fill {
    pub filled: BTreeMap<&'static str, String>,
    pub open: BTreeMap<&'static str, String>,
}

impl Fill {
    /// Of the flags of a remedy.
    pub fn of(remedy: &str) -> Self {
        let mut fill = Self::default();
        let words = shell_words::split(remedy).unwrap_or_default();
        for pair in words.chunks_exact(2) {
            let [flag, value] = pair else { continue };
            let with_key = value.split_once('=').map(|(key, value)| (format!("{flag} {key}"), value));
            let of = |flag: &str| FIELDS.iter().find(|field| field.flag == flag);
            let own = with_key.and_then(|(flag, value)| Some((of(&flag)?, value.to_owned())));
            let found = match (own, flag.as_str()) {
                (None, "--sample-rate") => of("--read").map(|field| (field, format!("sample_rate={value}"))),
                (None, flag) => of(flag).map(|field| (field, value.clone())),
                (own, _) => own,
            };
            let Some((field, value)) = found else { continue };
            let last = value.rsplit('=').next().unwrap_or_default();
            let open = value.contains('<') || ["NAME", "UNIT", "RATE", "N"].contains(&last);
            let into = if open { &mut fill.open } else { &mut fill.filled };
            let text = into.entry(field.id).or_default();
            if !text.is_empty() {
                text.push(' ');
            }
            text.push_str(&value);
        }
        fill
    }
}

/// The fields that a text speaks of by their labels.
pub fn fields_in(text: &str) -> Vec<&'static str> {
    let mut ids: Vec<_> =
        FIELDS.iter().filter(|field| text.contains(&quoted(field.label))).map(|field| field.id).collect();
    ids.dedup();
    ids
}

fn quoted(label: &str) -> String {
    format!("“{label}”")
}

/// A text in which flags are written as fields: `pass --scale '100 mm/s/V'` as `enter “Sensitivity, bead” '100 mm/s/V'`.
pub fn in_page_words(text: &str) -> String {
    let known = calibrate::Arguments::augment_args(Command::new(""));
    let mut written = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("--") {
        let (before, behind) = rest.split_at(at);
        written.push_str(before);
        let end = behind[2..].find(|c: char| !c.is_ascii_lowercase() && c != '-').map_or(behind.len(), |end| end + 2);
        let mut fields: Vec<&Field> = FIELDS.iter().filter(|field| behind.starts_with(field.flag)).collect();
        fields.retain(|field| field.flag.len() >= end && !continues(&behind[field.flag.len()..]));
        let longest = fields.into_iter().max_by_key(|field| field.flag.len());
        let used = match longest {
            Some(field) => {
                written.push_str(&quoted(field.label));
                let used = field.flag.len();
                if field.flag.contains(' ') && behind[used..].starts_with('=') {
                    written.push(' ');
                    used + 1
                } else {
                    used
                }
            }
            None if &behind[..end] == "--sample-rate" => {
                written.push_str(&format!("{} sample_rate=", quoted("More on the bead's file")));
                if behind[end..].starts_with(' ') { end + 1 } else { end }
            }
            None => {
                let is_flag = known.get_arguments().any(|flag| flag.get_long() == Some(&behind[2..end.max(2)]));
                written.push_str(&if is_flag { format!("{} ", quoted(FURTHER)) } else { String::new() });
                written.push_str(&behind[..end]);
                end
            }
        };
        rest = without_placeholder(&behind[used..]);
    }
    written.push_str(rest);
    written.replace("pass it as “", "enter it as “").replace("pass “", "enter “")
}

/// Whether a flag or a key goes on.
fn continues(rest: &str) -> bool {
    rest.starts_with(|c: char| c.is_ascii_lowercase() || c == '-' || c == '_')
}

/// The parser of flags names what a flag takes: ` <QUANTITY>`.
fn without_placeholder(rest: &str) -> &str {
    let inner = rest.strip_prefix(" <").and_then(|inner| inner.split_once('>'));
    match inner {
        Some((name, behind)) if name.chars().all(|c| c.is_ascii_uppercase() || "|=,…".contains(c)) => behind,
        _ => rest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_become_fields_with_what_follows_them() {
        for (flags, fields) in [
            ("pass --scale '<VALUE> mm/s/V'", "enter “Sensitivity, bead” '<VALUE> mm/s/V'"),
            ("choose one with --drive-read channel", "choose one with “Channel of the horn”"),
            ("pass --drive-read scale='2 um/V' or not", "enter “Sensitivity, horn” '2 um/V' or not"),
            (
                "--drive-read time_unit=us, --read delay=4us",
                "“More on the horn's file” time_unit=us, “More on the bead's file” delay=4us",
            ),
            ("--drive-frequency; --drive", "“Drive frequency”; “Which file is the horn's”"),
            ("a larger --evaluations -- or", "a larger “Further flags” --evaluations -- or"),
            ("invalid value 'x' for '--unit <UNIT>': expected", "invalid value 'x' for '“Unit of the bead”': expected"),
            ("--kind hydrophone", "--kind hydrophone"),
        ] {
            assert_eq!(in_page_words(flags), fields);
        }
    }

    #[test]
    fn a_remedy_fills_in_what_it_knows_and_asks_for_the_rest() {
        let fill =
            Fill::of("--channel 'CH2 (V)' --scale '<VALUE> mm/s/V' --drive-read channel=CH1 --read time_unit=us");
        let pairs = |of: &BTreeMap<&'static str, String>| {
            of.iter().map(|(id, value)| format!("{id}: {value}")).collect::<Vec<_>>()
        };
        assert_eq!(pairs(&fill.filled), ["channel: CH2 (V)", "keys: time_unit=us", "tip-channel: CH1"]);
        assert_eq!(pairs(&fill.open), ["scale: <VALUE> mm/s/V"]);
    }

    #[test]
    fn every_field_stands_in_the_page_under_its_label() {
        let page = include_str!("../page/page.html");
        for Field { id, label, .. } in FIELDS {
            let named = format!("<label for=\"{id}\">{label}</label>");
            assert!(page.contains(&named), "{named}");
            assert!(page.contains(&format!(" id=\"{id}\"")), "{id}");
        }
    }
}
