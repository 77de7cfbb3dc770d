//! One static contact: force, radius and pressure against approach, held against closed laws.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::{
    figure::{Axis, Colour, Dash, Figure, Marker, Panel, Stroke},
    number::{engineering, fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, provenance},
};

/// A contact pressed together step by step, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Version of the program.
    pub program: String,
    /// The two bodies, such as `bead on bead`.
    pub pair: String,
    /// What was computed, in one or two sentences: bodies, materials, mesh.
    pub description: String,
    /// The closed law that the force is held against, such as `Hertz`.
    pub law: String,
    /// What the abscissa of a pressure profile is, such as `Radius`.
    pub abscissa: String,
    /// One entry a way of loading.
    pub loadings: Vec<ContactLoading>,
    /// What must not be overlooked.
    pub warnings: Vec<String>,
    /// What the numbers mean and where the laws come from.
    pub statements: Vec<String>,
    /// Command line as typed.
    pub command_line: String,
}

/// A way of loading and its states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactLoading {
    /// Name for people, such as `squeezed at both poles`.
    pub name: String,
    /// States, by approach.
    pub states: Vec<ContactState>,
}

/// One state of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactState {
    /// Approach of the mass means of both bodies, m.
    pub approach_m: f64,
    /// Force, N.
    pub force_n: f64,
    /// Contact radius, or half the width of a ring, m.
    pub radius_m: f64,
    /// Largest pressure, Pa.
    pub peak_pressure_pa: f64,
    /// Force of the closed law at the same approach, N.
    pub law_force_n: f64,
    /// Force of the finite-body law at the same approach, N, where there is one.
    pub finite_body_force_n: Option<f64>,
    /// Radius of the closed law under the same force, m, where it gives one.
    pub law_radius_m: Option<f64>,
    /// Largest pressure of the closed law under the same force, Pa, where it gives one.
    pub law_peak_pressure_pa: Option<f64>,
    /// (place along the surface from the middle of the contact m, pressure Pa).
    pub pressure: Vec<[f64; 2]>,
}

impl ContactState {
    /// F/F_law − 1, 1.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        self.force_n / self.law_force_n - 1.0
    }

    /// The law's pressure p₀ √(1 − (r/a)²) at a place (m), Pa, where it gives one; 0 outside its contact.
    #[must_use]
    pub(crate) fn law_pressure(&self, place: f64) -> Option<f64> {
        let (radius, peak) = (self.law_radius_m?, self.law_peak_pressure_pa?);
        Some(peak * (1.0 - (place / radius).powi(2)).max(0.0).sqrt())
    }
}

/// How far a pressure profile is drawn, in contact radii of the largest approach.
const SHOWN_RADII: f64 = 1.2;
/// Pressure profiles drawn of a loading.
const PROFILES: usize = 3;

