//! The template for Open Job Description (2023-09), of which render farms' managers make jobs.
//!
//! Paths are defaults of parameters, which are plain text; command lines are format strings, in which `{{` begins an
//! expression. They are parameters of type STRING, since the default of a PATH must be relative to the template.

use super::{CliError, Farm};
use std::time::Duration;

/// Seconds a part has to write its checkpoint when it is told to stop.
const NOTICE: u64 = 120;

/// The template.
pub fn template(farm: &Farm) -> Result<String, CliError> {
    let Farm { parts, .. } = farm;
    let texts = farm.options.iter().chain(&farm.merge).chain([&farm.name]);
    if let Some(text) = texts.into_iter().find(|t| t.contains("{{")) {
        return Err(CliError::Usage(format!(
            "cannot write {text:?} into a template: Open Job Description reads {{{{ as the beginning of an expression"
        )));
    }
    if farm.options.iter().any(|o| o.starts_with("--progress")) {
        let text = "cannot take after -- --progress: the template asks for the engine's";
        return Err(CliError::Usage(text.into()));
    }
    let [metrolux, scene, dir, name] =
        [&farm.metrolux, &farm.scene, &farm.dir, &farm.name].map(|t| quoted(t));
    let list = |all: &[String]| -> String {
        let line = |w: &String| format!("            - {}\n", quoted(w));
        all.iter().map(line).collect()
    };
    let (options, merge) = (list(&farm.options), list(&farm.merge));
    let threads = farm
        .cpus
        .map_or(String::new(), |n| list(&[format!("--threads={n}")]));
    let files: Vec<String> = (1..=*parts).map(|k| format!("part.{k}")).collect();
    let files = list(&files);
    let timeout = farm.time.map_or(String::new(), |t| {
        format!("          timeout: {}\n", seconds(t))
    });
    let cores = farm.cpus.map_or(String::new(), |n| {
        format!(
            "    hostRequirements:\n      amounts:\n        - name: amount.worker.vcpu\n          min: {n}\n"
        )
    });
    let version = env!("CARGO_PKG_VERSION");
    Ok(format!(
        r#"# A render in {parts} parts, made by metrolux {version}. What is in the folder is gone on from: a task that is run
# again, after a failure or a time limit, begins where its last checkpoint stands.
specificationVersion: jobtemplate-2023-09
name: {name}
parameterDefinitions:
  - name: Metrolux
    description: The program
    type: STRING
    default: {metrolux}
  - name: Scene
    type: STRING
    default: {scene}
  - name: Folder
    description: Where everything is kept, seen by all machines
    type: STRING
    default: {dir}
steps:
  - name: Part
{cores}    parameterSpace:
      taskParameterDefinitions:
        - name: K
          type: INT
          range: "1-{parts}"
    script:
      actions:
        onRun:
{timeout}          cancelation:
            mode: NOTIFY_THEN_TERMINATE
            notifyPeriodInSeconds: {NOTICE}
          command: bash
          args:
            - "-c"
            - {run}
            - part
            - "{{{{Param.Folder}}}}"
            - "{{{{Param.Metrolux}}}}"
            - render
            - "{{{{Param.Scene}}}}"
            - "--shard={{{{Task.Param.K}}}}/{parts}"
            - "-opart.{{{{Task.Param.K}}}}"
            - "--checkpoint=part.{{{{Task.Param.K}}}}.run"
            - "--resume"
            - "--progress=openjd"
{threads}{options}  - name: Merge
    dependencies:
      - dependsOn: Part
    script:
      actions:
        onRun:
          command: bash
          args:
            - "-c"
            - {run}
            - merge
            - "{{{{Param.Folder}}}}"
            - "{{{{Param.Metrolux}}}}"
            - merge
            - "--progress=openjd"
{files}{merge}"#,
        run = quoted(RUN),
    ))
}

/// In the folder, the words that follow it; the render takes the place of the shell, so that signals reach it alone.
const RUN: &str = r#"mkdir -p -- "$1" && cd -- "$1" && shift && exec "$@""#;

/// A string of YAML, which reads those of JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn seconds(t: Duration) -> u64 {
    t.as_secs_f64().ceil() as u64
}
