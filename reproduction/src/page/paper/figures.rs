//! Figures of the study of the paper.

use super::{
    PaperReport,
    tables::{capitalised, reading_name},
};
use crate::paper::{LAWS, Law, PaperOutcome, ReadingOutcome, SweepPoint};
use crate::portrait::Trait;
use crate::published::{KUWABARA_KONO, LINEAR, MEASURED};
use granchain_report::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Polygon, Stroke, trace},
    number::fixed,
    page::Plate,
};
use granchain_signal::{
    Series,
    feature::{AmplitudeSpectrum, Ratio},
};

/// Highest frequency of the spectra, in drive frequencies.
const SPAN: f64 = 3.25;
/// Instants shown of the waveforms, s.
const SHOWN: (f64, f64) = (0.0, 700e-6);

fn time() -> Axis {
    Axis::new("Time", "µs").times(1e6)
}

/// Velocity of the last bead before the rigid wall on every model.
pub(super) fn rigid(outcome: &PaperOutcome) -> Figure {
    const STROKES: [Stroke; 3] = [
        Stroke::new(Colour::Black),
        Stroke::new(Colour::Vermillion).dash(Dash::Dashed),
        Stroke::new(Colour::Blue).dash(Dash::DashDotted),
    ];
    let end = outcome.rigid.windows_s.iter().fold(0.0, |end: f64, (_, to)| end.max(*to));
    let panel = Panel::new(time().range(0.0, end), Axis::new("Velocity of the last bead", "m/s")).height(52.0);
    let panel = outcome
        .rigid
        .runs
        .iter()
        .zip(STROKES.into_iter().cycle())
        .fold(panel, |panel, (run, stroke)| panel.line(run.model, trace(&run.velocity.window(0.0, end)), stroke));
    Figure::new(
        "Velocity of the last bead’s centre before the rigid wall, undamped, 1 µm: the models of this program side by side, as finite elements \
         and discrete chain in Fig. 5 of the paper. Models part with time because the motion is chaotic, not because one has failed.",
    )
    .sized(PAGE_WIDTH_MM, 1)
    .panel(panel)
}

/// Peaks and line ratios over α, both laws.
pub(super) fn sweep(outcome: &PaperOutcome) -> Figure {
    let figure = Figure::new(
        "Peaks of the pole’s velocity (top) and line amplitudes over the drive line (bottom) against the amplitude scale α. Points: mean and \
         standard deviation over perturbed runs. Dotted: the measured peaks as printed; crosses: the peaks the paper prints of its own runs.",
    )
    .sized(PAGE_WIDTH_MM, 2);
    let peaks = LAWS.iter().zip(&outcome.sweeps).enumerate().map(|(index, (law, sweep))| peak_panel(index, law, sweep));
    let ratios = LAWS.iter().zip(&outcome.sweeps).map(|(law, sweep)| ratio_panel(law, sweep));
    peaks.chain(ratios).fold(figure, Figure::panel)
}

fn alpha() -> Axis {
    Axis::new("Amplitude scale α", "1").range(0.22, 1.58)
}

fn curve(panel: Panel, label: &str, sweep: &[SweepPoint], what: Trait, colour: Colour, marker: Marker) -> Panel {
    let points: Vec<ErrorPoint> = sweep
        .iter()
        .filter_map(|point| {
            let own = point.moments.get(what)?;
            Some(ErrorPoint::vertical(point.alpha, own.mean, own.mean - own.deviation, own.mean + own.deviation))
        })
        .collect();
    let line = points.iter().map(|point| (point.x, point.y)).collect();
    panel.line("", line, Stroke::new(colour).width(0.7)).error_points(label, points, colour, marker)
}

