//! The WGSL preprocessor: directives, and errors at their original lines.

use rodsweep::backend::Precision;
use rodsweep::gpu::shader::{Piece, Source, Specialisation, Value, check, emit};

fn piece(name: &'static str, text: &'static str) -> Piece {
    Piece { name: name.into(), text: text.into() }
}

fn specialisation() -> Specialisation {
    let mut s = Specialisation::default();
    s.term("LOAD", true);
    s.term("FORCE", false);
    s.term("A[1]", true);
    s.term("A[0]", false);
    s.constant("COUNT", Value::U32(3));
    s.constant("WEIGHTS", Value::float_array([0.1, 1e-9, 1.0 / 3.0]));
    s
}

fn emitted(text: &'static str) -> Source {
    emit(&[piece("a.wgsl", text)], &specialisation()).unwrap()
}

fn error(text: &'static str) -> String {
    emit(&[piece("a.wgsl", text)], &specialisation()).unwrap_err().to_string()
}

#[test]
fn without_directives_a_source_is_unchanged() {
    let text = "fn f() -> f32 {\n    return 1.0; // R1\n}\n";
    assert_eq!(emitted(text).text, text);
}

#[test]
fn blocks_are_kept_or_dropped_by_their_term() {
    let text = "a\n//@if LOAD\nb\n//@else\nc\n//@end\n//@if FORCE\nd\n//@else\ne\n//@end\n//@if !FORCE\nf\n//@end\n";
    assert_eq!(emitted(text).text, "a\nb\ne\nf\n");
}

#[test]
fn blocks_nest() {
    let text = "//@if LOAD\n//@if FORCE\na\n//@else\nb\n//@end\nc\n//@else\n//@if LOAD\nd\n//@end\n//@end\n";
    assert_eq!(emitted(text).text, "b\nc\n");
}

#[test]
fn constants_take_their_specialised_value_and_type() {
    let text = "const COUNT: u32 = 1u; //@spec\nconst WEIGHTS: array<f32, 1> = array<f32, 1>(0.0); //@spec\n";
    let expected = "const COUNT: u32 = 3u;\n\
                    const WEIGHTS: array<f32, 3> = array<f32, 3>(0.1f, 1e-9f, 0.33333334f);\n";
    assert_eq!(emitted(text).text, expected);
}

