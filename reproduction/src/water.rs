//! The scene before water: which mount, baffle and dampers give the printed pressure and content, and at which drive.
//!
//! The source paper leaves the disc's mount, what lies around it and the place of the dampers open, prints 3.96 µm of drive, 14 kPa at 1 mm and
//! −21 dB at 0.95 MHz. Every combination is run at several drives, each drive as a handful of runs spread evenly over ±2 %: the chain is
//! strongly nonlinear, so that a single run says little. Deterministic: no seed.

mod cell;
mod tips;

pub use cell::{Cell, Quantiles, Run};
pub use tips::{Explained, LoadedTip};

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;

use crate::{divided::Divided, failure::StudyError};
use granchain_calibration::predict::{Bodies, observation, replicates::Watch};
use granchain_model::{
    response::Response,
    scene::{self, Scene},
};
use granchain_signal::{
    Series,
    feature::{
        AmplitudeSpectrum, PressureFeatures, PressureSettings, Window, amplitude_spectrum, correlation_peak,
        measure_pressure,
    },
};

pub const PRINTED_PRESSURE: f64 = 14e3;
/// Printed level around 0.95 MHz, dB re the fundamental.
pub const PRINTED_LEVEL_DB: f64 = -21.0;
pub const PRINTED_DRIVE: f64 = 3.96e-6;

/// A tenth of it: a hypothesis, since the paper writes "3.96 m".
pub const TENTH: f64 = 0.1 * PRINTED_DRIVE;
/// Half the relative spread of the drive over the runs of one cell.
pub const DRIVE_SPREAD: f64 = 0.02;
/// How far a level may lie from the printed one and still count as it, dB: a reader's error on a printed spectrum.
pub const LEVEL_TOLERANCE_DB: f64 = 3.0;

pub const RIMS: [&str; 3] = ["clamped", "supported", "free"];
pub const BAFFLES: [&str; 2] = ["rigid", "soft"];
/// Places of the dampers, as in `damping.at`.
pub const PLACEMENTS: [&str; 2] = ["all", "beads"];

/// Largest modal mass of a horn's tip, kg; the least is that of a bead.
pub const HEAVIEST_TIP: f64 = 0.3e-3;
/// Q of its resonance, which lies at the drive.
pub const TIP_QUALITIES: [f64; 2] = [50.0, 500.0];
/// Masses from the largest to the least, evenly in the logarithm.
const TIP_MASSES: usize = 5;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WaterPlan {
    pub drives_m: Vec<f64>,
    /// Runs at each drive over ±2 %, ≥ 3.
    #[serde(rename = "members")]
    pub replicates: usize,
    /// Side of the acoustic elements of the soft baffle, m.
    pub soft_side_m: f64,
}

impl WaterPlan {
    /// Everything: five runs at six drives.
    #[must_use]
    pub fn whole() -> Self {
        Self { drives_m: vec![0.3e-6, TENTH, 0.5e-6, 1e-6, 2e-6, PRINTED_DRIVE], replicates: 5, soft_side_m: 0.05e-3 }
    }

    /// A first look: three runs, coarse elements.
    #[must_use]
    pub fn quick() -> Self {
        Self { replicates: 3, soft_side_m: 0.1e-3, ..Self::whole() }
    }
}

/// A way to read what the paper leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Combination {
    pub rim: &'static str,
    pub baffle: &'static str,
    pub placement: &'static str,
}

/// All of them, mounts slowest.
#[must_use]
pub fn combinations() -> Vec<Combination> {
    let with = |rim| {
        BAFFLES
            .into_iter()
            .flat_map(move |baffle| PLACEMENTS.into_iter().map(move |placement| Combination { rim, baffle, placement }))
    };
    RIMS.into_iter().flat_map(with).collect()
}

/// Where the median pressure passes the printed one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Crossing {
    /// Drive, m, interpolated in the logarithms.
    pub drive_m: f64,
    /// Median level around 0.95 MHz there, dB, interpolated.
    pub level_db: f64,
}

/// What came of one combination.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CombinationOutcome {
    pub combination: Combination,
    pub cells: Vec<Cell>,
    /// First passage of the printed pressure with rising drive.
    pub crossing: Option<Crossing>,
}

impl CombinationOutcome {
    /// Drives (m) at which the printed pressure and level come together: those whose runs hold both, and the passage of the pressure where the
    /// level is the printed one.
    #[must_use]
    pub fn with_both(&self) -> Vec<f64> {
        let held = self.cells.iter().filter(|cell| cell.has_pressure() && cell.has_level()).map(|cell| cell.drive_m);
        let passed = self.crossing.filter(|own| (own.level_db - PRINTED_LEVEL_DB).abs() <= LEVEL_TOLERANCE_DB);
        let mut drives: Vec<f64> = held.chain(passed.map(|crossing| crossing.drive_m)).collect();
        drives.sort_by(f64::total_cmp);
        drives
    }

