//! That no two jobs have one name or write one file.

use super::entry::{Entry, Span};
use super::expand::{FILES, Job};
use super::text::{Text, Wrong};
use std::collections::HashMap;
use std::path::PathBuf;

/// Names and files that are taken.
#[derive(Default)]
pub struct Seen {
    names: HashMap<String, Span>,
    files: HashMap<PathBuf, String>,
}

impl Seen {
    /// Takes a job's name and files.
    ///
    /// # Errors
    /// One that another job has taken.
    pub fn add(&mut self, text: &Text, entry: &Entry, job: &Job) -> Result<(), Wrong> {
        let name = entry.name.as_ref().map_or(&entry.span, |n| &n.span);
        if let Some(first) = self.names.insert(job.name.clone(), name.clone()) {
            let e = text.wrong(name, format!("two jobs are called “{}”", job.name));
            let e = e.found(format!("the first at {}", text.at(first.start)));
            return Err(
                e.expected("a name with what tells them apart, such as ${frame} or ${folder}")
            );
        }
        for file in job.args.output.iter().chain(&job.args.stats) {
            if let Some(other) = self.files.insert(file.clone(), job.name.clone()) {
                let choice = entry
                    .options
                    .iter()
                    .find(|o| FILES.contains(&o.key.as_str()));
                let span = choice.map_or(&entry.span, |o| &o.span);
                let e = text.wrong(
                    span,
                    format!("“{}” would write a file that is another's", job.name),
                );
                let found = format!("{}, which “{other}” writes", file.display());
                return Err(e
                    .found(found)
                    .expected("a name with ${name} or ${frame} in it"));
            }
        }
        Ok(())
    }
}
