//! What a study found, in words and figures.

use super::analyse::{Errors, Summary, TARGETS};
use super::axes::{Axis, AxisName};
use super::fit::{Reach, fit};
use super::interval::Interval;
use super::page::Study;
use std::fmt::Write;

/// A time with the unit that suits its size, two or three digits.
pub fn time(seconds: f64) -> String {
    let (v, unit) = match seconds {
        s if s < 0.0995 => (s * 1e3, "ms"),
        s if s < 99.5 => (s, "s"),
        s if s < 99.5 * 60.0 => (s / 60.0, "min"),
        s if s < 72.0 * 3600.0 => (s / 3600.0, "h"),
        s if s < 1000.0 * 86400.0 => (s / 86400.0, "days"),
        _ => return "years".into(),
    };
    format!("{} {unit}", digits(v))
}

/// Two digits, three from 100 on.
pub fn digits(v: f64) -> String {
    if !v.is_finite() {
        return if v.is_nan() { "?".into() } else { "∞".into() };
    }
    if v == 0.0 {
        return "0".into();
    }
    let places = (1 - v.abs().log10().floor() as i32).max(0) as usize;
    format!("{v:.places$}")
}

/// Per cent.
pub fn percent(v: f64) -> String {
    format!("{} %", digits(100.0 * v))
}

/// A value with its bounds in brackets, all by `f`.
pub fn bounds(i: Interval, f: impl Fn(f64) -> String) -> String {
    format!("{} ({} to {})", f(i.value), f(i.low), f(i.high))
}

/// Squared error × time of a setting at its highest budget over that of the axis's first: how much longer it takes for the
/// same error where both fall as 1/√time.
pub fn longer(first: &Summary, other: &Summary) -> Option<Interval> {
    let (a, b) = (first.efficiency?, other.efficiency?);
    let half = |i: Interval| 0.5 * (i.high / i.low).ln();
    let ratio = (a.value / b.value).ln();
    let both = half(a).hypot(half(b));
    (ratio.is_finite() && both.is_finite()).then(|| Interval::around(ratio, both).map(f64::exp))
}

/// The answers an axis gives, a sentence each.
pub fn answers(study: &Study, summaries: &[Summary], axis: &Axis) -> Vec<String> {
    let of = |k: usize| &summaries[study.number(&axis.settings[k].args)];
    let name = |k: usize| axis.settings[k].name.as_str();
    let all = 0..axis.settings.len();
    let mut said = Vec::new();
    if let Some(t) = study.common_time(axis) {
        let mut errors: Vec<(usize, Interval)> = all
            .clone()
            .filter_map(|k| Some((k, of(k).error_after(t)?)))
            .collect();
        errors.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let each = errors
            .iter()
            .map(|(k, e)| format!("{} {}", name(*k), bounds(*e, percent)));
        let each: Vec<String> = each.collect();
        if !each.is_empty() {
            said.push(format!("Error after {}: {}.", time(t), each.join(", ")));
        }
    }
    if axis.name == AxisName::Integrator {
        said.extend(veach(study, summaries, axis));
    }
    let (mut slower, mut faster, mut same) = (Vec::new(), Vec::new(), Vec::new());
    for k in all.clone().skip(1) {
        // What has a floor never gets to the same error.
        if of(k).parts.and_then(|p| p.floor()).is_some() {
            continue;
        }
        if let Some(r) = longer(of(0), of(k)) {
            let text = format!("{} {}", name(k), bounds(r, digits));
            if r.low > 1.0 {
                slower.push(text);
            } else if r.high < 1.0 {
                faster.push(text);
            } else {
                same.push(text);
            }
        }
    }
    for (list, which) in [(slower, "more"), (faster, "less"), (same, "not told apart")] {
        if !list.is_empty() {
            let (first, list) = (name(0), list.join(", "));
            said.push(format!(
                "Squared error × time at the highest budget over that of {first}, {which}: {list}."
            ));
        }
    }
    for k in all {
        if let Some(f) = of(k).parts.and_then(|p| p.floor()) {
            let why = axis.settings[k]
                .biased
                .as_ref()
                .map_or(String::new(), |w| format!(" ({w})"));
            said.push(format!(
                "{} stays {} off, however long it runs{why}.",
                name(k),
                bounds(f, percent)
            ));
        }
    }
    said
}

