//! How a command tells of itself: messages to a person on stderr, events to a program, progress to either.

use super::CliError;
use super::progress::Shown;
use crate::output::Events;
use clap::{Args, ValueEnum};
use indicatif::MultiProgress;
use serde::Serialize;
use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// How progress is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressArg {
    /// A bar on a terminal, nothing elsewhere
    #[default]
    Auto,
    /// A line on stderr every few seconds
    Plain,
    /// Lines on stdout that Open Job Description understands
    Openjd,
    /// Nothing
    None,
}

/// Where events go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LogArg {
    /// To stderr, in place of messages.
    Stderr,
    /// To the end of a file.
    File(PathBuf),
}

fn log(s: &str) -> Result<LogArg, String> {
    match s.split_once('=') {
        None if s == "json" => Ok(LogArg::Stderr),
        Some(("json", file)) if !file.is_empty() => Ok(LogArg::File(file.into())),
        _ => Err("expected json or json=FILE".into()),
    }
}

/// Options of commands that tell of themselves.
#[derive(Args, Clone, Debug, Default)]
pub struct VoiceArgs {
    /// How progress is shown
    #[arg(long, value_enum, default_value = "auto")]
    pub progress: ProgressArg,
    /// Tell events as JSON, one a line: on stderr, which then has nothing else, or at the end of FILE
    #[arg(long, value_name = "json[=FILE]", value_parser = log)]
    pub log: Option<LogArg>,
}

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Good to know.
    Note,
    /// Something may not be as wanted.
    Warning,
    /// Something is not as wanted.
    Error,
}

/// What a command tells.
#[derive(Clone)]
pub struct Voice {
    quiet: bool,
    /// How progress is shown.
    pub progress: ProgressArg,
    logs: Vec<Arc<Events>>,
    /// stderr has events and nothing else.
    bare: bool,
    begun: Instant,
    /// The job of a batch that this is the voice of.
    job: Option<Arc<str>>,
    /// Bars that stand where messages go.
    bars: Option<MultiProgress>,
}

/// An event's fields, and whose they are.
#[derive(Serialize)]
struct Of<'a, T> {
    #[serde(skip_serializing_if = "Option::is_none")]
    job: Option<&'a str>,
    #[serde(flatten)]
    fields: &'a T,
}

impl Voice {
    /// Opens the log.
    ///
    /// # Errors
    /// A log that cannot be written.
    pub fn new(args: &VoiceArgs, quiet: bool) -> Result<Self, CliError> {
        if args.log == Some(LogArg::Stderr) && args.progress == ProgressArg::Plain {
            let text = "--log json and --progress plain both go to stderr: expected --log json=FILE, or no --progress plain";
            return Err(CliError::Usage(text.into()));
        }
        let log = match &args.log {
            None => None,
            Some(LogArg::Stderr) => Some(Events::to(Box::new(std::io::stderr()))),
            Some(LogArg::File(file)) => Some(Events::to_file(file)?),
        };
        Ok(Self {
            quiet,
            progress: args.progress,
            logs: log.into_iter().map(Arc::new).collect(),
            bare: args.log == Some(LogArg::Stderr),
            begun: Instant::now(),
            job: None,
            bars: None,
        })
    }

    /// Tells its events there too.
    pub fn also_to(mut self, log: Events) -> Self {
        self.logs.push(Arc::new(log));
        self
    }

    /// Messages go above these bars.
    pub fn above(mut self, bars: Option<MultiProgress>) -> Self {
        self.bars = bars;
        self
    }

    /// The bars that stand where messages go.
    pub fn bars(&self) -> Option<&MultiProgress> {
        self.bars.as_ref()
    }

    /// The voice of a job among many: its name is with everything it tells, and what is only good to know is left to events.
    pub fn of_job(&self, name: &str) -> Self {
        Self {
            job: Some(name.into()),
            progress: ProgressArg::None,
            ..self.clone()
        }
    }

    /// Nobody is listening to messages, nor to a bar.
    pub fn is_quiet(&self) -> bool {
        self.quiet || self.bare
    }

    /// A message; `--quiet` leaves out what is no error.
    pub fn say(&self, level: Level, text: &str) {
        let wanted = !self.quiet && (self.job.is_none() || level != Level::Note);
        self.message(level, text, wanted || level == Level::Error);
    }

    /// A message that `--quiet` does not leave out.
    pub fn insist(&self, level: Level, text: &str) {
        self.message(level, text, true);
    }

    fn message(&self, level: Level, text: &str, shown: bool) {
        self.event("message", &json!({ "level": level, "text": text }));
        if self.bare || !shown {
            return;
        }
        let before = match level {
            Level::Note => "",
            Level::Warning => "warning: ",
            Level::Error => "error: ",
        };
        let of = self
            .job
            .as_ref()
            .map_or(String::new(), |j| format!("{j}: "));
        self.print(&format!("{before}{of}{text}"));
    }

    fn print(&self, line: &str) {
        // A reader that went away is no reason to stop.
        let print = || {
            let _ = writeln!(std::io::stderr().lock(), "{line}");
        };
        match &self.bars {
            Some(bars) => bars.suspend(print),
            None => print(),
        }
    }

    /// An event with its fields, for a program.
    pub fn event(&self, name: &str, fields: &impl Serialize) {
        let job = self.job.as_deref();
        for log in &self.logs {
            if let Err(e) = log.tell(name, &Of { job, fields })
                && !self.bare
            {
                let text = "warning: the log cannot be written";
                self.print(&format!("{text}: {e}; the work goes on"));
            }
        }
    }

    /// Progress of something, shown as asked for.
    pub fn shown(&self, what: &'static str) -> Shown<'_> {
        Shown::new(self, what)
    }

    /// Tells how it ended, and turns that into the exit code.
    pub fn conclude(&self, ended: Result<u8, CliError>) -> ExitCode {
        let code = ended.unwrap_or_else(|e| {
            let text = e.to_string();
            self.say(Level::Error, &text);
            if self.progress == ProgressArg::Openjd {
                let line = text.replace('\n', " ");
                let _ = writeln!(std::io::stdout().lock(), "openjd_fail: {line}");
            }
            e.code()
        });
        let seconds = self.begun.elapsed().as_secs_f64();
        self.event("done", &json!({ "code": code, "seconds": seconds }));
        ExitCode::from(code)
    }
}
