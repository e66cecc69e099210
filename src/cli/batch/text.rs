//! A file of jobs as text, with places in it for messages.

use crate::scene::load::{Fault, Location, SceneError};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// The text of a file.
pub struct Text {
    name: Arc<str>,
    text: String,
}

impl Text {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let name: Arc<str> = path.display().to_string().into();
        let whole = Location {
            file: Arc::clone(&name),
            line: 0,
            column: 0,
        };
        let text = std::fs::read_to_string(path).map_err(|e| SceneError {
            at: whole,
            fault: Fault::File,
            message: format!("cannot be read: {e}"),
            found: None,
            expected: None,
        })?;
        Ok(Self { name, text })
    }

    /// A text that is no file.
    #[cfg(test)]
    pub fn of(text: &str) -> Self {
        let name = "jobs.toml".into();
        let text = text.to_owned();
        Self { name, text }
    }

    /// All of it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The place of a byte.
    pub fn at(&self, byte: usize) -> Location {
        let before = self.text.get(..byte).unwrap_or(&self.text);
        let start = before.rfind('\n').map_or(0, |n| n + 1);
        Location {
            file: Arc::clone(&self.name),
            line: before.matches('\n').count() as u32 + 1,
            column: (before.len() - start) as u32 + 1,
        }
    }

    /// Something wrong at a place.
    pub fn wrong(&self, span: &Range<usize>, message: impl Into<String>) -> Wrong {
        Wrong(SceneError {
            at: self.at(span.start),
            fault: Fault::Value,
            message: message.into(),
            found: None,
            expected: None,
        })
    }
}

/// A mistake in the file, while it is being put into words.
pub struct Wrong(SceneError);

impl Wrong {
    /// What stands there.
    pub fn found(mut self, found: impl ToString) -> Self {
        self.0.found = Some(found.to_string());
        self
    }

    /// What would be right.
    pub fn expected(mut self, expected: impl ToString) -> Self {
        self.0.expected = Some(expected.to_string());
        self
    }
}

impl From<Wrong> for SceneError {
    fn from(w: Wrong) -> Self {
        w.0
    }
}

impl From<Wrong> for crate::cli::CliError {
    fn from(w: Wrong) -> Self {
        Self::Scene(w.0)
    }
}
