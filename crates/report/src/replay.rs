//! The page and the figures of one run: what the piston and the last bead did, how the pulses ran through the chain, and the spectrum.

use super::{
    calibration::spectrum::{SpectrumCurve, amplitude_panel},
    dynamics::{ROWS, rows},
    figure::{Axis, Colour, Figure, Layer, Map, PAGE_WIDTH_MM, Panel, Stroke, trace},
    motion::Motion,
    number::{engineering, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, provenance},
    spectrum::lines_table,
};
use granchain_model::response::{Channels, EnergyBalance, ObservedPoint, Response};
use granchain_signal::{
    Series,
    feature::{FeatureError, Features, amplitude_spectrum},
};

/// Highest frequency drawn, in drive frequencies.
const HIGHEST_RATIO: f64 = 8.0;

/// A run as its page shows it.
#[derive(Debug)]
pub struct ReplayReport<'a> {
    /// Name of the scene, and what it is.
    pub scene: (&'a str, &'a str),
    /// What was run, for people: names and values.
    pub facts: Vec<(String, String)>,
    /// Diameter of the first bead, m.
    pub bead_diameter: f64,
    /// Whether anything stands behind the last bead.
    pub has_support: bool,
    pub response: &'a Response,
    /// The observed velocity as the instrument sees it.
    pub seen: &'a Series,
    /// What was measured of it.
    pub features: Option<&'a Features>,
    /// Drive frequency of the scene, Hz.
    pub drive_frequency: f64,
    /// Figures besides, with their names.
    pub others: Vec<(&'static str, Figure)>,
    /// Mean, scatter and sensitivity, if they were requested.
    pub ensemble: Option<Table>,
    /// What was assumed on the way, and what was warned of.
    pub assumptions: Vec<String>,
}

impl ReplayReport<'_> {
    /// `report.html`, and every figure as SVG and PNG beside it.
    pub fn files(self) -> Result<Files, ReportError> {
        self.page()?.files_beside()
    }

    fn page(self) -> Result<Page, ReportError> {
        let Self { response, seen, features, .. } = self;
        let drive_frequency = features.map_or(self.drive_frequency, |features| features.drive_frequency_hz);
        let traces = Plate::new("response", response_figure(response, seen));
        let chain = chain_figure(response, drive_frequency).map(|figure| Plate::new("chain", figure));
        let mut blocks =
            vec![Block::Facts(self.facts), Block::Plates(vec![traces]), Block::Heading("The chain".into())];
        blocks.extend(Motion::of(response, self.bead_diameter, self.has_support).map(Block::Motion));
        blocks.push(Block::Plates(chain.into_iter().collect()));
        if let Some(features) = features {
            let spectrum = Plate::new("spectrum", spectrum_figure(response.observed, seen, features)?);
            blocks.extend(Block::Plates(vec![spectrum]).under("Spectrum"));
            blocks.push(Block::Table(lines_table(features, (1e3, "mm/s"))));
        }
        if !self.others.is_empty() {
            let plates = self.others.into_iter().map(|(name, figure)| Plate::new(name, figure));
            blocks.extend(Block::Plates(plates.collect()).under("Besides"));
        }
        blocks.extend(Block::Table(energy_table(&response.energy)).under("Energy"));
        blocks.extend(self.ensemble.into_iter().flat_map(|table| Block::Table(table).under("Scatter")));
        blocks.extend(Block::listed("Assumed on the way", self.assumptions));
        let files = vec![("beside this page".into(), "scene.toml, response.csv, summary.json".into())];
        blocks.extend(provenance(files, "granchain replay --scene scene.toml"));
        let (name, description) = self.scene;
        Ok(Page { title: format!("Replay of the scene {name}"), subtitle: description.to_owned(), blocks })
    }
}

/// Where the energy of a run came from and went, and its share of what was supplied.
pub(crate) fn energy_table(balance: &EnergyBalance) -> Table {
    let of = |part: fn(&Channels) -> f64| balance.channels.as_ref().map(part).filter(|energy| *energy != 0.0);
    let supplied = (balance.initial_j + balance.piston_work_j).abs();
    let rows = [
        ("work of the horn's source", of(|channels| channels.source_work_j)),
        ("in the horn at the end", of(|channels| channels.horn_j)),
        ("lost in the horn", of(|channels| channels.horn_lost_j)),
        ("stored at the start (precompression)", Some(balance.initial_j)),
        ("work of the piston", Some(balance.piston_work_j)),
        ("kinetic energy at the end", Some(balance.kinetic_j)),
        ("stored in the contacts at the end", Some(balance.stored_j)),
        ("lost in the dashpots", Some(balance.dissipated_j)),
        ("lost in the bead guide's drag", of(|channels| channels.drag_j)),
        ("lost in friction with the bead guide", of(|channels| channels.friction_j)),
        ("lost where contacts yielded", of(|channels| channels.yielding_j)),
        ("lost within the bodies", of(|channels| channels.material_j)),
        ("in the disc at the end", balance.disc_j),
        ("given to the water", balance.water_j),
        ("residual (error of the integrator)", Some(balance.residual_j)),
        ("largest energy in the chain", Some(balance.largest_j)),
    ];
    let row = |(name, value): (&str, Option<f64>)| {
        let value = value?;
        let share = if supplied > 0.0 { significant(100.0 * value / supplied, 2) } else { "–".to_owned() };
        Some(vec![name.to_owned(), significant(1e9 * value, 3), share])
    };
    Table {
        caption: "Energy balance of the run.".into(),
        columns: vec![
            Column::words("Energy"),
            Column::numbers("Value").unit("nJ"),
            Column::numbers("Share of what was supplied").unit("%"),
        ],
        rows: rows.into_iter().filter_map(row).collect(),
    }
}

