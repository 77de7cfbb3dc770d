//! Bead guide in models of a fixed step: drag, and friction with the regularised law.
//!
//! ```text
//! m v̇ = −b v                          v(t) = v₀ e^(−b t/m)
//! m v̇ = −F_c tanh(v/v_s)              sinh(v/v_s) = sinh(v₀/v_s) e^(−F_c t/(m v_s))
//! ```
//!
//! Both are solved over a step as they stand here, F_c held: stable at any F_c h/(m v_s), and the energy lost is exactly that taken from the motion.
//! Friction under the load across the chain follows the forces of the contacts at the step's start, to first order in h.

use crate::{
    number::Number,
    scene::{DEFAULT_SLIP_VELOCITY, Holder, Scene},
};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hold<N> {
    beads: Vec<Bead<N>>,
    /// μ tan θ of the contacts, 1; 0 at piston and support. Empty without.
    wedge: Vec<N>,
    /// v_s, m/s.
    slip: N,
    rubs: bool,
    drags: bool,
    step: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Bead<N> {
    /// m, kg.
    mass: N,
    /// e^(−b h/(2m)), 1.
    half: N,
    /// F_c, N.
    friction: N,
}

/// Energy lost so far, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HoldLoss<N> {
    pub(crate) drag: N,
    pub(crate) friction: N,
}

impl<N: Number> HoldLoss<N> {
    pub(crate) fn none() -> Self {
        Self { drag: N::ZERO, friction: N::ZERO }
    }
}

impl<N: Number> Hold<N> {
    /// Of the bead guide of each run, whose beads are those of `scene` with the masses `masses` (kg), in steps of `step` (s).
    pub(crate) fn new(each: impl Fn(usize) -> Holder, scene: &Scene, masses: &[f64], step: f64) -> Self {
        let of = |value: &dyn Fn(Holder) -> f64| N::of(|place| value(each(place)));
        let any = |asks: &dyn Fn(&Holder) -> bool| (0..N::WIDTH).any(|place| asks(&each(place)));
        let bead = |mass: &f64| Bead {
            mass: N::all(*mass),
            half: of(&|holder| (-0.5 * step * holder.drag / mass).exp()),
            friction: of(&|holder| holder.friction_force),
        };
        let wedged = any(&|holder| holder.friction_coefficient > 0.0 && holder.clearance > 0.0);
        let wedge = |contact: usize| match contact.checked_sub(1).and_then(|bead| scene.chain.beads.get(bead..bead + 2))
        {
            Some([before, after]) => {
                of(&|holder| holder.friction_coefficient * holder.tangent(before.radius, after.radius))
            }
            _ => N::ZERO,
        };
        let contacts = if wedged { masses.len() + 1 } else { 0 };
        Self {
            beads: masses.iter().map(bead).collect(),
            wedge: (0..contacts).map(wedge).collect(),
            slip: of(&|holder| {
                if holder.slip_velocity > 0.0 { holder.slip_velocity } else { DEFAULT_SLIP_VELOCITY }
            }),
            rubs: any(&|holder| holder.has_friction()),
            drags: any(&|holder| holder.drag > 0.0),
            step,
        }
    }

    pub(crate) fn rubs(&self) -> bool {
        self.rubs
    }

    pub(crate) fn drags(&self) -> bool {
        self.drags
    }

    /// The factor e^(−b h/(2m)) that half a step of drag leaves of a bead's velocities.
    #[inline(always)]
    pub(crate) fn drag_half(&self, bead: usize) -> N {
        self.beads[bead].half
    }

    /// The velocity (m/s) that a step of friction leaves of a bead's, its contacts pressing with `forces` (N) before and after it.
    #[inline(always)]
    pub(crate) fn rubbed(&self, bead: usize, velocity: N, forces: [N; 2]) -> N {
        let own = &self.beads[bead];
        let mut friction = own.friction;
        if !self.wedge.is_empty() {
            // Dashpots may pull; what rubs is how hard the wall is pressed.
            friction =
                friction + self.wedge[bead] * forces[0].magnitude() + self.wedge[bead + 1] * forces[1].magnitude();
        }
        let spent = friction * self.step / (own.mass * self.slip);
        let speed = velocity.magnitude() / self.slip;
        let left = N::of(|place| slowed(speed.get(place), spent.get(place))) * self.slip;
        let left = (N::ZERO - left).or_where_not(N::ZERO.above(velocity), left);
        // To the bit as it was where nothing rubs.
        left.or_where_not(spent.above(N::ZERO), velocity)
    }

    /// Drag over half a step, friction over a step, drag over half a step; what each took is booked.
    #[inline(always)]
    pub(crate) fn slowed(&self, bead: usize, velocity: N, forces: [N; 2]) -> [N; 3] {
        let half = self.beads[bead].half;
        let dragged = velocity * half;
        let rubbed = if self.rubs { self.rubbed(bead, dragged, forces) } else { dragged };
        [dragged, rubbed, rubbed * half]
    }

