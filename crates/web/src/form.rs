//! What is filled in on the page, as flags of the program.

use std::path::PathBuf;

use clap::{Args, Parser};
use granchain::{
    cli::{
        calibrate::{self, InMemory},
        start,
    },
    measurement::{ReadOptions, horn_column_of, shell_line},
};
use serde::Deserialize;

use crate::answer::Refused;

/// One record, as its fields say how it is read; empty where a field is.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Channel {
    pub channel: String,
    pub unit: String,
    pub scale: String,
    pub keys: String,
}

/// The page's fields.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Form {
    /// Names of one or two files.
    pub files: Vec<String>,
    /// Name of the horn's, if given.
    pub horn: String,
    pub bead: Channel,
    pub tip: Channel,
    pub scene: String,
    /// `KEY=VALUE`, a line each.
    pub settings: String,
    pub frequency: String,
    pub damping: String,
    /// Further flags of `granchain calibrate`.
    pub further: String,
    #[serde(skip)]
    pub bytes: Vec<Vec<u8>>,
}

/// A line of flags and nothing else.
#[derive(Debug, Parser)]
#[command(name = "granchain", no_binary_name = true, disable_help_flag = true)]
struct Line<A: Args> {
    #[command(flatten)]
    arguments: A,
}

fn parsed<A: Args>(flags: &[String]) -> Result<A, Refused> {
    Line::<A>::try_parse_from(flags).map(|line| line.arguments).map_err(|error| Refused::of_flags(&error))
}

/// Words of a field as a shell would take them.
fn words(label: &str, text: &str) -> Result<Vec<String>, Refused> {
    shell_words::split(text).map_err(|error| {
        Refused::new(format!("“{label}”: expected words, found `{text}`: {error}; close the quotation"))
    })
}

impl Form {
    /// The form that the page sent, with the bytes of its files.
    pub fn of(json: &str, first: Vec<u8>, second: Option<Vec<u8>>) -> Result<Self, Refused> {
        let form: Self = serde_json::from_str(json)
            .map_err(|error| Refused::new(format!("the page sent what is no form: {error}; load the page again")))?;
        let bytes: Vec<_> = std::iter::once(first).chain(second).collect();
        if form.files.len() != bytes.len() {
            return Err(Refused::new(
                "the page sent names and files that differ in number; load the page again".into(),
            ));
        }
        Ok(Self { bytes, ..form })
    }

