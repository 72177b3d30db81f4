//! Every reader of the library on bytes of any kind: none may panic, hang, or take memory without bound.

use rodsweep::input::{
    ImportOptions, import, parse_scene, parse_trajectory, read_input_table, read_observed_tips, read_shapes,
    read_trajectory, write_scene,
};
use rodsweep::model::Scene;
use rodsweep::results::{Manifest, Results};
use rodsweep::spec::SweepSpec;
use rodsweep::table::{Column, Table, Values, csv, mat, npz, parquet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// One reader: its name, what it does with bytes, and files to begin from.
pub struct Reader {
    /// Of the fuzz target.
    pub name: &'static str,
    /// Reads some bytes.
    pub read: fn(&Place, &[u8]),
    /// Files of the repository that it reads, and others.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

/// Every reader.
pub const READERS: [Reader; 15] = [
    Reader { name: "scene", read: scene, seeds: || shipped(&["sweeps/scenes"], "toml") },
    Reader { name: "sweep", read: sweep, seeds: || shipped(&["sweeps", "sweeps/bench"], "toml") },
    Reader { name: "trajectory", read: trajectory, seeds: || shipped(&["sweeps/trajectories"], "toml") },
    Reader { name: "shape", read: shape, seeds: shapes },
    Reader {
        name: "csv",
        read: read_csv,
        seeds: || vec![csv::encode(&table()), b"coil.current.x\n\"1 mA\"\n2\n".into()],
    },
    Reader { name: "parquet", read: read_parquet, seeds: parquet_files },
    Reader { name: "npz", read: read_npz, seeds: || vec![npz::encode(&table()).unwrap_or_default()] },
    Reader { name: "mat", read: read_mat, seeds: || shipped(&["tests/data/matlab"], "mat") },
    Reader { name: "import", read: read_import, seeds: || shipped(&["tests/data/import"], "") },
    Reader { name: "run", read: run, seeds: || vec![whole_run()[0].1.clone()] },
    Reader { name: "manifest", read: manifest, seeds: || vec![whole_run()[2].1.clone()] },
    Reader { name: "part", read: part, seeds: parts },
    Reader { name: "verdict", read: verdict, seeds: verdicts },
    Reader { name: "names", read: names, seeds: || vec![HOSTILE.into(), b"sweep\ntouch x\n#.toml".into()] },
    Reader { name: "map", read: map, seeds: maps },
];

/// What terminals, shells and readers of XML obey.
const HOSTILE: &[u8] = "\u{1b}[31mred\u{7} \u{202e}\u{2028}\u{1}<b>&\"'$(x)`y`;# %j \\".as_bytes();

/// A folder for files that readers open by name.
pub struct Place(tempfile::TempDir);

impl Place {
    /// A new folder, in memory where the system has such.
    pub fn new() -> Place {
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        Place(folder.expect("a folder"))
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).expect("a file");
        path
    }
}

fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().find(|folder| folder.join("sweeps").is_dir()).unwrap_or(here).to_owned()
}

/// Files of some folders, by extension, none longer than a fuzzer likes.
fn shipped(folders: &[&str], extension: &str) -> Vec<Vec<u8>> {
    let files = folders.iter().flat_map(|folder| fs::read_dir(root().join(folder)).into_iter().flatten().flatten());
    let wanted =
        |path: &PathBuf| path.is_file() && (extension.is_empty() || path.extension().is_some_and(|e| e == extension));
    let mut paths: Vec<PathBuf> = files.map(|entry| entry.path()).filter(wanted).collect();
    paths.sort();
    let texts = paths.iter().filter_map(|path| fs::read(path).ok());
    texts.filter(|bytes| bytes.len() < 1 << 16).collect()
}

fn a_scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| rodsweep::input::read_scene(&root().join("sweeps/scenes/p6.toml")).expect("a scene"))
}

fn table() -> Table {
    let rows = 40;
    Table::new(vec![
        Column::new("sample", "", (0..rows).collect::<Vec<u64>>()),
        Column::new("coil.current.x", "A", (0..rows).map(|k| k as f64 / 7.0).collect::<Vec<f64>>()),
        Column::new("coil.current.y", "A", (0..rows).map(|k| k as f32 / 3.0).collect::<Vec<f32>>()),
        Column::new("stable", "", Values::Flag((0..rows).map(|k| (k % 3 > 0).then_some(k % 2 == 0)).collect())),
        Column::new("note", "", (0..rows).map(|k| "a,\"é".repeat(k as usize % 3)).collect::<Vec<String>>()),
    ])
}

fn parquet_files() -> Vec<Vec<u8>> {
    let whole = table();
    let numbers = Table::new(whole.columns[1..3].to_vec());
    let encoded = |table: &Table| parquet::encode(table, &[("key", "value".into())]).unwrap_or_default();
    // Its page says that a list of 124 million entries is to be skipped.
    let found = include_bytes!("../../data/found/parquet-skipped-list").to_vec();
    vec![encoded(&whole), encoded(&numbers), encoded(&Table::new(numbers.columns[..1].to_vec())), found]
}

