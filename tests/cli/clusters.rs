//! Runs on many machines: shared runs by the program, files for schedulers, the recipes of `docs/clusters.md`.

use crate::common::root;
use crate::common::texts::SWEEP;
use crate::sandbox::{Sandbox, json};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const SHARE: [&str; 5] = ["--join", "--part-size", "1", "--backend", "cpu"];

fn share<'a>(more: &[&'a str]) -> Vec<&'a str> {
    ["run", "sweep.toml", "--out", "out"].into_iter().chain(SHARE).chain(more.iter().copied()).collect()
}

#[test]
fn workers_join_a_run_and_status_tells_of_them() {
    let sandbox = Sandbox::new();
    let workers: Vec<_> = (0..3).map(|_| sandbox.command(&share(&["--quiet"])).spawn().expect("a worker")).collect();
    for mut worker in workers {
        assert!(worker.wait().expect("an end").success());
    }
    let status = sandbox.ok(&["status", "out"]).stdout;
    assert!(status.contains("5 of 5 parts done") && status.contains("workers: 0 of 3 alive"), "{status}");
    assert_eq!(status.matches("has left").count(), 3, "{status}");
    let watched = sandbox.ok(&["status", "out", "--watch"]).stdout;
    assert!(watched.starts_with("5 of 5 samples in 5 parts, 0 of 3 workers alive"), "{watched}");
    let manifest = json(&fs::read_to_string(sandbox.path("out/manifest.json")).expect("a manifest"));
    assert_eq!((manifest["complete"].as_bool(), manifest["workers"].as_array().map(Vec::len)), (Some(true), Some(3)));
    // What one worker alone writes is the same.
    sandbox.ok(&["run", "sweep.toml", "--out", "alone", "--part-size", "1", "--backend", "cpu", "--no-figures"]);
    for chunk in 0..5 {
        let read = |dir: &str| fs::read(sandbox.path(&format!("{dir}/part-000000000{chunk}.parquet"))).expect("a part");
        assert!(read("out") == read("alone"), "part {chunk}");
    }
}

/// Containers are alike: the same host name, and each program is process 1.
#[cfg(target_os = "linux")]
#[test]
fn workers_of_equal_names_and_numbers_share_a_directory() {
    const CONTAINER: [&str; 6] = ["--user", "--map-root-user", "--pid", "--uts", "--fork", "--kill-child"];
    let sandbox = Sandbox::new();
    let boxed = |arguments: &[&str]| {
        let program = sandbox.command(arguments);
        let mut command = Command::new("unshare");
        command.args(CONTAINER).args(["sh", "-c", "hostname box && exec \"$@\"", "sh", env!("CARGO_BIN_EXE_rodsweep")]);
        command.args(arguments).current_dir(sandbox.path("."));
        for (name, value) in program.get_envs() {
            command.env(name, value.unwrap_or_default());
        }
        command
    };
    if !boxed(&["--version"]).output().is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: this system gives no containers");
        return;
    }
    sandbox.write("sweep.toml", &SWEEP.replace("points = 5", "points = 3000"));
    let run = ["run", "sweep.toml", "--part-size", "50", "--backend", "cpu", "--no-figures", "--quiet", "--out"];
    sandbox.ok(&[&run[..], &["alone"]].concat());
    // All of them on everything, and sharing it by claims.
    for out in ["resume", "join"] {
        let how = format!("--{out}");
        let workers: Vec<_> =
            (0..3).map(|_| boxed(&[&run[..], &[out, &how]].concat()).stderr(Stdio::piped()).spawn().unwrap()).collect();
        for worker in workers {
            let output = worker.wait_with_output().unwrap();
            assert!(output.status.success(), "{how}: {}", String::from_utf8_lossy(&output.stderr));
        }
        assert!(sandbox.ok(&["status", out]).stdout.contains("60 of 60 parts done"));
        let names: Vec<String> = fs::read_dir(sandbox.path(out)).unwrap().map(name).collect();
        assert!(!names.iter().any(|name| name.starts_with('.')), "{names:?}");
        for part in names.iter().filter(|name| name.starts_with("part-")) {
            let read = |dir: &str| fs::read(sandbox.path(&format!("{dir}/{part}"))).expect("a part");
            assert!(read(out) == read("alone"), "{how}: {part}");
        }
    }
    let manifest = json(&fs::read_to_string(sandbox.path("join/manifest.json")).unwrap());
    let workers = manifest["workers"].as_array().unwrap();
    assert_eq!(workers.len(), 3);
    assert!(workers.iter().all(|worker| worker["host"] == "box" && worker["process"] == 1), "{workers:?}");
}