/// Relative l1, l2 and l∞ of each setting over those of the first, after the same time: the figures of Veach and Guibas 1997.
fn veach(study: &Study, summaries: &[Summary], axis: &Axis) -> Option<String> {
    let t = study.common_time(axis)?;
    let after = |k: usize, of: fn(&Errors) -> f64| {
        let i = study.number(&axis.settings[k].args);
        let points = study.points[i].iter();
        let points: Vec<(f64, f64)> = points
            .map(|j| (j.point.rounds as f64, of(&j.errors)))
            .collect();
        let line = fit(&points)?;
        Some(line.error_at(summaries[i].pace.work(t)).value)
    };
    let norms: [fn(&Errors) -> f64; 3] = [|e| e.l1, |e| e.l2, |e| e.l_inf];
    let each = (1..axis.settings.len()).filter_map(|k| {
        let ratio = norms.map(|n| Some(after(k, n)? / after(0, n)?));
        let [Some(l1), Some(l2), Some(l_inf)] = ratio else {
            return None;
        };
        let name = &axis.settings[k].name;
        Some(format!(
            "{name} {}, {}, {}",
            digits(l1),
            digits(l2),
            digits(l_inf)
        ))
    });
    let each: Vec<String> = each.collect();
    let first = &axis.settings[0].name;
    let text = format!(
        "Then relative l1, l2, l∞ over those of {first}: {}.",
        each.join("; ")
    );
    (!each.is_empty()).then_some(text)
}

/// A time to reach an error, of a setting whose curve is known or not.
pub fn reach(r: Option<Reach>, known: bool) -> String {
    let Some(r) = r else {
        return if known { "never" } else { "not known" }.into();
    };
    let mark = if r.extrapolated { " *" } else { "" };
    format!("{}{mark}", bounds(r.needed, time))
}

/// Everything for a terminal.
pub fn report(study: &Study) -> String {
    let summaries = study.summaries();
    let mut out = String::new();
    for axis in &study.axes {
        let _ = writeln!(out, "\n{}", axis.name.question());
        for s in answers(study, &summaries, axis) {
            let _ = writeln!(out, "  {s}");
        }
        let width = axis
            .settings
            .iter()
            .map(|s| s.name.chars().count())
            .max()
            .unwrap_or(0);
        let _ = writeln!(out, "  Time to reach an error of");
        for s in &axis.settings {
            let of = &summaries[study.number(&s.args)];
            let each = TARGETS.iter().zip(of.reach);
            let known = of.fit.is_some();
            let each = each.map(|(e, r)| format!("{}: {}", percent(*e), reach(r, known)));
            let each: Vec<String> = each.collect();
            let _ = writeln!(out, "    {:width$}  {}", s.name, each.join("; "));
        }
    }
    let _ = writeln!(
        out,
        "  * beyond what was measured; intervals hold with 95 %"
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_read_well() {
        let times = [
            (0.0123, "12 ms"),
            (3.21, "3.2 s"),
            (99.0, "99 s"),
            (600.0, "10 min"),
            (1e5, "28 h"),
            (1e12, "years"),
        ];
        for (t, text) in times {
            assert_eq!(time(t), text);
        }
        assert_eq!(percent(0.0512), "5.1 %");
        assert_eq!(
            bounds(Interval::around(0.1, 0.02), percent),
            "10 % (8.0 % to 12 %)"
        );
        let needed = Interval::exact(90.0);
        assert_eq!(
            reach(
                Some(Reach {
                    needed,
                    extrapolated: true
                }),
                true
            ),
            "90 s (90 s to 90 s) *"
        );
        assert_eq!(reach(None, true), "never");
        assert_eq!(reach(None, false), "not known");
        let summary = |e: f64| Summary {
            efficiency: Some(Interval {
                value: e,
                low: e / 2.0,
                high: e * 2.0,
            }),
            ..Summary::default()
        };
        let r = longer(&summary(6.0), &summary(2.0)).expect("both known");
        assert!(
            (r.value - 3.0).abs() < 1e-12 && (r.high / 3.0 - 2f64.powf(2f64.sqrt())).abs() < 1e-9
        );
    }
}