fn parts() -> Vec<Vec<u8>> {
    // Its footer says that a list of 131 million flags is to be skipped.
    let found = include_bytes!("../../data/found/part-list-of-flags").to_vec();
    vec![whole_run()[3].1.clone(), found]
}

fn shapes() -> Vec<Vec<u8>> {
    let text = "s,x,y,z,coil.current.x\n10 mm,1 mm,0,9 mm,0.1\n,2 mm,0,80 mm,0.1\n0.01,0,0,0.01,0\n";
    vec![text.into(), b"x,y,z\n0,0,0.1\n".into(), b"point,x,y,z,tx,ty,tz\n0,0,0,1,0,0,1\n".into()]
}

fn text(bytes: &[u8]) -> &str {
    let sound = std::str::from_utf8(bytes).map_or_else(|error| error.valid_up_to(), |text| text.len());
    std::str::from_utf8(&bytes[..sound]).unwrap_or_default()
}

fn scene(_: &Place, bytes: &[u8]) {
    if let Ok(scene) = parse_scene(Path::new("scene.toml"), text(bytes)) {
        let again = parse_scene(Path::new("again.toml"), &write_scene(&scene));
        assert!(again.is_ok(), "a scene that was read is written so that it is not: {again:?}");
    }
}

fn sweep(_: &Place, bytes: &[u8]) {
    let text = text(bytes);
    // Files that the text names are none of the fuzzer's business.
    let scenes: Vec<&str> = text.split('"').filter(|word| word.ends_with(".toml")).collect();
    let built_in: Vec<(&str, &str)> =
        scenes.iter().map(|path| (*path, include_str!("../../../sweeps/scenes/p6.toml"))).collect();
    if let Ok(spec) = SweepSpec::parse_with(Path::new("/nowhere/sweep.toml"), text, &built_in) {
        let sampler = spec.sampler();
        let mut row = vec![0.0; sampler.value_count()];
        [0, spec.sample_count / 2, spec.sample_count - 1].iter().for_each(|index| sampler.values(*index, &mut row));
        let _ = spec.to_toml();
    }
}

fn trajectory(_: &Place, bytes: &[u8]) {
    let _ = parse_trajectory(Path::new("/nowhere/trajectory.toml"), text(bytes), a_scene());
}

fn shape(place: &Place, bytes: &[u8]) {
    let file = place.file("shapes.csv", bytes);
    let _ = read_shapes(&file, a_scene());
    let _ = read_observed_tips(&file, 10);
    let _ = read_trajectory(&file, a_scene());
}

fn read_csv(place: &Place, bytes: &[u8]) {
    let like = table();
    let _ = csv::decode(text(bytes), &[], &like);
    let _ = csv::decode(text(bytes), &["note", "sample"], &like);
    let _ = read_input_table(&place.file("inputs.csv", bytes), a_scene());
}

fn read_parquet(place: &Place, bytes: &[u8]) {
    let _ = parquet::footer(bytes);
    let file = place.file("inputs.parquet", bytes);
    let _ = read_input_table(&file, a_scene());
    if let Ok(table) = parquet::read(&file, &[]) {
        let rows = table.row_count();
        assert!(table.columns.iter().all(|column| column.values.len() == rows), "columns differ in length");
    }
}

fn read_npz(_: &Place, bytes: &[u8]) {
    if let Ok(table) = npz::decode(bytes, &[], &table()) {
        let rows = table.row_count();
        assert!(table.columns.iter().all(|column| column.values.len() == rows), "columns differ in length");
    }
}

fn read_mat(_: &Place, bytes: &[u8]) {
    let Ok(names) = mat::array_names(bytes) else { return };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    for array in mat::read_arrays(bytes, &names, 1 << 16).unwrap_or_default() {
        assert_eq!(array.values.len(), array.shape.iter().product::<usize>(), "numbers do not fit their shape");
    }
}

fn read_import(place: &Place, bytes: &[u8]) {
    let file = place.file("import.txt", bytes);
    let spatial = ImportOptions { spatial: Some(file.clone()), ..ImportOptions::default() };
    for options in [ImportOptions::default(), spatial] {
        let _ = import(&file, &options);
    }
}

