//! The drive that is made of a horn-tip record against the motion that was recorded, in closed form.

use std::{f64::consts::PI, fmt::Write as _, path::Path};

use granchain_record::{
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

/// Errors over the first cycle, later, and at the end of the burst.
#[derive(Debug, Clone, Copy)]
struct Errors {
    first: f64,
    later: f64,
    end: f64,
}

fn errors(bench: Bench) -> (Errors, HornDrive) {
    let drive = bench.record().to_drive().unwrap();
    let errors = Errors {
        first: bench.error(&drive, (-20.0, 0.999)),
        later: bench.error(&drive, (1.0, 38.0)),
        end: bench.error(&drive, (38.0, 60.0)),
    };
    println!(
        "{bench:?}: begins {:+.4} cycles late, {errors:?}, {:?} {:?}, noise left {:.1e}",
        bench.late(&drive),
        drive.begins,
        drive.ends,
        drive.remainder.as_ref().map_or(0.0, |left| left.rms() / PEAK),
    );
    (errors, drive)
}

#[test]
fn a_motion_without_noise_passes_wherever_samples_and_trigger_fall() {
    for envelope in ENVELOPES {
        for bench in [
            BENCH,
            Bench { from: -4.0271, ..BENCH },
            Bench { trigger: 6.3, ..BENCH },
            Bench { from: 0.0, ..BENCH },
            Bench { from: 0.9 / BENCH.rate, ..BENCH },
            Bench { from: -4.021, rate: 200.0, ..BENCH },
            Bench { from: -4.021, rate: 20.0, ..BENCH },
            Bench { to: 20.0, ..BENCH },
            Bench { to: 20.37, ..BENCH },
        ] {
            let (errors, drive) = errors(Bench { envelope, ..bench });
            // At 20 samples a cycle the place where a fast envelope begins is known less well.
            let first = if bench.rate < 30.0 { 2e-3 } else { 1e-3 };
            assert!(
                errors.first < first && errors.later < 1e-4 && errors.end < 1e-3,
                "{envelope:?} {bench:?} {errors:?}"
            );
            let recorded = (drive.recorded_until + drive.origin) * F0 + bench.trigger;
            assert!(
                (recorded - bench.to.min(CYCLES)).abs() < 0.1 || matches!(envelope, Envelope::RingUp(_)),
                "{recorded}"
            );
        }
    }
}

#[test]
fn eight_samples_a_cycle_or_four_are_enough_for_a_steady_burst() {
    for (envelope, rate, most) in [
        (Envelope::Sine, 8.0, 1e-4),
        (Envelope::Sine, 4.2, 1e-4),
        (Envelope::Gaussian, 8.0, 1e-3),
        (Envelope::Gaussian, 4.2, 2e-3),
        (Envelope::Hann, 4.2, 4e-3),
        (Envelope::RingUp(7.3), 4.2, 1e-2),
    ] {
        let (errors, _) = errors(Bench { envelope, rate, from: -4.021, ..BENCH });
        assert!(errors.first < most && errors.later < most, "{envelope:?} {rate} {errors:?}");
    }
}

#[test]
fn noise_is_taken_off_and_what_is_left_is_known() {
    for envelope in ENVELOPES {
        for noise in [1e-3, 1e-2] {
            let bench = Bench { envelope, noise, ..BENCH };
            let (errors, drive) = errors(bench);
            // A kilo of samples reach four of what is left; an envelope that begins in the noise is rest until it leaves it.
            assert!(errors.later < 1.5 * noise && errors.first < 2.5 * noise, "{errors:?}");
            let left = drive.remainder.as_ref().unwrap().rms() / PEAK;
            let series = &drive.displacement;
            let inside: Vec<f64> = (0..series.len())
                .map(|i| (i, (series.time(i) + drive.origin) * F0))
                .filter(|(_, cycles)| (4.0..36.0).contains(cycles))
                .map(|(i, cycles)| series.values[i] / PEAK - envelope.at(cycles))
                .collect();
            let rms = (inside.iter().map(|x| x * x).sum::<f64>() / inside.len() as f64).sqrt();
            println!("{envelope:?} {noise}: left {left:.2e}, found {rms:.2e}");
            assert!((0.5..1.6).contains(&(rms / left)), "{envelope:?} {noise}: {rms:e} {left:e}");
            // The low-pass alone leaves 0.54 of it.
            assert!(rms < 0.35 * noise, "{rms:e}");
        }
    }
}

#[test]
fn the_plateau_is_not_lowered() {
    for noise in [0.0, 1e-2] {
        let bench = Bench { noise, ..BENCH };
        let drive = bench.record().to_drive().unwrap();
        let series = drive.displacement.window(5.0 * PERIOD - drive.origin, 35.0 * PERIOD - drive.origin);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (i, value) in series.values.iter().enumerate() {
            let weight = 1.0 - (2.0 * PI * (i as f64 + 0.5) / series.len() as f64).cos();
            sum += weight * value * (2.0 * PI * F0 * (series.time(i) + drive.origin)).sin();
            weights += weight;
        }
        let amplitude = 2.0 * sum / weights / PEAK;
        // Of 2,055 samples under a Hann window with noise of 1 %: σ = 4e-4.
        let most = if noise == 0.0 { 1e-4 } else { 1.5e-3 };
        assert!((amplitude - 1.0).abs() < most, "{noise}: {amplitude}");
    }
}

#[test]
fn converters_of_8_and_12_bits_are_known_for_their_noise() {
    for (bits, first, later) in [(8, 8e-3, 5e-3), (12, 1e-3, 5e-4)] {
        for from in [BENCH.from, 0.0] {
            for envelope in [Envelope::Sine, Envelope::RingUp(7.3), Envelope::Gaussian] {
                let bench = Bench { envelope, bits: Some(bits), from, ..BENCH };
                let record = bench.record();
                let step = 2.5 / f64::from(1u32 << bits) * PEAK;
                assert!(
                    (record.quantisation_step.unwrap() / step - 1.0).abs() < 1e-3,
                    "{:?}",
                    record.quantisation_step
                );
                assert!(record.noise_rms >= 0.99 * step / 12f64.sqrt(), "{}", record.noise_rms);
                if from < 0.0 {
                    assert_eq!(record.noise_source, NoiseSource::Quantisation);
                }
                let (errors, _) = errors(bench);
                assert!(errors.first < first && errors.later < later, "{bench:?} {errors:?}");
            }
        }
    }
}

#[test]
fn a_velocity_is_integrated_without_its_drift() {
    for envelope in ENVELOPES {
        for (noise, first, later) in [(0.0, 3e-3, 2e-3), (3e-3, 8e-3, 6e-3)] {
            for offset in [0.0, 0.01] {
                let (errors, _) = errors(Bench { envelope, noise, offset, velocity: true, ..BENCH });
                assert!(errors.first < first && errors.later < later, "{envelope:?} {noise} {errors:?}");
            }
        }
    }
}

#[test]
fn hum_and_offset_are_no_motion() {
    for envelope in ENVELOPES {
        let bench = Bench { envelope, hum: 0.01, offset: 0.05, ..BENCH };
        let drive = bench
            .read(&ReadOptions { baseline: Baseline::Plateau, ..ReadOptions::default() })
            .unwrap()
            .to_drive()
            .unwrap();
        assert!(bench.late(&drive).abs() < 0.2 || envelope == Envelope::Hann, "{envelope:?}: {}", bench.late(&drive));
        // The hum goes; where its mean over the plateau is not that of the plateau's window a part of it stays.
        let error = bench.error(&drive, (2.0, 30.0));
        println!("{envelope:?}: {error:.1e}, drift {:.1e}", drive.drift / PEAK);
        assert!(error < 3e-3 && drive.drift > 2e-3 * PEAK, "{envelope:?}: {error:e} {:e}", drive.drift);
    }
}

#[test]
fn a_record_that_begins_inside_says_so_and_is_led_into() {
    for (envelope, missing) in [
        (Envelope::Sine, None),
        (Envelope::RingUp(7.3), Some(6.37)),
        (Envelope::RingUp(2.0), Some(6.37)),
        (Envelope::Gaussian, Some(3.5)),
    ] {
        let bench = Bench { envelope, from: 6.37, trigger: 6.37, ..BENCH };
        let (errors, drive) = errors(bench);
        let Beginning::Inside { missing_cycles } = drive.begins else { panic!("{:?}", drive.begins) };
        match missing {
            None => assert_eq!(missing_cycles, None),
            Some(cycles) => assert!((missing_cycles.unwrap() / cycles - 1.0).abs() < 0.1, "{missing_cycles:?}"),
        }
        assert!(drive.warnings()[0].contains("begins inside the burst"), "{:?}", drive.warnings());
        // From the first sample on it is the record.
        assert!(bench.error(&drive, (6.4, 38.0)) < 1e-4, "{errors:?}");
        assert_eq!(drive.displacement.values[0], 0.0);
        assert!((drive.begins_at + drive.origin).abs() < 1e-9 && drive.displacement.start >= 0.0);
        assert!((drive.begins_at - drive.displacement.start) * F0 > 12.0);
    }
}

#[test]
fn a_record_that_ends_inside_says_so_and_is_continued() {
    for to in [20.0, 20.37] {
        let bench = Bench { to, ..BENCH };
        let drive = bench.record().to_drive().unwrap();
        assert_eq!(drive.ends, Ending::Inside);
        assert!(drive.warnings()[0].contains("ends inside the burst, 20."), "{:?}", drive.warnings());
        let until = (drive.recorded_until + drive.origin) * F0;
        assert!((until - to).abs() < 0.02, "{until}");
        // Two periods on the prediction is the motion still.
        let beyond = Bench { to: 22.0, ..bench };
        assert!(beyond.error(&drive, (20.0, 22.0)) < 1e-3);
        assert_eq!(drive.displacement.values.last(), Some(&0.0));
    }
    let whole = BENCH.record().to_drive().unwrap();
    assert!(whole.warnings().is_empty() && whole.ends == Ending::Rest && whole.begins == Beginning::Rest);
}

#[test]
fn the_model_s_clock_is_the_record_s_unless_motion_begins_before_zero_or_long_after() {
    let drive = |trigger: f64| Bench { trigger, ..BENCH }.record().to_drive().unwrap();
    assert_eq!(drive(0.0).origin, 0.0);
    assert!((drive(0.0).begins_at).abs() < 1e-9);
    let late = drive(-2.0);
    assert_eq!(late.origin, 0.0);
    assert!((late.begins_at * F0 - 2.0).abs() < 1e-3);
    // A logger's absolute time: a second at rest is no second to simulate.
    let absolute = drive(-73e3);
    assert!(
        (absolute.begins_at * F0 - 1.0).abs() < 1e-6 && absolute.displacement.end() < 1.1 * late.displacement.end()
    );
    let early = drive(6.3);
    assert!((early.origin * F0 + 7.3).abs() < 1e-3 && (early.begins_at * F0 - 1.0).abs() < 1e-6);
    assert!(
        early.statement().contains("the time of the simulation is that of the record + 100.0"),
        "{}",
        early.statement()
    );
}

#[test]
fn a_frequency_that_is_not_the_strongest_line_is_refused_unless_forced() {
    let stated = |frequency: f64, force_frequency: bool| {
        BENCH.read(&ReadOptions { drive_frequency: Some(frequency), force_frequency, ..ReadOptions::default() })
    };
    assert!(stated(73.3e3, false).is_ok());
    let error = stated(40e3, false).unwrap_err();
    assert!(matches!(error, MeasurementError::FrequencyDisagrees { stated, .. } if stated == 40e3));
    assert!(
        error.to_string().starts_with("horn.csv: expected a strongest line at the drive frequency of 40.0000 kHz (--drive-frequency), found it at 73.0"),
        "{error}"
    );
    assert!(stated(40e3, true).is_ok());
    let vibrometer = ReadOptions { drive_frequency: Some(146e3), ..ReadOptions::default() };
    let text = "# drive frequency: 73 kHz\ntime_us,velocity_mm_per_s\n".to_owned()
        + &(0..900)
            .map(|i| format!("{},{:.4}\n", 0.2 * f64::from(i), (0.0917 * f64::from(i)).sin()))
            .collect::<String>();
    assert!(
        read_record_bytes(Path::new("vib.csv"), text.as_bytes(), Some(RecordKind::Vibrometer), &vibrometer).is_ok()
    );
}
