//! The plan of a render: which effects the scene calls for and why, and what follows for how it is simulated.
//!
//! Pure: the same scene and options give the same plan. What a plan names as the cause of an effect is something in the
//! scene that is certain to take part in the image as far as can be told without tracing rays.

mod causes;
mod change;
mod colour;
mod effect;
pub mod objects;
mod power;
mod reach;
mod slivers;
mod strategy;
mod text;
mod unseen;

pub use causes::Cause;
pub use change::{fold, insert, remove};
pub use effect::Effect;
pub use power::{Chosen, light_powers};
pub use reach::{Dark, dark_lights, live_materials};
pub use strategy::{Shares, Strategy};
pub use unseen::unseen_shapes;

use crate::scene::Scene;
use crate::scene::flatten::flatten;
use crate::scene::spectrum::{Curve, Grey};
use crate::scene::subset::leave_out;
use causes::Causes;
use serde::Serialize;

/// What a user decides beside the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Number of wavelengths a path carries, if it is not for the plan to say.
    pub lanes: Option<usize>,
    /// Shares of the strategies, if they are not for the plan to say.
    pub shares: Option<Shares>,
    /// Effects to simulate whether the scene calls for them or not.
    pub force: Vec<Effect>,
    /// Effects to leave out whether the scene calls for them or not.
    pub without: Vec<Effect>,
    /// Primitives that objects may become beside one copy of each before they are instanced; [`objects::FLAT`] if not
    /// given.
    pub flat: Option<u64>,
}

/// Whether an effect is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The scene calls for it.
    CalledFor,
    /// Nothing calls for it.
    NotCalledFor,
    /// It is simulated because the user wants it, though nothing calls for it.
    Forced,
    /// It is left out because the user wants that, though the scene calls for it.
    LeftOut,
}

impl Verdict {
    /// It is simulated.
    pub fn on(self) -> bool {
        matches!(self, Self::CalledFor | Self::Forced)
    }
}

/// What the plan found of one effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Which.
    pub effect: Effect,
    /// Whether it is simulated.
    pub verdict: Verdict,
    /// What calls for it.
    pub causes: Vec<Cause>,
}

/// A light that gives the image nothing and is left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unlit {
    /// Where it stands, and what it is.
    pub light: Cause,
    /// Why it gives nothing.
    pub why: Dark,
    /// Lights of this directive that are left out: a mesh has one for each triangle.
    pub count: usize,
}

/// How a scene is rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// All effects, in the order of [`Effect::ALL`].
    pub findings: Vec<Finding>,
    /// Wavelengths a path carries.
    pub lanes: usize,
    /// The one spectrum of all lights, and what stands for it, in a scene without colour.
    pub grey: Option<(Curve, Grey)>,
    /// Shares of the mutation strategies: the user's, or those that a run has unless a pilot finds better ones.
    pub shares: Shares,
    /// They are the user's.
    pub asked: bool,
    /// For each light of the scene, whether it takes part.
    pub lit: Vec<bool>,
    /// How often each light is chosen: its luminous power, 0 for those that do not take part.
    pub power: Vec<f64>,
    /// The same by directive.
    pub chosen: Vec<Chosen>,
    /// The lights that do not take part.
    pub unlit: Vec<Unlit>,
    /// Materials that no surface is made of.
    pub unused: Vec<Cause>,
    /// Shapes that no path can meet.
    pub unseen: Vec<Cause>,
    /// Most edges of a path: storage is sized by it, and no path is cut shorter.
    pub max_edges: usize,
}

/// Lanes of a scene with colour.
const LANES: usize = 4;

/// The longest paths that can be stored: 3·edges + 9 vertices of two paths and what is between them, numbered by 16 bits.
pub const MOST_EDGES: usize = (u16::MAX as usize - 9) / 3;

