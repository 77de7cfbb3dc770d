//! The pressure field at instants, at frequencies and far away, against closed forms, brute force and the elements.

use std::f64::consts::{PI, TAU};

use faer::c64;
use granchain::{
    model::{
        analytical::BaffledPiston,
        water::{
            OnWater, Water,
            disc::{Disc, DiscMesh, DiscShape, Rim},
            elements::{Baffle, DiscOnWater, DiscOnWaterSettings, WaterMesh},
            field::{FaceMotion, FieldGrid, amplitude_map, beam_pattern, far_field},
            rayleigh::{field::FieldPoint, instant::InstantRule, motion::WetDisc, radiation::Radiator},
            source::FieldSource,
        },
    },
    scene::{self, Material},
    signal::Series,
};

const A: f64 = 1e-3;
const PISTON: BaffledPiston = BaffledPiston { radius: A, density: 1000.0, sound_speed: 1500.0 };

/// A burst around 0.5 MHz that is smooth and over within 8 µs.
fn burst(t: f64) -> f64 {
    if (0.0..8e-6).contains(&t) { (PI * t / 8e-6).sin().powi(4) * (TAU * 0.5e6 * t).sin() } else { 0.0 }
}

/// Its derivative by central differences of the closed form.
fn burst_rate(t: f64) -> f64 {
    let h = 1e-10;
    (burst(t + h) - burst(t - h)) / (2.0 * h)
}

fn motion(step: f64) -> FaceMotion {
    FaceMotion::new(vec![Series::new(0.0, step, (0..800).map(|i| burst(i as f64 * step)).collect())])
}

#[test]
fn pressure_on_the_axis_is_the_piston_s_closed_form() {
    let (radiator, water) = (Radiator::piston(A), Water::fresh());
    let times: Vec<f64> = (0..60).map(|i| 0.2e-6 * f64::from(i)).collect();
    for distance in [0.0, 0.2e-3, 1e-3, 4e-3] {
        let found = motion(25e-9).pressure(&radiator, &water, FieldPoint::on_axis(distance), &times).unwrap();
        for (&time, found) in times.iter().zip(found) {
            let exact = PISTON.axial_pressure(distance, time, burst);
            // ρc is 1.5e6; the spline through 80 samples a period.
            assert!((found - exact).abs() < 2.0, "{distance} {time:e}: {found} {exact}");
        }
    }
}

/// ρ/(2π) ∫ v̇(t − R/c)/R dS by midpoints over the disc.
fn brute_force(point: FieldPoint, time: f64) -> f64 {
    let (rings, spokes) = (1000, 720);
    let mut sum = 0.0;
    for i in 0..rings {
        let radius = A * (f64::from(i) + 0.5) / f64::from(rings);
        for j in 0..spokes {
            let angle = PI * (f64::from(j) + 0.5) / f64::from(spokes);
            let x = point.radius - radius * angle.cos();
            let distance = x.hypot(radius * angle.sin()).hypot(point.distance);
            sum += radius / distance * burst_rate(time - distance / 1500.0);
        }
    }
    1000.0 / TAU * sum * (A / f64::from(rings)) * (TAU / f64::from(spokes))
}

#[test]
fn pressure_off_the_axis_is_the_integral_over_the_disc() {
    let (radiator, water) = (Radiator::piston(A), Water::fresh());
    for (radius, distance) in [(0.4e-3, 0.5e-3), (1.0e-3, 0.8e-3), (1.7e-3, 0.3e-3), (2.5e-3, 2.0e-3)] {
        let point = FieldPoint { radius, distance };
        let times = [2.1e-6, 3.7e-6, 5.2e-6];
        let found = motion(25e-9).pressure(&radiator, &water, point, &times).unwrap();
        for (&time, found) in times.iter().zip(found) {
            let exact = brute_force(point, time);
            // Midpoints of a micrometre and a quarter of a degree.
            assert!((found - exact).abs() < 5.0, "{radius} {distance} {time:e}: {found} {exact}");
        }
    }
}