fn peak_panel(index: usize, law: &Law, sweep: &[SweepPoint]) -> Panel {
    let printed = if index == 0 { LINEAR } else { KUWABARA_KONO };
    let y = Axis::new("Peak velocity", "mm/s").times(1e3);
    let panel = Panel::new(alpha(), y).height(45.0).titled(format!("{} dampers: peaks", capitalised(law.name)));
    let panel = panel.mark_x(law.alpha, "paper");
    let dotted = |colour| Stroke::new(colour).dash(Dash::Dotted);
    let panel = panel.mark_y(MEASURED.positive_m_per_s, "measured, printed", dotted(Colour::Black)).mark_y(
        MEASURED.negative_m_per_s,
        "",
        dotted(Colour::Black),
    );
    let panel = curve(panel, "positive", sweep, Trait::PositivePeak, Colour::Vermillion, Marker::Disc);
    let panel = curve(panel, "negative", sweep, Trait::NegativePeak, Colour::Blue, Marker::Square);
    panel.points(
        "paper’s own",
        vec![(law.alpha, printed.positive_m_per_s), (law.alpha, printed.negative_m_per_s)],
        Colour::Black,
        Marker::Cross,
    )
}

fn ratio_panel(law: &Law, sweep: &[SweepPoint]) -> Panel {
    let panel = Panel::new(alpha(), Axis::new("A(f)/A(f0)", "1"))
        .height(45.0)
        .titled(format!("{} dampers: lines", capitalised(law.name)))
        .mark_x(law.alpha, "paper");
    [
        (Ratio::new(1, 3), Colour::Vermillion, Marker::Disc),
        (Ratio::new(1, 2), Colour::Blue, Marker::Square),
        (Ratio::new(2, 3), Colour::Orange, Marker::Diamond),
    ]
    .into_iter()
    .fold(panel, |panel, (line, colour, marker)| {
        curve(panel, &line.to_string(), sweep, Trait::Level(line), colour, marker)
    })
}

/// Waveform and spectrum of the reconstruction and of both laws.
pub(super) fn waveforms(report: &PaperReport) -> Figure {
    let figure = Figure::new(
        "Velocity of the last bead’s pole (left) and its spectrum relative to the drive line (right): the reconstruction made from printed \
         numbers, which is no measurement, and one unperturbed run of each law at the paper’s α. Drive at 73 kHz; fractions of it are marked. \
         Dotted: the printed peaks of that row.",
    )
    .sized(PAGE_WIDTH_MM, 2);
    let f0 = report.drive_frequency;
    let reconstruction = &report.reconstruction;
    let mut panels = vec![
        waveform(
            "(a) reconstruction",
            &reconstruction.velocity,
            (MEASURED.positive_m_per_s, MEASURED.negative_m_per_s),
            Colour::Black,
        ),
        spectrum("(b) reconstruction", &reconstruction.spectrum, reconstruction.drive_line, f0, Colour::Black),
    ];
    let looks = [(LINEAR, Colour::Vermillion, 'c'), (KUWABARA_KONO, Colour::Blue, 'e')];
    for (law, (printed, colour, letter)) in report.outcome.laws.iter().zip(looks) {
        let name = |letter: char| format!("({letter}) {} dampers, α = {}", law.law.name, law.law.alpha);
        let peaks = (printed.positive_m_per_s, printed.negative_m_per_s);
        let drive = law.single.get(Trait::DriveLine).unwrap_or(1.0);
        panels.push(waveform(&name(letter), &law.velocity, peaks, colour));
        panels.push(spectrum(&name(char::from(letter as u8 + 1)), &law.spectrum, drive, f0, colour));
    }
    panels.into_iter().fold(figure, Figure::panel)
}

fn waveform(title: &str, velocity: &Series, (up, down): (f64, f64), colour: Colour) -> Panel {
    let dotted = Stroke::new(Colour::Grey).dash(Dash::Dotted);
    let y = Axis::new("Velocity", "mm/s").times(1e3).range(-0.36, 0.36);
    Panel::new(time().range(SHOWN.0, SHOWN.1), y)
        .titled(title)
        .height(36.0)
        .line("", trace(&velocity.window(SHOWN.0, SHOWN.1)), Stroke::new(colour).width(0.6))
        .mark_y(up, "", dotted)
        .mark_y(down, "", dotted)
}

