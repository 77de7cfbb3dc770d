use std::io::{self, Write};

use super::Response;
use granchain_signal::Series;

/// Write the response as CSV, one line an instant, LF, shortest floats that read back exactly:
/// `time_s,piston_displacement_m,bead1_velocity_m_per_s…beadN_velocity_m_per_s,pole_velocity_m_per_s,contact1_force_n…contact{N+1}_force_n`,
/// behind them `contact1_radius_m…contact{N+1}_radius_m` where the model gives the radii, and where the scene has a disc
/// `disc_velocity_m_per_s,pressure_pa,pressure_2_pa…`, a pressure for every field point; `sensor_force_n` last where it has a sensor bead.
pub fn write_csv(response: &Response, mut writer: impl Write) -> io::Result<()> {
    let columns = columns(response);
    let mut line = String::with_capacity(32 * (columns.len() + 1));
    line.push_str("time_s");
    for (name, _) in &columns {
        line.push(',');
        line.push_str(name);
    }
    line.push('\n');
    writer.write_all(line.as_bytes())?;
    let clock = &response.piston_displacement;
    for sample in 0..clock.len() {
        line.clear();
        push_number(&mut line, clock.time(sample));
        for (_, series) in &columns {
            line.push(',');
            push_number(&mut line, series.values[sample]);
        }
        line.push('\n');
        writer.write_all(line.as_bytes())?;
    }
    writer.flush()
}

/// Every column behind the time, by its name.
pub fn columns(response: &Response) -> Vec<(String, &Series)> {
    let numbered =
        |start: &'static str, end: &'static str| move |(index, series)| (format!("{start}{}{end}", index + 1), series);
    let one = |name: &str, series| std::iter::once((name.to_owned(), series));
    let velocities = response.bead_velocity.iter().enumerate().map(numbered("bead", "_velocity_m_per_s"));
    let forces = response.contact_force.iter().enumerate().map(numbered("contact", "_force_n"));
    let radii = response.contact_radius.iter().flatten().enumerate().map(numbered("contact", "_radius_m"));
    let of_disc = response.disc.iter().flat_map(|disc| {
        let pressures = disc.pressure.iter().enumerate().map(|(point, series)| match point {
            0 => ("pressure_pa".to_owned(), series),
            point => (format!("pressure_{}_pa", point + 1), series),
        });
        std::iter::once(("disc_velocity_m_per_s".to_owned(), &disc.velocity)).chain(pressures)
    });
    one("piston_displacement_m", &response.piston_displacement)
        .chain(velocities)
        .chain(one("pole_velocity_m_per_s", &response.pole_velocity))
        .chain(forces)
        .chain(radii)
        .chain(of_disc)
        .chain(response.sensor_force.iter().map(|series| ("sensor_force_n".to_owned(), series)))
        .collect()
}

/// Shortest decimal form that reads back to the same number.
fn push_number(line: &mut String, value: f64) {
    line.push_str(ryu::Buffer::new().format(value));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::EnergyBalance;
    use granchain_signal::Series;

    fn response() -> Response {
        let series = |values: [f64; 2]| Series::new(0.0, 1e-7, values.to_vec());
        Response {
            piston_displacement: series([0.0, 4.5e-8]),
            bead_displacement: vec![series([0.0, 0.0])],
            bead_velocity: vec![series([0.0, -0.1])],
            pole_velocity: series([0.0, -0.1]),
            observed: crate::response::ObservedPoint::Pole,
            contact_force: vec![series([0.0, 1.0 / 3.0]), series([0.0, 0.0])],
            contact_radius: None,
            sensor_force: None,
            disc: None,
            energy: EnergyBalance::default(),
            work: crate::response::SolverWork::default(),
        }
    }

    #[test]
    fn the_header_is_the_contract_and_the_lines_end_in_lf() {
        let mut bytes = Vec::new();
        write_csv(&response(), &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let mut lines = text.split('\n');
        assert_eq!(
            lines.next().unwrap(),
            "time_s,piston_displacement_m,bead1_velocity_m_per_s,pole_velocity_m_per_s,contact1_force_n,contact2_force_n"
        );
        assert_eq!(lines.next().unwrap(), "0.0,0.0,0.0,0.0,0.0,0.0");
        assert_eq!(lines.next().unwrap(), "1e-7,4.5e-8,-0.1,-0.1,0.3333333333333333,0.0");
        assert_eq!(lines.next().unwrap(), "");
        assert!(!text.contains('\r'));
    }

    #[test]
    fn radii_stand_behind_the_columns_that_every_model_has() {
        let plain = response();
        let series = |values: [f64; 2]| Series::new(0.0, 1e-7, values.to_vec());
        let radii = Response { contact_radius: Some(vec![series([0.0, 0.25]), series([0.0, 0.0])]), ..plain.clone() };
        let written = |response: &Response| {
            let mut bytes = Vec::new();
            write_csv(response, &mut bytes).unwrap();
            String::from_utf8(bytes).unwrap()
        };
        let ends = [",contact1_radius_m,contact2_radius_m", ",0.0,0.0", ",0.25,0.0"];
        for ((line, longer), end) in written(&plain).lines().zip(written(&radii).lines()).zip(ends) {
            assert_eq!(format!("{line}{end}"), longer);
        }
    }

    #[test]
    fn disc_and_pressures_stand_last_where_there_is_a_disc() {
        let series = |values: [f64; 2]| Series::new(0.0, 1e-7, values.to_vec());
        let pressure = vec![series([0.0, 14e3]), series([0.5, 0.0])];
        let disc = Some(crate::response::DiscResponse { velocity: series([0.0, 0.25]), pressure });
        let mut bytes = Vec::new();
        write_csv(&Response { disc, ..response() }, &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].ends_with(",contact2_force_n,disc_velocity_m_per_s,pressure_pa,pressure_2_pa"), "{text}");
        assert!(lines[1].ends_with(",0.0,0.0,0.5") && lines[2].ends_with(",0.25,14000.0,0.0"), "{text}");
    }

    #[test]
    fn every_number_reads_back_to_the_same_bits() {
        for value in [1.0 / 3.0, -0.0, 5e-324, 1.797_693_134_862_315_7e308, 6.6e-7, 123_456_789.123_456_78] {
            let mut line = String::new();
            push_number(&mut line, value);
            assert_eq!(line.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
    }
}
