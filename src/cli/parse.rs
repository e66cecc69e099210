//! Values of options: numbers, sizes, times. Each error says what was expected.

use crate::film::MOST_SHARDS;
use std::time::Duration;

/// A number > 0.
pub fn positive(s: &str) -> Result<f64, String> {
    s.parse::<f64>()
        .ok()
        .filter(|v| v.is_finite() && *v > 0.0)
        .ok_or_else(|| "expected a number > 0".into())
}

/// The words of the command line, whatever bytes they are of.
pub fn words() -> impl Iterator<Item = String> {
    let words = std::env::args_os();
    words.map(|w| w.to_string_lossy().into_owned())
}

/// A number that is one.
pub fn finite(s: &str) -> Result<f64, String> {
    let v = s.parse::<f64>().ok();
    v.filter(|v| v.is_finite())
        .ok_or_else(|| "expected a number".into())
}

/// Stops of exposure.
pub fn stops(s: &str) -> Result<f32, String> {
    let v = s.parse::<f32>().ok();
    v.filter(|v| (-100.0..=100.0).contains(v))
        .ok_or_else(|| "expected a number from -100 to 100".into())
}

/// K numbers between separators.
fn numbers<const K: usize>(s: &str, sep: char, what: &str) -> Result<[u32; K], String> {
    let v: Vec<u32> = s
        .split(sep)
        .map(|p| p.trim().parse::<u32>())
        .collect::<Result<_, _>>()
        .map_err(|_| what)?;
    v.try_into().map_err(|_| what.to_owned())
}

/// A count of at least one, and not a slip of the finger.
pub fn positive_count(s: &str) -> Result<usize, String> {
    let n = s.parse::<usize>().ok();
    n.filter(|n| (1..=999).contains(n))
        .ok_or_else(|| "expected a number from 1 to 999".into())
}

/// A number of threads; 0 for one per core. Some hundred thousand, a slip of the finger, would hold up the machine.
pub fn threads(s: &str) -> Result<usize, String> {
    let n = s.parse::<usize>().ok();
    n.filter(|n| *n <= 1024)
        .ok_or_else(|| "expected a number from 1 to 1024".into())
}

/// `WIDTHxHEIGHT` in pixels.
pub fn size(s: &str) -> Result<[u32; 2], String> {
    let v = numbers::<2>(s, 'x', "expected WIDTHxHEIGHT, such as 640x360")?;
    if v.iter().all(|n| (1..=65536).contains(n)) {
        Ok(v)
    } else {
        Err("expected 1 to 65536 pixels each way".into())
    }
}

/// `x0,y0,x1,y1` in pixels.
pub fn region(s: &str) -> Result<[u32; 4], String> {
    numbers::<4>(s, ',', "expected x0,y0,x1,y1 in pixels")
}

/// A time with its unit; seconds if it has none.
pub fn duration(s: &str) -> Result<Duration, String> {
    let wrong = || "expected a time such as 30s, 10m, 1.5h".to_owned();
    let at = s.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(s.len());
    let n: f64 = s[..at].trim().parse().map_err(|_| wrong())?;
    let unit = match &s[at..] {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let t = n * unit;
    if t.is_finite() && t > 0.0 {
        Ok(Duration::from_secs_f64(t))
    } else {
        Err(wrong())
    }
}

/// A number of parts.
pub fn parts(s: &str) -> Result<u32, String> {
    let n = s.parse::<u32>().ok();
    n.filter(|n| (1..=MOST_SHARDS).contains(n))
        .ok_or_else(|| format!("expected a number from 1 to {MOST_SHARDS}"))
}

/// `K/N`, part K of N, as (K − 1, N).
pub fn shard(s: &str) -> Result<(u32, u32), String> {
    let wrong = || format!("expected K/N, such as 2/16: part K of N, 1 <= K <= N <= {MOST_SHARDS}");
    let [k, n] = numbers::<2>(s, '/', "").map_err(|_| wrong())?;
    if (1..=n).contains(&k) && n <= MOST_SHARDS {
        Ok((k - 1, n))
    } else {
        Err(wrong())
    }
}
