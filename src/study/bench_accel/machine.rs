//! Where and with what the figures were measured.

use serde::Serialize;

/// Circumstances of a benchmark.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Processor by its own name.
    pub cpu: String,
    /// Processors of this process.
    pub cores: usize,
    /// Memory, bytes.
    pub memory_bytes: u64,
    /// Operating system and kernel.
    pub system: String,
    /// Version of this program.
    pub metrolux: String,
    /// Vector instructions this program was compiled for.
    pub compiled_for: String,
    /// Version of Embree.
    pub embree: String,
    /// Widest vectors Embree traces with here.
    pub embree_isa: String,
    /// Version of obvhs.
    pub obvhs: String,
    /// Load of the machine over the last minute when the benchmark began: 0 is a quiet machine.
    pub load: f64,
}

impl Machine {
    /// This machine.
    pub fn here(embree: String, embree_isa: &str) -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let cpuinfo = read("/proc/cpuinfo");
        let named = |key: &str| {
            let line = cpuinfo.lines().find(|l| l.starts_with(key))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        };
        let family = |key| named(key).unwrap_or_else(|| "?".into());
        let cpu = format!(
            "{} (family {}, model {}, stepping {})",
            family("model name"),
            family("cpu family"),
            named("model\t").unwrap_or_else(|| "?".into()),
            family("stepping"),
        );
        let meminfo = read("/proc/meminfo");
        let kb = meminfo.split_whitespace().nth(1);
        Self {
            cpu,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory_bytes: kb.and_then(|v| v.parse::<u64>().ok()).unwrap_or(0) * 1024,
            system: format!(
                "{} {}",
                std::env::consts::OS,
                read("/proc/sys/kernel/osrelease").trim()
            ),
            metrolux: env!("CARGO_PKG_VERSION").to_owned(),
            compiled_for: compiled_for(),
            embree,
            embree_isa: embree_isa.to_owned(),
            obvhs: locked("obvhs"),
            load: read("/proc/loadavg")
                .split_whitespace()
                .next()
                .and_then(|v| v.parse().ok())
                .unwrap_or(f64::NAN),
        }
    }

    /// One line for each fact.
    pub fn lines(&self) -> Vec<String> {
        vec![
            format!(
                "{}, {} cores, {:.1} GiB, {}",
                self.cpu,
                self.cores,
                self.memory_bytes as f64 / 2f64.powi(30),
                self.system
            ),
            format!(
                "metrolux {} compiled for {}; Embree {} with {}; obvhs {}; load {:.2} at the start",
                self.metrolux,
                self.compiled_for,
                self.embree,
                self.embree_isa,
                self.obvhs,
                self.load
            ),
        ]
    }
}

fn compiled_for() -> String {
    let all = [
        ("sse2", cfg!(target_feature = "sse2")),
        ("sse4.2", cfg!(target_feature = "sse4.2")),
        ("avx", cfg!(target_feature = "avx")),
        ("avx2", cfg!(target_feature = "avx2")),
        ("fma", cfg!(target_feature = "fma")),
        ("avx512f", cfg!(target_feature = "avx512f")),
        ("neon", cfg!(target_feature = "neon")),
    ];
    let on: Vec<&str> = all.iter().filter(|a| a.1).map(|a| a.0).collect();
    format!("{} {}", std::env::consts::ARCH, on.join(" "))
}

/// The version of a library that this program was built with.
fn locked(name: &str) -> String {
    const LOCK: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.lock"));
    let start = format!("name = \"{name}\"\nversion = \"");
    LOCK.split_once(&start)
        .and_then(|(_, rest)| rest.split('"').next())
        .unwrap_or("?")
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lock_file_names_the_library_that_is_used() {
        assert!(locked("obvhs").starts_with("0.4"), "{}", locked("obvhs"));
        assert_eq!(locked("nosuchlibrary"), "?");
    }
}
