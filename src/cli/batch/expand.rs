//! From tables to jobs: scenes by patterns, all combinations of values, names filled in. Every job is a command line.

use super::entry::{Choice, Entry, Item, Span, read};
use super::text::{Text, Wrong};
use super::unique::Seen;
use super::values::fill;
use crate::cli::CliError;
use crate::cli::render_args::{self, RenderArgs};
use crate::scene::load::Setting;
use std::path::{Path, PathBuf};

/// A job.
pub struct Job {
    /// What it is called; no two have one name.
    pub name: String,
    /// Words of `metrolux render` that make the same images.
    pub words: Vec<String>,
    /// The same with file names as they are seen from the folder of the file of jobs.
    pub plain: Vec<String>,
    /// These as clap reads them.
    pub args: RenderArgs,
    /// Number of its table in the file.
    pub entry: usize,
}

/// Options whose values are files, relative to the folder of the file of jobs.
pub const FILES: [&str; 2] = ["output", "stats"];

/// Reads a file of jobs; names of files in it start at `base`.
///
/// # Errors
/// The first mistake with its place.
pub fn jobs(path: &Path, base: &Path) -> Result<Vec<Job>, CliError> {
    Ok(expand(&Text::read(path)?, base)?)
}

fn expand(text: &Text, base: &Path) -> Result<Vec<Job>, Wrong> {
    let mut jobs = Vec::new();
    let mut seen = Seen::default();
    for (k, entry) in read(text)?.iter().enumerate() {
        for values in combinations(&entry.loops) {
            let mut names = Names(values);
            for (name, curve) in &entry.curves {
                let frame = names.get("frame").unwrap_or_default();
                let n = frame.parse::<f64>().map_err(|_| {
                    let e = text.wrong(&entry.span, "a frame that values run with is no number");
                    e.found(&frame)
                })?;
                names.add(name, curve.text_at(n));
            }
            for scene in scenes(text, base, &entry.scene, &names)? {
                let job = job(text, base, entry, &scene, names.clone())?;
                seen.add(text, entry, &job)?;
                jobs.push(Job { entry: k, ..job });
            }
        }
    }
    Ok(jobs)
}

/// Values by name.
#[derive(Clone)]
struct Names(Vec<(String, String)>);

impl Names {
    fn get(&self, name: &str) -> Option<String> {
        let found = self.0.iter().rfind(|n| n.0 == name)?;
        Some(found.1.clone())
    }

    fn add(&mut self, name: &str, value: String) {
        self.0.push((name.to_owned(), value));
    }

    fn fill(&self, text: &Text, item: &Item) -> Result<String, Wrong> {
        let known = || {
            let all: Vec<&str> = self.0.iter().map(|n| n.0.as_str()).collect();
            all.join(", ")
        };
        fill(&item.text, &|n| self.get(n), &known).map_err(|(_, e)| text.wrong(&item.span, e))
    }
}

/// Every combination, the last name's values fastest.
fn combinations(loops: &[(String, Vec<String>)]) -> Vec<Vec<(String, String)>> {
    let mut all = vec![Vec::new()];
    for (name, values) in loops {
        let with = |before: &Vec<(String, String)>| {
            let before = before.clone();
            values.iter().map(move |v| {
                let mut one = before.clone();
                one.push((name.clone(), v.clone()));
                one
            })
        };
        all = all.iter().flat_map(with).collect();
    }
    all
}

/// The scene file, or all that a pattern finds.
fn scenes(text: &Text, base: &Path, scene: &Item, names: &Names) -> Result<Vec<PathBuf>, Wrong> {
    let filled = names.fill(text, scene)?;
    let wrong = |message: &str| text.wrong(&scene.span, message).found(&filled);
    if !filled.contains(['*', '?', '[']) {
        let path = base.join(&filled);
        if path.is_file() {
            return Ok(vec![path]);
        }
        return Err(wrong("no such scene").expected("a file, seen from the folder of this one"));
    }
    let folder = glob::Pattern::escape(&base.to_string_lossy());
    let pattern = Path::new(&folder).join(&filled);
    let found = glob::glob(&pattern.to_string_lossy()).map_err(|e| wrong(e.msg))?;
    let mut all = found
        .collect::<Result<Vec<PathBuf>, _>>()
        .map_err(|e| wrong(&format!("cannot be looked for: {e}")))?;
    all.retain(|p| p.is_file());
    if all.is_empty() {
        return Err(wrong("the pattern finds no file"));
    }
    // “box” before “box-2”, as people sort them.
    all.sort_by_key(|p| p.with_extension(""));
    Ok(all)
}

