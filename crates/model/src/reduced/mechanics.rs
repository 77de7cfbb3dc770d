//! Everything linear of one run: bodies with the modes its step can follow, contacts condensed on what is left.

use std::ops::Range;

use super::{
    contact::{BLOCK, Condensed, bounds, dot},
    losses::{Law, StepLaw},
    rank::Crossing,
    reduction::{Face, Member, Reduction, Watch},
};
use crate::{fea::FeaError, number::Number, scene::Scene};

/// Largest ω h of a mode that is kept, rad.
pub(crate) const LARGEST_PHASE: f64 = 2.0;

#[derive(Debug)]
pub(super) struct Mechanics {
    /// ω² of the modes kept, by kind.
    pub(super) squares: Vec<Vec<f64>>,
    /// Surfaces of the bodies, as [`Reduction::faces`].
    pub(super) surfaces: Vec<Surface>,
    pub(super) watched: Vec<Vec<Watch>>,
    pub(super) condensed: Vec<Condensed>,
    /// Which of them every contact is.
    pub(super) of_contact: Vec<usize>,
    /// How each kind of body loses, none where it is elastic; the contacts are condensed on w R of those that do.
    pub(super) laws: Vec<Option<StepLaw>>,
    /// R of the faces of those, and between front and back of the members of those kinds: row by row, rows by front and columns by back, and
    /// the other way round.
    pub(super) whole: Vec<Option<Vec<f64>>>,
    pub(super) across: Vec<[Option<Vec<f64>>; 2]>,
}

/// Normal displacements of the points of a face by the rigid motion and the modes kept.
#[derive(Debug)]
pub(super) struct Surface {
    points: usize,
    /// Rigid motion, then mode by mode.
    columns: Vec<f64>,
    rows: Vec<f64>,
    /// Least and largest value of every column in every block.
    bounds: Vec<Vec<[f64; 2]>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Flexibility {
    /// In steps of this length, s: without that of the modes that it can follow in time.
    Residual(f64),
    Static,
}

impl Surface {
    fn new(face: &Face, modes: usize) -> Self {
        let points = face.axial.len();
        let mut columns = face.axial.clone();
        columns.extend_from_slice(&face.shapes[..modes * points]);
        let rows = (0..points).flat_map(|i| (0..modes).map(move |k| face.shapes[k * points + i])).collect();
        let block = |first: usize| {
            let end = (first + BLOCK).min(points);
            columns.chunks_exact(points).map(|column| bounds(&column[first..end])).collect()
        };
        let bounds = (0..points).step_by(BLOCK).map(block).collect();
        Self { points, columns, rows, bounds }
    }

    /// Take the displacements of rigid motion (m) and modes from the gaps of these points.
    #[inline(always)]
    pub(super) fn close<N: Number>(&self, rigid: N, modal: &[N], points: Range<usize>, gaps: &mut [N]) {
        let columns = self.columns.chunks_exact(self.points).map(|column| &column[points.clone()]);
        N::subtract_all(gaps, std::iter::once(rigid).chain(modal.iter().copied()).zip(columns));
    }

    /// Lower bounds of how much that adds to the gaps of every block, m, added to `least`.
    #[inline(always)]
    pub(super) fn least<N: Number>(&self, rigid: N, modal: &[N], least: &mut [N]) {
        for (least, bounds) in least.iter_mut().zip(&self.bounds) {
            for (amount, [low, high]) in std::iter::once(&rigid).chain(modal).zip(bounds) {
                *least = *least - (*amount * *low).larger(*amount * *high);
            }
        }
    }

