//! Figures of the study before water.

use crate::water::{
    BAFFLES, Cell, CombinationOutcome, PRINTED_DRIVE, PRINTED_LEVEL_DB, PRINTED_PRESSURE, Quantiles, RIMS,
    WaterOutcome, Waveform,
};
use granchain_report::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::{engineering, short, significant},
    page::Plate,
};
use granchain_signal::feature::AmplitudeSpectrum;

/// Highest frequency of the spectra, Hz.
const HIGHEST: f64 = 1.2e6;
/// Lowest level of the spectra, dB.
const LOWEST_DB: f64 = -60.0;

/// Peak pressure and level over the drive, one column a baffle, one curve a mount and place of the dampers.
pub(super) fn drives(outcome: &WaterOutcome) -> Figure {
    let figure = Figure::new(
        "Peak pressure at 1 mm (top) and level around 0.95 MHz re the fundamental (bottom) over the drive; points and bars: median, lowest and \
         highest of the runs. Full: dampers at all contacts; dashed: between beads only. Dotted: the printed 14 kPa and −21 dB; marked: the printed \
         drive.",
    )
    .sized(PAGE_WIDTH_MM, 2);
    let pressure = |baffle: &str| {
        let y = Axis::new("Peak pressure", "kPa").times(1e-3).logarithmic();
        let panel = over_drive(outcome, baffle, y, |cell| cell.pressure_pa);
        panel.mark_y(PRINTED_PRESSURE, "", Stroke::new(Colour::Black).dash(Dash::Dotted))
    };
    let level = |baffle: &str| {
        let y = Axis::new("Level around 0.95 MHz", "dB");
        let panel = over_drive(outcome, baffle, y, |cell| cell.level_db);
        panel.mark_y(PRINTED_LEVEL_DB, "", Stroke::new(Colour::Black).dash(Dash::Dotted))
    };
    let tops = BAFFLES.map(|baffle| pressure(baffle).titled(format!("{baffle} baffle")));
    tops.into_iter().chain(BAFFLES.map(level)).fold(figure, Figure::panel)
}

fn over_drive(outcome: &WaterOutcome, baffle: &str, y: Axis, pick: fn(&Cell) -> Option<Quantiles>) -> Panel {
    const LOOKS: [(Colour, Marker); 3] =
        [(Colour::Black, Marker::Disc), (Colour::Vermillion, Marker::Square), (Colour::Blue, Marker::Diamond)];
    let drives = &outcome.plan.drives_m;
    let (low, high) = (drives.first().copied().unwrap_or(1.0), drives.last().copied().unwrap_or(1.0));
    let ticks = drives.iter().map(|drive| (*drive, short(1e6 * drive))).collect();
    let x = Axis::new("Drive", "µm").times(1e6).logarithmic().range(low / 1.15, high * 1.15).named_ticks(ticks);
    let own = outcome.combinations.iter().filter(|own| own.combination.baffle == baffle);
    own.fold(Panel::new(x, y).height(48.0).mark_x(PRINTED_DRIVE, ""), |panel, own| {
        let CombinationOutcome { combination, cells, .. } = own;
        let place = RIMS.iter().position(|rim| *rim == combination.rim).unwrap_or(0);
        let (colour, marker) = LOOKS[place];
        let points: Vec<ErrorPoint> = cells
            .iter()
            .filter_map(|cell| Some((cell.drive_m, pick(cell)?)))
            .filter(|(_, found)| found.lowest.is_finite() && found.highest.is_finite())
            .map(|(drive, found)| ErrorPoint::vertical(drive, found.median, found.lowest, found.highest))
            .collect();
        let line = points.iter().map(|point| (point.x, point.y)).collect();
        let dash = if combination.placement == "all" { Dash::Solid } else { Dash::Dashed };
        let label = if combination.placement == "all" { combination.rim } else { "" };
        panel.line("", line, Stroke::new(colour).dash(dash).width(0.8)).error_points(label, points, colour, marker)
    })
}

/// Fig. 7 once and Fig. 8 for every drawn run.
pub(super) fn waveforms(waveforms: &[Waveform]) -> Vec<Plate> {
    let mut plates: Vec<Plate> = waveforms.first().map(|first| Plate::new("fig-7", drive(first))).into_iter().collect();
    for (index, waveform) in waveforms.iter().enumerate() {
        let name = if index == 0 { "fig-8-printed-drive" } else { "fig-8-printed-pressure" };
        plates.push(Plate::new(name, response(waveform)));
    }
    plates
}