    /// Whether the median lies above the printed pressure at the lowest drive already.
    #[must_use]
    pub fn begins_above(&self) -> bool {
        self.cells.first().and_then(|cell| cell.pressure_pa).is_some_and(|found| found.median > PRINTED_PRESSURE)
    }

    /// The cell at the printed drive.
    #[must_use]
    pub fn printed(&self) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.drive_m == PRINTED_DRIVE)
    }
}

/// First passage of [`PRINTED_PRESSURE`] by the medians; none if they stay on one side.
fn crossing(cells: &[Cell]) -> Option<Crossing> {
    let known: Vec<(f64, f64, f64)> = cells
        .iter()
        .filter_map(|cell| Some((cell.drive_m, cell.pressure_pa?.median, cell.level_db?.median)))
        .filter(|(_, pressure, _)| *pressure > 0.0)
        .collect();
    let pair = known.windows(2).find(|pair| (pair[0].1 < PRINTED_PRESSURE) != (pair[1].1 < PRINTED_PRESSURE))?;
    let share = (PRINTED_PRESSURE / pair[0].1).ln() / (pair[1].1 / pair[0].1).ln();
    Some(Crossing {
        drive_m: pair[0].0 * (pair[1].0 / pair[0].0).powf(share),
        level_db: pair[0].2 + share * (pair[1].2 - pair[0].2),
    })
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Waveform {
    pub combination: Combination,
    pub drive_m: f64,
    /// Displacement of the piston, m, and its spectrum in the window of the pressure's.
    pub piston: Series,
    pub piston_spectrum: AmplitudeSpectrum,
    /// Velocity of the last bead's far pole, m/s.
    pub velocity: Series,
    pub pressure: Series,
    pub pressure_spectrum: AmplitudeSpectrum,
    /// What is measured on the pressure.
    pub features: PressureFeatures,
}

/// Six aluminium beads, the companion work's chain before water.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Companion {
    /// What the chain stands on.
    pub combination: Combination,
    pub cells: Vec<Cell>,
    /// Peak of the normalised cross-correlation of the pressures with a clamped and with a supported disc, at each drive where both ran.
    pub mount_similarity: Vec<(f64, f64)>,
}

/// What came of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WaterOutcome {
    pub plan: WaterPlan,
    pub combinations: Vec<CombinationOutcome>,
    /// The drawn runs: printed drive, then the drive whose median pressure lies nearest to the printed one.
    pub waveforms: Vec<Waveform>,
    pub companion: Companion,
    /// Tips that give way at the printed drive, heaviest first.
    pub tips: Vec<LoadedTip>,
}

/// The combination that is drawn, and the companion's: the scene's own.
const OWN: Combination = Combination { rim: "clamped", baffle: "rigid", placement: "all" };
const HELD_OTHERWISE: Combination = Combination { rim: "supported", ..OWN };

/// Overrides of the companion's beads.
fn aluminium() -> [String; 1] {
    ["chain.material=aluminium".to_owned()]
}

#[derive(Debug)]
pub struct Study {
    plan: WaterPlan,
    overrides: Vec<String>,
    scene: Scene,
    bodies: Bodies,
}

impl Study {
    /// Check the plan and the scene; `overrides` apply to all runs before a combination's own.
    ///
    /// # Errors
    /// [`StudyError::TooFew`], [`StudyError::Scene`].
    pub fn new(plan: WaterPlan, overrides: &[String], bodies: Bodies) -> Result<Self, StudyError> {
        if plan.replicates < 3 {
            return Err(StudyError::TooFew { what: "members", least: 3, found: plan.replicates });
        }
        if plan.drives_m.len() < 2 {
            return Err(StudyError::TooFew { what: "drives", least: 2, found: plan.drives_m.len() });
        }
        let scene = scene_of(&plan, overrides, OWN, PRINTED_DRIVE, &[])?;
        Ok(Self { plan, overrides: overrides.to_vec(), scene, bodies })
    }

    #[must_use]
    pub fn plan(&self) -> &WaterPlan {
        &self.plan
    }

