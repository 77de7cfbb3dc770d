//! `granchain mesh`: the finite element mesh of a scene, drawn, counted and written.

use std::{path::PathBuf, sync::Arc};

use anyhow::{Context, bail};
use clap::Args;
use serde::Serialize;

use super::{
    Outcome,
    arguments::{OutputArguments, Session, usage, whole},
    output::{OutputFolder, aligned},
    summary,
};
use crate::{
    model::{
        Estimate,
        fea::{
            arrangement::{Arrangement, torus},
            mesh::{Quality, quality},
        },
    },
    report::{
        mesh::{Bench, Standing, Window, chain, contacts},
        number::{fixed, significant},
        page::{Column, Table},
    },
    response::{Field, FieldBody, write_vtu},
    scene::{self, FlatContact, ModelKind, Scene, Support},
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain mesh --scene annulus --out mesh")]
pub struct Arguments {
    /// Built-in scene (see `granchain scene list`) or scene file
    #[arg(long, value_name = "NAME|FILE", help_heading = "Scene")]
    pub scene: String,
    /// Mesh density n; the element size is proportional to 1/n. 8 is fast; 16 to 24 is for reference solutions [default: the
    /// scene's, else 12; the reduced model runs with 16]
    #[arg(long, value_name = "N", value_parser = whole(2_u32, Some(128)), help_heading = "Scene")]
    pub density: Option<u32>,
    /// Override one key of the scene: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub output: OutputArguments,
}

#[derive(Debug, Clone, Serialize)]
struct Kind {
    /// Which bodies, such as `beads 1 to 6`.
    bodies: String,
    count: usize,
    #[serde(flatten)]
    quality: Quality,
    mass_kg: f64,
    /// Mass over that of the exact shape, less 1; none where the shape is known from its mesh alone.
    mass_error: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
struct Summary {
    scene: String,
    density: u32,
    kinds: Vec<Kind>,
    elements: usize,
    unknowns: usize,
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { scene: name, density, set, output } = arguments;
    let mut overrides = vec!["model.kind=fea".to_owned()];
    overrides.extend(density.map(|density| format!("model.mesh_density={density}")));
    if density.is_some() && set.iter().any(|set| set.starts_with("model.mesh_density")) {
        return Err(usage("--density and --set model.mesh_density say the same; give one of them"));
    }
    overrides.extend(set);
    let loaded = scene::load_with_notes(&name, &overrides)?;
    for note in &loaded.notes {
        session.note(format_args!("assumed: {note}"));
    }
    let scene = loaded.scene.with_limits(session.limits());
    Estimate::of_bodies(&scene).check(&scene.model.limits)?;
    let folder = output.stage(&["mesh.json"])?;
    let arrangement = Arrangement::new(&scene).with_context(|| format!("scene `{name}` cannot be meshed"))?;
    let summary = summary(&scene, &arrangement);
    if let Some(folder) = folder {
        let place = write(folder, &scene, &arrangement, &summary)?;
        session.note(format_args!("written to {}", place.display()));
    }
    session.result(text(&summary), &summary)?;
    Ok(Outcome::Done)
}

/// `bead 3`, `beads 1 to 6` or `beads 1, 2, 5`, counted from 1.
fn named(beads: &[usize]) -> String {
    match beads {
        [one] => format!("bead {}", one + 1),
        [first, .., last] if last - first + 1 == beads.len() => format!("beads {} to {}", first + 1, last + 1),
        _ => {
            let numbers: Vec<String> = beads.iter().map(|bead| (bead + 1).to_string()).collect();
            format!("beads {}", numbers.join(", "))
        }
    }
}

fn summary(scene: &Scene, arrangement: &Arrangement) -> Summary {
    let mut kinds = Vec::new();
    for (kind, body) in arrangement.kinds.iter().enumerate() {
        let all = arrangement.beads.iter().enumerate();
        let beads: Vec<usize> = all.filter(|(_, of)| **of == kind).map(|(bead, _)| bead).collect();
        let mass = body.total_mass();
        let (bodies, exact) = match beads.first() {
            Some(&first) => {
                let bead = &scene.chain.beads[first];
                (named(&beads), Some(bead.mass()))
            }
            None => ("support".to_owned(), support_mass(scene)),
        };
        kinds.push(Kind {
            bodies,
            count: beads.len().max(1),
            quality: quality(body.mesh()),
            mass_kg: mass,
            mass_error: exact.map(|exact| mass / exact - 1.0),
        });
    }
    let settings = scene.model.meshing();
    Summary {
        scene: scene.name.clone(),
        density: settings.density,
        elements: kinds.iter().map(|kind| kind.count * kind.quality.elements).sum(),
        unknowns: arrangement.unknowns(),
        kinds,
    }
}

fn support_mass(scene: &Scene) -> Option<f64> {
    match &scene.support {
        Support::Annulus { material, .. } => Some(material.density * torus(scene)?.volume()),
        _ => None,
    }
}

/// Most beads that are drawn for a first look.
const MOST_DRAWN: usize = 40;
/// Mesh density of that picture.
const DRAWN_DENSITY: u32 = 6;

/// The section of the bench of any scene, as PNG: of the bodies that meshes have, whatever model runs it.
pub(super) fn picture(scene: &Scene) -> anyhow::Result<Vec<u8>> {
    let beads = scene.chain.beads.len();
    if beads > MOST_DRAWN {
        bail!("{beads} beads are too many for one picture, of at most {MOST_DRAWN}");
    }
    let mut scene = scene.clone();
    scene.model.kind = ModelKind::Fea;
    scene.model.fea.density = DRAWN_DENSITY;
    // A half-space looks as a rigid flat does.
    scene.piston = FlatContact::Rigid;
    if let Support::Flat(flat) = &mut scene.support {
        *flat = FlatContact::Rigid;
    }
    let arrangement = Arrangement::new(&scene)?;
    Ok(chain(&bench(&arrangement)).to_png()?)
}

/// The bodies where they stand.
fn bench(arrangement: &Arrangement) -> Bench<'_> {
    let kinds = arrangement.beads.iter().chain(&arrangement.support);
    let names = arrangement.beads.iter().map(|_| "bead").chain(arrangement.support.map(|_| "support"));
    let standing = kinds.zip(&arrangement.origins).zip(names).map(|((kind, offset), name)| Standing {
        name,
        mesh: arrangement.kinds[*kind].mesh(),
        offset: *offset,
    });
    let bodies: Vec<Standing<'_>> = standing.collect();
    let last = arrangement.beads.len() - 1;
    let flat = arrangement.support.is_none().then(|| far_pole(&bodies[last]));
    Bench { bodies, flat }
}

/// Where a body's axis ends, m.
fn far_pole(body: &Standing<'_>) -> f64 {
    let on_axis = body.mesh.nodes.iter().filter(|[r, _]| *r == 0.0);
    body.offset + on_axis.map(|[_, z]| *z).fold(f64::NEG_INFINITY, f64::max)
}

fn write(folder: OutputFolder, scene: &Scene, arrangement: &Arrangement, summary: &Summary) -> anyhow::Result<PathBuf> {
    let bench = bench(arrangement);
    let last = arrangement.beads.len() - 1;
    let far_pole = |bead: usize| far_pole(&bench.bodies[bead]);
    let windows = windows(scene, arrangement, &far_pole);

    let figures = [("mesh", chain(&bench)), ("contacts", contacts(&bench, &windows))];
    for (name, figure) in figures {
        folder.write(format!("{name}.svg"), figure.to_svg()?)?;
        folder.write(format!("{name}.png"), figure.to_png()?)?;
    }
    let meshes: Vec<_> = arrangement.kinds.iter().map(|body| Arc::new(body.mesh().to_field_mesh())).collect();
    let kinds = arrangement.beads.iter().chain(&arrangement.support);
    let bodies = kinds.zip(&bench.bodies).enumerate().map(|(index, (kind, standing))| {
        let name = if index <= last { format!("bead{}", index + 1) } else { "support".to_owned() };
        FieldBody::at_rest(name, meshes[*kind].clone(), standing.offset)
    });
    let mut bytes = Vec::new();
    write_vtu(&Field { time: 0.0, bodies: bodies.collect() }, &mut bytes)?;
    folder.write("mesh.vtu", bytes)?;
    folder.write("mesh.json", summary::json(summary)?)?;
    Ok(folder.finish()?)
}

/// What the figure of contacts shows: the first contact between beads, else the piston's, and that of the support.
fn windows(scene: &Scene, arrangement: &Arrangement, far_pole: &impl Fn(usize) -> f64) -> Vec<Window> {
    let beads = arrangement.beads.len();
    // A little more than a polar patch of the default size.
    let half = 0.06 * scene.chain.beads[0].radius;
    let at = |title: &str, z: f64| Window { title: title.to_owned(), z: (z - half, z + half), r: (0.0, 2.0 * half) };
    let first = if beads > 1 { at("(a) beads 1 and 2", far_pole(0)) } else { at("(a) piston and bead 1", 0.0) };
    let support = match (torus(scene), arrangement.origins.get(beads)) {
        (Some(torus), Some(origin)) => {
            let ([r, z], half) = (torus.contact_point(), 0.18 * torus.section_radius);
            let z = z + origin;
            Window { title: "(b) last bead and support".to_owned(), z: (z - half, z + half), r: (r - half, r + half) }
        }
        _ => at("(b) last bead and support", far_pole(beads - 1)),
    };
    vec![first, support]
}

fn text(summary: &Summary) -> String {
    let Summary { scene, density, kinds, elements, unknowns } = summary;
    let row = |Kind { bodies, quality, mass_kg, mass_error, .. }: &Kind| {
        let mut row = vec![bodies.clone()];
        row.extend([quality.elements, quality.nodes, quality.unknowns, quality.contact_nodes].map(|it| it.to_string()));
        row.push(fixed(1e6 * mass_kg, 6));
        row.push(mass_error.map_or_else(|| "–".to_owned(), |error| significant(error, 2)));
        row.push(fixed(quality.worst_jacobian_ratio, 3));
        row
    };
    let all = ["all bodies".to_owned(), elements.to_string(), String::new(), unknowns.to_string()].to_vec();
    let numbers = ["elements", "nodes", "unknowns", "contact", "mass mg", "its error", "Jacobian"].map(Column::numbers);
    let table = Table {
        caption: String::new(),
        columns: [Column::words("body")].into_iter().chain(numbers).collect(),
        rows: kinds.iter().map(row).chain([all]).collect(),
    };
    let sides = |Kind { bodies, quality, .. }: &Kind| {
        let (shortest, longest) =
            (significant(1e6 * quality.shortest_side, 2), significant(1e6 * quality.longest_side, 3));
        format!("  sides of elements of {bodies}: {shortest} to {longest} µm\n")
    };
    format!(
        "{scene}: mesh of density {density}\n{}{}  \
         contact: nodes that may touch; Jacobian: smallest over largest determinant,\n  worst element\n",
        aligned(&table),
        kinds.iter().map(sides).collect::<String>()
    )
}
