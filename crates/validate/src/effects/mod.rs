//! What every effect of a scene costs, and what leaving it out would change.
//!
//! An effect the scene has is taken out, one it does not have is put in, everything else as it is. Both scenes are run on one thread, in turn,
//! and their median times compared; beside the times stand counts of what was done, which do not depend on the machine. What an effect
//! changes is said of the last bead's centre up to the end of a window short enough that the undamped chain's own chaos does not decide it:
//!
//! ```text
//! waveform = rms(v_without − v_with)/rms(v_with),   peak = max|v_without|/max|v_with| − 1,   ratio = A(f₀/3)/A(f₀) without − with
//! ```

mod advice;
mod clock;
mod switch;

pub use advice::{Advice, Advised, advise};
pub use switch::Belongs;

use std::time::Instant;

use serde::Serialize;

use self::{clock::Clock, switch::Switch};
use granchain_calibration::predict::replicates::Watch;
use granchain_model::{
    self as model, ModelError, Prepared,
    response::{Preparation, Response, SolverWork},
    scene::{Scene, effects},
};
use granchain_signal::{
    Series,
    feature::{FeatureSettings, Ratio, Window, measure},
};

/// End of the window in which waveforms are compared, s: undamped, and damped or in front of water.
const WINDOW: (f64, f64) = (70e-6, 250e-6);
/// Repetitions of a pair of runs: so many, or fewer once they have taken the first time (s); and on up to the second number until the second
/// time.
const REPEATS: [(usize, f64); 2] = [(3, 4.0), (25, 1.0)];

/// One effect of a scene, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Marginal {
    pub name: &'static str,
    /// Whether the scene has it.
    pub on: bool,
    /// Whether it belongs to the experiment or to the model.
    pub belongs: Belongs,
    /// The keys that take it out where the scene has it, or put it in.
    pub key: String,
    /// What it costs and changes; none where it could not be measured, with the reason.
    pub measured: Option<Measured>,
    /// Why it was not measured.
    pub refused: Option<String>,
}

/// What an effect costs and changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measured {
    pub without: Cost,
    pub with: Cost,
    /// What leaving it out changes.
    pub change: Change,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    pub work: SolverWork,
    /// Counts of making its bodies ready.
    pub preparation: Preparation,
    /// Median processor time of a run, s; of the clock on the wall where the system keeps none of a thread.
    pub run_s: f64,
    /// Time that making the bodies ready took, once, s.
    pub prepare_s: f64,
    pub runs: usize,
}

impl Measured {
    /// Share of the run's time that the effect takes, 1; negative where a run without it takes longer.
    #[must_use]
    pub fn share(&self) -> f64 {
        1.0 - self.without.run_s / self.with.run_s
    }

    /// Time of the run with it over that without, 1.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.with.run_s / self.without.run_s
    }

    #[must_use]
    pub fn unknowns(&self) -> i64 {
        self.with.work.unknowns as i64 - self.without.work.unknowns as i64
    }
}

/// What leaving an effect out changes, the run with it being the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Rms of the change of the last bead's velocity, that of its centre, over its rms, 1.
    pub waveform: f64,
    /// Relative change of its largest amount, 1.
    pub peak: f64,
    /// Change of A(f₀/3)/A(f₀), 1; none where the window cannot tell.
    pub ratio_third: Option<f64>,
    /// Relative change of the largest amount of the pressure at the first field point, 1; none where either is silent or has no water.
    pub pressure: Option<f64>,
}

impl Change {
    /// The largest of waveform, peak and pressure, 1: what an accuracy target is held against.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.waveform.max(self.peak.abs()).max(self.pressure.map_or(0.0, f64::abs))
    }

    /// Between two runs of one output step, up to `window` (s).
    fn between(with: &Response, without: &Response, scene: &Scene, window: f64) -> Self {
        let cut = |series: &Series| {
            let samples = ((window / series.step).round() as usize + 1).min(series.values.len());
            series.values[..samples].to_vec()
        };
        let (a, b) = (cut(centre(with)), cut(centre(without)));
        let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| b - a).collect();
        let ratio = |response: &Response| {
            let velocity = centre(response);
            let window = Window::whole(&Series::new(velocity.start, velocity.step, cut(velocity)));
            let settings = FeatureSettings::velocity(scene.drive.frequency, window);
            measure(velocity, &settings).ok()?.line(Ratio::new(1, 3)).map(|line| line.relative)
        };
        let peak_pressure = |response: &Response| {
            let pressure = response.disc.as_ref()?.pressure.first()?;
            Some(largest(&cut(pressure))).filter(|peak| *peak > 0.0)
        };
        Self {
            waveform: rms(&difference) / rms(&a).max(f64::MIN_POSITIVE),
            peak: largest(&b) / largest(&a).max(f64::MIN_POSITIVE) - 1.0,
            ratio_third: ratio(with).zip(ratio(without)).map(|(with, without)| without - with),
            pressure: peak_pressure(with).zip(peak_pressure(without)).map(|(with, without)| without / with - 1.0),
        }
    }
}

/// The velocity that every model has, and that stands still in none while the bead is pressed on a wall.
fn centre(response: &Response) -> &Series {
    response.bead_velocity.last().unwrap_or(&response.pole_velocity)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// The effects of a scene, measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectCosts {
    pub scene: String,
    pub model: &'static str,
    /// End of the runs and of the window of comparison, s.
    pub window_s: f64,
    /// The scene as it is.
    pub base: Cost,
    /// Every effect that can be switched.
    pub effects: Vec<Marginal>,
}