fn job(
    text: &Text,
    base: &Path,
    entry: &Entry,
    scene: &Path,
    mut names: Names,
) -> Result<Job, Wrong> {
    let part =
        |p: Option<&std::ffi::OsStr>| p.map_or(String::new(), |s| s.to_string_lossy().into_owned());
    let mut name = part(scene.file_stem());
    for (_, value) in &names.0[..entry.loops.len()] {
        name = format!("{name}-{value}");
    }
    names.add("scene", part(scene.file_stem()));
    names.add("folder", part(scene.parent().and_then(Path::file_name)));
    if let Some(given) = &entry.name {
        name = names.fill(text, given)?;
    }
    names.add("name", name.clone());
    let mut words = vec![scene.to_string_lossy().into_owned()];
    let below = scene.strip_prefix(base).unwrap_or(scene);
    let mut plain = vec![below.to_string_lossy().into_owned()];
    for Choice { key, values, .. } in &entry.options {
        for value in values {
            let Some(item) = value else {
                words.push(format!("--{key}"));
                plain.push(format!("--{key}"));
                continue;
            };
            let mut v = names.fill(text, item)?;
            plain.push(format!("--{key}={v}"));
            if FILES.contains(&key.as_str()) {
                v = base.join(v).to_string_lossy().into_owned();
            }
            words.push(format!("--{key}={v}"));
        }
    }
    for change in &entry.set {
        let v = names.fill(text, &change.text)?;
        if let Err(e) = Setting::new(&change.target, &v) {
            return Err(text.wrong(&change.text.span, e));
        }
        let word = format!("--set={}={v}", change.target);
        plain.push(word.clone());
        words.push(word);
    }
    let args = render_args::parse(&words).map_err(|e| {
        let message = e.to_string();
        let line = message.lines().next().unwrap_or_default();
        let line = line.strip_prefix("error: ").unwrap_or(line);
        text.wrong(&blamed(entry, &e), line)
    })?;
    Ok(Job {
        name,
        words,
        plain,
        args,
        entry: 0,
    })
}