    /// Book what [`Hold::slowed`] took from a bead that moved at `velocity` (m/s).
    #[inline(always)]
    pub(crate) fn add_loss(&self, bead: usize, velocity: N, [dragged, rubbed, left]: [N; 3], loss: &mut HoldLoss<N>) {
        let half_mass = self.beads[bead].mass * 0.5;
        let square = |v: N| v * v;
        let drag = square(velocity) - square(dragged) + (square(rubbed) - square(left));
        loss.drag = loss.drag + half_mass * drag;
        loss.friction = loss.friction + half_mass * (square(dragged) - square(rubbed));
    }
}

impl Hold<f64> {
    pub(crate) fn of(scene: &Scene, masses: &[f64], step: f64) -> Option<Self> {
        let holder = scene.holder.filter(Holder::acts)?;
        Some(Self::new(|_| holder, scene, masses, step))
    }
}

/// y ≥ 0 of sinh y = sinh x e^(−s), with x, s ≥ 0.
fn slowed(x: f64, s: f64) -> f64 {
    if s == 0.0 || x == 0.0 {
        return x;
    }
    // ln(2 sinh x) − s without overflow.
    let doubled = x + (-(-2.0 * x).exp_m1()).ln() - s;
    if doubled > 40.0 { doubled } else { (0.5 * doubled.exp()).asinh() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    fn hold(holder: Holder, step: f64) -> (Hold<f64>, f64) {
        let scene = scene::load("rigid", &["chain.beads=2".into()]).unwrap();
        let mass = scene.chain.beads[0].mass();
        (Hold::new(|_| holder, &scene, &[mass; 2], step), mass)
    }

    #[test]
    fn the_map_of_a_step_solves_its_equation() {
        for x0 in [1e-3, 0.5, 3.0, 60.0, 900.0] {
            for s in [1e-4, 0.3, 5.0, 50.0] {
                // dy/ds = −tanh y by a thousand steps of Runge–Kutta.
                let (mut y, n) = (x0, 20_000);
                let h = s / f64::from(n);
                for _ in 0..n {
                    let f = |y: f64| -f64::tanh(y);
                    let a = f(y);
                    let b = f(y + 0.5 * h * a);
                    let c = f(y + 0.5 * h * b);
                    let d = f(y + h * c);
                    y += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
                }
                let found = slowed(x0, s);
                assert!((found - y).abs() < 1e-10 * x0.max(1e-12 / 1e-10), "{x0} {s}: {found} {y}");
            }
        }
    }

    #[test]
    fn a_sliding_bead_stops_after_its_momentum_over_the_friction() {
        let (force, speed, step) = (0.02, 0.3, 5e-8);
        let (hold, mass) = hold(Holder { friction_force: force, slip_velocity: 1e-5, ..Holder::default() }, step);
        let (mut v, mut x, mut stopped, mut loss) = (speed, 0.0, None, HoldLoss::none());
        for taken in 1..=4000 {
            let steps = hold.slowed(0, v, [0.0; 2]);
            hold.add_loss(0, v, steps, &mut loss);
            x += 0.5 * step * (v + steps[2]);
            v = steps[2];
            if stopped.is_none() && v < 1e-5 {
                stopped = Some(f64::from(taken) * step);
            }
        }
        let time = mass * speed / force;
        // To a step, and to the time that v_s smears: (v_s/F) m ln 2.
        assert!((stopped.unwrap() - time).abs() < step + 2.0 * mass * 1e-5 / force, "{stopped:?} {time}");
        let distance = mass * speed * speed / (2.0 * force);
        // v_s/v of it, and the trapezoid's corner.
        assert!((x / distance - 1.0).abs() < 1e-4, "{x} {distance}");
        assert!((loss.friction / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-9 && loss.drag == 0.0);
    }

    #[test]
    fn friction_opposes_either_direction_and_grows_with_the_load_across() {
        let holder = Holder { friction_coefficient: 0.3, clearance: 1e-4, slip_velocity: 1e-3, ..Holder::default() };
        let (hold, mass) = hold(holder, 5e-8);
        let tangent = 0.1 / f64::sqrt(1.0 - 0.01);
        for (forces, load) in [([0.0, 4.0], 4.0), ([4.0, 0.0], 0.0), ([0.0, -1.0], 1.0)] {
            let [_, rubbed, _] = hold.slowed(0, 0.5, forces);
            let expected = 0.5 - 0.3 * tangent * load * 5e-8 / mass;
            assert!((rubbed - expected).abs() < 1e-15, "{forces:?} {rubbed} {expected}");
            assert_eq!(hold.slowed(0, -0.5, forces)[1], -rubbed);
        }
        // A bead between two: both neighbours press it against the wall. The contact with the support does not.
        assert_eq!(hold.slowed(1, 0.5, [4.0, 9.0])[1], hold.slowed(0, 0.5, [9.0, 4.0])[1]);
    }
}