    /// Add the forces on the points (N, pressing inwards) to those on the modes.
    #[inline(always)]
    pub(super) fn press<N: Number>(&self, forces: &[N], [first, end]: [usize; 2], modal: &mut [N]) {
        let modes = modal.len();
        if modes == 0 {
            return;
        }
        let rows = self.rows.chunks_exact(modes).take(end).skip(first);
        N::subtract_all(modal, forces[first..end].iter().copied().zip(rows));
    }
}

impl Mechanics {
    /// Of a scene with these bodies.
    ///
    /// `further`: what the last contact gives way besides, row by row (m/N); empty for nothing.
    pub(super) fn new(
        reduction: &Reduction,
        scene: &Scene,
        flexibility: Flexibility,
        further: &[f64],
    ) -> Result<Self, FeaError> {
        let support = reduction.support.map(|member| reduction.members[member].kind);
        let factor = scene.support.ring().map_or(1.0, |(_, factor, _)| factor);
        // A stiffer support: the same shapes, all ω² and 1/S in proportion.
        let factor = |kind: usize| if support == Some(kind) { factor } else { 1.0 };
        let laws: Vec<Option<StepLaw>> = match flexibility {
            Flexibility::Residual(step) => {
                let stepped = |law: Option<Law>| law.map(|law| StepLaw::new(law, step));
                Law::of(reduction, &scene.loss).into_iter().map(stepped).collect()
            }
            Flexibility::Static => vec![None; reduction.kinds.len()],
        };
        let squares: Vec<Vec<f64>> = (reduction.kinds.iter().enumerate())
            .map(|(kind, body)| {
                let all = body.squares.iter().map(|square| square * factor(kind));
                match flexibility {
                    Flexibility::Residual(step) => {
                        // Relaxing material is stiffer to what is fast.
                        let fast = laws[kind].as_ref().map_or(1.0, StepLaw::fast);
                        all.take_while(|square| (fast * square).sqrt() <= LARGEST_PHASE / step).collect()
                    }
                    Flexibility::Static => Vec::new(),
                }
            })
            .collect();
        let surfaces = reduction.faces.iter().map(|face| Surface::new(face, squares[face.kind].len())).collect();
        let mut compliances: Vec<Vec<f64>> = (reduction.faces.iter())
            .map(|face| residual(&face.compliance, factor(face.kind), face, face, &squares[face.kind]))
            .collect();
        let weight = |kind: usize| laws[kind].as_ref().map(|law| law.weight);
        let whole = (reduction.faces.iter().zip(&mut compliances))
            .map(|(face, own)| {
                let weight = weight(face.kind)?;
                let whole = own.clone();
                own.iter_mut().for_each(|value| *value *= weight);
                Some(whole)
            })
            .collect();
        let mut across = vec![[None, None]; reduction.members.len()];
        let crossings: Vec<Crossing> = (reduction.members.iter().zip(&mut across))
            .map(|(member, across)| {
                let (front, squares) = (&reduction.faces[member.front], &squares[member.kind]);
                member.back.map_or_else(Crossing::default, |back| {
                    let mut matrix = residual(&member.crossing, 1.0, &reduction.faces[back], front, squares);
                    if let Some(weight) = weight(member.kind) {
                        *across = [Some(transposed(&matrix, front.axial.len())), Some(matrix.clone())];
                        matrix.iter_mut().for_each(|value| *value *= weight);
                    }
                    Crossing::of(matrix, front.axial.len())
                })
            })
            .collect();
        let watched = reduction
            .members
            .iter()
            .map(|member| member.watched.iter().map(|watch| reduction.watch(member, watch, &squares)).collect())
            .collect();
        let spring = scene.support.spring().map_or(0.0, f64::recip);
        let last = reduction.contacts.len() - 1;
        let (mut condensed, mut of_contact, mut known) = (Vec::new(), Vec::new(), Vec::new());
        for (contact, &geometry) in reduction.contacts.iter().enumerate() {
            let [before, after] = [contact, contact + 1].map(|slot| reduction.member(slot));
            let key = (geometry, before, after);
            if let Some(found) = known.iter().position(|other| *other == key) {
                of_contact.push(found);
                continue;
            }
            let n = reduction.geometries[geometry].gaps.len();
            // The flat on a spring gives way by F/K wherever it is pressed.
            let mut matrix = vec![if contact == last { spring } else { 0.0 }; n * n];
            let faces = [
                before.and_then(|member| reduction.members[member].back),
                after.map(|member| reduction.members[member].front),
            ];
            if contact == last {
                matrix.iter_mut().zip(further).for_each(|(sum, value)| *sum += value);
            }
            for face in faces.into_iter().flatten() {
                matrix.iter_mut().zip(&compliances[face]).for_each(|(sum, value)| *sum += value);
            }
            let [before, after] = [before, after].map(|member| member.map(|member| &crossings[member]));
            let ordering = reduction.geometries[geometry].ordering();
            let own = Condensed::new(matrix, n, ordering, before, after)
                .map_err(|_| FeaError::Compliance { contact: contact + 1 })?;
            known.push(key);
            of_contact.push(condensed.len());
            condensed.push(own);
        }
        Ok(Self { squares, surfaces, watched, condensed, of_contact, laws, whole, across })
    }
}

impl Reduction {
    /// Member in a slot (piston 0, beads 1…N, support N + 1); none where it is rigid.
    pub(super) fn member(&self, slot: usize) -> Option<usize> {
        match slot.checked_sub(1) {
            None => None,
            Some(bead) if bead < self.beads.len() => Some(self.beads[bead]),
            Some(_) => self.support,
        }
    }

    /// A watched place with the static answer of what is left of the modes.
    fn watch(&self, member: &Member, watch: &Watch, squares: &[Vec<f64>]) -> Watch {
        let squares = &squares[member.kind];
        let shapes = watch.shapes[..squares.len()].to_vec();
        let left = |answer: &[f64], face: &Face| {
            let mut answer = answer.to_vec();
            let modes = shapes.iter().zip(squares).zip(face.shapes.chunks_exact(answer.len().max(1)));
            for ((here, square), shape) in modes {
                answer.iter_mut().zip(shape).for_each(|(value, there)| *value -= here * there / square);
            }
            answer
        };
        let front = left(&watch.front, &self.faces[member.front]);
        let back = member.back.map_or_else(Vec::new, |back| left(&watch.back, &self.faces[back]));
        Watch { shapes, front, back }
    }
}

/// S/factor − Σ φ φᵀ/ω², row by row.
fn residual(compliance: &[f64], factor: f64, to: &Face, from: &Face, squares: &[f64]) -> Vec<f64> {
    let (rows, columns) = (to.axial.len(), from.axial.len());
    let mut matrix: Vec<f64> = compliance.iter().map(|value| value / factor).collect();
    let shapes = to.shapes.chunks_exact(rows).zip(from.shapes.chunks_exact(columns));
    for (square, (there, here)) in squares.iter().zip(shapes) {
        for (row, a) in matrix.chunks_exact_mut(columns).zip(there) {
            row.iter_mut().zip(here).for_each(|(value, b)| *value -= a * b / square);
        }
    }
    matrix
}

fn transposed(matrix: &[f64], columns: usize) -> Vec<f64> {
    (0..columns).flat_map(|column| matrix.iter().skip(column).step_by(columns).copied()).collect()
}

impl Watch {
    /// Displacement (m) of the place in a body that moved by `rigid` (m) and `modal` under the forces of its front and back (N).
    pub(super) fn displacement<N: Number>(&self, rigid: N, modal: &[N], front: &[N], back: &[N]) -> N {
        let bent = dot(front, &self.front) + dot(back, &self.back);
        rigid + dot(modal, &self.shapes) - bent
    }
}
