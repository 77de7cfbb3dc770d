//! What a step of bodies with drag and with losses in their material needs besides.

use super::{Group, Motion};
use crate::{
    fea::{
        arrangement::Arrangement, assembly::Columns, body::Body, loss::StepLoss, operator::Operator,
        scheme::Coefficients,
    },
    number,
};

#[derive(Debug, Clone)]
pub(super) struct Lossy {
    pub(super) blend: Columns,
    pub(super) product: Columns,
    /// d, the part of the displacements that is not yet relaxed, m; none without relaxation.
    pub(super) behind: Option<Columns>,
    /// Velocities of the massless unknowns in the step before, m/s; empty without retardation.
    pub(super) slopes: Vec<f64>,
}

impl Lossy {
    /// ½ dᵀ K d g with the strength g of the relaxation, J; 0 without.
    pub(super) fn energy(&mut self, body: &Body, strength: f64) -> f64 {
        let Some(behind) = &self.behind else { return 0.0 };
        body.multiply_stiffness(behind, &mut self.product);
        0.5 * strength * dot(behind, &self.product)
    }
}

pub(super) fn dot(a: &Columns, b: &Columns) -> f64 {
    number::dot(a.as_slice(), b.as_slice())
}

impl Motion {
    /// Energy (J) that the bodies lost in drag and in their material in the step just accepted; what relaxes follows.
    pub(crate) fn lose(&mut self, arrangement: &Arrangement, operator: &Operator) -> [f64; 2] {
        let mut lost = [0.0; 2];
        for (kind, group) in self.groups.iter_mut().enumerate() {
            if let Some(loss) = &operator.losses[kind] {
                let own = group.lose(&arrangement.kinds[kind], loss);
                lost = [lost[0] + own[0], lost[1] + own[1]];
            }
        }
        lost
    }

    /// Kind and column of every body that relaxes, in the order of slots.
    pub(super) fn relaxing(&self) -> impl Iterator<Item = (usize, usize)> {
        let relaxes = |kind: usize| self.groups[kind].lossy.as_ref().is_some_and(|lossy| lossy.behind.is_some());
        self.columns.iter().copied().flatten().filter(move |&(kind, _)| relaxes(kind))
    }

    /// d of a kind that relaxes.
    pub(super) fn behind(&self, kind: usize) -> &Columns {
        let group = &self.groups[kind];
        group.lossy.as_ref().and_then(|lossy| lossy.behind.as_ref()).unwrap_or(&group.displacement)
    }
}

impl Group {
    /// Right-hand side of a step with losses, without what lags: M (ũ + θ b/m (ũ − ṽ/c)) + K (1 − α) β_N h² (β (c ũ − ṽ) − g (e d₀ − k u₀)).
    pub(super) fn load_losing(&mut self, body: &Body, loss: &StepLoss, c: &Coefficients) {
        let Self { displacement, velocity, acceleration, predicted, solution, massless, lossy, .. } = self;
        let Some(lossy) = lossy else { return };
        let (u, v, a) = (displacement.as_slice(), velocity.as_slice(), acceleration.as_slice());
        let gain = c.new_force_gain();
        let drag = loss.share * loss.own.drag;
        if drag == 0.0 {
            body.multiply_mass(predicted, solution);
        } else {
            let blend = lossy.blend.as_mut_slice();
            for (((blend, &ahead), &v), &a) in blend.iter_mut().zip(predicted.as_slice()).zip(v).zip(a) {
                *blend = ahead + drag * (ahead - c.velocity(v, a, 0.0) / loss.rate);
            }
            body.multiply_mass(&lossy.blend, solution);
        }
        let retardation = gain * loss.own.retardation;
        if retardation == 0.0 && lossy.behind.is_none() {
            return;
        }
        let blend = lossy.blend.as_mut_slice();
        if retardation > 0.0 {
            for (((blend, &ahead), &v), &a) in blend.iter_mut().zip(predicted.as_slice()).zip(v).zip(a) {
                *blend = retardation * (loss.rate * ahead - c.velocity(v, a, 0.0));
            }
            let width = displacement.width();
            for &unknown in &*massless {
                let row = unknown as usize * width..(unknown as usize + 1) * width;
                for (place, blend) in row.clone().zip(&mut blend[row]) {
                    *blend = retardation * loss.massless_history(u[place], v[place], a[place]);
                }
            }
        } else {
            blend.fill(0.0);
        }
        if let Some(behind) = &lossy.behind {
            let [strength, kept, mean] = loss.relaxing;
            for ((blend, d), u) in blend.iter_mut().zip(behind.as_slice()).zip(u) {
                *blend -= gain * strength * (kept * d - mean * u);
            }
        }
        body.multiply_stiffness(&lossy.blend, &mut lossy.product);
        solution.as_mut_slice().iter_mut().zip(lossy.product.as_slice()).for_each(|(load, more)| *load += more);
    }

