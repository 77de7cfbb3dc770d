//! Losses within reduced bodies: of the modes kept, and of the static flexibility that stands for all others.
//!
//! The material of a body has the modulus E (1 + β d/dt) (Kelvin–Voigt), E (1 + g e^(−t/τ)) (a standard linear solid), or both:
//!
//! ```text
//! E(s)/E = 1 + β s + g τ s/(1 + τ s)
//! ```
//!
//! A mode kept moves by
//!
//! ```text
//! q̈ + β ω² q̇ + ω² (q + g (q − z)) = f,        τ ż = q − z
//! ```
//!
//! its damping in the middle of the drift, where the velocity is that of the whole step: a free mode then decays by e^(−β ω² t/2) exactly at any step,
//! and q static is f/ω². z follows a q that is straight over the step, exactly.
//!
//! The rest of the flexibility has no inertia: it creeps under the forces of its points by the inverse of E(s),
//!
//! ```text
//! u = R λᵉ,    λᵉ = j₀ λ + Σ a_k y_k,    ẏ_k = r_k (λ − y_k),    E/E(s) = j₀ + Σ a_k r_k/(s + r_k),    j₀ + Σ a_k = 1
//! ```
//!
//! exactly under a λ that is straight over the step: λᵉ′ = w λ′ + p, with w the same in every step and p known at its start. So the contacts are
//! condensed on w R once, and R p joins their gaps. The same y in every point: nothing is lost in the static answer, and nothing left out.

use super::{contact::dot, mechanics::Mechanics, reduction::Reduction};
use crate::{
    number::{Mask, Number},
    scene::{MaterialLoss, Relaxation},
};

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Law {
    /// β, s.
    pub(super) retardation: f64,
    pub(super) relaxation: Option<Relaxation>,
}

impl Law {
    pub(super) fn of(reduction: &Reduction, loss: &MaterialLoss) -> Vec<Option<Self>> {
        let support = reduction.support.map(|member| reduction.members[member].kind);
        let law = |kind: usize| {
            let (retardation, relaxation) = loss.of_body(support == Some(kind));
            Self { retardation, relaxation }
        };
        (0..reduction.kinds.len()).map(|kind| Some(law(kind)).filter(|law| *law != Self::default())).collect()
    }

