//! Quantities with units: `"1.3 mm"`, `"31.03 MPa"`, `"2.9e-4 kg/m"`, `"20 deg"`; a bare number is SI.
//!
//! A unit carries its dimension and a decimal power, so `"1.3 mm"` is the double nearest to 0.0013. `"10 %"` is the number
//! 0.1.

use crate::model::{MU0_OVER_4PI, short_name};

/// No number that users give is larger, in SI: those of a scene multiplied stay finite, and so do derivatives.
pub const LARGEST: f64 = 1e60;

/// Magnetic constant (T·m/A), by which a field strength H in air is a flux density.
const MU_0: f64 = 4.0 * std::f64::consts::PI * MU0_OVER_4PI;

/// Exponents of m, kg, s, A, rad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Dimension([i8; 5]);

/// A unit: `factor x 10^power` of the SI unit of its dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit {
    dimension: Dimension,
    factor: f64,
    power: i32,
}

/// Why a text is no quantity of the dimension that is needed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The text does not start with a number.
    #[error("\"{}\" does not start with a number; write for example {example}", short_name(.text))]
    NoNumber {
        /// The text that was to be read.
        text: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// What follows the number is no unit.
    #[error("\"{}\": \"{}\" is no unit known here; write for example {example}", short_name(.text), short_name(.unit))]
    UnknownUnit {
        /// The text that was to be read.
        text: String,
        /// What follows the number.
        unit: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// A number with a decimal comma.
    #[error("\"{}\" has a decimal comma; write a point, for example {example}", short_name(.text))]
    DecimalComma {
        /// The text that was to be read.
        text: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// A temperature.
    #[error(
        "\"{}\" is a temperature, which is not modelled; give {expected} at that temperature, for example {example}", short_name(.text)
    )]
    Temperature {
        /// The text that was to be read.
        text: String,
        /// The dimension that is needed, in words.
        expected: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// The unit measures something else.
    #[error("\"{}\" is {found}; give {expected} such as {example}", short_name(.text))]
    Dimension {
        /// The text that was to be read.
        text: String,
        /// The dimension of the text, in words.
        found: String,
        /// The dimension that is needed, in words.
        expected: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// The value in SI units is larger than any number may be.
    #[error("\"{}\" is too large; give {expected} of at most 1e60 in size, such as {example}", short_name(.text))]
    TooLarge {
        /// The text that was to be read.
        text: String,
        /// The dimension that is needed, in words.
        expected: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
    /// The value in SI units is too large for a double.
    #[error("\"{}\" is not finite; give {expected} such as {example}", short_name(.text))]
    NotFinite {
        /// The text that was to be read.
        text: String,
        /// The dimension that is needed, in words.
        expected: String,
        /// A quantity of the dimension that is needed, as it is written.
        example: &'static str,
    },
}

impl Dimension {
    /// That of a pure number.
    pub const NUMBER: Dimension = Dimension([0; 5]);
    const FLUX_DENSITY: Dimension = Dimension([0, 1, -2, -1, 0]);
    const FIELD_STRENGTH: Dimension = Dimension([-1, 0, 0, 1, 0]);
    const FLUX_GRADIENT: Dimension = Dimension([-1, 1, -2, -1, 0]);
    const STRENGTH_GRADIENT: Dimension = Dimension([-2, 0, 0, 1, 0]);

    /// Dimension of an SI unit as `Parameter::unit` writes it.
    pub fn of(unit: &str) -> Dimension {
        parse_unit(unit).map_or(Self::NUMBER, |unit| unit.dimension)
    }

    /// Radians count as numbers beside other units (rad/m and 1/m are both curvatures), but not on their own.
    fn accepts(self, other: Dimension) -> bool {
        self == other || self.0[..4] == other.0[..4] && self.0[..4] != [0; 4]
    }

    /// By what a value in SI units of `other` becomes one of this dimension. In air a field strength is a flux density.
    fn factor_from(self, other: Dimension) -> Option<f64> {
        match (self, other) {
            (Self::FLUX_DENSITY, Self::FIELD_STRENGTH) | (Self::FLUX_GRADIENT, Self::STRENGTH_GRADIENT) => Some(MU_0),
            _ => self.accepts(other).then_some(1.0),
        }
    }

    fn words(self) -> Option<&'static (&'static str, &'static str, &'static str)> {
        KNOWN.iter().find(|(unit, ..)| parse_unit(unit).is_some_and(|unit| unit.dimension == self))
    }

    /// For messages: `a length`.
    pub fn name(self) -> String {
        self.words().map_or_else(|| format!("a quantity in {}", self.si_unit()), |(_, name, _)| (*name).into())
    }

    /// For messages: `"13 mm"`.
    pub fn example(self) -> &'static str {
        self.words().map_or("a number in SI units", |(.., example)| example)
    }

    fn si_unit(self) -> String {
        let mut text = String::new();
        for (name, exponent) in ["m", "kg", "s", "A", "rad"].iter().zip(self.0) {
            if exponent != 0 {
                let separator = if text.is_empty() { "" } else { "·" };
                let power = if exponent == 1 { String::new() } else { format!("^{exponent}") };
                text += &format!("{separator}{name}{power}");
            }
        }
        text
    }
}

/// SI unit, what it measures, an example.
const KNOWN: [(&str, &str, &str); 21] = [
    ("", "a pure number", "100"),
    ("m", "a length", "\"13 mm\""),
    ("kg", "a mass", "\"58 mg\""),
    ("s", "a time", "\"1 s\""),
    ("A", "a current", "\"200 mA\""),
    ("rad", "an angle", "\"20 deg\""),
    ("m²", "an area", "\"46.7 mm^2\""),
    ("T", "a flux density", "\"3 T\""),
    ("A/m", "a field strength", "\"16 kA/m\""),
    ("T/m", "a gradient of a field", "\"0.3 T/m\""),
    ("N", "a force", "\"2 mN\""),
    ("N·m", "a moment", "\"5 uN·m\""),
    ("N·m²", "a bending or torsional stiffness", "\"2e-5 N·m²\""),
    ("N/m", "a force per length", "\"0.01 N/m\""),
    ("m/s²", "an acceleration", "\"9.81 m/s^2\""),
    ("Pa", "a pressure or modulus", "\"31.03 MPa\""),
    ("kg/m³", "a density", "\"1060 kg/m^3\""),
    ("kg/m", "a mass per length", "\"2.9e-4 kg/m\""),
    ("1/m", "a curvature", "\"0.74 1/m\""),
    ("A·m²", "a magnetic moment", "\"0.01 A·m²\""),
    ("A·m", "a magnetic moment per length", "\"0.1 A·m\""),
];

/// Value in SI units of a text whose dimension must be `expected`; a number without unit is in SI units.
///
/// # Errors
///
/// A text without number, an unknown unit, another dimension, a value that is not finite.
pub fn parse_quantity(text: &str, expected: Dimension) -> Result<f64, QuantityError> {
    let example = expected.example();
    // A minus of typesetting.
    let plain = text.replace('−', "-");
    let trimmed = plain.trim();
    let split = number_end(trimmed);
    let Ok(number) = trimmed[..split].parse::<f64>() else {
        return Err(QuantityError::NoNumber { text: text.into(), example });
    };
    let unit_text = trimmed[split..].trim();
    let value = if unit_text.is_empty() {
        number
    } else {
        let Some(unit) = parse_unit(unit_text) else {
            return Err(no_unit(text, unit_text, expected));
        };
        let Some(factor) = expected.factor_from(unit.dimension) else {
            let (found, expected) = (unit.dimension.name(), expected.name());
            return Err(QuantityError::Dimension { text: text.into(), found, expected, example });
        };
        shifted(&trimmed[..split], unit.power).unwrap_or(f64::NAN) * (unit.factor * factor)
    };
    match value.abs() {
        size if size <= LARGEST => Ok(value),
        size if size.is_finite() => {
            Err(QuantityError::TooLarge { text: text.into(), expected: expected.name(), example })
        }
        _ => Err(QuantityError::NotFinite { text: text.into(), expected: expected.name(), example }),
    }
}

/// Why what follows a number is no unit.
fn no_unit(text: &str, unit: &str, expected: Dimension) -> QuantityError {
    let (text, example) = (text.to_owned(), expected.example());
    if unit.strip_prefix(',').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
        return QuantityError::DecimalComma { text, example };
    }
    match unit {
        "degC" | "°C" | "℃" | "degF" | "°F" | "K" | "celsius" | "Celsius" | "kelvin" | "Kelvin" => {
            QuantityError::Temperature { text, expected: expected.name(), example }
        }
        _ => QuantityError::UnknownUnit { text, unit: unit.into(), example },
    }
}

