//! `granchain scene`: list, show, check, explain and start scenes.

mod bench;
mod explain;
mod margins;

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use anyhow::bail;
use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Map, Value, json};

use bench::BenchChoice;

use super::{
    Outcome,
    arguments::Session,
    output::{self, print},
};
use crate::{
    measurement::shell_word,
    model::contact_law::{ElasticLaw, Hertz, bead_face_stiffness, bead_flat_stiffness, bead_pair_stiffness},
    scene::{self, BUILT_IN, DriveKind, Effect, KEYS, Material, ModelKind, Scene, SettingValue, Support},
    signal::{Dimension, Quantity, visible},
};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  granchain scene show annulus\n  granchain scene init bench.toml\n  granchain scene check bench.toml"
)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the built-in scenes
    List,
    /// Print every key of a scene with its value, unit and meaning
    Show {
        /// Built-in scene or scene file
        #[arg(value_name = "NAME|FILE")]
        scene: String,
        /// Print the scene as a TOML file with every key
        #[arg(long)]
        toml: bool,
        /// Override one key: a number without unit is SI; repeatable
        #[arg(long = "set", value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
    /// List every key of a scene file: values, default, conditions and meaning
    Keys,
    /// Check a scene; print what follows from it, and its margins: how far step, contacts and energy are from spoiling the answer
    Check {
        /// Scene file or built-in scene
        #[arg(value_name = "FILE|NAME")]
        scene: String,
        /// Override one key: a number without unit is SI; repeatable
        #[arg(long = "set", value_name = "KEY=VALUE")]
        set: Vec<String>,
    },
    /// List every effect, on or off, and why; with --measure its cost and its influence
    Explain(explain::Arguments),
    /// Write a commented scene file to start from; never replaces a file
    Init {
        /// The file to write
        #[arg(value_name = "FILE")]
        file: PathBuf,
        /// Support of the last bead. The file has only the keys that this support needs
        #[arg(long, value_enum, conflicts_with = "from")]
        bench: Option<BenchChoice>,
        /// Built-in scene to start from
        #[arg(long, value_name = "NAME", default_value = "annulus")]
        from: String,
    },
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    match arguments.action {
        Action::List => list(session)?,
        Action::Show { scene, toml, set } => show(session, &load(session, &scene, &set)?, toml)?,
        Action::Keys => keys(session)?,
        Action::Check { scene, set } => check(session, &scene, &set, &load(session, &scene, &set)?)?,
        Action::Explain(explain) => {
            explain::execute(session, &explain, &load(session, &explain.scene, &explain.set)?)?;
        }
        Action::Init { file, bench: Some(BenchChoice::Impact), .. } => init(session, &file, "impact")?,
        Action::Init { file, bench: None, from } => init(session, &file, &from)?,
        Action::Init { file, bench: Some(bench), .. } => init_bench(session, &file, bench)?,
    }
    Ok(Outcome::Done)
}

fn load(session: &Session, name: &str, overrides: &[String]) -> anyhow::Result<Scene> {
    // As replay would run it.
    let loaded = scene::load_preferring(name, overrides, ModelKind::Reduced)?;
    for note in &loaded.notes {
        session.note(format_args!("note: {note}"));
    }
    if loaded.lacks_frequency {
        session.note(
            "note: `drive.frequency` is not given: that of the record is taken when the scene runs; what follows from it is shown for 73 kHz",
        );
    }
    session.warn(loaded.scene.coarse_ring());
    Ok(loaded.scene.with_limits(session.limits()))
}

fn list(session: &Session) -> anyhow::Result<()> {
    let mut text = String::new();
    let mut rows = Vec::new();
    for built_in in BUILT_IN {
        let description = scene::load(built_in.name, &[])?.description;
        writeln!(text, "{:<8} {description}", built_in.name)?;
        rows.push(json!({ "name": built_in.name, "description": description, "available": true }));
    }
    session.result(text, &rows)
}