impl Plan {
    /// Plans a render of the scene as it stands.
    pub fn new(scene: &Scene, options: &Options) -> Self {
        let dark = dark_lights(scene);
        let forced = |e: Effect| options.force.contains(&e);
        let lit = lit(scene, &dark, options);
        let unseen = unseen_shapes(scene, &lit);
        let live = live_materials(scene, &unseen);
        let power = light_powers(scene, |i| lit[i]);
        let flat = options.flat.unwrap_or(objects::FLAT);
        let mut causes = Causes::new(scene, &live, &lit, &unseen, flat);
        let findings: Vec<Finding> = Effect::ALL
            .into_iter()
            .map(|effect| {
                let mut found = causes.take(effect);
                if effect == Effect::Colour && options.lanes.is_some_and(|n| n > 1) {
                    let n = options.lanes.unwrap_or(LANES);
                    found.push(Cause::option(format!("--lanes {n} asks for wavelengths")));
                }
                let verdict = match (found.is_empty(), forced(effect)) {
                    _ if options.without.contains(&effect) && !found.is_empty() => Verdict::LeftOut,
                    (false, _) => Verdict::CalledFor,
                    (true, true) => Verdict::Forced,
                    (true, false) => Verdict::NotCalledFor,
                };
                Finding {
                    effect,
                    verdict,
                    causes: found,
                }
            })
            .collect();
        let on = |e: Effect| findings[e as usize].verdict.on();
        let grey = if on(Effect::Colour) {
            None
        } else {
            // Light that the eye does not see has no colour to multiply in: it is simulated as any other.
            Grey::new(&causes.illuminant).map(|g| (causes.illuminant.clone(), g))
        };
        let lanes = match (&grey, options.lanes) {
            (Some(_), _) => 1,
            (None, Some(n)) => n,
            (None, None) => LANES,
        };
        let planned = Shares::of(on(Effect::Caustic), on(Effect::MultiChain), grey.is_none());
        let shares = match options.shares {
            Some(s) if grey.is_some() => s.without(Strategy::Wavelength),
            Some(s) => s,
            None => planned,
        };
        Self {
            lanes,
            shares,
            asked: options.shares.is_some(),
            unlit: unlit(scene, &dark, &lit),
            unused: (0..live.len())
                .filter(|i| !live[*i])
                .map(|i| Cause::material(scene, i, "is on no surface that takes part"))
                .collect(),
            unseen: told_unseen(scene, &unseen),
            chosen: power::chosen(scene, &lit, &power),
            power,
            lit,
            grey,
            max_edges: scene.settings.max_depth as usize + 1,
            findings,
        }
    }

    /// Makes the scene ready for a render and plans that: what is to be left out or forced goes out of the scene or into
    /// it, objects that are not worth an instance are put into the world, mixes that are certain are resolved, and shapes
    /// that no path can meet are left out; rays leave out the slivers they start on where there are any. The findings tell
    /// of the scene as it was.
    pub fn make(scene: &mut Scene, options: &Options) -> Self {
        let before = Self::new(scene, options);
        for f in &before.findings {
            match f.verdict {
                Verdict::LeftOut => remove(f.effect, scene),
                Verdict::Forced => insert(f.effect, scene),
                Verdict::CalledFor | Verdict::NotCalledFor => {}
            }
        }
        if !options.force.contains(&Effect::Instances) {
            let flat = options.flat.unwrap_or(objects::FLAT);
            let stays = objects::instanced(&scene.geometry, flat);
            flatten(scene, |i| !stays[i]);
        }
        fold(scene);
        let unseen = unseen_shapes(scene, &lit(scene, &dark_lights(scene), options));
        let told = told_unseen(scene, &unseen);
        leave_out(scene, &unseen);
        let mut plan = Self::new(scene, options);
        for (now, f) in plan.findings.iter_mut().zip(before.findings) {
            // Which objects are instanced was decided among all of them.
            let settled = f.effect == Effect::Instances;
            if settled || matches!(f.verdict, Verdict::LeftOut | Verdict::Forced) {
                *now = f;
            }
        }
        scene.geometry.leave_out = plan.on(Effect::Slivers);
        Self {
            unlit: before.unlit,
            unused: before.unused,
            unseen: told,
            ..plan
        }
    }

    /// The finding about an effect.
    pub fn finding(&self, effect: Effect) -> &Finding {
        &self.findings[effect as usize]
    }

    /// Whether an effect is simulated.
    pub fn on(&self, effect: Effect) -> bool {
        self.finding(effect).verdict.on()
    }
}

impl Shares {
    /// The shares that the plan of a scene gives without any option.
    pub fn for_scene(scene: &Scene) -> Self {
        Plan::new(scene, &Options::default()).shares
    }
}

/// For each light, whether it takes part.
fn lit(scene: &Scene, dark: &[Option<Dark>], options: &Options) -> Vec<bool> {
    let sky = options.force.contains(&Effect::Environment);
    dark.iter()
        .zip(&scene.lights)
        .map(|(d, l)| d.is_none() || (sky && causes::is_environment(l)))
        .collect()
}

fn told_unseen(scene: &Scene, unseen: &[bool]) -> Vec<Cause> {
    let of = |i| Cause::shape(scene, i, "is where no path can come");
    let shapes = (0..unseen.len()).filter(|i| unseen[*i]);
    shapes.map(of).collect()
}

fn unlit(scene: &Scene, dark: &[Option<Dark>], lit: &[bool]) -> Vec<Unlit> {
    let mut all: Vec<Unlit> = Vec::new();
    for (i, why) in dark.iter().enumerate().filter(|d| !lit[d.0]) {
        let Some(why) = *why else { continue };
        let light = Cause::light(scene, i, why.why());
        match all.iter_mut().find(|u| u.light == light) {
            Some(u) => u.count += 1,
            None => all.push(Unlit {
                light,
                why,
                count: 1,
            }),
        }
    }
    all
}
