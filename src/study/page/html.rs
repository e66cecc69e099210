//! The page itself.

use super::super::analyse::{Judged, Summary, TARGETS, geometric};
use super::super::axes::Axis;
use super::super::flip::auto_gain;
use super::super::words::{answers, percent, time};
use super::chart::{Chart, Series, Step, escape, plain};
use super::{Study, front, picture, table};
use std::fmt::Write;

/// Errors that a reader can choose between: identifier, short name, name on the axis, in per cent, value.
type Metric = (
    &'static str,
    &'static str,
    &'static str,
    bool,
    fn(&Judged) -> Option<f64>,
);

const METRICS: [Metric; 7] = [
    ("rms", "relative RMS", "relative error", true, |j| {
        j.errors.rel_rms_net
    }),
    ("relmse", "relMSE", "relMSE", false, |j| {
        Some(j.errors.rel_mse)
    }),
    ("l1", "l1", "relative l1", true, |j| Some(j.errors.l1)),
    ("l2", "l2", "relative l2", true, |j| Some(j.errors.l2)),
    ("linf", "l∞", "relative l∞", true, |j| {
        Some(j.errors.l_inf)
    }),
    ("mape", "MAPE", "MAPE", true, |j| Some(j.errors.mape)),
    ("flip", "ꟻLIP", "mean ꟻLIP", false, |j| {
        Some(j.errors.flip)
    }),
];

/// All of it as one file that needs nothing else.
pub fn page(study: &Study, summaries: &[Summary]) -> String {
    let name = scene_name(study);
    let mut out = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>{} · what accuracy costs</title><style>{}</style></head><body>",
        escape(&name),
        include_str!("style.css")
    );
    for (i, (id, ..)) in METRICS.iter().enumerate() {
        let checked = if i == 0 { " checked" } else { "" };
        let _ = write!(
            out,
            "<input type=\"radio\" name=\"metric\" id=\"m-{id}\" class=\"choose\"{checked}>"
        );
    }
    header(study, summaries, &name, &mut out);
    out.push_str("<main>");
    for axis in &study.axes {
        section(study, summaries, axis, &mut out);
    }
    out.push_str(&front::section(study));
    points(study, &mut out);
    out.push_str(include_str!("reading.html"));
    out.push_str("</main></body></html>\n");
    out
}

fn scene_name(study: &Study) -> String {
    let path = std::path::Path::new(&study.facts.scene);
    path.file_stem().map_or(study.facts.scene.clone(), |s| {
        s.to_string_lossy().into_owned()
    })
}

fn header(study: &Study, summaries: &[Summary], name: &str, out: &mut String) {
    let gain = auto_gain(&study.reference.image);
    let f = &study.facts;
    let _ = write!(
        out,
        "<header><img class=\"hero\" src=\"{}\" alt=\"the reference image of {}\"><div><p class=\"over\">What accuracy costs in time</p><h1>{}</h1>",
        picture::whole(&study.reference.image, gain),
        escape(name),
        escape(name)
    );
    if let Some(line) = headline(study, summaries) {
        let _ = write!(out, "<p class=\"headline\">{}</p>", escape(&line));
    }
    let images: usize = study.points.iter().map(Vec::len).sum();
    let noise = study.reference.noise();
    let known = if noise > 0.0 {
        format!("relative noise {}", percent(noise))
    } else {
        "taken for exact".into()
    };
    let shared = if f.shared.is_empty() {
        String::new()
    } else {
        format!(" · {}", f.shared.join(" "))
    };
    let _ = write!(
        out,
        "<dl><dt>image</dt><dd>{} × {} px, {} triangles, depth {}{}</dd><dt>measured</dt><dd>{images} images of {} settings on {} threads, by {}</dd>\
         <dt>reference</dt><dd>{}; {known}</dd></dl>",
        f.size[0],
        f.size[1],
        f.triangles,
        f.max_depth,
        escape(&shared),
        study.settings.len(),
        f.threads,
        study.clock.words(),
        escape(&study.reference.origin)
    );
    out.push_str("<nav>");
    for a in &study.axes {
        let _ = write!(out, "<a href=\"#{}\">{}</a>", a.name.name(), a.name.name());
    }
    out.push_str("<a href=\"#front\">front</a><a href=\"#points\">points</a><a href=\"#reading\">reading</a></nav></div></header>");
}