    /// The scene's own combination at the printed drive.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// One run of the scene's own combination, its bodies made before: for the time it takes. Thrown away.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn first(&self) -> Result<(), StudyError> {
        self.waveform(OWN, self.plan.drives_m[0], &[]).map(drop)
    }

    /// Mass (kg) and Q of the tips that give way, heaviest first.
    fn tips(&self) -> Vec<(f64, f64)> {
        let least = self.scene.chain.beads.first().map_or(HEAVIEST_TIP, granchain_model::scene::Bead::mass);
        let mass = |step: usize| HEAVIEST_TIP * (least / HEAVIEST_TIP).powf(step as f64 / (TIP_MASSES - 1) as f64);
        (0..TIP_MASSES).flat_map(|step| TIP_QUALITIES.map(|quality| (mass(step), quality))).collect()
    }

    /// The printed drive as the free motion of a compliant tip; what cannot be run says why.
    fn tip(&self, (mass_kg, quality): (f64, f64), watch: &dyn Watch) -> Result<Vec<Cell>, StudyError> {
        let horn = [format!("horn.mass={mass_kg:e}"), format!("horn.quality={quality}")];
        match self.cells(OWN, &[PRINTED_DRIVE], &horn, watch) {
            Ok(cells) => Ok(cells),
            Err(StudyError::Stopped) => Err(StudyError::Stopped),
            Err(error) => Ok(vec![Cell::of(PRINTED_DRIVE, &[Err(error.to_string())])]),
        }
    }

    /// One cell a drive (m); runs side by side.
    fn cells(
        &self,
        combination: Combination,
        drives_m: &[f64],
        besides: &[String],
        watch: &dyn Watch,
    ) -> Result<Vec<Cell>, StudyError> {
        let replicates = &self.plan.replicates;
        let scenes = drives_m
            .iter()
            .flat_map(|drive| (0..*replicates).map(move |replicate| drive * spread(replicate, *replicates)))
            .map(|drive| Ok((drive, scene_of(&self.plan, &self.overrides, combination, drive, besides)?)))
            .collect::<Result<Vec<_>, StudyError>>()?;
        let what = || format!("disc {}, baffle {}", combination.rim, combination.baffle);
        // Made once, before the runs ask for it side by side.
        let prepared = self.bodies.prepared(&scenes[0].1).map_err(|source| StudyError::Run { what: what(), source })?;
        let runs: Vec<Result<Run, String>> = scenes
            .par_iter()
            .map(|(drive, scene)| {
                let response = prepared.run(scene, &mut |_| !watch.stop()).map_err(|error| error.to_string())?;
                watch.advance(1);
                measured(scene, *drive, &response)
            })
            .collect();
        if watch.stop() {
            return Err(StudyError::Stopped);
        }
        Ok(drives_m.iter().zip(runs.chunks(*replicates)).map(|(drive, runs)| Cell::of(*drive, runs)).collect())
    }

    fn waveform(&self, combination: Combination, drive: f64, besides: &[String]) -> Result<Waveform, StudyError> {
        let scene = scene_of(&self.plan, &self.overrides, combination, drive, besides)?;
        let what = || format!("disc {}, drive {drive:e} m", combination.rim);
        let response = self
            .bodies
            .prepared(&scene)
            .and_then(|prepared| prepared.run(&scene, &mut |_| true))
            .map_err(|source| StudyError::Run { what: what(), source })?;
        let feature = |source| StudyError::Feature { what: what(), source };
        let pressure = field_pressure(&response);
        let settings = settings(&scene).map_err(feature)?;
        let features = measure_pressure(&pressure, &settings).map_err(feature)?;
        Ok(Waveform {
            combination,
            drive_m: drive,
            piston_spectrum: amplitude_spectrum(&response.piston_displacement, settings.window).map_err(feature)?,
            pressure_spectrum: amplitude_spectrum(&pressure, settings.window).map_err(feature)?,
            piston: response.piston_displacement,
            velocity: response.pole_velocity,
            pressure,
            features,
        })
    }
}

/// The combinations, the companion's beads, the tips. What is drawn (twelve runs) is run where all of them are at hand.
impl Divided for Study {
    type Point = Vec<Cell>;
    type Outcome = WaterOutcome;

    fn points(&self) -> usize {
        combinations().len() + 1 + TIP_MASSES * TIP_QUALITIES.len()
    }

    fn runs_of(&self, point: usize) -> usize {
        let drives = if point <= combinations().len() { self.plan.drives_m.len() } else { 1 };
        drives * self.plan.replicates
    }

    fn part(&self, part: Range<usize>, watch: &dyn Watch) -> Result<Vec<Vec<Cell>>, StudyError> {
        let (combinations, tips) = (combinations(), self.tips());
        let point = |point: usize| match (combinations.get(point), point.checked_sub(combinations.len() + 1)) {
            (Some(combination), _) => self.cells(*combination, &self.plan.drives_m, &[], watch),
            (None, Some(tip)) => self.tip(tips[tip], watch),
            (None, None) => self.cells(OWN, &self.plan.drives_m, &aluminium(), watch),
        };
        part.map(point).collect()
    }