/// Files of a small run: `run.json`, `sweep.toml`, `manifest.json`, a part.
fn whole_run() -> &'static [(&'static str, Vec<u8>)] {
    static FILES: OnceLock<Vec<(&'static str, Vec<u8>)>> = OnceLock::new();
    FILES.get_or_init(|| {
        use rodsweep::backend::BackendKind;
        use rodsweep::engines::EngineRequest;
        use rodsweep::sweep::{ResultDirectory, SweepJob};
        let text = "scene = \"scenes/p6.toml\"\n[sampling]\nmethod = \"uniform\"\nsamples = 20\n\
             [[axis]]\nparameter = \"coil.current.x\"\nfrom = 0\nto = \"0.1 A\"\n[solver]\nsteps = 8\n\
             [output]\nquantities = [\"tip_position\", \"stability\"]\nderivatives = []\nformat = \"parquet\"\n";
        let spec = SweepSpec::parse(&root().join("sweeps/fuzz.toml"), text).expect("a sweep");
        let place = Place::new();
        let job = SweepJob::new(spec).engine(EngineRequest::of(BackendKind::Cpu)).spot_check(None);
        job.run(&mut ResultDirectory::new(place.0.path())).expect("a run");
        let names = ["run.json", "sweep.toml", "manifest.json", "part-0000000000.parquet"];
        names.map(|name| (name, fs::read(place.0.path().join(name)).expect("a file"))).into()
    })
}

/// A run of which one file is other bytes.
fn run_with(place: &Place, name: &str, bytes: &[u8]) -> PathBuf {
    let folder = place.0.path().join("run");
    fs::create_dir_all(&folder).expect("a folder");
    for (other, whole) in whole_run() {
        fs::write(folder.join(other), if *other == name { bytes } else { whole }).expect("a file");
    }
    folder
}

fn read_results(folder: PathBuf) {
    let Ok(results) = Results::open(folder) else { return };
    let _ = results.status();
    let _ = results.read(&[]);
    let _ = results.tips();
}

fn run(place: &Place, bytes: &[u8]) {
    read_results(run_with(place, "run.json", bytes));
}

fn manifest(place: &Place, bytes: &[u8]) {
    if let Ok(manifest) = Manifest::read(&run_with(place, "manifest.json", bytes)) {
        let _ = serde_json::to_string(&manifest);
    }
}

fn part(place: &Place, bytes: &[u8]) {
    read_results(run_with(place, "part-0000000000.parquet", bytes));
}

fn verdicts() -> Vec<Vec<u8>> {
    let doubt = r#"{"kind":"rows-elsewhere","samples":2,"of":9,"how_far":0.1,"statuses":{"ok":2},"inputs":[{"name":
        "coil.current.x","unit":"A","from":-1,"to":null}],"worst":3,"worst_values":[["coil.current.x",0.1]],"seen":[3,5]}"#;
    let text = format!(
        r#"{{"sound":false,"checked":9,"samples":20,"usable":20,"failures":null,"doubts":[{doubt},{}]}}"#,
        doubt.replace("rows-elsewhere", "tolerance-missed")
    );
    vec![text.into(), br#"{"sound":true,"checked":0,"samples":0,"usable":0,"failures":null,"doubts":[]}"#.into()]
}

/// A verdict of a shard, as it lies beside the results.
fn verdict(place: &Place, bytes: &[u8]) {
    let folder = run_with(place, "", &[]);
    fs::create_dir_all(folder.join("verdicts")).expect("a folder");
    fs::write(folder.join("verdicts/1-of-2.json"), bytes).expect("a file");
    if let Ok(results) = Results::open(folder) {
        let told = results.distrust();
        let sound = results.verdict().map(|verdict| verdict.is_none_or(|verdict| verdict.sound));
        assert_eq!(matches!(told, Ok(None)), matches!(sound, Ok(true)), "what is not sound says why");
    }
}

/// Names on their way to a terminal, a page and a shell.
fn names(_: &Place, bytes: &[u8]) {
    use rodsweep::text::{line, quoted, shell_word, terminal, xml};
    let text = text(bytes);
    assert!(terminal(text).chars().all(|c| !c.is_control() || c == '\n' || c == '\t'));
    assert!(!line(text).contains(['\n', '\t', '\r']));
    assert!(!xml(text).contains(['<', '>', '"', '\'', '\u{1}', '\u{1b}']));
    for word in [quoted(text), shell_word(text)] {
        // Outside quotes nothing is left that a shell obeys.
        let outside: String = word.replace(r"'\''", "").split('\'').step_by(2).collect();
        assert!(outside.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c)), "{word}");
    }
}

fn maps() -> Vec<Vec<u8>> {
    let mut text = String::from("x,y,z,Bx,By,Bz\n");
    for node in 0..64 {
        let [i, j, k] = [node % 4, node / 4 % 4, node / 16].map(|n| 0.01 * f64::from(n));
        text += &format!("{i},{j},{k},0,{},1\n", 1.0 - i);
    }
    vec![text.replace("Bx,By,Bz", "potential,By,Bz").into(), text.into()]
}

/// A field map of a scene.
fn map(place: &Place, bytes: &[u8]) {
    place.file("map.csv", bytes);
    let scene = "[[field_map]]\nname = \"map\"\nfile = \"map.csv\"\n[[segment]]\nname = \"tube\"\nkind = \"flexible\"\n\
                 length = 0.1\nstiffness = { bending = 1e-5, torsion = 1e-5 }\n";
    let _ = parse_scene(&place.0.path().join("scene.toml"), scene);
}
