//! `rodsweep submit`: a run that many workers share, as the files of a scheduler.

use super::{CommandError, Exit, say};
use clap::{Args, Subcommand};
use rodsweep::results::{is_url, make_directory, write_bytes};
use rodsweep::spec::{Format, RESOLVED_TABLE, SweepSpec};
use rodsweep::text::{self, quoted};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

#[derive(Debug, Subcommand)]
pub enum SubmitCommand {
    /// Write a job array and the job that ends the run, for Slurm
    Slurm(SlurmArguments),
    /// Write an Indexed Job and the job that ends the run, for Kubernetes
    Kubernetes(KubernetesArguments),
}

#[derive(Debug, Args)]
pub struct SubmitArguments {
    /// Sweep file (TOML)
    pub sweep: PathBuf,
    /// Result directory that every node sees, or its address, such as s3://bucket/results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Workers at most
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub workers: u64,
    /// GPUs of each worker
    #[arg(long, value_name = "G")]
    pub gpus: Option<u64>,
    /// Processor cores of each worker
    #[arg(long, value_name = "C")]
    pub cpus: Option<u64>,
    /// Arguments of `run` for every worker, such as "--backend cpu"
    #[arg(long, value_name = "ARGUMENTS", allow_hyphen_values = true)]
    pub run: Option<String>,
    /// Folder that the files are written to [default: NAME-OF-THE-SWEEP-slurm or -kubernetes, here]
    #[arg(long, value_name = "DIR")]
    pub write: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Hand it in
    #[arg(long)]
    pub submit: bool,
}