fn name(entry: std::io::Result<fs::DirEntry>) -> String {
    entry.unwrap().file_name().to_string_lossy().into_owned()
}

#[test]
fn what_does_not_go_together_is_refused() {
    let sandbox = Sandbox::new();
    for (more, part) in [
        (&["--shard", "1/2"][..], "--shard"),
        (&["--silence", "0"], "--silence"),
        (&["--backend", "none"], "--backend"),
    ] {
        let output = sandbox.run(&share(more));
        assert!(output.code == 2 && output.stderr.contains(part), "{more:?}: {}", output.stderr);
    }
    let sweep = fs::read_to_string(sandbox.path("sweep.toml")).expect("a sweep").replace("\"parquet\"", "\"none\"");
    sandbox.write("none.toml", &sweep);
    let output = sandbox.run(&["run", "none.toml", "--out", "none", "--join"]);
    assert!(output.code == 2 && output.stderr.contains("has none"), "{}", output.stderr);
    let output = sandbox.run(&["submit", "slurm", "none.toml", "--out", "none", "--workers", "2"]);
    assert!(output.code == 2 && output.stderr.contains("--shard"), "{}", output.stderr);
}

#[cfg(unix)]
#[test]
fn a_worker_that_is_asked_to_finishes_its_part() {
    let sandbox = Sandbox::new();
    let sweep =
        fs::read_to_string(sandbox.path("sweep.toml")).expect("a sweep").replace("points = 5", "points = 400000");
    sandbox.write("long.toml", &sweep);
    for signal in ["USR1", "TERM"] {
        let arguments =
            ["run", "long.toml", "--out", signal, "--join", "--part-size", "2000", "--backend", "cpu", "--no-figures"];
        let mut worker = sandbox.command(&arguments);
        let worker = worker.stderr(std::process::Stdio::piped()).spawn().expect("a worker");
        let first = sandbox.path(&format!("{signal}/workers/plan.json"));
        while !first.exists() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let kill = Command::new("kill").args([&format!("-{signal}"), &worker.id().to_string()]).status();
        assert!(kill.expect("kill").success());
        let output = worker.wait_with_output().expect("an end");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(85), "{text}");
        assert!(text.contains("stopped between two parts; go on with: rodsweep run long.toml"), "{text}");
        let status = sandbox.ok(&["status", signal]).stdout;
        assert!(status.contains("1 alive") || status.contains("workers: 0 of 1 alive"), "{status}");
    }
}

