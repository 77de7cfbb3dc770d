//! The bench of a report: what stands on it, in words, and who says so.

use std::path::Path;

use super::Job;
use crate::{
    cli::summary,
    measurement::sha256,
    report::{
        calibration::{BenchReport, BenchRow, DrawnSupport},
        number::{engineering, significant},
    },
    scene::{ContactLaw, FlatContact, Material, Rim, Scene, Support, simulated},
};

/// The bench of the first record.
pub fn bench(job: &Job, scene: &Scene) -> BenchReport {
    let bench = &job.problem.lead().bench;
    let file = bench.text.file().and_then(|(_, text)| text.parse::<toml::Table>().ok()).unwrap_or_default();
    let fitted: Vec<&str> =
        job.problem.candidates[0].parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let origin = |keys: &[&str], parameters: &[&str]| -> String {
        let stated = keys.iter().any(|key| {
            let below = format!("{key}.");
            bench
                .overrides
                .iter()
                .filter_map(|set| set.split('=').next())
                .any(|set| set == *key || set.starts_with(&below))
                || holds(&file, key)
        });
        let is_fitted =
            |name: &&str| fitted.iter().any(|fitted| fitted == name || fitted.starts_with(&format!("{name}_")));
        match parameters.iter().find(|name| is_fitted(name)) {
            Some(name) if stated => format!("{name} fitted, the rest stated"),
            Some(name) => format!("{name} fitted, the rest default"),
            None if stated => "stated".into(),
            None => "default".into(),
        }
    };
    let row = |part: &str, value: String, keys: &[&str], parameters: &[&str]| BenchRow {
        part: part.into(),
        value,
        origin: origin(keys, parameters),
    };
    let piston = match (scene.piston, &scene.piston_material) {
        (FlatContact::Rigid, _) => "rigid flat".to_owned(),
        (FlatContact::HalfSpace, None) => "half-space of the bead's material".to_owned(),
        (FlatContact::HalfSpace, Some(face)) => format!("half-space of {}", material(face)),
    };
    let law = match scene.contact_law {
        _ if scene.model.kind.is_meshed() => "computed on the meshed bodies",
        ContactLaw::Hertz => "Hertz",
        ContactLaw::FiniteBody => "fitted to finite bodies",
    };
    let force = engineering(scene.chain.precompression, "N", 3);
    let mut rows = vec![
        row("beads", beads(scene), &["chain.beads", "chain.radius", "chain.override", "chain.mesh"], &[]),
        row("bead material", material(&scene.chain.beads[0].material), &["chain.material", "materials"], &[]),
        row("piston's face", piston, &["piston"], &[]),
        row("support", support(scene), &["support", "disc", "water"], &["support_stiffness"]),
        row("gaps", gaps(scene), &["chain.gaps"], &["gap"]),
        row("static force", force, &["chain.precompression"], &["precompression"]),
        row("contacts", law.into(), &["contact.law"], &[]),
        row("damping", summary::damping(scene), &["damping"], &["damping"]),
    ];
    rows.extend(scene.horn.map(|horn| {
        let value = format!("modal mass {}, {}", engineering(horn.mass, "kg", 3), engineering(horn.frequency, "Hz", 4));
        row("compliant horn", value, &["horn"], &["horn_mass"])
    }));
    rows.extend(scene.holder.map(|holder| {
        let value = format!(
            "drag {}, friction {}, μ {}, clearance {}",
            engineering(holder.drag, "N·s/m", 3),
            engineering(holder.friction_force, "N", 3),
            significant(holder.friction_coefficient, 3),
            engineering(holder.clearance, "m", 3)
        );
        row("bead guide", value, &["holder"], &["drag", "friction"])
    }));
    let drive = format!("{} at {}", summary::drive(scene), engineering(scene.drive.frequency, "Hz", 5));
    rows.push(match bench.drive {
        Some(_) => BenchRow {
            part: "drive".into(),
            value: format!("{drive}, multiplied by α = {}", significant(scene.amplitude_scale, 3)),
            origin: if fitted.contains(&"alpha") { "horn record; α fitted" } else { "horn record" }.into(),
        },
        None => row("drive", drive, &["drive", "alpha"], &["alpha"]),
    });
    rows.push(row("model", summary::model(scene), &["model"], &[]));
    let effects = simulated(scene).replacen("Effects simulated: ", "", 1);
    rows.push(BenchRow { part: "effects simulated".into(), value: effects, origin: "the scene's keys".into() });
    BenchReport {
        rows,
        radii: scene.chain.beads.iter().map(|bead| bead.radius).collect(),
        support: drawn(scene),
        texts: texts(job),
    }
}

