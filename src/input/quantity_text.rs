//! Quantities written with a unit that reads well: `104 mm`, `31.03 MPa`, `20 deg`.

/// SI unit, and units with their factors, the largest first.
const SHOWN: [(&str, &[(&str, f64)]); 11] = [
    ("m", &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6)]),
    ("rad", &[("deg", std::f64::consts::PI / 180.0)]),
    ("Pa", &[("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0)]),
    ("N", &[("N", 1.0), ("mN", 1e-3), ("uN", 1e-6)]),
    ("N·m", &[("N·m", 1.0), ("mN·m", 1e-3), ("uN·m", 1e-6)]),
    ("N·m²", &[("N·m²", 1.0), ("N·mm²", 1e-6)]),
    ("m²", &[("m²", 1.0), ("mm²", 1e-6)]),
    ("kg", &[("kg", 1.0), ("g", 1e-3), ("mg", 1e-6)]),
    ("kg/m", &[("kg/m", 1.0), ("g/m", 1e-3)]),
    ("T", &[("T", 1.0), ("mT", 1e-3)]),
    ("A", &[("A", 1.0), ("mA", 1e-3)]),
];

/// A value in SI units as files take it, to six digits, with a unit in which it reads well.
///
/// ```
/// use rodsweep::input::quantity_text;
///
/// assert_eq!(quantity_text(0.104, "m"), "104 mm");
/// assert_eq!(quantity_text(0.001, "m"), "1 mm");
/// assert_eq!(quantity_text(31.03e6, "Pa"), "31.03 MPa");
/// assert_eq!(quantity_text(0.0, "T"), "0 T");
/// assert_eq!(quantity_text(100.0, ""), "100");
/// ```
pub fn quantity_text(value: f64, unit: &str) -> String {
    let shown = SHOWN.iter().find(|(si, _)| *si == unit).map_or(&[][..], |(_, shown)| shown);
    // Lengths are told in m from 2 m on, all else from 0.1 of its unit on.
    let least = |factor: f64| if unit == "m" && factor == 1.0 { 2.0 } else { 0.1 * factor };
    let fits = |(_, factor): &&(&str, f64)| value.abs() >= least(*factor) * (1.0 - 1e-9);
    let usual = if unit == "m" { shown.get(1) } else { shown.first() };
    let found = if value == 0.0 { usual } else { shown.iter().find(fits).or(shown.last()) };
    let (name, factor) = found.copied().unwrap_or((unit, 1.0));
    let number = digits(value / factor);
    if name.is_empty() { number } else { format!("{number} {name}") }
}

/// Six digits, without the zeros that end them.
fn digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    match rounded.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e7).contains(&size) || !size.is_finite() => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
