//! The drive that is made of a horn-tip record against the motion that was recorded, in closed form.

#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::{f64::consts::PI, fmt::Write as _, path::Path};

use granchain::measurement::{
    Baseline, Beginning, Ending, HornDrive, MeasurementError, NoiseSource, ReadOptions, Record, RecordKind,
    read_record_bytes,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const F0: f64 = 73e3;
const PERIOD: f64 = 1.0 / F0;
const PEAK: f64 = 1e-6;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Envelope {
    /// Of 40 cycles, at once.
    Sine,
    /// 1 − exp(−t/τ) over 40 cycles, then exp: τ in cycles.
    RingUp(f64),
    /// Of 40 cycles.
    Hann,
    /// Of 40 cycles, 0.044 at its ends.
    Gaussian,
}

const CYCLES: f64 = 40.0;
const ENVELOPES: [Envelope; 5] =
    [Envelope::Sine, Envelope::RingUp(7.3), Envelope::RingUp(2.0), Envelope::Hann, Envelope::Gaussian];

impl Envelope {
    /// Displacement over its peak, `cycles` after motion begins.
    fn at(self, cycles: f64) -> f64 {
        if cycles <= 0.0 {
            return 0.0;
        }
        let (whole, middle) = (cycles < CYCLES, 0.5 * CYCLES);
        let envelope = match self {
            Self::Sine => f64::from(u8::from(whole)),
            Self::RingUp(tau) => {
                let norm = 1.0 / (1.0 - (-CYCLES / tau).exp());
                if whole { norm * (1.0 - (-cycles / tau).exp()) } else { (-(cycles - CYCLES) / tau).exp() }
            }
            Self::Hann if whole => (PI * cycles / CYCLES).sin().powi(2),
            Self::Gaussian if whole => (-0.5 * (2.5 * (cycles - middle) / middle).powi(2)).exp(),
            _ => 0.0,
        };
        envelope * (2.0 * PI * cycles).sin()
    }

    /// Velocity over ω times the peak, by differences.
    fn velocity(self, cycles: f64) -> f64 {
        let h = 1e-6;
        let ahead = |by: f64| self.at(cycles + by);
        if cycles <= 0.0 {
            0.0
        } else if cycles < h || cycles < CYCLES && cycles + h > CYCLES {
            (ahead(0.0) - ahead(-h)) / h / (2.0 * PI)
        } else {
            (ahead(h) - ahead(-h)) / (2.0 * h) / (2.0 * PI)
        }
    }
}

/// How a motion is recorded.
#[derive(Debug, Clone, Copy)]
struct Bench {
    envelope: Envelope,
    /// Samples a cycle.
    rate: f64,
    /// First sample, cycles after motion begins.
    from: f64,
    /// Last, likewise.
    to: f64,
    /// When the trigger came, cycles after motion begins.
    trigger: f64,
    /// σ of white noise over the peak.
    noise: f64,
    /// Bits over 1.25 times the peak.
    bits: Option<u32>,
    velocity: bool,
    /// A slow sine of the mains kind: amplitude over the peak.
    hum: f64,
    offset: f64,
}

const BENCH: Bench = Bench {
    envelope: Envelope::Sine,
    rate: 5e6 / F0,
    from: -4.02,
    to: 60.0,
    trigger: 0.0,
    noise: 0.0,
    bits: None,
    velocity: false,
    hum: 0.0,
    offset: 0.0,
};

impl Bench {
    fn record(self) -> Record {
        self.read(&ReadOptions::default()).unwrap()
    }

    fn read(self, options: &ReadOptions) -> Result<Record, MeasurementError> {
        let Self { rate, from, noise, .. } = self;
        let mut random = ChaCha8Rng::seed_from_u64(11 + (1e6 * noise) as u64 + (1e3 * rate) as u64);
        let quantity = if self.velocity { "velocity_um_per_s" } else { "displacement_nm" };
        let full = if self.velocity { 1e6 * 2.0 * PI * F0 * PEAK } else { 1e9 * PEAK };
        let mut text = format!("# drive frequency: 73 kHz\ntime_ns,{quantity}\n");
        for i in 0..((self.to - from) * rate).floor() as usize + 1 {
            let cycles = from + i as f64 / rate;
            let mut value = if self.velocity { self.envelope.velocity(cycles) } else { self.envelope.at(cycles) };
            value += self.offset + self.hum * (2.0 * PI * cycles / 170.0 + 0.4).sin();
            let drawn: f64 = StandardNormal.sample(&mut random);
            value += noise * drawn;
            if let Some(bits) = self.bits {
                let step = 2.5 / f64::from(1u32 << bits);
                value = (value / step).round() * step;
            }
            writeln!(text, "{:.6},{:.6}", 1e9 * PERIOD * (cycles - self.trigger), full * value).unwrap();
        }
        read_record_bytes(Path::new("horn.csv"), text.as_bytes(), Some(RecordKind::HornTip), options)
    }

    /// Largest distance of the drive from the motion over `cycles` after motion begins, over the peak.
    fn error(self, drive: &HornDrive, (from, to): (f64, f64)) -> f64 {
        let series = &drive.displacement;
        let mut worst = 0.0;
        for i in 0..series.len() {
            let cycles = (series.time(i) + drive.origin) * F0 + self.trigger;
            if cycles >= from && cycles <= to.min(self.to) {
                worst = f64::max(worst, (series.values[i] / PEAK - self.envelope.at(cycles)).abs());
            }
        }
        worst
    }

    /// Instant of first motion, cycles late.
    fn late(self, drive: &HornDrive) -> f64 {
        (drive.begins_at + drive.origin) * F0 + self.trigger
    }
}

fn report(name: &str, bench: Bench) -> (f64, f64, f64) {
    let drive = bench.record().to_drive().unwrap();
    let errors =
        (bench.error(&drive, (-20.0, 0.999)), bench.error(&drive, (1.0, 38.0)), bench.error(&drive, (38.0, 60.0)));
    println!(
        "{name:<44} begins {:+.4} cycles late, first cycle {:.1e}, later {:.1e}, end {:.1e}, {:?} {:?}, noise left {:.1e}, origin {:.3}",
        bench.late(&drive),
        errors.0,
        errors.1,
        errors.2,
        drive.begins,
        drive.ends,
        drive.remainder.as_ref().map_or(0.0, |left| left.rms() / PEAK),
        drive.origin * F0,
    );
    errors
}

#[test]
fn survey() {
    for envelope in ENVELOPES {
        for (name, bench) in [
            ("plain", BENCH),
            ("between samples", Bench { from: -4.0271, ..BENCH }),
            ("6.3 late", Bench { trigger: 6.3, ..BENCH }),
            ("with the burst", Bench { from: 0.0, ..BENCH }),
            ("with the burst, 0.9 sample", Bench { from: 0.9 / BENCH.rate, ..BENCH }),
            ("inside", Bench { from: 6.37, ..BENCH }),
            ("ends inside", Bench { to: 20.0, ..BENCH }),
            ("ends inside, anywhere", Bench { to: 20.37, ..BENCH }),
            ("8 bits", Bench { bits: Some(8), ..BENCH }),
            ("8 bits, with burst", Bench { bits: Some(8), from: 0.0, ..BENCH }),
            ("12 bits", Bench { bits: Some(12), ..BENCH }),
            ("noise 0.1 %", Bench { noise: 1e-3, ..BENCH }),
            ("noise 1 %", Bench { noise: 1e-2, ..BENCH }),
            ("noise 1 %, with burst", Bench { noise: 1e-2, from: 0.0, ..BENCH }),
            ("velocity", Bench { velocity: true, ..BENCH }),
            ("velocity 0.3 %", Bench { velocity: true, noise: 3e-3, ..BENCH }),
            ("velocity, with burst", Bench { velocity: true, from: 0.0, ..BENCH }),
            ("hum 1 %", Bench { hum: 1e-2, ..BENCH }),
            ("200 a cycle", Bench { rate: 200.0, ..BENCH }),
            ("20 a cycle", Bench { rate: 20.0, from: -4.021, ..BENCH }),
            ("8 a cycle", Bench { rate: 8.0, from: -4.021, ..BENCH }),
            ("4.2 a cycle", Bench { rate: 4.2, from: -4.021, ..BENCH }),
        ] {
            report(&format!("{envelope:?}, {name}"), Bench { envelope, ..bench });
        }
    }
}
