//! Calibrations of electromagnet systems by multipoles, in YAML: `Coil_List`, and for each coil its sources. A source with
//! one `B_Coeff` b, a direction d and a position gives B = b (3 (d·r) r - d) / r³ per ampere, r of length one.

use super::super::error::{InputError, Problem};
use super::super::units::LARGEST;
use super::yaml::{self, Node};
use super::{Import, ImportKind, name_of, printable};
use crate::model::{MU0_OVER_4PI, Vector, closest, short_name};
use std::fmt::Write;
use std::path::Path;

const COIL_LIST: &str = "Coil_List";
const SOURCE_LIST: &str = "Source_List";
const WORKSPACE: &str = "Workspace_Dimensions";
/// Half of the workspace where the file does not tell one (m)
const USUAL: f64 = 0.01;

struct Source {
    position: Vector,
    /// In m²
    moment_per_ampere: Vector,
}

/// Whether the text is such a calibration.
pub(crate) fn looks_so(text: &str) -> bool {
    text.lines()
        .any(|line| line.trim_end().strip_prefix(COIL_LIST).is_some_and(|rest| rest.trim_start().starts_with(':')))
}

struct Calibration<'a> {
    file: &'a Path,
    root: Node,
}

pub(crate) fn import(file: &Path, text: &str) -> Result<Import, InputError> {
    let root = yaml::parse(text).map_err(|(line, words)| InputError {
        file: file.into(),
        line: Some(line),
        key: String::new(),
        problem: Problem::Unreadable(words).into(),
    })?;
    let calibration = Calibration { file, root };
    if let Some((line, number)) = calibration.root.number_beyond(LARGEST) {
        let (value, expected) = (short_name(number).into_owned(), "numbers of at most 1e60 in size".into());
        return Err(calibration.error(Some(line), "", Problem::Range { value, expected }));
    }
    let names = calibration.words(&calibration.root, COIL_LIST, "")?;
    let mut coils = Vec::new();
    for name in &names {
        let coil = calibration.entry(&calibration.root, name, "")?;
        let sources = calibration.words(coil, SOURCE_LIST, name)?;
        let source = |source: &String| calibration.source(coil, name, source);
        coils.push((name.clone(), sources.iter().map(source).collect::<Result<Vec<_>, _>>()?));
    }
    let workspace = calibration.workspace()?;
    let system = calibration.root.get("System_Name").and_then(Node::text).unwrap_or("coils").to_owned();
    let count: usize = coils.iter().map(|(_, sources)| sources.len()).sum();
    let mut notes = vec![
        "the rod is none of the file's: put yours in place of the segments at its end".to_owned(),
        "the sources are fictitious: their field holds in the workspace alone, and `clearance = 0` lets rods come near"
            .to_owned(),
    ];
    let lies_inside =
        |source: &Source| (0..3).all(|k| workspace[k][0] < source.position[k] && source.position[k] < workspace[k][1]);
    let inside = coils.iter().flat_map(|(_, sources)| sources).filter(|source| lies_inside(source)).count();
    if inside > 0 {
        notes.push(format!("{inside} sources lie in the workspace, where their field is infinite"));
    }
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write(&mut text, file, &system, &coils, &workspace);
    Ok(Import { kind: ImportKind::Scene, text, summary: format!("{} coils with {count} sources", coils.len()), notes })
}

