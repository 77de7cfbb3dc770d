//! The conditions: what a laboratory does to a record, and what it may say wrongly of its bench.
//!
//! Everything that is random but the noise itself is drawn here, from a stream of its own for every condition and number, so that a synthetic record is the
//! same whichever others are made beside it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::instrument::{CausalFilter, Laboratory};
use granchain_calibration::diagnosis::Cause;

/// Scale of the half-normal gaps in every contact, m: 0.3 nm, what a fit takes for granted.
pub(super) const GAP: f64 = 3e-10;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Condition {
    Pretrigger,
    BurstOnly,
    EightBit,
    Envelopes,
    Cut,
    Benches,
    LateTrigger,
    HornVelocity,
    Clock,
    Sensitivity,
    Hum,
    Coupling,
    Decoder,
    Bits,
    #[serde(rename = "clipped-95")]
    Clipped95,
    LowDrive,
    DropOuts,
    Averages,
    CausalDecoder,
    Crosstalk,
    HornHarmonics,
    TwoBursts,
    OffNominal,
    OffModulus,
    OffRadius,
    OffDensity,
    Modulated,
    Speckle,
    Overload,
    #[serde(rename = "period-3")]
    Period3,
    SofterSupport,
    OtherLaw,
    BothLaws,
    BeadFewer,
    BeadMore,
    Radius,
    FirstGap,
    Rough,
    Sign,
    HornSign,
    Modulus,
    Aluminium,
    EndFaces,
    HornFace,
    Friction,
    ClockOff,
    ScaleUp,
    ScaleDown,
    UnitUp,
    UnitDown,
    Swapped,
    Frequency,
    #[serde(rename = "clipped-60")]
    Clipped60,
    #[serde(rename = "clipped-85")]
    Clipped85,
    StrongHum,
    Drift,
    Noisy,
    PureNoise,
    ShortHorn,
    ShortVibrometer,
    Late,
    LateVibrometer,
    Middle,
}

/// What a diagnosis has to say of a wrong record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// The cause that names it.
    pub cause: Cause,
    /// Words, lower case, one of which a refusal or a warning has to hold; of none, neither names it.
    pub words: &'static [&'static str],
}

use Condition::{
    Aluminium, Averages, BeadFewer, BeadMore, Benches, Bits, BothLaws, BurstOnly, CausalDecoder, Clipped60, Clipped85,
    Clipped95, Clock, ClockOff, Coupling, Crosstalk, Cut, Decoder, Drift, DropOuts, EightBit, EndFaces, Envelopes,
    FirstGap, Frequency, Friction, HornFace, HornHarmonics, HornSign, HornVelocity, Hum, Late, LateTrigger,
    LateVibrometer, LowDrive, Middle, Modulated, Modulus, Noisy, OffDensity, OffModulus, OffNominal, OffRadius,
    OtherLaw, Overload, Period3, Pretrigger, PureNoise, Radius, Rough, ScaleDown, ScaleUp, Sensitivity, ShortHorn,
    ShortVibrometer, Sign, SofterSupport, Speckle, StrongHum, Swapped, TwoBursts, UnitDown, UnitUp,
};

