//! The tables of a file of jobs, before they are multiplied out.

use super::text::{Text, Wrong};
use super::values::{Curve, range};
use crate::cli::render_args;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// Bytes of the file.
pub type Span = Range<usize>;

/// A string with its place.
#[derive(Clone, Debug)]
pub struct Item {
    /// What it says.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// An option of `metrolux render`.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Its long name.
    pub key: String,
    /// Where that stands.
    pub span: Span,
    /// One for each time it is given; `None` is the name alone.
    pub values: Vec<Option<Item>>,
}

/// A change of the scene.
#[derive(Clone, Debug)]
pub struct Change {
    /// Its target.
    pub target: String,
    /// What it is set to.
    pub text: Item,
}

/// A table `[[job]]`, with the defaults in it.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Where it stands.
    pub span: Span,
    /// Scene, or a pattern of scenes.
    pub scene: Item,
    /// Name of its jobs.
    pub name: Option<Item>,
    /// Values that jobs are made of in all combinations, in the order of the file.
    pub loops: Vec<(String, Vec<String>)>,
    /// Values that run with the frame.
    pub curves: Vec<(String, Curve)>,
    /// Options.
    pub options: Vec<Choice>,
    /// Changes of the scene.
    pub set: Vec<Change>,
}

/// Options that are the batch's own affair, and what to do instead.
const OWN: [(&str, &str); 11] = [
    (
        "checkpoint",
        "the batch keeps checkpoints of its own, every --every",
    ),
    ("every", "it is an option of the batch"),
    ("resume", "the batch goes on with what was cut"),
    ("extend", "the batch keeps checkpoints of its own"),
    ("shard", "the batch makes whole images"),
    ("threads", "it is an option of the batch"),
    ("quiet", "it is an option of the batch"),
    ("progress", "it is an option of the batch"),
    ("log", "it is an option of the batch"),
    ("preview", "it is for a single render"),
    ("record-rays", "it is for a single render"),
];

/// Options that say how much work a render is; one excludes the others.
const BUDGETS: [&str; 4] = ["mutations", "spp", "time-limit", "rounds"];

type Pair<'t, 'i> = (&'t Spanned<DeString<'i>>, &'t Spanned<DeValue<'i>>);

/// The entries of a table in the order of the file.
fn pairs<'t, 'i>(table: &'t DeTable<'i>) -> Vec<Pair<'t, 'i>> {
    let mut all: Vec<Pair> = table.iter().collect();
    all.sort_by_key(|(k, _)| k.span().start);
    all
}

/// Reads all entries.
///
/// # Errors
/// The first mistake, with its place.
pub fn read(text: &Text) -> Result<Vec<Entry>, Wrong> {
    let (root, errors) = DeTable::parse_recoverable(text.text());
    let place = |e: &toml::de::Error| e.span().unwrap_or(0..0);
    if let Some(first) = errors.iter().min_by_key(|e| place(e).start) {
        return Err(text.wrong(&place(first), first.message()));
    }
    let mut defaults = Table::default();
    let mut jobs = Vec::new();
    for (key, value) in pairs(root.get_ref()) {
        match (key.get_ref().as_ref(), value.get_ref()) {
            ("defaults", DeValue::Table(t)) => defaults = Table::read(text, t)?,
            ("job", DeValue::Array(list)) => {
                for job in list.iter() {
                    let DeValue::Table(t) = job.get_ref() else {
                        let e = text.wrong(&job.span(), "a job is no table");
                        return Err(e.found(job.get_ref().type_str()).expected("[[job]]"));
                    };
                    jobs.push((job.span(), t));
                }
            }
            (name, v) => {
                let e = text.wrong(&key.span(), "unknown table");
                let found = format!("{name}, a {}", v.type_str());
                return Err(e.found(found).expected("[defaults] and [[job]]"));
            }
        }
    }
    for (what, span) in [("scene", &defaults.scene), ("name", &defaults.name)] {
        if let Some(item) = span {
            return Err(text.wrong(&item.span, format!("{what} belongs into a [[job]]")));
        }
    }
    if jobs.is_empty() {
        return Err(text.wrong(&(0..0), "there is no job").expected("[[job]]"));
    }
    let each = jobs.into_iter();
    each.map(|(span, t)| Table::read(text, t)?.over(&defaults, text, span))
        .collect()
}