#[derive(Debug, Args)]
pub struct SlurmArguments {
    #[command(flatten)]
    pub common: SubmitArguments,
    /// Time limit of a task, as Slurm reads it; a task that reaches it is queued again
    #[arg(long, value_name = "TIME")]
    pub time: Option<String>,
    /// Partition
    #[arg(long, value_name = "NAME")]
    pub partition: Option<String>,
    /// Account
    #[arg(long, value_name = "NAME")]
    pub account: Option<String>,
    /// Memory of a task, such as 4G
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
    /// The program on the nodes [default: this one]
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct KubernetesArguments {
    #[command(flatten)]
    pub common: SubmitArguments,
    /// Container image that has `rodsweep`
    #[arg(long, value_name = "IMAGE")]
    pub image: String,
    /// Secret whose entries become environment variables, such as AWS_ACCESS_KEY_ID
    #[arg(long, value_name = "NAME")]
    pub secret: Option<String>,
    /// Claim of a volume that holds the result directory, mounted at DIR
    #[arg(long, value_name = "NAME")]
    pub volume: Option<String>,
    /// Memory of a worker, such as 4Gi
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<String>,
}

/// How a program ends that was asked to finish its part, and is to be started again.
const UNFINISHED: u8 = super::Exit::Unfinished as u8;
/// Seconds that a worker gets to finish its part.
const GRACE: u64 = 60;

pub fn submit(command: &SubmitCommand) -> Result<Exit, CommandError> {
    let (common, name) = match command {
        SubmitCommand::Slurm(slurm) => (&slurm.common, "slurm"),
        SubmitCommand::Kubernetes(kubernetes) => (&kubernetes.common, "kubernetes"),
    };
    let spec = SweepSpec::read(&common.sweep)?;
    if spec.format == Format::None {
        return Err(CommandError::Usage(
            "workers share a run by its parts, and format = \"none\" has none: run shards (`--shard`), and merge them"
                .into(),
        ));
    }
    let stem = spec.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = common.write.clone().unwrap_or_else(|| PathBuf::from(format!("{stem}-{name}")));
    let (files, hand_in): (Vec<(&str, String)>, Vec<String>) = match command {
        SubmitCommand::Slurm(slurm) => {
            let script = folder.join("submit.sh");
            (slurm_files(slurm, &stem, &folder)?, vec!["sh".into(), script.display().to_string()])
        }
        SubmitCommand::Kubernetes(kubernetes) => {
            let file = folder.join("jobs.json");
            let hand_in = ["kubectl", "apply", "-f"].map(str::to_owned).into_iter();
            (
                vec![("jobs.json", kubernetes_file(kubernetes, &spec, &stem)?)],
                hand_in.chain([file.display().to_string()]).collect(),
            )
        }
    };
    if let Some((name, _)) = files.iter().find(|(name, _)| folder.join(name).exists() && !common.force) {
        let path = folder.join(name);
        return Err(CommandError::Usage(format!("{} is there; add `--force` to overwrite it", path.display())));
    }
    make_directory(&folder)?;
    for (name, text) in &files {
        write_bytes(&folder.join(name), text.as_bytes())?;
        say(&format!("file: {}", folder.join(name).display()));
    }
    if !common.submit {
        say(&format!("hand it in with: {}", shell_line(&hand_in)));
        return Ok(Exit::Done);
    }
    let failed = |what: String| CommandError::Usage(format!("`{}`: {what}", hand_in.join(" ")));
    let status = Command::new(&hand_in[0]).args(&hand_in[1..]).status();
    match status.map_err(|error| failed(error.to_string()))? {
        status if status.success() => Ok(Exit::Done),
        status => Err(failed(status.to_string())),
    }
}

/// A command as a shell takes it.
fn shell_line(words: &[String]) -> String {
    words.iter().map(|word| text::shell_word(word)).collect::<Vec<_>>().join(" ")
}

/// A path as every node understands it.
fn absolute(path: &Path) -> Result<String, CommandError> {
    let gone = |error| CommandError::System("cannot tell the working directory", error);
    let path = if is_url(path) { path.to_owned() } else { std::path::absolute(path).map_err(gone)? };
    let text = path.to_str().map(str::to_owned);
    let text =
        text.ok_or_else(|| CommandError::Usage(format!("{}: give a path that is UTF-8 text", path.display())))?;
    in_a_line("a path", &text)?;
    Ok(text)
}

/// Refuses text that would not stay in its line of a script.
fn in_a_line(what: &str, text: &str) -> Result<(), CommandError> {
    match text::unfit_for_a_line(text) {
        None => Ok(()),
        Some(c) => Err(CommandError::Usage(format!(
            "{what} holds the control character \\u{:04x}, which no line of a script may hold: {}; give it another name",
            c as u32,
            text::line(text)
        ))),
    }
}

/// An option of `sbatch` in a comment: `%` of a path is no pattern there.
fn sbatch(name: &str, value: &str) -> Result<String, CommandError> {
    in_a_line(&format!("`{name}`"), value)?;
    Ok(format!("#SBATCH {name}={}\n", text::shell_word(value)))
}

/// Arguments of `run`, each a word of its own whatever it holds.
fn extra(common: &SubmitArguments) -> Result<String, CommandError> {
    let Some(given) = &common.run else { return Ok(String::new()) };
    in_a_line("`--run`", given)?;
    let words = words(given).ok_or_else(|| CommandError::Usage(format!("`--run {given}`: a quote is not closed")))?;
    Ok(words.iter().map(|word| format!(" {}", text::shell_word(word))).collect())
}

/// Words of a command line, in quotes or not; `None`: a quote is not closed.
fn words(text: &str) -> Option<Vec<String>> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in text.chars() {
        match quote {
            Some(open) if c == open => quote = None,
            None if c == '\'' || c == '"' => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            None if c.is_whitespace() => words.extend(word.take()),
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    quote.is_none().then_some(words)
}

fn slurm_files(
    arguments: &SlurmArguments,
    name: &str,
    folder: &Path,
) -> Result<Vec<(&'static str, String)>, CommandError> {
    let common = &arguments.common;
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => std::env::current_exe()
            .map_err(|error| CommandError::System("cannot tell where this program lies; give `--program`", error))?,
    };
    let (program, folder) = (quoted(&absolute(&program)?), absolute(folder)?);
    let (sweep, out) = (quoted(&absolute(&common.sweep)?), quoted(&absolute(&common.out)?));
    let options = [
        ("--gpus-per-task", common.gpus.map(|gpus| gpus.to_string())),
        ("--ntasks", common.gpus.map(|_| "1".to_owned())),
        ("--cpus-per-task", common.cpus.map(|cpus| cpus.to_string())),
        ("--mem", arguments.memory.clone()),
        ("--time", arguments.time.clone()),
        ("--partition", arguments.partition.clone()),
        ("--account", arguments.account.clone()),
    ];
    let given = options.into_iter().filter_map(|(name, value)| Some((name, value?)));
    let options: String = given.map(|(name, value)| sbatch(name, &value)).collect::<Result<_, _>>()?;
    let head = |name: &str, log: &str, more: &str| -> Result<String, CommandError> {
        let job = sbatch("--job-name", name)?;
        // `%` begins a pattern there.
        let output = sbatch("--output", &format!("{}/{log}.log", folder.replace('%', "%%")))?;
        Ok(format!(
            "#!/bin/bash\n{job}#SBATCH --requeue\n#SBATCH --open-mode=append\n\
             #SBATCH --signal=B:USR1@{GRACE}\n{output}{more}{options}"
        ))
    };
    let work = format!(
        "# Before the time limit the worker finishes its part and ends with {UNFINISHED}; then it is queued again.\n\
         {program} run {sweep} --out {out} --join --quiet --no-figures{} &\nworker=$!\n\
         trap 'kill -USR1 \"$worker\" 2>/dev/null' USR1 TERM\n\
         code=129\nwhile [ \"$code\" -gt 128 ]; do\n    wait \"$worker\"\n    code=$?\n\
         \x20   kill -0 \"$worker\" 2>/dev/null || {{ wait \"$worker\"; code=$?; break; }}\ndone\n",
        extra(common)?
    );
    let again = |job: &str| format!("if [ \"$code\" -eq {UNFINISHED} ]; then\n    scontrol requeue \"{job}\"\nfi\n");
    let array = format!("#SBATCH --array=1-{}\n", common.workers);
    let worker = head(name, "worker-%A-%a", &array)?
        + &work
        + &again("${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}")
        + "exit \"$code\"\n";
    let finish = head(&format!("{name}-end"), "end-%j", "")?
        + "# One more worker: it solves what is left and writes the manifest, if no other has.\n"
        + &work
        + &again("$SLURM_JOB_ID")
        + &format!("[ \"$code\" -eq 0 ] || exit \"$code\"\n{program} figures {out}\n");
    let here = quoted(&folder);
    let submit = format!(
        "#!/bin/sh\n# Hands in the workers, and the job that ends the run after them.\nset -e\n\
         workers=$(sbatch --parsable {here}/worker.sh)\n\
         end=$(sbatch --parsable --dependency=afterany:\"${{workers%%;*}}\" {here}/end.sh)\n\
         echo \"workers: job ${{workers%%;*}}; end: job ${{end%%;*}}\"\n"
    );
    Ok(vec![("worker.sh", worker), ("end.sh", finish), ("submit.sh", submit)])
}

/// A name as Kubernetes allows it: lower case, digits and dashes, at most 40 characters.
fn label(name: &str) -> String {
    let lower = name.to_lowercase();
    let text: String = lower.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let text = text.trim_matches('-');
    format!("rodsweep-{}", if text.is_empty() { "run" } else { text })
}

fn kubernetes_file(arguments: &KubernetesArguments, spec: &SweepSpec, stem: &str) -> Result<String, CommandError> {
    let common = &arguments.common;
    let (name, out) = (label(stem), common.out.to_string_lossy().into_owned());
    if !is_url(&common.out) && arguments.volume.is_none() {
        let remedy = "give the address of an object store, or the claim of a volume with `--volume`";
        return Err(CommandError::Usage(format!("`--out {out}`: the nodes see no such directory; {remedy}")));
    }
    let mut files = Map::new();
    files.insert("sweep.toml".into(), spec.to_toml().into());
    if let Some(table) = &spec.table {
        files.insert(RESOLVED_TABLE.into(), table.to_csv(&spec.scene).into());
    }
    let work =
        format!("rodsweep run /sweep/sweep.toml --out {} --join --quiet --no-figures{}", quoted(&out), extra(common)?);
    // The shell gives way to the program, which then gets the signals.
    let worker = format!("exec {work}");
    let end = format!("{work} && exec rodsweep figures {}", quoted(&out));
    let job = |name: &str, command: &str, workers: u64| {
        let mut limits = Map::new();
        let amounts = [
            ("nvidia.com/gpu", common.gpus.map(|gpus| gpus.to_string())),
            ("cpu", common.cpus.map(|cpus| cpus.to_string())),
            ("memory", arguments.memory.clone()),
        ];
        limits.extend(amounts.into_iter().filter_map(|(what, much)| Some((what.to_owned(), much?.into()))));
        let mut container = json!({
            "name": "worker", "image": arguments.image, "command": ["/bin/sh", "-c", command],
            "volumeMounts": [{ "name": "sweep", "mountPath": "/sweep", "readOnly": true }],
        });
        let mut volumes = vec![json!({ "name": "sweep", "configMap": { "name": format!("{}-sweep", label(stem)) } })];
        if !limits.is_empty() {
            container["resources"] = json!({ "limits": limits });
        }
        if let Some(secret) = &arguments.secret {
            container["envFrom"] = json!([{ "secretRef": { "name": secret } }]);
        }
        if let (Some(claim), Some(mounts)) = (&arguments.volume, container["volumeMounts"].as_array_mut()) {
            mounts.push(json!({ "name": "results", "mountPath": out }));
            volumes.push(json!({ "name": "results", "persistentVolumeClaim": { "claimName": claim } }));
        }
        let ends = |action: &str, codes: &[u8]| json!({ "action": action, "onExitCodes": { "containerName": "worker", "operator": "In", "values": codes } });
        json!({
            "apiVersion": "batch/v1", "kind": "Job",
            "metadata": { "name": name, "labels": { "app": "rodsweep" } },
            "spec": {
                "completionMode": "Indexed", "completions": workers, "parallelism": workers, "backoffLimitPerIndex": 6,
                "podFailurePolicy": { "rules": [
                    // A node that is drained, and a worker that gave way, are no failures.
                    { "action": "Ignore", "onPodConditions": [{ "type": "DisruptionTarget", "status": "True" }] },
                    ends("Ignore", &[UNFINISHED, Exit::Interrupted as u8]),
                    ends("FailJob", &[Exit::Usage as u8]),
                    // Once more would find the same.
                    ends("FailIndex", &[Exit::Distrusted as u8]),
                ] },
                "template": { "metadata": { "labels": { "app": "rodsweep" } }, "spec": {
                    "restartPolicy": "Never", "terminationGracePeriodSeconds": GRACE,
                    "containers": [container], "volumes": volumes,
                } },
            },
        })
    };
    let list: Value = json!({ "apiVersion": "v1", "kind": "List", "items": [
        { "apiVersion": "v1", "kind": "ConfigMap", "metadata": { "name": format!("{name}-sweep") }, "data": files },
        job(&name, &worker, common.workers),
        job(&format!("{name}-end"), &end, 1),
    ] });
    Ok(serde_json::to_string_pretty(&list).unwrap_or_default() + "\n")
}
