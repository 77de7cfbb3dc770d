//! Horn-tip records with the flaws of a laboratory's files.

use std::{fmt::Write as _, path::Path};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    Limit,
    room::{Balance, Room},
};
use granchain_model::scene::Scene;
use granchain_record::{self as measurement, Missing, ReadOptions, RecordKind};

/// What is wrong with a record.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Flaw {
    /// White noise of so much of the peak.
    Noise(f64),
    /// Every so many-th cell missing.
    Dropouts(usize),
    /// Cut off at so much of the peak.
    Clipped(f64),
    /// Displaced by so much of the peak from the middle of the burst on.
    Step(f64),
}

const PLAIN: f64 = 5e6;

pub(super) fn examine(room: &mut Room<'_>) {
    let clean = match peak(room, PLAIN, None, Missing::Refuse) {
        Ok((peak, _)) => peak,
        Err(reason) => return room.failed("clean", reason),
    };
    // What each flaw explains: noise of 1 nm, filtered at 730 kHz, moves the piston by 1.5 mm/s, a straight line over a missing cell by 4 nm;
    // both are kicks to beads that move by 200 mm/s. A spline through fourteen samples a period is the burst itself.
    for (which, rate, flaw, most) in [
        ("noise of 0.1 %", PLAIN, Some(Flaw::Noise(0.001)), 0.05),
        ("every hundredth cell missing, interpolated", PLAIN, Some(Flaw::Dropouts(100)), 0.05),
        ("1 MHz", 1e6, None, 0.03),
        ("25 MHz", 25e6, None, 0.01),
    ] {
        match peak(room, rate, flaw, Missing::Interpolate) {
            Ok((peak, _)) => {
                let name = format!("{which}: positive peak against the clean record’s");
                room.check(name, (peak / clean - 1.0).abs(), Limit::AtMost(most), "1");
            }
            Err(reason) => room.failed(which, reason),
        }
    }
    match peak(room, PLAIN, Some(Flaw::Dropouts(100)), Missing::Refuse) {
        Ok(_) => room.failed("missing cells", "read without a word".to_owned()),
        Err(reason) => room.refused("missing cells", reason, "missing"),
    }
    for (which, flaw, word) in [
        ("noise of 1 %", Flaw::Noise(0.01), "noise"),
        ("clipped at 70 %", Flaw::Clipped(0.7), "clipped"),
        ("baseline moved by 30 % in mid-burst", Flaw::Step(0.3), "baseline"),
    ] {
        match peak(room, PLAIN, Some(flaw), Missing::Refuse) {
            Ok((_, warnings)) => {
                let warned = f64::from(u8::from(warnings.iter().any(|warning| warning.contains(word))));
                room.check(format!("{which}: a warning says `{word}`"), warned, Limit::AtLeast(1.0), "1");
            }
            Err(reason) => room.refused(which, reason, word),
        }
    }
}

/// Positive peak (m/s) of the pole under a record with a flaw, and what the reader warned of.
fn peak(room: &mut Room<'_>, rate: f64, flaw: Option<Flaw>, missing: Missing) -> Result<(f64, Vec<String>), String> {
    // The regular regime: what differs is the record, not the chain's own scatter.
    let sets = [
        "damping.kind=kuwabara-kono",
        "damping.coefficient=3660 N s/m^1.5",
        "drive.cycles=20",
        "duration=400 us",
        "alpha=1.5",
    ];
    let scene = room.scene("annulus", &sets)?;
    let text = written(&scene, rate, flaw);
    let options = ReadOptions { missing, ..ReadOptions::default() };
    let record =
        measurement::read_record_bytes(Path::new("horn_tip.csv"), text.as_bytes(), Some(RecordKind::HornTip), &options)
            .map_err(|error| error.to_string())?;
    let drive = record.to_drive().map_err(|error| error.to_string())?;
    let frequency = scene.drive.frequency;
    let scene = scene.with_continued_record(drive.displacement, drive.recorded_until, vec![], frequency, None);
    let ran = room.run(&scene)?;
    let name = flaw.map_or("clean".to_owned(), |flaw| format!("{flaw:?}"));
    room.sound(&format!("{name}, {} MHz", 1e-6 * rate), &ran, Balance::DAMPED);
    let peak = ran.response.pole_velocity.values.iter().copied().fold(0.0, f64::max);
    Ok((peak, record.warnings))
}

/// The scene's own burst as a laboratory's file.
fn written(scene: &Scene, rate: f64, flaw: Option<Flaw>) -> String {
    let motion = scene.drive.motion(1.0);
    let peak = scene.drive.amplitude;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (first, last) = ((-50e-6 * rate) as i64, (scene.duration * rate) as i64);
    let middle = 0.3 * scene.duration;
    let mut text = "# drive frequency: 73 kHz\ntime_us,displacement_nm\n".to_owned();
    for sample in first..last {
        let t = sample as f64 / rate;
        let mut value = motion.at(t).0;
        match flaw {
            Some(Flaw::Noise(level)) => {
                let noise: f64 = StandardNormal.sample(&mut random);
                value += level * peak * noise;
            }
            Some(Flaw::Clipped(level)) => value = value.clamp(-level * peak, level * peak),
            Some(Flaw::Step(level)) if t > middle => value += level * peak,
            _ => {}
        }
        let gone = matches!(flaw, Some(Flaw::Dropouts(every)) if sample.rem_euclid(every as i64) == 7);
        // Writing to a string cannot fail.
        let _ = if gone {
            writeln!(text, "{:.3},n/a", 1e6 * t)
        } else {
            writeln!(text, "{:.3},{:.3}", 1e6 * t, 1e9 * value)
        };
    }
    text
}