/// How many effects are looked at in a scene.
#[must_use]
pub fn count() -> u64 {
    Switch::all().len() as u64
}

/// Measure every effect of a scene that can be switched, over at most the first 70 µs, damped 250 µs.
///
/// # Errors
/// [`ModelError`] when the scene itself cannot be run; an effect that cannot is a row with its reason.
pub fn measured(scene: &Scene, watch: &dyn Watch) -> Result<EffectCosts, ModelError> {
    let damped = !scene.damping.coefficients.are_absent();
    let window = scene.duration.min(if damped { WINDOW.1 } else { WINDOW.0 });
    let mut scene = scene.clone();
    scene.duration = window;
    let (base, _) = Bench::new(&scene)?.alone()?;
    let mut rows = Vec::with_capacity(Switch::all().len());
    for switch in Switch::all() {
        if watch.stop() {
            return Err(ModelError::Stopped { time: 0.0 });
        }
        rows.push(marginal(&scene, switch, window));
        watch.advance(1);
    }
    let model = scene.model.kind.name();
    Ok(EffectCosts { scene: scene.name.clone(), model, window_s: window, base, effects: rows })
}

/// The names of all effects that can be switched.
pub fn names() -> impl Iterator<Item = &'static str> {
    Switch::all().map(Switch::name)
}

/// A scene without and with the effect of that name, whichever it has: what is compared. Both may differ from it in what the effect needs
/// beside it, such as the model in which it can be computed. None where the effect does not go with the scene, or there is none of that name.
#[must_use]
pub fn pair(scene: &Scene, name: &str) -> Option<(Scene, Scene)> {
    let switch = Switch::all().find(|switch| switch.name() == name)?;
    let mut ground = scene.clone();
    if !switch.ground(&mut ground) {
        return None;
    }
    let mut other = ground.clone();
    if is_on(scene, name) {
        switch.remove(&mut other).then_some((other, ground))
    } else {
        switch.insert(&mut other).then_some((ground, other))
    }
}

/// Whether a scene has the effect of that name.
#[must_use]
pub fn is_on(scene: &Scene, name: &str) -> bool {
    match name {
        "water by elements" => is_by_elements(scene),
        name => effects(scene).iter().any(|effect| effect.name == name && effect.on),
    }
}

/// Whether the water of a scene is meshed.
#[must_use]
pub fn is_by_elements(scene: &Scene) -> bool {
    scene.water.as_ref().is_some_and(|water| matches!(water.method, granchain_model::scene::WaterMethod::Elements(_)))
}

fn marginal(scene: &Scene, switch: Switch, window: f64) -> Marginal {
    let on = is_on(scene, switch.name());
    let key = switch.key(on);
    let row =
        |measured, refused| Marginal { name: switch.name(), on, belongs: switch.belongs(), key, measured, refused };
    let Some((without, with)) = pair(scene, switch.name()) else {
        return row(None, Some("does not go with this scene".into()));
    };
    match compare(&without, &with, window) {
        Ok(measured) => row(Some(measured), None),
        Err(error) => row(None, Some(error.to_string())),
    }
}

/// Run both scenes in turn.
fn compare(without: &Scene, with: &Scene, window: f64) -> Result<Measured, ModelError> {
    let (bare, whole) = (Bench::new(without)?, Bench::new(with)?);
    let (mut times, mut last) = ([Vec::new(), Vec::new()], None);
    let started = Instant::now();
    let more = |done: usize| {
        let elapsed = started.elapsed().as_secs_f64();
        done == 0 || REPEATS.iter().any(|&(most, time)| done < most && elapsed < time)
    };
    while more(times[0].len()) {
        let (bare_time, bare_response) = bare.timed()?;
        let (whole_time, whole_response) = whole.timed()?;
        times[0].push(bare_time);
        times[1].push(whole_time);
        last = Some((bare_response, whole_response));
    }
    let (bare_response, whole_response) = match last {
        Some(last) => last,
        None => (bare.timed()?.1, whole.timed()?.1),
    };
    let [bare_times, whole_times] = times;
    Ok(Measured {
        without: bare.cost(&bare_response, bare_times),
        with: whole.cost(&whole_response, whole_times),
        change: Change::between(&whole_response, &bare_response, with, window),
    })
}

/// A scene with its bodies made ready.
struct Bench<'a> {
    scene: &'a Scene,
    prepared: Prepared,
    prepare_s: f64,
}

impl<'a> Bench<'a> {
    fn new(scene: &'a Scene) -> Result<Self, ModelError> {
        let clock = Clock::start();
        let prepared = model::prepare(scene)?;
        Ok(Self { scene, prepared, prepare_s: clock.elapsed() })
    }

    fn timed(&self) -> Result<(f64, Response), ModelError> {
        let clock = Clock::start();
        let response = self.prepared.run(self.scene, &mut |_| true)?;
        Ok((clock.elapsed(), response))
    }

    fn cost(&self, response: &Response, mut times: Vec<f64>) -> Cost {
        times.sort_by(f64::total_cmp);
        Cost {
            work: response.work,
            preparation: self.prepared.work(),
            run_s: times.get(times.len() / 2).copied().unwrap_or(0.0),
            prepare_s: self.prepare_s,
            runs: times.len(),
        }
    }

    fn alone(&self) -> Result<(Cost, Response), ModelError> {
        let mut times = Vec::new();
        let (time, mut response) = self.timed()?;
        times.push(time);
        for _ in 1..REPEATS[0].0 {
            let (time, again) = self.timed()?;
            times.push(time);
            response = again;
        }
        Ok((self.cost(&response, times), response))
    }
}
