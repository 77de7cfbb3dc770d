//! Settings of the finite element analysis in scene files: what they default to, what is refused, what a change of model drops.

use std::path::Path;

use granchain::scene::{
    self, AnnulusShape, DEFAULT_FEA_STEP, DEFAULT_WATER_STEP, FeaSettings, Integrator, Loaded, Material, ModelKind,
    Scene, SceneError, Scheme, Support, load_text, load_with_notes,
};

fn loaded(name: &str, overrides: &[&str]) -> Result<Loaded, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    load_with_notes(name, &overrides)
}

fn overridden(name: &str, overrides: &[&str]) -> Scene {
    loaded(name, overrides).unwrap().scene
}

fn refusal(name: &str, overrides: &[&str]) -> String {
    loaded(name, overrides).unwrap_err().to_string()
}

fn on(scene: &Scene) -> Vec<&'static str> {
    scene::effects(scene).iter().filter(|effect| effect.on).map(|effect| effect.name).collect()
}

#[test]
fn every_built_in_scene_runs_as_finite_elements_by_its_kind_alone() {
    for built_in in scene::BUILT_IN {
        let Loaded { scene, notes, .. } = loaded(built_in.name, &["model.kind=fea"]).unwrap();
        let default = FeaSettings::default();
        // In front of water the step resolves 1 MHz.
        let step = if scene.water.is_some() { DEFAULT_WATER_STEP } else { default.step };
        assert_eq!((scene.model.kind, scene.model.fea), (ModelKind::Fea, FeaSettings { step, ..default }));
        assert_eq!(notes, [""; 0]);
        assert!(on(&scene).contains(&"elastic bodies"));
    }
    let default = FeaSettings::default();
    assert_eq!((default.density, default.step, default.scheme), (12, 0.1e-6, Scheme::Trapezoid));
    let chain = overridden("annulus", &[]);
    assert_eq!(chain.model.fea, default);
    assert!(!on(&chain).contains(&"elastic bodies"));
}

#[test]
fn every_setting_has_its_key() {
    let scene = overridden(
        "annulus",
        &[
            "model.kind=fea",
            "model.mesh_density=16",
            "model.contact_patch=0.2",
            "model.step=0.02us",
            "model.integrator=hht",
            "model.numerical_dissipation=0.1",
            "materials.resin.youngs_modulus=2GPa",
        ],
    );
    let expected = FeaSettings {
        contact_patch: 0.2,
        density: 16,
        step: 0.02e-6,
        scheme: Scheme::HilberHughesTaylor { dissipation: 0.1 },
    };
    assert_eq!(scene.model.fea, expected);
    let material = Material { youngs_modulus: 2e9, ..Material::resin() };
    assert_eq!(scene.support, Support::Annulus { shape: AnnulusShape::published(), stiffness_factor: 1.0, material });
    assert_eq!(on(&scene)[4..], ["elastic bodies", "numerical dissipation"]);
}

#[test]
fn schemes_without_numerical_damping_are_the_trapezoid_and_with_it_stay_stable() {
    for dissipation in [0.0, 0.05, 1.0 / 3.0] {
        let scheme = Scheme::HilberHughesTaylor { dissipation };
        let (beta, gamma) = (scheme.beta(), scheme.gamma());
        // Unconditional stability of Newmark's family: 2β ≥ γ ≥ ½; largest damping at infinity: β = (½ + γ)²/4.
        assert!(2.0 * beta >= gamma && gamma >= 0.5);
        assert!((beta - (0.5 + gamma).powi(2) / 4.0).abs() < 1e-15);
    }
    assert_eq!(
        (Scheme::Trapezoid.beta(), Scheme::Trapezoid.gamma(), Scheme::Trapezoid.dissipation()),
        (0.25, 0.5, 0.0)
    );
}