#[test]
fn floats_survive_to_the_last_bit() {
    for value in [0.1, 1.0 / 3.0, 3.0e38, 1.2e-38, -43.489_883, 16_777_217.0] {
        let text = Value::Float(value).wgsl(Precision::F32);
        let single = value as f32;
        assert_eq!(text.trim_end_matches('f').parse::<f32>().unwrap().to_bits(), single.to_bits(), "{text}");
        let text = Value::Float(value).wgsl(Precision::F64);
        assert_eq!(text.trim_end_matches("lf").parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
    }
}

#[test]
fn in_f64_every_float_is_one_of_f64() {
    let text = "const COUNT: u32 = 1u; //@spec\nconst WEIGHTS: array<f32, 1> = array<f32, 1>(0.0); //@spec\n\
                fn f(a: vec3<f32>, i: u32) -> f32 { return a.x * 1.5 + 1e-3 * 2.5e6 + f32(i + 2u) - 0.; } // f32 1.0\n";
    let expected = "const COUNT: u32 = 3u;\n\
                    const WEIGHTS: array<f64, 3> = array<f64, 3>(0.1lf, 1e-9lf, 0.3333333333333333lf);\n\
                    fn f(a: vec3<f64>, i: u32) -> f64 { return a.x * 1.5lf + 1e-3lf * 2.5e6lf + f64(i + 2u) - 0.lf; } // f32 1.0\n";
    let specialisation = Specialisation { precision: Precision::F64, ..specialisation() };
    let source = emit(&[piece("a.wgsl", text)], &specialisation).unwrap();
    assert_eq!(source.text, expected);
    check(&source).unwrap();
}

#[test]
fn loops_unroll_with_literals_and_pasted_names() {
    let text = "for (var i = 0u; i < 2u; i++) { //@unroll\nlet x_i = length_i(i) + p.i + xi; // i stays\n} //@end\n";
    let expected = "{ // i = 0\nlet x_0 = length_0(0u) + p.i + xi; // i stays\n}\n\
                    { // i = 1\nlet x_1 = length_1(1u) + p.i + xi; // i stays\n}\n";
    assert_eq!(emitted(text).text, expected);
}

#[test]
fn loops_nest_with_bounds_from_constants_and_outer_variables() {
    let text = "for (var i = 1; i < COUNT; i++) { //@unroll\nfor (var j: i32 = 0; j < i; j++) { //@unroll\n\
                a_i_j[i][j];\n} //@end\n} //@end\n";
    let body: Vec<_> = emitted(text).text.lines().filter(|line| line.starts_with('a')).map(str::to_owned).collect();
    assert_eq!(body, ["a_1_0[1][0];", "a_2_0[2][0];", "a_2_1[2][1];"]);
}

#[test]
fn declarations_repeat_without_braces() {
    let text = "//@repeat r COUNT\nfn f_r() {\n//@if A[r]\ng(r);\n//@end\n}\n//@end\n";
    let mut s = specialisation();
    s.constant("COUNT", Value::U32(2));
    let source = emit(&[piece("a.wgsl", text)], &s).unwrap();
    assert_eq!(source.text, "fn f_0() {\n}\nfn f_1() {\ng(1u);\n}\n");
    assert_eq!(source.origin(4), Some(("a.wgsl", 4)));
    assert!(error("//@repeat r\n//@end\n").contains("a name and a count"));
    assert!(error("//@repeat r LAOD\n//@end\n").contains("a name and a count"));
}

#[test]
fn terms_may_depend_on_the_loop() {
    let text = "for (var i = 0u; i < 2u; i++) { //@unroll\n//@if A[i]\nkept(i);\n//@end\n} //@end\n";
    assert_eq!(emitted(text).text, "{ // i = 0\n}\n{ // i = 1\nkept(1u);\n}\n");
}

#[test]
fn an_empty_loop_leaves_nothing() {
    assert_eq!(emitted("for (var i = 2u; i < 2u; i++) { //@unroll\na\n} //@end\n").text, "");
}

#[test]
fn lines_know_where_they_came_from() {
    let first = piece("a.wgsl", "a\n//@if FORCE\nb\n//@end\nc\n");
    let second = piece("b.wgsl", "\nfor (var i = 0u; i < 2u; i++) { //@unroll\nd\n} //@end\n");
    let source = emit(&[first, second], &specialisation()).unwrap();
    let origins: Vec<_> = (1..=source.text.lines().count()).map(|line| source.origin(line).unwrap()).collect();
    let b = "b.wgsl";
    let expected = [("a.wgsl", 1), ("a.wgsl", 5), (b, 1), (b, 2), (b, 3), (b, 4), (b, 2), (b, 3), (b, 4)];
    assert_eq!(origins, expected);
    assert_eq!(source.origin(0), None);
    assert_eq!(source.origin(10), None);
}

#[test]
fn mistakes_in_directives_are_errors() {
    assert_eq!(error("a\n//@if LAOD\n//@end\n"), "a.wgsl:2: no term is named `LAOD`");
    assert_eq!(error("//@if !LAOD\n//@end\n"), "a.wgsl:1: no term is named `!LAOD`");
    assert_eq!(error("//@if LOAD\n"), "a.wgsl:1: this block has no `//@end`");
    assert_eq!(error("}\n//@end\n"), "a.wgsl:2: `//@end` stands outside a block");
    assert_eq!(error("//@else\n"), "a.wgsl:1: `//@else` stands outside a block");
    assert_eq!(error("const CUONT: u32 = 1u; //@spec\n"), "a.wgsl:1: no constant is named `CUONT`");
    assert!(error("let COUNT = 1u; //@spec\n").contains("needs `const NAME"));
    assert!(error("for (var i = 0u; i < n; i++) { //@unroll\n} //@end\n").contains("A and B literals"));
    assert!(error("for (var i = 0u; i < 2u; i += 2u) { //@unroll\n} //@end\n").contains("A and B literals"));
    assert_eq!(error("a //@uroll\n"), "a.wgsl:1: no directive is named `uroll`");
}

#[test]
fn a_syntax_error_is_reported_at_its_original_line() {
    let first = piece("a.wgsl", "//@if LOAD\nconst COUNT: u32 = 1u; //@spec\n//@end\n");
    let second = piece("b.wgsl", "fn f() {\n    let x = ;\n}\n");
    let error = check(&emit(&[first, second], &specialisation()).unwrap()).unwrap_err();
    assert_eq!((error.piece.as_str(), error.line), ("b.wgsl", 2), "{error}");
}

#[test]
fn an_unknown_name_in_an_unrolled_body_is_reported_at_its_original_line() {
    let text = "fn f() -> f32 {\n    var sum = 0.0;\n    for (var i = 0u; i < 3u; i++) { //@unroll\n        \
                sum += WIEGHTS[i];\n    } //@end\n    return sum;\n}\n";
    let error = check(&emitted(text)).unwrap_err();
    assert_eq!((error.piece.as_str(), error.line), ("a.wgsl", 4), "{error}");
    assert!(error.message.contains("WIEGHTS"), "{error}");
}

#[test]
fn a_type_error_is_reported_at_its_original_line() {
    let text = "//@if FORCE\n\n\n//@end\nfn f(a: vec3<f32>) -> f32 {\n\n    return a * 2.0;\n}\n";
    let error = check(&emitted(text)).unwrap_err();
    assert_eq!((error.piece.as_str(), error.line), ("a.wgsl", 7), "{error}");
}

#[test]
fn an_unrolled_tableau_is_valid() {
    let text = "const WEIGHTS: array<f32, 1> = array<f32, 1>(0.0); //@spec\n\
                fn f(k: vec3<f32>) -> vec3<f32> {\n    var sum = vec3<f32>();\n    \
                for (var i = 0u; i < COUNT; i++) { //@unroll\n    let k_i = WEIGHTS[i] * k;\n    sum += k_i;\n    \
                } //@end\n    return sum;\n}\n";
    check(&emitted(text)).unwrap();
}
