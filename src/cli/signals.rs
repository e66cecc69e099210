//! Interrupts and termination requests as flags that a render looks at between rounds.

use super::CliError;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What has been asked of the process.
pub struct Signals {
    stop: Arc<AtomicUsize>,
    show: Arc<AtomicBool>,
    shows: AtomicUsize,
}

impl Signals {
    /// From now on INT and TERM ask to stop, a second one of them exits at once, and HUP asks for what there is.
    ///
    /// # Errors
    /// A system that does not let signals be caught.
    pub fn catch() -> Result<Self, CliError> {
        let again = Arc::new(AtomicBool::new(false));
        let (stop, show) = (Arc::default(), Arc::<AtomicBool>::default());
        let catch = || -> std::io::Result<()> {
            for signal in [SIGINT, SIGTERM] {
                // First in line: it acts only if the flag was set before this signal.
                flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again))?;
                flag::register(signal, Arc::clone(&again))?;
                flag::register_usize(signal, Arc::clone(&stop), signal as usize)?;
            }
            flag::register(SIGHUP, Arc::clone(&show))?;
            Ok(())
        };
        catch().map_err(|e| CliError::Internal(format!("cannot catch signals: {e}")))?;
        Ok(Self {
            stop,
            show,
            shows: AtomicUsize::new(0),
        })
    }

    /// The signal that asked to stop.
    pub fn stop(&self) -> Option<i32> {
        match self.stop.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(signal as i32),
        }
    }

    /// How often what there is has been asked for so far: several renders may listen.
    pub fn shows(&self) -> usize {
        let new = usize::from(self.show.swap(false, Ordering::Relaxed));
        self.shows.fetch_add(new, Ordering::Relaxed) + new
    }
}