/// The double nearest to a decimal number times a power of ten.
fn shifted(number: &str, power: i32) -> Option<f64> {
    let (digits, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    format!("{digits}e{}", exponent.parse::<i32>().ok()?.checked_add(power)?).parse().ok()
}

/// Bytes of the leading decimal number.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let mut at = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    at = digits(at);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = at + 1 + usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        let end = digits(sign);
        if end > sign {
            at = end;
        }
    }
    at
}

/// A product of powers: `N·m²`, `kg/m^3`, `1/m`, `N m^2`, `m s^-2`. One division applies to the next factor only.
fn parse_unit(text: &str) -> Option<Unit> {
    let mut total = Unit { dimension: Dimension::NUMBER, factor: 1.0, power: 0 };
    let mut divide = false;
    let mut expects_factor = false;
    let mut rest = text.trim();
    while let Some(c) = rest.chars().next() {
        if c.is_whitespace() {
            rest = rest.trim_start();
            continue;
        }
        if matches!(c, '·' | '*' | '⋅' | '.' | '/') {
            if expects_factor {
                return None;
            }
            (divide, expects_factor) = (c == '/', true);
            rest = &rest[c.len_utf8()..];
            continue;
        }
        let end = rest.find(|c: char| !(c.is_alphabetic() || matches!(c, '°' | '%'))).unwrap_or(rest.len());
        if end == 0 {
            // The only number in a unit is the one of `1/m`.
            rest = rest.strip_prefix('1')?;
            if !rest.trim_start().starts_with('/') {
                return None;
            }
            expects_factor = false;
            continue;
        }
        let unit = parse_symbol(&rest[..end])?;
        let (exponent, used) = parse_exponent(&rest[end..])?;
        let exponent = if divide { -exponent } else { exponent };
        for (sum, part) in total.dimension.0.iter_mut().zip(unit.dimension.0) {
            *sum = sum.checked_add(part.checked_mul(exponent)?)?;
        }
        total.factor *= unit.factor.powi(i32::from(exponent));
        total.power += unit.power * i32::from(exponent);
        rest = &rest[end + used..];
        (divide, expects_factor) = (false, false);
    }
    if expects_factor { None } else { Some(total) }
}