#[test]
fn a_step_that_cannot_resolve_the_drive_is_refused_with_the_limit() {
    assert_eq!(
        refusal("rigid", &["model.kind=fea", "model.step=1us"]),
        "--set model.step=1us: `model.step`: expected at most 684 ns, a twentieth of a drive period, found 1 µs"
    );
    // The default, too.
    assert_eq!(
        refusal("rigid", &["model.kind=fea", "drive.frequency=1MHz"]),
        "built-in scene `rigid`: `model.step`: expected at most 50 ns, a twentieth of a drive period, found 0.1 µs"
    );
    assert!(refusal("rigid", &["model.kind=fea", "model.step=0s"]).contains("a positive, finite value, found 0"));
}

#[test]
fn numbers_out_of_their_range_are_refused() {
    for (integrator, text, expected) in [
        ("trapezoid", "model.mesh_density=1", "a whole number from 2 to 128, found 1"),
        ("trapezoid", "model.mesh_density=2.5", "a whole number from 2 to 128, found 2.5"),
        ("hht", "model.numerical_dissipation=0.34", "a value from 0 to 1/3, found 0.34"),
        ("hht", "model.numerical_dissipation=-0.1", "a value from 0 to 1/3, found -0.1"),
        ("trapezoid", "materials.resin.poissons_ratio=0.5", "Poisson's ratio above −1 and below 0.5, found 0.5"),
        ("trapezoid", "materials.resin.poissons_ratio=-1", "Poisson's ratio above −1 and below 0.5, found -1"),
    ] {
        let key = text.split('=').next().unwrap();
        let mut overrides = vec!["model.kind=fea".to_owned(), format!("model.integrator={integrator}")];
        if integrator != "trapezoid" {
            overrides.push("model.numerical_dissipation=0.1".to_owned());
        }
        overrides.push(text.to_owned());
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        assert_eq!(refusal("annulus", &overrides), format!("--set {text}: `{key}`: expected {expected}"));
    }
    assert_eq!(
        refusal("rigid", &["model.kind=fea", "model.integrator=hht"]),
        "built-in scene `rigid`: `model.numerical_dissipation` is missing (a scheme with numerical damping needs it); \
         add `model.numerical_dissipation = 0.1`, or pass it with --set"
    );
}

#[test]
fn a_step_that_does_not_divide_the_output_step_is_shortened_and_said() {
    let step = |overrides: &[&str]| {
        let Loaded { scene, notes, .. } = loaded("rigid", &[&["model.kind=fea"], overrides].concat()).unwrap();
        // Written out, the step needs no remark any more.
        let again = load_text(&scene.to_toml(), Path::new("own.toml"), &[]).unwrap();
        assert_eq!((again.scene, again.notes.len()), (scene.clone(), 0));
        (scene.model.fea.step, notes)
    };
    assert_eq!(step(&["model.step=20ns"]), (20e-9, vec![]));
    // 0.1 µs/(1/30 µs) is 3 up to rounding.
    assert_eq!(step(&["model.step=3.3333333333333333e-8"]).1, [""; 0]);
    let (shortened, notes) = step(&["model.step=60ns"]);
    // The division itself.
    assert!((shortened - 50e-9).abs() < 1e-22);
    assert_eq!(
        notes,
        [
            "`model.step` 60 ns does not divide `output_step` 0.1 µs; taken as 50 ns, so that every sample is a computed state"
        ]
    );
    let (shortened, notes) = step(&["output_step=30ns"]);
    assert_eq!((shortened, notes.len()), (30e-9, 1));
    assert_eq!(step(&["output_step=0.3us"]), (DEFAULT_FEA_STEP, vec![]));
}

