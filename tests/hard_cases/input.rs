//! Every mistake a person makes in a scene file, as the person meets it: a message with file, line and column, what was found
//! and what was expected, exit code 2, nothing written and nothing on stdout.

use assert_cmd::Command;
use std::fmt::Write;
use std::fs;

/// A mistake, and the scene that makes it.
const MISTAKES: &[(&str, &str)] = &[
    ("an empty file", ""),
    ("no WorldBegin", "Camera \"perspective\"\nShape \"sphere\""),
    ("WorldBegin twice", "WorldBegin\nWorldBegin"),
    ("a misspelt directive", "WorldBegin\nMatrial \"diffuse\""),
    (
        "a string that does not end",
        "WorldBegin\nMaterial \"diffuse\n",
    ),
    (
        "a list that does not end",
        "WorldBegin\nShape \"sphere\" \"float radius\" [ 1",
    ),
    (
        "a parameter without a value",
        "WorldBegin\nShape \"sphere\" \"float radius\"",
    ),
    (
        "a parameter without a type",
        "WorldBegin\nShape \"sphere\" \"radius\" 1",
    ),
    (
        "a word where a number belongs",
        "WorldBegin\nTranslate 1 up 3",
    ),
    (
        "too few numbers",
        "WorldBegin\nLookAt 0 0 0  1 1 1\nShape \"sphere\"",
    ),
    (
        "a file that is not there",
        "WorldBegin\nInclude \"geometry.pbrt\"",
    ),
    (
        "a mesh that is not there",
        "WorldBegin\n\nShape \"plymesh\" \"string filename\" \"bunny.ply\"",
    ),
    (
        "a texture that is not there",
        "WorldBegin\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wood.png\"",
    ),
    (
        "a mesh that is no mesh",
        "WorldBegin\nShape \"plymesh\" \"string filename\" \"broken.ply\"",
    ),
    (
        "an image that is no image",
        "WorldBegin\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"broken.png\"",
    ),
    (
        "a mesh that claims a billion vertices",
        "WorldBegin\nShape \"plymesh\" \"string filename\" \"huge.ply\"",
    ),
    (
        "points that are no triples",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 ] \"integer indices\" [ 0 1 2 ]",
    ),
    (
        "indices that are no triples",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0 ] \"integer indices\" [ 0 1 ]",
    ),
    (
        "an index out of range",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0 ] \"integer indices\" [ 0 1 3 ]",
    ),
    (
        "a negative index",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0 ] \"integer indices\" [ 0 1 -1 ]",
    ),
    (
        "a vertex that is no number",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  nan 0 0  0 1 0 ]",
    ),
    (
        "a vertex beyond 32-bit floats",
        "WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0  1e60 0 0  0 1 0 ]",
    ),
    (
        "a negative radius",
        "WorldBegin\nShape \"sphere\" \"float radius\" -1",
    ),
    (
        "a parameter of the wrong type",
        "WorldBegin\nShape \"sphere\" \"string radius\" \"1\"",
    ),
    (
        "a parameter that is not known",
        "WorldBegin\nShape \"sphere\" \"float diameter\" 2",
    ),
    (
        "a material that is not known",
        "WorldBegin\nMaterial \"velvet\"",
    ),
    (
        "a material without a name",
        "WorldBegin\nNamedMaterial \"gold\"",
    ),
    (
        "a texture without a name",
        "WorldBegin\nMaterial \"diffuse\" \"texture reflectance\" \"oak\"",
    ),
    (
        "an object without a name",
        "WorldBegin\nObjectInstance \"chair\"",
    ),
    (
        "a spectrum that is not known",
        "WorldBegin\nMaterial \"conductor\" \"spectrum eta\" \"metal-Xy-eta\"",
    ),
    (
        "a reflectance above 1",
        "WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 1.5 0.5 0.5 ]",
    ),
    (
        "AttributeEnd alone",
        "WorldBegin\nShape \"sphere\"\nAttributeEnd",
    ),
    (
        "AttributeBegin alone",
        "WorldBegin\n  AttributeBegin\nShape \"sphere\"",
    ),
    (
        "blocks that cross",
        "WorldBegin\nObjectBegin \"o\"\nAttributeBegin\nObjectEnd\nAttributeEnd",
    ),
    (
        "a singular transform",
        "WorldBegin\nScale 1 1 0\nShape \"sphere\"",
    ),
    ("a view along up", "LookAt 0 0 5  0 0 0  0 0 1\nWorldBegin"),
    (
        "an image of no pixels",
        "Film \"rgb\" \"integer xresolution\" 0\nWorldBegin",
    ),
    (
        "an image beyond bounds",
        "Film \"rgb\" \"integer xresolution\" 1000000\nWorldBegin",
    ),
    (
        "a crop without a pixel",
        "Film \"rgb\" \"integer pixelbounds\" [ 5 5 0 10 ]\nWorldBegin",
    ),
    (
        "a field of view of 180",
        "Camera \"perspective\" \"float fov\" 180\nWorldBegin",
    ),
    (
        "a depth below 0",
        "Integrator \"mlt\" \"integer maxdepth\" -1\nWorldBegin",
    ),
    ("the film after WorldBegin", "WorldBegin\nFilm \"rgb\""),
    ("an unknown integrator", "Integrator \"mtl\"\nWorldBegin"),
    (
        "a camera too far away",
        "LookAt 0 0 1e20 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"",
    ),
    (
        "a light too far away",
        "WorldBegin\nShape \"sphere\"\nLightSource \"point\" \"point3 from\" [ 0 1e18 0 ]",
    ),
    (
        "a shape too far away",
        "WorldBegin\nShape \"sphere\"\nTranslate 0 0 3e18\nShape \"sphere\"",
    ),
    (
        "an instance too far away",
        "WorldBegin\nObjectBegin \"o\"\nShape \"sphere\"\nObjectEnd\nTranslate 0 0 1\nObjectInstance \"o\"\n\
         Translate 0 0 3e20\nObjectInstance \"o\"",
    ),
    (
        "an eye on an edge",
        "LookAt 0.1 0.2 5 0 0 0 0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n\
         Shape \"trianglemesh\" \"point3 P\" [ -9.3 0.2 5  9.7 0.2 5  0 3 9 ] \"integer indices\" [ 0 1 2 ]",
    ),
];

