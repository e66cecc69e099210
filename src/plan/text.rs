//! A plan as a person reads it.

use super::{Cause, Chosen, Effect, Finding, Plan, Strategy, Verdict};
use std::fmt::Write;

/// Lights of which it is told how often they are chosen.
const CHOSEN: usize = 3;

/// How it is chosen among them, and why not by what a look finds.
const BY_POWER: &str =
    "chosen by luminous power, which is known without rays, so that none is missed";

/// Why there are some where there are deltas.
const WHATEVER_IS_FOUND: &str = "caustic and multichain have a share whether a pilot finds such paths or not: it misses those \
                                 that are hardest to find";

impl Plan {
    /// Every effect with its cause or what is skipped, the strategies of chains if there will be any, the wavelengths, the
    /// lights.
    pub fn text(&self, chains: bool) -> String {
        let mut t = String::from("effects\n");
        for f in &self.findings {
            let (word, rest) = told(f);
            let _ = writeln!(t, "  {:<12} {word:<9} {rest}", f.effect.name());
        }
        if chains {
            let _ = writeln!(t, "strategies     {}", self.strategies());
        }
        if chains && (self.on(Effect::Caustic) || self.on(Effect::MultiChain)) {
            let _ = writeln!(t, "               {WHATEVER_IS_FOUND}");
        }
        let _ = writeln!(t, "wavelengths    {}", self.wavelengths());
        let _ = writeln!(t, "lights         {}", self.lights());
        let _ = writeln!(
            t,
            "path length    storage for up to {} edges; none is cut shorter",
            self.max_edges
        );
        for aside in [&self.unused, &self.unseen] {
            if !aside.is_empty() {
                let _ = writeln!(t, "left aside     {}", several(aside));
            }
        }
        t
    }

    /// In two lines: what is simulated, and how, with chains or without.
    pub fn short(&self, chains: bool) -> String {
        let names = |on: bool| -> String {
            let of = self.findings.iter().filter(|f| f.verdict.on() == on);
            let names: Vec<&str> = of.map(|f| f.effect.name()).collect();
            match names.is_empty() {
                true => "nothing".into(),
                false => names.join(", "),
            }
        };
        format!(
            "plan: {}; not called for: {}\nplan: {}{}",
            names(true),
            names(false),
            self.wavelengths(),
            match chains {
                true => format!("; {}", self.strategies()),
                false => String::new(),
            }
        )
    }

    /// What will be wrong with the image, for each effect that is left out though the scene calls for it.
    pub fn wrongs(&self) -> Vec<String> {
        let left_out = |f: &&Finding| f.verdict == Verdict::LeftOut;
        let found = self.findings.iter().filter(left_out);
        found
            .map(|f| {
                format!(
                    "without {}: {}; called for by {}",
                    f.effect,
                    f.effect.missed(),
                    several(&f.causes)
                )
            })
            .collect()
    }

    /// The strategies that have a share.
    fn strategies(&self) -> String {
        if !self.on(Effect::Indirect) && self.max_edges <= 2 {
            return "none".into();
        }
        let total: f64 = self.shares.0.iter().sum();
        let each = Strategy::ALL.into_iter().filter_map(|s| {
            let share = self.shares.get(s);
            (share > 0.0).then(|| match self.asked {
                true => format!("{} {:.0} %", s.name(), 100.0 * share / total),
                false => s.name().into(),
            })
        });
        each.collect::<Vec<_>>().join(", ")
    }

    fn wavelengths(&self) -> String {
        match (&self.grey, self.lanes) {
            (Some((_, g)), _) => format!("1 lane at {} nm stands for all", g.lambda),
            (None, 1) => "1 lane".into(),
            (None, n) => format!("{n} lanes"),
        }
    }

    fn lights(&self) -> String {
        let lit = self.lit.iter().filter(|l| **l).count();
        let mut t = format!("{lit} of {} are sampled", self.lit.len());
        if lit > 1 {
            let _ = write!(t, ", {BY_POWER}");
        }
        if self.chosen.len() > 1 {
            let told = |c: &Chosen| format!("{} {}", c.light, percent(c.part));
            let most = self.chosen.iter().take(CHOSEN).map(told);
            let _ = write!(t, ": {}", most.collect::<Vec<_>>().join(", "));
        }
        if self.chosen.len() > CHOSEN {
            let _ = write!(t, " and {} more", self.chosen.len() - CHOSEN);
        }
        for u in &self.unlit {
            let times = match u.count {
                1 => String::new(),
                n => format!(" ({n} of them)"),
            };
            let _ = write!(t, "; not {}{times}", u.light);
        }
        t
    }
}

/// A part of a whole.
fn percent(part: f64) -> String {
    match 100.0 * part {
        p if p >= 1.0 => format!("{p:.0} %"),
        p if p >= 0.01 => format!("{p:.2} %"),
        p if p > 0.0 => "below 0.01 %".into(),
        _ => "never".into(),
    }
}

fn told(f: &Finding) -> (&'static str, String) {
    match f.verdict {
        Verdict::CalledFor => ("yes", several(&f.causes)),
        Verdict::NotCalledFor => ("no", f.effect.skipped().into()),
        Verdict::Forced => ("forced", "nothing in the scene calls for it".into()),
        Verdict::LeftOut => (
            "left out",
            format!(
                "{}; called for by {}",
                f.effect.missed(),
                several(&f.causes)
            ),
        ),
    }
}

/// The first cause and how many more there are.
fn several(causes: &[Cause]) -> String {
    match causes {
        [] => "nothing".into(),
        [one] => one.to_string(),
        [first, rest @ ..] => format!("{first} and {} more", rest.len()),
    }
}