/// What a table says.
#[derive(Clone, Default)]
struct Table {
    scene: Option<Item>,
    name: Option<Item>,
    loops: Vec<(String, Vec<String>)>,
    curves: Vec<(String, Curve)>,
    options: Vec<Choice>,
    set: Vec<Change>,
}

impl Table {
    fn read(text: &Text, table: &DeTable) -> Result<Self, Wrong> {
        let mut found = Self::default();
        let names = render_args::long_names();
        for (key, value) in pairs(table) {
            let name = key.get_ref().replace('_', "-");
            let wrong = |what: &str| {
                let e = text.wrong(
                    &value.span(),
                    format!("{name} has a value of the wrong kind"),
                );
                Err(e.found(value.get_ref().type_str()).expected(what))
            };
            match (name.as_str(), value.get_ref()) {
                ("scene", DeValue::String(_)) => found.scene = Some(item(value)),
                ("name", DeValue::String(_)) => found.name = Some(item(value)),
                ("scene" | "name", _) => return wrong("a string"),
                ("for", DeValue::Table(t)) => {
                    for (key, value) in pairs(t) {
                        let values = looped(text, value)?;
                        found.loops.push((variable(text, key)?, values));
                    }
                }
                ("vary", DeValue::Table(t)) => {
                    for (key, value) in pairs(t) {
                        let curve = curve(text, value)?;
                        found.curves.push((variable(text, key)?, curve));
                    }
                }
                ("set", DeValue::Table(t)) => changes(text, t, "", &mut found.set)?,
                ("for" | "vary" | "set", _) => return wrong("a table"),
                _ => {
                    let key_span = key.span();
                    if let Some((_, why)) = OWN.iter().find(|o| o.0 == name) {
                        let e = format!("{name} cannot be set for a job: {why}");
                        return Err(text.wrong(&key_span, e));
                    }
                    if !names.contains(&name) {
                        let e = text.wrong(&key_span, "no option of metrolux render");
                        let expected = "scene, name, for, vary, set, or an option by its long name";
                        return Err(e.found(&name).expected(expected));
                    }
                    let values = values(text, value)?;
                    let span = key_span;
                    found.options.push(Choice {
                        key: name,
                        span,
                        values,
                    });
                }
            }
        }
        Ok(found)
    }

    /// The job that this is with the defaults.
    fn over(self, defaults: &Self, text: &Text, span: Span) -> Result<Entry, Wrong> {
        let Some(scene) = self.scene else {
            return Err(text
                .wrong(&span, "the job has no scene")
                .expected("scene = \"FILE.pbrt\""));
        };
        let mut options = defaults.options.clone();
        // A job with a budget of its own has no other.
        if self
            .options
            .iter()
            .any(|o| BUDGETS.contains(&o.key.as_str()))
        {
            options.retain(|o| !BUDGETS.contains(&o.key.as_str()));
        }
        for o in self.options {
            options.retain(|d| d.key != o.key);
            options.push(o);
        }
        let mut set = defaults.set.clone();
        for s in self.set {
            set.retain(|d| d.target != s.target);
            set.push(s);
        }
        let (mut loops, mut curves) = (defaults.loops.clone(), defaults.curves.clone());
        for l in self.loops {
            loops.retain(|d| d.0 != l.0);
            loops.push(l);
        }
        for c in self.curves {
            curves.retain(|d| d.0 != c.0);
            curves.push(c);
        }
        if !options.iter().any(|o| o.key == "output") {
            let e = text.wrong(&span, "the job writes nothing");
            return Err(e.expected("output = \"FILE.exr\", here or in [defaults]"));
        }
        if !curves.is_empty() && !loops.iter().any(|l| l.0 == "frame") {
            let e = text.wrong(&span, "vary needs frames to run with");
            return Err(e.expected("for.frame = \"1-120\""));
        }
        Ok(Entry {
            span,
            scene,
            name: self.name,
            loops,
            curves,
            options,
            set,
        })
    }
}

fn item(value: &Spanned<DeValue>) -> Item {
    Item {
        text: value.get_ref().as_str().unwrap_or_default().to_owned(),
        span: value.span(),
    }
}

/// A string or number as text.
fn scalar(value: &DeValue) -> Option<String> {
    Some(match value {
        DeValue::String(s) => s.to_string(),
        DeValue::Integer(i) if i.radix() == 10 => i.as_str().to_owned(),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok()?.to_string(),
        DeValue::Float(f) => f.as_str().to_owned(),
        _ => return None,
    })
}

