//! Tables: of an axis for people, of all points for machines.

use super::super::analyse::{Summary, TARGETS};
use super::super::axes::Axis;
use super::super::words::{bounds, digits, longer, percent, time};
use super::Study;
use super::chart::{COLOURS, escape, mark};
use std::fmt::Write;

/// Every point, one a line, with a head.
pub fn csv(study: &Study) -> String {
    let mut out = String::from(
        "setting,level,repeat,seed,rounds,wall_seconds,cpu_seconds,threads,claimed,rel_rms,rel_rms_net,bias,rel_mse,l1,l2,l_inf,mape,flip,faults,command\n",
    );
    let maybe = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
    for (args, points) in study.settings.iter().zip(&study.points) {
        for j in points {
            let (p, e) = (&j.point, &j.errors);
            let _ = writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                quoted(&args.join(" ")),
                j.level,
                p.repeat,
                p.seed,
                p.rounds,
                p.wall_seconds,
                p.cpu_seconds,
                p.threads,
                maybe(p.claimed),
                e.rel_rms,
                maybe(e.rel_rms_net),
                e.bias,
                e.rel_mse,
                e.l1,
                e.l2,
                e.l_inf,
                e.mape,
                e.flip,
                p.faults,
                quoted(&command(&p.command))
            );
        }
    }
    out
}

fn quoted(s: &str) -> String {
    format!("\"{}\"", s.replace('"', "\"\""))
}

/// A point's command for a shell.
pub fn command(words: &[String]) -> String {
    let plain = |w: &str| {
        let safe = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
        !w.is_empty() && w.chars().all(safe)
    };
    let word = |w: &String| {
        if plain(w) {
            w.clone()
        } else {
            format!("'{}'", w.replace('\'', "'\\''"))
        }
    };
    let words: Vec<String> = words.iter().map(word).collect();
    format!("metrolux render {}", words.join(" "))
}

/// A coloured mark as in the chart.
pub fn swatch(colour: usize) -> String {
    format!(
        "<svg class=\"swatch s{}\" viewBox=\"0 0 14 14\" aria-hidden=\"true\"><path class=\"mark\" d=\"{}\"/></svg>",
        colour % COLOURS,
        mark(colour, 7.0, 7.0)
    )
}

/// The settings of an axis with what they cost.
pub fn costs(study: &Study, summaries: &[Summary], axis: &Axis) -> String {
    let of = |k: usize| &summaries[study.number(&axis.settings[k].args)];
    let best = (0..axis.settings.len())
        .filter_map(|k| Some(of(k).efficiency?.value))
        .fold(0.0, f64::max);
    let mut out =
        String::from("<div class=\"scroll\"><table><thead><tr><th scope=\"col\">setting</th>");
    for t in TARGETS {
        let _ = write!(out, "<th scope=\"col\" class=\"n\">to {}</th>", percent(t));
    }
    out.push_str(
        "<th scope=\"col\">efficiency</th><th scope=\"col\" class=\"n\">floor</th><th scope=\"col\" class=\"n\">bias</th>\
         <th scope=\"col\" class=\"n\">slope</th><th scope=\"col\" class=\"n\">claimed / true</th></tr></thead><tbody>",
    );
    for (k, setting) in axis.settings.iter().enumerate() {
        let s = of(k);
        let why = setting
            .biased
            .as_ref()
            .map_or(String::new(), |w| format!(" title=\"{}\"", escape(w)));
        let _ = write!(
            out,
            "<tr><th scope=\"row\"{why}>{}{}</th>",
            swatch(k),
            escape(&setting.name)
        );
        for r in s.reach {
            let _ = match r {
                Some(r) => {
                    let (class, more) = if r.extrapolated {
                        ("n far", ", beyond what was measured")
                    } else {
                        ("n", "")
                    };
                    write!(
                        out,
                        "<td class=\"{class}\" title=\"{} to {}{more}\">{}<small>{}–{}</small></td>",
                        time(r.needed.low),
                        time(r.needed.high),
                        time(r.needed.value),
                        time(r.needed.low),
                        time(r.needed.high)
                    )
                }
                None if s.fit.is_none() => write!(out, "<td class=\"n\">–</td>"),
                None => write!(out, "<td class=\"n never\">never</td>"),
            };
        }
        match s.efficiency {
            Some(e) if best > 0.0 => {
                let part = e.value / best;
                let title = match longer(of(0), s) {
                    Some(r) if k > 0 => {
                        let than = escape(&axis.settings[0].name);
                        format!(
                            " title=\"squared error × time {} times that of {than}\"",
                            bounds(r, digits)
                        )
                    }
                    _ => String::new(),
                };
                let _ = write!(
                    out,
                    "<td class=\"bar s{}\"{title}><span class=\"track\"><i style=\"width:{:.1}%\"></i></span><b>{}</b></td>",
                    k % COLOURS,
                    100.0 * part,
                    if part > 0.9995 {
                        "1".into()
                    } else {
                        digits(part)
                    }
                );
            }
            _ => out.push_str("<td>–</td>"),
        }
        let parts = s.parts;
        let floor = parts.map(|p| (p.floor(), p.floor_square.high.max(0.0).sqrt()));
        let _ = match floor {
            Some((Some(f), _)) => write!(
                out,
                "<td class=\"n floor\" title=\"{}\">{}</td>",
                bounds(f, percent),
                percent(f.value)
            ),
            Some((None, high)) if high.is_finite() => {
                write!(
                    out,
                    "<td class=\"n none\" title=\"none found; at most\">&lt; {}</td>",
                    percent(high)
                )
            }
            _ => write!(out, "<td class=\"n\">–</td>"),
        };
        let _ = match parts.map(|p| p.bias).filter(|b| b.high.is_finite()) {
            Some(b) => {
                let class = if b.low > 0.0 || b.high < 0.0 {
                    "n told"
                } else {
                    "n none"
                };
                let half = 50.0 * (b.high - b.low);
                write!(
                    out,
                    "<td class=\"{class}\">{:+.2} ± {} %</td>",
                    100.0 * b.value,
                    digits(half)
                )
            }
            None => write!(out, "<td class=\"n\">–</td>"),
        };
        let _ = match s.fit {
            Some(f) => {
                let half = 0.5 * (f.slope.high - f.slope.low);
                write!(
                    out,
                    "<td class=\"n\">{:.2} ± {:.2}</td>",
                    f.slope.value, half
                )
            }
            None => write!(out, "<td class=\"n\">–</td>"),
        };
        let _ = match s.claim {
            Some(c) => write!(
                out,
                "<td class=\"n\" title=\"{}\">{:.2}</td></tr>",
                bounds(c, digits),
                c.value
            ),
            None => write!(out, "<td class=\"n\">–</td></tr>"),
        };
    }
    out.push_str("</tbody></table></div>");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_survive_a_shell() {
        let words = |s: &[&str]| s.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>();
        assert_eq!(
            command(&words(&[
                "a b.pbrt",
                "--mutate",
                "lens=0.5,caustic=0.5",
                "it's"
            ])),
            "metrolux render 'a b.pbrt' --mutate lens=0.5,caustic=0.5 'it'\\''s'"
        );
        assert_eq!(quoted("a\"b"), "\"a\"\"b\"");
    }
}
