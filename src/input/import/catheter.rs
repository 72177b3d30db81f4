//! The published solver's parameter file: segments and actuators, tip to base, in mm, MPa, kg and A.

use super::super::error::{InputError, Problem};
use super::keywords::{Bound, Keyword, KeywordFile, Number};
use crate::model::SceneError;
use std::path::Path;

const CONFIG: &str = "CatheterConfig";
const OUTER_RADIUS: Keyword = Keyword { name: "oRlist", unit: "mm", bound: Bound::Positive };
const INNER_RADIUS: Keyword = Keyword { name: "iRlist", unit: "mm", bound: Bound::NotNegative };
const YOUNGS_MODULUS: Keyword = Keyword { name: "YoungModlist", unit: "MPa", bound: Bound::Positive };
const SHEAR_MODULUS: Keyword = Keyword { name: "ShearModlist", unit: "MPa", bound: Bound::Positive };
const REST_CURVATURE: Keyword = Keyword { name: "ustarlist", unit: "1/mm", bound: Bound::Any };
const LENGTH: Keyword = Keyword { name: "SegmentLengths", unit: "mm", bound: Bound::NotNegative };
const LINEAR_DENSITY: Keyword = Keyword { name: "rho", unit: "kg/mm", bound: Bound::Any };
const MASS: Keyword = Keyword { name: "ActMass", unit: "kg", bound: Bound::Any };
const TURNS_AREA: Keyword = Keyword { name: "CoilTurnAreaMat", unit: "1000 mm^2", bound: Bound::Any };
const ANGLES: Keyword = Keyword { name: "CoilAlignmentAngles", unit: "rad", bound: Bound::Any };
/// Keywords of markers and dynamics.
const UNUSED: [&str; 7] =
    ["NumSegments", "NumLocalizationMarkers", "MarkerLoc", "ActDamping", "ActInertia", "damping", "actInertia"];

/// Keywords that make the scene.
pub(crate) const USED: [&str; 11] = [
    CONFIG,
    OUTER_RADIUS.name,
    INNER_RADIUS.name,
    YOUNGS_MODULUS.name,
    SHEAR_MODULUS.name,
    REST_CURVATURE.name,
    LENGTH.name,
    LINEAR_DENSITY.name,
    MASS.name,
    TURNS_AREA.name,
    ANGLES.name,
];

/// A parameter file, in its own units.
pub(crate) struct Catheter<'a> {
    /// Base to tip.
    pub segments: Vec<Segment<'a>>,
    pub comments: Vec<&'a str>,
    /// Keywords and values that a static model has no use for.
    pub unused: Vec<(&'a str, String)>,
}

pub(crate) struct Segment<'a> {
    pub name: String,
    /// In mm
    pub length: Number<'a>,
    /// Of the tube (kg/mm)
    pub linear_density: Number<'a>,
    pub kind: Kind<'a>,
}

