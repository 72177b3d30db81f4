//! What the preprocessor works on: pieces of WGSL, and the terms and constants of one specialisation.

use std::borrow::Cow;
use std::collections::BTreeMap;

/// A shader file, or text generated for one plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Shown in error messages.
    pub name: Cow<'static, str>,
    pub text: Cow<'static, str>,
}

/// A constant's value, with its type.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    U32(u32),
    F32(f32),
    /// Not empty, all of one type.
    Array(Vec<Value>),
}

/// What distinguishes one specialisation of the shaders from another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Specialisation {
    pub terms: BTreeMap<String, bool>,
    pub constants: BTreeMap<String, Value>,
}

impl Value {
    pub fn wgsl_type(&self) -> String {
        match self {
            Value::U32(_) => "u32".into(),
            Value::F32(_) => "f32".into(),
            Value::Array(values) => format!("array<{}, {}>", values[0].wgsl_type(), values.len()),
        }
    }

    /// An expression of this value, to the last bit.
    pub fn wgsl(&self) -> String {
        match self {
            Value::U32(value) => format!("{value}u"),
            Value::F32(value) => format!("{value:?}f"),
            Value::Array(values) => {
                let values: Vec<_> = values.iter().map(Value::wgsl).collect();
                format!("{}({})", self.wgsl_type(), values.join(", "))
            }
        }
    }

    pub fn f32_array(values: impl IntoIterator<Item = f64>) -> Value {
        Value::Array(values.into_iter().map(|value| Value::F32(value as f32)).collect())
    }

    pub fn u32_array(values: impl IntoIterator<Item = usize>) -> Value {
        Value::Array(values.into_iter().map(|value| Value::U32(value as u32)).collect())
    }
}

impl Specialisation {
    pub fn term(&mut self, name: impl Into<String>, holds: bool) {
        self.terms.insert(name.into(), holds);
    }

    pub fn constant(&mut self, name: impl Into<String>, value: Value) {
        self.constants.insert(name.into(), value);
    }
}
