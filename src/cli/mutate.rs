//! `--mutate`: the shares of the strategies by name.

use crate::chain::Shares;
use crate::mutation::Strategy;

/// The wavelength mutation's part where it is not named.
const WAVELENGTH: f64 = 0.05;

/// Parses `bidirectional=0.5,caustic=0.5`. Strategies that are not named are left out, but for the wavelength mutation.
pub fn shares(text: &str) -> Result<Shares, String> {
    let names = || Strategy::ALL.map(Strategy::name).join(", ");
    let mut found = [None; Strategy::ALL.len()];
    for part in text.split(',') {
        let (name, value) = part
            .split_once('=')
            .ok_or_else(|| format!("found “{part}”, expected STRATEGY=SHARE"))?;
        let name = name.trim();
        let at = Strategy::ALL
            .iter()
            .position(|s| s.name() == name)
            .ok_or_else(|| format!("found strategy “{name}”, expected one of {}", names()))?;
        let share: f64 = (value.trim().parse().ok())
            .filter(|v: &f64| v.is_finite() && *v >= 0.0)
            .ok_or_else(|| {
                format!("found {name}={value}, expected a number >= 0 (0 removes the strategy)")
            })?;
        if found[at].replace(share).is_some() {
            return Err(format!("{name} is given twice"));
        }
    }
    let mut w = found.map(|s| s.unwrap_or(0.0));
    if w[Strategy::Bidirectional as usize] <= 0.0 {
        return Err(
            "bidirectional must have a share > 0: the other strategies alone do not reach every path"
                .into(),
        );
    }
    let wavelength = Strategy::Wavelength as usize;
    if found[wavelength].is_none() {
        w[wavelength] = w.iter().sum::<f64>() * WAVELENGTH / (1.0 - WAVELENGTH);
    }
    let total: f64 = w.iter().sum();
    if !total.is_finite() {
        return Err("the shares add up to no number".into());
    }
    Ok(Shares(w.map(|s| s / total)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_normalised() {
        let s = shares("bidirectional=2, lens=1,multichain=1,wavelength=0").expect("good");
        assert_eq!(s.0, [0.5, 0.25, 0.0, 0.25, 0.0, 0.0]);
        let s = shares("bidirectional=30,caustic=65").expect("good");
        for (found, expected) in s.0.into_iter().zip([0.30, 0.0, 0.65, 0.0, 0.0, 0.05]) {
            assert!((found - expected).abs() < 1e-15, "{s:?}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_told() {
        for (text, about) in [
            ("", "STRATEGY=SHARE"),
            ("bidirectional", "STRATEGY=SHARE"),
            ("bidirectional=0.5,manifold=0.5", "multichain"),
            ("bidirectional=-1", "bidirectional=-1"),
            ("bidirectional=inf", "number"),
            ("bidirectional=1,lens=much", "lens=much"),
            ("bidirectional=1,lens=1,lens=2", "twice"),
            ("bidirectional=1e308,lens=1e308", "no number"),
            ("bidirectional=0,lens=1", "> 0"),
            ("lens=1", "bidirectional"),
        ] {
            let e = shares(text).expect_err(text);
            assert!(e.contains(about), "{text}: {e}");
        }
    }
}