#[test]
fn a_job_array_of_slurm_shares_the_run() {
    let sandbox = Sandbox::new();
    let options =
        ["--workers", "3", "--gpus", "1", "--cpus", "2", "--time", "1:00:00", "--partition", "long", "--memory", "2G"];
    let call: Vec<&str> =
        ["submit", "slurm", "sweep.toml", "--out", "out of 'here'", "--run", "--part-size 1 --backend cpu"]
            .into_iter()
            .chain(options)
            .collect();
    let told = sandbox.ok(&call).stderr;
    assert!(told.contains("hand it in with: sh sweep-slurm/submit.sh"), "{told}");
    let again = sandbox.run(&call);
    assert!(again.code == 2 && again.stderr.contains("--force"), "{}", again.stderr);
    let worker = fs::read_to_string(sandbox.path("sweep-slurm/worker.sh")).expect("a script");
    for line in [
        "#SBATCH --array=1-3",
        "#SBATCH --requeue",
        "#SBATCH --signal=B:USR1@60",
        "#SBATCH --gpus-per-task=1",
        "#SBATCH --cpus-per-task=2",
        "#SBATCH --time=1:00:00",
        "#SBATCH --partition=long",
        "#SBATCH --mem=2G",
        "    scontrol requeue \"${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}\"",
    ] {
        assert!(worker.lines().any(|other| other == line), "{line} is missing in:\n{worker}");
    }
    // A scheduler of one machine: tasks run one after another, the job that waits for them at last.
    let bin = sandbox.path("bin");
    fs::create_dir(&bin).expect("a folder");
    let sbatch = "#!/bin/sh\nfor script; do :; done\necho \"$@\" >>calls\ncase $script in\n\
                  *worker.sh) for task in 1 2 3; do SLURM_ARRAY_TASK_ID=$task bash \"$script\" || exit; done; echo '11;c' ;;\n\
                  *) bash \"$script\" >&2 && echo 12 ;;\nesac\n";
    script(&bin.join("sbatch"), sbatch);
    let output =
        with_path(sandbox.command(&[&call[..], &["--force", "--submit"]].concat()), &bin).output().expect("runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("workers: job 11; end: job 12"));
    let calls = fs::read_to_string(sandbox.path("calls")).expect("calls");
    assert!(calls.lines().nth(1).is_some_and(|call| call.contains("--dependency=afterany:11 ")), "{calls}");
    assert!(sandbox.path("out of 'here'/tips.png").exists(), "{text}");
    assert!(sandbox.ok(&["status", "out of 'here'"]).stdout.contains("5 of 5 parts done"));
}

#[cfg(unix)]
fn script(path: &Path, text: &str) {
    use std::os::unix::fs::PermissionsExt;
    fs::write(path, text).expect("a script");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("executable");
}

fn with_path(mut command: Command, first: &Path) -> Command {
    let path = std::env::var("PATH").unwrap_or_default();
    command.env("PATH", format!("{}:{path}", first.display()));
    command
}

/// What in a value does not fit a schema: that part of JSON Schema which the API of Kubernetes uses.
fn misfits(schemas: &Value, schema: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    if let Some(name) = schema["$ref"].as_str() {
        assert!(schemas[name].is_object(), "{place}: there is no schema {name}");
        return misfits(schemas, &schemas[name], value, place, found);
    }
    if let Some(choices) = schema["oneOf"].as_array() {
        let fits = |choice: &&Value| {
            let mut none = Vec::new();
            misfits(schemas, choice, value, place, &mut none);
            none.is_empty()
        };
        if choices.iter().filter(fits).count() != 1 {
            found.push(format!("{place}: {value} fits not one of {choices:?}"));
        }
        return;
    }
    let fits = match schema["type"].as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") if schema["format"] == "int32" => value.as_i64().is_some_and(|x| i32::try_from(x).is_ok()),
        Some("integer") => value.is_i64(),
        _ => true,
    };
    if !fits || schema["enum"].as_array().is_some_and(|words| !words.contains(value)) {
        found.push(format!("{place}: {value} is not of {schema}"));
    }
    for (key, item) in value.as_object().into_iter().flatten() {
        let place = format!("{place}.{key}");
        match (schema["properties"].get(key), &schema["additionalProperties"]) {
            (Some(inner), _) => misfits(schemas, inner, item, &place, found),
            (None, Value::Bool(false)) => found.push(format!("{place}: there is no such field")),
            (None, inner) => misfits(schemas, inner, item, &place, found),
        }
    }
    let items = value.as_array().into_iter().flatten().enumerate();
    items.for_each(|(at, item)| misfits(schemas, &schema["items"], item, &format!("{place}[{at}]"), found));
    let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let missing = required.filter(|key| value.is_object() && value.get(key).is_none());
    found.extend(missing.map(|key| format!("{place}.{key} is missing")));
}

