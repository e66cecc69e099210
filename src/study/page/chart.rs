//! Charts of two logarithmic axes as SVG. Colours and type come from the page's style sheet.

use std::fmt::Write;

/// Colours that people with any colour vision tell apart, on white and on black (after Okabe and Ito), by series.
pub const COLOURS: usize = 8;

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 50.0;

/// Points of one level of a series.
#[derive(Clone, Debug)]
pub struct Step {
    /// Mean time.
    pub x: f64,
    /// Mean error.
    pub y: f64,
    /// Interval of the mean, if it is known.
    pub band: Option<[f64; 2]>,
    /// Single points with what is said of each.
    pub dots: Vec<(f64, f64, String)>,
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// Number of its colour.
    pub colour: usize,
    /// Name.
    pub name: String,
    /// By growing time.
    pub steps: Vec<Step>,
    /// An error that it does not fall below.
    pub floor: Option<f64>,
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// For those who cannot see it.
    pub title: String,
    /// What is drawn to the right.
    pub x: String,
    /// What is drawn upwards.
    pub y: String,
    /// Errors are shown in per cent.
    pub percent: bool,
    /// Lines.
    pub series: Vec<Series>,
    /// A dashed line across, with its name.
    pub level: Option<(f64, String)>,
    /// A broken line through these points: the Pareto front.
    pub front: Vec<(f64, f64)>,
}

struct Scale {
    x: [f64; 2],
    y: [f64; 2],
}

impl Scale {
    fn x(&self, v: f64) -> f64 {
        LEFT + (v.ln() - self.x[0]) / (self.x[1] - self.x[0]) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, v: f64) -> f64 {
        HEIGHT - BOTTOM - (v.ln() - self.y[0]) / (self.y[1] - self.y[0]) * (HEIGHT - TOP - BOTTOM)
    }
}

/// Logarithms of the least and the most, with room around and at least a factor of two between.
fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let good = values.filter(|v| v.is_finite() && *v > 0.0).map(f64::ln);
    let [low, high] = good.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
        [a.min(v), b.max(v)]
    });
    let room = (0.06 * (high - low))
        .max(0.5 * (2f64.ln() - (high - low)))
        .max(0.08);
    (low <= high).then_some([low - room, high + room])
}