    fn outcome(&self, points: Vec<Vec<Cell>>) -> Result<WaterOutcome, StudyError> {
        let mut points = points.into_iter();
        let combinations: Vec<CombinationOutcome> = combinations()
            .into_iter()
            .zip(&mut points)
            .map(|(combination, cells)| CombinationOutcome { combination, crossing: crossing(&cells), cells })
            .collect();
        let own = combinations.iter().find(|outcome| outcome.combination == OWN);
        let distance = |cell: &Cell| {
            let median = cell.pressure_pa.map_or(f64::MIN_POSITIVE, |pressure| pressure.median.max(f64::MIN_POSITIVE));
            (median / PRINTED_PRESSURE).ln().abs()
        };
        let nearest = own
            .and_then(|own| own.cells.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))))
            .map_or(PRINTED_DRIVE, |cell| cell.drive_m);
        let waveforms = [PRINTED_DRIVE, nearest]
            .into_iter()
            .map(|drive| self.waveform(OWN, drive, &[]))
            .collect::<Result<Vec<_>, _>>()?;
        let cells = points.next().unwrap_or_default();
        let mut mount_similarity = Vec::new();
        for &drive in &self.plan.drives_m {
            let run_of = |combination| -> Result<Series, StudyError> {
                Ok(self.waveform(combination, drive, &aluminium())?.pressure)
            };
            let found = correlation_peak(&run_of(OWN)?, &run_of(HELD_OTHERWISE)?);
            mount_similarity.extend(found.ok().map(|found| (drive, found.value)));
        }
        let companion = Companion { combination: OWN, cells, mount_similarity };
        let tip = |((mass_kg, quality), cells): ((f64, f64), Vec<Cell>)| {
            Some(LoadedTip { mass_kg, quality, cell: cells.into_iter().next()? })
        };
        let tips = self.tips().into_iter().zip(points).filter_map(tip).collect();
        Ok(WaterOutcome { plan: self.plan.clone(), combinations, waveforms, companion, tips })
    }
}

/// The scene of a combination at a drive (m).
fn scene_of(
    plan: &WaterPlan,
    overrides: &[String],
    Combination { rim, baffle, placement }: Combination,
    drive: f64,
    besides: &[String],
) -> Result<Scene, StudyError> {
    let mut overrides = overrides.to_vec();
    overrides.extend([
        format!("drive.amplitude={drive:e} m"),
        format!("disc.rim={rim}"),
        format!("damping.at={placement}"),
        format!("water.baffle={baffle}"),
    ]);
    if baffle == "soft" {
        overrides.push("water.method=elements".into());
        overrides.push(format!("water.mesh_side={:e} m", plan.soft_side_m));
    }
    overrides.extend_from_slice(besides);
    Ok(scene::load("water", &overrides)?)
}

/// Factor on the drive of a replicate: evenly over 1 ± [`DRIVE_SPREAD`].
fn spread(replicate: usize, replicates: usize) -> f64 {
    1.0 + DRIVE_SPREAD * (2.0 * replicate as f64 / (replicates - 1) as f64 - 1.0)
}

/// How the pressure of a scene is measured: spectra where the envelope of its drive exceeds half its peak.
fn settings(scene: &Scene) -> Result<PressureSettings, granchain_signal::feature::FeatureError> {
    let window = observation::settings(scene)?.window.unwrap_or(Window::new(0.0, scene.duration));
    Ok(PressureSettings::new(scene.drive.frequency, window))
}

/// Pressure at the scene's first field point; nothing where there is none.
fn field_pressure(response: &Response) -> Series {
    let first = response.disc.as_ref().and_then(|disc| disc.pressure.first());
    first.cloned().unwrap_or_else(|| Series::new(0.0, 1.0, Vec::new()))
}