/// Name and words of each, the right ones first.
const TABLE: [(Condition, &str, &str); 63] = [
    (Pretrigger, "pretrigger", "20 cycles before the trigger, 1 % noise, horn 0.1 %, offsets, unknown trigger"),
    (BurstOnly, "burst-only", "both records begin with the burst, 0–1 % noise"),
    (EightBit, "eight-bit", "8 bits, range 1.25 × peak, both channels"),
    (Envelopes, "envelopes", "Gaussian, fast or rectangular envelope"),
    (Cut, "cut", "records end 20 cycles into the burst"),
    (Benches, "benches", "3–8 beads, 0.4–1 mm, steel or aluminium, 40–100 kHz"),
    (LateTrigger, "late-trigger", "t = 0 is 6.3 cycles into the burst, nothing lost"),
    (HornVelocity, "horn-velocity", "horn recorded as velocity, 0.3 % noise"),
    (Clock, "clock", "clocks of the channels up to 50 ppm apart"),
    (Sensitivity, "sensitivity", "vibrometer up to 1 % off, stated by --uncertainty sensitivity=0.01"),
    (Hum, "hum", "50 Hz and slow drift on both"),
    (Coupling, "coupling", "AC coupling 100 Hz–1 kHz on both"),
    (Decoder, "decoder", "vibrometer filter of 0.4–1.5 MHz with its delay, both stated"),
    (Bits, "bits", "10, 12 or 14 bits, range 1.1–2.5 × peak"),
    (Clipped95, "clipped-95", "velocity clipped at 95 % of its peak"),
    (LowDrive, "low-drive", "α 0.15–0.3"),
    (DropOuts, "drop-outs", "signal lost five times for 0.5–2 µs, five single-sample spikes"),
    (Averages, "averages", "mean of 16 shots with their own gaps, noise and 0.2 µs of jitter"),
    (CausalDecoder, "causal-decoder", "causal filter at 400 kHz, only its bandwidth stated"),
    (Crosstalk, "crosstalk", "1 % of the drive in the velocity channel, a spike at the trigger"),
    (HornHarmonics, "horn-harmonics", "3 % second and 2 % third harmonic, 1/f noise on both channels"),
    (TwoBursts, "two-bursts", "second burst after 25 cycles of rest"),
    (OffNominal, "off-nominal", "stiffness and mass ±0.5 %, clocks 100 ppm apart"),
    (OffModulus, "off-modulus", "Young's modulus of the beads ±1 %"),
    (OffRadius, "off-radius", "radius of the beads ±0.5 %"),
    (OffDensity, "off-density", "density of the beads ±1 %"),
    (Modulated, "modulated", "5 % amplitude modulation, 0.2 % frequency drift"),
    (
        Speckle,
        "speckle",
        "noise of 3 % of the velocity of the instant, four stretches of 5 µs with noise of 20 % of the peak",
    ),
    (Overload, "overload", "velocity clipped at 75–92 % of its peak, overload fading within 3 µs"),
    (Period3, "period-3", "α 0.12–0.3, dampers between beads only, 3 % noise"),
    (SofterSupport, "softer-support", "annulus 30 % softer than stated"),
    (OtherLaw, "other-law", "other damping law than stated"),
    (BothLaws, "both-laws", "both damping laws at once, one stated"),
    (BeadFewer, "bead-fewer", "a bead fewer than stated"),
    (BeadMore, "bead-more", "a bead more than stated"),
    (Radius, "radius", "beads 10 % larger than stated"),
    (FirstGap, "first-gap", "first gap 20 nm"),
    (Rough, "rough", "gaps in every contact ten times as large, 3 nm"),
    (Sign, "sign", "sign of the velocity turned"),
    (HornSign, "horn-sign", "sign of the horn's record turned"),
    (Modulus, "modulus", "Young's modulus of the beads 25 % off"),
    (Aluminium, "aluminium", "beads of aluminium stated as steel"),
    (EndFaces, "end-faces", "half-spaces at both ends stated as rigid"),
    (HornFace, "horn-face", "face of the horn of titanium stated as rigid"),
    (Friction, "friction", "friction of 0.3–3 mN on every bead in its guide"),
    (ClockOff, "clock-off", "clock of the vibrometer 0.3 % off"),
    (ScaleUp, "scale-up", "velocity ten times too large"),
    (ScaleDown, "scale-down", "velocity ten times too small"),
    (UnitUp, "unit-up", "velocity a thousand times too large"),
    (UnitDown, "unit-down", "velocity a thousand times too small"),
    (Swapped, "swapped", "files of horn and bead swapped, both velocities"),
    (Frequency, "frequency", "40 kHz stated as 73 kHz"),
    (Clipped60, "clipped-60", "velocity clipped at 60 % of its peak"),
    (Clipped85, "clipped-85", "velocity clipped at 85 % of its peak"),
    (StrongHum, "strong-hum", "hum of 30 % of the peak"),
    (Drift, "drift", "drift by 60 % of the peak"),
    (Noisy, "noisy", "10 % noise"),
    (PureNoise, "pure-noise", "noise alone"),
    (ShortHorn, "short-horn", "horn record ends 15 cycles into the burst"),
    (ShortVibrometer, "short-vibrometer", "vibrometer record ends 8 cycles into the burst"),
    (Late, "late", "records begin 6–10 cycles into the burst, what was before is lost"),
    (
        LateVibrometer,
        "late-vibrometer",
        "vibrometer record begins 6–25 cycles into the burst, nothing of the horn’s is lost",
    ),
    (Middle, "middle", "vibrometer record is 12–18 cycles from inside the burst"),
];

