//! Every error says where, what was found and what was expected.

use crate::{TRIANGLE, load};
use metrolux::scene::load::{Fault, LoadOptions, load_str};
use std::path::Path;

/// The message for a whole text.
fn message(text: &str) -> String {
    match load(text) {
        Ok(_) => panic!("no error in:\n{text}"),
        Err(e) => e.to_string(),
    }
}

/// The message for the body of a world, which begins on line 2.
fn in_world(body: &str) -> String {
    message(&format!("WorldBegin\n{body}"))
}

#[test]
fn files() {
    let e = in_world(r#"Shape "plymesh" "string filename" "no such.ply""#);
    assert_eq!(
        e,
        "<text>:2:17: cannot read the mesh no such.ply: No such file or directory (os error 2)"
    );
    let e = in_world(r#"  Include "nowhere.pbrt""#);
    assert_eq!(
        e,
        "<text>:2:11: cannot read nowhere.pbrt: No such file or directory (os error 2)"
    );
    let e = in_world(r#"Texture "t" "spectrum" "imagemap" "string filename" "none.png""#);
    assert!(
        e.starts_with("<text>:2:35: cannot read the image none.png: "),
        "{e}"
    );
    let e = in_world(r#"Material "conductor" "spectrum eta" "Unobtainium.eta.spd""#);
    assert_eq!(
        e,
        "<text>:2:22: \"Unobtainium.eta.spd\" is neither a known spectrum nor a readable file (found No such file or directory (os error 2))"
    );
}

#[test]
fn numbers() {
    assert_eq!(
        in_world("Translate 1 2\nIdentity"),
        "<text>:3:1: unexpected text (found Identity, expected a number (3 of 3 of Translate))"
    );
    assert_eq!(
        in_world("Transform [1 0 0 0  0 1 0 0  0 0 1 0  0 0 0]"),
        "<text>:2:44: unexpected text (found ], expected a number (16 of 16 of Transform))"
    );
    assert_eq!(
        in_world(r#"Material "diffuse" "rgb reflectance" [0.5 0.5]"#),
        "<text>:2:20: parameter \"reflectance\" has a wrong number of numbers (found 2, expected a multiple of 3)"
    );
    assert_eq!(
        in_world(r#"Shape "sphere" "float radius" [1 2]"#),
        "<text>:2:16: parameter \"radius\" has a wrong number of values (found 2, expected 1)"
    );
    assert_eq!(
        in_world(r#"Shape "sphere" "float radius" -1"#),
        "<text>:2:16: Shape \"sphere\" cannot use this value of \"radius\" (found -1, expected a radius above 0)"
    );
    assert_eq!(
        in_world(r#"Shape "sphere" "integer radius" 1"#),
        "<text>:2:16: parameter \"radius\" of Shape \"sphere\" has the wrong type (found integer, expected float)"
    );
    assert_eq!(
        in_world(r#"Material "diffuse" "rgb reflectance" [0.5 2 0.5]"#),
        "<text>:2:20: parameter \"reflectance\" is not a spectrum (found [0.5, 2.0, 0.5], expected at most 1)"
    );
    assert_eq!(
        in_world(r#"Shape "sphere" "float radius" "one""#),
        "<text>:2:16: parameter \"radius\" has values of the wrong kind (found strings, expected float)"
    );
}

#[test]
fn names() {
    assert_eq!(
        in_world("MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nNamedMaterial \"b\""),
        "<text>:3:15: unknown material (found \"b\", expected one of \"a\")"
    );
    assert_eq!(
        in_world(r#"Material "diffuse" "texture reflectance" "wood""#),
        "<text>:2:20: unknown spectrum texture (found \"wood\", expected the name of a spectrum texture defined above)"
    );
    assert_eq!(
        in_world("ObjectInstance \"chair\""),
        "<text>:2:16: unknown object (found \"chair\", expected a name given to ObjectBegin above)"
    );
    assert_eq!(
        in_world("CoordSysTransform \"desk\""),
        "<text>:2:19: unknown coordinate system (found \"desk\", expected a name given to CoordinateSystem above, \"camera\" or \"world\")"
    );
}

#[test]
fn blocks() {
    assert_eq!(
        in_world("AttributeEnd"),
        "<text>:2:1: AttributeEnd without AttributeBegin"
    );
    assert_eq!(
        in_world(" AttributeBegin\n"),
        "<text>:2:2: AttributeBegin without AttributeEnd"
    );
    assert_eq!(
        in_world("ObjectBegin \"o\"\nAttributeEnd"),
        "<text>:3:1: AttributeEnd inside another block (found ObjectBegin at <text>:2:1 still open)"
    );
    assert_eq!(message("Identity"), "<text>: the scene has no WorldBegin");
    assert_eq!(
        in_world("Film \"rgb\""),
        "<text>:2:1: Film stands on the wrong side of WorldBegin (expected it before WorldBegin)"
    );
}

#[test]
fn meshes() {
    assert_eq!(
        in_world(
            r#"Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 3]"#
        ),
        "<text>:2:53: Shape \"trianglemesh\" cannot use this value of \"indices\" (found 3 as number 2, expected 0 to 2)"
    );
    assert_eq!(
        in_world(r#"Shape "trianglemesh" "point3 P" [0 0 0 1 nan 0 0 1 0]"#),
        "<text>:2:22: value 1 of parameter \"P\" is not finite (found NaN, expected finite numbers)"
    );
    assert_eq!(
        in_world(r#"Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "normal N" [0 0 1]"#),
        "<text>:2:53: Shape \"trianglemesh\" cannot use this value of \"N\" (found 1 values, expected 3, one for each vertex)"
    );
    assert_eq!(
        in_world(r#"Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1]"#),
        "<text>:2:53: Shape \"trianglemesh\" cannot use this value of \"indices\" (found 2 indices, expected a multiple of 3)"
    );
}

#[test]
fn transforms() {
    assert_eq!(
        in_world("Scale 1 0 1"),
        "<text>:2:1: Scale makes the transform singular"
    );
    assert_eq!(
        in_world("Transform [1 0 0 0  0 1 0 0  0 0 1 0.5  0 0 0 1]"),
        "<text>:2:1: Transform is not affine (found the last row [0.0, 0.0, 0.5, 1.0], expected 0 0 0 1)"
    );
    assert_eq!(
        in_world("LookAt 0 0 0  0 1 0  0 1 0"),
        "<text>:2:1: LookAt makes the transform singular (found eye [0, 0, 0], target [0, 1, 0], up [0, 1, 0], expected a target away from the eye and not in the direction of up)"
    );
}

/// What is not supported is an error that names it, and a warning to a lenient reader, who goes on.
#[test]
fn unsupported() {
    let cases = [
        (
            "Frobnicate \"x\" [1 2]",
            "<text>:2:1: unknown directive (found Frobnicate)",
        ),
        (
            "Shape \"curve\"",
            "<text>:2:1: this shape is not supported (found \"curve\", expected \"trianglemesh\", \"plymesh\", \"bilinearmesh\", \"loopsubdiv\", \"sphere\" or \"disk\")",
        ),
        (
            "Material \"hair\"",
            "<text>:2:1: this material is not supported (found \"hair\", expected \"diffuse\", \"dielectric\", \"thindielectric\", \"conductor\", \"coateddiffuse\", \"mix\" or \"interface\")",
        ),
        (
            "LightSource \"goniometric\"",
            "<text>:2:1: this light is not supported (found \"goniometric\", expected \"point\", \"spot\", \"distant\" or \"infinite\")",
        ),
        (
            "Texture \"t\" \"spectrum\" \"marble\"",
            "<text>:2:1: this texture is not supported (found \"marble\", expected \"constant\", \"scale\", \"checkerboard\" or \"imagemap\")",
        ),
        (
            "Material \"diffuse\" \"float sheen\" 1",
            "<text>:2:20: Material \"diffuse\" does not take the parameter \"float sheen\"",
        ),
        (
            "Material \"coateddiffuse\" \"float thickness\" 0.1",
            "<text>:2:26: a coat of this thickness is not supported (found 0.1, expected 0.01)",
        ),
        (
            "Texture \"t\" \"float\" \"constant\"  Material \"coateddiffuse\" \"texture thickness\" \"t\"",
            "<text>:2:58: a coat of this thickness is not supported (found 1, expected 0.01)",
        ),
        (
            "MediumInterface \"a\" \"b\"",
            "<text>:2:1: participating media are not supported (found MediumInterface)",
        ),
        (
            "ActiveTransform EndTime",
            "<text>:2:1: motion is not supported (found ActiveTransform EndTime)",
        ),
    ];
    for (body, want) in cases {
        let text = format!("WorldBegin\n{body}\n{TRIANGLE}");
        let e = load(&text).unwrap_err();
        assert_eq!(e.to_string(), want);
        assert_eq!(e.fault, Fault::Unsupported);
        let lenient = LoadOptions {
            lenient: true,
            ..LoadOptions::default()
        };
        let s = load_str(&text, Path::new(""), &lenient).unwrap();
        assert_eq!(s.geometry.triangles.len(), 1, "{body}");
        assert!(
            s.warnings.contains(&format!("ignored: {want}")),
            "{:?}",
            s.warnings
        );
    }
}

/// A lenient reader keeps the coat, with the thickness that there is; given as the default, it is no departure.
#[test]
fn thickness_of_a_coat() {
    let with = |thickness: &str| {
        let coat =
            format!("Material \"coateddiffuse\" \"rgb reflectance\" [0.2 0.3 0.4] {thickness}");
        let text = format!("WorldBegin\n{coat}\n{TRIANGLE}");
        load_str(
            &text,
            Path::new(""),
            &LoadOptions {
                lenient: true,
                ..LoadOptions::default()
            },
        )
        .expect("lenient")
    };
    let plain = with("");
    assert_eq!(with("\"float thickness\" 0.2").materials, plain.materials);
    let default = with("\"float thickness\" 0.01");
    assert_eq!(default.materials, plain.materials);
    assert_eq!(default.warnings, plain.warnings);
    assert!(load("WorldBegin\nMaterial \"coateddiffuse\" \"float thickness\" 0.01").is_ok());
}

/// What cannot change the image passes in silence.
/// It decides which random numbers, not which image.
#[test]
fn an_unknown_sampler_is_only_told() {
    let s = load(&format!(
        "Sampler \"sobel\"\nWorldBegin\nLightSource \"point\"\n{TRIANGLE}"
    ))
    .unwrap();
    assert_eq!(
        s.warnings,
        ["<text>:1:1: the sampler \"sobel\" is not known"]
    );
}

#[test]
fn harmless_parameters_pass() {
    let s = load(
        r#"Sampler "halton" "integer pixelsamples" 8 "integer seed" 3
        Film "rgb" "bool savefp16" false "float diagonal" 35 "string filename" "a.exr"
        Accelerator "bvh" "integer maxnodeprims" 4
        Option "bool quiet" true
        Integrator "path" "string lightsampler" "bvh"
        WorldBegin
        LightSource "point""#,
    )
    .unwrap();
    assert_eq!(s.warnings, Vec::<String>::new());
    assert_eq!(s.settings.spp, Some(8));
}

/// A file that includes itself ends in an error, not in a stack overflow.
#[test]
fn inclusion_without_end() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.pbrt");
    std::fs::write(&file, "Include \"a.pbrt\"").unwrap();
    let e = metrolux::scene::load::load_scene(&file, &LoadOptions::default()).unwrap_err();
    assert!(e.to_string().contains("is included too deeply"), "{e}");
}

/// No prefix of a scene makes the reader panic.
#[test]
fn truncation() {
    let text = r#"LookAt 0 0 0  0 0 1  0 1 0 Camera "perspective" "float fov" [40]
        WorldBegin AttributeBegin Texture "t" "float" "constant" "float value" 2
        Material "dielectric" "spectrum eta" [400 1.5 700 1.4] ObjectBegin "o"
        Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1] ObjectEnd
        ObjectInstance "o" LightSource "spot" "blackbody I" 4000 AttributeEnd"#;
    load(text).unwrap();
    for n in 0..text.len() {
        if let Err(e) = load(&text[..n]) {
            assert!(e.to_string().starts_with("<text>"), "{e}");
        }
    }
}

/// A few lines cannot ask for 2⁶⁰ copies.
#[test]
fn doubling_ends_early() {
    let mut textures = String::from("Texture \"t0\" \"float\" \"constant\"\n");
    let mut mixes = String::from("MakeNamedMaterial \"m0\" \"string type\" \"diffuse\"\n");
    for i in 1..60 {
        let p = i - 1;
        textures += &format!(
            "Texture \"t{i}\" \"float\" \"scale\" \"texture tex\" \"t{p}\" \"texture scale\" \"t{p}\"\n"
        );
        mixes += &format!(
            "MakeNamedMaterial \"m{i}\" \"string type\" \"mix\" \"string materials\" [\"m{p}\" \"m{p}\"]\n"
        );
    }
    assert_eq!(
        in_world(&textures),
        "<text>:14:1: the texture has too many parts (found 8191, expected at most 4096)"
    );
    assert_eq!(
        in_world(&mixes),
        "<text>:11:1: mixes of mixes are nested too deeply (expected at most 8 levels)"
    );
}
