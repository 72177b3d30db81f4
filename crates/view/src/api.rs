//! The table of paths: what a request asks for, and its answer. No path names a file.

use crate::drag::Beginning;
use crate::error::Refusal;
use crate::map::ResultMap;
use crate::page;
use crate::rod;
use crate::view::View;
use rodsweep::model::Vector;
use serde_json::{Map, Value, json};

/// A request whose sender has been checked.
pub struct Request {
    /// Whether it brings a body; else it only asks.
    pub is_post: bool,
    /// Behind the secret, without the slash.
    pub path: String,
    /// Behind the question mark.
    pub query: String,
    /// JSON.
    pub body: Vec<u8>,
}

/// What goes back.
pub struct Answer {
    /// Of HTTP.
    pub status: u16,
    /// Type of the content.
    pub kind: &'static str,
    /// The content.
    pub body: Vec<u8>,
}

const JSON: &str = "application/json";
const COLUMNS: &str = "application/octet-stream";

/// Answers a request; a refusal is an answer, too.
pub fn answer(view: &View, request: &Request) -> Answer {
    let found = if request.is_post { post(view, request) } else { get(view, request) };
    found.unwrap_or_else(|refusal| Answer {
        status: refusal.status,
        kind: JSON,
        body: json!({ "error": refusal.message }).to_string().into_bytes(),
    })
}

fn get(view: &View, request: &Request) -> Result<Answer, Refusal> {
    let query = Query::parse(&request.query)?;
    match request.path.as_str() {
        "" => Ok(of("text/html; charset=utf-8", page::DOCUMENT.into())),
        "page.js" => Ok(of("text/javascript; charset=utf-8", page::SCRIPT.into())),
        "style.css" => Ok(of("text/css; charset=utf-8", page::LOOKS.into())),
        "api/view" => Ok(of_json(&view.describe(true)?)),
        "api/points" => {
            let names = query.list("columns");
            Ok(of(COLUMNS, map(view)?.points(&names, query.number("from")?, query.number("count")?)?))
        }
        "api/column" => Ok(of_json(&map(view)?.column(query.text("name")?)?)),
        "api/row" => Ok(of_json(&map(view)?.row(query.number("row")? as u64)?)),
        "api/voxels" => Ok(of(COLUMNS, map(view)?.voxels(query.text("column")?)?)),
        "api/voxels/column" => Ok(of_json(&map(view)?.voxel_column(query.text("name")?)?)),
        "api/surface/points" => Ok(of(COLUMNS, surface(view)?.point_columns()?)),
        "api/surface/triangles" => Ok(of(COLUMNS, surface(view)?.triangle_columns()?)),
        path => match path.strip_prefix("stills/") {
            Some(name) => Ok(of("image/png", view.stills().read(name, view.scene())?)),
            None => Err(Refusal::absent("no such page")),
        },
    }
}

fn post(view: &View, request: &Request) -> Result<Answer, Refusal> {
    let body: Value = serde_json::from_slice(&request.body)
        .map_err(|error| Refusal::wrong(format!("the body is no JSON: {error}")))?;
    let none = Map::new();
    let values = match body.get("values") {
        None => &none,
        Some(Value::Object(values)) => values,
        Some(_) => return Err(Refusal::wrong("`values`: give an object of names and numbers in SI units")),
    };
    let is_set = |name: &str| body.get(name).and_then(Value::as_bool).unwrap_or(false);
    match request.path.as_str() {
        "api/solve" => {
            let known = match &body["lines"] {
                Value::Null => None,
                number => Some(number.as_u64().ok_or_else(|| Refusal::wrong("`lines`: give a number from 0 on"))?),
            };
            Ok(of_json(&rod::answer(view.scene_at(values)?, is_set("rest"), view.lines(), known)?))
        }
        "api/branches" => Ok(of_json(&rod::branches(view.scene_at(values)?)?)),
        "api/drag" => {
            let target = vector(&body["target"]);
            let target = target.ok_or_else(|| Refusal::wrong("`target`: give three coordinates in metres"))?;
            let along = match &body["along"] {
                Value::Null => None,
                along => Some(vector(along).and_then(unit).ok_or_else(|| Refusal::wrong("`along`: give a direction"))?),
            };
            let beginning = Beginning { is_precise: is_set("precise"), along };
            Ok(of_json(&view.drag(values, target, is_set("begin").then_some(beginning))?))
        }
        _ => Err(Refusal::absent("no such page")),
    }
}

/// Three numbers.
fn vector(value: &Value) -> Option<Vector> {
    let numbers: Vec<f64> = value.as_array()?.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}

/// A direction as a unit vector.
fn unit(vector: Vector) -> Option<Vector> {
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length.is_finite() && length > 0.0).then(|| vector.map(|x| x / length))
}

fn map(view: &View) -> Result<&ResultMap, Refusal> {
    view.map().ok_or_else(|| Refusal::absent("a scene has no points: view a result directory"))
}

fn surface(view: &View) -> Result<&crate::surface::Surface, Refusal> {
    let surface = map(view)?.surface.as_ref();
    surface.ok_or_else(|| Refusal::absent("no boundary: run `rodsweep workspace` on the directory"))
}

fn of(kind: &'static str, body: Vec<u8>) -> Answer {
    Answer { status: 200, kind, body }
}

fn of_json(value: &Value) -> Answer {
    of(JSON, value.to_string().into_bytes())
}

/// Names and values behind the question mark.
struct Query(Vec<(String, String)>);

impl Query {
    fn parse(text: &str) -> Result<Query, Refusal> {
        let pairs = text.split('&').filter(|pair| !pair.is_empty());
        let pair = |pair: &str| {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            Ok((decoded(name)?, decoded(value)?))
        };
        pairs.map(pair).collect::<Result<_, Refusal>>().map(Query)
    }

    fn text(&self, name: &str) -> Result<&str, Refusal> {
        let found = self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str());
        found.ok_or_else(|| Refusal::wrong(format!("`{name}` is missing")))
    }

    fn list(&self, name: &str) -> Vec<String> {
        let values = self.0.iter().filter(|(known, value)| known == name && !value.is_empty());
        values.map(|(_, value)| value.clone()).collect()
    }

    fn number(&self, name: &str) -> Result<usize, Refusal> {
        self.text(name)?.parse().map_err(|_| Refusal::wrong(format!("`{name}`: give a whole number")))
    }
}

/// Percent signs and plus signs undone.
fn decoded(text: &str) -> Result<String, Refusal> {
    let wrong = || Refusal::wrong("the address is not encoded as it should be");
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        rest = after;
        match first {
            b'+' => bytes.push(b' '),
            b'%' => {
                let (digits, after) = rest.split_first_chunk::<2>().ok_or_else(wrong)?;
                let digit = |digit: u8| (digit as char).to_digit(16).ok_or_else(wrong);
                bytes.push((16 * digit(digits[0])? + digit(digits[1])?) as u8);
                rest = after;
            }
            other => bytes.push(*other),
        }
    }
    String::from_utf8(bytes).map_err(|_| wrong())
}