/// The most useful sentence: what the best setting of the first axis needs for 5 %, and the others beside it.
fn headline(study: &Study, summaries: &[Summary]) -> Option<String> {
    let axis = study.axes.first()?;
    let mut known: Vec<(&str, f64, bool)> = axis
        .settings
        .iter()
        .filter_map(|s| {
            let r = summaries[study.number(&s.args)].reach[1]?;
            Some((s.name.as_str(), r.needed.value, r.extrapolated))
        })
        .collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (first, rest) = known.split_first()?;
    let about = |far: bool| if far { "about " } else { "" };
    let mut text = format!(
        "{} in {}{} with {}",
        percent(TARGETS[1]),
        about(first.2),
        time(first.1),
        first.0
    );
    for (name, t, far) in rest {
        let _ = write!(text, ", {}{} with {name}", about(*far), time(*t));
    }
    Some(text + ".")
}

fn section(study: &Study, summaries: &[Summary], axis: &Axis, out: &mut String) {
    let _ = write!(
        out,
        "<section id=\"{}\"><h2>{}</h2><div class=\"pair\"><figure>",
        axis.name.name(),
        axis.name.question()
    );
    out.push_str("<div class=\"tabs\" role=\"group\" aria-label=\"error drawn\">");
    for (id, short, ..) in METRICS {
        let _ = write!(
            out,
            "<label for=\"m-{id}\" class=\"for-{id}\">{short}</label>"
        );
    }
    out.push_str("</div>");
    for metric in METRICS {
        let _ = write!(
            out,
            "<div class=\"chart c-{}\">{}</div>",
            metric.0,
            chart(study, summaries, axis, metric).svg()
        );
    }
    out.push_str("<figcaption class=\"legend\">");
    for (k, s) in axis.settings.iter().enumerate() {
        let _ = write!(out, "<span>{}{}</span>", table::swatch(k), escape(&s.name));
    }
    out.push_str("</figcaption></figure><div class=\"answers\">");
    for line in answers(study, summaries, axis) {
        let _ = write!(out, "<p>{}</p>", escape(&line));
    }
    out.push_str("</div></div>");
    out.push_str(&table::costs(study, summaries, axis));
    gallery(study, axis, out);
    out.push_str("</section>");
}

fn chart(
    study: &Study,
    summaries: &[Summary],
    axis: &Axis,
    (id, _, y, percent, value): Metric,
) -> Chart {
    let series = axis.settings.iter().enumerate().map(|(k, setting)| {
        let i = study.number(&setting.args);
        let points = &study.points[i];
        let top = points.iter().map(|j| j.level).max().unwrap_or(0);
        let steps = (0..=top).filter_map(|level| {
            let at: Vec<(f64, f64)> = points
                .iter()
                .filter(|j| j.level == level)
                .filter_map(|j| Some((j.point.seconds(study.clock), value(j)?)))
                .collect();
            let x = geometric(&at.iter().map(|p| p.0).collect::<Vec<_>>())?.value;
            let mean = geometric(&at.iter().map(|p| p.1).collect::<Vec<_>>())?;
            let dots = at.iter().map(|(t, e)| {
                let shown = if percent {
                    super::super::words::percent(*e)
                } else {
                    plain(*e)
                };
                (*t, *e, format!("{}: {}, {shown}", setting.name, time(*t)))
            });
            Some(Step {
                x,
                y: mean.value,
                band: (at.len() > 1).then_some([mean.low, mean.high]),
                dots: dots.collect(),
            })
        });
        let floor = summaries[i].parts.and_then(|p| p.floor()).map(|f| f.value);
        Series {
            colour: k,
            name: setting.name.clone(),
            steps: steps.collect(),
            floor: floor.filter(|_| id == "rms"),
        }
    });
    let noise = study.reference.noise();
    Chart {
        title: format!(
            "{y} against {} for {}",
            study.clock.words(),
            axis.name.name()
        ),
        x: format!("{}, s", study.clock.words()),
        y: y.into(),
        percent,
        series: series.collect(),
        level: (id == "rms" && noise > 0.0).then(|| (noise, "noise of the reference".into())),
        front: Vec::new(),
    }
}

