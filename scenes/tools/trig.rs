//! Sine and cosine that give the same bits on every machine.
//!
//! The C library's differ in the last place between versions, and the committed meshes are compared byte by byte.

use std::f64::consts::TAU;

/// Cosine and sine of an angle given in turns; uses only correctly rounded operations.
pub fn cos_sin_turns(turns: f64) -> (f64, f64) {
    let t = turns - turns.floor();
    // Quarter turns are exact, the rest is within an eighth of a turn of one of them.
    let quarter = (t * 4.0).round();
    let (c, s) = small((t - quarter / 4.0) * TAU);
    match quarter as i32 % 4 {
        0 => (c, s),
        1 => (-s, c),
        2 => (-c, -s),
        _ => (s, -c),
    }
}

/// Taylor series for |x| ≤ π/4, where 18 terms are far below rounding.
fn small(x: f64) -> (f64, f64) {
    let (mut c, mut s, mut term) = (0.0, 0.0, 1.0);
    for k in 0..18 {
        match k % 4 {
            0 => c += term,
            1 => s += term,
            2 => c -= term,
            _ => s -= term,
        }
        term *= x / f64::from(k + 1);
    }
    (c, s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        for i in -50..150 {
            let turns = f64::from(i) / 37.0;
            let (c, s) = cos_sin_turns(turns);
            assert!((c - (turns * TAU).cos()).abs() < 1e-14);
            assert!((s - (turns * TAU).sin()).abs() < 1e-14);
        }
        assert_eq!(cos_sin_turns(0.25), (0.0, 1.0));
        assert_eq!(cos_sin_turns(0.5), (-1.0, 0.0));
    }
}