/// The place of the option that clap complains about.
fn blamed(entry: &Entry, e: &clap::Error) -> Span {
    use clap::error::{ContextKind, ContextValue};
    let option = match e.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(s)) => s.clone(),
        Some(ContextValue::Strings(s)) => s.first().cloned().unwrap_or_default(),
        _ => String::new(),
    };
    let name = option.trim_start_matches('-');
    let name = name.split([' ', '=', '[']).next().unwrap_or_default();
    let found = entry.options.iter().find(|o| o.key == name);
    found.map_or(entry.span.clone(), |o| match o.values.first() {
        Some(Some(item)) => item.span.clone(),
        _ => o.span.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::CliError;

    fn folder() -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a folder");
        for name in ["b/box.pbrt", "a/box.pbrt", "a/ball.pbrt"] {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().expect("one")).expect("made");
            std::fs::write(path, "WorldBegin\n").expect("written");
        }
        dir
    }

    fn expanded(dir: &tempfile::TempDir, toml: &str) -> Result<Vec<Job>, String> {
        expand(&Text::of(toml), dir.path()).map_err(|e| CliError::from(e).to_string())
    }

    #[test]
    fn every_job_is_a_command() {
        let dir = folder();
        let toml = r#"
            [defaults]
            mutations = 1_00
            output = ["out/${name}.exr", "out/${name}.png"]
            set.film = '"integer xresolution" 64'
            [[job]]
            scene = "a/*.pbrt"
            lenient = true
            two-stage = "off"
            [[job]]
            scene = "b/box.pbrt"
            name = "turn.${frame:4}-${glass}"
            rounds = 20
            for.frame = "1-5:2"
            for.glass = [1.5, 1.33]
            vary.angle = { 1 = 0, 5 = 90 }
            set.view = "LookAt 0 0 5 0 0 0 0 1 0 Rotate ${angle} 0 1 0"
            set."material glass" = '"float eta" ${glass}'
            set.material.ice = '"float eta" ${glass}'
        "#;
        let jobs = expanded(&dir, toml).expect("jobs");
        let names: Vec<&str> = jobs.iter().map(|j| j.name.as_str()).collect();
        let turned = ["turn.0001-1.5", "turn.0001-1.33", "turn.0003-1.5"];
        assert_eq!(names[..5], [&["ball", "box"], &turned[..]].concat());
        assert_eq!(jobs.len(), 8);
        let at = |name: &str| dir.path().join(name).display().to_string();
        assert_eq!(
            jobs[0].words,
            [
                at("a/ball.pbrt"),
                "--mutations=100".into(),
                format!("--output={}", at("out/ball.exr")),
                format!("--output={}", at("out/ball.png")),
                "--lenient".into(),
                "--two-stage=off".into(),
                "--set=film=\"integer xresolution\" 64".into(),
            ]
        );
        let words = &jobs[4].words;
        assert!(!words.contains(&"--mutations=100".to_owned()), "{words:?}");
        let view = "--set=view=LookAt 0 0 5 0 0 0 0 1 0 Rotate 45 0 1 0".to_owned();
        assert!(words.contains(&view), "{words:?}");
        assert!(words.contains(&"--set=material ice=\"float eta\" 1.5".to_owned()));
        assert_eq!((jobs[4].entry, jobs[4].args.rounds), (1, Some(20)));
    }

    #[test]
    fn mistakes_have_their_place() {
        let dir = folder();
        for (toml, says) in [
            ("", "jobs.toml:1:1: there is no job"),
            (
                "[[job]]\nscene = 3",
                "jobs.toml:2:9: scene has a value of the wrong kind (found integer",
            ),
            (
                "[[job]]\nscene = \"a/ball.pbrt\"",
                "jobs.toml:1:1: the job writes nothing",
            ),
            (
                "[[job]]\noutput = \"a.exr\"",
                "jobs.toml:1:1: the job has no scene",
            ),
            (
                "[[job]]\nscene = \"c.pbrt\"\noutput=\"a.exr\"",
                "jobs.toml:2:9: no such scene (found c.pbrt",
            ),
            (
                "[[job]]\nscene = \"c*.pbrt\"\noutput=\"a.exr\"",
                "jobs.toml:2:9: the pattern finds no file",
            ),
            ("[[job]\n", "jobs.toml:1:"),
            ("[[job]]\nscene = \"a\nb\"", "jobs.toml:2:"),
            (
                "[job]\nscene = 3",
                "jobs.toml:1:2: unknown table (found job, a table",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nmutation = 3",
                "jobs.toml:4:1: no option of metrolux render (found mutation",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nmutations = \"many\"",
                "jobs.toml:4:13: invalid value 'many' for '--mutations <N>'",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nrounds = 3\nspp = 2",
                "jobs.toml:",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\ncheckpoint = \"x\"",
                "jobs.toml:4:1: checkpoint cannot be set for a job",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"${nam}.exr\"",
                "jobs.toml:3:8: there is no “${nam}”: expected one of scene, folder, name",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nset.camera='float fov 3'",
                "jobs.toml:4:12: --set camera:1:1",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nset.lens='\"float fov\" 3'",
                "jobs.toml:4:10: cannot set “lens”",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nfor.frame='9-1'",
                "jobs.toml:4:11: “9-1” is no range",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nfor.frame='1-9'",
                "jobs.toml:3:1: “ball-2” would write a file that is another's",
            ),
            (
                "[[job]]\nscene=\"*/box.pbrt\"\noutput=\"${folder}.exr\"",
                "jobs.toml:1:1: two jobs are called “box”",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"a.exr\"\nvary.x={1=2}",
                "jobs.toml:1:1: vary needs frames",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput=\"${frame}.exr\"\nfor.frame='1-2'\nvary.x={a=2}",
                "jobs.toml:5:9: not a frame with a number",
            ),
            (
                "[[job]]\nscene=\"a/ball.pbrt\"\noutput={}",
                "jobs.toml:3:8: an option cannot have this value (found table",
            ),
        ] {
            match expanded(&dir, toml) {
                Ok(_) => panic!("accepted: {toml}"),
                Err(e) => assert!(e.starts_with(says), "{toml}\n{e}"),
            }
        }
    }
}