/// Displacement of the piston and its normalised spectrum.
fn drive(waveform: &Waveform) -> Figure {
    let time = Axis::new("Time", "µs").times(1e6);
    let displacement = Panel::new(time, Axis::new("Displacement", "µm").times(1e6))
        .titled("(a) piston")
        .height(42.0)
        .line("", trace(&waveform.piston), Stroke::new(Colour::Blue).width(0.7));
    let largest = waveform.piston_spectrum.amplitudes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let points = points(&waveform.piston_spectrum, 0.2e6, |amplitude| amplitude / largest);
    let spectrum =
        Panel::new(Axis::new("Frequency", "kHz").times(1e-3).range(0.0, 0.2e6), Axis::new("Normalised amplitude", "1"))
            .titled("(b) its spectrum")
            .height(42.0)
            .line("", points, Stroke::new(Colour::Blue));
    Figure::new(format!(
        "The drive, as Fig. 7 of the paper: 30 cycles of 73 kHz under a Gaussian, {} at the peak",
        engineering(waveform.drive_m, "m", 3)
    ))
    .sized(PAGE_WIDTH_MM, 2)
    .panel(displacement)
    .panel(spectrum)
}

/// Velocity of the pole, pressure, and its spectrum re the fundamental.
fn response(waveform: &Waveform) -> Figure {
    let time = || Axis::new("Time", "µs").times(1e6);
    let velocity = Panel::new(time(), Axis::new("Velocity", "mm/s").times(1e3))
        .titled("(a) pole of the last bead, on the disc")
        .height(36.0)
        .line("", trace(&waveform.velocity), Stroke::new(Colour::Vermillion).width(0.6));
    let pressure = Panel::new(time(), Axis::new("Pressure", "kPa").times(1e-3))
        .titled("(b) pressure on the axis, 1 mm into the water")
        .height(36.0)
        .line("", trace(&waveform.pressure), Stroke::new(Colour::Blue).width(0.6));
    let reference = waveform.features.harmonics.first().map_or(f64::MIN_POSITIVE, |line| line.amplitude_pa);
    let db = |amplitude: f64| (20.0 * (amplitude / reference).max(1e-9).log10()).max(LOWEST_DB - 20.0);
    let points = points(&waveform.pressure_spectrum, HIGHEST, db);
    let highest = points.iter().fold(0.0, |highest: f64, point| highest.max(point.1));
    let harmonics = waveform.features.harmonics.iter().map(|line| (line.frequency_hz, db(line.amplitude_pa))).collect();
    let y = Axis::new("Level re the fundamental", "dB").range(LOWEST_DB, highest + 4.0);
    let spectrum = Panel::new(Axis::new("Frequency", "MHz").times(1e-6).range(0.0, HIGHEST), y)
        .titled("(c) spectrum of the pressure")
        .height(46.0)
        .mark_x(0.95e6, "0.95 MHz")
        .mark_y(PRINTED_LEVEL_DB, "−21 dB", Stroke::new(Colour::Black).dash(Dash::Dotted))
        .line("", points, Stroke::new(Colour::Blue).width(0.7))
        .points("harmonics of 73 kHz", harmonics, Colour::Vermillion, Marker::Dot);
    Figure::new(format!(
        "As Fig. 8 of the paper, {} disc, {} baffle, dampers at all contacts, drive {}: peak {}, {} around 0.95 MHz",
        waveform.combination.rim,
        waveform.combination.baffle,
        engineering(waveform.drive_m, "m", 3),
        engineering(waveform.features.largest(), "Pa", 3),
        waveform
            .features
            .probe_level_db
            .map_or_else(|| "unknown level".to_owned(), |level| format!("{} dB", significant(level, 2)))
    ))
    .sized(PAGE_WIDTH_MM, 1)
    .panel(velocity)
    .panel(pressure)
    .panel(spectrum)
}

fn points(spectrum: &AmplitudeSpectrum, highest: f64, shown: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let all = spectrum.amplitudes.iter().enumerate().map(|(index, &amplitude)| (spectrum.frequency(index), amplitude));
    all.take_while(|(frequency, _)| *frequency <= highest).map(|(frequency, a)| (frequency, shown(a))).collect()
}