impl ContactReport {
    /// `report.html`, `report.md`, the figures, `contact.csv`, `pressure.csv`, `contact.json`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no state, or one is not finite.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.loadings.iter().all(|loading| loading.states.is_empty()) {
            return Err(ReportError::Missing { field: "loadings" });
        }
        for loading in &self.loadings {
            for state in &loading.states {
                let numbers = [state.approach_m, state.force_n, state.radius_m, state.peak_pressure_pa];
                if let Some(found) = numbers.into_iter().find(|number| !number.is_finite()) {
                    let field = format!("{} at {}", loading.name, engineering(state.approach_m, "m", 3));
                    return Err(ReportError::NotFinite { field, found });
                }
            }
        }
        let mut files = self.page().files()?;
        files.push(("contact.csv".into(), self.csv().into_bytes()));
        files.push(("pressure.csv".into(), self.pressure_csv().into_bytes()));
        let mut json = serde_json::to_vec_pretty(self)?;
        json.push(b'\n');
        files.push(("contact.json".into(), json));
        Ok(files)
    }

    /// Unit in which pressures are shown, and how many of it are one Pa.
    #[must_use]
    pub fn pressure_unit(&self) -> (&'static str, f64) {
        let states = self.loadings.iter().flat_map(|loading| &loading.states);
        let largest = states.map(|state| state.peak_pressure_pa).fold(0.0, f64::max);
        if largest < 0.5e9 { ("MPa", 1e-6) } else { ("GPa", 1e-9) }
    }

    /// Force, deviation from the law, radius and pressure.
    #[must_use]
    pub fn plates(&self) -> Vec<Plate> {
        let mut plates = vec![
            Plate::new("force", self.force_figure()),
            Plate::new("deviation", self.deviation_figure()),
            Plate::new("radius", self.radius_figure()),
        ];
        for (index, loading) in self.loadings.iter().enumerate() {
            plates.push(Plate::new(format!("pressure-{}", index + 1), self.pressure_figure(loading)));
        }
        plates
    }

    /// The columns of `contact.csv` as a table for people.
    #[must_use]
    pub fn table(&self) -> Table {
        let (unit, factor) = self.pressure_unit();
        let number = |value: Option<f64>, factor: f64, figures: usize| {
            value.map_or("–".to_owned(), |value| significant(factor * value, figures))
        };
        let rows = self.loadings.iter().flat_map(|loading| {
            loading.states.iter().map(|state| {
                let over = |law: Option<f64>| {
                    law.map_or("–".to_owned(), |law| fixed(100.0 * (state.force_n / law - 1.0), 2))
                };
                vec![
                    loading.name.clone(),
                    significant(1e6 * state.approach_m, 3),
                    significant(state.force_n, 5),
                    over(Some(state.law_force_n)),
                    over(state.finite_body_force_n),
                    significant(1e6 * state.radius_m, 4),
                    number(state.law_radius_m, 1e6, 4),
                    significant(factor * state.peak_pressure_pa, 4),
                    number(state.law_peak_pressure_pa, factor, 4),
                ]
            })
        });
        Table {
            caption: format!(
                "The contact state by state. Forces are compared at the same approach, radius and pressure of {} at the same force.",
                self.law
            ),
            columns: vec![
                Column::words("Loading"),
                Column::numbers("Approach").unit("µm"),
                Column::numbers("Force").unit("N"),
                Column::numbers(format!("over {}", self.law)).unit("%"),
                Column::numbers("over finite-body law").unit("%"),
                Column::numbers("Radius").unit("µm"),
                Column::numbers(format!("Radius, {}", self.law)).unit("µm"),
                Column::numbers("Peak pressure").unit(unit),
                Column::numbers(format!("Peak, {}", self.law)).unit(unit),
            ],
            rows: rows.collect(),
        }
    }

    fn page(&self) -> Page {
        let mut blocks = vec![Block::Paragraph(self.description.clone())];
        if !self.warnings.is_empty() {
            blocks.push(Block::Notice(self.warnings.clone()));
        }
        blocks.push(Block::Plates(self.plates()));
        blocks.push(Block::Table(self.table()));
        if !self.statements.is_empty() {
            blocks.push(Block::List(self.statements.clone()));
        }
        blocks.extend(provenance(vec![("version".into(), self.program.clone())], &self.command_line));
        Page {
            title: format!("Static contact, {}", self.pair),
            subtitle: format!("Force, radius and pressure by finite elements, against {}", self.law),
            blocks,
        }
    }

    fn styled(&self) -> impl Iterator<Item = (&ContactLoading, Colour, Marker)> {
        let styles =
            [(Colour::Vermillion, Marker::Disc), (Colour::Blue, Marker::Ring), (Colour::Green, Marker::Square)];
        self.loadings
            .iter()
            .zip(styles.into_iter().cycle())
            .map(|(loading, (colour, marker))| (loading, colour, marker))
    }

    fn force_figure(&self) -> Figure {
        let mut panel = Panel::new(approach_axis(), Axis::new("Force", "N").logarithmic()).height(50.0);
        if let Some(loading) = self.loadings.first() {
            let law = curve(loading, |state| Some(state.law_force_n));
            panel = panel.line(self.law.clone(), law, Stroke::new(Colour::Black).dash(Dash::Dashed));
        }
        for (loading, colour, marker) in self.styled() {
            panel = panel.points(loading.name.clone(), curve(loading, |state| Some(state.force_n)), colour, marker);
        }
        Figure::new(format!("Force against approach of the mass means; dashed: {}.", self.law)).panel(panel)
    }

    fn deviation_figure(&self) -> Figure {
        let axis = Axis::new(format!("Force over {}, less 1", self.law), "%").times(100.0);
        let mut panel =
            Panel::new(approach_axis(), axis).height(50.0).mark_y(0.0, "", Stroke::new(Colour::Black).width(0.7));
        for (loading, colour, marker) in self.styled() {
            panel = panel.points(loading.name.clone(), curve(loading, |state| Some(state.deviation())), colour, marker);
            let finite = curve(loading, |state| Some(state.finite_body_force_n? / state.law_force_n - 1.0));
            if !finite.is_empty() {
                panel = panel.line(String::new(), finite, Stroke::new(colour).dash(Dash::Dashed));
            }
        }
        let closed = self.loadings.iter().flat_map(|l| &l.states).any(|state| state.finite_body_force_n.is_some());
        let dashed = if closed { "; dashed: the finite-body law of that loading" } else { "" };
        Figure::new(format!("Deviation of the force from {} at the same approach{dashed}.", self.law)).panel(panel)
    }

    fn radius_figure(&self) -> Figure {
        let mut panel = Panel::new(
            Axis::new("Force", "N").logarithmic(),
            Axis::new("Contact radius", "µm").times(1e6).logarithmic(),
        )
        .height(50.0);
        let against = |loading: &ContactLoading, value: &dyn Fn(&ContactState) -> Option<f64>| {
            let points = loading.states.iter().filter_map(|state| Some((state.force_n, value(state)?)));
            points.filter(|(force, radius)| *force > 0.0 && *radius > 0.0).collect::<Vec<_>>()
        };
        if let Some(loading) = self.loadings.first() {
            let law = against(loading, &|state| state.law_radius_m);
            if !law.is_empty() {
                panel = panel.line(self.law.clone(), law, Stroke::new(Colour::Black).dash(Dash::Dashed));
            }
        }
        for (loading, colour, marker) in self.styled() {
            panel = panel.points(loading.name.clone(), against(loading, &|state| Some(state.radius_m)), colour, marker);
        }
        Figure::new("Contact radius against force; it is known to half the distance of two contact points.")
            .panel(panel)
    }

    fn pressure_figure(&self, loading: &ContactLoading) -> Figure {
        let axis = Axis::new(self.abscissa.clone(), "µm").times(1e6);
        let (unit, factor) = self.pressure_unit();
        let mut panel = Panel::new(axis, Axis::new("Pressure", unit).times(factor)).height(50.0);
        let shown = profiles(&loading.states);
        let wide = SHOWN_RADII * shown.last().map_or(0.0, |state| state.radius_m);
        let colours = [Colour::Blue, Colour::Vermillion, Colour::Black];
        let markers = [Marker::Ring, Marker::Disc, Marker::Square];
        for ((state, colour), marker) in shown.iter().zip(colours).zip(markers) {
            if let Some(radius) = state.law_radius_m {
                let places = (0..=100).map(|i| radius * (f64::from(i) / 100.0));
                let law = places.filter_map(|place| Some((place, state.law_pressure(place)?))).collect();
                panel = panel.line(String::new(), law, Stroke::new(colour).dash(Dash::Dashed));
            }
            let near = state.pressure.iter().filter(|[place, _]| place.abs() <= wide);
            let pressed = near.map(|[place, pressure]| (*place, *pressure)).collect();
            panel = panel.points(engineering(state.approach_m, "m", 2), pressed, colour, marker);
        }
        let law = if shown.iter().any(|state| state.law_radius_m.is_some()) {
            format!("; dashed: {} under the same force", self.law)
        } else {
            String::new()
        };
        Figure::new(format!("Pressure along the surface, {}, at the approaches named{law}.", loading.name)).panel(panel)
    }

    fn csv(&self) -> String {
        let mut text = String::from(
            "loading,approach_m,force_n,radius_m,peak_pressure_pa,law_force_n,finite_body_force_n,law_radius_m,law_peak_pressure_pa\n",
        );
        let cell = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:e}"));
        for loading in &self.loadings {
            for state in &loading.states {
                // Writing to a string cannot fail.
                let _ = writeln!(
                    text,
                    "{},{:e},{:e},{:e},{:e},{:e},{},{},{}",
                    loading.name,
                    state.approach_m,
                    state.force_n,
                    state.radius_m,
                    state.peak_pressure_pa,
                    state.law_force_n,
                    cell(state.finite_body_force_n),
                    cell(state.law_radius_m),
                    cell(state.law_peak_pressure_pa)
                );
            }
        }
        text
    }

    fn pressure_csv(&self) -> String {
        let mut text = String::from("loading,approach_m,place_m,pressure_pa,law_pressure_pa\n");
        for loading in &self.loadings {
            for state in &loading.states {
                for [place, pressure] in &state.pressure {
                    let law = state.law_pressure(*place).map_or_else(String::new, |law| format!("{law:e}"));
                    let _ = writeln!(text, "{},{:e},{place:e},{pressure:e},{law}", loading.name, state.approach_m);
                }
            }
        }
        text
    }
}

fn approach_axis() -> Axis {
    Axis::new("Approach", "µm").times(1e6).logarithmic()
}

fn curve(loading: &ContactLoading, value: impl Fn(&ContactState) -> Option<f64>) -> Vec<(f64, f64)> {
    loading.states.iter().filter_map(|state| Some((state.approach_m, value(state)?))).collect()
}

/// The states whose pressure is drawn: the last, and those nearest a half and a quarter of its approach.
fn profiles(states: &[ContactState]) -> Vec<&ContactState> {
    let Some(last) = states.last() else { return Vec::new() };
    let mut shown: Vec<&ContactState> = Vec::new();
    for part in 0..PROFILES {
        let wanted = last.approach_m / f64::from(1_u32 << (PROFILES - 1 - part));
        let distance = |state: &ContactState| (state.approach_m - wanted).abs();
        let nearest = states.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)));
        shown.extend(nearest.filter(|state| shown.last().is_none_or(|before| before.approach_m != state.approach_m)));
    }
    shown
}
