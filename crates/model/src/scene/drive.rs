//! The prescribed motion of the piston.

use std::path::{Path, PathBuf};

use granchain_signal::Series;

use super::{Bead, Scene, motion::Motion};

/// Drive frequency of a scene whose record is not read yet, where it states none, Hz.
pub(crate) const UNREAD_FREQUENCY: f64 = 73e3;

#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    pub kind: DriveKind,
    /// Peak displacement, m; 1 for a record, which carries its own.
    pub amplitude: f64,
    /// Drive frequency f0, Hz; of a striker one over the duration of its Hertz collision with the first bead.
    pub frequency: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub enum DriveKind {
    /// sin 2πf0 t for a number of cycles from t = 0, then zero.
    SineCycles { cycles: f64 },
    /// sin 2πf0 t under (1 − exp(−t/τ))/(1 − exp(−T/τ)) up to T = cycles/f0, then decaying with exp(−(t − T)/τ).
    ToneBurst {
        cycles: f64,
        /// τ, s; 0 is a rectangular burst.
        ring_up: f64,
    },
    /// sin 2πf0 (t − T/2) under exp(−½(2.5 x)²), x = (t − T/2)/(T/2), T = cycles/f0; zero outside 0…T.
    GaussianBurst { cycles: f64 },
    /// A horn-tip record: displacement in m, positive towards the chain, already band-limited.
    Record {
        displacement: Series,
        /// Last instant of recorded motion, s: what the series holds behind it was predicted. Its end where nothing was.
        recorded_until: f64,
        /// Realisations of what is not known of the displacement, m, at its instants: a run may add any mixture of them. None where it is known.
        shakes: Vec<Series>,
        file: Option<PathBuf>,
    },
    /// No piston: a bead that touches the first one at t = 0 with a velocity, free before and after.
    Striker {
        bead: Bead,
        /// Velocity at α = 1 towards the chain, m/s.
        velocity: f64,
    },
    /// A record that has not been read yet; no model runs it. The caller reads it and uses `Scene::with_drive_record`.
    UnreadRecord { file: PathBuf },
}

/// A piston motion that can be evaluated at any instant: displacement (m), velocity (m/s).
///
/// The motion is smooth between its [breaks](PistonMotion::breaks). Piece 0 lies before the first break, piece i between break
/// i − 1 and break i. An integrator that stays within one piece at a time and asks [`PistonMotion::on_piece`] sees a smooth
/// function up to and including both ends, whatever jumps there.
pub trait PistonMotion: Send + Sync {
    /// Displacement (m) and velocity (m/s) at time `t` (s); at a break the values just after it.
    fn at(&self, t: f64) -> (f64, f64) {
        let piece = self.breaks().partition_point(|instant| *instant <= t);
        self.on_piece(piece, t)
    }

    /// The formula of one piece at time `t` (s), also at its ends.
    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64);

    /// Instants (s) where the motion is not smooth, ascending: an integrator must not step across them.
    fn breaks(&self) -> &[f64];

    /// Longest step that meets the piston on each of its ways (s), for an integrator that does not feel it: nothing touches it.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Displacements (m) and velocities (m/s) at all of `times` (s): one dispatch for all stages of a step.
    fn sample(&self, times: &[f64], displacements: &mut [f64], velocities: &mut [f64]) {
        one_by_one(self, times, displacements, velocities);
    }
}

pub(super) fn one_by_one(
    motion: &(impl PistonMotion + ?Sized),
    times: &[f64],
    displacements: &mut [f64],
    velocities: &mut [f64],
) {
    for ((time, displacement), velocity) in times.iter().zip(displacements).zip(velocities) {
        (*displacement, *velocity) = motion.at(*time);
    }
}

impl<M: PistonMotion + ?Sized> PistonMotion for &M {
    fn at(&self, t: f64) -> (f64, f64) {
        (**self).at(t)
    }

    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64) {
        (**self).on_piece(piece, t)
    }

    fn breaks(&self) -> &[f64] {
        (**self).breaks()
    }

    fn longest_step(&self) -> f64 {
        (**self).longest_step()
    }

    fn sample(&self, times: &[f64], displacements: &mut [f64], velocities: &mut [f64]) {
        (**self).sample(times, displacements, velocities);
    }
}

impl DriveKind {
    pub(crate) const fn name(&self) -> &'static str {
        match self {
            Self::SineCycles { .. } => "sine",
            Self::ToneBurst { .. } => "tone-burst",
            Self::GaussianBurst { .. } => "gaussian-burst",
            Self::Record { .. } | Self::UnreadRecord { .. } => "record",
            Self::Striker { .. } => "striker",
        }
    }

    /// Length of its burst in periods of f0; a record has none.
    pub(crate) const fn cycles(&self) -> Option<f64> {
        match *self {
            Self::SineCycles { cycles } | Self::ToneBurst { cycles, .. } | Self::GaussianBurst { cycles } => {
                Some(cycles)
            }
            Self::Record { .. } | Self::UnreadRecord { .. } | Self::Striker { .. } => None,
        }
    }

    /// The bead that strikes the chain and its velocity at α = 1, m/s.
    pub const fn striker(&self) -> Option<(&Bead, f64)> {
        if let Self::Striker { bead, velocity } = self { Some((bead, *velocity)) } else { None }
    }
}

impl Drive {
    /// The motion α·drive, ready to be evaluated.
    pub fn motion(&self, amplitude_scale: f64) -> Box<dyn PistonMotion> {
        Box::new(self.concrete_motion(amplitude_scale))
    }

    /// The motion α·drive as a concrete type, for loops that should not call through a pointer.
    pub(crate) fn concrete_motion(&self, amplitude_scale: f64) -> Motion {
        Motion::new(self, amplitude_scale)
    }
}

impl Scene {
    /// The horn-tip record this scene wants and does not hold yet: read it and hand it to [`Scene::with_drive_record`].
    pub fn pending_record(&self) -> Option<&Path> {
        match &self.drive.kind {
            DriveKind::UnreadRecord { file } => Some(file),
            _ => None,
        }
    }

    /// The same scene driven by a record.
    ///
    /// - `displacement`: m, positive towards the chain, band-limited, starting and ending near 0, at t ≥ 0
    /// - `frequency`: its drive frequency f0, Hz
    /// - `file`: where it came from, for provenance; a pending file's name stays if `None`
    #[must_use]
    pub fn with_drive_record(self, displacement: Series, frequency: f64, file: Option<PathBuf>) -> Self {
        let recorded_until = displacement.end();
        self.with_continued_record(displacement, recorded_until, vec![], frequency, file)
    }

    /// The same scene driven by a record that was continued beyond what was recorded.
    ///
    /// - `recorded_until`: last instant of recorded motion, s; burst and comparison end there at the latest
    /// - `shakes`: realisations of what is not known of the displacement, m, at its instants
    ///
    /// The others as in [`Scene::with_drive_record`].
    #[must_use]
    pub fn with_continued_record(
        mut self,
        displacement: Series,
        recorded_until: f64,
        shakes: Vec<Series>,
        frequency: f64,
        file: Option<PathBuf>,
    ) -> Self {
        let file = file.or_else(|| match &self.drive.kind {
            DriveKind::UnreadRecord { file } => Some(file.clone()),
            DriveKind::Record { file, .. } => file.clone(),
            _ => None,
        });
        self.drive =
            Drive { kind: DriveKind::Record { displacement, recorded_until, shakes, file }, amplitude: 1.0, frequency };
        self
    }
}
