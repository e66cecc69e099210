//! The Pareto front: which settings nothing beats in both time and error.

use super::super::analyse::{geometric, pareto};
use super::super::words::{percent, time};
use super::Study;
use super::chart::{Chart, Series, Step, escape};
use std::fmt::Write;

/// A mean point of a setting at a level.
struct Place {
    seconds: f64,
    error: f64,
    name: String,
}

fn places(study: &Study) -> Vec<Place> {
    let mut all = Vec::new();
    for (i, points) in study.points.iter().enumerate() {
        // The first axis that has the setting names it.
        let named = study.axes.iter().flat_map(|a| &a.settings);
        let name = named
            .clone()
            .find(|s| study.number(&s.args) == i)
            .map_or("", |s| &s.name);
        let top = points.iter().map(|j| j.level).max().unwrap_or(0);
        for level in 0..=top {
            let at: Vec<_> = points.iter().filter(|j| j.level == level).collect();
            let mean = |f: &dyn Fn(usize) -> Option<f64>| {
                let v: Option<Vec<f64>> = (0..at.len()).map(f).collect();
                geometric(&v?).map(|i| i.value)
            };
            let seconds = mean(&|k| Some(at[k].point.seconds(study.clock)));
            let error = mean(&|k| at[k].errors.rel_rms_net);
            if let (Some(seconds), Some(error)) = (seconds, error) {
                all.push(Place {
                    seconds,
                    error,
                    name: name.to_owned(),
                });
            }
        }
    }
    all
}

/// Chart and list.
pub fn section(study: &Study) -> String {
    let all = places(study);
    let points: Vec<(f64, f64)> = all.iter().map(|p| (p.seconds, p.error)).collect();
    let best = pareto(&points);
    if best.is_empty() {
        return String::new();
    }
    let step = |p: &Place| Step {
        x: p.seconds,
        y: p.error,
        band: None,
        dots: vec![(
            p.seconds,
            p.error,
            format!("{}: {}, {}", p.name, time(p.seconds), percent(p.error)),
        )],
    };
    // One series each, so that no line joins them.
    let cloud = all.iter().enumerate().map(|(i, p)| Series {
        colour: if best.contains(&i) { 0 } else { 7 },
        name: p.name.clone(),
        steps: vec![step(p)],
        floor: None,
    });
    let chart = Chart {
        title: "Error against time of all settings, with the front that nothing beats".into(),
        x: format!("{}, s", study.clock.words()),
        y: "relative error".into(),
        percent: true,
        series: cloud.collect(),
        level: None,
        front: best.iter().map(|i| points[*i]).collect(),
    };
    let mut out = String::from(
        "<section id=\"front\"><h2>What nothing beats</h2><p class=\"answer\">Every setting at every budget; along the \
         line no other one is both faster and more exact.</p><div class=\"pair\"><figure>",
    );
    out.push_str(&chart.svg());
    out.push_str("</figure><div class=\"scroll\"><table><thead><tr><th class=\"n\">time</th><th class=\"n\">error</th><th>setting</th></tr></thead><tbody>");
    for i in best {
        let p = &all[i];
        let _ = write!(
            out,
            "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
            time(p.seconds),
            percent(p.error),
            escape(&p.name)
        );
    }
    out.push_str("</tbody></table></div></div></section>");
    out
}
