//! Help: commands in groups, and examples below the help of each.

use super::args::Arguments;
use clap::{CommandFactory, FromArgMatches};
use std::ffi::OsString;

/// A heading and the commands below it.
const GROUPS: [(&str, &[&str]); 7] = [
    ("Begin", &["new", "examples", "check", "parameters", "import"]),
    ("Solve", &["solve", "run", "view"]),
    ("Study", &["workspace", "contact", "sensitivity", "control", "fit"]),
    ("Results", &["status", "figures", "merge"]),
    ("Many machines", &["submit"]),
    ("Trust and speed", &["doctor", "verify", "bench"]),
    ("The program itself", &["completions", "manual", "licenses", "help"]),
];

/// A command and two examples of it.
const EXAMPLES: [(&str, [&str; 2]); 23] = [
    ("new", ["rodsweep new catheter", "rodsweep new field-map --out mine.toml"]),
    ("examples", ["rodsweep examples", "rodsweep examples workspace --out trial"]),
    ("check", ["rodsweep check sweep.toml", "rodsweep check circle.toml --scene scene.toml --json"]),
    ("parameters", ["rodsweep parameters scene.toml", "rodsweep parameters sweep.toml --json"]),
    ("import", ["rodsweep import CatheterParameterSet_1.txt", "rodsweep import circle_01_new.play --out currents.csv"]),
    (
        "solve",
        [
            "rodsweep solve scene.toml --set coil.current.x=\"200 mA\" --wrt coil.current",
            "rodsweep solve scene.toml --json --plot rod.png",
        ],
    ),
    ("run", ["rodsweep run sweep.toml", "rodsweep run sweep.toml --limit 1000 --out results/trial --force"]),
    ("view", ["rodsweep view sweep.toml", "rodsweep view results/sweep --export map.html"]),
    (
        "workspace",
        [
            "rodsweep workspace sweep.toml --voxel 2mm",
            "rodsweep workspace sweep.toml --reach \"10 mm,-40 mm,80 mm\" --out results/reach",
        ],
    ),
    (
        "contact",
        [
            "rodsweep contact sweep.toml --voxel 2mm --extent 30mm",
            "rodsweep contact sweep.toml --force 5mN --out results/friction",
        ],
    ),
    (
        "sensitivity",
        [
            "rodsweep sensitivity sweep.toml",
            "rodsweep sensitivity results/sweep --outputs tip.position,stability.margin --json",
        ],
    ),
    (
        "control",
        [
            "rodsweep control scene.toml circle.toml",
            "rodsweep control scene.toml --targets points.csv --input coil.current=0.3",
        ],
    ),
    (
        "fit",
        [
            "rodsweep fit scene.toml markers.csv --out fitted.toml",
            "rodsweep fit scene.toml markers.csv --free tube.youngs_modulus --noise \"0.2 mm\"",
        ],
    ),
    ("status", ["rodsweep status results/sweep", "rodsweep status results/sweep --watch"]),
    ("figures", ["rodsweep figures results/sweep", "rodsweep figures results/sweep --colour coil.current.z"]),
    (
        "merge",
        [
            "rodsweep merge part-1 part-2 --out whole",
            "rodsweep merge s3://bucket/part-1 s3://bucket/part-2 --out whole",
        ],
    ),
    (
        "submit",
        [
            "rodsweep submit slurm sweep.toml --out results/sweep --workers 8",
            "rodsweep submit kubernetes sweep.toml --out s3://bucket/sweep --workers 8 --image rodsweep:latest",
        ],
    ),
    ("doctor", ["rodsweep doctor", "rodsweep doctor --help"]),
    ("verify", ["rodsweep verify", "rodsweep verify --hard --software"]),
    ("bench", ["rodsweep bench --quick", "rodsweep bench --only hard --out results/bench"]),
    ("completions", ["rodsweep completions bash", "rodsweep completions zsh"]),
    ("manual", ["rodsweep manual ~/.local/share/man/man1", "rodsweep manual pages"]),
    ("licenses", ["rodsweep licenses", "rodsweep licenses --help"]),
];

const TEMPLATE: &str = "{about-with-newline}\n{usage-heading} {usage}{after-help}\n\nOptions:\n{options}\n";

/// The program's commands with groups and examples.
pub fn command() -> clap::Command {
    let plain = Arguments::command();
    let groups = groups(&plain);
    let with_groups = plain.help_template(TEMPLATE).after_help(groups);
    EXAMPLES.iter().fold(with_groups, |command, (name, [one, two])| {
        let examples = format!("Examples:\n  {one}\n  {two}");
        command.mut_subcommand(name, |command| command.after_help(examples))
    })
}

/// The arguments of the command line, as clap reads them.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let mut command = command();
    let matches = command.try_get_matches_from_mut(arguments)?;
    Arguments::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// The commands below their headings.
fn groups(command: &clap::Command) -> String {
    let about = |name: &str| match command.find_subcommand(name) {
        Some(found) => found.get_about().map(ToString::to_string).unwrap_or_default(),
        None => "Print this message or the help of a command".into(),
    };
    let group = |(heading, names): &(&str, &[&str])| {
        let lines: String = names.iter().map(|name| format!("\n  {name:<13}{}", about(name))).collect();
        format!("{heading}:{lines}")
    };
    GROUPS.iter().map(group).collect::<Vec<_>>().join("\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words of a line, as a shell takes them; quotes hold words together.
    fn words(line: &str) -> Vec<OsString> {
        let (mut words, mut is_quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => is_quoted = !is_quoted,
                ' ' if !is_quoted => words.push(String::new()),
                c => words.last_mut().expect("a word").push(c),
            }
        }
        words.into_iter().map(OsString::from).collect()
    }

    #[test]
    fn every_command_is_in_one_group_and_has_examples() {
        for command in Arguments::command().get_subcommands().map(clap::Command::get_name) {
            let groups = GROUPS.iter().filter(|(_, names)| names.contains(&command)).count();
            assert_eq!(groups, 1, "{command}");
            assert!(EXAMPLES.iter().any(|(name, _)| *name == command), "{command}");
        }
    }

    #[test]
    fn every_example_is_understood() {
        for (name, lines) in EXAMPLES {
            for line in lines {
                let words = words(line);
                assert_eq!(words[1], name, "{line}");
                match parse(words) {
                    Ok(_) => {}
                    Err(error) => assert!(!error.use_stderr(), "{line}: {error}"),
                }
            }
        }
    }
}