impl Condition {
    /// All, the right ones first.
    #[must_use]
    pub fn all() -> Vec<Self> {
        TABLE.iter().map(|(condition, ..)| *condition).collect()
    }

    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        TABLE.iter().find(|(_, known, _)| *known == name).map(|(condition, ..)| *condition)
    }

    fn row(self) -> &'static (Self, &'static str, &'static str) {
        TABLE.iter().find(|(condition, ..)| *condition == self).unwrap_or(&TABLE[0])
    }

    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// What it is, in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        self.row().2
    }

    /// What a diagnosis has to say; `None` where nothing is wrong.
    #[must_use]
    pub fn expected(self) -> Option<Expected> {
        let (cause, words): (Cause, &'static [&'static str]) = match self {
            SofterSupport => (Cause::Support, &[]),
            OtherLaw | BothLaws => (Cause::DampingLaw, &[]),
            BeadFewer | BeadMore => (Cause::Beads, &[]),
            Radius => (Cause::Radius, &[]),
            FirstGap | Rough => (Cause::Gap, &[]),
            Sign => (Cause::Sign, &["invert"]),
            HornSign => (Cause::HornSign, &["--drive-read invert=true"]),
            Modulus => (Cause::Modulus, &[]),
            Aluminium => (Cause::Material, &[]),
            EndFaces => (Cause::Ends, &[]),
            HornFace => (Cause::HornFace, &[]),
            Friction => (Cause::Friction, &[]),
            ClockOff => (Cause::Clock, &[]),
            ScaleUp | ScaleDown | UnitUp | UnitDown => (Cause::Scale, &["--scale", "--unit", "record's unit"]),
            Frequency => (Cause::Record, &["frequency", "strongest line"]),
            Swapped => (Cause::Record, &["swap"]),
            Clipped60 | Clipped85 => (Cause::Record, &["clipped", "overload"]),
            StrongHum => (Cause::Record, &["hum", "50 hz", "baseline moves", "drift"]),
            Drift => (Cause::Record, &["drift", "baseline moves"]),
            Noisy | PureNoise => (Cause::Record, &["noise of", "% noise", "noise beyond", "noise alone", "but noise"]),
            ShortHorn => (Cause::Record, &["ends", "shorter"]),
            ShortVibrometer => (Cause::Record, &["ends", "shorter", "too short", "record longer"]),
            Late | LateVibrometer | Middle => (Cause::Record, &["begins", "missing", "lost"]),
            _ => return None,
        };
        Some(Expected { cause, words })
    }

    /// A number of its own: FNV-1a of its name, so that a further condition changes none.
    fn stream(self) -> u64 {
        self.name()
            .bytes()
            .fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
            .into()
    }
}

/// Truth and instrument of one synthetic record, and the information given to its fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    pub condition: Condition,
    /// Number of the synthetic record in it.
    pub number: u64,
    /// `rigid`, `annulus` or `spring`.
    pub support: String,
    /// Damping law of the truth.
    pub damping_kind: String,
    /// α and the damping coefficient (SI) of the truth.
    pub values: [f64; 2],
    pub gaps: Vec<f64>,
    pub drive: String,
    /// Overrides of the scene `annulus` given to the fit.
    #[serde(rename = "told")]
    pub given: Vec<String>,
    /// Further ones of the truth.
    pub truth: Vec<String>,
    /// Uncertainties given to the fit: `--uncertainty`.
    pub uncertainty: Vec<(String, f64)>,
    /// Drive frequency given to the fit, Hz.
    #[serde(rename = "told_frequency_hz")]
    pub given_frequency_hz: f64,
    pub laboratory: Laboratory,
}

