//! Progress as somebody wants to hear it: a bar, lines for a person or an engine, events.

use super::bar::Bar;
use super::voice::{ProgressArg, Voice};
use crate::integrator::Progress;
use crate::study::words::time;
use serde_json::json;
use std::io::Write;
use std::sync::{Mutex, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// Plain lines are so far apart at least.
const LINES: Duration = Duration::from_secs(5);
/// Lines for an engine and events are so far apart at least.
const EVENTS: Duration = Duration::from_secs(1);

/// Progress of one thing.
pub struct Shown<'a> {
    voice: &'a Voice,
    what: &'static str,
    bar: Option<Bar>,
    told: Mutex<Told>,
}

/// What has been told so far.
struct Told {
    begun: Instant,
    /// When the work that is timed began, and how far it was then: a run may go on from a checkpoint.
    first: Option<(Instant, f64)>,
    line: Option<Instant>,
    event: Option<Instant>,
    part: f64,
}

impl<'a> Shown<'a> {
    /// Nothing is done yet.
    pub fn new(voice: &'a Voice, what: &'static str) -> Self {
        let bar = voice.progress == ProgressArg::Auto && !voice.is_quiet();
        Self::with(voice, what, bar.then(|| Bar::new(what, false)))
    }

    /// The same, with a bar that stands already.
    pub fn with(voice: &'a Voice, what: &'static str, bar: Option<Bar>) -> Self {
        Self {
            voice,
            what,
            bar,
            told: Mutex::new(Told {
                begun: Instant::now(),
                first: None,
                line: None,
                event: None,
                part: 0.0,
            }),
        }
    }

    /// The bar, if there is one.
    pub fn bar(&self) -> Option<&Bar> {
        self.bar.as_ref()
    }

    /// Says beside the bar how far it is.
    pub fn say(&self, what: &str) {
        if let Some(bar) = &self.bar {
            bar.say(what);
        }
    }

    /// It is over; `whole` if all was done.
    pub fn finish(&self, whole: bool) {
        if let Some(bar) = &self.bar {
            bar.finish();
        }
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if whole && told.part < 1.0 {
            self.tell(&mut told, self.what, 1.0);
        }
    }

    fn tell(&self, told: &mut Told, what: &str, part: f64) {
        let now = Instant::now();
        let left = match (what == self.what, told.first) {
            (false, _) => None,
            (true, None) => {
                told.first = Some((now, part));
                None
            }
            (true, Some((at, from))) => {
                let spent = now.duration_since(at).as_secs_f64();
                (part > from).then(|| spent * (1.0 - part) / (part - from))
            }
        };
        let over = part >= 1.0 && what == self.what;
        let due = |last: &mut Option<Instant>, apart| {
            let due = over || last.is_none_or(|l| now.duration_since(l) >= apart);
            due.then(|| *last = Some(now)).is_some()
        };
        told.part = if what == self.what { part } else { 0.0 };
        let elapsed = now.duration_since(told.begun).as_secs_f64();
        let to_go = left.map_or(String::new(), |s| format!(", {} to go", time(s)));
        if due(&mut told.event, EVENTS) {
            let fields =
                json!({ "doing": what, "part": part, "seconds": elapsed, "seconds_left": left });
            self.voice.event("progress", &fields);
            if self.voice.progress == ProgressArg::Openjd {
                let percent = 100.0 * told.part;
                let text = format!("openjd_progress: {percent:.1}\nopenjd_status: {what}{to_go}\n");
                let _ = std::io::stdout().lock().write_all(text.as_bytes());
            }
        }
        if self.voice.progress == ProgressArg::Plain && due(&mut told.line, LINES) {
            let (percent, so_far) = (100.0 * part, time(elapsed));
            let _ = writeln!(
                std::io::stderr().lock(),
                "{what} {percent:3.0} %, {so_far} so far{to_go}"
            );
        }
    }

    /// For calls that come often and from many threads: one that finds another at it lets it be.
    fn hear(&self, what: &str, part: f64) {
        let mut told = match self.told.try_lock() {
            Ok(told) => told,
            Err(TryLockError::Poisoned(e)) => e.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        self.tell(&mut told, what, part);
    }
}

impl Progress for Shown<'_> {
    fn update(&self, done: f64) {
        if let Some(bar) = &self.bar {
            bar.update(done);
        }
        self.hear(self.what, done);
    }

    fn building(&self, done: f64) {
        if let Some(bar) = &self.bar {
            bar.building(done);
        }
        self.hear("building", done);
    }
}
