//! The outcome as it is shown: parameters with their symbols in the units of the laboratory, laws by their names.

use std::collections::BTreeMap;

use super::{CalibrationReport, DensityMap, LawReport, RecordReport};
use crate::{figure::Map, number, page::Column};
use granchain_calibration::predict::observation::watched_of;
use granchain_calibration::{
    outcome::{FidelityOutcome, FitOutcome, FittedFeature, FittedParameter, OutcomeFeature},
    parameter::{PARAMETERS, Parameter, Shown},
};
use granchain_model::scene::DampingKind;
use granchain_signal::feature::Measurand;

/// A law with its fit, and what is drawn of it.
pub(super) struct Law<'a> {
    pub fit: &'a FitOutcome,
    pub drawn: &'a LawReport,
    /// Its parameters in the order fitted.
    pub parameters: Vec<Estimate>,
}

impl CalibrationReport {
    /// Every law, the one the report leads with first.
    pub(super) fn laws(&self) -> Vec<Law<'_>> {
        let laws = self.outcome.laws.iter().zip(&self.laws);
        laws.map(|(fit, drawn)| {
            let parameters = estimates(&fit.parameters, &drawn.parameters, &fit.damping_kind);
            Law { fit, drawn, parameters }
        })
        .collect()
    }

    /// The record that the scene is of.
    pub(super) fn lead(&self) -> &RecordReport {
        &self.records[0]
    }

    /// What the watched features of record `number` and of the calibrated model are, in the order they are watched.
    pub(super) fn features(&self, number: usize) -> Vec<FeatureRow<'_>> {
        let best = &self.outcome.best;
        let of_record = best.records.get(number).filter(|_| number > 0);
        let (features, fitted) = of_record
            .map_or((&best.features, &best.fitted_features), |record| (&record.features, &record.fitted_features));
        let watched = watched_of(self.outcome.quantity, self.drive_frequency).into_iter();
        // Peaks that the fit compared are those of the whole answer: one value a feature.
        let compared = |key: &str| fitted.get(key).is_some_and(|feature| feature.measured.is_some());
        let row = |key: String| {
            if key.ends_with("_peak") && compared(&key) {
                return None;
            }
            let feature = features.get(&key)?;
            // Of a pressure a harmonic's line is compared by the band around it.
            let band = key.replace("line_", "band_");
            let fitted = compared(&key) || self.outcome.quantity == Measurand::Pressure && compared(&band);
            let row = FeatureRow { name: key.replace('_', " "), feature, fitted };
            (feature.measured.is_some() || feature.simulated.is_some()).then_some(row)
        };
        watched.filter_map(|watched| row(watched.key)).collect()
    }
}

/// One row of the feature table, SI.
pub(super) struct FeatureRow<'a> {
    /// Name for people, such as `positive peak` or `line 1/3`.
    pub name: String,
    pub feature: &'a OutcomeFeature,
    /// Whether the fit used it.
    pub fitted: bool,
}

impl<'r> Law<'r> {
    /// The law as it reads in a sentence: `linear damping`, `linear dampers`, `linear damping on the free disc`.
    pub(super) fn name(&self) -> String {
        let mount = self.fit.mount.as_ref().map_or_else(String::new, |mount| format!(" on the {mount} disc"));
        let kind = law_name(&self.fit.damping_kind);
        if kind.contains("damp") { format!("{kind}{mount}") } else { format!("{kind} damping{mount}") }
    }

    /// The law in the names of files: `linear`, `linear-clamped`.
    pub(super) fn key(&self) -> String {
        let law = law_name(&self.fit.damping_kind).to_lowercase();
        let law = law.replace(|letter: char| !letter.is_ascii_alphanumeric(), "-");
        self.fit.mount.as_ref().map_or_else(|| law.clone(), |mount| format!("{law}-{mount}"))
    }

    /// Each model below the answer with what it says by itself, the chain first.
    pub(super) fn below(&self) -> Vec<(&'r str, &'r LawReport, Vec<Estimate>)> {
        let below = std::iter::successors(self.drawn.below.as_deref(), |law| law.below.as_deref());
        let below: Vec<&LawReport> = below.collect();
        let own = |(law, fidelity): (&'r LawReport, &'r FidelityOutcome)| {
            (fidelity.model.as_str(), law, estimates(&fidelity.parameters, &law.parameters, &self.fit.damping_kind))
        };
        below.into_iter().rev().zip(&self.fit.fidelities).map(own).collect()
    }