#[test]
fn a_change_of_model_drops_what_only_the_other_uses() {
    let own = "extends = \"annulus\"\n[chain]\noverride = [{ bead = 2, radius = 4e-4 }]\n\
               [model]\nkind = \"fea\"\nintegrator = \"hht\"\n\
               numerical_dissipation = 0.1\nstep = \"50 ns\"\nmesh_density = 8";
    let read = |overrides: &[&str]| {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        load_text(own, Path::new("bench/own.toml"), &overrides).unwrap().scene
    };
    let fea = read(&[]);
    assert_eq!(fea.model.fea.step, 50e-9);
    let chain = read(&["model.kind=chain"]);
    assert_eq!(chain.model, overridden("annulus", &[]).model);
    assert_eq!(chain.chain.beads[1].radius, 4e-4);
    assert_eq!(chain.support, Support::resin_annulus(1.0));
    let trapezoid = read(&["model.integrator=trapezoid"]).model.fea;
    assert_eq!((trapezoid.scheme, trapezoid.step, trapezoid.density), (Scheme::Trapezoid, 50e-9, 8));
    // And from the chain's tolerance to the finite elements.
    let own = "extends = \"rigid\"\nmodel = { tolerance = 1e-8 }";
    let scene = load_text(own, Path::new("own.toml"), &["model.kind=fea".into()]).unwrap().scene;
    assert_eq!(scene.model.fea, FeaSettings::default());
    assert_eq!(scene.model.integrator, Integrator::DormandPrince853 { tolerance: scene::DEFAULT_TOLERANCE });
}

#[test]
fn keys_of_the_other_model_are_refused_with_the_model_they_belong_to() {
    for key in ["model.modes=2", "loss.support=0.1"] {
        let message = refusal("annulus", &[key]);
        assert!(message.contains("has no effect with `model.kind = \"chain\"`"), "{message}");
        let owner = if key.contains("modes") { "reduced" } else { "fea" };
        assert!(message.contains("it belongs to `model.kind = \"") && message.contains(owner), "{message}");
    }
    let unfitted = refusal("annulus", &["model.mesh_density=8"]);
    assert!(unfitted.contains("it belongs to `contact.law = \"finite-body\"`"), "{unfitted}");
    assert!(
        refusal("rigid", &["model.kind=fea", "model.tolerance=1e-9"])
            .contains("it belongs to `model.kind = \"chain\"`")
    );
    assert_eq!(
        refusal("rigid", &["model.kind=fea", "model.integrator=symplectic", "model.step=1e-8"]),
        "--set model.integrator=symplectic: `model.integrator`: expected one of `trapezoid`, `hht`, found `symplectic`"
    );
    assert!(refusal("rigid", &["model.integrator=hht"]).contains("expected one of `dormand-prince-853`, `symplectic`"));
    // Without effect although no integrator is named.
    let own = "extends = \"rigid\"\nmodel = { kind = \"fea\", numerical_dissipation = 0.1 }";
    let message = load_text(own, Path::new("own.toml"), &[]).unwrap_err().to_string();
    assert!(message.contains("has no effect with `model.integrator = \"trapezoid\"`"), "{message}");
}

#[test]
fn bodies_of_gmsh_files_are_answered_with_what_to_write_instead() {
    let bead = "a bead is a sphere of its `radius`, meshed as finely as `model.mesh_density` says";
    for key in ["chain.mesh", "chain.mesh_unit"] {
        let message = refusal("rigid", &["model.kind=fea", &format!("{key}=bead.msh")]);
        assert_eq!(message, format!("--set {key}=bead.msh: `{key}`: bodies of Gmsh files are gone: {bead}"));
    }
    let message = refusal("rigid", &["chain.override=[{bead=2,mesh=\"b.msh\"}]"]);
    assert!(message.ends_with(&format!("`chain.override.mesh`: bodies of Gmsh files are gone: {bead}")), "{message}");
    for set in ["support.kind=body", "support.mesh=ring.msh", "support.mesh_unit=1 mm"] {
        let message = refusal("annulus", &["model.kind=fea", set]);
        assert!(message.contains("write `support.kind = \"annulus\"` with `support.ring_radius`"), "{message}");
    }
}