fn measured(scene: &Scene, drive_m: f64, response: &Response) -> Result<Run, String> {
    let words = |error: granchain_signal::feature::FeatureError| error.to_string();
    let settings = settings(scene).map_err(words)?;
    let pressure = measure_pressure(&field_pressure(response), &settings).map_err(words)?;
    Ok(Run { drive_m, pressure, velocity_m_per_s: response.pole_velocity.peak() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(drive_m: f64, pressure: f64, level: f64) -> Cell {
        let exactly = |value| Quantiles::of([value]);
        Cell {
            drive_m,
            pressure_pa: exactly(pressure),
            level_db: exactly(level),
            content_hz: None,
            band_width_hz: None,
            thd: None,
            velocity_m_per_s: None,
            failures: Vec::new(),
        }
    }

    #[test]
    fn the_median_of_an_even_number_lies_between() {
        assert_eq!(Quantiles::of([4.0, 1.0, 3.0, 2.0]), Some(Quantiles { median: 2.5, lowest: 1.0, highest: 4.0 }));
        assert_eq!(Quantiles::of([4.0, 1.0, 9.0]).map(|found| found.median), Some(4.0));
        assert_eq!(Quantiles::of([]), None);
    }

    #[test]
    fn the_printed_pressure_is_passed_where_a_power_law_says() {
        // p = 14 kPa (d/d₀)², level rising by 10 dB a decade.
        let at = |d: f64| cell(d, PRINTED_PRESSURE * (d / 0.4e-6_f64).powi(2), -21.0 + 10.0 * (d / 0.4e-6_f64).log10());
        let found = crossing(&[at(0.1e-6), at(0.2e-6), at(1e-6), at(3e-6)]).unwrap();
        assert!((found.drive_m / 0.4e-6 - 1.0).abs() < 1e-12 && (found.level_db + 21.0).abs() < 1e-12, "{found:?}");
        assert_eq!(crossing(&[at(1e-6), at(2e-6)]), None);
        // Falling counts as well, and what failed is skipped.
        let failed = Cell { pressure_pa: None, ..at(0.3e-6) };
        assert!(crossing(&[at(1e-6), failed, at(0.2e-6)]).is_some());
    }

    #[test]
    fn a_printed_number_counts_where_the_runs_hold_it() {
        let wide = Cell {
            pressure_pa: Quantiles::of([11e3, 13e3, 15e3]),
            level_db: Quantiles::of([-30.0, -27.0, -24.5]),
            ..cell(1e-6, 0.0, 0.0)
        };
        assert!(wide.has_pressure() && !wide.has_level());
        let near = Cell { level_db: Quantiles::of([-23.9, -23.5]), ..wide };
        assert!(near.has_level() && !cell(1e-6, 15e3, -21.0).has_pressure());
    }

    #[test]
    fn both_come_together_in_a_cell_or_where_the_pressure_passes() {
        let of = |cells: Vec<Cell>| {
            let combination = combinations()[0];
            CombinationOutcome { combination, crossing: crossing(&cells), cells }
        };
        let wide =
            |drive: f64, level: f64| Cell { pressure_pa: Quantiles::of([13e3, 16e3, 17e3]), ..cell(drive, 0.0, level) };
        assert_eq!(of(vec![wide(0.3e-6, -30.0), wide(0.5e-6, -20.0)]).with_both(), [0.5e-6]);
        assert!(of(vec![wide(0.3e-6, -30.0)]).begins_above());
        let passing = of(vec![cell(0.3e-6, 10e3, -22.0), cell(0.6e-6, 19.6e3, -22.0)]);
        // 14 = √(10 × 19.6).
        assert!((passing.with_both()[0] / (0.3e-6 * 2f64.sqrt()) - 1.0).abs() < 1e-12 && !passing.begins_above());
        assert!(of(vec![cell(0.3e-6, 10e3, -35.0), cell(0.6e-6, 19.6e3, -35.0)]).with_both().is_empty());
    }

    #[test]
    fn a_tip_explains_its_share_of_the_logarithm_of_the_factor() {
        let tip = |pressure: Option<f64>| LoadedTip {
            mass_kg: 1e-4,
            quality: 50.0,
            cell: Cell { pressure_pa: pressure.and_then(|own| Quantiles::of([own])), ..cell(PRINTED_DRIVE, 0.0, 0.0) },
        };
        // 14 kPa × 64 down to 14 kPa × 8: half of the logarithm; what was refused does not count.
        let all = [tip(Some(30.0 * PRINTED_PRESSURE)), tip(None), tip(Some(8.0 * PRINTED_PRESSURE))];
        let found = tips::explained(64.0 * PRINTED_PRESSURE, &all).unwrap();
        assert!((found.share - 0.5).abs() < 1e-12 && found.least.0 == 2, "{found:?}");
        assert_eq!(tips::explained(64.0 * PRINTED_PRESSURE, &[tip(None)]), None);
    }

    #[test]
    fn drives_spread_evenly_and_twelve_combinations_differ() {
        assert_eq!([spread(0, 5), spread(2, 5), spread(4, 5)], [0.98, 1.0, 1.02]);
        let all = combinations();
        assert_eq!(all.len(), 12);
        assert!(all.iter().enumerate().all(|(index, own)| !all[..index].contains(own)));
    }
}
