//! What the preprocessor works on: pieces of WGSL, and the terms and constants of one specialisation.

use crate::backend::Precision;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A shader file, or text generated for one plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Shown in error messages.
    pub name: Cow<'static, str>,
    /// WGSL with directives, see [`super::emit()`].
    pub text: Cow<'static, str>,
}

/// A constant's value, with its type.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A whole number.
    U32(u32),
    /// Of the kernel's precision.
    Float(f64),
    /// Not empty, all of one type.
    Array(Vec<Value>),
}

/// What distinguishes one specialisation of the shaders from another.
#[derive(Clone, Debug, PartialEq)]
pub struct Specialisation {
    /// Shaders are written in f32; in f64 every `f32` and every literal becomes one of f64.
    pub precision: Precision,
    /// Which lines are kept.
    pub terms: BTreeMap<String, bool>,
    /// Values of the constants that are marked `//@spec`.
    pub constants: BTreeMap<String, Value>,
}

impl Value {
    /// The type in WGSL.
    pub fn wgsl_type(&self, precision: Precision) -> String {
        match self {
            Value::U32(_) => "u32".into(),
            Value::Float(_) => precision.to_string(),
            Value::Array(values) => format!("array<{}, {}>", values[0].wgsl_type(precision), values.len()),
        }
    }

    /// An expression of this value, to the last bit.
    pub fn wgsl(&self, precision: Precision) -> String {
        match self {
            Value::U32(value) => format!("{value}u"),
            Value::Float(value) => match precision {
                Precision::F32 => format!("{:?}f", *value as f32),
                Precision::F64 => format!("{value:?}lf"),
            },
            Value::Array(values) => {
                let values: Vec<_> = values.iter().map(|value| value.wgsl(precision)).collect();
                format!("{}({})", self.wgsl_type(precision), values.join(", "))
            }
        }
    }

    /// An array of numbers of the kernel's precision; not empty.
    pub fn float_array(values: impl IntoIterator<Item = f64>) -> Value {
        Value::Array(values.into_iter().map(Value::Float).collect())
    }

    /// An array of whole numbers; not empty.
    pub fn u32_array(values: impl IntoIterator<Item = usize>) -> Value {
        Value::Array(values.into_iter().map(|value| Value::U32(value as u32)).collect())
    }
}

impl Default for Specialisation {
    fn default() -> Self {
        Self::new(Precision::F32)
    }
}

impl Specialisation {
    /// Without terms and constants.
    pub fn new(precision: Precision) -> Self {
        Self { precision, terms: BTreeMap::new(), constants: BTreeMap::new() }
    }

    /// Says whether a term holds.
    pub fn term(&mut self, name: impl Into<String>, holds: bool) {
        self.terms.insert(name.into(), holds);
    }

    /// Says the value of a constant.
    pub fn constant(&mut self, name: impl Into<String>, value: Value) {
        self.constants.insert(name.into(), value);
    }
}