/// `²`, `³`, `⁻¹`, `^2`, `^-1` or nothing: the exponent and its bytes.
fn parse_exponent(text: &str) -> Option<(i8, usize)> {
    let superscripts = [("⁻¹", -1), ("⁻²", -2), ("⁻³", -3), ("²", 2), ("³", 3), ("⁴", 4)];
    for (symbol, exponent) in superscripts {
        if text.starts_with(symbol) {
            return Some((exponent, symbol.len()));
        }
    }
    let Some(power) = text.strip_prefix('^') else { return Some((1, 0)) };
    let end = power.find(|c: char| !(c.is_ascii_digit() || c == '-')).unwrap_or(power.len());
    let exponent: i8 = power[..end].parse().ok()?;
    (exponent.unsigned_abs() <= 9).then_some((exponent, end + 1))
}

/// A unit symbol with at most one prefix.
fn parse_symbol(symbol: &str) -> Option<Unit> {
    if let Some(unit) = base_symbol(symbol) {
        return Some(unit);
    }
    const PREFIXES: [(&str, i32); 9] =
        [("p", -12), ("n", -9), ("u", -6), ("µ", -6), ("μ", -6), ("m", -3), ("c", -2), ("k", 3), ("M", 6)];
    let giga = ("G", 9);
    let (prefix, power) = PREFIXES.iter().chain([&giga]).find(|(prefix, _)| symbol.starts_with(prefix))?;
    let unit = base_symbol(&symbol[prefix.len()..])?;
    takes_prefix(&symbol[prefix.len()..]).then_some(Unit { power: unit.power + power, ..unit })
}

