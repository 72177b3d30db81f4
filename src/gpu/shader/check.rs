//! Checks a source without a GPU and says where, in the original files, it is wrong.

use super::emit::Source;
use std::error::Error;
use wgpu::naga;

/// What is wrong with a shader, at its original place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{piece}:{line}: {message}")]
#[non_exhaustive]
pub struct ShaderError {
    /// Name of the piece.
    pub piece: String,
    /// From 1; 0 where the place is unknown.
    pub line: usize,
    /// The compiler's words.
    pub message: String,
}

/// What a valid source declares.
#[derive(Clone, Debug)]
pub struct Reflection {
    module: naga::Module,
}

/// Parses and validates a source; an error names piece and line.
pub fn check(source: &Source) -> Result<Reflection, ShaderError> {
    let at = |location: Option<naga::SourceLocation>, message: String| {
        let line = location.map_or(0, |location| location.line_number as usize);
        let (piece, line) = source.origin(line).unwrap_or(("the emitted shader", 0));
        ShaderError { piece: piece.to_owned(), line, message }
    };
    let module = naga::front::wgsl::parse_str(&source.text).map_err(|error| {
        let message = std::iter::once(error.message().to_owned()).chain(error.notes().map(str::to_owned));
        at(error.location(&source.text), message.collect::<Vec<_>>().join("; "))
    })?;
    let capabilities = naga::valid::Capabilities::default() | naga::valid::Capabilities::FLOAT64;
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
    validator.validate(&module).map_err(|error| {
        let mut message = error.as_inner().to_string();
        let mut cause = error.as_inner().source();
        while let Some(inner) = cause {
            message = format!("{message}: {inner}");
            cause = inner.source();
        }
        at(innermost(&error, &source.text), message)
    })?;
    Ok(Reflection { module })
}

/// The smallest span of an error: the expression rather than its function.
fn innermost<E: Error>(error: &naga::WithSpan<E>, text: &str) -> Option<naga::SourceLocation> {
    let spans = error.spans().map(|(span, _)| *span).filter(naga::Span::is_defined);
    spans.min_by_key(|span| span.to_range().map_or(usize::MAX, |range| range.len())).map(|span| span.location(text))
}

impl Reflection {
    /// Members of a struct and their offsets (bytes).
    pub fn members(&self, name: &str) -> Option<Vec<(String, usize)>> {
        let of = |(_, ty): (_, &naga::Type)| match &ty.inner {
            naga::TypeInner::Struct { members, .. } if ty.name.as_deref() == Some(name) => {
                let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
                Some(members.iter().map(member).collect())
            }
            _ => None,
        };
        self.module.types.iter().find_map(of)
    }

    /// Group, binding and name of each resource, in the order of the source.
    pub fn bindings(&self) -> Vec<(u32, u32, String)> {
        let of = |(_, variable): (_, &naga::GlobalVariable)| {
            let binding = variable.binding?;
            Some((binding.group, binding.binding, variable.name.clone().unwrap_or_default()))
        };
        self.module.global_variables.iter().filter_map(of).collect()
    }

    /// Names of the functions, in the order of the source.
    pub fn functions(&self) -> Vec<String> {
        self.module.functions.iter().filter_map(|(_, function)| function.name.clone()).collect()
    }

    /// Workgroup size of an entry point.
    pub fn workgroup_size(&self, entry_point: &str) -> Option<[u32; 3]> {
        self.module.entry_points.iter().find(|entry| entry.name == entry_point).map(|entry| entry.workgroup_size)
    }
}
