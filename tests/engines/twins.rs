//! The shaders against the CPU engine, file by file: the same functions in the same order, the same equation tags.

use crate::common::root;
use std::collections::BTreeMap;
use std::fs;

const STEMS: [&str; 37] = [
    "algebra",
    "rod/segments",
    "rod/section",
    "rod/step",
    "rod/column",
    "rod/source",
    "rod/trace",
    "rod/base",
    "rod/shoot",
    "equilibrium/path",
    "equilibrium/search",
    "equilibrium/anchors",
    "equilibrium/chord",
    "equilibrium/solve",
    "rod/stability",
    "rod/rows",
    "multiple_shooting/mesh",
    "multiple_shooting/interval",
    "multiple_shooting/drives",
    "multiple_shooting/elimination",
    "multiple_shooting/margin",
    "multiple_shooting/state",
    "multiple_shooting/newton",
    "multiple_shooting/responses",
    "multiple_shooting/path",
    "multiple_shooting/answer",
    "rod/field/space",
    "rod/field/step",
    "rod/field/crossing",
    "rod/field/ends",
    "rod/field/first",
    "rod/field/matrix",
    "rod/field/index",
    "rod/field/parameters",
    "rod/field/pass",
    "equilibrium/field/path",
    "equilibrium/field/answer",
];

/// Functions of one side alone, by stem: name and reason.
struct Exceptions {
    rust_only: &'static [(&'static str, &'static [&'static str], &'static str)],
    wgsl_only: &'static [(&'static str, &'static [&'static str], &'static str)],
    /// Stem, name in Rust, name in WGSL.
    renamed: &'static [(&'static str, &'static str, &'static str)],
}