fn spectrum(title: &str, spectrum: &AmplitudeSpectrum, drive: f64, f0: f64, colour: Colour) -> Panel {
    const LOWEST_DB: f64 = -50.0;
    let points: Vec<(f64, f64)> = spectrum
        .amplitudes
        .iter()
        .enumerate()
        .map(|(index, amplitude)| (spectrum.frequency(index), amplitude))
        .take_while(|(frequency, _)| *frequency <= SPAN * f0)
        .map(|(frequency, amplitude)| (frequency, (20.0 * (amplitude / drive).max(1e-9).log10()).max(LOWEST_DB - 10.0)))
        .collect();
    let x = Axis::new("Frequency", "kHz").times(1e-3).range(0.0, SPAN * f0);
    let panel = Panel::new(x, Axis::new("Level re f0", "dB").range(LOWEST_DB, 10.0)).titled(title).height(36.0);
    [Ratio::new(1, 3), Ratio::new(1, 2), Ratio::new(2, 3), Ratio::ONE, Ratio::new(2, 1), Ratio::new(3, 1)]
        .into_iter()
        .fold(panel, |panel, line| panel.mark_x(line.value() * f0, line.to_string()))
        .line("", points, Stroke::new(colour))
}

/// One plate a law: readings by rank, three bars each.
pub(super) fn readings(outcome: &PaperOutcome) -> Vec<Plate> {
    LAWS.iter()
        .zip(&outcome.readings)
        .map(|(law, readings)| Plate::new(format!("readings-{}", law.kind), ranked(law, readings)))
        .collect()
}

/// Changes beyond this are drawn to the frame, 1.
const WIDEST: f64 = 1.0;

fn ranked(law: &Law, readings: &[ReadingOutcome]) -> Figure {
    let shown: Vec<&ReadingOutcome> = readings.iter().filter(|reading| reading.changes.is_some()).collect();
    let names = shown.iter().enumerate().map(|(row, reading)| (-(row as f64), reading_name(reading))).collect();
    let rows = shown.len() as f64;
    let y = Axis::new("Reading", "").range(-rows + 0.4, 0.6).named_ticks(names);
    let changes = shown.iter().filter_map(|reading| reading.changes.as_ref()).flatten();
    let widest = changes.map(|change| change.change.abs()).fold(0.05, f64::max).min(WIDEST) * 1.05;
    let step = [0.02, 0.05, 0.1, 0.2, 0.5].into_iter().find(|step| widest / step < 3.0).unwrap_or(0.5);
    let ticks = (-4..=4).map(|index| f64::from(index) * step).filter(|at| at.abs() <= widest);
    let ticks = ticks.map(|at| (at, fixed(100.0 * at, 0))).collect();
    let x = Axis::new("Change", "%").times(100.0).range(-widest, widest).named_ticks(ticks);
    let mut panel = Panel::new(x, y).height(8.0 + 6.2 * rows);
    let quantities = [
        ("positive peak".to_owned(), Colour::Vermillion),
        ("negative peak".to_owned(), Colour::Blue),
        (format!("A({}·f0)/A(f0)", law.own_line), Colour::Black),
    ];
    for (place, (label, colour)) in quantities.into_iter().enumerate() {
        let bars = shown.iter().enumerate().filter_map(|(row, reading)| {
            let change = reading.changes.as_ref()?.get(place)?;
            let (bottom, top) = bar_edges(row, place);
            let tip = change.change.clamp(-widest, widest);
            let share = if change.significance.abs() < 2.0 { 0.35 } else { 1.0 };
            Some(Polygon { corners: vec![(0.0, bottom), (tip, bottom), (tip, top), (0.0, top)], fill: (colour, share) })
        });
        panel = panel.layer(Layer::Polygons { label, polygons: bars.collect() });
    }
    let zero = vec![(0.0, -rows + 0.4), (0.0, 0.6)];
    panel = panel.line("", zero, Stroke::new(Colour::Grey).width(0.5));
    Figure::new(format!(
        "{} dampers, α = {}: what each reading changes, largest shift on top. Peaks in per cent of their own value (right: larger in size), the \
         line ratio in hundredths. Pale: less than two scatters. Bars that reach the frame go beyond it; their numbers stand in the table.",
        capitalised(law.name),
        law.alpha
    ))
    .panel(panel)
}

/// Lower and upper edge of bar `place` (0…2) of a row, rows one apart and going down.
fn bar_edges(row: usize, place: usize) -> (f64, f64) {
    let top = -(row as f64) + 0.36 - 0.24 * place as f64;
    (top - 0.22, top)
}
