//! Error against time, against work, against what is varied.

use super::{line_name, percent};
use crate::accuracy::{
    ladder::{FidelityLevel, Varied},
    stored::{Measured, OwnErrors, Stored},
};
use granchain_report::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::significant,
};

/// Colour, marker and dash of a model.
fn look(fidelity: FidelityLevel) -> (Colour, Marker, Dash) {
    match fidelity {
        FidelityLevel::Chain => (Colour::Black, Marker::Disc, Dash::Solid),
        FidelityLevel::ChainFixed => (Colour::Grey, Marker::Ring, Dash::Dashed),
        FidelityLevel::FiniteBody => (Colour::Green, Marker::Diamond, Dash::DashDotted),
        FidelityLevel::Reduced => (Colour::Vermillion, Marker::Square, Dash::Solid),
        FidelityLevel::Fea => (Colour::Blue, Marker::Disc, Dash::Dashed),
        FidelityLevel::FeaDamped => (Colour::SkyBlue, Marker::Ring, Dash::Dotted),
        FidelityLevel::ChainElements => (Colour::Orange, Marker::Diamond, Dash::Dotted),
    }
}

fn error_axis() -> Axis {
    Axis::new("Error", "%").times(100.0).logarithmic()
}

/// Name of a model and the orders observed of it.
fn with_orders(found: &Stored, fidelity: FidelityLevel) -> String {
    let orders: Vec<String> = found
        .own
        .iter()
        .filter(|own| own.fidelity == fidelity && own.key != "contact-force")
        .filter_map(|own| Some(format!("{} {}", own.varied.symbol(), significant(own.order?, 2))))
        .collect();
    if orders.is_empty() { fidelity.name().to_owned() } else { format!("{} ({})", fidelity.name(), orders.join(", ")) }
}

/// All settings in a plane of cost and error: points a model, a line along what is best of each, the chaos floor, the front.
fn plane(
    found: &Stored,
    axis: Axis,
    cost: &dyn Fn(&Measured) -> f64,
    front: &[usize],
    name: &dyn Fn(FidelityLevel) -> String,
) -> Panel {
    let mut panel = Panel::new(axis, error_axis()).height(80.0);
    let points = |chosen: &dyn Fn(usize, &Measured) -> bool| -> Vec<(f64, f64)> {
        let all = found.measured.iter().enumerate().filter(|(place, measured)| chosen(*place, measured));
        all.map(|(_, measured)| (cost(measured), found.known_error(measured))).collect()
    };
    for fidelity in FidelityLevel::ALL {
        let own = |below: bool| {
            points(&|_, measured| measured.setting.fidelity == fidelity && found.is_below_limit(measured) == below)
        };
        let (known, below) = (own(false), own(true));
        let (colour, marker, dash) = look(fidelity);
        let label_below = if known.is_empty() { name(fidelity) } else { String::new() };
        if !known.is_empty() {
            // A line on to a limit would look like an error that is known.
            panel = panel.line(String::new(), lower_left(known.clone()), Stroke::new(colour).dash(dash));
            panel = panel.points(name(fidelity), known, colour, marker);
        }
        if !below.is_empty() {
            panel = panel.points(label_below, below, colour, Marker::Below);
        }
    }
    if !front.is_empty() {
        panel = panel.points("front", points(&|place, _| front.contains(&place)), Colour::Black, Marker::Cross);
    }
    if found.measured.iter().any(|measured| found.is_below_limit(measured)) {
        let label = format!("reference known to {}, triangles below it", percent(found.least_quotable()));
        panel = panel.mark_y(found.least_quotable(), label, Stroke::new(Colour::Grey).dash(Dash::DashDotted));
    }
    if found.chaos.floor > 0.0 {
        let label = format!("chaos floor {}", percent(found.chaos.floor));
        panel = panel.mark_y(found.chaos.floor, label, Stroke::new(Colour::Grey).dash(Dash::Dotted));
    }
    panel
}