const EXCEPTIONS: Exceptions = Exceptions {
    rust_only: &[
        ("algebra", &["splat", "select"], "operators of WGSL"),
        ("algebra", &["dot", "cross", "length", "transpose"], "built into WGSL"),
        ("algebra", &["select_matrix"], "masks of lanes"),
        ("algebra", &["adjugate"], "the CPU alone follows curves of equilibria"),
        ("rod/segments", &["under"], "loads of folds follow parameters on the CPU alone"),
        ("rod/source", &["rate_under"], "loads of folds follow parameters on the CPU alone"),
        ("rod/field/space", &["weaken"], "loads of folds follow parameters on the CPU alone"),
        ("rod/field/space", &["all", "by_moment", "by_turn", "cuboid", "unit"], "magnets are exact on the CPU alone"),
        ("rod/field/crossing", &["in_world", "load", "couple"], "loads turn with the rod on the CPU alone"),
        ("rod/section", &["alike"], "crossings of curves are told in double precision alone"),
        ("rod/stability", &["new"], "the workspace"),
        ("rod/stability", &["is_grown"], "the CPU alone solves a row again by nodes for it"),
        ("rod/segments", &["new"], "makes room for segments, which the shader loads where it crosses them"),
        ("rod/step", &["new", "set_tableau", "set_step", "row"], "the workspace; the shader's tableau is compiled in"),
        ("rod/source", &["new", "zero", "add", "add_to", "add_at"], "the plan's data, generated for the shader"),
        ("rod/trace", &["zero", "clear"], "WGSL's own zero value"),
        ("rod/trace", &["add_rows"], "the shader adds to a trace column by column"),
        ("rod/trace", &["set_strains"], "once for all columns; the shader's compiler sees to that"),
        ("rod/shoot", &["with_simd"], "the wrapping of `integrate`"),
        ("rod/shoot", &["forward_source"], "the shader has one source in hand"),
        ("rod/stability", &["by_rotation"], "the shader knows the columns by their number"),
        ("equilibrium/anchors", &["add"], "an operator of WGSL"),
        ("equilibrium/anchors", &["anchor", "grid", "what_is_of_second_order_is_met"], "tests"),
        ("equilibrium/anchors", &["cells_without_good_corners_and_places_outside_are_no_start"], "tests"),
        ("equilibrium/anchors", &["corners_on_two_branches_are_no_start"], "tests"),
        ("equilibrium/chord", &["check_pass"], "`chord_steps` that do not move: the code of a pass is there once"),
        ("equilibrium/chord", &["select"], "operators of WGSL"),
        ("equilibrium/search", &["search_start"], "the search of the shader reads its start itself"),
        ("equilibrium/search", &["unit", "snap"], "samples that end at a fold are solved again on the CPU"),
        ("rod/rows", &["add"], "an operator of WGSL's matrices"),
        ("equilibrium/solve", &["code"], "masks of lanes"),
        (
            "equilibrium/solve",
            &["newton", "write_answer", "write_verdict"],
            "`find`, `judge` and `write_row` in the shader, where three kernels share them",
        ),
        (
            "multiple_shooting/mesh",
            &["is_there", "numbers", "lanes"],
            "lanes share the number of pieces; invocations do not",
        ),
        ("multiple_shooting/mesh", &["new"], "the workspace"),
        ("multiple_shooting/mesh", &["softness"], "the shader compares passes on the same nodes"),
        ("multiple_shooting/mesh", &["lay"], "pieces are kept in Rust, so that other lanes may take them over"),
        ("multiple_shooting/interval", &["select"], "masks of lanes"),
        ("multiple_shooting/elimination", &["new"], "the workspace"),
        (
            "multiple_shooting/elimination",
            &["least_whole", "determinant"],
            "paths that end under a tip moment are followed again on the CPU",
        ),
        ("multiple_shooting/state", &["new", "resolve"], "the workspace; the shader hands its steps on"),
        (
            "multiple_shooting/state",
            &["rest"],
            "a pass of the shader that is for that: the code of a pass is there once",
        ),
        ("multiple_shooting/state", &["cut_sources"], "the shader cuts a source where it loads it"),
        ("multiple_shooting/newton", &["chord_step", "moved_tip"], "the shader compares whole passes"),
        ("multiple_shooting/answer", &["merge"], "masks of lanes"),
        ("multiple_shooting/answer", &["correct"], "the shader compares whole passes"),
        ("rod/field/space", &["new", "inside"], "maps are for the CPU"),
        ("rod/field/space", &["acts"], "passes without columns need no gradient"),
        ("rod/field/step", &["new", "advanced"], "the workspace; the shader's tableau is compiled in"),
        ("rod/field/crossing", &["mean"], "points are summed up once for all columns"),
        ("rod/field/first", &["new"], "the workspace"),
        ("rod/field/crossing", &["begin_columns"], "zeros, which the shader carries along"),
        ("rod/field/index", &["beyond", "compliance"], "what is known of an interval; the shader treats all alike"),
        ("rod/field/matrix", &["add_product"], "the same"),
        ("rod/field/matrix", &["zero", "select", "put"], "blocks, which columns fill as they are"),
        ("rod/field/matrix", &["solve_soon", "block", "by_blocks"], "in lanes a choice of pivots costs most of it"),
        ("rod/field/matrix", &["solve_whole"], "shaders know no wall, whose rows need the determinant"),
        ("equilibrium/field/answer", &["settle"], "shaders know no wall, beside which Newton's method runs twice"),
        ("rod/field/parameters", &["new"], "the workspace"),
        (
            "rod/field/parameters",
            &["map", "at", "acting"],
            "maps are for the CPU; points are summed up once for all columns",
        ),
        ("rod/field/pass", &["numbered"], "the workspace"),
        ("rod/field/pass", &["varying_pass"], "the name of the kernel"),
        ("equilibrium/path", &["narrowed"], "in double precision alone"),
        ("equilibrium/field/path", &["select"], "masks of lanes"),
        ("multiple_shooting/newton", &["end_check"], "loads without energy are followed on the CPU"),
        ("multiple_shooting/path", &["begin_check"], "loads without energy are followed on the CPU"),
        ("equilibrium/field/path", &["departure"], "paths that end under a tip moment are followed again on the CPU"),
        ("equilibrium/field/path", &["narrowed"], "in single precision round-off hides what lies closer"),
        (
            "equilibrium/field/answer",
            &["determinant"],
            "paths that end under a tip moment are followed again on the CPU",
        ),
        ("equilibrium/field/answer", &["moved_tip", "code"], "tips from twice the steps; masks of lanes"),
    ],
    wgsl_only: &[
        ("rod/segments", &["load_rigid"], "segments are loaded where they are crossed"),
        ("rod/column", &["force_of"], "an enumeration in Rust"),
        ("rod/source", &["load_source"], "sources are loaded where segments are crossed"),
        ("equilibrium/solve", &["is_finite"], "a method of lanes"),
        (
            "equilibrium/solve",
            &["find", "moves_on", "judge", "write_row"],
            "`newton`, `write_answer` and `write_verdict` in Rust, which has one kernel",
        ),
        ("equilibrium/solve", &["solve"], "the entry point"),
        ("multiple_shooting/mesh", &["push_interval"], "a list that grows in Rust"),
        ("multiple_shooting/mesh", &["growth"], "the shader does not keep the panels of a segment"),
        ("multiple_shooting/interval", &["source_piece"], "a method of the same name as that of segments in Rust"),
        ("multiple_shooting/elimination", &["s_beyond"], "an index that may be past the end"),
        ("multiple_shooting/elimination", &["solve_threes"], "generic in Rust"),
        ("multiple_shooting/path", &["start_path"], "local variables in Rust; the shader's outlast a dispatch"),
        (
            "multiple_shooting/responses",
            &["start_responses", "load_responses", "follow_responses"],
            "lists of all nodes in Rust",
        ),
        ("multiple_shooting/responses", &["of_response"], "the shader collects the traces of responses themselves"),
        ("multiple_shooting/answer", &["node_steps"], "an array that the shader reads by its place"),
        ("multiple_shooting/answer", &["lose", "finish_rows"], "what ends a sample, in whichever turn"),
        ("multiple_shooting/answer", &["advance"], "the entry point"),
        ("rod/field/space", &["field_vector"], "a method of programs"),
        ("rod/field/crossing", &["point"], "a list in Rust"),
        ("rod/field/matrix", &["product", "squared_norm", "row_of", "without"], "arrays in Rust"),
        ("rod/field/index", &["rows_of", "symmetric"], "arrays in Rust"),
        (
            "rod/field/parameters",
            &["load_segment_source", "slot_change"],
            "sources are read where segments are crossed",
        ),
        ("rod/field/pass", &["take_columns", "keep_columns"], "lists in Rust; the shader has one three in hand"),
        ("equilibrium/field/path", &["sum", "newton_step"], "written out in Rust"),
        ("equilibrium/field/path", &["start_path"], "local variables in Rust; the shader's outlast a dispatch"),
        ("equilibrium/field/answer", &["balance"], "a loop in Rust, a turn each here"),
    ],
    renamed: &[
        ("algebra", "zero", "zero_matrix"),
        ("rod/segments", "length", "rod_length"),
        ("rod/step", "velocity", "stage_velocity"),
        ("rod/column", "moment", "columns_moment"),
        ("rod/source", "load", "load_sources"),
        ("rod/source", "force", "source_force"),
        ("rod/source", "bend", "source_bend"),
        ("rod/source", "shear", "source_shear"),
        ("rod/source", "couple", "source_couple"),
        ("rod/source", "lengthen", "source_lengthen"),
        ("rod/source", "cross_rigid", "source_cross_rigid"),
        ("rod/shoot", "integrate", "shoot"),
        ("equilibrium/anchors", "predict", "predict_within"),
        ("rod/rows", "new", "new_responses"),
        ("multiple_shooting/interval", "new", "new_node"),
        ("multiple_shooting/elimination", "solve", "solve_changes"),
        ("multiple_shooting/state", "pass", "pass_nodes"),
        ("multiple_shooting/state", "start_columns", "start_node_columns"),
        ("multiple_shooting/responses", "write_forward_rows", "write_driven_rows"),
        ("rod/field/space", "B", "dipole_B"),
        ("rod/field/space", "G", "dipole_G"),
        ("rod/field/space", "T3", "dipole_T3"),
        ("rod/field/space", "load", "load_space"),
        ("rod/field/crossing", "dipole", "rigid_dipole"),
        ("rod/field/crossing", "cross", "cross_segment"),
        ("rod/field/first", "load", "load_first"),
        ("rod/field/first", "moved", "first_moved"),
        ("rod/field/matrix", "identity", "identity6"),
        ("rod/field/index", "index", "stability_index"),
        ("rod/field/parameters", "load", "load_parameters"),
        ("rod/field/parameters", "field", "parameters_field"),
    ],
};

