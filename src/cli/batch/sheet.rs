//! A page with all images of a batch, in one file that needs nothing else.

use super::BatchArgs;
use super::expand::Job;
use super::store::{Done, Store};
use super::table::word;
use super::work::{How, Outcome};
use crate::cli::CliError;
use crate::cli::replay::quoted;
use crate::output::write_streamed;
use crate::study::page::escape;
use crate::study::words::{percent, time};
use std::io::{self, Write};

/// Writes the page. Pictures come from what is kept of each job, one at a time.
///
/// # Errors
/// A page that cannot be written.
pub fn write(
    args: &BatchArgs,
    store: &Store,
    jobs: &[Job],
    outcomes: &[Option<Outcome>],
) -> Result<(), CliError> {
    let title = args.file.file_stem().unwrap_or_default().to_string_lossy();
    let page = store.file("index.html");
    write_streamed(&page, &mut |out| {
        head(&title, jobs, outcomes, out)?;
        for (number, (job, outcome)) in jobs.iter().zip(outcomes).enumerate() {
            card(number, job, outcome.as_ref(), store.read(&job.name), out)?;
        }
        out.write_all(b"</main></body></html>\n")
    })?;
    Ok(())
}

fn head(
    title: &str,
    jobs: &[Job],
    outcomes: &[Option<Outcome>],
    out: &mut dyn Write,
) -> io::Result<()> {
    let title = escape(title);
    write!(
        out,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>{title} · batch</title><style>{}</style></head>\
         <body><header><h1>{title}</h1>",
        include_str!("sheet.css")
    )?;
    let all = || outcomes.iter().flatten();
    let done = all().filter(|o| is_done(&o.how));
    let seconds: f64 = done.clone().map(|o| o.seconds).sum();
    let failed = all().filter(|o| matches!(o.how, How::Failed(_))).count();
    let wrong = if failed > 0 {
        format!(", {failed} failed")
    } else {
        String::new()
    };
    write!(
        out,
        "<p>{} of {} images{wrong} · {} of rendering</p>",
        done.count(),
        jobs.len(),
        time(seconds)
    )?;
    if failed > 0 {
        out.write_all(b"<ul class=\"wrong\">")?;
        for (number, (job, outcome)) in jobs.iter().zip(outcomes).enumerate() {
            if let Some(How::Failed(why)) = outcome.as_ref().map(|o| &o.how) {
                let (name, why) = (escape(&job.name), escape(why));
                write!(out, "<li><a href=\"#j{number}\">{name}</a> {why}</li>")?;
            }
        }
        out.write_all(b"</ul>")?;
    }
    out.write_all(b"</header><main>")
}

fn is_done(how: &How) -> bool {
    matches!(how, How::Rendered | How::Resumed | How::Unchanged)
}

fn card(
    number: usize,
    job: &Job,
    outcome: Option<&Outcome>,
    kept: Option<Done>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let name = escape(&job.name);
    let how = outcome.map_or(&How::NotBegun, |o| &o.how);
    let done = is_done(how);
    write!(out, "<article id=\"j{number}\"><div class=\"picture\">")?;
    match &kept {
        Some(k) => write!(
            out,
            "<img loading=\"lazy\" src=\"{}\" alt=\"{name}\">",
            k.picture
        )?,
        None => out.write_all(b"<span>no image</span>")?,
    }
    write!(out, "</div><div class=\"said\"><h2>{name}</h2>")?;
    match (&kept, done) {
        (Some(k), true) => {
            let error = k
                .error
                .map_or(String::new(), |e| format!(" · error {}", percent(e)));
            let [w, h] = k.size;
            write!(out, "<p>{w} × {h} · {}{error}</p>", time(k.seconds))?;
            if k.code == 3 {
                out.write_all(b"<p class=\"failed\">faults were counted</p>")?;
            }
            write!(out, "<p>{}</p>", word(how))?;
        }
        (kept, _) => {
            let class = word(how).replace(' ', "-");
            let old = if kept.is_some() {
                "; the picture is an earlier one"
            } else {
                ""
            };
            let text = match how {
                How::Failed(why) => escape(why),
                other => word(other).into(),
            };
            write!(out, "<p class=\"{class}\">{text}{old}</p>")?;
        }
    }
    let words: Vec<String> = job.words.iter().map(|w| quoted(w)).collect();
    let command = escape(&words.join(" "));
    write!(
        out,
        "<details><summary>command</summary><code>metrolux render {command}</code></details></div></article>"
    )
}