/// 1, 2 and 5 times powers of ten between two logarithms; only powers of ten if there would be too many.
fn ticks([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let tens = (low / 10f64.ln()).floor() as i32..=(high / 10f64.ln()).ceil() as i32;
    let of = |steps: &[f64]| -> Vec<f64> {
        let all = tens
            .clone()
            .flat_map(|t| steps.iter().map(move |s| s * 10f64.powi(t)));
        all.filter(|v| (low..=high).contains(&v.ln())).collect()
    };
    let fine = of(&[1.0, 2.0, 5.0]);
    if fine.len() <= most { fine } else { of(&[1.0]) }
}

impl Chart {
    /// The chart as an `svg` element; nothing if there is no point.
    pub fn svg(&self) -> String {
        let steps = || self.series.iter().flat_map(|s| &s.steps);
        let dots = || steps().flat_map(|s| &s.dots);
        let xs = steps().map(|s| s.x).chain(dots().map(|d| d.0));
        let floors = self.series.iter().filter_map(|s| s.floor);
        let ys = steps()
            .map(|s| s.y)
            .chain(dots().map(|d| d.1))
            .chain(floors);
        let (Some(x), Some(y)) = (range(xs), range(ys)) else {
            return String::new();
        };
        let scale = Scale { x, y };
        let mut out = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
            escape(&self.title)
        );
        self.grid(&scale, &mut out);
        let _ = write!(
            out,
            "<svg x=\"{LEFT}\" y=\"{TOP}\" width=\"{w}\" height=\"{h}\" viewBox=\"{LEFT} {TOP} {w} {h}\">",
            w = WIDTH - LEFT - RIGHT,
            h = HEIGHT - TOP - BOTTOM
        );
        self.guide(&scale, &mut out);
        if let Some((v, name)) = &self.level {
            let at = scale.y(*v);
            let _ = write!(
                out,
                "<path class=\"level\" d=\"M{LEFT} {at:.1}H{WIDTH}\"/><text class=\"note\" x=\"{:.0}\" y=\"{:.1}\">{}</text>",
                LEFT + 6.0,
                at - 5.0,
                escape(name)
            );
        }
        for s in &self.series {
            draw(s, &scale, &mut out);
        }
        if self.front.len() > 1 {
            let d = path(self.front.iter().map(|(x, y)| (scale.x(*x), scale.y(*y))));
            let _ = write!(out, "<path class=\"front\" d=\"{d}\"/>");
        }
        out.push_str("</svg></svg>");
        out
    }

    fn grid(&self, scale: &Scale, out: &mut String) {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for v in ticks(scale.x, 9) {
            let at = scale.x(v);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{at:.1} {TOP}V{bottom}\"/><text class=\"tick\" text-anchor=\"middle\" x=\"{at:.1}\" y=\"{:.1}\">{}</text>",
                bottom + 18.0,
                plain(v)
            );
        }
        for v in ticks(scale.y, 9) {
            let at = scale.y(v);
            let text = if self.percent {
                format!("{} %", plain(100.0 * v))
            } else {
                plain(v)
            };
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{right}\"/><text class=\"tick\" text-anchor=\"end\" x=\"{:.1}\" y=\"{:.1}\">{text}</text>",
                LEFT - 7.0,
                at + 5.0
            );
        }
        let _ = write!(
            out,
            "<path class=\"frame\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>\
             <text class=\"label\" text-anchor=\"middle\" x=\"{:.0}\" y=\"{:.0}\">{}</text>\
             <text class=\"label\" text-anchor=\"start\" x=\"{:.0}\" y=\"{:.0}\">{}</text>",
            0.5 * (LEFT + right),
            HEIGHT - 8.0,
            escape(&self.x),
            LEFT + 8.0,
            TOP + 14.0,
            escape(&self.y)
        );
    }

    /// A line of slope −1/2 through the middle, to hold the curves against.
    fn guide(&self, scale: &Scale, out: &mut String) {
        if !self.percent {
            return;
        }
        let middle = [
            0.5 * (scale.x[0] + scale.x[1]),
            0.5 * (scale.y[0] + scale.y[1]),
        ];
        let at = |x: f64| {
            (
                scale.x(x.exp()),
                scale.y((middle[1] - 0.5 * (x - middle[0])).exp()),
            )
        };
        let d = path(scale.x.into_iter().map(at));
        let _ = write!(
            out,
            "<path class=\"guide\" d=\"{d}\"><title>slope −1/2: four times the time, half the error</title></path>"
        );
    }
}

