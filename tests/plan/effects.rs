//! Every effect is on exactly where something calls for it, whatever else is in the scene.

use super::scene;
use metrolux::plan::{Effect, Options, Plan, Verdict, remove};
use std::collections::BTreeSet;

/// Something that can be put into a scene.
struct Part {
    /// Goes before `WorldBegin`.
    prelude: &'static str,
    /// Goes into the world.
    world: &'static str,
    /// What it calls for, where paths are long enough.
    calls_for: &'static [Effect],
}

const GLASS: [Effect; 3] = [Effect::Specular, Effect::Caustic, Effect::MultiChain];

const NOTHING: Part = Part {
    prelude: "",
    world: "",
    calls_for: &[],
};

/// Parts that call for something, and parts that only look as if they did.
const PARTS: [Part; 12] = [
    Part {
        world: r#"Material "diffuse" "rgb reflectance" [ 0.2 0.5 0.1 ]
            Shape "sphere""#,
        calls_for: &[Effect::Colour],
        ..NOTHING
    },
    Part {
        world: r#"LightSource "point" "blackbody I" 2800"#,
        calls_for: &[Effect::Colour],
        ..NOTHING
    },
    Part {
        world: r#"Material "dielectric" "float eta" 1.5 Shape "sphere""#,
        calls_for: &GLASS,
        ..NOTHING
    },
    Part {
        world: r#"Material "dielectric" "spectrum eta" "glass-BK7" "float roughness" 0.3 Shape "sphere""#,
        calls_for: &[Effect::Dispersion, Effect::Colour],
        ..NOTHING
    },
    Part {
        prelude: r#""float lensradius" 0.1"#,
        calls_for: &[Effect::Aperture],
        ..NOTHING
    },
    Part {
        world: r#"LightSource "infinite" "rgb L" [ 0.5 0.5 0.5 ]"#,
        calls_for: &[Effect::Environment],
        ..NOTHING
    },
    Part {
        world: r#"Texture "tiles" "spectrum" "checkerboard" "rgb tex1" [ 0.1 0.1 0.1 ] "rgb tex2" [ 0.9 0.9 0.9 ]
            Material "diffuse" "texture reflectance" "tiles" Shape "sphere""#,
        calls_for: &[Effect::Textures],
        ..NOTHING
    },
    Part {
        world: r#"Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "normal N" [ 0 0 1 0 0 1 0 0.6 0.8 ]"#,
        calls_for: &[Effect::Normals],
        ..NOTHING
    },
    // A needle; a material on no surface.
    Part {
        world: r#"MakeNamedMaterial "spare" "string type" "conductor"
            Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0.4 0.0005 0 ]"#,
        calls_for: &[Effect::Slivers],
        ..NOTHING
    },
    // A light that emits nothing, and a surface that is not there.
    Part {
        world: r#"LightSource "infinite" "rgb L" [ 1 0 0 ] "float scale" 0
            AttributeBegin Material "conductor" Shape "sphere" "float alpha" 0 AttributeEnd"#,
        ..NOTHING
    },
    // A mixture that is certainly its grey part.
    Part {
        world: r#"MakeNamedMaterial "grey" "string type" "diffuse"
            MakeNamedMaterial "gold" "string type" "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k"
            MakeNamedMaterial "both" "string type" "mix" "string materials" [ "grey" "gold" ] "float amount" 0
            NamedMaterial "both" Shape "sphere""#,
        ..NOTHING
    },
    Part {
        world: r#"ObjectBegin "ball" Shape "sphere" ObjectEnd
            ObjectInstance "ball" Translate 0 0 1 ObjectInstance "ball""#,
        calls_for: &[Effect::Instances],
        ..NOTHING
    },
];

/// As if no object were small enough to be put into the world.
fn options() -> Options {
    Options {
        flat: Some(0),
        ..Options::default()
    }
}

fn text(parts: &[&Part], depth: u32) -> String {
    let join = |f: fn(&Part) -> &'static str| -> String {
        let each = parts.iter().map(|p| f(p));
        each.collect::<Vec<_>>().join("\n")
    };
    format!(
        r#"Integrator "mlt" "integer maxdepth" {depth}
        Film "rgb" "integer xresolution" 8 "integer yresolution" 8
        Camera "perspective" {}
        WorldBegin
        LightSource "point" "rgb I" [ 2 2 2 ]
        Material "diffuse"
        Shape "sphere" "float radius" 5
        {}"#,
        join(|p| p.prelude),
        join(|p| p.world)
    )
}

/// What a scene of these parts should be found to call for.
fn expected(parts: &[&Part], depth: u32) -> BTreeSet<&'static str> {
    let own = parts.iter().flat_map(|p| p.calls_for.iter().copied());
    let indirect = (depth > 1).then_some(Effect::Indirect);
    own.chain(indirect)
        .filter(|e| match e {
            Effect::Caustic | Effect::MultiChain => depth >= 2,
            _ => true,
        })
        .map(Effect::name)
        .collect()
}

