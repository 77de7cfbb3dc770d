//! Commented scene files of the benches that laboratories build: what `granchain scene init --bench` writes.

use clap::ValueEnum;

/// `--bench`: what holds the far end of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BenchChoice {
    /// A rigid wall
    #[value(alias = "rigid")]
    Wall,
    /// A ring on which the last bead lies
    #[value(alias = "annulus")]
    Ring,
    /// A one-sided linear spring
    Spring,
    /// A disc on water
    Disc,
    /// Nothing: the last bead is free
    Free,
    /// A column of beads on a soft half-space, struck by a falling bead
    Impact,
}

impl BenchChoice {
    const fn description(self) -> &'static str {
        match self {
            Self::Wall => "steel beads between a horn and a rigid wall",
            Self::Ring => "steel beads between a horn and a ring",
            Self::Spring => "steel beads between a horn and a spring",
            Self::Disc => "steel beads between a horn and a disc on water",
            Self::Free => "steel beads in front of a horn, the last one free",
            Self::Impact => "steel beads on a soft half-space, struck by one bead more",
        }
    }

    /// The tables on the far end, with every key that describes it.
    const fn far_end(self) -> &'static str {
        match self {
            Self::Wall => {
                "[support]\n# A rigid, frictionless flat. \"half-space\" is an elastic wall of the last bead's material (chain only).\n\
                 kind = \"rigid\"\n"
            }
            Self::Ring => {
                "[support]\n# A half disc revolved about the axis, its flat side outwards and clamped. The last bead must be larger than the opening,\n\
                 # ring_radius - section_radius, and touch the ring 25 to 80 degrees from the axis: sin = ring_radius/(bead + section_radius).\n\
                 kind = \"annulus\"\n\
                 # To the centres of the sections and to the clamped side.\nring_radius = \"0.55 mm\"\n\
                 # Of the half disc.\nsection_radius = \"0.25 mm\"\n\
                 material = \"resin\"\n# A factor on its stiffness, 1 if geometry and modulus are right; `calibrate --fit` knows it as support_stiffness.\n\
                 stiffness_factor = 1.0\n\n\
                 [materials.resin]\nyoungs_modulus = \"1.4 GPa\"\npoissons_ratio = 0.35\ndensity = \"1235 kg/m^3\"\n"
            }
            Self::Spring => {
                "[support]\n# Massless and one-sided: it pushes and never pulls. `calibrate --fit` knows the stiffness as support_stiffness.\n\
                 kind = \"spring\"\nstiffness = \"0.7e6 N/m\"\n"
            }
            Self::Disc => {
                "[support]\nkind = \"disc\"\n\n[disc]\nradius = \"1 mm\"\nthickness = \"0.25 mm\"\n\
                 # vitreous-carbon, glass, aluminium, acrylic, or one of your own in [materials.NAME].\nmaterial = \"vitreous-carbon\"\n\
                 # How the lateral face is held: clamped, supported (along the axis only), free.\nrim = \"clamped\"\n\n\
                 [water]\n# \"tissue\", or \"none\" for a disc in air; density and sound_speed may be changed by themselves.\nmedium = \"water\"\n\
                 # Field points of the pressure, z from the back of the disc.\nfield_points = [{ r = \"0 mm\", z = \"1 mm\" }]\n"
            }
            // Its file is that of the built-in scene, which has no horn.
            Self::Impact => "",
            Self::Free => {
                "[support]\n# Nothing touches the last bead behind: it flies off, and no static force can hold the chain.\nkind = \"free\"\n"
            }
        }
    }

    /// A scene file called `name` (as TOML).
    pub fn toml(self, name: &str) -> String {
        let (description, far_end) = (self.description(), self.far_end());
        let precompression = if self == Self::Free { "" } else { PRECOMPRESSION };
        format!(
            "name = {name}\ndescription = \"{description}\"\n\n\
             # Factor on the drive; of a horn's record 1 if both sensitivities are right and the horn's face moves as its recorded point.\nalpha = 1.0\n\
             # The burst lasts 548 us; the rest shows its decay. A record that drives sets it by itself.\nduration = \"700 us\"\n\n\
             [chain]\nbeads = 6\nradius = \"0.5 mm\"\nmaterial = \"chrome-steel\"\n\
             # Just touching: one length for all contacts, or {{ contact1 = \"5 nm\" }}.\ngaps = \"0 m\"\n{precompression}\n\
             [materials.chrome-steel]\nyoungs_modulus = \"201 GPa\"\npoissons_ratio = 0.3\ndensity = \"7833 kg/m^3\"\n\n\
             [piston]\n# \"half-space\" is a horn of the first bead's material (chain only).\ncontact = \"rigid\"\n\n\
             [drive]\n# A record of the horn's tip instead: kind = \"record\" and file = \"horn_tip.csv\", without the other keys.\n\
             kind = \"tone-burst\"\namplitude = \"1 um\"\nfrequency = \"73 kHz\"\ncycles = 40\nring_up = \"100 us\"\n\n\
             {far_end}\n[damping]\n# Or \"kuwabara-kono\", \"linear+kuwabara-kono\", \"none\". The coefficient is usually fitted.\n\
             kind = \"linear\"\ncoefficient = \"0.3 N s/m\"\n"
        )
    }
}

const PRECOMPRESSION: &str =
    "# Static force along the chain; not zero in any laboratory, and a sensitive quantity.\nprecompression = \"0 N\"\n";
