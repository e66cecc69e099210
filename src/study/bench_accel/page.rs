//! The figures as a page that stands for itself.

use super::report::{BuildRow, Report, SpeedRow, distinct, megabytes, told};
use std::fmt::Write;

const STYLE: &str = "\
:root{--ink:#1a1a1a;--soft:#666;--line:#d8d8d8;--paper:#fff;--embree:#0072b2;--obvhs:#d55e00}\
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e8;--soft:#a0a0a0;--line:#3a3a3a;--paper:#161616;\
--embree:#56b4e9;--obvhs:#e69f00}}\
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:70rem;margin:2rem auto;\
padding:0 1rem}\
h1{font-size:1.6rem}h2{font-size:1.25rem;margin-top:2.5rem;border-top:1px solid var(--line);padding-top:1rem}\
h3{font-size:1rem;margin:1.5rem 0 .3rem}p.note{color:var(--soft);max-width:46rem}\
svg{max-width:100%;height:auto}svg text{font:12px system-ui,sans-serif;fill:var(--ink)}\
svg .soft{fill:var(--soft)}svg line{stroke:var(--line)}svg .whisker{stroke:var(--ink)}\
.embree{fill:var(--embree)}.obvhs{fill:var(--obvhs)}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.85rem}\
td,th{padding:.15rem .6rem;text-align:right;border-bottom:1px solid var(--line)}td:first-child,th:first-child{text-align:left}\
div.wide{overflow-x:auto}summary{cursor:pointer;color:var(--soft)}";

/// Width of names, of a bar of full length, and of the figures behind it; height of a row.
const NAME: f64 = 230.0;
const BAR: f64 = 430.0;
const FIGURE: f64 = 220.0;
const ROW: f64 = 20.0;

impl Report {
    /// The page.
    pub fn page(&self) -> String {
        let mut out = format!(
            "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>\
             <title>metrolux: Embree and obvhs</title><style>{STYLE}</style><h1>Embree and obvhs on the same rays</h1>"
        );
        for line in self.machine.lines() {
            let _ = write!(out, "<p>{}</p>", text(&line));
        }
        let _ = write!(
            out,
            "<p class=note>Bars are medians of {} turns of at least {:.0} ms by {} time, thin lines the quartiles. The contenders \
             take turns, so a machine that slows down slows all of them; the ratio is that of two times in the same \
             turn. A rate is that of asking which primitive is nearest, or whether any is in the way: no shading.</p>",
            self.turns,
            1e3 * self.least_seconds,
            self.clock.word()
        );
        for scene in self.scenes() {
            self.scene(scene, &mut out);
        }
        out.push_str("</html>\n");
        out
    }

    fn scene(&self, scene: &str, out: &mut String) {
        let builds: Vec<&BuildRow> = self.builds.iter().filter(|b| b.scene == scene).collect();
        let threads = builds.iter().map(|b| b.threads);
        let most = threads.max().unwrap_or(1);
        let _ = write!(
            out,
            "<h2>{}</h2><p>{} primitives</p>",
            text(scene),
            builds[0].primitives
        );
        for set in distinct(&self.speeds, |s| &s.set) {
            let all = self
                .speeds
                .iter()
                .filter(|s| s.scene == scene && s.set == set);
            let rows: Vec<&SpeedRow> = all.collect();
            let few = rows.iter().map(|r| r.threads).min().unwrap_or(1);
            let bars = rows.iter().filter(|r| r.threads == few).map(|r| Bar {
                name: &r.contender,
                value: [
                    r.rays_per_second.median,
                    r.rays_per_second.low,
                    r.rays_per_second.high,
                ]
                .map(|v| v * 1e-6),
                figure: format!(
                    "{:.2} M/s  × {:.2}",
                    r.rays_per_second.median * 1e-6,
                    r.ratio.median
                ),
            });
            let Some(first) = rows.first() else { continue };
            let _ = write!(
                out,
                "<h3>{}: {} rays, million rays a second, {few} thread{}</h3>",
                text(set),
                first.rays,
                if few == 1 { "" } else { "s" }
            );
            out.push_str(&chart(&bars.collect::<Vec<_>>()));
            self.speeds_table(&rows, out);
        }
        let bars = builds.iter().filter(|b| b.threads == most).map(|b| Bar {
            name: &b.contender,
            value: [b.seconds.median, b.seconds.low, b.seconds.high],
            figure: format!(
                "{:.3} s  {:.0} B/prim",
                b.seconds.median, b.bytes_per_primitive
            ),
        });
        let _ = write!(
            out,
            "<h3>Build, seconds, {most} threads (shorter is better)</h3>"
        );
        out.push_str(&chart(&bars.collect::<Vec<_>>()));
        out.push_str(
            "<details><summary>Table</summary><div class=wide><table><tr><th>contender<th>threads<th>s<th>MB\
             <th>bytes a primitive<th>peak MB</tr>",
        );
        for b in builds {
            let _ = write!(
                out,
                "<tr><td>{}<td>{}<td>{}<td>{:.1}<td>{:.1}<td>{}</tr>",
                b.contender,
                b.threads,
                told(b.seconds, 1.0, 3),
                b.bytes as f64 * 1e-6,
                b.bytes_per_primitive,
                megabytes(b.peak_bytes)
            );
        }
        out.push_str("</table></div></details>");
    }

    fn speeds_table(&self, rows: &[&SpeedRow], out: &mut String) {
        let _ = write!(
            out,
            "<details><summary>Table</summary><div class=wide><table><tr><th>contender<th>threads<th>Mrays/s\
             <th>× {}<th>efficiency<th>hits</tr>",
            rows[0].contender
        );
        for s in rows {
            let _ = write!(
                out,
                "<tr><td>{}<td>{}<td>{}<td>{}<td>{:.3}<td>{}</tr>",
                s.contender,
                s.threads,
                told(s.rays_per_second, 1e-6, 2),
                told(s.ratio, 1.0, 3),
                s.efficiency,
                s.hits
            );
        }
        out.push_str("</table></div></details>");
    }
}

struct Bar<'a> {
    name: &'a str,
    /// Median, low, high.
    value: [f64; 3],
    figure: String,
}

/// Horizontal bars from 0.
fn chart(bars: &[Bar]) -> String {
    let most = bars
        .iter()
        .map(|b| b.value[2])
        .fold(f64::MIN_POSITIVE, f64::max);
    let height = ROW * bars.len() as f64 + 4.0;
    let width = NAME + BAR + FIGURE;
    let mut out = format!("<svg viewBox='0 0 {width} {height}' width='{width}' role=img>");
    for (i, b) in bars.iter().enumerate() {
        let y = ROW * i as f64 + 3.0;
        let [m, l, h] = b.value.map(|v| NAME + v / most * BAR);
        let class = b.name.split('-').next().unwrap_or("");
        let (middle, text_y, bar) = (y + 0.5 * (ROW - 5.0), y + ROW - 8.0, ROW - 5.0);
        let _ = write!(
            out,
            "<text x='{}' y='{text_y}' text-anchor=end>{}</text>\
             <rect class={class} x='{NAME}' y='{y}' width='{:.1}' height='{bar}'/>\
             <line class=whisker x1='{l:.1}' x2='{h:.1}' y1='{middle}' y2='{middle}'/>\
             <text class=soft x='{:.1}' y='{text_y}'>{}</text>",
            NAME - 8.0,
            text(b.name),
            m - NAME,
            h + 8.0,
            text(&b.figure)
        );
    }
    out.push_str("</svg>");
    out
}

fn text(s: &str) -> String {
    s.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
