//! Scenes of any kind: written as TOML and read back they are the same.

use std::path::Path;

use granchain::scene::{
    Absorption, AnnulusShape, Baffle, Bead, Chain, ContactLaw, DEFAULT_SLIP_VELOCITY, DEFAULT_TOLERANCE, Damping,
    DampingKind, DampingPlacement, DampingTerm, DiscShape, Drive, DriveKind, FeaSettings, FieldPoint, FlatContact,
    Holder, Horn, Integrator, Limits, Material, MaterialLoss, Medium, ModelKind, ModelSettings, Plate, ReducedSettings,
    Relaxation, Rim, Scene, Scheme, Sensor, Support, Water, WaterMesh, WaterMethod, WaterSettings, load_text,
};
use proptest::prelude::*;

fn materials() -> impl Strategy<Value = Material> {
    (0..3usize, 1e9..400e9f64, -0.9..0.5f64, 100.0..2e4f64).prop_map(
        |(index, youngs_modulus, poissons_ratio, density)| {
            // One name, one material: their names differ with every property.
            let name = ["chrome-steel", "brass", "own_3"][index];
            if index == 0 {
                Material::chrome_steel()
            } else {
                Material {
                    name: format!("{name}{density:.9}").replace('.', "-"),
                    youngs_modulus,
                    poissons_ratio,
                    density,
                }
            }
        },
    )
}

fn drives() -> impl Strategy<Value = Drive> {
    let frequency = 1e3..1e6f64;
    let amplitude = 0.0..1e-5f64;
    let kind = prop_oneof![
        (1..99u32).prop_map(|n| DriveKind::SineCycles { cycles: f64::from(n) / 2.0 }),
        (0.1..99.0f64, 1e-6..1e-3f64).prop_map(|(cycles, ring_up)| DriveKind::ToneBurst { cycles, ring_up }),
        (1..99u32).prop_map(|n| DriveKind::GaussianBurst { cycles: f64::from(n) }),
        "[a-zA-Z0-9 \"\\\\µ.-]{1,12}".prop_map(|name| DriveKind::UnreadRecord { file: Path::new("/lab").join(name) }),
    ];
    (kind, amplitude, frequency).prop_map(|(kind, amplitude, frequency)| {
        let amplitude = if matches!(kind, DriveKind::UnreadRecord { .. }) { 1.0 } else { amplitude };
        Drive { kind, amplitude, frequency }
    })
}

fn dampings() -> impl Strategy<Value = Damping> {
    (0..4, 0.0..10.0f64, 0.0..1e5f64, any::<bool>(), any::<bool>()).prop_map(|(kind, c, gamma, beads, tension)| {
        let (linear, kuwabara_kono) = ((DampingTerm::Linear, c), (DampingTerm::KuwabaraKono, gamma));
        let (kind, coefficients) = match kind {
            0 => (DampingKind::None, [].into()),
            1 => (DampingKind::Linear, [linear].into()),
            2 => (DampingKind::KuwabaraKono, [kuwabara_kono].into()),
            _ => (DampingKind::LinearAndKuwabaraKono, [linear, kuwabara_kono].into()),
        };
        // Without dampers the other two have no effect and keep their defaults.
        let damped = kind != DampingKind::None;
        let placement = if damped && beads { DampingPlacement::Beads } else { DampingPlacement::All };
        Damping { kind, coefficients, placement, tension: damped && tension }
    })
}

fn supports() -> impl Strategy<Value = Support> {
    prop_oneof![
        Just(Support::Flat(FlatContact::Rigid)),
        Just(Support::Flat(FlatContact::HalfSpace)),
        (1.0..1e9f64).prop_map(|stiffness| Support::Spring { stiffness }),
        (0.1..3.0f64).prop_map(Support::resin_annulus),
        (0.1..3.0f64, 0.5e-3..0.6e-3f64, 0.21e-3..0.4e-3f64).prop_map(|(factor, ring_radius, section_radius)| {
            let mut support = Support::resin_annulus(factor);
            if let Support::Annulus { shape, .. } = &mut support {
                *shape = AnnulusShape { ring_radius, section_radius };
            }
            support
        }),
        Just(Support::Free),
        (1e3..1e12f64, -0.9..0.49f64, 0.0..1e-3f64, prop::option::of((1e-4..1e-2f64, materials()))).prop_map(
            |(youngs_modulus, poissons_ratio, loss_time, plate)| Support::Foundation {
                youngs_modulus,
                poissons_ratio,
                loss_time,
                plate: plate.map(|(thickness, material)| Plate { thickness, material }),
            }
        ),
        (1e-4..5e-3f64, 0.01..0.99f64, 0..3usize, materials(), 1..64u32).prop_map(
            |(radius, slender, rim, material, mesh_density)| {
                let rim = [Rim::Clamped, Rim::Supported, Rim::Free][rim];
                Support::Disc { shape: DiscShape { radius, thickness: slender * radius, material, rim }, mesh_density }
            }
        ),
    ]
}

