//! Materials, textures and images.

use crate::{load, world};
use glam::Vec2;
use metrolux::scene::material::{ConductorFresnel, Roughness};
use metrolux::scene::spectrum::Curve;
use metrolux::scene::texture::{FloatTexture, SpectrumTexture, Wrap};
use metrolux::scene::{Material, Scene};
use std::path::Path;

fn material(body: &str) -> Material {
    let s = world(&format!("{body}\nShape \"sphere\""));
    let shape = s.geometry.shapes[0];
    s.materials[shape.material as usize].clone()
}

fn constants(r: &Roughness) -> [f32; 2] {
    match (&r.u, &r.v) {
        (FloatTexture::Constant(u), FloatTexture::Constant(v)) if !r.remap => [*u, *v],
        _ => panic!("{r:?}"),
    }
}

#[test]
fn defaults_are_those_of_pbrt() {
    let grey = SpectrumTexture::Constant(Curve::Constant(0.5));
    assert_eq!(
        material(""),
        Material::Diffuse {
            reflectance: grey.clone()
        }
    );
    assert_eq!(
        material("Material \"diffuse\""),
        Material::Diffuse { reflectance: grey }
    );
    let Material::Dielectric { eta, roughness } = material("Material \"dielectric\"") else {
        panic!()
    };
    assert_eq!(
        (eta, constants(&roughness)),
        (Curve::Constant(1.5), [0.0; 2])
    );
    let copper = material("Material \"conductor\"");
    let named = material(
        "Material \"conductor\" \"spectrum eta\" \"metal-Cu-eta\" \"spectrum k\" \"metal-Cu-k\"",
    );
    assert_eq!(copper, named);
}

/// α is the square root of the roughness unless the file says that it is α already.
#[test]
fn roughness() {
    let alpha = |p: &str| match material(&format!("Material \"dielectric\" {p}")) {
        Material::Dielectric { roughness, .. } => constants(&roughness),
        _ => panic!(),
    };
    assert_eq!(alpha("\"float roughness\" 0.25"), [0.5, 0.5]);
    assert_eq!(
        alpha("\"float roughness\" 0.25 \"bool remaproughness\" false"),
        [0.25; 2]
    );
    assert_eq!(
        alpha("\"float uroughness\" 0.25 \"float vroughness\" 0.04"),
        [0.5, 0.2]
    );
    assert_eq!(
        alpha("\"float roughness\" 0.25 \"float vroughness\" 0.04"),
        [0.5, 0.2]
    );
    let s = world(
        "Texture \"r\" \"float\" \"checkerboard\"\nMaterial \"dielectric\" \"texture roughness\" \"r\"\nShape \"sphere\"",
    );
    let Material::Dielectric { roughness, .. } = &s.materials[0] else {
        panic!()
    };
    assert!(roughness.remap);
}

#[test]
fn conductors() {
    let r = material("Material \"conductor\" \"rgb reflectance\" [.7 .7 .7]");
    assert!(matches!(
        r,
        Material::Conductor {
            fresnel: ConductorFresnel::Reflectance(SpectrumTexture::Constant(Curve::Constant(_))),
            ..
        }
    ));
    let e = load(
        "WorldBegin Material \"conductor\" \"rgb reflectance\" [.7 .7 .7] \"spectrum k\" \"metal-Ag-k\"",
    )
    .unwrap_err();
    assert!(e.to_string().contains("either \"reflectance\" or"), "{e}");
    // An unbounded colour may exceed 1 and keeps its value: a grey one exactly.
    let Material::Conductor {
        fresnel: ConductorFresnel::EtaK { eta, .. },
        ..
    } = material("Material \"conductor\" \"rgb eta\" [2 2 2]")
    else {
        panic!()
    };
    assert_eq!(eta, Curve::Constant(2.0));
}

#[test]
fn mixes_name_their_parts() {
    let s = world(
        r#"MakeNamedMaterial "a" "string type" "dielectric"
        MakeNamedMaterial "b" "string type" "diffuse"
        Material "mix" "string materials" ["a" "b"] "float amount" 0.25
        Shape "sphere""#,
    );
    let Material::Mix { amount, a, b } = &s.materials[2] else {
        panic!()
    };
    assert_eq!(*amount, FloatTexture::Constant(0.25));
    assert!(matches!(
        s.materials[*a as usize],
        Material::Dielectric { .. }
    ));
    assert!(matches!(s.materials[*b as usize], Material::Diffuse { .. }));
    assert_eq!(&*s.sources.materials[0].label, "dielectric \"a\"");
    assert_eq!(s.sources.materials[1].at.line, 3);
}

/// `scale` over `checkerboard`, with both parts where they belong.
#[test]
fn textures_nest() {
    let s = world(
        r#"Texture "board" "float" "checkerboard" "float uscale" 2 "float vscale" 2
            "float tex1" 3 "float tex2" 5
        Texture "half" "float" "scale" "texture tex" "board" "float scale" 0.5
        Material "dielectric" "texture roughness" "half" Shape "sphere""#,
    );
    let Material::Dielectric { roughness, .. } = &s.materials[0] else {
        panic!()
    };
    let at = |u, v| roughness.u.eval(Vec2::new(u, v), &s.images);
    assert_eq!([at(0.1, 0.1), at(0.6, 0.1), at(0.6, 0.6)], [1.5, 2.5, 1.5]);
}