    /// j₀ and the pairs a, r of E/E(s).
    fn creep(&self) -> (f64, Vec<[f64; 2]>) {
        let beta = self.retardation;
        match self.relaxation {
            None if beta == 0.0 => (1.0, Vec::new()),
            None => (0.0, vec![[1.0, 1.0 / beta]]),
            Some(Relaxation { strength: g, time }) if beta == 0.0 => {
                (1.0 / (1.0 + g), vec![[g / (1.0 + g), 1.0 / (time * (1.0 + g))]])
            }
            Some(Relaxation { strength: g, time }) => {
                // β τ s² + (β + τ (1 + g)) s + 1 = 0.
                let sum = beta + time * (1.0 + g);
                let fast = (sum + (sum * sum - 4.0 * beta * time).sqrt()) / (2.0 * beta * time);
                let slow = 1.0 / (beta * time * fast);
                let share = |own: f64, other: f64| (1.0 - time * own) * other / (other - own);
                (0.0, vec![[share(slow, fast), slow], [share(fast, slow), fast]])
            }
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct StepLaw {
    law: Law,
    step: f64,
    instant: f64,
    terms: Vec<Term>,
    pub(super) weight: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Term {
    share: f64,
    rate: f64,
    /// e^(−r h).
    kept: f64,
    /// (1 − e^(−r h))/(r h).
    mean: f64,
}

/// (1 − e^(−x))/x.
fn mean_decay(x: f64) -> f64 {
    if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
}

impl StepLaw {
    pub(super) fn new(law: Law, step: f64) -> Self {
        let (instant, pairs) = law.creep();
        let term = |[share, rate]: [f64; 2]| {
            let x = rate * step;
            Term { share, rate, kept: (-x).exp(), mean: mean_decay(x) }
        };
        let terms: Vec<Term> = pairs.into_iter().map(term).collect();
        let weight = instant + terms.iter().map(|term| term.share * (1.0 - term.mean)).sum::<f64>();
        Self { law, step, instant, terms, weight }
    }

    /// Modulus of fast changes over that of slow ones, β left out, 1.
    pub(super) fn fast(&self) -> f64 {
        1.0 + self.law.relaxation.map_or(0.0, |relaxation| relaxation.strength)
    }

    /// Whether it has any of β, and of relaxation.
    pub(super) fn parts(&self) -> [bool; 2] {
        [self.law.retardation > 0.0, self.law.relaxation.is_some()]
    }
}

#[derive(Debug, Clone)]
pub(super) struct ModalLoss<N> {
    /// e^(−β ω² h) of every mode.
    pub(super) damping: Vec<f64>,
    /// g, and e^(−h/τ) and (1 − e^(−h/τ)) τ/h; none without relaxation.
    relaxation: Option<[f64; 4]>,
    /// q − z of every mode; empty without relaxation.
    behind: Vec<N>,
}

impl<N: Number> ModalLoss<N> {
    pub(super) fn new(law: &StepLaw, squares: &[f64]) -> Self {
        let StepLaw { law: Law { retardation, relaxation }, step, .. } = law;
        Self {
            damping: squares.iter().map(|square| (-retardation * square * step).exp()).collect(),
            relaxation: relaxation.map(|Relaxation { strength, time }| {
                [strength, (-step / time).exp(), mean_decay(step / time), time / step]
            }),
            behind: vec![N::ZERO; if relaxation.is_some() { squares.len() } else { 0 }],
        }
    }

    /// What relaxation adds to the amounts of the modes in their restoring force, g (q − z); none without.
    #[inline(always)]
    pub(super) fn stiffening(&self) -> Option<(f64, &[N])> {
        self.relaxation.map(|[strength, ..]| (strength, &self.behind[..]))
    }

    /// Let z follow the move `moved` of mode `k`, whose ω² is `square`; the energy lost, J.
    #[inline(always)]
    pub(super) fn relax(&mut self, k: usize, moved: N, square: f64) -> N {
        let Some([strength, kept, mean, time]) = self.relaxation else { return N::ZERO };
        let before = self.behind[k];
        let after = moved * mean + before * kept;
        self.behind[k] = after;
        // ∫ (q − z)²/τ dt along a straight q.
        let followed = moved - (after - before);
        let lost = moved * followed * time - (after * after - before * before) * 0.5;
        lost * (strength * square)
    }
}

impl ModalLoss<f64> {
    /// Energy in the relaxing part of the modes, J.
    pub(super) fn energy(&self, squares: &[f64]) -> f64 {
        let strength = self.relaxation.map_or(0.0, |[strength, ..]| strength);
        0.5 * strength * self.behind.iter().zip(squares).map(|(d, square)| square * d * d).sum::<f64>()
    }
}

#[derive(Debug, Clone)]
pub(super) struct Creep<N> {
    bodies: Vec<Option<Creeping<N>>>,
    /// R p of every contact, from both sides, m, and the least of every block.
    pub(super) gaps: Vec<Vec<N>>,
    pub(super) least: Vec<Vec<N>>,
}

#[derive(Debug, Clone)]
struct Creeping<N> {
    kind: usize,
    member: usize,
    faces: [Option<usize>; 2],
    /// The contact before the body and the one after it.
    sides: [Option<Side<N>>; 2],
}

#[derive(Debug, Clone)]
struct Side<N> {
    /// y of every term, N, and its change in the last step; within a step what it will be but for the force at the end.
    y: Vec<Vec<N>>,
    moved: Vec<Vec<N>>,
    /// p, N.
    known: Vec<N>,
    /// λᵉ, N.
    felt: Vec<N>,
    /// Points from the first with a p to behind the last.
    range: [usize; 2],
}

impl<N: Number> Side<N> {
    /// That has carried these forces for long.
    fn at_rest(law: &StepLaw, forces: &[N]) -> Self {
        let count = law.terms.len();
        Self {
            y: vec![forces.to_vec(); count],
            moved: vec![vec![N::ZERO; forces.len()]; count],
            known: vec![N::ZERO; forces.len()],
            felt: forces.to_vec(),
            range: [0, 0],
        }
    }

    /// Begin a step from the forces λ (N) at its start.
    #[inline(always)]
    fn begin(&mut self, law: &StepLaw, forces: &[N]) {
        self.known.fill(N::ZERO);
        for ((term, y), moved) in law.terms.iter().zip(&self.y).zip(&mut self.moved) {
            let own = term.mean - term.kept;
            for (((known, moved), force), y) in self.known.iter_mut().zip(moved).zip(forces).zip(y) {
                // What y is at the end without the force there.
                *moved = *force * own + *y * term.kept;
                *known = *known + *moved * term.share;
            }
        }
        let acts = |known: &N| !known.equals(N::ZERO).every();
        let first = self.known.iter().position(acts).unwrap_or(0);
        self.range = [first, self.known.iter().rposition(acts).map_or(first, |last| last + 1)];
    }

    /// End it with the forces λ′ (N) there.
    #[inline(always)]
    fn end(&mut self, law: &StepLaw, forces: &[N]) {
        for ((felt, known), force) in self.felt.iter_mut().zip(&self.known).zip(forces) {
            *felt = *force * law.weight + *known;
        }
        for ((term, y), moved) in law.terms.iter().zip(&mut self.y).zip(&mut self.moved) {
            for ((y, moved), force) in y.iter_mut().zip(moved).zip(forces) {
                let new = *force * (1.0 - term.mean) + *moved;
                *moved = new - *y;
                *y = new;
            }
        }
    }
}

impl<N: Number> Creep<N> {
    /// Of bodies at rest under these forces of the contacts (N); none where all are elastic.
    pub(super) fn new<'a>(
        reduction: &Reduction,
        laws: &[Option<StepLaw>],
        forces: impl Fn(usize) -> &'a [N],
        blocks: usize,
    ) -> Option<Self>
    where
        N: 'a,
    {
        if laws.iter().all(Option::is_none) {
            return None;
        }
        let contacts = reduction.contacts.len();
        let bodies = (0..=contacts).map(|slot| {
            let member = reduction.member(slot)?;
            let kind = reduction.members[member].kind;
            let law = laws[kind].as_ref()?;
            let side = |contact: usize| (contact < contacts).then(|| Side::at_rest(law, forces(contact)));
            let back = reduction.members[member].back.and_then(|_| side(slot));
            let faces = [Some(reduction.members[member].front), reduction.members[member].back];
            Some(Creeping { kind, member, faces, sides: [side(slot - 1), back] })
        });
        let bodies = bodies.collect();
        let gaps: Vec<Vec<N>> = (0..contacts).map(|contact| vec![N::ZERO; forces(contact).len()]).collect();
        let least = gaps.iter().map(|gaps| vec![N::ZERO; gaps.len().div_ceil(blocks)]).collect();
        Some(Self { bodies, gaps, least })
    }

    /// Begin a step: what the flexibility has not yet given back, in the gaps. `forces` are those at its start.
    #[inline(always)]
    pub(super) fn begin<'a>(&mut self, mechanics: &Mechanics, forces: impl Fn(usize) -> &'a [N], block: usize)
    where
        N: 'a,
    {
        self.gaps.iter_mut().for_each(|gaps| gaps.fill(N::ZERO));
        for (slot, body) in self.bodies.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            let Some(law) = &mechanics.laws[body.kind] else { continue };
            let faces = body.faces;
            for (end, side) in body.sides.iter_mut().enumerate() {
                let (Some(side), Some(face)) = (side, faces[end]) else { continue };
                side.begin(law, forces(slot - 1 + end));
                let [first, last] = side.range;
                let far = 1 - end;
                for (target, matrix) in [
                    (slot - 1 + end, mechanics.whole[face].as_deref()),
                    (slot - 1 + far, faces[far].and_then(|_| mechanics.across[body.member][end].as_deref())),
                ] {
                    let Some(matrix) = matrix else { continue };
                    let gaps = &mut self.gaps[target];
                    let rows = matrix.chunks_exact(gaps.len());
                    let terms = side.known[first..last].iter().zip(rows.skip(first));
                    N::subtract_all(gaps, terms.map(|(known, row)| (N::ZERO - *known, row)));
                }
            }
        }
        for (least, gaps) in self.least.iter_mut().zip(&self.gaps) {
            for (least, gaps) in least.iter_mut().zip(gaps.chunks(block)) {
                *least = gaps.iter().copied().fold(N::all(f64::INFINITY), N::smaller);
            }
        }
    }

    #[inline(always)]
    pub(super) fn end<'a>(&mut self, mechanics: &Mechanics, forces: impl Fn(usize) -> &'a [N])
    where
        N: 'a,
    {
        for (slot, body) in self.bodies.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            let Some(law) = &mechanics.laws[body.kind] else { continue };
            for (end, side) in body.sides.iter_mut().enumerate() {
                if let Some(side) = side {
                    side.end(law, forces(slot - 1 + end));
                }
            }
        }
    }

    /// Forces (N) that the flexibility of the body in a slot answers at its front (0) or back (1); none where it answers the contact's own.
    #[inline(always)]
    pub(super) fn felt(&self, slot: usize, end: usize) -> Option<&[N]> {
        self.bodies[slot].as_ref()?.sides[end].as_ref().map(|side| &side.felt[..])
    }
}