fn show(session: &Session, scene: &Scene, toml: bool) -> anyhow::Result<()> {
    if toml && !session.json {
        // A file to be kept: its lines stay as they are.
        return print(visible(&scene.to_toml()));
    } else if toml {
        return session.result("", &json!({ "toml": scene.to_toml() }));
    }
    let settings = scene.settings();
    let width = |of: &dyn Fn(&scene::Setting) -> usize| settings.iter().map(of).max().unwrap_or(0);
    let keys = width(&|setting| setting.key.chars().count());
    // A long text or list must not push the meanings of all others aside.
    let values = width(&|setting| Some(setting.value.display().chars().count()).filter(|n| *n <= 24).unwrap_or(0));
    let units = width(&|setting| setting.value.unit().chars().count()).max(4);
    let mut text = format!("{:keys$}  {:values$}  {:units$}  meaning\n", "key", "value", "SI unit");
    for setting in &settings {
        let (value, unit) = (setting.value.display(), setting.value.unit());
        if value.chars().count() > 24 {
            writeln!(text, "{:keys$}  {value}", setting.key)?;
        } else {
            writeln!(text, "{:keys$}  {value:values$}  {unit:units$}  {}", setting.key, setting.meaning)?;
        }
    }
    let rows: Vec<Value> = settings
        .iter()
        .map(|setting| {
            json!({
                "key": setting.key,
                "value": json_value(&setting.value),
                "unit": setting.value.unit(),
                "text": setting.value.display(),
                "meaning": setting.meaning,
            })
        })
        .collect();
    session.result(text, &rows)
}

fn keys(session: &Session) -> anyhow::Result<()> {
    let (mut text, mut rows) = (String::new(), Vec::new());
    for key in KEYS {
        let (default, conditions, alternative) = (key.default_text(), key.conditions(), key.alternative());
        writeln!(text, "{}: {}", key.name, key.meaning)?;
        writeln!(text, "    takes {}", key.takes())?;
        match default.as_str() {
            "" => writeln!(text, "    must be given")?,
            default => writeln!(text, "    unless given: {default}")?,
        }
        let or = alternative.iter().map(|(governor, values)| format!("{governor} is {}, or ", values.join(" or ")));
        let or: String = or.collect();
        for (governor, values) in &conditions {
            writeln!(text, "    where {or}{governor} is {}", values.join(" or "))?;
        }
        let conditions: Map<_, _> =
            conditions.into_iter().map(|(key, values)| (key.to_owned(), json!(values))).collect();
        let mut row = json!({
            "key": key.name, "meaning": key.meaning, "takes": key.takes(), "default": default, "where": conditions,
        });
        if let Some((governor, values)) = alternative {
            row["or_where"] = json!({ governor: values });
        }
        rows.push(row);
    }
    session.result(text, &rows)
}

fn json_value(value: &SettingValue) -> Value {
    match value {
        SettingValue::Quantity(quantity) => json!(quantity.value),
        SettingValue::Lengths(lengths) => json!(lengths),
        SettingValue::Count(count) => json!(count),
        SettingValue::Text(text) => json!(text),
        SettingValue::Flag(flag) => json!(flag),
        SettingValue::FieldPoints(points) => {
            points.iter().map(|point| json!({ "r_m": point.radius, "z_m": point.distance })).collect()
        }
        SettingValue::Beads(beads) => beads
            .iter()
            .map(|(number, bead)| json!({ "bead": number, "radius_m": bead.radius, "material": bead.material.name }))
            .collect(),
    }
}