fn response_figure(response: &Response, seen: &Series) -> Figure {
    let piston = Panel::new(Axis::time(), Axis::new("Displacement", "µm").times(1e6))
        .titled("(a) piston")
        .height(30.0)
        .line("", trace(&response.piston_displacement), Stroke::new(Colour::Blue));
    let place = response.observed.name();
    let seen = Panel::new(Axis::time(), Axis::new("Velocity", "mm/s").times(1e3))
        .titled(format!("(b) {place} of the last bead"))
        .height(45.0)
        .line("", trace(seen), Stroke::new(Colour::Vermillion));
    let figure = Figure::new(format!("Displacement of the piston and velocity of the last bead's {place}"))
        .sized(PAGE_WIDTH_MM, 1)
        .panel(piston)
        .panel(seen);
    let Some(force) = &response.sensor_force else { return figure };
    let force = Panel::new(Axis::time(), Axis::new("Force", "N"))
        .titled("(c) force that the sensor reads")
        .height(45.0)
        .line("", trace(force), Stroke::new(Colour::Green));
    figure.panel(force)
}

/// Drive periods shown of the pulses in the chain, from the first motion of the last bead on.
const PERIODS_SHOWN: f64 = 12.0;
/// Columns of the map of contact forces.
const MAP_COLUMNS: usize = 400;

/// The velocities of the beads one above the other and the contact forces as a map, over the first periods.
fn chain_figure(response: &Response, drive_frequency: f64) -> Option<Figure> {
    let seen = response.observed_velocity();
    let start = seen.start;
    let moving = 0.02 * seen.peak();
    let first = seen.values.iter().position(|velocity| velocity.abs() > moving)?;
    let onset = seen.time(first);
    let end = (onset + PERIODS_SHOWN / drive_frequency).min(seen.end());
    let time = || Axis::time().range(start, end);

    let (velocities, row) = rows(response, (start, end))?;
    let velocities = velocities.titled(format!("(a) velocity of the beads, one row is {}", engineering(row, "m/s", 3)));
    let mut figure = Figure::new(format!(
        "Pulses in the chain: velocities of the beads and contact forces until {PERIODS_SHOWN:.0} drive periods after the last bead first moved"
    ))
    .sized(PAGE_WIDTH_MM, 1)
    .panel(velocities);
    if let Some(map) = force_map(response, start, end) {
        let contacts = response.contact_force.len();
        let names = (0..contacts).step_by(contacts.div_ceil(ROWS).max(1));
        let axis = Axis::new("Contact, counted from the piston", "1")
            .range(-0.5, contacts as f64 - 0.5)
            .named_ticks(names.map(|index| (index as f64, (index + 1).to_string())).collect());
        let panel = Panel::new(time(), axis)
            .titled("(b) contact forces; white: open")
            .height(20.0 + 4.0 * contacts.min(ROWS) as f64)
            .layer(Layer::HeatMap { label: "Force (N)".into(), map, range: None });
        figure = figure.panel(panel);
    }
    Some(figure)
}

/// Largest force of each contact within each of the map's columns, N.
fn force_map(response: &Response, start: f64, end: f64) -> Option<Map> {
    let forces: Vec<Series> = response.contact_force.iter().map(|force| force.window(start, end)).collect();
    let samples = forces.first()?.len();
    let columns = samples.min(MAP_COLUMNS);
    if columns < 2 || forces.len() < 2 {
        return None;
    }
    let bounds = |column: usize| (column * samples / columns, (column + 1) * samples / columns);
    let values = forces
        .iter()
        .flat_map(|force| {
            (0..columns).map(move |column| {
                let (from, to) = bounds(column);
                force.values[from..to].iter().copied().fold(0.0, f64::max)
            })
        })
        .collect();
    let middle = |column: usize| {
        let (from, to) = bounds(column);
        forces[0].start + 0.5 * (from + to - 1) as f64 * forces[0].step
    };
    Some(Map { x: (0..columns).map(middle).collect(), y: (0..forces.len()).map(|j| j as f64).collect(), values })
}

fn spectrum_figure(observed: ObservedPoint, seen: &Series, features: &Features) -> Result<Figure, FeatureError> {
    let spectrum = amplitude_spectrum(seen, features.window)?;
    let drive = features.drive_frequency_hz;
    let curve = SpectrumCurve { label: String::new(), spectrum: &spectrum, stroke: Stroke::new(Colour::Vermillion) };
    let panel = amplitude_panel(&[curve], "Velocity amplitude", "m/s", drive, HIGHEST_RATIO * drive).height(55.0);
    Ok(Figure::new(format!("Spectrum of the velocity of the last bead's {}, Hann window over the drive; fractions of the drive frequency marked", observed.name()))
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel))
}
