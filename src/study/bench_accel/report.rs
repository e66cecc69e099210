//! The figures as a table, as CSV and as JSON.

use super::machine::Machine;
use super::measure::{Clock, Spread};
use serde::Serialize;
use std::fmt::Write;

/// One build.
#[derive(Clone, Debug, Serialize)]
pub struct BuildRow {
    /// Scene or ray file.
    pub scene: String,
    /// Key of the contender.
    pub contender: String,
    /// Threads.
    pub threads: usize,
    /// Triangles and quadrics.
    pub primitives: usize,
    /// Wall time, s.
    pub seconds: Spread,
    /// Held when built, beside the geometry.
    pub bytes: usize,
    /// The same for each primitive.
    pub bytes_per_primitive: f64,
    /// Most resident memory more than before the build, bytes, if it was measured.
    pub peak_bytes: Option<u64>,
}

/// One contender on one set.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedRow {
    /// Scene or ray file.
    pub scene: String,
    /// Set and kind.
    pub set: String,
    /// Key of the contender.
    pub contender: String,
    /// Threads.
    pub threads: usize,
    /// Rays of the set.
    pub rays: usize,
    /// Those that hit something.
    pub hits: u64,
    /// Over the turns.
    pub rays_per_second: Spread,
    /// Speed over that of the first contender in the same turn.
    pub ratio: Spread,
    /// Speed over that of the fewest threads, for each thread.
    pub efficiency: f64,
}

/// All figures of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Circumstances.
    pub machine: Machine,
    /// What time was measured by; builds always by the wall.
    pub clock: Clock,
    /// Turns of each contender.
    pub turns: usize,
    /// Least time of a turn, s.
    pub least_seconds: f64,
    /// Builds.
    pub builds: Vec<BuildRow>,
    /// Speeds.
    pub speeds: Vec<SpeedRow>,
}

/// Different values of a column in the order they appear.
pub(super) fn distinct<'a, T>(rows: &'a [T], of: impl Fn(&'a T) -> &'a str) -> Vec<&'a str> {
    let mut seen: Vec<&str> = Vec::new();
    for r in rows {
        if !seen.contains(&of(r)) {
            seen.push(of(r));
        }
    }
    seen
}

impl Report {
    /// Scenes in the order they were measured.
    pub fn scenes(&self) -> Vec<&str> {
        distinct(&self.builds, |b| &b.scene)
    }

    /// For a terminal: builds, then speeds, scene by scene.
    pub fn table(&self) -> String {
        let mut out = self.machine.lines().join("\n");
        let _ = writeln!(
            out,
            "\n{} turns of at least {:.0} ms, {} time; median (quartiles)\n",
            self.turns,
            1e3 * self.least_seconds,
            self.clock.word()
        );
        for scene in self.scenes() {
            let builds: Vec<&BuildRow> = self.builds.iter().filter(|b| b.scene == scene).collect();
            let _ = writeln!(
                out,
                "{scene}: {} primitives\n{:<32} {:>7} {:>22} {:>10} {:>8} {:>10}",
                builds[0].primitives, "build", "threads", "s", "MB", "B/prim", "peak MB"
            );
            for b in builds {
                let _ = writeln!(
                    out,
                    "{:<32} {:>7} {:>22} {:>10.1} {:>8.1} {:>10}",
                    b.contender,
                    b.threads,
                    told(b.seconds, 1.0, 3),
                    b.bytes as f64 * 1e-6,
                    b.bytes_per_primitive,
                    megabytes(b.peak_bytes)
                );
            }
            let speeds: Vec<&SpeedRow> = self.speeds.iter().filter(|s| s.scene == scene).collect();
            for set in distinct(&self.speeds, |s| &s.set) {
                let rows: Vec<&&SpeedRow> = speeds.iter().filter(|s| s.set == set).collect();
                let Some(first) = rows.first() else { continue };
                let _ = writeln!(
                    out,
                    "\n{:<32} {:>7} {:>22} {:>22} {:>6}",
                    format!("{set} ({} rays)", first.rays),
                    "threads",
                    "Mrays/s",
                    format!("× {}", first.contender),
                    "eff."
                );
                for s in rows {
                    let _ = writeln!(
                        out,
                        "{:<32} {:>7} {:>22} {:>22} {:>6.3}",
                        s.contender,
                        s.threads,
                        told(s.rays_per_second, 1e-6, 2),
                        told(s.ratio, 1.0, 3),
                        s.efficiency
                    );
                }
            }
            out.push('\n');
        }
        out
    }

    /// Builds and speeds in one table; columns that do not apply are empty.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "scene,what,contender,threads,primitives,rays,hits,median,low,high,ratio,ratio_low,ratio_high,efficiency,\
             bytes,peak_bytes\n",
        );
        for b in &self.builds {
            let s = b.seconds;
            let _ = writeln!(
                out,
                "{},build seconds,{},{},{},,,{},{},{},,,,,{},{}",
                quoted(&b.scene),
                b.contender,
                b.threads,
                b.primitives,
                s.median,
                s.low,
                s.high,
                b.bytes,
                b.peak_bytes.unwrap_or(0)
            );
        }
        for r in &self.speeds {
            let (s, q) = (r.rays_per_second, r.ratio);
            let _ = writeln!(
                out,
                "{},{} rays/s,{},{},,{},{},{},{},{},{},{},{},{},,",
                quoted(&r.scene),
                r.set,
                r.contender,
                r.threads,
                r.rays,
                r.hits,
                s.median,
                s.low,
                s.high,
                q.median,
                q.low,
                q.high,
                r.efficiency
            );
        }
        out
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// "median (low–high)".
pub(super) fn told(s: Spread, factor: f64, digits: usize) -> String {
    let [m, l, h] = [s.median, s.low, s.high].map(|v| v * factor);
    format!("{m:.digits$} ({l:.digits$}–{h:.digits$})")
}

pub(super) fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or("–".into(), |b| format!("{:.1}", b as f64 * 1e-6))
}