#[test]
fn twice_the_points_of_the_quadrature_change_nothing() {
    let (radiator, water) = (Radiator::piston(A), Water::fresh());
    // 24 points and one for each of the 53 steps in which sound crosses the disc; the other has 154.
    let (rule, doubled) = (InstantRule::new(A, &water, 25e-9), InstantRule::new(A, &water, 10.2e-9));
    let rate = |t: f64, out: &mut [f64]| out[0] = burst_rate(t);
    let times = [2.1e-6, 3.7e-6, 5.2e-6];
    let mut worst: f64 = 0.0;
    for radius in [0.0, 0.1e-3, 0.9e-3, 0.999e-3, 1.4e-3] {
        for distance in [0.0, 0.01e-3, 1e-3] {
            let point = FieldPoint { radius, distance };
            let once = radiator.pressure_at(&water, point, &times, &rule, &rate).unwrap();
            let twice = radiator.pressure_at(&water, point, &times, &doubled, &rate).unwrap();
            once.iter().zip(twice).for_each(|(a, b)| worst = worst.max((a - b).abs()));
        }
    }
    // Of ρc·1 m/s = 1.5 MPa.
    assert!(worst < 1.0, "{worst}");
}

#[test]
fn a_piston_s_amplitude_on_the_axis_is_its_closed_form() {
    let grid = FieldGrid { radius: vec![0.0], distance: (0..40).map(|i| 0.1e-3 * f64::from(i)).collect() };
    let omega = TAU * 0.95e6;
    let found = amplitude_map(&Radiator::piston(A), &Water::fresh(), &grid, &[c64::new(0.01, 0.0)], omega).unwrap();
    for (&z, found) in grid.distance.iter().zip(found) {
        let exact = 2.0 * 1.5e6 * 0.01 * (0.5 * omega / 1500.0 * (z.hypot(A) - z)).sin().abs();
        assert!((found.norm() - exact).abs() < 1e-6 * 1.5e4, "{z}: {found} {exact}");
    }
}

#[test]
fn a_piston_s_beam_is_two_bessel_over_x_far_away() {
    let (radiator, water) = (Radiator::piston(A), Water::fresh());
    let omega = TAU * 1.5e6;
    let angles: Vec<f64> = (0..=90).map(|degree| f64::from(degree).to_radians()).collect();
    let one = [c64::new(1.0, 0.0)];
    let limit = far_field(&radiator, &water, &angles, &one, omega);
    // ka²/2 = 3.1 mm: at a metre the wave front is flat over the disc to 0.3 %, the levels closer than that.
    let distant = beam_pattern(&radiator, &water, (1.0, &angles), &one, omega).unwrap();
    for (i, &angle) in angles.iter().enumerate() {
        let exact = PISTON.directivity(angle, omega);
        let far = (limit[i] / limit[0]).re;
        assert!((far - exact).abs() < 1e-10, "{i}°: {far} {exact}");
        let near = distant[i].norm() / distant[0].norm();
        assert!((near - exact.abs()).abs() < 1e-3, "{i}°: {near} {exact}");
    }
    // ρ/(2π) πa² ω.
    let strength = 1000.0 * omega * A * A / 2.0;
    assert!((limit[0].norm() / strength - 1.0).abs() < 1e-12 && (distant[0].norm() / strength - 1.0).abs() < 1e-5);
    let half = half_angle(&angles, &limit);
    let exact = (2.215_0 / (omega * A / 1500.0)).asin();
    assert!((half - exact).abs() < 0.05f64.to_radians(), "{half} {exact}");
}

/// Angle (rad) at which a beam pattern has fallen to half its value on the axis (−6 dB), interpolated between the angles given.
fn half_angle(angles: &[f64], pattern: &[c64]) -> f64 {
    let size: Vec<f64> = pattern.iter().map(|value| value.norm()).collect();
    let past = size.iter().position(|&value| value < 0.5 * size[0]).unwrap();
    let share = (size[past - 1] - 0.5 * size[0]) / (size[past - 1] - size[past]);
    angles[past - 1] + share * (angles[past] - angles[past - 1])
}