#[test]
fn mistakes_are_told_with_their_place() {
    let dir = tempfile::tempdir().expect("a folder");
    let file = |name: &str| dir.path().join(name);
    fs::write(file("broken.ply"), "ply\nformat ascii 2.0\nend_header\n").expect("written");
    fs::write(file("broken.png"), "this is no picture").expect("written");
    let claim = "ply\nformat ascii 1.0\nelement vertex 1000000000\nproperty float x\nproperty float y\n\
                 property float z\nend_header\n0 0 0\n";
    fs::write(file("huge.ply"), claim).expect("written");
    let mut all = String::new();
    for (what, text) in MISTAKES {
        fs::write(file("scene.pbrt"), text).expect("written");
        let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
        let c = c
            .current_dir(dir.path())
            .args(["render", "scene.pbrt", "-o", "out.exr"]);
        let done = c.output().expect("it runs");
        let told = String::from_utf8(done.stderr).expect("UTF-8");
        assert_eq!(done.status.code(), Some(2), "{what}: {told}");
        assert!(
            done.stdout.is_empty() && !file("out.exr").exists(),
            "{what}"
        );
        assert!(
            told.contains("error: ") && told.contains("scene.pbrt"),
            "{what}: {told}"
        );
        // What is told of the plan before is not of the mistake.
        let (_, error) = told.split_once("error: ").expect("as just seen");
        let _ = write!(all, "{what}\n  error: {error}");
    }
    insta::assert_snapshot!(all);
}
