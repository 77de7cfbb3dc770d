//! The disc's back as tables for a field solver such as k-Wave.
//!
//! `velocity.npy` holds v(r_i, t_n) as an array of shape (radii, instants), m/s, positive into the water; `velocity.csv` the same with one line an
//! instant; `grid.json` what a solver needs to place them: in k-Wave's axisymmetric code the rows are `source.ux` (the axial velocity) on the
//! nodes at the radii of the plane z = 0. Behind a soft baffle the source is the pressure there instead, `pressure.npy` and `pressure.csv`, Pa: `source.p`
//! with `source.p_mode` = `'dirichlet'`, and 0 on the rest of the plane.

use std::fmt::Write as _;

use serde::Serialize;

use super::page::Files;
use granchain_model::{response::write_npy, water::Water};

/// Courant number c dt/dx of the tables: k-Wave's own default.
pub(crate) const COURANT: f64 = 0.3;
/// Nodes a disc's radius: 15 a wavelength of 1 MHz in water for a disc of 2 mm.
pub(crate) const NODES: usize = 10;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceQuantity {
    /// Velocity of the back, m/s, behind a rigid baffle.
    Velocity,
    /// Pressure on it, Pa, behind a soft one.
    Pressure,
}

impl FaceQuantity {
    /// Name of the files, and of the columns with their unit.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Velocity => ("velocity", "velocity_m_per_s"),
            Self::Pressure => ("pressure", "pressure_pa"),
        }
    }

    fn description(self) -> &'static str {
        match self {
            Self::Velocity => {
                "velocity of the disc's back, positive into the water, rows by radius, columns by instant"
            }
            Self::Pressure => {
                "pressure on the disc's back, rows by radius, columns by instant; 0 on the plane beside it (source of Dirichlet's kind)"
            }
        }
    }
}

/// `grid.json`: keys carry their units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InterfaceGrid {
    #[serde(skip)]
    pub held: FaceQuantity,
    pub quantity: &'static str,
    pub program: String,
    /// Spacing of the radii, m.
    pub dx_m: f64,
    /// Interval of the instants, s.
    pub dt_s: f64,
    /// Number of radii, from 0 to the rim.
    pub points: usize,
    /// Number of instants, from 0.
    pub instants: usize,
    /// c dt/dx with the water's own c, 1.
    pub courant: f64,
    /// Radius of the disc, m.
    pub disc_radius_m: f64,
    pub sound_speed_m_per_s: f64,
    pub density_kg_per_m3: f64,
    /// Highest frequency that the spacing resolves with three points a wavelength, Hz.
    pub highest_frequency_hz: f64,
    /// The plane around the disc.
    pub baffle: &'static str,
}

impl InterfaceGrid {
    /// The grid of a disc of that radius (m) over `duration` (s).
    #[must_use]
    pub fn new(
        (program, held): (String, FaceQuantity),
        disc: f64,
        water: &Water,
        baffle: &'static str,
        duration: f64,
    ) -> Self {
        let dx_m = disc / NODES as f64;
        let dt_s = COURANT * dx_m / water.sound_speed;
        Self {
            held,
            quantity: held.description(),
            program,
            dx_m,
            dt_s,
            points: NODES + 1,
            instants: (duration / dt_s + 1e-9) as usize + 1,
            courant: water.sound_speed * dt_s / dx_m,
            disc_radius_m: disc,
            sound_speed_m_per_s: water.sound_speed,
            density_kg_per_m3: water.density,
            highest_frequency_hz: water.sound_speed / (3.0 * dx_m),
            baffle,
        }
    }

    #[must_use]
    pub fn radii(&self) -> Vec<f64> {
        (0..self.points).map(|point| point as f64 * self.dx_m).collect()
    }

    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        (0..self.instants).map(|instant| instant as f64 * self.dt_s).collect()
    }

    /// The three files, in a folder `interface`, of one list over the instants a radius.
    pub fn files(&self, rows: &[Vec<f64>]) -> std::io::Result<Files> {
        let (radii, times) = (self.radii(), self.times());
        let (name, column) = self.held.names();
        let mut array = Vec::new();
        write_npy(rows, &mut array)?;
        let mut table = String::from("time_s");
        for radius in &radii {
            // Writing to a string cannot fail.
            let _ = write!(table, ",{column}_at_r_{:.4}_mm", 1e3 * radius);
        }
        table.push('\n');
        for (instant, time) in times.iter().enumerate() {
            let _ = write!(table, "{time:e}");
            for row in rows {
                let _ = write!(table, ",{:e}", row[instant]);
            }
            table.push('\n');
        }
        let mut hints = serde_json::to_vec_pretty(self)?;
        hints.push(b'\n');
        Ok(vec![
            (format!("interface/{name}.npy").into(), array),
            (format!("interface/{name}.csv").into(), table.into_bytes()),
            ("interface/grid.json".into(), hints),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::water::{field::FaceMotion, rayleigh::radiation::Radiator};
    use granchain_signal::Series;

    #[test]
    fn the_tables_hold_the_face_s_velocity_on_a_grid_that_a_solver_can_step() {
        let water = Water { density: 1000.0, sound_speed: 1500.0 };
        let value = |i: usize| (i as f64 * 0.02).sin();
        let motion = FaceMotion::new(vec![Series::new(0.0, 25e-9, (0..2000).map(value).collect())]);
        let shape = |r: f64| 1.0 - (r / 1e-3).powi(2);
        let radiator = Radiator { radius: 1e-3, shapes: vec![&shape] };
        let grid = InterfaceGrid::new(("granchain".into(), FaceQuantity::Velocity), 1e-3, &water, "rigid", 40e-6);
        assert!((grid.courant - 0.3).abs() < 1e-12 && (grid.dx_m - 1e-4).abs() < 1e-18);
        assert_eq!((grid.points, grid.instants), (11, 2001));
        let files = grid.files(&motion.face(&radiator, &grid.radii(), &grid.times())).unwrap();
        let named = |name: &str| &files.iter().find(|(path, _)| path.ends_with(name)).unwrap().1;

        let array = named("velocity.npy");
        assert!(String::from_utf8_lossy(&array[..128]).contains("'shape': (11, 2001)"));
        let array: Vec<f64> = array[128..].as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect();
        for (point, instant) in [(0, 0), (0, 700), (4, 1234), (10, 1999)] {
            let time = instant as f64 * 20e-9;
            let exact = shape(point as f64 * 1e-4) * (0.02 * time / 25e-9).sin();
            let found = array[point * 2001 + instant];
            assert!((found - exact).abs() < 1e-9, "{point} {instant}: {found} {exact}");
        }
        let table = String::from_utf8(named("velocity.csv").clone()).unwrap();
        let line: Vec<f64> = table.lines().nth(1235).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!((line.len(), line[5]), (12, array[4 * 2001 + 1234]));
        assert!((line[0] / 24.68e-6 - 1.0).abs() < 1e-12);
        let hints: serde_json::Value = serde_json::from_slice(named("grid.json")).unwrap();
        assert_eq!(hints["points"], 11);
        assert!((hints["dt_s"].as_f64().unwrap() - 20e-9).abs() < 1e-20);
    }
}
