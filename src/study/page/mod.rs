//! The page of a study, and the same figures for machines.

mod chart;
mod front;
mod html;
mod picture;
mod table;

pub use chart::escape;
pub use picture::whole as thumbnail;

use super::analyse::{Judged, Summary, summarise};
use super::axes::Axis;
use super::record::{Clock, Point, Store};
use super::reference::Reference;
use crate::output::{Image, ImageError, write_atomic};
use serde::Serialize;

/// The circumstances.
#[derive(Clone, Debug, Serialize)]
pub struct Facts {
    /// Scene file as it was named.
    pub scene: String,
    /// Hash of everything in it that can change the image.
    pub scene_hash: String,
    /// Options of every render.
    pub shared: Vec<String>,
    /// Pixels.
    pub size: [u32; 2],
    /// Version of this program.
    pub version: String,
    /// Threads of a render.
    pub threads: usize,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Depth of the default render.
    pub max_depth: u32,
}

/// A study so far.
pub struct Study {
    /// The circumstances.
    pub facts: Facts,
    /// What time is measured by.
    pub clock: Clock,
    /// Axes.
    pub axes: Vec<Axis>,
    /// Options of the different settings.
    pub settings: Vec<Vec<String>>,
    /// The truth.
    pub reference: Reference,
    /// Points of each setting.
    pub points: Vec<Vec<Judged>>,
    /// The last image of each setting's first repeat, with its level.
    latest: Vec<Option<(usize, Image)>>,
}

impl Study {
    /// Nothing rendered yet.
    pub fn new(
        clock: Clock,
        axes: &[Axis],
        settings: &[Vec<String>],
        reference: Reference,
        facts: Facts,
    ) -> Self {
        Self {
            facts,
            clock,
            axes: axes.to_vec(),
            settings: settings.to_vec(),
            reference,
            points: settings.iter().map(|_| Vec::new()).collect(),
            latest: settings.iter().map(|_| None).collect(),
        }
    }

    /// Adds an image of a setting at a level.
    pub fn add(&mut self, setting: usize, level: usize, point: Point, image: &Image) {
        if point.repeat == 0 {
            self.latest[setting] = Some((level, image.clone()));
        }
        let judged = Judged::new(point, level, image, &self.reference);
        self.points[setting].push(judged);
    }

    /// What is to be said where the reference is too noisy for the images held against it.
    pub fn doubt(&self) -> Option<String> {
        let all = || self.points.iter().flatten();
        let lost = all().filter(|j| j.errors.rel_rms_net.is_none()).count();
        (lost > 0).then(|| {
            format!(
                "{lost} of {} images differ too little from the reference, whose own relative error is {}, for their error \
                 to be told: allow more by --reference-time",
                all().count(),
                super::words::percent(self.reference.noise())
            )
        })
    }

    /// Number of the setting with these options.
    pub fn number(&self, args: &[String]) -> usize {
        let found = self.settings.iter().position(|s| s == args);
        found.expect("axes are made of the study's settings")
    }

    /// What the points of each setting say.
    pub fn summaries(&self) -> Vec<Summary> {
        let of = |p: &Vec<Judged>| {
            let all: Vec<&Judged> = p.iter().collect();
            summarise(&all, &self.reference, self.clock)
        };
        self.points.iter().map(of).collect()
    }

    /// Seconds at which the settings of an axis can be compared: the most that all of them were measured at.
    pub fn common_time(&self, axis: &Axis) -> Option<f64> {
        let most = |args: &Vec<String>| {
            let p = &self.points[self.number(args)];
            let top = p.iter().map(|j| j.level).max()?;
            let at: Vec<f64> = p
                .iter()
                .filter(|j| j.level == top)
                .map(|j| j.point.seconds(self.clock))
                .collect();
            Some(at.iter().sum::<f64>() / at.len() as f64)
        };
        let each = axis.settings.iter().filter_map(|s| most(&s.args));
        each.reduce(f64::min)
    }
}

#[derive(Serialize)]
struct Json<'a> {
    facts: &'a Facts,
    clock: Clock,
    reference: ReferenceJson<'a>,
    axes: &'a [Axis],
    settings: Vec<SettingJson<'a>>,
}

#[derive(Serialize)]
struct ReferenceJson<'a> {
    origin: &'a str,
    noise: f64,
    commands: &'a [Vec<String>],
}

#[derive(Serialize)]
struct SettingJson<'a> {
    args: &'a [String],
    summary: &'a Summary,
    points: &'a [Judged],
}

/// Writes index.html, study.json and study.csv, each whole or not at all.
///
/// # Errors
/// A file that cannot be written.
pub fn write(study: &Study, store: &Store) -> Result<(), ImageError> {
    let summaries = study.summaries();
    let settings = study.settings.iter().zip(&summaries).zip(&study.points);
    let json = Json {
        facts: &study.facts,
        clock: study.clock,
        reference: ReferenceJson {
            origin: &study.reference.origin,
            noise: study.reference.noise(),
            commands: &study.reference.commands,
        },
        axes: &study.axes,
        settings: settings
            .map(|((args, summary), points)| SettingJson {
                args,
                summary,
                points,
            })
            .collect(),
    };
    store.write_json(&store.file("study.json"), &json)?;
    write_atomic(&store.file("study.csv"), table::csv(study).as_bytes())?;
    let page = html::page(study, &summaries);
    write_atomic(&store.file("index.html"), page.as_bytes())
}