/// A function's name and the equation tags on its lines, in order.
type Function = (String, Vec<String>);

/// Every function of a source, in order, with the tags at the ends of its lines of code.
fn functions(text: &str) -> Vec<Function> {
    let mut found: Vec<Function> = Vec::new();
    for line in text.lines().map(str::trim_start).filter(|line| !line.starts_with("//")) {
        let words = line.strip_prefix("pub ").or(line.strip_prefix("pub(crate) ")).unwrap_or(line);
        if let Some(rest) = words.strip_prefix("fn ") {
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default();
            // The body of a function that is compiled apart.
            if name.strip_suffix("_apart").is_some_and(|of| found.last().is_some_and(|(last, _)| last == of)) {
                continue;
            }
            // Functions of a tableau are emitted for each.
            found.push((name.strip_suffix("_r").unwrap_or(name).into(), Vec::new()));
        }
        if let (true, Some((_, tags))) = (is_tagged(line), found.last_mut()) {
            tags.push(comment(line).into());
        }
    }
    found
}

/// What stands behind a line of code.
fn comment(line: &str) -> &str {
    line.rsplit_once("// ").filter(|(code, _)| !code.trim().is_empty()).map_or("", |(_, comment)| comment.trim())
}

fn is_tagged(line: &str) -> bool {
    let tag = comment(line);
    tag.len() == 2 && tag.starts_with(['R', 'J', 'N']) && tag.ends_with(|c: char| c.is_ascii_digit())
}