/// Water behind a disc of 1 m, or none; lengths are in its radius.
fn waters() -> impl Strategy<Value = Option<WaterSettings>> {
    let point = (0.0..1.5f64, 0.0..1.5f64).prop_map(|(radius, distance)| FieldPoint { radius, distance });
    let points = prop::collection::vec(point, 1..4);
    let liquid = (500.0..2e3f64, 500.0..3e3f64);
    let absorption = (0.01..99.0f64, 0.01..2.0f64).prop_map(|(at_1_mhz, exponent)| Absorption { at_1_mhz, exponent });
    let settings = (any::<bool>(), liquid, prop::option::of(absorption), 0..3, points, 2.2..9.0f64, 0.01..0.5f64)
        .prop_map(|(tissue, (density, sound_speed), absorption, way, field_points, radius, side)| WaterSettings {
            medium: if tissue { Medium::Tissue } else { Medium::Water },
            liquid: Water { density, sound_speed },
            absorption,
            baffle: if way == 2 { Baffle::Soft } else { Baffle::Rigid },
            method: if way == 0 { WaterMethod::Rayleigh } else { WaterMethod::Elements(WaterMesh { radius, side }) },
            field_points,
        });
    prop::option::of(settings)
}

/// What a disc brings along.
fn behind_disc(scene: &mut Scene, water: Option<WaterSettings>, steps: u32) {
    let Support::Disc { shape, .. } = &scene.support else { return };
    let size = shape.radius;
    scene.water = water.map(|mut water| {
        for point in &mut water.field_points {
            (point.radius, point.distance) = (point.radius * size, point.distance * size);
        }
        if let WaterMethod::Elements(mesh) = &mut water.method {
            (mesh.radius, mesh.side) = (mesh.radius * size, mesh.side * size);
        }
        water
    });
    if scene.model.kind == ModelKind::Chain {
        scene.drive.frequency = scene.drive.frequency.min(49e3);
        scene.model.integrator = Integrator::OnDisc { step: scene.output_step / f64::from(steps) };
    }
}

fn chains() -> impl Strategy<Value = Chain> {
    let bead = (0.4e-3..0.6e-3f64, materials()).prop_map(|(radius, material)| Bead::sphere(radius, material));
    (prop::collection::vec(bead, 1..9), 0..3, 0.0..1.0f64, 1e-9..1e-6f64).prop_map(|(mut beads, kind, force, gap)| {
        // The annulus' law is that of this last bead.
        if let Some(last) = beads.last_mut() {
            last.radius = 0.5e-3;
        }
        let contacts = beads.len() + 1;
        let gaps = match kind {
            0 => vec![0.0; contacts],
            1 => vec![gap; contacts],
            _ => (0..contacts).map(|index| gap * index as f64 / contacts as f64).collect(),
        };
        let sensor = (kind == 1).then_some(Sensor { bead: contacts - 1, share: force });
        let gravity = if kind == 2 { 10.0 * force } else { 0.0 };
        Chain { beads, gaps, precompression: if kind == 0 { force } else { 0.0 }, gravity, sensor }
    })
}

/// What only models of meshed bodies use.
#[derive(Debug, Clone)]
struct Analysis {
    fea: FeaSettings,
    modes: u32,
    /// Steps an output sample.
    steps: u32,
    resin: Material,
}

fn analyses() -> impl Strategy<Value = Analysis> {
    let scheme = prop_oneof![
        Just(Scheme::Trapezoid),
        (0.0..0.333f64).prop_map(|dissipation| Scheme::HilberHughesTaylor { dissipation }),
    ];
    (2..99u32, scheme, 1..9u32, materials(), 0..99u32, 0.01..0.5f64).prop_map(
        |(density, scheme, steps, resin, modes, contact_patch)| Analysis {
            modes,
            fea: FeaSettings { density, contact_patch, scheme, ..FeaSettings::default() },
            steps,
            resin,
        },
    )
}

fn analyse(scene: &mut Scene, analysis: Analysis) {
    // A step that the drive allows, and that divides the output step.
    scene.drive.frequency = scene.drive.frequency.min(49e3);
    let step = scene.output_step / f64::from(analysis.steps);
    let FeaSettings { density, contact_patch, .. } = analysis.fea;
    if scene.model.kind == ModelKind::Reduced {
        scene.model.reduced = ReducedSettings { density, contact_patch, step, modes: analysis.modes };
    } else {
        scene.model.fea = FeaSettings { step, ..analysis.fea };
    }
    if let Support::Annulus { material, .. } = &mut scene.support {
        *material = analysis.resin;
    }
}