pub(crate) enum Kind<'a> {
    Flexible(Flexible<'a>),
    Rigid,
    Actuator(Actuator<'a>),
}

pub(crate) struct Flexible<'a> {
    /// In mm
    pub outer_radius: Number<'a>,
    /// In mm
    pub inner_radius: Number<'a>,
    /// In MPa
    pub youngs_modulus: Number<'a>,
    /// In MPa
    pub shear_modulus: Number<'a>,
    /// In 1/mm
    pub rest_curvature: [Number<'a>; 3],
}

pub(crate) struct Actuator<'a> {
    /// Without the tube (kg)
    pub mass: Number<'a>,
    /// Row by row, before alignment (1000 mm²)
    pub turns_area: [Number<'a>; 9],
    /// In rad
    pub angles: [Number<'a>; 2],
}

pub(crate) fn parse<'a>(file: &'a Path, text: &'a str) -> Result<Catheter<'a>, InputError> {
    let source = KeywordFile::parse(file, text, &[&USED[..], &UNUSED].concat())?;
    let types = segment_types(&source)?;
    let count = |kind: &str| types.iter().filter(|other| **other == kind).count();
    let (flexible, actuators) = (count("F"), count("A"));
    let listed = |keyword: &Keyword, each: usize, kind: &str, number: usize| {
        let one = match each {
            1 => "one",
            2 => "two",
            3 => "three",
            _ => "nine, row by row,",
        };
        source.numbers(keyword, each * number, &format!("{one} for each {kind} of {}", types.join(" ")))
    };
    let of_flexible = |keyword: &Keyword, each: usize| listed(keyword, each, "flexible segment (F)", flexible);
    let of_actuators = |keyword: &Keyword, each: usize| listed(keyword, each, "actuator (A)", actuators);
    let outer_radius = of_flexible(&OUTER_RADIUS, 1)?;
    let inner_radius = of_flexible(&INNER_RADIUS, 1)?;
    let youngs_modulus = of_flexible(&YOUNGS_MODULUS, 1)?;
    let shear_modulus = of_flexible(&SHEAR_MODULUS, 1)?;
    let rest_curvature = of_flexible(&REST_CURVATURE, 3)?;
    let mass = of_actuators(&MASS, 1)?;
    let turns_area = of_actuators(&TURNS_AREA, 9)?;
    let angles = of_actuators(&ANGLES, 2)?;
    let length = listed(&LENGTH, 1, "segment", types.len())?;
    let linear_density = listed(&LINEAR_DENSITY, 1, "segment", types.len())?;
    if flexible == 0 {
        return Err(source.error(CONFIG, Problem::Scene(SceneError::NoFlexible)));
    }
    for (inner, outer) in inner_radius.iter().zip(&outer_radius) {
        if inner.value >= outer.value {
            let expected = format!("a number [mm] below {} of the segment, {}", OUTER_RADIUS.name, outer.text);
            return Err(source.error(INNER_RADIUS.name, Problem::Range { value: inner.text.into(), expected }));
        }
    }
    let names = names(&types);
    let (mut f, mut a) = (0, 0);
    let mut segments = Vec::new();
    for (index, kind) in types.iter().enumerate() {
        let kind = match *kind {
            "F" => {
                f += 1;
                Kind::Flexible(Flexible {
                    outer_radius: outer_radius[f - 1],
                    inner_radius: inner_radius[f - 1],
                    youngs_modulus: youngs_modulus[f - 1],
                    shear_modulus: shear_modulus[f - 1],
                    rest_curvature: std::array::from_fn(|k| rest_curvature[3 * (f - 1) + k]),
                })
            }
            "A" => {
                a += 1;
                Kind::Actuator(Actuator {
                    mass: mass[a - 1],
                    turns_area: std::array::from_fn(|k| turns_area[9 * (a - 1) + k]),
                    angles: std::array::from_fn(|k| angles[2 * (a - 1) + k]),
                })
            }
            _ => Kind::Rigid,
        };
        let name = names[index].clone();
        segments.push(Segment { name, length: length[index], linear_density: linear_density[index], kind });
    }
    segments.reverse();
    let unused = source.lines.iter().filter(|line| UNUSED.contains(&line.keyword));
    let unused = unused.map(|line| (line.keyword, line.values.join(" "))).collect();
    Ok(Catheter { segments, comments: source.comments, unused })
}

/// `F`, `A` or `R` of each segment, tip to base.
fn segment_types<'a>(source: &KeywordFile<'a>) -> Result<Vec<&'a str>, InputError> {
    let types = source.line(CONFIG).map(|line| line.values.clone()).unwrap_or_default();
    if types.is_empty() {
        let remedy = format!("add a line `{CONFIG}` with a letter for each segment, tip to base, such as F A F");
        return Err(source.error(CONFIG, Problem::Missing { remedy }));
    }
    match types.iter().find(|kind| !["F", "A", "R"].contains(kind)) {
        None => Ok(types),
        Some(other) => {
            let allowed = "F (flexible), A (rigid with actuator), R (rigid)".into();
            Err(source.error(CONFIG, Problem::Choice { found: (*other).into(), suggestion: None, allowed }))
        }
    }
}

/// A name for each segment, in the order given (tip to base); numbers count from the base.
fn names(types: &[&str]) -> Vec<String> {
    if types == ["F", "A", "F"] {
        return ["distal", "coil", "proximal"].map(String::from).into();
    }
    let actuators = types.iter().filter(|kind| **kind == "A").count();
    let mut from_base = [0; 3];
    let mut name = |kind: &&str| {
        let at = ["F", "A", "R"].iter().position(|other| other == kind).unwrap_or(2);
        from_base[at] += 1;
        match (*kind, from_base[at]) {
            ("F", number) => format!("segment_{number}"),
            ("A", _) if actuators == 1 => "coil".into(),
            ("A", number) => format!("coil_{number}"),
            (_, number) => format!("rigid_{number}"),
        }
    };
    let mut names: Vec<String> = types.iter().rev().map(&mut name).collect();
    names.reverse();
    names
}
