//! Numbers with units, read and written.

use granchain::signal::{Dimension, Quantity, QuantityError, Unit};
use proptest::prelude::*;

fn value(text: &str, dimension: Dimension) -> f64 {
    Quantity::parse_as(text, dimension).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn message(text: &str) -> String {
    Quantity::parse(text).unwrap_err().to_string()
}

#[test]
fn prefixed_numbers_are_the_doubles_their_scientific_form_is() {
    for text in ["3.96 um", "3.96um", "3.96 µm", "3.96 μm", "3960 nm", "+3.96e0 um", "0.00396mm"] {
        assert_eq!(value(text, Dimension::LENGTH), 3.96e-6, "{text}");
    }
    assert_eq!(value("73kHz", Dimension::FREQUENCY), 73e3);
    assert_eq!(value("0.073 MHz", Dimension::FREQUENCY), 73e3);
    assert_eq!(value("73_000 1/s", Dimension::FREQUENCY), 73e3);
    assert_eq!(value("201 GPa", Dimension::PRESSURE), 201e9);
    assert_eq!(value("201 kN/mm^2", Dimension::PRESSURE), 201e9);
    assert_eq!(value("1 µs", Dimension::TIME), 1e-6);
    assert_eq!(value("2 min", Dimension::TIME), 120.0);
    assert_eq!(value("7.833 g/cm³", Dimension::DENSITY), 7833.0);
    assert_eq!(value("7833 kg m^-3", Dimension::DENSITY), 7833.0);
    assert_eq!(value("7833 kg m-3", Dimension::DENSITY), 7833.0);
    assert_eq!(value("-207 mm·s⁻¹", Dimension::VELOCITY), -0.207);
    assert_eq!(value("−207 mm/s", Dimension::VELOCITY), -0.207);
    assert_eq!(value("0.5", Dimension::NONE), 0.5);
    assert_eq!(value("25 %", Dimension::NONE), 0.25);
}

#[test]
fn damping_coefficients_are_read_however_their_half_exponents_are_written() {
    for text in ["0.3 N s/m", "0.3 N·s/m", "0.3 N*s/m", "0.3 N/(m/s)", "0.3 N s m^-1", "0.3 kg/s", "300 mN s/m"] {
        assert_eq!(value(text, Dimension::LINEAR_DAMPING), 0.3, "{text}");
    }
    for text in [
        "3660 N s m^-3/2",
        "3660 N·s/m^1.5",
        "3660 N·s·m^(-3/2)",
        "3660 N s m**-1.5",
        "3.66e3 N s m⁻³ᐟ²",
        "3660 N s/m^(3/2)",
        "3.66 kN s/m^3/2",
    ] {
        assert_eq!(value(text, Dimension::KUWABARA_KONO_DAMPING), 3660.0, "{text}");
    }
    // A prefix under a half exponent: (1e-3)^-1.5 = 10^4.5, rounded twice.
    let millimetres = value("1 N s mm^-1.5", Dimension::KUWABARA_KONO_DAMPING);
    assert!((millimetres / 10f64.powf(4.5) - 1.0).abs() < 1e-15);
}

#[test]
fn units_alone_carry_factor_and_dimension() {
    let velocity = Unit::parse("mm/s").unwrap();
    assert_eq!((velocity.factor, velocity.dimension), (1e-3, Dimension::VELOCITY));
    assert_eq!(Unit::parse("mm_per_s").unwrap(), velocity);
    assert_eq!(Unit::parse("m per s").unwrap(), Unit::parse("m/s").unwrap());
    assert_eq!(Unit::parse("us").unwrap().factor, 1e-6);
    assert_eq!(Unit::parse("N s m^-5/4").unwrap(), Unit::parse("N·s/m^1.25").unwrap());
    assert_eq!(Unit::parse("m^1.25").unwrap().dimension.si_unit(), "m^1.25");
    let quarter = Unit::parse("mm^1/4").unwrap();
    assert!((quarter.factor.powi(4) - 1e-3).abs() < 1e-17 && quarter.dimension.metre == 1);
    assert_eq!(Unit::parse("mV").unwrap().dimension, Dimension::VOLTAGE);
    assert_eq!("1".parse::<Unit>().unwrap(), Unit { factor: 1.0, dimension: Dimension::NONE });
    assert!(Unit::parse("").is_err());
}

#[test]
fn unreadable_quantities_name_what_was_found_and_the_nearest_unit() {
    assert_eq!(message("fast"), "expected a number with a unit such as `3.96 um`, found `fast`");
    assert_eq!(message("NaN"), "expected a number with a unit such as `3.96 um`, found `NaN`");
    assert_eq!(message("0,396 um"), "expected a decimal point, found a comma in `0,396 um`; write `0.396 um`");
    assert_eq!(message("1e999 m"), "`1e999 m` is too large to be represented");
    assert_eq!(message("73 khz"), "unknown unit `khz` in `73 khz`; did you mean `kHz`?");
    assert_eq!(message("4 mmm"), "unknown unit `mmm` in `4 mmm`; did you mean `mm`?");
    assert_eq!(message("4 parsec"), "unknown unit `parsec` in `4 parsec`; examples: mm/s, um, nm, V, kPa");
    assert_eq!(
        message("4 m^1.3"),
        "`^1.3` in `4 m^1.3` is no exponent; expected a multiple of 1/4 such as `^2`, `^-3/2` or `^1.25`"
    );
    assert_eq!(message("4 m?"), "cannot read the unit in `4 m?` at `?`; expected a unit such as `mm/s` or `N s/m^1.5`");
    assert!(matches!(Quantity::parse("4 m/"), Err(QuantityError::Malformed { .. })));
    assert!(matches!(Quantity::parse("4 (m/s"), Err(QuantityError::Malformed { .. })));
    assert!(matches!(Quantity::parse("4 m)"), Err(QuantityError::Malformed { .. })));
    assert!(matches!(Quantity::parse("4 m^99"), Err(QuantityError::Exponent { .. })));
    assert!(matches!(Quantity::parse("4 m^60 m^60"), Err(QuantityError::Exponent { .. })));
    assert!(matches!(Quantity::parse(""), Err(QuantityError::NoNumber { .. })));
}

#[test]
fn a_quantity_of_another_dimension_is_refused_with_an_example_of_the_right_one() {
    let refuse = |text, dimension| Quantity::parse_as(text, dimension).unwrap_err().to_string();
    assert_eq!(refuse("0.5", Dimension::LENGTH), "expected a length such as `0.5 mm`, found `0.5` without a unit");
    assert_eq!(
        refuse("0.5 s", Dimension::LENGTH),
        "expected a length such as `0.5 mm`, found `0.5 s`, which is a time"
    );
    assert_eq!(
        refuse("3660 N s/m", Dimension::KUWABARA_KONO_DAMPING),
        "expected a Kuwabara–Kono damping coefficient such as `3660 N s/m^1.5`, found `3660 N s/m`, \
         which is a linear damping coefficient"
    );
    assert_eq!(
        refuse("1 V s", Dimension::NONE),
        "expected a number without unit such as `0.7`, found `1 V s`, which is in s·V"
    );
}

#[test]
fn quantities_are_written_with_a_prefix_that_reads_well() {
    let written = |value, dimension| Quantity::new(value, dimension).to_string();
    assert_eq!(written(3.96e-6, Dimension::LENGTH), "3.96 µm");
    assert_eq!(written(0.5e-3, Dimension::LENGTH), "0.5 mm");
    assert_eq!(written(0.0, Dimension::LENGTH), "0 m");
    assert_eq!(written(73e3, Dimension::FREQUENCY), "73 kHz");
    assert_eq!(written(-0.247, Dimension::VELOCITY), "-247 mm/s");
    assert_eq!(written(201e9, Dimension::PRESSURE), "201 GPa");
    assert_eq!(written(1e-7, Dimension::TIME), "0.1 µs");
    assert_eq!(written(1.2e-4, Dimension::TIME), "120 µs");
    assert_eq!(written(7833.0, Dimension::DENSITY), "7833 kg/m³");
    assert_eq!(written(4.101e-6, Dimension::MASS), "4.101 mg");
    assert_eq!(written(0.3, Dimension::LINEAR_DAMPING), "0.3 N·s/m");
    assert_eq!(written(3660.0, Dimension::KUWABARA_KONO_DAMPING), "3660 N·s·m^(-3/2)");
    assert_eq!(written(0.25, Dimension::NONE), "0.25");
    assert_eq!(Quantity::new(3660.0, Dimension::KUWABARA_KONO_DAMPING).format_si(), "3660 N s/m^1.5");
    assert_eq!(Quantity::new(1e-6, Dimension::LENGTH).format_si(), "1 um");
    assert_eq!(written(2.0, Dimension { metre: 4, kilogram: 0, second: 4, volt: -4 }), "2 m·s·V^-1");
}

fn dimensions() -> impl Strategy<Value = Dimension> {
    prop::sample::select(vec![
        Dimension::NONE,
        Dimension::LENGTH,
        Dimension::MASS,
        Dimension::TIME,
        Dimension::FREQUENCY,
        Dimension::VELOCITY,
        Dimension::ACCELERATION,
        Dimension::FORCE,
        Dimension::ENERGY,
        Dimension::PRESSURE,
        Dimension::DENSITY,
        Dimension::STIFFNESS,
        Dimension::HERTZ_STIFFNESS,
        Dimension::LINEAR_DAMPING,
        Dimension::KUWABARA_KONO_DAMPING,
        Dimension::VOLTAGE,
        Dimension { metre: 1, kilogram: -2, second: 3, volt: 0 },
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn writing_and_reading_back_gives_the_same_double(
        mantissa in -1.0f64..1.0, exponent in -30i32..30, dimension in dimensions()
    ) {
        let quantity = Quantity::new(mantissa * 10f64.powi(exponent), dimension);
        prop_assert_eq!(Quantity::parse(&quantity.format_si()).unwrap(), quantity);
        prop_assert_eq!(Quantity::parse(&quantity.to_string()).unwrap(), quantity);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "\\PC{0,24}", unit in "[0-9mskgNPaHz^*/()·µ. -]{0,16}") {
        let _ = Quantity::parse(&text);
        let _ = Unit::parse(&unit);
        let _ = Quantity::parse(&format!("1 {unit}"));
    }
}

#[test]
fn parentheses_nested_without_end_are_refused() {
    let nested = |depth: usize| Unit::parse(&format!("{}m{}", "(".repeat(depth), ")".repeat(depth)));
    assert_eq!(nested(32).unwrap().dimension, Dimension::LENGTH);
    for depth in [33, 1_000_000] {
        let error = nested(depth).unwrap_err();
        assert!(matches!(error, QuantityError::Nested { .. }), "{error}");
        assert!(error.to_string().len() < 200);
    }
}