/// Images after about the same time, with the part that differs most and their errors.
fn gallery(study: &Study, axis: &Axis, out: &mut String) {
    let shown: Vec<_> = axis
        .settings
        .iter()
        .enumerate()
        .filter_map(|(k, s)| {
            let i = study.number(&s.args);
            let (level, image) = study.latest[i].as_ref()?;
            let point = study.points[i]
                .iter()
                .find(|j| j.level == *level && j.point.repeat == 0)?;
            Some((k, s, image, point))
        })
        .collect();
    if shown.is_empty() {
        return;
    }
    let reference = &study.reference.image;
    let gain = auto_gain(reference);
    let images: Vec<_> = shown.iter().map(|(_, _, image, _)| *image).collect();
    let part = picture::most_different(&images, reference);
    let [x, y, size] = part;
    let of = |v: usize, whole: usize| 100.0 * v as f64 / whole as f64;
    let frame = format!(
        "<i class=\"where\" style=\"left:{:.2}%;top:{:.2}%;width:{:.2}%;height:{:.2}%\"></i>",
        of(x, reference.width),
        of(y, reference.height),
        of(size, reference.width),
        of(size, reference.height)
    );
    let _ = write!(
        out,
        "<h3>At about the same time</h3><p class=\"hint\">Each image, the {size} × {size} pixels in which they differ most, and \
         the error: <b class=\"red\">brighter</b> or <b class=\"blue\">darker</b> than the reference, full at a factor of \
         two.</p><div class=\"gallery\">"
    );
    for (k, s, image, j) in shown {
        let _ = write!(
            out,
            "<figure><figcaption>{}<b>{}</b><span>{} · {}</span></figcaption><div class=\"view\"><img src=\"{}\" alt=\"image by {}\">{frame}</div>\
             <div class=\"two\"><img class=\"pixels\" src=\"{}\" alt=\"its part that differs most\"><img src=\"{}\" alt=\"its error\"></div></figure>",
            table::swatch(k),
            escape(&s.name),
            time(j.point.seconds(study.clock)),
            percent(j.errors.rel_rms_net.unwrap_or(j.errors.rel_rms)),
            picture::whole(image, gain),
            escape(&s.name),
            picture::part(image, part, gain),
            picture::difference(image, reference)
        );
    }
    let _ = write!(
        out,
        "<figure><figcaption><b>reference</b></figcaption><div class=\"view\"><img src=\"{}\" alt=\"the reference\">{frame}</div>\
         <div class=\"two\"><img class=\"pixels\" src=\"{}\" alt=\"its part\"></div></figure></div>",
        picture::whole(reference, gain),
        picture::part(reference, part, gain)
    );
}

/// Every point with its command, folded away.
fn points(study: &Study, out: &mut String) {
    out.push_str("<section id=\"points\"><h2>Every point, and how to make it again</h2>");
    let list = |title: &str, commands: &[(String, String)], out: &mut String| {
        let _ = write!(
            out,
            "<details><summary>{} <small>{} images</small></summary><ol>",
            escape(title),
            commands.len()
        );
        for (what, command) in commands {
            let _ = write!(
                out,
                "<li><span>{}</span><code>{}</code></li>",
                escape(what),
                escape(command)
            );
        }
        out.push_str("</ol></details>");
    };
    if !study.reference.commands.is_empty() {
        let parts = study.reference.commands.iter().enumerate();
        let parts: Vec<_> = parts
            .map(|(i, c)| (format!("part {}", i + 1), table::command(c)))
            .collect();
        list("the reference", &parts, out);
    }
    for (args, points) in study.settings.iter().zip(&study.points) {
        let each = points.iter().map(|j| {
            let what = format!(
                "{}, {}",
                time(j.point.seconds(study.clock)),
                percent(j.errors.rel_rms)
            );
            (what, table::command(&j.point.command))
        });
        list(&args.join(" "), &each.collect::<Vec<_>>(), out);
    }
    out.push_str("</section>");
}