fn path(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    for (i, (x, y)) in points.enumerate() {
        let _ = write!(d, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
    }
    d
}

fn draw(s: &Series, scale: &Scale, out: &mut String) {
    let colour = s.colour % COLOURS;
    let _ = write!(out, "<g class=\"s{colour}\">");
    let banded: Vec<&Step> = s.steps.iter().filter(|s| s.band.is_some()).collect();
    if banded.len() > 1 {
        let edge = |k: usize| move |s: &&Step| (s.x, s.band.expect("filtered")[k].max(1e-12));
        let upper = banded.iter().map(edge(1));
        let lower = banded.iter().rev().map(edge(0));
        let d = path(upper.chain(lower).map(|(x, y)| (scale.x(x), scale.y(y))));
        let _ = write!(out, "<path class=\"band\" d=\"{d}Z\"/>");
    }
    if let Some(f) = s.floor {
        let at = scale.y(f);
        let _ = write!(
            out,
            "<path class=\"floor\" d=\"M{LEFT} {at:.1}H{WIDTH}\"><title>{}: floor at {:.3} %</title></path>",
            escape(&s.name),
            100.0 * f
        );
    }
    for (x, y, text) in s.steps.iter().flat_map(|s| &s.dots) {
        let _ = write!(
            out,
            "<circle class=\"dot\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\"><title>{}</title></circle>",
            scale.x(*x),
            scale.y(*y),
            escape(text)
        );
    }
    if s.steps.len() > 1 {
        let d = path(s.steps.iter().map(|s| (scale.x(s.x), scale.y(s.y))));
        let _ = write!(out, "<path class=\"line\" d=\"{d}\"/>");
    }
    for step in &s.steps {
        let _ = write!(
            out,
            "<path class=\"mark\" d=\"{}\"><title>{}: {} s, {:.4}</title></path>",
            mark(s.colour, scale.x(step.x), scale.y(step.y)),
            escape(&s.name),
            plain(step.x),
            step.y
        );
    }
    out.push_str("</g>");
}

/// A shape for each colour, so that colour is not all that tells series apart.
pub fn mark(colour: usize, x: f64, y: f64) -> String {
    let (a, b) = (x - 4.5, y - 4.5);
    match colour % 4 {
        0 => format!("M{a:.1} {y:.1}a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0 -9 0Z"),
        1 => format!("M{:.1} {:.1}h8v8h-8Z", x - 4.0, y - 4.0),
        2 => format!("M{x:.1} {b:.1}l5 9h-10Z"),
        _ => format!("M{x:.1} {:.1}l5.5 5.5l-5.5 5.5l-5.5 -5.5Z", y - 5.5),
    }
}

/// A number with two or three digits, without an exponent where that is readable.
pub fn plain(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let size = v.abs().log10().floor() as i32;
    if !(-5..7).contains(&size) {
        return format!("{v:.1e}");
    }
    let digits = (1 - size).max(0) as usize;
    let text = format!("{v:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Text for HTML and its attributes.
pub fn escape(s: &str) -> String {
    let mut out = String::with_capacity(s.len());
    for c in s.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let of = |a: f64, b: f64| ticks([a.ln(), b.ln()], 9);
        let close = |a: Vec<f64>, b: &[f64]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-9)
        };
        assert!(close(of(0.09, 2.1), &[0.1, 0.2, 0.5, 1.0, 2.0]));
        assert!(close(
            of(0.9e-3, 1.1e3),
            &[1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3]
        ));
    }

    #[test]
    fn numbers_and_text_are_readable() {
        let cases = [
            (0.5, "0.5"),
            (12.0, "12"),
            (1234.0, "1234"),
            (0.0123, "0.012"),
            (0.1, "0.1"),
            (3.4159, "3.4"),
        ];
        for (v, text) in cases {
            assert_eq!(plain(v), text);
        }
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
    }

    #[test]
    fn a_chart_without_points_is_nothing_and_others_are_whole() {
        let mut c = Chart {
            title: "t".into(),
            x: "s".into(),
            y: "e".into(),
            percent: true,
            series: Vec::new(),
            level: Some((0.01, "noise".into())),
            front: vec![(1.0, 0.1), (2.0, 0.05)],
        };
        assert!(c.svg().is_empty());
        let step = |x: f64, y: f64| Step {
            x,
            y,
            band: Some([y * 0.9, y * 1.1]),
            dots: vec![(x, y, "<1>".into())],
        };
        c.series.push(Series {
            colour: 9,
            name: "n".into(),
            steps: vec![step(1.0, 0.1), step(2.0, 0.07)],
            floor: Some(0.05),
        });
        let svg = c.svg();
        assert_eq!(svg.matches("<svg").count(), svg.matches("</svg>").count());
        for class in [
            "s1", "band", "line", "dot", "mark", "floor", "level", "front", "guide",
        ] {
            assert!(
                svg.contains(&format!("class=\"{class}\"")),
                "{class} in {svg}"
            );
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.contains("&lt;1&gt;"));
    }
}