impl Creep<f64> {
    /// Energy (J) that the flexibility holds, less what the contacts' own account ([`State::energy`](super::contact::State::energy)) has of it:
    /// ½ λᵀ w R λ.
    pub(super) fn energy<'a>(&self, mechanics: &Mechanics, forces: impl Fn(usize) -> &'a [f64]) -> f64 {
        let mut sum = 0.0;
        for (slot, body) in self.bodies.iter().enumerate() {
            let Some((body, law)) = body.as_ref().and_then(|body| Some((body, mechanics.laws[body.kind].as_ref()?)))
            else {
                continue;
            };
            let own = [0, 1].map(|end| body.sides[end].as_ref().map(|_| forces(slot - 1 + end)));
            sum += 0.5 * (law.instant - law.weight) * body.square(mechanics, own);
            for (k, term) in law.terms.iter().enumerate() {
                let y = [0, 1].map(|end| body.sides[end].as_ref().map(|side| &side.y[k][..]));
                sum += 0.5 * term.share * body.square(mechanics, y);
            }
        }
        sum
    }

    /// Energy lost in the last step, J: Σ a r ∫ (λ − y)ᵀ R (λ − y) dt with the mean of λ − y over the step.
    pub(super) fn lost(&self, mechanics: &Mechanics) -> f64 {
        let mut sum = 0.0;
        for body in self.bodies.iter().flatten() {
            let Some(law) = &mechanics.laws[body.kind] else { continue };
            for (k, term) in law.terms.iter().enumerate() {
                let moved = [0, 1].map(|end| body.sides[end].as_ref().map(|side| &side.moved[k][..]));
                sum += term.share / (term.rate * law.step) * body.square(mechanics, moved);
            }
        }
        sum
    }
}

