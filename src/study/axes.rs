//! What a study turns: axes, and on each of them settings, told apart by the options they add to `metrolux render`.

use crate::chain::Shares;
use crate::mutation::Strategy;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// One thing that is varied while everything else stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisName {
    /// Path tracing, bidirectional path tracing, Metropolis
    Integrator,
    /// Metropolis with one mutation strategy off at a time
    Strategy,
    /// Metropolis with one refinement off (or on) at a time
    Refinement,
    /// 1, 4, 8, 16 wavelengths a path
    Lanes,
    /// Embree robust and fast, obvhs
    Accel,
    /// Most scattering events on a path
    Depth,
    /// Number of Markov chains
    Chains,
    /// Number of seeding samples
    Seeds,
    /// Sums of the image: exact, in single precision, compensated
    Sums,
}

impl AxisName {
    /// All of them, what tells most first: with little time the last are left out.
    pub const ALL: [Self; 9] = [
        Self::Integrator,
        Self::Strategy,
        Self::Refinement,
        Self::Lanes,
        Self::Accel,
        Self::Depth,
        Self::Chains,
        Self::Seeds,
        Self::Sums,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Integrator => "integrator",
            Self::Strategy => "strategy",
            Self::Refinement => "refinement",
            Self::Lanes => "lanes",
            Self::Accel => "accel",
            Self::Depth => "depth",
            Self::Chains => "chains",
            Self::Seeds => "seeds",
            Self::Sums => "sums",
        }
    }

    /// The question it answers, as a heading.
    pub fn question(self) -> &'static str {
        match self {
            Self::Integrator => "Which integrator?",
            Self::Strategy => "What does each mutation bring?",
            Self::Refinement => "What does each refinement bring?",
            Self::Lanes => "How many wavelengths should a path carry?",
            Self::Accel => "Who should answer rays?",
            Self::Depth => "How long need paths be?",
            Self::Chains => "How many chains?",
            Self::Seeds => "How many seeding samples?",
            Self::Sums => "How should the image be added up?",
        }
    }
}

/// A place on an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// Short name on the page.
    pub name: String,
    /// Options of `metrolux render`, beside those that all settings share.
    pub args: Vec<String>,
    /// Why its images may converge to something else than the reference.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub biased: Option<String>,
}

/// An axis with its settings; the first is the one the others are measured by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axis {
    /// Which.
    pub name: AxisName,
    /// Its places.
    pub settings: Vec<Setting>,
}

/// What axes need to know of the scene and of the options that all settings share.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// Integrator by its name on the command line, where an axis leaves it open.
    pub integrator: &'static str,
    /// Shares of the strategies in the default render.
    pub shares: Shares,
    /// Depth of the default render.
    pub max_depth: u32,
    /// Lanes of the default render.
    pub lanes: usize,
}

/// The axis of this name over the ground; `None` where there is nothing to vary.
pub fn axis(name: AxisName, ground: &Ground) -> Option<Axis> {
    let settings = match name {
        AxisName::Integrator => ["mlt", "bdpt", "pt"]
            .map(|i| setting(i, &["--integrator", i]))
            .to_vec(),
        AxisName::Strategy => strategies(&ground.shares),
        AxisName::Refinement => refinements(),
        AxisName::Lanes => lanes(ground),
        AxisName::Accel => backends(ground),
        AxisName::Depth => depths(ground),
        AxisName::Chains => counts("--chains", "chains", 16, &[4, 64, 256]),
        AxisName::Sums => sums(),
        AxisName::Seeds => counts("--seeds", "seeds", 4096, &[256, 1024, 16384]),
    };
    (settings.len() > 1).then_some(Axis { name, settings })
}

fn setting(name: &str, args: &[&str]) -> Setting {
    Setting {
        name: name.into(),
        args: args.iter().map(|a| (*a).to_owned()).collect(),
        biased: None,
    }
}

const MLT: [&str; 2] = ["--integrator", "mlt"];

fn mlt_with(name: &str, more: &[&str]) -> Setting {
    setting(name, &[&MLT[..], more].concat())
}

/// Everything on, then each strategy's share shared out among the others. The bidirectional one cannot be off.
fn strategies(shares: &Shares) -> Vec<Setting> {
    let mut all = vec![mlt_with("all strategies", &[])];
    for off in Strategy::ALL {
        if shares.0[off as usize] == 0.0 || off == Strategy::Bidirectional {
            continue;
        }
        let each = Strategy::ALL.map(|s| {
            let share = if s == off { 0.0 } else { shares.0[s as usize] };
            format!("{}={share}", s.name())
        });
        let without = mlt_with(
            &format!("without {}", off.name()),
            &["--mutate", &each.join(",")],
        );
        all.push(without);
    }
    all
}

fn refinements() -> Vec<Setting> {
    vec![
        mlt_with("default", &[]),
        mlt_with("without expected values", &["--no-expected-values"]),
        mlt_with("without p_d2", &["--plain-deletions"]),
        mlt_with("direct light in the chain", &["--direct", "chain"]),
        mlt_with(
            "direct light in a pass of its own",
            &["--direct", "separate"],
        ),
        mlt_with("two-stage", &["--two-stage"]),
        mlt_with(
            "without stratified lens sub-paths",
            &["--no-stratification"],
        ),
    ]
}

