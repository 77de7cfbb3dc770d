//! A disc and the water behind it in scene files: what they default to, what they refuse, what a change of support drops.

use std::{f64::consts::LN_10, path::Path};

use granchain::{
    scene::{
        self, Absorption, Baffle, DampingPlacement, DampingTerm, DiscShape, DriveKind, FieldPoint, Integrator,
        Material, Medium, ModelKind, Rim, Scene, Support, Water, WaterMesh, WaterMethod, WaterSettings, load,
        load_preferring, load_text,
    },
    signal::{Dimension, Quantity},
};

fn overridden(name: &str, overrides: &[&str]) -> Scene {
    load(name, &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(overrides: &[&str]) -> String {
    load("water", &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>()).unwrap_err().to_string()
}

fn water(overrides: &[&str]) -> WaterSettings {
    overridden("water", overrides).water.unwrap()
}

#[test]
fn water_is_the_source_of_ultrasound_of_the_paper() {
    let scene = overridden("water", &[]);
    let shape =
        DiscShape { radius: 1e-3, thickness: 0.25e-3, material: Material::vitreous_carbon(), rim: Rim::Clamped };
    assert_eq!(scene.support, Support::Disc { shape, mesh_density: 6 });
    assert_eq!(scene.water, Some(WaterSettings::default()));
    assert_eq!((scene.drive.kind, scene.drive.amplitude), (DriveKind::GaussianBurst { cycles: 30.0 }, 3.96e-6));
    assert_eq!(
        (scene.damping.coefficients[DampingTerm::Linear], scene.damping.placement),
        (0.3, DampingPlacement::All)
    );
    assert_eq!(scene.model.kind, ModelKind::Chain);
    assert_eq!(scene.model.integrator, Integrator::OnDisc { step: 25e-9 });
    let default = WaterSettings::default();
    assert_eq!(default.liquid, Water { density: 1000.0, sound_speed: 1500.0 });
    assert_eq!(default.field_points, [FieldPoint { radius: 0.0, distance: 1e-3 }]);
}

#[test]
fn a_disc_alone_has_every_default_of_the_scene_water() {
    let own = load_text(
        "extends = \"chain\"\nsupport.kind = \"disc\"\nmodel.integrator = \"symplectic\"",
        Path::new("own.toml"),
        &[],
    );
    let (own, built_in) = (own.unwrap().scene, overridden("water", &[]));
    assert_eq!((&own.support, &own.water, &own.model), (&built_in.support, &built_in.water, &built_in.model));
}

#[test]
fn every_key_arrives_in_si() {
    let scene = overridden(
        "water",
        &[
            "disc.radius=2mm",
            "disc.thickness=0.5mm",
            "disc.material=glass",
            "disc.rim=supported",
            "disc.mesh_density=4",
            "water.medium=tissue",
            "water.sound_speed=1480",
            "water.absorption=0.5 dB/cm",
            "water.absorption_exponent=1.1",
            "water.baffle=soft",
            "water.method=elements",
            "water.mesh_radius=6mm",
            "water.mesh_side=0.1mm",
            "water.field_points=[{z=\"2 mm\"},{r=\"1 mm\",z=0}]",
        ],
    );
    let shape = DiscShape { radius: 2e-3, thickness: 0.5e-3, material: Material::glass(), rim: Rim::Supported };
    assert_eq!(scene.support, Support::Disc { shape, mesh_density: 4 });
    let settings = scene.water.unwrap();
    let absorption = settings.absorption.unwrap();
    // 0.5 dB/cm = 50 dB/m; 1 dB = ln 10/20 Np.
    assert!((absorption.at_1_mhz / (50.0 * LN_10 / 20.0) - 1.0).abs() < 1e-15 && absorption.exponent == 1.1);
    let expected = WaterSettings {
        medium: Medium::Tissue,
        liquid: Water { density: 1050.0, sound_speed: 1480.0 },
        absorption: Some(Absorption { ..absorption }),
        baffle: Baffle::Soft,
        method: WaterMethod::Elements(WaterMesh { radius: 6e-3, side: 1e-4 }),
        field_points: vec![FieldPoint::on_axis(2e-3), FieldPoint { radius: 1e-3, distance: 0.0 }],
    };
    assert_eq!(settings, expected);
    assert_eq!(Quantity::parse_as("1 Np/m", Dimension::ATTENUATION).unwrap(), 1.0);
}

#[test]
fn the_way_follows_from_model_and_baffle_unless_it_is_named() {
    let way = |overrides: &[&str]| water(overrides).method;
    assert_eq!(way(&[]), WaterMethod::Rayleigh);
    // The built-in scene names the way of its own baffle; a file of one's own names its own, and else the baffle or the model decides.
    assert_eq!(way(&["water.baffle=soft"]), WaterMethod::Elements(WaterMesh::default()));
    let own = |text: &str| {
        let text = format!("extends = \"chain\"\nsupport.kind = \"disc\"\nmodel.integrator = \"symplectic\"\n{text}");
        load_text(&text, Path::new("own.toml"), &[]).unwrap().scene.water.unwrap().method
    };
    let elements = WaterMethod::Elements(WaterMesh::default());
    assert_eq!(own(""), WaterMethod::Rayleigh);
    assert_eq!(own("water.baffle = \"soft\""), elements);
    assert_eq!(own("water.method = \"elements\""), elements);
    let fea = "extends = \"rigid\"\nsupport.kind = \"disc\"\nmodel.kind = \"fea\"";
    assert_eq!(load_text(fea, Path::new("own.toml"), &[]).unwrap().scene.water.unwrap().method, elements);
    // A larger disc has a larger mesh of the same proportions.
    let large = WaterMethod::Elements(WaterMesh { radius: 5e-3, side: 1e-4 });
    assert_eq!(way(&["water.method=elements", "disc.radius=2mm"]), large);
}

#[test]
fn a_vacuum_is_no_water_and_uses_no_key_of_it() {
    let vacuum =
        "extends = \"chain\"\nsupport.kind = \"disc\"\nmodel.integrator = \"symplectic\"\nwater.medium = \"none\"\n";
    assert_eq!(load_text(vacuum, Path::new("own.toml"), &[]).unwrap().scene.water, None);
    let refused = load_text(&format!("{vacuum}water.density = 900"), Path::new("own.toml"), &[]).unwrap_err();
    assert!(refused.to_string().contains("`water.density`"), "{refused}");
    assert_eq!(overridden("water", &["water.medium=none"]).water, None);
}

#[test]
fn another_support_drops_disc_and_water() {
    let scene = overridden("water", &["support.kind=rigid"]);
    assert_eq!(scene.water, None);
    assert!(scene.settings().iter().all(|s| !s.key.starts_with("disc.") && !s.key.starts_with("water.")));
    let refused = load("rigid", &["disc.radius=1mm".into()]).unwrap_err().to_string();
    assert!(refused.contains("`disc.radius`") && refused.contains("disc"), "{refused}");
    // A liquid by another name is that liquid.
    assert_eq!(water(&["water.medium=tissue"]).liquid, Water::tissue());
}

#[test]
fn what_cannot_be_is_refused_with_figures() {
    let cases: [(&[&str], &str); 11] = [
        (&["disc.thickness=1mm"], "`disc.thickness`: expected a thickness below the disc's radius 1 mm"),
        (&["disc.radius=0.2mm"], "below the disc's radius 0.2 mm"),
        (&["disc.material=steel"], "steel"),
        (&["disc.rim=glued"], "one of"),
        (&["water.field_points=[{z=-1e-3}]"], "expected 0 or more: z counts from the disc's back into the water"),
        (&["water.field_points=[]"], "expected 1 to 100 points, found 0"),
        (&["water.field_points=[{z=1e-3,x=2}]"], "unknown key `water.field_points.x`"),
        (
            &["water.method=elements", "water.field_points=[{z=3e-3}]"],
            "within the mesh of `water.mesh_radius` = 2.5 mm",
        ),
        (&["water.baffle=soft", "water.method=rayleigh"], "`elements` where `water.baffle` is \"soft\""),
        (&["water.mesh_side=0.1mm"], "`water.mesh_side`"),
        (&["water.absorption_exponent=1"], "`water.absorption`"),
    ];
    for (overrides, expected) in cases {
        let found = refusal(overrides);
        assert!(found.contains(expected), "{overrides:?}: {found}");
    }
    assert!(refusal(&["model.integrator=dormand-prince-853", "model.tolerance=1e-9"]).contains("symplectic"));
}

#[test]
fn the_clock_divides_the_output_step_and_says_so() {
    let loaded = scene::load_with_notes("water", &["model.step=30ns".into()]).unwrap();
    assert_eq!(loaded.scene.model.integrator, Integrator::OnDisc { step: 25e-9 });
    assert!(loaded.notes[0].contains("taken as 25 ns"), "{:?}", loaded.notes);
}

#[test]
fn effects_and_listing_name_disc_and_water() {
    let on = |scene: &Scene| -> Vec<&str> {
        scene::effects(scene).iter().filter(|effect| effect.on).map(|effect| effect.name).collect()
    };
    let names = ["linear dampers", "dampers at piston and support", "elastic disc", "water behind the disc"];
    assert_eq!(on(&overridden("water", &[])), names);
    assert_eq!(on(&overridden("water", &["water.medium=none"])), names[..3]);
    let lossy = ["water.absorption=1 dB/m", "water.absorption_exponent=2"];
    assert!(on(&overridden("water", &lossy)).contains(&"absorption in the water"));
    let text = overridden("water", &[]).to_toml();
    assert!(text.contains("field_points = [{ r = \"0 m\", z = \"1 mm\" }]"), "{text}");
}

#[test]
fn a_disc_that_names_no_model_is_behind_the_chain() {
    let loaded = load_preferring("rigid", &["support.kind=disc".into()], ModelKind::Reduced).unwrap();
    assert_eq!(loaded.scene.model.kind, ModelKind::Chain);
    assert!(loaded.notes[0].contains("usual model before the disc"), "{:?}", loaded.notes);
}