#[test]
fn options_that_are_gone_are_refused_but_where_they_said_what_is_left() {
    for (set, part) in [
        ("support.normal=moving", "0.19 % too large per µm of travel"),
        ("model.contact_mass=consistent", "does not converge as the step falls"),
        ("model.elements=mixed", "all are 8-node quadrilaterals"),
        ("model.integrator=newmark", "write \"hht\""),
    ] {
        let message = refusal("annulus", &["model.kind=fea", set]);
        assert!(message.starts_with(&format!("--set {set}: `")) && message.contains(part), "{message}");
    }
    let idle = ["support.normal=fixed", "model.contact_mass=massless", "model.elements=quadrilaterals"];
    assert_eq!(overridden("annulus", &idle), overridden("annulus", &[]));
    let own = "extends = \"annulus\"\nsupport = { normal = \"fixed\" }";
    assert_eq!(
        load_text(own, Path::new("annulus.toml"), &[]).unwrap().scene.support,
        overridden("annulus", &[]).support
    );
}

#[test]
fn supports_that_a_model_cannot_hold_a_bead_with_are_refused() {
    assert!(refusal("annulus", &["support.material=amber"]).contains("unknown material `amber`"));
    assert_eq!(overridden("annulus", &["model.kind=fea", "chain.radius=0.6mm"]).chain.beads[5].radius, 0.6e-3);
    assert_eq!(
        refusal("annulus", &["model.kind=fea", "chain.radius=0.25mm"]),
        "built-in scene `annulus`: the last bead has radius 250 µm and falls through the annulus (opening \
         radius 0.3 mm); use a larger bead, a smaller ring (`support.ring_radius`), or another `support.kind`"
    );
    assert_eq!(
        refusal("annulus", &["support.section_radius=0.6mm"]),
        "--set support.section_radius=0.6mm: `support.section_radius`: expected a section radius below the ring radius 550 µm, which leaves an \
         opening; change one of both, found 0.6 mm"
    );
    assert_eq!(
        refusal("annulus", &["support.ring_radius=0.745mm"]),
        "--set support.ring_radius=0.745mm: the last bead touches the ring with a normal 83.4° from the axis (sin φ = R/(a + b)), expected 25° to \
         80°; take a smaller ring or a larger bead"
    );
    assert!(refusal("annulus", &["chain.radius=1.2mm"]).contains("take a larger ring or a smaller bead"));
    for (key, value) in [("support.ring_radius", "0.6mm"), ("support.section_radius", "0.2mm")] {
        let message = refusal("rigid", &[&format!("{key}={value}")]);
        assert!(message.contains("it belongs to `support.kind = \"annulus\"`"), "{message}");
    }
    assert_eq!(
        refusal("annulus", &["support.kind=free", "chain.precompression=0.1 N"]),
        "--set chain.precompression=0.1 N: `chain.precompression`: expected 0 N before a free end (`support.kind` = \"free\"), which holds no static \
         force, found 0.1 N"
    );
}

#[test]
fn a_ring_is_its_own_where_the_law_of_the_papers_does_not_hold() {
    let own = |overrides: &[&str]| overridden("annulus", overrides).has_own_ring();
    for same in ["alpha=1", "chain.radius=0.495mm", "chain.material=aluminium", "support.stiffness_factor=0.7"] {
        assert!(!own(&[same]), "{same}");
    }
    for other in [
        "chain.radius=0.6mm",
        "chain.material=acrylic",
        "support.ring_radius=0.551mm",
        "support.section_radius=0.251mm",
        "support.material=acrylic",
        "materials.resin.youngs_modulus=2GPa",
    ] {
        assert!(own(&[other]), "{other}");
    }
    let shape = |overrides: &[&str]| match overridden("annulus", overrides).support {
        Support::Annulus { shape, .. } => shape,
        other => panic!("{other:?}"),
    };
    assert_eq!(shape(&[]), AnnulusShape::published());
    let given = ["support.ring_radius=2 mm", "support.section_radius=0.8 mm", "chain.radius=1.5 mm"];
    assert_eq!(shape(&given), AnnulusShape { ring_radius: 2e-3, section_radius: 0.8e-3 });
}
