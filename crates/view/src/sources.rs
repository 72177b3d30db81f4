//! Magnets and coils around the rod, as the figures have them.

use rodsweep::draw::{FieldSource, SourceBody, Surroundings};
use serde_json::{Value, json};

/// Of what surrounds a rod; an empty list where the field is uniform.
pub fn sources(around: Option<&Surroundings>) -> Value {
    around.into_iter().flat_map(|around| &around.sources).map(source).collect()
}

fn source(source: &FieldSource) -> Value {
    let body = match source.body {
        SourceBody::Dipole => Value::Null,
        SourceBody::Cylinder(body) | SourceBody::Coil(body) => {
            json!({ "axis": body.axis, "length": body.length, "diameter": body.diameter })
        }
        SourceBody::Cuboid(body) => json!({ "edges": body.edges, "size": body.size }),
    };
    json!({
        "name": source.name,
        "kind": if source.is_coil() { "electromagnet" } else { "magnet" },
        "position": source.position,
        "moment": source.moment,
        "current": source.current,
        "body": body,
    })
}