/// Whether prefixes go with a unit. With one, others mean something else: `min` is no length.
fn takes_prefix(symbol: &str) -> bool {
    matches!(symbol, "m" | "g" | "s" | "A" | "rad" | "N" | "J" | "Pa" | "T" | "Wb" | "G" | "Gs" | "Oe" | "emu" | "gf")
}

fn base_symbol(symbol: &str) -> Option<Unit> {
    const INCH: f64 = 2.54;
    const POUND_FORCE: f64 = 4.448_221_615_260_5;
    const PSI: f64 = POUND_FORCE / (INCH * INCH);
    let (exponents, factor, power) = match symbol {
        "%" => ([0; 5], 1.0, -2),
        "m" => ([1, 0, 0, 0, 0], 1.0, 0),
        "g" => ([0, 1, 0, 0, 0], 1.0, -3),
        "kg" => ([0, 1, 0, 0, 0], 1.0, 0),
        "s" => ([0, 0, 1, 0, 0], 1.0, 0),
        "A" => ([0, 0, 0, 1, 0], 1.0, 0),
        "rad" => ([0, 0, 0, 0, 1], 1.0, 0),
        "deg" | "°" | "degree" | "degrees" => ([0, 0, 0, 0, 1], std::f64::consts::PI / 180.0, 0),
        "N" => ([1, 1, -2, 0, 0], 1.0, 0),
        "J" => ([2, 1, -2, 0, 0], 1.0, 0),
        "Pa" => ([-1, 1, -2, 0, 0], 1.0, 0),
        "bar" => ([-1, 1, -2, 0, 0], 1.0, 5),
        "T" => ([0, 1, -2, -1, 0], 1.0, 0),
        "G" | "Gs" | "gauss" | "Gauss" => ([0, 1, -2, -1, 0], 1.0, -4),
        "Wb" => ([2, 1, -2, -1, 0], 1.0, 0),
        "Oe" | "oersted" | "Oersted" => ([-1, 0, 0, 1, 0], 0.25 / std::f64::consts::PI, 3),
        "emu" => ([2, 0, 0, 1, 0], 1.0, -3),
        "in" | "inch" | "inches" => ([1, 0, 0, 0, 0], INCH, -2),
        "mil" | "thou" => ([1, 0, 0, 0, 0], INCH, -5),
        "Fr" | "French" => ([1, 0, 0, 0, 0], 1.0 / 3.0, -3),
        "psi" => ([-1, 1, -2, 0, 0], PSI, 4),
        "ksi" => ([-1, 1, -2, 0, 0], PSI, 7),
        "lbf" => ([1, 1, -2, 0, 0], POUND_FORCE, 0),
        "gf" => ([1, 1, -2, 0, 0], 9.806_65, -3),
        _ => return None,
    };
    Some(Unit { dimension: Dimension(exponents), factor, power })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_give_the_nearest_double() {
        let cases = [
            ("1.3 mm", "m", 0.0013),
            ("31.03 MPa", "Pa", 31.03e6),
            ("20 deg", "rad", 20.0 * std::f64::consts::PI / 180.0),
            ("46.7 mm^2", "m²", 46.7e-6),
            ("46.7mm²", "m²", 46.7e-6),
            ("1060 kg/m^3", "kg/m³", 1060.0),
            ("2.9e-4 kg/m", "kg/m", 2.9e-4),
            ("2 N·m²", "N·m²", 2.0),
            ("2 N m^2", "N·m²", 2.0),
            ("2 N*mm^2", "N·m²", 2e-6),
            ("0.74 1/m", "1/m", 0.74),
            ("0.74 /m", "1/m", 0.74),
            ("0.74 m^-1", "1/m", 0.74),
            ("0.74 rad/m", "1/m", 0.74),
            ("5 mT", "T", 5e-3),
            ("300 G", "T", 0.03),
            ("1 G/cm", "T/m", 0.01),
            ("30 mT/cm", "T/m", 3.0),
            ("70 A·m^2", "A·m²", 70.0),
            ("-300 mA", "A", -0.3),
            ("58 mg", "kg", 58e-6),
            ("3 g", "kg", 3e-3),
            ("2 mN", "N", 2e-3),
            ("7 uN·m", "N·m", 7e-6),
            ("7 µN m", "N·m", 7e-6),
            ("9.81 m/s²", "m/s²", 9.81),
            ("9.81 m/s/s", "m/s²", 9.81),
            ("30", "", 30.0),
            ("10 %", "", 0.1),
            ("2.5%", "", 0.025),
            ("0.0013", "m", 0.0013),
            ("2 in", "m", 0.0508),
            ("2 inch", "m", 0.0508),
            ("14 mil", "m", 355.6e-6),
            ("6 Fr", "m", 2e-3),
            ("6 French", "m", 2e-3),
            ("1 psi", "Pa", 6_894.757_293_168_361),
            ("2.5 ksi", "Pa", 17_236_893.232_920_9),
            ("2 lbf", "N", 8.896_443_230_521),
            ("5 lbf/in^2", "Pa", 5.0 * 6_894.757_293_168_361),
            ("100 gf", "N", 0.980_665),
            ("1 kgf", "N", 9.806_65),
            ("200 Gs", "T", 0.02),
            ("2 kGs", "T", 0.2),
            ("200 gauss", "T", 0.02),
            ("200 Oe", "T", 0.02),
            ("16 kA/m", "T", 16e3 * 4e-7 * std::f64::consts::PI),
            ("16 kA m^-1", "T", 16e3 * 4e-7 * std::f64::consts::PI),
            ("3 mA/m", "T", 3e-3 * 4e-7 * std::f64::consts::PI),
            ("5 Oe/cm", "T/m", 0.05),
            ("0.02 Wb/m^2", "T", 0.02),
            ("35 emu", "A·m²", 0.035),
            ("35 emu/cm", "A·m", 3.5),
            ("0.02 A.m", "A·m", 0.02),
            ("20 degrees", "rad", 20.0 * std::f64::consts::PI / 180.0),
            ("−13 mm", "m", -0.013),
            ("0.74 m^−1", "1/m", 0.74),
            ("1e−3 m", "m", 1e-3),
        ];
        for (text, unit, value) in cases {
            let parsed = parse_quantity(text, Dimension::of(unit));
            let Ok(parsed) = parsed else { panic!("{text}: {parsed:?}") };
            assert!((parsed - value).abs() <= value.abs() * 2.3e-16, "{text}: {parsed}");
        }
        assert_eq!(parse_quantity("94.3 mm", Dimension::of("m")), Ok(0.0943));
        assert_eq!(parse_quantity("0.9906 mm", Dimension::of("m")), Ok(0.0009906));
        assert_eq!(parse_quantity("-9.906e2 um", Dimension::of("m")), Ok(-0.0009906));
    }

    #[test]
    fn wrong_dimensions_and_units_are_named() {
        let message = |text, unit| parse_quantity(text, Dimension::of(unit)).unwrap_err().to_string();
        assert_eq!(message("3 kg", "m"), "\"3 kg\" is a mass; give a length such as \"13 mm\"");
        assert_eq!(message("3 deg", ""), "\"3 deg\" is an angle; give a pure number such as 100");
        assert_eq!(message("3 %", "m"), "\"3 %\" is a pure number; give a length such as \"13 mm\"");
        assert!(message("3 m%", "").contains("no unit"));
        assert_eq!(message("3 m", "rad"), "\"3 m\" is a length; give an angle such as \"20 deg\"");
        assert!(message("3 furlong", "m").contains("\"furlong\" is no unit"));
        assert!(message("long", "m").contains("does not start with a number"));
        assert!(message("3 m/", "m").contains("no unit"));
        assert!(message("1e400 m", "m").contains("not finite"));
        assert!(message("3 m^99", "m").contains("no unit"));
        assert!(message("3 min", "m").contains("no unit"));
        assert_eq!(message("0,3 mm", "m"), "\"0,3 mm\" has a decimal comma; write a point, for example \"13 mm\"");
        for temperature in ["37 degC", "37 °C", "310 K"] {
            let expected =
                format!("\"{temperature}\" is a temperature, which is not modelled; give a pressure or modulus");
            assert!(message(temperature, "Pa").starts_with(&expected), "{}", message(temperature, "Pa"));
        }
        assert!(message("200 Oe", "A").contains("is a field strength; give a current"));
    }
}