fn check(session: &Session, name: &str, set: &[String], scene: &Scene) -> anyhow::Result<()> {
    let mut text = format!("{name}: scene `{}` is valid\n\n", scene.name);
    let derived = consequences(scene);
    let width = derived.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(0);
    for (label, value) in &derived {
        writeln!(text, "  {label:width$}  {value}")?;
    }
    let effects = scene::effects(scene);
    let width = effects.iter().map(|effect| effect.name.chars().count()).max().unwrap_or(0);
    let section = |text: &mut String, title: &str, on: bool| -> std::fmt::Result {
        writeln!(text, "\n{title}")?;
        let chosen: Vec<&Effect> = effects.iter().filter(|effect| effect.on == on).collect();
        if chosen.is_empty() {
            writeln!(text, "  none")?;
        }
        for effect in chosen {
            writeln!(text, "  {:width$}  {}", effect.name, effect.why)?;
        }
        Ok(())
    };
    section(&mut text, "Effects in this scene", true)?;
    section(&mut text, "Effects switched off", false)?;
    if let Some(file) = scene.pending_record() {
        let found = if file.is_file() { "found, read when the scene runs" } else { "not found" };
        writeln!(text, "\nThe drive is the record {}: {found}.", file.display())?;
        if !file.is_file() {
            if !session.json {
                text += &margins::section(&margins::none("the drive record is not found"));
                session.result(text, &())?;
            }
            bail!("`drive.file`: there is no file {}; the path is relative to the scene file's folder", file.display());
        }
    }
    let margins = margins::of(session, name, set, scene)?;
    text += &margins::section(&margins);
    let rows: Vec<Value> = derived.iter().map(|(label, value)| json!({ "name": label, "value": value })).collect();
    let all = json!({ "scene": scene.name, "valid": true, "derived": rows, "effects": effects, "margins": margins });
    session.result(text, &all)
}

fn show_rounded(value: f64, dimension: Dimension) -> String {
    Quantity::new(rounded(value), dimension).to_string()
}

/// What follows for the beads.
fn bodies(scene: &Scene) -> Vec<(&'static str, String)> {
    let show = show_rounded;
    let beads = &scene.chain.beads;
    let (lightest, heaviest) =
        beads.iter().fold((f64::INFINITY, 0.0f64), |(low, high), bead| (low.min(bead.mass()), high.max(bead.mass())));
    let mass = if lightest == heaviest {
        show(lightest, Dimension::MASS)
    } else {
        format!("{} to {}", show(lightest, Dimension::MASS), show(heaviest, Dimension::MASS))
    };
    let materials = scene.materials_in_use().into_iter().map(|material| {
        let Material { name, youngs_modulus, poissons_ratio, density } = material;
        let (modulus, density) = (show(*youngs_modulus, Dimension::PRESSURE), show(*density, Dimension::DENSITY));
        ("material", format!("{name}: E {modulus}, ν {poissons_ratio}, ρ {density}"))
    });
    let mut rows: Vec<_> = materials.collect();
    rows.extend([
        ("mass of a bead", mass),
        ("mass of the chain", show(beads.iter().map(scene::Bead::mass).sum(), Dimension::MASS)),
        ("length of the chain", show(beads.iter().map(|bead| 2.0 * bead.radius).sum(), Dimension::LENGTH)),
        ("contacts", scene.chain.gaps.len().to_string()),
    ]);
    rows
}

/// What follows from a scene without running it.
fn consequences(scene: &Scene) -> Vec<(&'static str, String)> {
    let show = show_rounded;
    let drive = &scene.drive;
    let period = 1.0 / drive.frequency;
    let mut rows = consequences_of_bench(scene);
    if let Some((striker, velocity)) = drive.kind.striker() {
        let velocity = scene.amplitude_scale * velocity;
        let energy = 0.5 * striker.mass() * velocity * velocity;
        rows.push(("mass of the striker", show(striker.mass(), Dimension::MASS)));
        rows.push(("energy of the striker", show(energy, Dimension::ENERGY)));
        rows.push(("duration of its collision with a free first bead", show(period, Dimension::TIME)));
        rows.push(("output samples", scene.samples().to_string()));
        return rows;
    }
    rows.extend([("drive period", show(period, Dimension::TIME))]);
    if !matches!(drive.kind, DriveKind::Record { .. } | DriveKind::UnreadRecord { .. }) {
        let amplitude = scene.amplitude_scale * drive.amplitude;
        rows.push(("piston displacement, peak", show(amplitude, Dimension::LENGTH)));
        let velocity = std::f64::consts::TAU * drive.frequency * amplitude;
        rows.push(("piston velocity, peak", show(velocity, Dimension::VELOCITY)));
        if let Some(end) = drive.motion(scene.amplitude_scale).breaks().last() {
            rows.push(("end of the drive", show(*end, Dimension::TIME)));
        }
    }
    rows.push(("simulated periods", format!("{:.1}", scene.duration / period)));
    rows.push(("output samples", ((scene.duration / scene.output_step).round() as u64 + 1).to_string()));
    rows.push(("samples a period", format!("{:.1}", period / scene.output_step)));
    rows
}