fn number(value: &DeValue) -> Option<f64> {
    let text = match value {
        DeValue::Integer(_) | DeValue::Float(_) => scalar(value)?,
        _ => return None,
    };
    text.parse::<f64>().ok().filter(|v| v.is_finite())
}

/// What an option is set to: a string or number, `true`, or a list of them.
fn values(text: &Text, value: &Spanned<DeValue>) -> Result<Vec<Option<Item>>, Wrong> {
    let one = |v: &Spanned<DeValue>| match v.get_ref() {
        DeValue::Boolean(on) => Ok(on.then_some(None)),
        other => match scalar(other) {
            Some(text) => Ok(Some(Some(Item {
                text,
                span: v.span(),
            }))),
            None => {
                let e = text.wrong(&v.span(), "an option cannot have this value");
                Err(e
                    .found(other.type_str())
                    .expected("a string, a number, true, false or a list of them"))
            }
        },
    };
    match value.get_ref() {
        DeValue::Array(list) => {
            let each = list.iter().map(one).collect::<Result<Vec<_>, _>>()?;
            Ok(each.into_iter().flatten().collect())
        }
        _ => Ok(one(value)?.into_iter().collect()),
    }
}

/// A name that values can be asked for by.
fn variable(text: &Text, key: &Spanned<DeString>) -> Result<String, Wrong> {
    let name = key.get_ref().to_string();
    let fit = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !fit || ["scene", "folder", "name"].contains(&name.as_str()) {
        let e = text
            .wrong(&key.span(), "not a name for a value of one's own")
            .found(&name);
        return Err(e.expected("letters, digits and _, and not scene, folder or name"));
    }
    Ok(name)
}

fn looped(text: &Text, value: &Spanned<DeValue>) -> Result<Vec<String>, Wrong> {
    let wrong = |span: &Span, what: &DeValue| {
        let e = text
            .wrong(span, "not values for jobs")
            .found(what.type_str());
        Err(e.expected("a range such as \"1-120\", or a list of strings or numbers"))
    };
    let found = match value.get_ref() {
        DeValue::String(s) => range(s).map_err(|e| text.wrong(&value.span(), e))?,
        DeValue::Array(list) => {
            let mut all = Vec::new();
            for v in list.iter() {
                match scalar(v.get_ref()) {
                    Some(s) => all.push(s),
                    None => return wrong(&v.span(), v.get_ref()),
                }
            }
            all
        }
        other => return wrong(&value.span(), other),
    };
    if found.is_empty() {
        return Err(text.wrong(&value.span(), "no values, so no jobs"));
    }
    Ok(found)
}

fn curve(text: &Text, value: &Spanned<DeValue>) -> Result<Curve, Wrong> {
    let e = text.wrong(&value.span(), "not a value that runs with the frame");
    let e = e.expected("keys, such as { 1 = 0, 120 = 357 }: frames with the value there");
    let DeValue::Table(t) = value.get_ref() else {
        return Err(e.found(value.get_ref().type_str()));
    };
    let mut keys = Vec::new();
    for (key, value) in t.iter() {
        let frame = key.get_ref().parse::<i64>().ok();
        let (Some(frame), Some(v)) = (frame, number(value.get_ref())) else {
            let e = text.wrong(&key.span(), "not a frame with a number");
            return Err(e.expected("such as 120 = 357.0"));
        };
        keys.push((frame as f64, v));
    }
    Curve::new(keys).ok_or(e)
}

/// Changes of a scene: `set.camera = "…"`, `set."material glass" = "…"` or `set.material.glass = "…"`.
fn changes(text: &Text, table: &DeTable, before: &str, all: &mut Vec<Change>) -> Result<(), Wrong> {
    for (key, value) in pairs(table) {
        let target = format!("{before} {}", key.get_ref()).trim().to_owned();
        match value.get_ref() {
            DeValue::String(_) => all.push(Change {
                target,
                text: item(value),
            }),
            DeValue::Table(t) => changes(text, t, &target, all)?,
            other => {
                let e = text.wrong(&value.span(), format!("cannot set {target}"));
                let expected = "parameters as in a scene file, such as '\"float fov\" 30'";
                return Err(e.found(other.type_str()).expected(expected));
            }
        }
    }
    Ok(())
}
