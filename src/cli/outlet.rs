//! What a command prints on stdout and tells on stderr. A reader that has seen enough (`metrolux plan SCENE | head -1`) is no
//! fault: the rest goes nowhere, and the command ends as it would have.

use super::CliError;
use std::fmt::Display;
use std::io::{ErrorKind, Result, Stdout, Write, stderr, stdout};

/// Stdout that takes a closed pipe for an open one.
pub struct Outlet<W = Stdout>(W);

impl Outlet {
    /// The process's own.
    pub fn new() -> Self {
        Self(stdout())
    }
}

impl<W: Write> Write for Outlet<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match self.0.write(bytes) {
            Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(bytes.len()),
            done => done,
        }
    }

    fn flush(&mut self) -> Result<()> {
        match self.0.flush() {
            Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
            done => done,
        }
    }
}

/// Prints a line.
///
/// # Errors
///
/// What keeps stdout from taking it, such as a full disk.
pub fn print(line: impl Display) -> std::result::Result<(), CliError> {
    writeln!(Outlet::new(), "{line}").map_err(CliError::Stdout)
}

/// Tells a line on stderr. There is nobody to complain to if that does not take it.
pub fn tell(line: impl Display) {
    let _ = writeln!(stderr(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fails(ErrorKind);

    impl Write for Fails {
        fn write(&mut self, _: &[u8]) -> Result<usize> {
            Err(self.0.into())
        }
        fn flush(&mut self) -> Result<()> {
            Err(self.0.into())
        }
    }

    #[test]
    fn a_closed_pipe_takes_everything_and_a_full_disk_nothing() {
        let mut closed = Outlet(Fails(ErrorKind::BrokenPipe));
        assert!(closed.write_all(b"a line\n").is_ok() && closed.flush().is_ok());
        let mut full = Outlet(Fails(ErrorKind::StorageFull));
        assert!(full.write_all(b"a line\n").is_err() && full.flush().is_err());
    }
}