    /// K (u₀ + β v₀ + g d₀) + (b/m) M v₀, in the place of ũ.
    pub(super) fn resistance_losing(&mut self, body: &Body, loss: &StepLoss) {
        let Self { displacement, velocity, acceleration, predicted, massless, lossy, .. } = self;
        let Some(lossy) = lossy else { return };
        let beta = loss.own.retardation;
        let blend = lossy.blend.as_mut_slice();
        for ((blend, u), v) in blend.iter_mut().zip(displacement.as_slice()).zip(velocity.as_slice()) {
            *blend = u + beta * v;
        }
        if beta > 0.0 {
            let width = displacement.width();
            for &unknown in &*massless {
                let row = unknown as usize * width..(unknown as usize + 1) * width;
                for (blend, a) in blend[row.clone()].iter_mut().zip(&acceleration.as_slice()[row]) {
                    *blend += beta * loss.half_step() * a;
                }
            }
        }
        if let Some(behind) = &lossy.behind {
            blend.iter_mut().zip(behind.as_slice()).for_each(|(blend, d)| *blend += loss.relaxing[0] * d);
        }
        body.multiply_stiffness(&lossy.blend, predicted);
        if loss.own.drag > 0.0 {
            body.multiply_mass(velocity, &mut lossy.product);
            let all = predicted.as_mut_slice().iter_mut().zip(lossy.product.as_slice());
            all.for_each(|(sum, more)| *sum += loss.own.drag * more);
        }
    }

    /// Energy lost in drag and material from the displacements before (in `solution`) to those now, J.
    fn lose(&mut self, body: &Body, loss: &StepLoss) -> [f64; 2] {
        let Self { displacement, solution, lossy, .. } = self;
        let Some(Lossy { blend, product, behind, .. }) = lossy else { return [0.0; 2] };
        let (mut drag, mut material) = (0.0, 0.0);
        let moved = || displacement.as_slice().iter().zip(solution.as_slice()).map(|(new, old)| new - old);
        blend.as_mut_slice().iter_mut().zip(moved()).for_each(|(blend, moved)| *blend = moved);
        let step = 2.0 * loss.half_step();
        if loss.own.drag > 0.0 {
            body.multiply_mass(blend, product);
            drag = loss.own.drag / step * dot(blend, product);
        }
        if loss.own.retardation > 0.0 {
            body.multiply_stiffness(blend, product);
            material = loss.own.retardation / step * dot(blend, product);
        }
        if let Some(behind) = behind {
            let [strength, kept, mean] = loss.relaxing;
            // Δz, while d moves on; then (d₀ + d₁)ᵀ K Δz.
            for (blend, d) in blend.as_mut_slice().iter_mut().zip(behind.as_slice()) {
                *blend -= mean * *blend + (kept - 1.0) * d;
            }
            body.multiply_stiffness(blend, product);
            let values = behind.as_mut_slice().iter_mut().zip(product.as_slice()).zip(moved());
            let sum: f64 = values
                .map(|((d, product), moved)| {
                    let before = *d;
                    *d = mean * moved + kept * before;
                    (before + *d) * product
                })
                .sum();
            material += 0.5 * strength * sum;
        }
        [drag, material]
    }
}
