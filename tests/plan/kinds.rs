//! Every kind of thing that calls for an effect does so alone, and what only resembles it does not.

use super::scene;
use metrolux::plan::{Effect, Options, Plan};
use std::collections::BTreeSet;

/// A kind of cause: what stands before `WorldBegin`, what in the world, and all it calls for.
type Kind = (&'static str, &'static str, &'static [Effect]);

const COLOUR: &[Effect] = &[Effect::Colour];
const DELTA: &[Effect] = &[Effect::Specular, Effect::Caustic, Effect::MultiChain];
const TEXTURES: &[Effect] = &[Effect::Textures];
const NOTHING: &[Effect] = &[];

const KINDS: [Kind; 33] = [
    // Slivers: of aspect 1010, in an object too; of aspect 990 it is none.
    (
        "",
        r#"Shape "trianglemesh" "point3 P" [ 0 0 0  101 0 0  30 0.1 0 ]"#,
        &[Effect::Slivers],
    ),
    (
        "",
        r#"ObjectBegin "needle" Shape "trianglemesh" "point3 P" [ 0 0 0  0 101 0  0 30 0.1 ] ObjectEnd
            ObjectInstance "needle""#,
        &[Effect::Slivers],
    ),
    (
        "",
        r#"Shape "trianglemesh" "point3 P" [ 0 0 0  99 0 0  30 0.1 0 ]"#,
        NOTHING,
    ),
    // Colour: of a surface, of a metal, of a coat, of a lamp beside another, of a texture.
    (
        "",
        r#"Material "diffuse" "rgb reflectance" [ 0.2 0.5 0.1 ] Shape "sphere""#,
        COLOUR,
    ),
    (
        "",
        r#"Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" 0.4
            Shape "sphere""#,
        COLOUR,
    ),
    (
        "",
        r#"Material "coateddiffuse" "rgb reflectance" [ 0.2 0.5 0.1 ] "float roughness" 0.4 Shape "sphere""#,
        COLOUR,
    ),
    ("", r#"LightSource "spot" "blackbody I" 2800"#, COLOUR),
    ("", r#"LightSource "distant" "rgb L" [ 1 0.5 0.2 ]"#, COLOUR),
    (
        "",
        r#"AttributeBegin AreaLightSource "diffuse" "rgb L" [ 1 0.5 0.2 ] Shape "sphere" AttributeEnd"#,
        COLOUR,
    ),
    (
        "",
        r#"Texture "c" "spectrum" "checkerboard" "rgb tex1" [ 0.9 0.1 0.1 ] "rgb tex2" [ 0.9 0.9 0.9 ]
            Material "diffuse" "texture reflectance" "c" Shape "sphere""#,
        &[Effect::Colour, Effect::Textures],
    ),
    // Two lamps of one spectrum, one brighter; a black texture times a colour.
    ("", r#"LightSource "distant" "rgb L" [ 3 3 3 ]"#, NOTHING),
    (
        "",
        r#"Texture "c" "spectrum" "scale" "rgb tex" [ 0.9 0.1 0.1 ] "float scale" 0
            Material "diffuse" "texture reflectance" "c" Shape "sphere""#,
        NOTHING,
    ),
    // Dispersion: of clear glass and of ground glass, in a sphere or behind a mixture.
    (
        "",
        r#"Material "dielectric" "spectrum eta" "glass-F11" Shape "sphere""#,
        &[
            Effect::Colour,
            Effect::Dispersion,
            Effect::Specular,
            Effect::Caustic,
            Effect::MultiChain,
        ],
    ),
    (
        "",
        r#"MakeNamedMaterial "grey" "string type" "diffuse"
            MakeNamedMaterial "glass" "string type" "dielectric" "spectrum eta" "glass-F11" "float roughness" 0.4
            MakeNamedMaterial "both" "string type" "mix" "string materials" [ "grey" "glass" ] "float amount" 1
            NamedMaterial "both" Shape "sphere""#,
        &[Effect::Colour, Effect::Dispersion],
    ),
    // Deltas: glass, a pane, a mirror, a coat, a smooth part of a mixture, ground glass without a step in its index.
    ("", r#"Material "dielectric" Shape "sphere""#, DELTA),
    ("", r#"Material "thindielectric" Shape "sphere""#, DELTA),
    (
        "",
        r#"Material "conductor" "rgb reflectance" [ 0.5 0.5 0.5 ] Shape "sphere""#,
        DELTA,
    ),
    (
        "",
        r#"Material "coateddiffuse" "float roughness" 0 Shape "sphere""#,
        DELTA,
    ),
    (
        "",
        r#"MakeNamedMaterial "grey" "string type" "diffuse"
            MakeNamedMaterial "mirror" "string type" "conductor" "rgb reflectance" [ 0.5 0.5 0.5 ]
            MakeNamedMaterial "both" "string type" "mix" "string materials" [ "grey" "mirror" ] "float amount" 0.5
            NamedMaterial "both" Shape "sphere""#,
        &[
            Effect::Specular,
            Effect::Caustic,
            Effect::MultiChain,
            Effect::Textures,
        ],
    ),
    (
        "",
        r#"Material "dielectric" "float eta" 1 "float roughness" 0.4 Shape "sphere""#,
        DELTA,
    ),
    // Rough glass, a rough metal, and a mirror that reflects nothing.
    (
        "",
        r#"Material "dielectric" "float roughness" 0.4 Shape "sphere""#,
        NOTHING,
    ),
    (
        "",
        r#"Material "conductor" "rgb reflectance" [ 0.5 0.5 0.5 ] "float roughness" 0.4 Shape "sphere""#,
        NOTHING,
    ),
    (
        "",
        r#"Material "conductor" "rgb reflectance" [ 0 0 0 ] Shape "sphere""#,
        NOTHING,
    ),
    // An aperture; the distance in focus alone is none.
    (r#""float lensradius" 0.01"#, "", &[Effect::Aperture]),
    (r#""float focaldistance" 3"#, "", NOTHING),
    // The environment; parallel light is none.
    (
        "",
        r#"LightSource "infinite" "rgb L" [ 0.1 0.1 0.1 ]"#,
        &[Effect::Environment],
    ),
    // Textures: of a reflectance, of a roughness, of a mixture's weight.
    (
        "",
        r#"Texture "c" "spectrum" "checkerboard" "rgb tex1" [ 0.5 0.5 0.5 ] "rgb tex2" [ 0.9 0.9 0.9 ]
            Material "diffuse" "texture reflectance" "c" Shape "sphere""#,
        TEXTURES,
    ),
    (
        "",
        r#"Texture "r" "float" "checkerboard" "float tex1" 0.3 "float tex2" 0.5
            Material "conductor" "rgb reflectance" [ 0.5 0.5 0.5 ] "texture roughness" "r" Shape "sphere""#,
        &[
            Effect::Specular,
            Effect::Caustic,
            Effect::MultiChain,
            Effect::Textures,
        ],
    ),
    // Normals: of a mesh, of a subdivided one.
    (
        "",
        r#"Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "normal N" [ 0 0 1 0 0 1 0 0.6 0.8 ]"#,
        &[Effect::Normals],
    ),
    (
        "",
        r#"Shape "loopsubdiv" "integer levels" 1 "integer indices" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]
            "point3 P" [ 0 0 0 1 0 0 0 1 0 0 0 1 ]"#,
        &[Effect::Normals],
    ),
    (
        "",
        r#"Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ]"#,
        NOTHING,
    ),
    // Instances: two places of an object; one place is none.
    (
        "",
        r#"ObjectBegin "ball" Shape "sphere" ObjectEnd
            ObjectInstance "ball" Translate 0 0 1 ObjectInstance "ball""#,
        &[Effect::Instances],
    ),
    (
        "",
        r#"ObjectBegin "ball" Shape "sphere" ObjectEnd ObjectInstance "ball""#,
        NOTHING,
    ),
];

fn found(prelude: &str, world: &str, depth: u32) -> BTreeSet<&'static str> {
    let text = format!(
        r#"Integrator "mlt" "integer maxdepth" {depth}
        Film "rgb" "integer xresolution" 8 "integer yresolution" 8
        Camera "perspective" {prelude}
        WorldBegin
        LightSource "point" "rgb I" [ 2 2 2 ]
        Material "diffuse"
        Shape "sphere" "float radius" 5
        AttributeBegin {world}
        AttributeEnd"#
    );
    let options = Options {
        // As if no object were small enough to be put into the world.
        flat: Some(0),
        ..Options::default()
    };
    let plan = Plan::new(&scene(&text), &options);
    let on = plan.findings.iter().filter(|f| f.verdict.on());
    on.map(|f| f.effect.name()).collect()
}

#[test]
fn each_kind_of_cause_calls_for_its_effects_alone() {
    let nothing = found("", "", 4);
    assert_eq!(nothing, BTreeSet::from([Effect::Indirect.name()]));
    for (prelude, world, effects) in KINDS {
        let mut expected = nothing.clone();
        expected.extend(effects.iter().map(|e| e.name()));
        assert_eq!(found(prelude, world, 4), expected, "{prelude}{world}");
    }
}

/// From a scene with nothing: one cause turns an effect on, whichever it is; with all others there too it stays on, and
/// goes off with the last of its own.
#[test]
fn the_first_cause_turns_an_effect_on_and_the_last_turns_it_off() {
    let join = |which: &dyn Fn(&Kind) -> bool| {
        let (mut prelude, mut world) = (String::new(), String::new());
        for (i, kind) in KINDS.iter().enumerate().filter(|k| which(k.1)) {
            if !prelude.contains(kind.0.split_whitespace().nth(1).unwrap_or_default()) {
                prelude += kind.0;
            }
            // Names are defined once.
            let own = [
                "\"c\"",
                "\"r\"",
                "\"ball\"",
                "\"grey\"",
                "\"both\"",
                "\"mirror\"",
                "\"glass\"",
            ];
            let mut text = kind.1.to_owned();
            for name in own {
                text = text.replace(name, &format!("{}{i}\"", &name[..name.len() - 1]));
            }
            world += &format!("AttributeBegin {text}\nAttributeEnd\n");
        }
        (prelude, world)
    };
    for effect in Effect::ALL {
        // The loader settles alpha; the depth is no part of the world.
        if matches!(effect, Effect::Alpha | Effect::Indirect) {
            continue;
        }
        let own = |k: &Kind| k.2.contains(&effect);
        assert!(KINDS.iter().any(own), "{effect} has a cause here");
        for one in KINDS.iter().filter(|k| own(k)) {
            assert!(found(one.0, one.1, 4).contains(effect.name()));
        }
        let (prelude, world) = join(&|_| true);
        assert!(found(&prelude, &world, 4).contains(effect.name()));
        let (prelude, world) = join(&|k| !own(k));
        assert!(
            !found(&prelude, &world, 4).contains(effect.name()),
            "{effect}"
        );
    }
    assert!(found("", "", 2).contains("indirect") && !found("", "", 1).contains("indirect"));
}

/// There is no cause for alpha: the loader leaves out what is not there, and refuses what is there in part, with its
/// place.
#[test]
fn alpha_is_settled_or_refused() {
    for alpha in ["0", "1"] {
        let world = format!("Shape \"sphere\" \"float alpha\" {alpha}");
        assert!(!found("", &world, 4).contains("alpha"));
    }
    let text = "Camera \"perspective\"\nWorldBegin\nShape \"sphere\" \"float alpha\" 0.5\n";
    let options = metrolux::scene::load::LoadOptions::default();
    let error = metrolux::scene::load::load_str(text, std::path::Path::new(""), &options);
    let error = error.expect_err("a half is refused").to_string();
    assert!(error.contains(":3:") && error.contains("alpha"), "{error}");
}