fn found(plan: &Plan) -> BTreeSet<&'static str> {
    let on = plan.findings.iter().filter(|f| f.verdict.on());
    on.map(|f| f.effect.name()).collect()
}

/// All 4096 sets of parts: an effect is on if and only if one of its causes is there.
#[test]
fn effects_are_the_union_of_what_the_parts_call_for() {
    for set in 0..1u32 << PARTS.len() {
        let parts: Vec<&Part> = (0..PARTS.len())
            .filter(|i| set >> i & 1 == 1)
            .map(|i| &PARTS[i])
            .collect();
        let depth = [8, 3, 2, 1][set as usize % 4];
        let scene = scene(&text(&parts, depth));
        let plan = Plan::new(&scene, &options());
        assert_eq!(
            found(&plan),
            expected(&parts, depth),
            "depth {depth}\n{}",
            text(&parts, depth)
        );
        assert_eq!(plan.lanes, if plan.on(Effect::Colour) { 4 } else { 1 });
        assert_eq!(plan.grey.is_none(), plan.on(Effect::Colour));
        assert_eq!(plan, Plan::new(&scene, &options()), "the same again");
    }
}

/// Taking out the causes of an effect turns it off and leaves those alone that do not hang on the same causes.
#[test]
fn removing_the_last_cause_turns_an_effect_off() {
    let all: Vec<&Part> = PARTS.iter().collect();
    let whole = scene(&text(&all, 8));
    let before = found(&Plan::new(&whole, &options()));
    // Nothing in a scene calls for alpha: the loader settles it.
    assert_eq!(before.len(), Effect::ALL.len() - 1);
    for effect in Effect::ALL {
        let dependent: &[Effect] = match effect {
            // How colour, slivers and the perturbations are simulated is no matter of the scene.
            Effect::Colour | Effect::Caustic | Effect::MultiChain => continue,
            Effect::Alpha | Effect::Slivers => continue,
            Effect::Specular => &GLASS,
            Effect::Indirect => &[Effect::Indirect, Effect::Caustic, Effect::MultiChain],
            _ => &[effect],
        };
        let mut without = whole.clone();
        remove(effect, &mut without);
        let mut left = before.clone();
        dependent
            .iter()
            .for_each(|e| assert!(left.remove(e.name())));
        let after = found(&Plan::new(&without, &options()));
        assert_eq!(after, left, "without {effect}");
    }
}

#[test]
fn forcing_and_leaving_out_are_told_and_done() {
    let all: Vec<&Part> = PARTS.iter().collect();
    let (full, bare) = (text(&all, 8), text(&[], 1));
    for effect in Effect::ALL {
        let mut s = scene(&full);
        let without = Options {
            without: vec![effect],
            ..options()
        };
        let plan = Plan::make(&mut s, &without);
        let verdict = plan.finding(effect).verdict;
        if effect == Effect::Alpha {
            assert_eq!(verdict, Verdict::NotCalledFor);
            continue;
        }
        assert_eq!(verdict, Verdict::LeftOut, "{effect}");
        assert!(!plan.finding(effect).causes.is_empty());
        assert_eq!(plan.wrongs().len(), 1);
        // The others are as they would be in a scene without it.
        let again = Plan::new(&s, &options());
        assert!(again.findings.iter().all(|f| f.effect == effect || {
            let now = plan.finding(f.effect).verdict.on();
            now == f.verdict.on()
        }));
        let mut s = scene(&bare);
        let force = Options {
            force: vec![effect],
            ..options()
        };
        let plan = Plan::make(&mut s, &force);
        assert_eq!(plan.finding(effect).verdict, Verdict::Forced, "{effect}");
        assert_eq!(found(&plan), BTreeSet::from([effect.name()]));
    }
}

#[test]
fn a_cause_names_its_place() {
    let text = "Integrator \"mlt\" \"integer maxdepth\" 4\nCamera \"perspective\"\n  \"float lensradius\" 0.5\nWorldBegin\n\
                LightSource \"point\"\n  Material \"conductor\"\nShape \"sphere\"\nShape \"sphere\"\n";
    let plan = Plan::new(&scene(text), &Options::default());
    let at = |e: Effect| -> Vec<String> {
        let causes = &plan.finding(e).causes;
        causes
            .iter()
            .map(|c| c.at.as_ref().expect("a place").to_string())
            .collect()
    };
    assert_eq!(at(Effect::Specular), ["<text>:6:3"]);
    assert_eq!(at(Effect::Colour), ["<text>:6:3"]);
    assert_eq!(at(Effect::Aperture), ["<text>:2:1"]);
    assert_eq!(at(Effect::Indirect), ["<text>:1:1"]);
    // No rough surface: nothing for a caustic to fall on.
    assert!(at(Effect::Caustic).is_empty());
}
