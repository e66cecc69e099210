//! What a run tells programs that watch it: events as JSON, one a line.

use super::ImageError;
use serde::Serialize;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Where events go. A line is written whole, by one call.
pub struct Events {
    out: Mutex<Option<Box<dyn Write + Send>>>,
}

#[derive(Serialize)]
struct Line<'a, T> {
    event: &'a str,
    /// Seconds since 1970, UTC.
    time: f64,
    #[serde(flatten)]
    fields: &'a T,
}

impl Events {
    /// To this writer.
    pub fn to(out: Box<dyn Write + Send>) -> Self {
        Self {
            out: Mutex::new(Some(out)),
        }
    }

    /// To the end of a file, so that a run that goes on continues the log.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn to_file(path: &Path) -> Result<Self, ImageError> {
        super::check_writable(path)?;
        let file = OpenOptions::new().append(true).create(true).open(path);
        let file = file.map_err(|source| ImageError::NotWritable {
            path: path.into(),
            source,
        })?;
        Ok(Self::to(Box::new(file)))
    }

    /// Tells an event with its fields, a struct or a map.
    ///
    /// # Errors
    /// Once, where a line cannot be written; what is told from then on is lost silently, so that a full disk stops no run.
    pub fn tell(&self, event: &str, fields: &impl Serialize) -> io::Result<()> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let time = since.map_or(0.0, |t| (t.as_secs_f64() * 1e3).round() / 1e3);
        let line = Line {
            event,
            time,
            fields,
        };
        let mut text = serde_json::to_vec(&line)?;
        text.push(b'\n');
        let mut out = self.out.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(open) = out.as_mut() else {
            return Ok(());
        };
        let written = open.write_all(&text).and_then(|()| open.flush());
        if written.is_err() {
            *out = None;
        }
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn each_event_is_a_line_at_the_end_of_the_file() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("log.jsonl");
        for run in 0..2 {
            let events = Events::to_file(&path).expect("writable");
            let fields = json!({ "run": run, "text": "two\nlines \"quoted\"" });
            events.tell("start", &fields).expect("told");
            events.tell("done", &json!({})).expect("told");
        }
        let text = std::fs::read_to_string(&path).expect("there");
        let lines: Vec<Value> = text
            .lines()
            .map(|l| serde_json::from_str(l).expect("JSON"))
            .collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(
            (&lines[2]["event"], &lines[2]["run"]),
            (&json!("start"), &json!(1))
        );
        assert_eq!(lines[0]["text"], "two\nlines \"quoted\"");
        assert!(lines[3]["time"].as_f64() > Some(1.7e9));
    }

    /// A disk that is full after one line.
    struct Full(bool);

    impl Write for Full {
        fn write(&mut self, b: &[u8]) -> io::Result<usize> {
            if std::mem::replace(&mut self.0, true) {
                return Err(io::ErrorKind::StorageFull.into());
            }
            Ok(b.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_full_disk_is_told_once() {
        let events = Events::to(Box::new(Full(false)));
        let told: Vec<bool> = (0..4)
            .map(|_| events.tell("progress", &json!({})).is_ok())
            .collect();
        assert_eq!(told, [true, false, true, true]);
    }
}