fn with_image(path: &Path, parameters: &str) -> Result<Scene, String> {
    load(&format!(
        "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{}\" {parameters}\n\
         Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"",
        path.display()
    ))
    .map_err(|e| e.to_string())
}

#[test]
fn encodings() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.png");
    image::RgbImage::from_pixel(1, 1, image::Rgb([128, 255, 0]))
        .save(&path)
        .unwrap();
    let v = 128.0f32 / 255.0;
    // IEC 61966-2-1 at 128/255, to the digits printed everywhere: 0.215861.
    for (parameters, want) in [
        ("", 0.215_860_5),
        ("\"string encoding\" \"linear\"", v),
        ("\"string encoding\" \"gamma 2.0\"", v * v),
    ] {
        let s = with_image(&path, parameters).unwrap();
        let [r, g, b] = s.images[0].texel(0);
        assert!((r - want).abs() < 1e-6, "{parameters}: {r}");
        assert_eq!((g, b), (1.0, 0.0));
    }
    let s = with_image(
        &path,
        "\"string wrap\" \"clamp\" \"float scale\" 2 \"bool invert\" true",
    )
    .unwrap();
    let Material::Diffuse {
        reflectance: SpectrumTexture::Image(m),
    } = &s.materials[0]
    else {
        panic!()
    };
    assert_eq!(
        (m.wrap, m.scale, m.invert, m.point),
        (Wrap::Clamp, 2.0, true, false)
    );
    // 16 bits and one channel.
    image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(2, 1, image::Luma([32896u16]))
        .save(&path)
        .unwrap();
    let s = with_image(&path, "").unwrap();
    assert!((s.images[0].texel(1)[2] - 0.215_860_5).abs() < 1e-6);
}

/// Floating-point images are linear; a file is decoded once.
#[test]
fn float_images() {
    let dir = tempfile::tempdir().unwrap();
    let exr = dir.path().join("t.exr");
    exr::prelude::write_rgb_file(&exr, 3, 2, |x, y| (x as f32, y as f32, 0.25f32)).unwrap();
    let s = with_image(&exr, "").unwrap();
    let i = &s.images[0];
    assert_eq!((i.width, i.height), (3, 2));
    assert_eq!(i.texel(5), [2.0, 1.0, 0.25]);
    let hdr = dir.path().join("t.hdr");
    image::Rgb32FImage::from_pixel(2, 2, image::Rgb([4.0, 2.0, 1.0]))
        .save(&hdr)
        .unwrap();
    assert_eq!(
        with_image(&hdr, "").unwrap().images[0].texel(0),
        [4.0, 2.0, 1.0]
    );
    let t = format!(
        "Texture \"x\" \"spectrum\" \"imagemap\" \"string filename\" \"{}\"\n",
        hdr.display()
    );
    assert_eq!(
        world(&t.replace("\"x\"", "\"y\"").repeat(2)).images.len(),
        1
    );
}

/// One channel is grey, whatever its name.
#[test]
fn grey_float_images() {
    use exr::prelude as e;
    use exr::prelude::WritableImage;
    let dir = tempfile::tempdir().unwrap();
    for name in ["Y", "height"] {
        let path = dir.path().join("t.exr");
        let pixels = |at: e::Vec2<usize>| (at.x() as f32 + 10.0 * at.y() as f32,);
        let channel = e::SpecificChannels::build().with_channel::<f32>(name);
        let image = e::Image::from_channels((3, 2), channel.with_pixel_fn(pixels));
        image.write().to_file(&path).unwrap();
        let s = with_image(&path, "").unwrap();
        let i = &s.images[0];
        assert_eq!((i.width, i.height), (3, 2));
        assert_eq!(i.texel(5), [12.0; 3], "{name}");
    }
}

/// A header that claims more than 2²⁶ texels is an error before anything is allocated.
#[test]
fn claims_are_checked() {
    let dir = tempfile::tempdir().unwrap();
    let exr = dir.path().join("t.exr");
    exr::prelude::write_rgb_file(&exr, 2, 2, |_, _| (0.0f32, 0.0f32, 0.0f32)).unwrap();
    let mut bytes = std::fs::read(&exr).unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    // x_max and y_max, after x_min and y_min.
    bytes[at + 8..at + 12].copy_from_slice(&999_999i32.to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&999_999i32.to_le_bytes());
    std::fs::write(&exr, bytes).unwrap();
    let e = with_image(&exr, "").unwrap_err();
    assert!(e.contains("1000000 × 1000000 texels"), "{e}");

    let bmp = dir.path().join("t.bmp");
    image::RgbImage::new(2, 2).save(&bmp).unwrap();
    let mut bytes = std::fs::read(&bmp).unwrap();
    bytes[18..22].copy_from_slice(&60_000i32.to_le_bytes());
    bytes[22..26].copy_from_slice(&60_000i32.to_le_bytes());
    std::fs::write(&bmp, bytes).unwrap();
    let e = with_image(&bmp, "").unwrap_err();
    assert!(e.contains("cannot read the image"), "{e}");
}