/// What follows for the bench whatever drives it.
pub(super) fn consequences_of_bench(scene: &Scene) -> Vec<(&'static str, String)> {
    bodies(scene).into_iter().chain(contacts(scene)).collect()
}

/// What follows for the contacts: stiffnesses of the ends and of the first pair, static overlap under precompression.
fn contacts(scene: &Scene) -> Vec<(&'static str, String)> {
    let stiffness = |value| Quantity::new(rounded(value), Dimension::HERTZ_STIFFNESS).to_string();
    let beads = &scene.chain.beads;
    let mut rows = vec![match scene.drive.kind.striker() {
        Some((striker, _)) => ("Hertz stiffness, striker", stiffness(bead_pair_stiffness(striker, &beads[0]))),
        None => ("Hertz stiffness, piston", stiffness(bead_face_stiffness(&beads[0], scene.piston_face()))),
    }];
    if let [first, second, ..] = &beads[..] {
        let pair = bead_pair_stiffness(first, second);
        rows.push(("Hertz stiffness, beads 1 and 2", stiffness(pair)));
        if scene.chain.precompression > 0.0 {
            let overlap = Hertz { stiffness: pair }.overlap(scene.chain.precompression);
            rows.push((
                "static overlap, beads 1 and 2",
                Quantity::new(rounded(overlap), Dimension::LENGTH).to_string(),
            ));
        }
    }
    if let (Support::Annulus { shape, .. }, Some(last)) = (&scene.support, beads.last()) {
        let angle = shape.contact_angle(last.radius);
        let of = |value| Quantity::new(rounded(value), Dimension::LENGTH).to_string();
        rows.push(("opening of the ring, radius", of(shape.opening())));
        rows.push(("radius of the contact circle", of(last.radius * angle.sin())));
        rows.push(("contact normal from the axis", format!("{:.2}°", angle.to_degrees())));
        let law = if scene.has_own_ring() { "fitted to its statics, made once" } else { "that of the paper's ring" };
        rows.push(("contact law bead–ring", law.to_owned()));
    }
    if let (Support::Flat(flat), Some(last)) = (&scene.support, beads.last()) {
        rows.push(("Hertz stiffness, support", stiffness(bead_flat_stiffness(last, *flat))));
    }
    rows
}

/// To six digits, for print.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn init(session: &Session, file: &Path, from: &str) -> anyhow::Result<()> {
    // Refuses unknown names in the words of the loader.
    let built_in = match BUILT_IN.iter().find(|built_in| built_in.name == from) {
        Some(built_in) => built_in,
        None => {
            scene::load(from, &[])?;
            bail!("--from {from}: expected a built-in scene; copy the file itself to start from a scene file");
        }
    };
    let name = SettingValue::Text(stem(file)).to_toml();
    let own = format!("name = \"{}\"\n", built_in.name);
    let begun = format!("begun as the built-in scene `{from}`");
    let text = header(&begun) + &built_in.toml.replacen(&own, &format!("name = {name}\n"), 1);
    write_new(session, file, &text, from)
}

fn init_bench(session: &Session, file: &Path, bench: BenchChoice) -> anyhow::Result<()> {
    let name = SettingValue::Text(stem(file)).to_toml();
    let word = bench.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
    write_new(session, file, &(header(&format!("the bench `{word}`")) + &bench.toml(&name)), &word)
}

fn stem(file: &Path) -> String {
    file.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned())
}

fn header(begun: &str) -> String {
    format!(
        "# A scene for granchain, {begun}. A plain number is SI, a text carries its unit.\n\
         # Check it with `granchain scene check FILE`, list what every key means with `granchain scene show FILE`.\n#\n"
    )
}

fn write_new(session: &Session, file: &Path, text: &str, from: &str) -> anyhow::Result<()> {
    output::write_new(file, text.as_bytes(), "the scene file ", "")?;
    let name = file.display().to_string();
    session.result(
        format_args!("wrote {name}; run it with `granchain replay --scene {}`\n", shell_word(&name)),
        &json!({ "file": file, "from": from }),
    )
}