/// A horn, a bead guide and losses, as far as they have an effect in the scene.
fn affect(scene: &mut Scene, (which, one, other): (u32, f64, f64)) {
    let has = |bit: u32| which >> bit & 1 == 1;
    let is_chain = scene.model.kind == ModelKind::Chain;
    if has(0) {
        let quality = if has(1) { 1e3 * one } else { f64::INFINITY };
        scene.horn = Some(Horn { mass: one, frequency: 1e5 * other, quality });
    }
    let least = scene.chain.beads.iter().map(|bead| bead.radius).fold(f64::INFINITY, f64::min);
    let given = |bit: u32, value: f64| if has(bit) { value } else { 0.0 };
    let mut holder = Holder {
        drag: given(2, one),
        friction_force: given(3, other),
        clearance: given(4, if is_chain { 0.5 } else { 0.1 } * least * one),
        friction_coefficient: if has(4) { given(5, other) } else { 0.0 },
        slip_velocity: 0.0,
    };
    let exact = is_chain && !matches!(scene.support, Support::Disc { .. });
    if !exact {
        holder.slip_velocity = DEFAULT_SLIP_VELOCITY;
    }
    if holder.has_friction() && has(6) {
        holder.slip_velocity = other;
    }
    scene.holder = Some(holder).filter(|holder| holder.drag + holder.friction_force + holder.clearance > 0.0);
    scene.yield_strength = Some(1e9 * one).filter(|_| is_chain && has(7));
    let is_ring = matches!(scene.support, Support::Annulus { .. });
    if !is_chain {
        scene.loss.beads = given(8, one);
        if is_ring {
            scene.loss.support = given(9, other);
        }
    }
    scene.loss.relaxation = Some(Relaxation { strength: other, time: one }).filter(|_| is_ring && has(9));
}

fn scenes() -> impl Strategy<Value = Scene> {
    let model = (0..3, -14.0..-2.0f64).prop_map(|(kind, exponent)| {
        let kind = [ModelKind::Chain, ModelKind::Reduced, ModelKind::Fea][kind as usize];
        let tolerance = 10f64.powf(exponent).clamp(1e-14, 1e-2);
        let integrator = Integrator::DormandPrince853 { tolerance };
        // What the kind does not use keeps its defaults.
        let unused = Integrator::DormandPrince853 { tolerance: DEFAULT_TOLERANCE };
        ModelSettings {
            kind,
            integrator: if kind.is_meshed() { unused } else { integrator },
            reduced: ReducedSettings::default(),
            fea: FeaSettings::default(),
            limits: Limits::default(),
        }
    });
    (
        ("[a-z0-9 _-]{1,9}", "\\PC{0,20}", chains(), drives(), supports()),
        (dampings(), any::<bool>(), 0.0..3.0f64, 1e-5..1e-2f64, 1e-8..1e-6f64, model),
        analyses(),
        waters(),
        (0..1024u32, 1e-6..1.0f64, 1e-6..1.0f64),
    )
        .prop_map(|(first, second, analysis, water, further)| {
            let (name, description, chain, drive, support) = first;
            let (damping, steel, amplitude_scale, duration, output_step, model) = second;
            let vibrometer_bandwidth = drive.frequency + 0.3 / output_step;
            let piston = if steel { FlatContact::HalfSpace } else { FlatContact::Rigid };
            let piston_material = Some(Material::titanium()).filter(|_| steel && amplitude_scale > 1.0);
            let mut scene = Scene {
                name,
                description,
                chain,
                piston,
                piston_material,
                drive,
                amplitude_scale,
                support,
                water: None,
                damping,
                contact_law: ContactLaw::Hertz,
                yield_strength: None,
                horn: None,
                holder: None,
                loss: MaterialLoss::default(),
                duration,
                output_step,
                vibrometer_bandwidth,
                model,
            };
            let steps = analysis.steps;
            if model.kind.is_meshed() {
                analyse(&mut scene, analysis);
            } else if steps % 2 == 1 {
                let FeaSettings { density, contact_patch, .. } = analysis.fea;
                scene.contact_law = ContactLaw::FiniteBody;
                scene.model.fea = FeaSettings { density, contact_patch, ..FeaSettings::default() };
                if let Support::Annulus { material, .. } = &mut scene.support {
                    *material = analysis.resin;
                }
            }
            if scene.support == Support::Free {
                scene.chain.precompression = 0.0;
            }
            behind_disc(&mut scene, water, steps);
            affect(&mut scene, further);
            scene
        })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_scene_written_as_toml_reads_back_as_the_same_scene(scene in scenes()) {
        let text = scene.to_toml();
        let loaded = load_text(&text, Path::new("/elsewhere/own.toml"), &[]);
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}\n{text}"));
        prop_assert_eq!(&loaded.scene, &scene);
        prop_assert!(loaded.notes.is_empty());
        // Canonical: written again it is the same text.
        prop_assert_eq!(loaded.scene.to_toml(), text);
    }
}