/// 1 + share or 1 − share.
fn off(r: &mut ChaCha8Rng, share: f64) -> f64 {
    if r.random() { 1.0 + share } else { 1.0 - share }
}

/// γ/c of two dashpots of comparable loss, √(1/m): the paper's.
const COMPARABLE: f64 = 12_200.0;

/// Stiffness of the spring, N/m: near that of a contact under some newtons.
const SPRING: f64 = 1e7;

/// Supports in turn, each for both laws.
const SUPPORTS: [&str; 4] = ["rigid", "annulus", "spring", "annulus"];

impl Setting {
    /// Synthetic record `number` of a condition, and the stream that its noise goes on from.
    #[must_use]
    pub fn draw(condition: Condition, number: u64, seed: u64) -> (Self, ChaCha8Rng) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream((condition.stream() << 32) | (number & 0xffff_ffff));
        let r = &mut random;
        // Conditions begin elsewhere in the turn of laws and supports, so that few synthetic records of each have all of them.
        let turn = number + condition.stream() % 8;
        let linear = turn.is_multiple_of(2);
        let mut support = SUPPORTS[((turn / 2) % 4) as usize];
        let mut alpha = log_uniform(r, 0.3, 1.5);
        let mut coefficient = if linear { log_uniform(r, 0.2, 1.5) } else { log_uniform(r, 1500.0, 9000.0) };
        let (mut frequency, mut cycles): (f64, f64) = (73e3, 40.0);
        let mut ring_up = r.random_range(60e-6..160e-6);
        let amplitude = r.random_range(0.8e-6..1.2e-6);
        let mut laboratory = Laboratory {
            sample_rate_hz: [2.5e6, 5e6, 10e6][r.random_range(0..3)],
            before: 20.0,
            end: 52.0,
            noise: 0.005,
            horn_noise: 0.001,
            start_s: r.random_range(0.0..5e-6),
            shift_s: r.random_range(-10e-6..10e-6),
            offset: r.random_range(-0.05..0.05),
            horn_offset: r.random_range(-0.03..0.03),
            bits: None,
            clip: None,
            gain: 1.0,
            hum: None,
            horn_hum: None,
            drift: 0.0,
            horn_drift: 0.0,
            coupling_hz: None,
            decoder: None,
            clock_ppm: 0.0,
            horn_velocity: false,
            lost: None,
            vibrometer_lost: None,
            horn_end: None,
            vibrometer_end: None,
            silent: false,
            horn_gain: 1.0,
            swapped: false,
            drop_outs: 0,
            averages: None,
            causal: None,
            crosstalk: None,
            harmonics: [0.0; 2],
            pink: [0.0; 2],
            second_burst: None,
            modulation: [0.0; 2],
            speckle: None,
            recovery_s: 0.0,
        };
        let lab = &mut laboratory;
        let (mut kind, mut beads, mut radius, mut material) = ("tone-burst", 6_u64, 0.5e-3_f64, "chrome-steel");
        let (mut given_law, mut truth, mut uncertainty) = (linear, Vec::new(), Vec::new());
        let mut both = None;
        let (mut roughness, mut first_gap, mut true_beads, mut given_frequency) = (1.0, 0.0, None, None);
        let hum_of = |r: &mut ChaCha8Rng, frequency: f64, low: f64, high: f64| {
            Some([frequency, r.random_range(low..high), r.random_range(0.0..std::f64::consts::TAU)])
        };
        match condition {
            Pretrigger => lab.noise = 0.01,
            BurstOnly => {
                (lab.before, lab.noise, lab.start_s, lab.shift_s) = (0.0, r.random_range(0.0..0.01), 0.0, 0.0);
                let share = if r.random() { 0.2 } else { 0.0 };
                (lab.offset, lab.horn_offset) = (share * lab.offset, share * lab.horn_offset);
            }
            EightBit => {
                (lab.bits, lab.before) = (Some((8, 1.25)), 10.0);
                (lab.noise, lab.horn_noise) = (r.random_range(0.0..0.003), r.random_range(0.0..0.001));
                (lab.offset, lab.horn_offset) = (0.0, 0.0);
            }
            Envelopes => match r.random_range(0..3) {
                0 => (kind, cycles) = ("gaussian-burst", f64::from(r.random_range(30..=60))),
                1 => ring_up = r.random_range(3e-6..15e-6),
                _ => (kind, cycles) = ("sine", f64::from(r.random_range(30..=60))),
            },
            Cut => lab.end = 20.0,
            Benches => {
                (beads, radius) = (r.random_range(3..=8), (r.random_range(0.4e-3_f64..1e-3) * 1e5).round() / 1e5);
                frequency = (r.random_range(40e3_f64..100e3) / 100.0).round() * 100.0;
                let aluminium = r.random();
                material = if aluminium { "aluminium" } else { material };
                ring_up *= 73e3 / frequency;
                let mass = (radius / 0.5e-3).powi(3) * if aluminium { 2700.0 / 7833.0 } else { 1.0 };
                let (low, high) = if linear { (0.08, 1.5) } else { (700.0, 15_000.0) };
                coefficient = (coefficient * mass.sqrt()).clamp(low, high);
            }
            LateTrigger => (lab.start_s, lab.shift_s) = (-6.3 / frequency, 0.0),
            HornVelocity => (lab.horn_velocity, lab.horn_noise) = (true, 0.003),
            Clock => lab.clock_ppm = r.random_range(-50.0..50.0),
            Sensitivity => {
                lab.gain = 1.0 + r.random_range(-0.01..0.01);
                uncertainty.push(("sensitivity".to_owned(), 0.01));
            }
            Hum => {
                (lab.hum, lab.drift) = (hum_of(r, 50.0, 0.005, 0.03), r.random_range(-0.03..0.03));
                (lab.horn_hum, lab.horn_drift) = (hum_of(r, 50.0, 0.002, 0.01), r.random_range(-0.01..0.01));
            }
            Coupling => lab.coupling_hz = Some(log_uniform(r, 100.0, 1000.0)),
            Decoder => {
                lab.decoder = Some([log_uniform(r, 0.4e6, 1.5e6), r.random_range(0.0..4e-6)]);
                lab.shift_s = 0.0;
            }
            Bits => {
                lab.bits = Some(([10, 12, 14][r.random_range(0..3)], r.random_range(1.1..2.5)));
                (lab.noise, lab.horn_noise) = (r.random_range(0.0..0.003), r.random_range(0.0..0.001));
            }
            Clipped95 => lab.clip = Some(0.95),
            LowDrive => alpha = log_uniform(r, 0.15, 0.3),
            DropOuts => lab.drop_outs = 5,
            Averages => lab.averages = Some((16, 0.2e-6)),
            CausalDecoder => {
                let shapes = [1, 2, 2, 2, 3, 4].map(CausalFilter::Butterworth);
                let shape = shapes.get(r.random_range(0..7)).copied().unwrap_or(CausalFilter::Bessel);
                lab.causal = Some((shape, 0.4e6));
            }
            Crosstalk => lab.crosstalk = Some([0.01, r.random_range(0.0..std::f64::consts::TAU), 0.2]),
            HornHarmonics => (lab.harmonics, lab.pink) = ([0.03, 0.02], [0.001, 0.01]),
            TwoBursts => lab.second_burst = Some(25.0),
            OffNominal => {
                lab.clock_ppm = 100.0;
                let [stiffness, mass] = [(); 2].map(|()| 1.0 + r.random_range(-0.005..0.005));
                truth.push(format!("materials.chrome-steel.youngs_modulus={}", 201e9 * stiffness));
                truth.push(format!("materials.chrome-steel.density={}", 7833.0 * mass));
            }
            OffModulus => truth.push(format!("materials.chrome-steel.youngs_modulus={}", 201e9 * off(r, 0.01))),
            OffRadius => truth.push(format!("chain.radius={}", radius * off(r, 0.005))),
            OffDensity => truth.push(format!("materials.chrome-steel.density={}", 7833.0 * off(r, 0.01))),
            Modulated => lab.modulation = [0.05, 0.002],
            Speckle => lab.speckle = Some([0.03, 0.2]),
            Overload => (lab.clip, lab.recovery_s) = (Some(r.random_range(0.75..0.92)), 3e-6),
            Period3 => {
                alpha = log_uniform(r, 0.12, 0.3);
                coefficient = if linear { log_uniform(r, 0.2, 0.8) } else { log_uniform(r, 1500.0, 6000.0) };
                (lab.sample_rate_hz, lab.noise) = (2.5e6, 0.03);
            }
            SofterSupport => {
                support = "annulus";
                truth.push("support.stiffness_factor=0.7".to_owned());
            }
            OtherLaw => given_law = !linear,
            BothLaws => {
                let c = if linear { coefficient } else { coefficient / COMPARABLE };
                both = Some([c, COMPARABLE * c]);
            }
            BeadFewer => true_beads = Some(beads - 1),
            BeadMore => true_beads = Some(beads + 1),
            Radius => truth.push(format!("chain.radius={}", 1.1 * radius)),
            FirstGap => first_gap = 20e-9,
            Rough => roughness = 10.0,
            HornFace => truth.extend(["piston.contact=half-space", "piston.material=titanium"].map(str::to_owned)),
            Friction => truth.push(format!("holder.friction_force={}", log_uniform(r, 0.3e-3, 3e-3))),
            ClockOff => lab.clock_ppm = 1e6 * (off(r, 3e-3) - 1.0),
            Sign => lab.gain = -1.0,
            HornSign => lab.horn_gain = -1.0,
            Modulus => truth.push(format!("materials.chrome-steel.youngs_modulus={}", 201e9 * off(r, 0.25))),
            Aluminium => {
                // Its stiffness over its mass is that of steel: only a support of its own tells them apart.
                support = "annulus";
                truth.push("chain.material=aluminium".to_owned());
            }
            EndFaces => {
                support = "rigid";
                truth.extend(["piston.contact=half-space", "support.kind=half-space"].map(str::to_owned));
            }
            ScaleUp => lab.gain = 10.0,
            ScaleDown => lab.gain = 0.1,
            UnitUp => lab.gain = 1e3,
            UnitDown => lab.gain = 1e-3,
            Swapped => (lab.horn_velocity, lab.swapped) = (true, true),
            Frequency => given_frequency = Some(40e3),
            Clipped60 => lab.clip = Some(0.6),
            Clipped85 => lab.clip = Some(0.85),
            StrongHum => {
                let frequency = [50.0, 100.0, 300.0, 1000.0][r.random_range(0..4)];
                lab.hum = hum_of(r, frequency, 0.29, 0.31);
            }
            Drift => lab.drift = if r.random() { 0.6 } else { -0.6 },
            Noisy => lab.noise = 0.1,
            PureNoise => (lab.silent, lab.noise) = (true, 0.2),
            ShortHorn => lab.horn_end = Some(15.0),
            ShortVibrometer => lab.vibrometer_end = Some(8.0),
            Late => {
                lab.lost = Some(r.random_range(6.0..10.0));
                (lab.before, lab.start_s, lab.shift_s) = (0.0, 0.0, 0.0);
            }
            LateVibrometer => lab.vibrometer_lost = Some(r.random_range(6.0..25.0)),
            Middle => {
                let (from, cycles) = (r.random_range(6.0..20.0), r.random_range(12.0..18.0));
                (lab.vibrometer_lost, lab.vibrometer_end) = (Some(from), Some(from + cycles));
            }
        }
        // The law of the annulus is that of beads of 0.5 mm.
        if matches!(condition, Benches | Radius) && support == "annulus" {
            support = "rigid";
        }
        if condition != Cut {
            lab.end = cycles + 12.0 + lab.second_burst.map_or(0.0, |rest| cycles + rest);
        }
        truth.extend(true_beads.map(|count| format!("chain.beads={count}")));
        let contacts = true_beads.unwrap_or(beads) + 1;
        let mut gaps: Vec<f64> = (0..contacts)
            .map(|_| {
                let normal: f64 = StandardNormal.sample(r);
                roughness * GAP * normal.abs()
            })
            .collect();
        gaps[0] += first_gap;
        let law = |linear: bool| if linear { "linear" } else { "kuwabara-kono" };
        truth.extend([
            format!("alpha={alpha}"),
            format!("drive.kind={kind}"),
            format!("drive.amplitude={amplitude}"),
            format!("drive.frequency={frequency}"),
            format!("drive.cycles={cycles}"),
        ]);
        truth.extend(match both {
            None => vec![format!("damping.kind={}", law(linear)), format!("damping.coefficient={coefficient}")],
            Some([c, gamma]) => vec![
                "damping.kind=linear+kuwabara-kono".to_owned(),
                format!("damping.linear_coefficient={c}"),
                format!("damping.kuwabara_kono_coefficient={gamma}"),
            ],
        });
        if kind == "tone-burst" {
            truth.push(format!("drive.ring_up={ring_up}"));
        }
        let mut given = vec![
            format!("chain.beads={beads}"),
            format!("chain.radius={radius}"),
            format!("chain.material={material}"),
            format!("support.kind={support}"),
        ];
        if support == "spring" {
            given.push(format!("support.stiffness={SPRING}"));
        }
        given.push(format!("damping.kind={}", law(given_law)));
        if condition == Period3 {
            given.push("damping.at=beads".to_owned());
        }
        let drive = if kind == "tone-burst" { format!("tone burst, τ {:.0} µs", 1e6 * ring_up) } else { kind.into() };
        let setting = Self {
            condition,
            number,
            support: support.into(),
            damping_kind: law(linear).into(),
            values: [alpha, coefficient],
            gaps,
            drive,
            given,
            truth,
            uncertainty,
            given_frequency_hz: given_frequency.unwrap_or(frequency),
            laboratory,
        };
        (setting, random)
    }
}

fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random::<f64>())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_condition_has_a_row_and_a_stream_of_its_own() {
        let all = Condition::all();
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), TABLE.len());
        assert_eq!(all.iter().map(|condition| condition.stream()).collect::<BTreeSet<_>>().len(), TABLE.len());
        for condition in all {
            assert_eq!(Condition::named(condition.name()), Some(condition));
            assert_eq!(serde_json::to_value(condition).unwrap(), condition.name());
        }
    }

    #[test]
    fn a_synthetic_record_does_not_depend_on_what_is_drawn_beside_it() {
        let once = Setting::draw(Pretrigger, 3, 7).0;
        assert_eq!(once, Setting::draw(Pretrigger, 3, 7).0);
        assert_ne!(once.values, Setting::draw(Pretrigger, 5, 7).0.values);
        assert_ne!(once.values, Setting::draw(BurstOnly, 3, 7).0.values);
        assert!((0.3..1.5).contains(&once.values[0]));
    }

    #[test]
    fn eight_records_of_a_condition_have_both_laws_on_every_support() {
        for condition in
            Condition::all().into_iter().filter(|condition| ![SofterSupport, Aluminium, EndFaces].contains(condition))
        {
            let kinds: BTreeSet<_> = (0..8)
                .map(|number| Setting::draw(condition, number, 1).0)
                .map(|setting| (setting.support, setting.damping_kind))
                .collect();
            let expected = if matches!(condition, Benches | Radius) { 4 } else { 6 };
            assert_eq!(kinds.len(), expected, "{condition:?}");
        }
    }
}