    /// Correlation of the first two parameters, where there are two.
    pub(super) fn correlation(&self) -> Option<f64> {
        (self.parameters.len() > 1).then_some(self.fit.correlation)
    }

    /// The fitted features of every record at the answer, in the order compared; of several records with their names.
    pub(super) fn compared<'a>(&'a self, records: &'a [RecordReport]) -> Vec<(String, &'a FittedFeature)> {
        let several = records.len() > 1;
        let of_record = |(number, record): (usize, &'a RecordReport)| {
            let fitted = match self.fit.records.get(number).filter(|_| number > 0) {
                Some(record) => &record.fitted_features,
                None => &self.fit.fitted_features,
            };
            let named = record.compared.iter().filter_map(move |name| Some((name, fitted.get(name)?)));
            named.map(move |(name, feature)| {
                let shown = name.replace('_', " ");
                (if several { format!("{} {shown}", record.label) } else { shown }, feature)
            })
        };
        records.iter().enumerate().flat_map(of_record).collect()
    }
}

/// Name of a damping law for people.
#[must_use]
pub fn law_name(kind: &str) -> &str {
    match DampingKind::named(kind).map(DampingKind::terms) {
        Some([term]) => term.description().title,
        _ => kind,
    }
}

/// One fitted parameter in the unit it is shown in.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    /// Name for people, such as `amplitude scale`.
    pub name: &'static str,
    pub symbol: &'static str,
    /// Unit; `1` for a pure number.
    pub unit: String,
    /// That unit's number over the SI's.
    pub factor: f64,
    pub value: f64,
    /// Ends of the 90 % interval; `None` where none may be quoted.
    pub low: Option<f64>,
    pub high: Option<f64>,
    /// Lower and upper end of the search.
    pub bounds: (f64, f64),
    /// Whether the fit leans on an end.
    pub at_bound: bool,
}

impl Estimate {
    /// Head of a column of its values.
    pub(super) fn column(&self) -> Column {
        let column = Column::words(format!("{} {}", self.name, self.symbol));
        match number::unit(&self.unit) {
            unit if unit == "1" => column,
            unit => column.unit(unit),
        }
    }
}

/// Fitted parameters in the given order.
pub(super) fn estimates(parameters: &BTreeMap<String, FittedParameter>, order: &[String], law: &str) -> Vec<Estimate> {
    order.iter().filter_map(|key| Some(estimate(key, parameters.get(key)?, law))).collect()
}

fn estimate(key: &str, fitted: &FittedParameter, law: &str) -> Estimate {
    let beside = Parameter::term_named(key).map(|term| (term.description().coefficient, term));
    let alone = || match DampingKind::named(law)?.terms() {
        [term] if key == "damping" => Some(("damping coefficient", *term)),
        _ => None,
    };
    let damping = beside.or_else(alone).map(|(name, term)| (name, term.description()));
    let of_damping = damping.map(|(_, term)| term.dimension.si_unit()).unwrap_or_default();
    let row = PARAMETERS.iter().find(|row| row.key == key);
    let (name, symbol, factor, unit) = match (damping, row.map(|row| (row.shown)(&fitted.unit))) {
        (Some((name, term)), _) => (name, term.symbol, 1.0, of_damping.as_str()),
        (None, Some(Shown { name, symbol, unit, factor })) => (name, symbol, factor, unit),
        (None, None) => ("parameter", "x", 1.0, fitted.unit.as_str()),
    };
    Estimate {
        name,
        symbol,
        unit: unit.into(),
        factor,
        value: factor * fitted.value,
        low: fitted.low.map(|low| factor * low),
        high: fitted.high.map(|high| factor * high),
        bounds: (factor * fitted.bounds[0], factor * fitted.bounds[1]),
        at_bound: fitted.at_bound,
    }
}

impl DensityMap {
    /// The density over two parameters in the units they are shown in.
    pub(super) fn shown(&self, x: &Estimate, y: &Estimate) -> Map {
        let scaled = |along: &[f64], factor: f64| along.iter().map(|at| factor * at).collect();
        Map { x: scaled(&self.x, x.factor), y: scaled(&self.y, y.factor), values: self.density.clone() }
    }
}