/// Pressure (Pa) on the axis at the distance z (m) from that of a face within a soft baffle, straight between the radii (m), Rayleigh's second
/// integral by the midpoint rule: (1/2π) ∫ P (z/R) (1/R + ik) e^{−ikR}/R dS.
fn soft_on_axis((radii, pressure): (&[f64], &[c64]), distance: f64, angular_frequency: f64) -> c64 {
    let wave_number = angular_frequency / Water::fresh().sound_speed;
    let pieces = radii.windows(2).zip(pressure.windows(2));
    let midpoints = pieces.flat_map(|(ends, values)| {
        (0..64).map(move |part| {
            let (x, length) = ((f64::from(part) + 0.5) / 64.0, ends[1] - ends[0]);
            let radius = ends[0] + x * length;
            let range = distance.hypot(radius);
            let spread = c64::new(1.0 / range, wave_number) * c64::from_polar(1.0, -wave_number * range);
            let here = values[0] * (1.0 - x) + values[1] * x;
            here * spread * (length / 64.0 * radius * distance / (range * range))
        })
    });
    midpoints.sum()
}

fn disc(rim: Rim) -> Disc {
    let shape = DiscShape { radius: A, thickness: 0.25e-3, material: Material::vitreous_carbon(), rim };
    Disc::new(&shape, &DiscMesh::default()).unwrap()
}

/// A smooth push of 1 N and 4 µs.
fn push(step: f64, end: f64) -> Vec<f64> {
    let force = |t: f64| if t < 4e-6 { (PI * t / 4e-6).sin().powi(2) } else { 0.0 };
    (0..=(end / step).round() as usize).map(|i| force(i as f64 * step)).collect()
}

#[test]
fn the_map_of_a_pushed_disc_is_the_same_by_integral_and_by_elements() {
    let (step, end, patch) = (25e-9, 5e-6, 60e-6);
    let disc = disc(Rim::Clamped);
    let modes = disc.basis(4, patch).unwrap();
    let radiator = Radiator::of_modes(A, &modes.back);
    let water = Water::fresh();
    let settings = DiscOnWaterSettings {
        water,
        baffle: Baffle::Rigid,
        mesh: WaterMesh::default(),
        points: Vec::new(),
        patch,
        step,
    };
    let mut meshed = DiscOnWater::new(disc, &settings).unwrap();
    let forces = push(step, end);
    for &force in &forces[1..] {
        meshed.predict();
        meshed.push(force);
    }
    let motion = FaceMotion::under(WetDisc::new(A, &modes, &water, &[], step).unwrap(), &forces);
    let (mut square, mut difference) = (0.0, 0.0);
    for (node, by_elements) in meshed.mesh().nodes.iter().zip(meshed.nodal_pressure()).step_by(7) {
        let point = FieldPoint { radius: node[0], distance: node[1] };
        let by_integral = motion.pressure(&radiator, &water, point, &[end]).unwrap()[0];
        square += by_integral * by_integral;
        difference += (by_integral - by_elements).powi(2);
    }
    let error = (difference / square).sqrt();
    // The mesh of 0.05 mm and its absorbing boundary.
    assert!(error < 0.01, "{error}");
    assert!(error > 0.0 && square > 0.0);
}