impl Calibration<'_> {
    fn error(&self, line: Option<usize>, key: &str, problem: Problem) -> InputError {
        InputError { file: self.file.into(), line, key: key.into(), problem: problem.into() }
    }

    fn entry<'n>(&self, node: &'n Node, name: &str, of: &str) -> Result<&'n Node, InputError> {
        node.get(name).ok_or_else(|| {
            let near = closest(name, node.names()).map(|near| format!("; `{near}` is there")).unwrap_or_default();
            let remedy = format!("the file lists it and has no such entry{near}");
            self.error(node.line(), &join(of, name), Problem::Missing { remedy })
        })
    }

    /// A list of names.
    fn words(&self, node: &Node, name: &str, of: &str) -> Result<Vec<String>, InputError> {
        let list = node.get(name);
        let words = list
            .and_then(Node::list)
            .map(|list| list.iter().filter_map(Node::text).map(String::from).collect::<Vec<_>>());
        words.filter(|words| !words.is_empty()).ok_or_else(|| {
            let remedy = "give a list of names, one a line after `- `".into();
            self.error(list.unwrap_or(node).line(), &join(of, name), Problem::Missing { remedy })
        })
    }

    fn source(&self, coil: &Node, of: &str, name: &str) -> Result<Source, InputError> {
        let source = self.entry(coil, name, of)?;
        let key = join(of, name);
        let terms = |name: &str| source.get(name).map_or(Some(Vec::new()), Node::numbers);
        let coefficient = match (terms("A_Coeff").as_deref(), terms("B_Coeff").as_deref()) {
            (Some([]), Some([b])) => *b,
            (a, b) => {
                let count = |terms: Option<&[f64]>| {
                    terms.map_or("no numbers".into(), |terms| format!("{} numbers", terms.len()))
                };
                let value = format!("a source with {} in A_Coeff and {} in B_Coeff", count(a), count(b));
                let expected =
                    "sources of one B_Coeff, which are dipoles: multipoles of higher order are not modelled".into();
                return Err(self.error(source.line(), &key, Problem::Range { value, expected }));
            }
        };
        let vector = |name: &str| -> Result<Vector, InputError> {
            let found = source.get(name);
            let numbers = found.and_then(Node::numbers).and_then(|numbers| Vector::try_from(numbers).ok());
            numbers.ok_or_else(|| {
                let remedy = "give three numbers, one a line after `- `".into();
                self.error(found.unwrap_or(source).line(), &join(&key, name), Problem::Missing { remedy })
            })
        };
        let direction = vector("Source_Direction")?;
        let moment_per_ampere = direction.map(|d| coefficient * d / MU0_OVER_4PI);
        Ok(Source { position: vector("Source_Position")?, moment_per_ampere })
    }

    /// From where to where the calibration holds (m)
    fn workspace(&self) -> Result<[[f64; 2]; 3], InputError> {
        let Some(node) = self.root.get(WORKSPACE) else { return Ok([[-USUAL, USUAL]; 3]) };
        let range = |node: &Node| <[f64; 2]>::try_from(node.numbers()?).ok().filter(|[low, high]| low < high);
        let ranges = node.list().and_then(|list| list.iter().map(range).collect::<Option<Vec<_>>>());
        ranges.and_then(|ranges| ranges.try_into().ok()).ok_or_else(|| {
            let expected = "three pairs of numbers, least and largest along x, y and z".into();
            self.error(node.line(), WORKSPACE, Problem::Range { value: "something else".into(), expected })
        })
    }
}

fn join(of: &str, name: &str) -> String {
    if of.is_empty() { name.into() } else { format!("{of}.{name}") }
}

fn write(
    text: &mut String,
    file: &Path,
    system: &str,
    coils: &[(String, Vec<Source>)],
    workspace: &[[f64; 2]; 3],
) -> std::fmt::Result {
    let middle = workspace.map(|[low, high]| 0.5 * (low + high));
    let [x, y, z] = workspace.map(|[low, high]| format!("{:?} to {:?} mm", 1e3 * low, 1e3 * high));
    writeln!(text, "# Imported from {}: {}.", name_of(file), printable(system))?;
    writeln!(text, "# It holds for x from {x}, y from {y}, z from {z}, in tesla per ampere.")?;
    writeln!(text, "name = \"Rod in calibrated coils\"\n")?;
    let length = (workspace[2][1] - workspace[2][0]).min(USUAL);
    writeln!(text, "[base] # not stated by the file: below the middle of its workspace, rod along world +z")?;
    writeln!(text, "position = [{:?}, {:?}, {:?}]\n", middle[0], middle[1], middle[2] - 0.5 * length)?;
    writeln!(text, "[[coil_array]]\nname = \"coils\"\ncurrent = {:?}", vec![0.0; coils.len()])?;
    writeln!(text, "clearance = 0 # the sources are fictitious")?;
    for (name, sources) in coils {
        writeln!(text, "[[coil_array.coil]] # {}", printable(name))?;
        writeln!(text, "dipoles = [ # B_Coeff times Source_Direction over mu0 / (4 pi)")?;
        for Source { position, moment_per_ampere } in sources {
            writeln!(text, "  {{ position = {position:?}, moment_per_ampere = {moment_per_ampere:?} }},")?;
        }
        writeln!(text, "]")?;
    }
    writeln!(text, "\n# Not stated by the file: a rod to begin with. Put yours here.")?;
    writeln!(text, "[[segment]]\nname = \"wire\"\nkind = \"flexible\"\nlength = {:?}", 0.8 * length)?;
    writeln!(text, "stiffness = {{ bending = \"2e-7 N·m²\", torsion = \"1.5e-7 N·m²\" }}\n")?;
    writeln!(text, "[[segment]]\nname = \"tip\"\nkind = \"rigid\"\nlength = {:?}", 0.2 * length)?;
    writeln!(text, "diameter = \"1 mm\"\nremanence = \"1.4 T\"")
}
