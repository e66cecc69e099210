//! What is wrong with a scene file, and where.

use std::fmt;
use std::sync::Arc;

/// A place in a file. Lines and columns count from 1, columns in bytes; 0 means the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Location {
    /// File name as the user would write it.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1.
    pub column: u32,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        if self.column > 0 {
            write!(f, ":{}", self.column)?;
        }
        Ok(())
    }
}

/// Whose fault an error is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The text does not follow the grammar.
    Syntax,
    /// A value that cannot be.
    Value,
    /// Legal pbrt-v4, but not rendered here. `lenient` turns these into warnings.
    Unsupported,
    /// A file is missing, unreadable or broken.
    File,
}

/// An error of a scene file: `file:line:column: message (found …, expected …)`.
#[derive(Debug, thiserror::Error)]
#[error("{at}: {message}{}", aside(.found, .expected))]
pub struct SceneError {
    /// Where.
    pub at: Location,
    /// Whose fault.
    pub fault: Fault,
    /// What is wrong.
    pub message: String,
    /// What stands there.
    pub found: Option<String>,
    /// What would be right.
    pub expected: Option<String>,
}

fn aside(found: &Option<String>, expected: &Option<String>) -> String {
    match (found, expected) {
        (None, None) => String::new(),
        (Some(f), None) => format!(" (found {f})"),
        (None, Some(e)) => format!(" (expected {e})"),
        (Some(f), Some(e)) => format!(" (found {f}, expected {e})"),
    }
}

impl SceneError {
    fn new(at: &Location, fault: Fault, message: impl Into<String>) -> Self {
        Self {
            at: at.clone(),
            fault,
            message: message.into(),
            found: None,
            expected: None,
        }
    }

    pub(super) fn syntax(at: &Location, message: impl Into<String>) -> Self {
        Self::new(at, Fault::Syntax, message)
    }

    pub(super) fn value(at: &Location, message: impl Into<String>) -> Self {
        Self::new(at, Fault::Value, message)
    }

    pub(super) fn unsupported(at: &Location, message: impl Into<String>) -> Self {
        Self::new(at, Fault::Unsupported, message)
    }

    pub(super) fn file(at: &Location, message: impl Into<String>) -> Self {
        Self::new(at, Fault::File, message)
    }

    pub(super) fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = Some(found.to_string());
        self
    }

    pub(super) fn expected(mut self, expected: impl fmt::Display) -> Self {
        self.expected = Some(expected.to_string());
        self
    }
}

/// The loader's result.
pub(super) type Result<T> = std::result::Result<T, SceneError>;