/// What differs between the twins of a stem.
fn differences(stem: &str, rust: &str, wgsl: &str) -> Vec<String> {
    let excepted = |list: &[(&str, &[&str], &str)], name: &str| {
        list.iter().any(|(at, names, _)| *at == stem && names.contains(&name))
    };
    let renamed = |name: String| {
        EXCEPTIONS
            .renamed
            .iter()
            .find(|(at, from, _)| *at == stem && *from == name)
            .map_or(name, |(_, _, to)| (*to).into())
    };
    let rust: Vec<Function> = functions(rust)
        .into_iter()
        .filter(|(name, _)| {
            EXCEPTIONS.renamed.iter().any(|(at, from, _)| *at == stem && from == name)
                || !excepted(EXCEPTIONS.rust_only, name)
        })
        .map(|(name, tags)| (renamed(name), tags))
        .collect();
    let wgsl: Vec<Function> =
        functions(wgsl).into_iter().filter(|(name, _)| !excepted(EXCEPTIONS.wgsl_only, name)).collect();
    let names = |list: &[Function]| {
        let mut names = list.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
        // Methods of two types that say the same of both.
        names.dedup();
        names
    };
    let mut found = Vec::new();
    if names(&rust) != names(&wgsl) {
        found.push(format!("{stem}: functions\n  Rust {:?}\n  WGSL {:?}", names(&rust), names(&wgsl)));
    }
    let wgsl: BTreeMap<String, Vec<String>> = wgsl.into_iter().collect();
    for (name, tags) in rust {
        match wgsl.get(&name) {
            Some(other) if *other != tags => found.push(format!("{stem}: {name}: Rust {tags:?}, WGSL {other:?}")),
            _ => {}
        }
    }
    found
}

fn read(path: &str) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Stems whose Rust side stands in two files, in this order.
const PARTS_IN_RUST: [(&str, [&str; 2]); 4] = [
    ("rod/column", ["rod/columns", "rod/column"]),
    ("rod/stability", ["rod/station", "rod/stability"]),
    ("rod/field/crossing", ["rod/field/crossing", "rod/field/crossing_columns"]),
    ("equilibrium/field/path", ["equilibrium/field/base_load", "equilibrium/field/path"]),
];

