//! The house rules that a reader can check: data flows one way through the rooms of `src/`, `unsafe` stays in one file,
//! and a file holds one idea.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each room of the line with the rooms it may look at, in the order
/// scene → plan → accel → sampling, scatter → path → mutation → chain → integrator, film → output.
/// The film serves the chains and integrators; a path knows nothing of images.
const ROOMS: [(&str, &[&str]); 13] = [
    ("scene", &[]),
    ("plan", &["scene"]),
    ("sampling", &[]),
    ("accel", &["scene", "plan"]),
    ("scatter", &["scene", "plan", "accel", "sampling"]),
    ("path", &["scene", "plan", "accel", "sampling", "scatter"]),
    (
        "mutation",
        &["scene", "plan", "accel", "sampling", "scatter", "path"],
    ),
    ("film", &["scene", "plan", "sampling"]),
    (
        "chain",
        &[
            "scene", "plan", "accel", "sampling", "scatter", "path", "mutation", "film",
        ],
    ),
    (
        "integrator",
        &[
            "scene", "plan", "accel", "sampling", "scatter", "path", "mutation", "film", "chain",
        ],
    ),
    (
        "output",
        &[
            "scene",
            "plan",
            "accel",
            "sampling",
            "scatter",
            "path",
            "mutation",
            "film",
            "chain",
            "integrator",
        ],
    ),
    ("study", EVERYTHING),
    ("cli", EVERYTHING),
];

/// Stand beside the line.
const EVERYTHING: &[&str] = &[
    "scene",
    "plan",
    "accel",
    "sampling",
    "scatter",
    "path",
    "mutation",
    "film",
    "chain",
    "integrator",
    "output",
    "study",
    "cli",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Every Rust file below `src`, with its path from there.
fn files() -> Vec<(PathBuf, String)> {
    fn walk(dir: &Path, all: &mut Vec<(PathBuf, String)>) {
        for entry in fs::read_dir(dir).expect("src can be read") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, all);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("UTF-8");
                let name = path.strip_prefix(root()).expect("below src").to_owned();
                all.push((name, text));
            }
        }
    }
    let mut all = Vec::new();
    walk(&root(), &mut all);
    all.sort();
    assert!(all.len() > 100, "only {} files found", all.len());
    all
}

/// The part of a line that the compiler reads; a comment may name any room.
fn code(line: &str) -> &str {
    line.split("//").next().unwrap_or("")
}

/// Rooms that a text names, as `crate::room`, in `use crate::{room, …}` over several lines, or by climbing up to the
/// root with `super`. `depth` is the number of modules above the file's own items.
fn rooms_named(text: &str, depth: usize) -> BTreeSet<String> {
    let flat: Vec<&str> = text
        .lines()
        .flat_map(|l| code(l).split_whitespace())
        .collect();
    let flat = flat.join(" ");
    let up = "super::".repeat(depth);
    let mut found = BTreeSet::new();
    for start in ["crate::", up.as_str()] {
        for (at, _) in flat.match_indices(start) {
            if !flat[..at].ends_with(|c: char| c.is_alphanumeric() || "_$:".contains(c)) {
                heads(&flat[at + start.len()..], &mut found);
            }
        }
    }
    found
}

/// First names of a path, or of each entry of a braced list.
fn heads(rest: &str, found: &mut BTreeSet<String>) {
    let word = |s: &str| -> String {
        s.trim_start()
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    if !rest.starts_with('{') {
        found.insert(word(rest));
        return;
    }
    let mut level = 0;
    for (i, c) in rest.char_indices() {
        match c {
            '{' => level += 1,
            '}' => level -= 1,
            _ => {}
        }
        if level == 1 && (c == '{' || c == ',') {
            found.insert(word(&rest[i + 1..]));
        }
        if level == 0 {
            return;
        }
    }
}

/// Arrows of a room's file that run back.
fn backward(room: &str, text: &str, depth: usize) -> Vec<String> {
    let (_, may) = ROOMS
        .iter()
        .find(|(r, _)| *r == room)
        .unwrap_or_else(|| panic!("room {room} is not in the list"));
    rooms_named(text, depth)
        .into_iter()
        .filter(|r| ROOMS.iter().any(|(name, _)| name == r))
        .filter(|r| r != room && !may.contains(&r.as_str()))
        .collect()
}

#[test]
fn data_flows_one_way() {
    let mut wrong = Vec::new();
    let mut rooms = BTreeSet::new();
    for (name, text) in files() {
        let parts: Vec<&str> = name.iter().map(|p| p.to_str().expect("UTF-8")).collect();
        let room = match parts[..] {
            ["lib.rs" | "main.rs"] => continue,
            // The number type, below all rooms.
            ["real.rs"] => continue,
            // A room's tests may call on rooms further down the line to have something to compare with.
            [_, "tests", ..] => continue,
            [file] => file.trim_end_matches(".rs"),
            _ => parts[0],
        };
        rooms.insert(room.to_owned());
        // crate::a::b sees the root two modules up, crate::a (its mod.rs) one.
        let depth = parts.len() - usize::from(parts.last() == Some(&"mod.rs"));
        for to in backward(room, &text, depth) {
            wrong.push(format!("src/{}: {room} → {to}", name.display()));
        }
    }
    assert!(rooms.len() >= 12, "only {rooms:?} found");
    assert!(wrong.is_empty(), "arrows run back:\n{}", wrong.join("\n"));
}

#[test]
fn an_arrow_back_is_seen_however_it_is_written() {
    for text in [
        "use crate::film::Film;",
        "use crate::{\n    scene::Scene,\n    film::{Crop, Film},\n};",
        "fn f(x: &crate::film::Film) {}",
        "pub use crate::film;",
        "fn f() { for x in crate::film::all() {} }",
        "use super::super::film::Film;",
    ] {
        assert_eq!(backward("path", text, 2), ["film"], "{text}");
    }
    for text in [
        "use crate::scene::Scene;",
        "// use crate::film::Film;",
        "/// [`crate::film`]\nfn f() {}",
        "use super::film::Film;",
    ] {
        assert!(backward("path", text, 2).is_empty(), "{text}");
    }
    assert_eq!(backward("scene", "use crate::cli::Cli;", 1), ["cli"]);
    assert!(backward("study", "use crate::cli::Cli;", 1).is_empty());
}

#[test]
fn unsafe_stands_in_one_file() {
    let mut found = Vec::new();
    for (name, text) in files() {
        // `unsafe_code` is the lint, another word.
        let words = text
            .lines()
            .flat_map(|l| code(l).split(|c: char| !(c.is_alphanumeric() || c == '_')));
        if words.into_iter().any(|w| w == "unsafe") {
            found.push(name.display().to_string());
        }
    }
    assert_eq!(found, ["accel/embree.rs"]);
    let lib = fs::read_to_string(root().join("lib.rs")).expect("lib.rs");
    assert!(lib.contains("#![deny(unsafe_code)]"));
}

#[test]
fn a_file_has_at_most_400_lines() {
    let long: Vec<String> = files()
        .iter()
        .map(|(name, text)| (name, text.lines().count()))
        .filter(|(_, n)| *n > 400)
        .map(|(name, n)| format!("src/{}: {n} lines", name.display()))
        .collect();
    assert!(
        long.is_empty(),
        "two ideas in one file:\n{}",
        long.join("\n")
    );
}