#[test]
fn jobs_of_kubernetes_are_valid() {
    let sandbox = Sandbox::new();
    const JOB: &str = "io.k8s.api.batch.v1.Job";
    let api = json(&fs::read_to_string(root().join("tests/data/kubernetes_job.json")).expect("the schemas"));
    let schemas = &api["definitions"];
    let check = |more: &[&str]| {
        let call = ["submit", "kubernetes", "sweep.toml", "--workers", "8", "--image", "rodsweep:1", "--force"];
        sandbox.ok(&[&call[..], more].concat());
        let list = json(&fs::read_to_string(sandbox.path("sweep-kubernetes/jobs.json")).expect("the jobs"));
        let mut found = Vec::new();
        let items = list["items"].as_array().expect("items");
        assert_eq!(items.len(), 3);
        for (item, name) in items.iter().zip(["io.k8s.api.core.v1.ConfigMap", JOB, JOB]) {
            misfits(schemas, &schemas[name], item, name, &mut found);
        }
        assert!(found.is_empty(), "{found:#?}");
        list
    };
    let list = check(&["--out", "s3://bucket/results", "--secret", "keys", "--gpus", "1", "--memory", "4Gi"]);
    let job = &list["items"][1]["spec"];
    assert_eq!((job["completionMode"].as_str(), job["completions"].as_u64()), (Some("Indexed"), Some(8)));
    assert_eq!(job["podFailurePolicy"]["rules"][1]["onExitCodes"]["values"], serde_json::json!([85, 130]));
    assert_eq!(job["template"]["spec"]["containers"][0]["resources"]["limits"]["nvidia.com/gpu"], "1");
    check(&["--out", "/results", "--volume", "claim"]);
    // The sweep that the workers get is whole by itself.
    sandbox.write("mounted.toml", list["items"][0]["data"]["sweep.toml"].as_str().expect("a sweep"));
    sandbox.ok(&["run", "mounted.toml", "--out", "out", "--dry-run"]);
    let output =
        sandbox.run(&["submit", "kubernetes", "sweep.toml", "--workers", "8", "--image", "a", "--out", "here"]);
    assert!(output.code == 2 && output.stderr.contains("--volume"), "{}", output.stderr);
    let mut found = Vec::new();
    let wrong = serde_json::json!({ "kind": "Jobs", "spec": {
        "completions": "8", "paralelism": 8, "backoffLimit": 1_u64 << 31, "podFailurePolicy": { "rules": [{}] },
        "template": { "spec": { "containers": [{ "name": "a", "resources": { "limits": { "cpu": [] } } }] } }
    } });
    misfits(schemas, &schemas[JOB], &wrong, "job", &mut found);
    assert_eq!(found.len(), 6, "this check can fail: {found:#?}");
}

/// Blocks of `docs/clusters.md` marked `bash`.
fn recipes() -> Vec<String> {
    let page = fs::read_to_string(root().join("docs/clusters.md")).expect("the page");
    page.split("```bash\n").skip(1).filter_map(|rest| rest.split_once("```")).map(|(text, _)| text.to_owned()).collect()
}

#[cfg(unix)]
#[test]
fn the_recipes_of_the_guide_run() {
    let recipes = recipes();
    assert!(recipes.len() >= 2, "{recipes:?}");
    for (number, recipe) in recipes.iter().enumerate() {
        let sandbox = Sandbox::new();
        let bin = sandbox.path("bin");
        fs::create_dir(&bin).expect("a folder");
        let program = env!("CARGO_BIN_EXE_rodsweep");
        script(
            &bin.join("rodsweep"),
            &format!("#!/bin/sh\n[ \"$1\" != run ] || set -- \"$@\" --backend cpu\nexec {program} \"$@\"\n"),
        );
        // Another machine is this one by another name; it begins in another folder, as `ssh` does.
        script(&bin.join("ssh"), "#!/bin/sh\nshift\ncd / && exec sh -c \"$*\"\n");
        if recipe.contains("parallel") && Command::new("parallel").arg("--version").output().is_err() {
            eprintln!("skipped: there is no GNU parallel for recipe {number}");
            continue;
        }
        let mut shell = Command::new("bash");
        shell.args(["-ec", recipe]).current_dir(sandbox.path("."));
        let output = with_path(shell, &bin).output().expect("a shell");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{recipe}\n{text}");
        let status = sandbox.ok(&["status", "results"]).stdout;
        assert!(status.contains("1 of 1 parts done"), "{recipe}\n{status}");
    }
}