fn lanes(ground: &Ground) -> Vec<Setting> {
    let mut all: Vec<usize> = vec![1, 4, 8, 16];
    all.sort_by_key(|n| *n != ground.lanes);
    let of = |n: usize| {
        let mut s = setting(
            &format!("{n} wavelengths"),
            &["--integrator", ground.integrator],
        );
        if n == 1 {
            s.name = "1 wavelength".into();
        }
        if n != ground.lanes {
            s.args.extend(["--lanes".into(), n.to_string()]);
        }
        s
    };
    all.into_iter().map(of).collect()
}

fn backends(ground: &Ground) -> Vec<Setting> {
    let i = ["--integrator", ground.integrator];
    let mut fast = setting(
        "Embree, fast",
        &[&i[..], &["--accel-precision", "fast"]].concat(),
    );
    fast.biased = Some("a ray may pass between two triangles that share an edge".into());
    vec![
        setting("Embree, robust", &i),
        fast,
        setting("obvhs", &[&i[..], &["--accel", "obvhs"]].concat()),
    ]
}

/// Powers of two below the default depth.
fn depths(ground: &Ground) -> Vec<Setting> {
    let i = ["--integrator", ground.integrator];
    let full = ground.max_depth;
    let mut all = vec![setting(&format!("depth {full}"), &i)];
    let shorter = (0..32).map(|k| 1u32 << k).take_while(|d| *d < full);
    let mut shorter: Vec<u32> = shorter.filter(|d| *d >= 2).collect();
    shorter.reverse();
    shorter.truncate(5);
    for d in shorter {
        let text = d.to_string();
        let mut s = setting(
            &format!("depth {d}"),
            &[&i[..], &["--max-depth", &text]].concat(),
        );
        s.biased = Some(format!(
            "light of more than {d} scattering events is missing"
        ));
        all.push(s);
    }
    all
}

fn counts(option: &str, what: &str, usual: u32, others: &[u32]) -> Vec<Setting> {
    let mut all = vec![mlt_with(&format!("16 × {usual} {what}"), &[])];
    for n in others {
        let text = n.to_string();
        all.push(mlt_with(&format!("16 × {n} {what}"), &[option, &text]));
    }
    all
}

/// With all light in the chains, whose sums alone are in question.
fn sums() -> Vec<Setting> {
    let chain = ["--direct", "chain"];
    let single = |name: &str, kind: &str| {
        let mut s = mlt_with(name, &[&chain[..], &["--sums", kind]].concat());
        s.biased = Some("rounding is lost for good where a small part meets a large sum".into());
        s
    };
    vec![
        mlt_with("exact", &[&chain[..], &["--sums", "exact"]].concat()),
        single("single precision", "f32"),
        single("compensated", "compensated"),
    ]
}

/// The shared options without those that the setting gives itself, then the setting's.
pub fn joined(shared: &[String], own: &[String]) -> Vec<String> {
    let is_option = |s: &str| s.starts_with("--") && s.len() > 2;
    let name = |s: &str| s.split('=').next().unwrap_or(s).to_owned();
    let set: Vec<String> = own
        .iter()
        .filter(|a| is_option(a))
        .map(|a| name(a))
        .collect();
    let mut all = Vec::new();
    let mut skipping = false;
    for a in shared {
        if is_option(a) {
            skipping = set.contains(&name(a));
        }
        if !skipping {
            all.push(a.clone());
        }
    }
    all.extend(own.iter().cloned());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground() -> Ground {
        Ground {
            integrator: "mlt",
            shares: Shares([0.35, 0.35, 0.1, 0.1, 0.05, 0.05]),
            max_depth: 10,
            lanes: 4,
        }
    }

    #[test]
    fn every_axis_measures_by_the_default_render() {
        for name in AxisName::ALL {
            let a = axis(name, &ground()).expect("something to vary");
            if name != AxisName::Sums {
                assert_eq!(a.settings[0].args, MLT, "{name:?}");
            }
            assert!(a.settings[0].biased.is_none());
            let mut args: Vec<_> = a.settings.iter().map(|s| &s.args).collect();
            args.sort();
            args.dedup();
            assert_eq!(args.len(), a.settings.len(), "{name:?}");
        }
        let flat = Ground {
            max_depth: 2,
            shares: Shares::default(),
            ..ground()
        };
        assert!(axis(AxisName::Depth, &flat).is_none());
        let names = axis(AxisName::Strategy, &flat).expect("an axis").settings;
        let names: Vec<&str> = names.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "all strategies",
                "without lens",
                "without lenssubpath",
                "without wavelength"
            ]
        );
    }

    #[test]
    fn a_setting_overrides_what_is_shared() {
        let text = |s: &str| s.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let shared = text("--resolution 64x64 --lanes 8 --two-stage --max-depth=7");
        assert_eq!(
            joined(&shared, &text("--integrator mlt --lanes 1 --max-depth 3")),
            text("--resolution 64x64 --two-stage --integrator mlt --lanes 1 --max-depth 3")
        );
        assert_eq!(joined(&shared, &[]), shared);
    }
}