#[test]
fn a_map_is_the_pressure_at_its_points_and_the_face_moves_with_it() {
    let (step, patch, water) = (25e-9, 60e-6, Water::fresh());
    let modes = disc(Rim::Supported).basis(4, patch).unwrap();
    let radiator = Radiator::of_modes(A, &modes.back);
    let point = FieldPoint { radius: 0.6e-3, distance: 0.4e-3 };
    let mut wet_disc = WetDisc::new(A, &modes, &water, &[point], step).unwrap();
    let motion = FaceMotion::under(wet_disc.clone(), &push(step, 8e-6));
    let grid = FieldGrid { radius: vec![0.0, point.radius], distance: vec![0.1e-3, point.distance] };
    let times = [3e-6, 6e-6];
    let maps = motion.map(&radiator, &water, &grid, &times).unwrap();
    for (instant, force) in push(step, 8e-6).into_iter().enumerate().skip(1) {
        wet_disc.predict();
        wet_disc.push(force);
        let time = instant as f64 * step;
        for (map, at) in maps.iter().zip(times) {
            if (time - at).abs() < 0.1 * step {
                // Straight velocities on the clock there, smooth ones here.
                let largest = map.iter().fold(0.0, |largest: f64, p| largest.max(p.abs()));
                assert!((map[3] - wet_disc.pressure(0)).abs() < 2e-3 * largest, "{} {}", map[3], wet_disc.pressure(0));
            }
        }
    }
    let middle: f64 = modes.back.iter().zip(motion.velocity()).map(|(shape, v)| shape.at(0.0) * v.values[160]).sum();
    assert!((motion.face(&radiator, &[0.0], &[160.0 * step])[0][0] / middle - 1.0).abs() < 1e-9);
    assert_eq!(motion.face(&radiator, &[1.1e-3], &[4e-6])[0][0], 0.0);
    // What is exported: from the shapes themselves, halfway out and beyond the rim.
    let (radius, instants) = (0.5e-3, [120_usize, 160]);
    let rows = motion.face(&radiator, &[radius, 1.1e-3], &instants.map(|instant| instant as f64 * step));
    for (found, instant) in rows[0].iter().zip(instants) {
        let moved: f64 =
            modes.back.iter().zip(motion.velocity()).map(|(shape, v)| shape.at(radius) * v.values[instant]).sum();
        assert!((found / moved - 1.0).abs() < 1e-9 && (moved / middle - 1.0).abs() > 0.05, "{found} {moved}");
    }
    assert_eq!(rows[1], [0.0; 2]);
}

fn water_scene(overrides: &[&str]) -> scene::Scene {
    scene::load("water", &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>()).unwrap()
}

#[test]
fn a_scene_s_field_is_the_same_by_integral_and_by_elements() {
    let integral = FieldSource::new(&water_scene(&["disc.rim=supported"])).unwrap();
    let meshed = FieldSource::new(&water_scene(&["disc.rim=supported", "water.method=elements"])).unwrap();
    let step = integral.step();
    // Counted from a static force, under which nothing sounds.
    let force = Series::new(0.0, step, push(step, 6e-6).iter().map(|force| force + 3.0).collect());
    let grid = FieldGrid::even(1.5e-3, 1.5e-3, 0.25e-3);
    let times = [2.5e-6, 5e-6];
    let (a, b) = (integral.maps(&force, &grid, &times).unwrap(), meshed.maps(&force, &grid, &times).unwrap());
    for (a, b) in a.iter().zip(&b) {
        let square: f64 = b.iter().map(|p| p * p).sum();
        let difference: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        // The mesh, and straight lines between its nodes.
        assert!((difference / square).sqrt() < 0.015 && square > 0.0, "{}", (difference / square).sqrt());
    }
    let reach = |source: &FieldSource| *source.grid().radius.last().unwrap();
    assert!((reach(&integral) - 2.5e-3).abs() < 1e-15 && reach(&meshed) < 2.5e-3 / 2f64.sqrt());
}

/// Weights of the spectrum ∫ p e^{−iωt} dt.
fn transform(omega: f64, step: f64, samples: usize) -> Vec<c64> {
    (0..samples).map(|n| c64::from_polar(step, -omega * step * n as f64)).collect()
}