impl Creeping<f64> {
    /// fᵀ R f with the forces of front and back, J.
    fn square(&self, mechanics: &Mechanics, forces: [Option<&[f64]>; 2]) -> f64 {
        let product = |matrix: &[f64], rows: &[f64], columns: &[f64]| -> f64 {
            let lines = matrix.chunks_exact(columns.len()).zip(rows).filter(|(_, row)| **row != 0.0);
            lines.map(|(line, row)| row * dot(columns, line)).sum()
        };
        let own = forces.iter().zip(self.faces).map(|(forces, face)| match (forces, face) {
            (Some(forces), Some(face)) => {
                mechanics.whole[face].as_ref().map_or(0.0, |whole| product(whole, forces, forces))
            }
            _ => 0.0,
        });
        let across = match (forces, &mechanics.across[self.member][0]) {
            ([Some(front), Some(back)], Some(matrix)) => product(matrix, front, back),
            _ => 0.0,
        };
        own.sum::<f64>() + 2.0 * across
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 5e-8;

    fn laws() -> Vec<Law> {
        let relaxation = |strength, time| Some(Relaxation { strength, time });
        vec![
            Law { retardation: 3e-9, relaxation: None },
            Law { retardation: 3e-7, relaxation: None },
            Law { retardation: 0.0, relaxation: relaxation(0.7, 2e-6) },
            Law { retardation: 8e-9, relaxation: relaxation(3.0, 4e-7) },
        ]
    }

    /// E(iω)/E.
    fn modulus(law: &Law, angular: f64) -> [f64; 2] {
        let (g, x) = law.relaxation.map_or((0.0, 0.0), |own| (own.strength, angular * own.time));
        [1.0 + g * x * x / (1.0 + x * x), law.retardation * angular + g * x / (1.0 + x * x)]
    }

    #[test]
    fn creep_is_the_inverse_of_the_modulus_at_every_frequency() {
        for law in laws() {
            let (instant, pairs) = law.creep();
            assert!((instant + pairs.iter().map(|[share, _]| share).sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(pairs.iter().all(|[share, rate]| *share > 0.0 && *rate > 0.0), "{pairs:?}");
            for angular in [1e3, 4.6e5, 3e6, 1e8] {
                let [storage, loss] = modulus(&law, angular);
                // J = j₀ + Σ a r/(iω + r); times E must be 1.
                let (mut real, mut imaginary) = (instant, 0.0);
                for [share, rate] in pairs.iter().copied() {
                    let size = share * rate / (angular * angular + rate * rate);
                    real += size * rate;
                    imaginary -= size * angular;
                }
                let product = [real * storage - imaginary * loss, real * loss + imaginary * storage];
                assert!((product[0] - 1.0).abs() < 1e-9 && product[1].abs() < 1e-9, "{law:?} {angular} {product:?}");
            }
        }
    }

    #[test]
    fn a_point_under_a_slow_sinusoid_gives_way_by_the_compliance_of_its_material() {
        for law in laws() {
            let stepped = StepLaw::new(law, STEP);
            let angular = 2.0 * std::f64::consts::PI * 73e3;
            let mut side = Side::at_rest(&stepped, &[0.0]);
            let (mut cosine, mut sine) = (0.0, 0.0);
            // 60 periods to ring up, then whole ones.
            let (from, to) = (8000, 8000 + 137 * 20);
            let force = |taken: i32| (angular * STEP * f64::from(taken)).sin();
            let per = 20.0 * 2.0 * std::f64::consts::PI / angular / STEP;
            assert!((per - 5479.45).abs() < 0.01);
            for taken in 1..=from + 5479 {
                side.begin(&stepped, &[force(taken - 1)]);
                side.end(&stepped, &[force(taken)]);
                if taken > from {
                    let phase = angular * STEP * f64::from(taken);
                    sine += side.felt[0] * phase.sin();
                    cosine += side.felt[0] * phase.cos();
                }
            }
            let _ = to;
            let [storage, loss] = modulus(&law, angular);
            let square = storage * storage + loss * loss;
            let (sine, cosine) = (2.0 * sine / 5479.0, 2.0 * cosine / 5479.0);
            // Straight pieces of a sine: (ωh)²/12 = 4e-5; the window misses half a step of 20 periods.
            assert!(
                (sine - storage / square).abs() < 3e-4 && (cosine + loss / square).abs() < 3e-4,
                "{law:?} {sine} {cosine}"
            );
        }
    }

    #[test]
    fn what_a_point_gives_way_to_is_stored_or_lost() {
        for law in laws() {
            let stepped = StepLaw::new(law, STEP);
            let mut side = Side::at_rest(&stepped, &[0.0]);
            let (mut work, mut lost, mut place, mut last) = (0.0, 0.0, 0.0, 0.0);
            let mut force = 0.0;
            for taken in 1..=1000 {
                let next = (f64::from(taken) * STEP / 3e-6).sin().powi(2);
                side.begin(&stepped, &[force]);
                side.end(&stepped, &[next]);
                work += 0.5 * (force + next) * (side.felt[0] - place);
                for (k, term) in stepped.terms.iter().enumerate() {
                    lost += term.share / (term.rate * STEP) * side.moved[k][0].powi(2);
                }
                (force, place, last) = (next, side.felt[0], next);
            }
            let terms = stepped.terms.iter().zip(&side.y).map(|(term, y)| term.share * y[0] * y[0]);
            let stored = 0.5 * (stepped.instant * last * last + terms.sum::<f64>());
            assert!(lost > 0.0 && (work - stored - lost).abs() < 2e-3 * lost + 1e-6, "{law:?} {work} {stored} {lost}");
        }
    }
}