/// What of some points no other is left of and below, from left to right.
fn lower_left(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    points.retain(|(_, error)| {
        let better = *error < least;
        least = least.min(*error);
        better
    });
    points
}

/// Error against seconds of one run, and against those of the bodies and one run.
pub(crate) fn against_time(found: &Stored) -> Figure {
    let seconds = |title: &str| Axis::new(title, "s").logarithmic();
    let front = found.front();
    let run = plane(
        found,
        seconds("Time of one run, bodies kept"),
        &|measured| measured.cost.run_s.least,
        &[],
        &|fidelity| fidelity.name().to_owned(),
    );
    let total =
        plane(found, seconds("Time with the bodies made"), &|measured| measured.cost.total(), &front, &|fidelity| {
            with_orders(found, fidelity)
        });
    Figure::new(
        "Total error against time, one thread. Lines join what is best of each model; numbers behind the models are \
         observed orders in tolerance, step Δt and element size h. \
         Crosses: nothing is shown to be both cheaper and more accurate. Open triangles: below what the reference is known to. Below the chaos floor accuracy buys nothing.",
    )
    .sized(PAGE_WIDTH_MM, 2)
    .panel(total)
    .panel(run)
}

/// Error against unknowns times steps or evaluations: the same on every machine.
pub(crate) fn against_work(found: &Stored) -> Figure {
    let axis = Axis::new("Unknowns × steps (chain: × evaluations)", "1").logarithmic();
    let updates = |measured: &Measured| {
        let work = measured.work;
        (work.unknowns * work.steps.max(work.evaluations)) as f64
    };
    Figure::new("Total error against work in counts that are the same on every machine. Below the chaos floor accuracy buys nothing.")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(plane(found, axis, &updates, &[], &|fidelity| with_orders(found, fidelity)))
}

/// Error of every line against its own limit, one panel for each number that is varied.
pub fn own_errors(found: &Stored) -> Figure {
    let figure = Figure::new(
        "Error of each model against its own limit as one number is varied; the observed order behind its name. Errors too small for the limit to be known are left out.",
    );
    let kinds = [
        (Varied::Tolerance, "Tolerance", "1"),
        (Varied::Step, "Step", "µs"),
        (Varied::Density, "Mesh density", "1"),
        (Varied::Modes, "Modes", "1"),
        (Varied::WaterMesh, "Side of the water’s elements", "mm"),
    ];
    let panels: Vec<Panel> = kinds
        .into_iter()
        .filter_map(|(varied, label, unit)| {
            let lines: Vec<&OwnErrors> = found.own.iter().filter(|own| own.varied == varied).collect();
            let factor = match varied {
                Varied::Step => 1e6,
                Varied::WaterMesh => 1e3,
                Varied::Tolerance | Varied::Density | Varied::Modes => 1.0,
            };
            let axis = Axis::new(label, unit).times(factor);
            let axis = if varied == Varied::Modes { axis } else { axis.logarithmic() };
            let panel = lines.iter().fold(Panel::new(axis, error_axis()).height(50.0), |panel, own| {
                let (colour, marker, dash) = if own.key == "contact-force" {
                    (Colour::Black, Marker::Cross, Dash::Dotted)
                } else {
                    look(own.fidelity)
                };
                let quoted = own.points.iter().filter(|point| point.quoted);
                let points: Vec<(f64, f64)> = quoted.map(|point| (point.value, point.error)).collect();
                let order = own.order.map_or(String::new(), |order| format!(" {}", significant(order, 2)));
                let label = format!("{}{order}", line_name(own));
                panel
                    .line(String::new(), points.clone(), Stroke::new(colour).dash(dash))
                    .points(label, points, colour, marker)
            });
            (!lines.is_empty() && lines.iter().any(|own| own.points.iter().any(|point| point.quoted))).then_some(panel)
        })
        .collect();
    let columns = panels.len().clamp(1, 2);
    panels.into_iter().fold(figure.sized(PAGE_WIDTH_MM, columns), Figure::panel)
}
