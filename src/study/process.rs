//! What this process has used so far: processor time and memory.

use rustix::time::{ClockId, clock_gettime};

/// Seconds of processor time of all its threads, of those that have ended too. Of others that run at this moment the last
/// few milliseconds may be missing.
pub fn processor_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// The most memory it had resident since [`forget_peak`], bytes; 0 where the system does not tell.
pub fn peak_bytes() -> u64 {
    status("VmHWM:")
}

/// What it has now, bytes; 0 where the system does not tell.
pub fn resident_bytes() -> u64 {
    status("VmRSS:")
}

/// Lets the peak start again from what is resident; false where the system does not allow it.
pub fn forget_peak() -> bool {
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// Memory and swap of the machine, bytes; 0 where the system does not tell.
pub fn machine_bytes() -> u64 {
    let of = |key| kilobytes("/proc/meminfo", key);
    of("MemTotal:") + of("SwapTotal:")
}

fn status(key: &str) -> u64 {
    kilobytes("/proc/self/status", key)
}

/// A line of a file that is the system's, in bytes.
fn kilobytes(file: &str, key: &str) -> u64 {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix(key));
    let kb = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    kb.unwrap_or(0) * 1024
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Each render of a study has threads of its own, which end at some time after it.
    #[test]
    fn the_time_of_threads_that_have_ended_is_kept() {
        const BUSY: Duration = Duration::from_millis(30);
        let own = || Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).expect("a time");
        let begun = processor_seconds();
        for n in 1..=3 {
            let busy = move || {
                while own() < BUSY {
                    std::hint::spin_loop();
                }
            };
            std::thread::spawn(busy).join().expect("it ended");
            let spent = processor_seconds() - begun;
            assert!(spent >= n as f64 * BUSY.as_secs_f64(), "{spent} after {n}");
        }
    }

    #[test]
    fn there_was_at_least_as_much_memory_as_there_is() {
        let now = resident_bytes();
        assert!(now > 0 && peak_bytes() >= now);
        assert!(machine_bytes() > now);
    }
}
