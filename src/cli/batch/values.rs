//! Values that differ from job to job: ranges of numbers, lists, and values that run with the frame.

/// Most values that one range may have.
const MOST: i64 = 1_000_000;

/// The numbers of a range such as `1-120`, `1-120:5` or `1-9,20,30-39`.
///
/// # Errors
/// What is wrong with it.
pub fn range(text: &str) -> Result<Vec<String>, String> {
    let wrong = || format!("“{text}” is no range: expected such as 1-120, 1-120:5 or 1-9,20,30-39");
    let mut all = Vec::new();
    for part in text.split(',') {
        let (ends, step) = match part.split_once(':') {
            Some((ends, step)) => (ends, step.trim().parse().map_err(|_| wrong())?),
            None => (part, 1i64),
        };
        let ends = ends.trim();
        // A dash in front is a sign.
        let dash = ends.get(1..).and_then(|rest| rest.find('-')).map(|n| n + 1);
        let (first, last) = match dash {
            Some(n) => (ends[..n].trim(), ends[n + 1..].trim()),
            None => (ends, ends),
        };
        let number = |s: &str| s.parse::<i64>().map_err(|_| wrong());
        let (first, last) = (number(first)?, number(last)?);
        if step < 1 || last < first {
            return Err(wrong());
        }
        let count = (last - first) / step + 1;
        if count + all.len() as i64 > MOST {
            return Err(format!("“{text}” has more than {MOST} values"));
        }
        all.extend((0..count).map(|k| (first + k * step).to_string()));
    }
    Ok(all)
}

/// A value that runs with the frame: straight between keys, constant beyond the first and the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve(Vec<(f64, f64)>);

impl Curve {
    /// Through keys (frame, value), in any order. `None` without a key, or with two at one frame.
    pub fn new(mut keys: Vec<(f64, f64)>) -> Option<Self> {
        keys.sort_by(|a, b| a.0.total_cmp(&b.0));
        let apart = keys.windows(2).all(|w| w[0].0 < w[1].0);
        (apart && !keys.is_empty()).then_some(Self(keys))
    }

    /// At a frame.
    pub fn at(&self, frame: f64) -> f64 {
        let after = self.0.partition_point(|k| k.0 <= frame);
        match (
            after.checked_sub(1).map(|i| self.0[i]),
            self.0.get(after).copied(),
        ) {
            (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (frame - x0) / (x1 - x0),
            (Some((_, y)), None) | (None, Some((_, y))) => y,
            (None, None) => f64::NAN,
        }
    }
}

impl Curve {
    /// The value at a frame as text, with what arithmetic leaves behind the twelfth digit taken off.
    pub fn text_at(&self, frame: f64) -> String {
        let v = self.at(frame);
        let rounded: f64 = format!("{v:.12e}").parse().unwrap_or(v);
        (rounded + 0.0).to_string()
    }
}

/// Replaces `${name}` and `${name:WIDTH}` by values; `$$` is one `$`. A width fills up a whole number with zeros.
///
/// # Errors
/// The byte where something is wrong, and what.
pub fn fill(
    text: &str,
    value: &dyn Fn(&str) -> Option<String>,
    known: &dyn Fn() -> String,
) -> Result<String, (usize, String)> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(n) = rest.find('$') {
        out.push_str(&rest[..n]);
        let at = text.len() - rest.len() + n;
        let after = &rest[n + 1..];
        if let Some(r) = after.strip_prefix('$') {
            out.push('$');
            rest = r;
            continue;
        }
        let inner = after.strip_prefix('{').and_then(|a| a.split_once('}'));
        let Some((inner, r)) = inner else {
            let text = "a $ that begins no ${name}: expected ${name}, or $$ for the sign itself";
            return Err((at, text.into()));
        };
        let (name, width) = match inner.split_once(':') {
            Some((name, w)) => (name, w.parse::<usize>().ok().filter(|w| *w <= 20)),
            None => (inner, Some(0)),
        };
        let Some(width) = width else {
            let text = format!("“${{{inner}}}” has a width that is no number up to 20");
            return Err((at, text));
        };
        let Some(v) = value(name) else {
            let text = format!("there is no “${{{name}}}”: expected one of {}", known());
            return Err((at, text));
        };
        match v.parse::<i64>() {
            _ if width == 0 => out.push_str(&v),
            Ok(n) => out.push_str(&format!("{n:0width$}")),
            Err(_) => {
                let text = format!("“${{{inner}}}” has a width, and is “{v}”, no whole number");
                return Err((at, text));
            }
        }
        rest = r;
    }
    out.push_str(rest);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_what_they_say() {
        let of = |t: &str| range(t).map(|v| v.join(" "));
        for (text, all) in [
            ("7", "7"),
            ("1-4", "1 2 3 4"),
            ("1-10:4", "1 5 9"),
            ("-2-1", "-2 -1 0 1"),
            ("-5--3", "-5 -4 -3"),
            ("1-2, 9 ,4-5", "1 2 9 4 5"),
        ] {
            assert_eq!(of(text).as_deref(), Ok(all), "{text}");
        }
        for text in [
            "",
            "a",
            "4-1",
            "1-",
            "1-9:0",
            "1-9:-1",
            "1,,2",
            "1-99999999",
        ] {
            assert!(of(text).is_err(), "{text}");
        }
    }

    #[test]
    fn curves_go_straight_from_key_to_key() {
        let c = Curve::new(vec![(10.0, 5.0), (0.0, 0.0), (20.0, 5.0)]).expect("keys");
        for (x, y) in [
            (-1.0, 0.0),
            (0.0, 0.0),
            (4.0, 2.0),
            (10.0, 5.0),
            (15.0, 5.0),
            (99.0, 5.0),
        ] {
            assert_eq!(c.at(x), y, "{x}");
        }
        let turn = Curve::new(vec![(1.0, 0.0), (121.0, 360.0)]).expect("keys");
        let third = Curve::new(vec![(0.0, 0.0), (3.0, 1.0)]).expect("keys");
        assert_eq!(turn.text_at(5.0), "12");
        assert_eq!(third.text_at(1.0), "0.3333333333333");
        assert_eq!(
            Curve::new(vec![(0.0, 0.3), (10.0, 0.0)])
                .expect("keys")
                .text_at(9.0),
            "0.03"
        );
        assert!(Curve::new(vec![]).is_none() && Curve::new(vec![(1.0, 1.0); 2]).is_none());
    }

    #[test]
    fn names_are_filled_in() {
        let value = |n: &str| match n {
            "frame" => Some("7".to_owned()),
            "scene" => Some("box".to_owned()),
            _ => None,
        };
        let of = |t: &str| fill(t, &value, &|| "frame, scene".into());
        assert_eq!(
            of("a/${scene}.${frame:4}.exr").as_deref(),
            Ok("a/box.0007.exr")
        );
        assert_eq!(of("$$ ${frame}$$${frame}").as_deref(), Ok("$ 7$7"));
        for (text, at) in [
            ("é ${no}", 3),
            ("a$", 1),
            ("${frame", 0),
            ("${scene:3}", 0),
            ("${frame:x}", 0),
        ] {
            assert_eq!(of(text).map_err(|e| e.0), Err(at), "{text}");
        }
    }
}