/// Stems whose shader stands in two files, in this order.
const PARTS_IN_WGSL: [(&str, [&str; 2]); 1] = [("equilibrium/solve", ["equilibrium/solve", "equilibrium"])];

fn twins(stem: &str) -> (String, String) {
    let whole = |parts: &[(&str, [&str; 2])], path: &dyn Fn(&str) -> String| {
        let parts = parts.iter().find(|(of, _)| *of == stem);
        parts.map_or_else(|| read(&path(stem)), |(_, parts)| parts.map(|part| read(&path(part))).concat())
    };
    (
        whole(&PARTS_IN_RUST, &|stem| format!("crates/core/src/cpu/{stem}.rs")),
        whole(&PARTS_IN_WGSL, &|stem| format!("shaders/{stem}.wgsl")),
    )
}

#[test]
fn twins_agree() {
    let found: Vec<String> = STEMS
        .iter()
        .flat_map(|stem| {
            let (rust, wgsl) = twins(stem);
            differences(stem, &rust, &wgsl)
        })
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn every_stem_has_functions_and_the_physics_has_tags() {
    let mut tags: Vec<String> = Vec::new();
    for stem in STEMS {
        let (_, wgsl) = twins(stem);
        let found = functions(&wgsl);
        assert!(found.len() > usize::from(!["rod/step", "multiple_shooting/drives"].contains(&stem)), "{stem}");
        tags.extend(found.into_iter().flat_map(|(_, tags)| tags));
    }
    for tag in ["R1", "R2", "R3", "R4", "R5", "R6", "J1", "J2", "J3", "J4", "J5", "N2", "N3"] {
        assert!(tags.iter().any(|found| found == tag), "{tag}");
    }
}

#[test]
fn every_exception_is_needed() {
    for (list, suffix) in [(EXCEPTIONS.rust_only, "rs"), (EXCEPTIONS.wgsl_only, "wgsl")] {
        for (stem, names, _) in list {
            let (rust, wgsl) = twins(stem);
            let text = if suffix == "rs" { rust } else { wgsl };
            let found = functions(&text);
            for name in *names {
                assert!(found.iter().any(|(other, _)| other == name), "{stem}.{suffix} has no {name}");
            }
        }
    }
}

#[test]
fn a_change_on_one_side_is_noticed() {
    for stem in STEMS {
        let (rust, wgsl) = twins(stem);
        for (at, (name, tags)) in functions(&wgsl).iter().enumerate() {
            if EXCEPTIONS.wgsl_only.iter().any(|(s, names, _)| *s == stem && names.contains(&name.as_str())) {
                continue;
            }
            let renamed = wgsl.replace(&format!("fn {name}"), &format!("fn other_{name}"));
            assert!(!differences(stem, &rust, &renamed).is_empty(), "{stem} {name} {at}");
            assert!(tags.iter().all(|tag| tag.len() == 2), "{stem} {name}");
        }
        for (at, line) in wgsl.lines().enumerate().filter(|(_, line)| is_tagged(line)) {
            let retag = |(i, other): (usize, &str)| if i == at { format!("{other}9") } else { other.to_owned() };
            let retagged: Vec<String> = wgsl.lines().enumerate().map(retag).collect();
            assert!(!differences(stem, &rust, &retagged.join("\n")).is_empty(), "{stem} {line}");
        }
    }
}

/// Settings of the path have one home, `model::tolerances`.
#[test]
fn numbers_of_the_path_come_from_the_host() {
    let wgsl = read("shaders/equilibrium/solve.wgsl");
    for line in wgsl.lines().filter(|line| line.starts_with("const ") && line.contains(": f32")) {
        assert!(line.ends_with("//@spec"), "{line}");
    }
    let rust = read("crates/core/src/cpu/equilibrium/solve.rs");
    assert!(!rust.lines().any(|line| line.trim_start().trim_start_matches("pub ").starts_with("const ")));
}