/// Whether a file states a dotted key, or one below it.
fn holds(file: &toml::Table, key: &str) -> bool {
    let mut parts = key.split('.');
    let first = parts.next().and_then(|part| file.get(part));
    parts.try_fold(first, |value, part| value.map(|value| value.get(part))).flatten().is_some()
}

fn material(material: &Material) -> String {
    let Material { name, youngs_modulus, poissons_ratio, density } = material;
    format!(
        "{name}: E {}, ν {}, ρ {} kg/m³",
        engineering(*youngs_modulus, "Pa", 4),
        significant(*poissons_ratio, 3),
        significant(*density, 4)
    )
}

fn beads(scene: &Scene) -> String {
    let beads = &scene.chain.beads;
    let differ = beads.iter().filter(|bead| **bead != beads[0]).count();
    let differ = if differ > 0 { format!("; {differ} differ from the first") } else { String::new() };
    format!("{} of radius {}{differ}", beads.len(), engineering(beads[0].radius, "m", 4))
}

fn gaps(scene: &Scene) -> String {
    let open = scene.chain.gaps.iter().filter(|gap| **gap > 0.0).count();
    let widest = scene.chain.gaps.iter().copied().fold(0.0, f64::max);
    match open {
        0 => "none (random gaps are added in every run)".into(),
        1 => format!("one of {}", engineering(widest, "m", 3)),
        open => format!("{open} of up to {}", engineering(widest, "m", 3)),
    }
}

fn support(scene: &Scene) -> String {
    match &scene.support {
        Support::Flat(FlatContact::Rigid) => "rigid wall".into(),
        Support::Flat(FlatContact::HalfSpace) => "half-space of the bead's material".into(),
        Support::Free => "none: the last bead is free".into(),
        Support::Spring { stiffness } => format!("spring, {}", engineering(*stiffness, "N/m", 4)),
        Support::Foundation { youngs_modulus, plate, .. } => format!(
            "half-space of {}{}",
            engineering(*youngs_modulus, "Pa", 4),
            plate.as_ref().map_or_else(String::new, |plate| format!(
                " under a plate of {}, {}",
                engineering(plate.thickness, "m", 4),
                material(&plate.material)
            ))
        ),
        Support::Annulus { shape, stiffness_factor, material: of, .. } => format!(
            "annulus, R {}, section radius {}, stiffness factor {}; {}",
            engineering(shape.ring_radius, "m", 4),
            engineering(shape.section_radius, "m", 4),
            significant(*stiffness_factor, 4),
            material(of)
        ),
        Support::Disc { shape, .. } => format!(
            "disc, radius {}, thickness {}, {}; {}; {}",
            engineering(shape.radius, "m", 4),
            engineering(shape.thickness, "m", 4),
            match shape.rim {
                Rim::Clamped => "clamped",
                Rim::Supported => "simply supported",
                Rim::Free => "free",
            },
            material(&shape.material),
            if scene.water.is_some() { "water behind it" } else { "vacuum behind it" }
        ),
        Support::Body { mesh, material: of, .. } => format!("body {}; {}", mesh.path.display(), material(of)),
    }
}

fn drawn(scene: &Scene) -> DrawnSupport {
    match &scene.support {
        Support::Free => DrawnSupport::Free,
        Support::Annulus { shape, .. } => {
            DrawnSupport::Ring { ring_radius: shape.ring_radius, section_radius: shape.section_radius }
        }
        Support::Disc { shape, .. } => {
            let water = scene.water.is_some();
            DrawnSupport::Disc { radius: shape.radius, thickness: shape.thickness, water }
        }
        Support::Flat(_) | Support::Spring { .. } | Support::Foundation { .. } | Support::Body { .. } => {
            DrawnSupport::Flat
        }
    }
}

/// Plan, bench and scene files as they were read; one that was changed meanwhile is left out.
fn texts(job: &Job) -> Vec<(String, String)> {
    let as_read = |path: &Path, digest: &str| {
        let text = std::fs::read_to_string(path).ok()?;
        (sha256(text.as_bytes()) == digest).then_some(text)
    };
    let plans = job.plans.iter().filter_map(|(role, input)| {
        Some((format!("{role} {}", input.path.display()), as_read(&input.path, &input.sha256)?))
    });
    let scene = job.problem.lead().bench.text.file();
    plans.chain(scene.map(|(path, text)| (format!("scene {}", path.display()), text.to_owned()))).collect()
}