    /// The files, in order.
    pub fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        self.files.iter().map(PathBuf::from).zip(self.bytes.iter().cloned()).collect()
    }

    /// Flags on how the files are read, which `start` and `calibrate` have in common.
    fn reading(&self) -> Result<Vec<String>, Refused> {
        let mut flags = Vec::new();
        let mut flag = |name: &str, value: String| flags.push(format!("--{name}={value}"));
        for (name, value) in [("channel", &self.bead.channel), ("unit", &self.bead.unit), ("scale", &self.bead.scale)] {
            if !value.trim().is_empty() {
                flag(name, value.trim().into());
            }
        }
        for setting in words("More on the bead's file", &self.bead.keys)? {
            flag("read", setting);
        }
        for (name, value) in [("channel", &self.tip.channel), ("unit", &self.tip.unit), ("scale", &self.tip.scale)] {
            if !value.trim().is_empty() {
                flag("drive-read", format!("{name}={}", value.trim()));
            }
        }
        for setting in words("More on the horn's file", &self.tip.keys)? {
            flag("drive-read", setting);
        }
        Ok(flags)
    }

    /// As `granchain start` takes it.
    pub fn start(&self) -> Result<start::Arguments, Refused> {
        let mut flags = self.reading()?;
        if !self.horn.is_empty() {
            flags.push(format!("--horn={}", self.horn));
        }
        flags.push("--".into());
        flags.extend(self.files.iter().cloned());
        parsed(&flags)
    }

    /// As `granchain calibrate` takes it, on the chain, and as it is typed. Of two files the horn's is known.
    pub fn calibrate(&self) -> Result<(calibrate::Arguments, Vec<String>, InMemory), Refused> {
        let horn_is_first = self.files.len() > 1 && self.files[0] == self.horn;
        let bead = usize::from(horn_is_first);
        let (Some(measured), Some(bytes)) = (self.files.get(bead), self.bytes.get(bead)) else {
            return Err(Refused::new(
                "expected the records of last bead and horn, found no file; drop or choose them".into(),
            ));
        };
        let mut flags = vec![format!("--measured={measured}")];
        let drive = if self.files.len() > 1 {
            let drive = 1 - bead;
            flags.push(format!("--drive={}", self.files[drive]));
            Some(self.bytes[drive].clone())
        } else if self.tip.channel.trim().is_empty() {
            flags.push("--drive=none".into());
            None
        } else {
            Some(bytes.clone())
        };
        flags.extend(self.reading()?);
        for (name, value) in [("scene", &self.scene), ("drive-frequency", &self.frequency), ("damping", &self.damping)]
        {
            if !value.trim().is_empty() {
                flags.push(format!("--{name}={}", value.trim()));
            }
        }
        let lines = self.settings.lines().map(str::trim).filter(|line| !line.is_empty());
        flags.extend(lines.map(|line| format!("--set={line}")));
        flags.push("--model=chain".into());
        flags.extend(words("Further flags", &self.further)?);
        let mut arguments: calibrate::Arguments = parsed(&flags)?;
        (arguments.session.quiet, arguments.session.cache) = (true, Some("none".into()));
        Ok((arguments, flags, InMemory { measured: vec![Some(bytes.clone())], drives: vec![drive] }))
    }

    /// The command that does the same.
    pub fn command(&self) -> Result<String, Refused> {
        let (_, flags, _) = self.calibrate()?;
        let typed = flags.iter().flat_map(|flag| match flag.split_once('=') {
            Some((name, value)) if name.starts_with("--") => vec![name, value],
            _ => vec![flag.as_str()],
        });
        Ok(shell_line(["granchain", "calibrate"].into_iter().chain(typed)))
    }

    /// The column of the horn's tip in the one file, by its name.
    pub fn horn_column(&self) -> Option<String> {
        let (path, bytes) = self.files().into_iter().next().filter(|_| self.files.len() == 1)?;
        horn_column_of(&path, bytes, &ReadOptions::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_the_flags_that_do_the_same() {
        let tip = Channel { channel: "CH1".into(), scale: "2 um/V".into(), ..Channel::default() };
        let bead = Channel {
            channel: "CH2".into(),
            scale: "125 mm/s/V".into(),
            keys: "delay=4us 'missing=interpolate'".into(),
            ..Channel::default()
        };
        let form = Form {
            files: vec!["scope 1.csv".into()],
            bytes: vec![b"x".to_vec()],
            bead,
            tip,
            scene: "annulus".into(),
            settings: "chain.beads=5\n\n".into(),
            frequency: "73kHz".into(),
            ..Form::default()
        };
        let same = "granchain calibrate --measured 'scope 1.csv' --channel CH2 --scale '125 mm/s/V' --read delay=4us --read missing=interpolate \
                    --drive-read channel=CH1 --drive-read 'scale=2 um/V' --scene annulus --drive-frequency 73kHz --set chain.beads=5 --model chain";
        assert_eq!(form.command().unwrap(), same);
        let (_, _, in_memory) = form.calibrate().unwrap();
        assert_eq!((in_memory.measured, in_memory.drives), (vec![Some(b"x".to_vec())], vec![Some(b"x".to_vec())]));
    }

    #[test]
    fn of_two_files_the_one_named_is_the_horns() {
        let form = |horn: &str| Form {
            files: vec!["a.csv".into(), "b.csv".into()],
            horn: horn.into(),
            bytes: vec![b"a".to_vec(), b"b".to_vec()],
            ..Form::default()
        };
        for (horn, bead) in [("a.csv", "b.csv"), ("b.csv", "a.csv")] {
            let command = form(horn).command().unwrap();
            assert_eq!(command, format!("granchain calibrate --measured {bead} --drive {horn} --model chain"));
            let (_, _, in_memory) = form(horn).calibrate().unwrap();
            assert_eq!(in_memory.drives, [Some(horn.as_bytes()[..1].to_vec())]);
        }
    }
}