#[test]
fn at_a_frequency_elements_have_the_integral_s_map() {
    let integral = FieldSource::new(&water_scene(&[])).unwrap();
    let meshed = FieldSource::new(&water_scene(&["water.method=elements"])).unwrap();
    let step = integral.step();
    // Until the disc is silent: what a transform ends in has not been heard yet.
    let force = Series::new(0.0, step, push(step, 150e-6));
    let grid = FieldGrid::even(1.5e-3, 1.5e-3, 0.25e-3);
    let (radiator, motion) = (integral.radiator(), integral.motion(&force).unwrap());
    assert!(integral.weighted_maps(&force, &grid, &[]).unwrap().is_none() && !integral.is_soft());
    let omegas = [TAU * 0.073e6, TAU * 0.3e6];
    let weights = omegas.map(|omega| transform(omega, step, force.len()));
    let found = meshed.weighted_maps(&force, &grid, &weights).unwrap().unwrap();
    for ((omega, weights), b) in omegas.into_iter().zip(&weights).zip(found) {
        let of = |series: &Series| series.values.iter().zip(weights).map(|(v, weight)| weight * *v).sum();
        let velocities: Vec<c64> = motion.velocity().iter().map(of).collect();
        let a = amplitude_map(&radiator, &Water::fresh(), &grid, &velocities, omega).unwrap();
        let square: f64 = b.iter().map(|p| p.norm().powi(2)).sum();
        let difference: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).norm().powi(2)).sum();
        assert!((difference / square).sqrt() < 0.015 && square > 0.0, "{omega}: {}", (difference / square).sqrt());
    }
}

#[test]
fn behind_a_soft_baffle_the_face_s_pressure_makes_the_meshes_field() {
    let soft = FieldSource::new(&water_scene(&["water.method=elements", "water.baffle=soft"])).unwrap();
    assert!(soft.is_soft());
    let step = soft.step();
    let force = Series::new(0.0, step, push(step, 300e-6));
    let face = soft.face_pressure(&force).unwrap().unwrap();
    let rim = face.pressure().last().unwrap();
    assert!(rim.values.iter().all(|p| *p == 0.0) && (face.radii().last().unwrap() - 1e-3).abs() < 1e-15);
    let grid = FieldGrid { radius: vec![0.0], distance: vec![0.5e-3, 1e-3] };
    let omegas = [TAU * 0.15e6, TAU * 0.35e6];
    let weights = omegas.map(|omega| transform(omega, step, force.len()));
    let found = soft.weighted_maps(&force, &grid, &weights).unwrap().unwrap();
    for ((omega, weights), meshed) in omegas.into_iter().zip(&weights).zip(found) {
        let of = |series: &Series| series.values.iter().zip(weights).map(|(p, weight)| weight * *p).sum();
        let on_face: Vec<c64> = face.pressure().iter().map(of).collect();
        for (z, meshed) in grid.distance.iter().zip(meshed) {
            let found = soft_on_axis((face.radii(), &on_face), *z, omega);
            let error = (found - meshed).norm() / meshed.norm();
            assert!(error < 0.01, "{omega} {z}: {error} {found} {meshed}");
        }
    }
}

#[test]
fn what_has_no_field_is_refused_with_the_way_out() {
    let rigid = FieldSource::new(&scene::load("rigid", &[]).unwrap()).unwrap_err().to_string();
    assert!(rigid.contains("--scene water"), "{rigid}");
    let soft = FieldSource::new(&water_scene(&["water.baffle=soft", "water.method=elements"])).unwrap();
    let force = Series::new(0.0, soft.step(), vec![0.0; 9]);
    let grid = FieldGrid::even(1e-3, 1e-3, 1e-3);
    let late = soft.maps(&force, &grid, &[1e-3]).unwrap_err().to_string();
    assert!(late.contains("within the run"), "{late}");
    let slow = Series { step: 1e-7, ..force };
    let refusal = soft.maps(&slow, &grid, &[0.0]).unwrap_err().to_string();
    assert!(refusal.contains("output_step"), "{refusal}");
}
