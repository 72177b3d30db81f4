//! Forces inside of the rod in scene files: their places, what is refused and with which remedy, what is written.

use rodsweep::input::{InputError, assign, parse_scene, write_scene};
use rodsweep::model::{LoadPlace, Parameter, Scene};

const SEGMENTS: &str = "[[segment]]
name = \"tube\"
kind = \"flexible\"
length = \"60 mm\"
stiffness = { bending = 2e-5, torsion = 1.5e-5 }
[[segment]]
name = \"ring\"
kind = \"rigid\"
length = \"4 mm\"
[[segment]]
name = \"end\"
kind = \"flexible\"
length = \"20 mm\"
stiffness = { bending = 1e-5, torsion = 8e-6 }
";

fn read(loads: &str) -> Result<Scene, InputError> {
    parse_scene("scene.toml".as_ref(), &format!("{loads}\n{SEGMENTS}"))
}

fn good(loads: &str) -> Scene {
    read(loads).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn places_are_found() {
    let cases = [
        ("at = \"20 mm\"\nforce = [0, 1, 0]", 0, LoadPlace::At(0.02)),
        ("at = \"60 mm\"\nforce = [0, 1, 0]", 0, LoadPlace::At(0.06)),
        ("at = 0\nforce = [0, 1, 0]", 0, LoadPlace::At(0.0)),
        ("segment = \"end\"\nat = \"5 mm\"\nforce = [0, 1, 0]", 2, LoadPlace::At(0.005)),
        ("segment = \"ring\"\nforce = [0, 1, 0]\nframe = \"world\"", 1, LoadPlace::Middle),
        ("segment = \"ring\"\nforce_per_length = [0, 1, 0]", 1, LoadPlace::Along),
        ("segment = \"tube\"\nforce_per_length = [0, \"2 N/m\", 0]", 0, LoadPlace::Along),
    ];
    for (text, segment, place) in cases {
        let scene = good(&format!("[[load]]\nname = \"push\"\n{text}"));
        let force = &scene.inner_loads[0];
        assert_eq!((force.segment, force.place), (segment, place), "{text}");
        assert_eq!(parse_scene("x.toml".as_ref(), &write_scene(&scene)).expect("what was written"), scene, "{text}");
        let key = if place == LoadPlace::Along { "force_per_length" } else { "force" };
        let named = Parameter::parse(&scene, &format!("loads.push.{key}")).expect("a group");
        assert_eq!(named.len(), 3, "{text}");
        assert_eq!(Parameter::parse(&scene, "loads.push").expect("a group"), named, "{text}");
        let mut moved = scene.clone();
        let unit = if place == LoadPlace::Along { "mN/mm" } else { "N" };
        assign(&mut moved, &[format!("loads.push.{key}.z=3 {unit}")]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(moved.inner_loads[0].force[2], 3.0, "{text}");
    }
    // By distance from the base, beyond a rigid segment.
    let scene = good("[[load]]\nname = \"push\"\nat = \"70 mm\"\nforce = [0, 1, 0]");
    let LoadPlace::At(at) = scene.inner_loads[0].place else { panic!("no station") };
    assert!(scene.inner_loads[0].segment == 2 && (at - 0.006).abs() < 1e-15);
}

#[test]
fn what_is_pushed_in_moves_a_force_on() {
    let scene = good("insertion = \"99 mm\"\n[[load]]\nname = \"push\"\nat = \"20 mm\"\nforce = [0, 1, 0]");
    let LoadPlace::At(at) = scene.inner_loads[0].place else { panic!("no station") };
    assert!((at - 0.035).abs() < 1e-15, "{at}");
    let mut scene = good("[[load]]\nname = \"push\"\nat = \"20 mm\"\nforce = [0, 1, 0]");
    assign(&mut scene, &["insertion=0.07".to_owned()]).expect("a value");
    let lengths: Vec<f64> = scene.rod().segments.iter().map(|segment| segment.length()).collect();
    assert_eq!(lengths.len(), 5);
    for (found, expected) in lengths.iter().zip([0.006, 0.0, 0.04, 0.004, 0.02]) {
        assert!((found - expected).abs() < 1e-15, "{lengths:?}");
    }
}

#[test]
fn mistakes_name_key_and_remedy() {
    let named = |text: &str| format!("[[load]]\nname = \"push\"\n{text}");
    let cases = [
        ("[[load]]\nat = 0.02\nforce = [0, 1, 0]".into(), "load[0].name", "such as name"),
        (named("at = 0.02\nforce = [0, 1, 0]").replace("push", "a.b"), "load[0].name", "letters, digits"),
        (named("at = 0.02"), "load[0].force", "in N"),
        (named("force = [0, 1, 0]"), "load[0].at", "how far from the base"),
        (named("segment = \"tube\"\nforce = [0, 1, 0]"), "load[0].at", "proximal end"),
        (named("segment = \"tub\"\nat = 0\nforce = [0, 1, 0]"), "load[0].segment", "did you mean"),
        (named("at = 0.062\nforce = [0, 1, 0]"), "load[0].at", "segment = \"ring\""),
        (named("at = \"85 mm\"\nforce = [0, 1, 0]"), "load[0].at", "0 to 0.084"),
        (named("at = -0.01\nforce = [0, 1, 0]"), "load[0].at", "0 to 0.084"),
        (named("segment = \"end\"\nat = 0.03\nforce = [0, 1, 0]"), "load[0].at", "at most the segment's length"),
        (named("segment = \"ring\"\nat = 0.001\nforce = [0, 1, 0]"), "load[0].segment", "a rigid one at its middle"),
        (named("force_per_length = [0, 1, 0]"), "load[0].segment", "distributed_force"),
        (named("segment = \"tube\"\nat = 0.01\nforce_per_length = [0, 1, 0]"), "load[0].at", "all along"),
        (named("at = 0.01\nforce = [0, 1, 0]\nforce_per_length = [0, 1, 0]"), "load[0].force_per_length", "its own"),
        (named("segment = \"tube\"\nforce_per_length = [0, 1, 0]\nframe = \"body\""), "load[0].frame", "per length"),
        (named("segment = \"tube\"\nforce_per_length = [0, 1, 0]\nmoment = [0, 1, 0]"), "load[0].moment", "its own"),
        ("[loads]\ntip_force = { frame = \"body\" }".into(), "loads.tip_force.value", "three components"),
        ("[loads]\ntip_force = { value = [0, 1, 0], frame = \"bdy\" }".into(), "loads.tip_force.frame", "did you mean"),
        (
            format!(
                "{}\n[wall]\nkind = \"plane\"\nposition = [0, 0.1, 0]\nnormal = [0, -1, 0]\n",
                named("at = 0.01\nmoment = [0, 1, 0]")
            ),
            "load[0]",
            "no energy",
        ),
        (named("at = 0.01\nforce = [0, 1, 0]\nframe = \"wrld\""), "load[0].frame", "did you mean"),
        (named("at = 0.01\nforce = [0, \"1 m\", 0]"), "load[0].force[1]", "force"),
        (named("at = 0.01\nforce = [0, 1, 0]").replace("push", "gravity"), "load[0].name", "two loads"),
        (named("at = 0.01\nforce = [0, 1, 0]").repeat(2).replace("][[", "]\n[["), "load[1].name", "two loads"),
        (named("at = 0.01\nfroce = [0, 1, 0]"), "load[0].froce", "did you mean `force`"),
    ];
    for (text, key, words) in cases {
        let error = read(&text).expect_err(&text);
        assert_eq!(error.key, key, "{text}: {error}");
        assert!(error.line.is_some() && error.to_string().contains(words), "{text}: {error}");
    }
}
