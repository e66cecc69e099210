//! Damaged files of every kind the reader takes: an error or a scene, never a panic, and no more memory than is stated.
//!
//! The quick relative of the fuzz targets in fuzz/: their corpus is read as it is, and thousands of small damages are done
//! to small files, by a fixed seed.

use crate::{load, peak};
use image::{Rgb, RgbImage};
use metrolux::sampling::Rng;
use metrolux::scene::load::{LoadOptions, load_scene};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Most memory that reading one of the small files here may take at a time: what a claim of some hundred thousand texels or
/// vertices for each kilobyte costs.
const LIMIT: usize = 1 << 29;

/// Does one to four small damages.
fn damage(original: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut b = original.to_vec();
    for _ in 0..1 + rng.next_below(4) {
        if b.is_empty() {
            return b;
        }
        let at = rng.next_below(b.len() as u64) as usize;
        // Headers are where claims are made.
        let at = if rng.next_f32() < 0.6 {
            at.min(rng.next_below(400) as usize)
        } else {
            at
        };
        match rng.next_below(8) {
            0 => b[at] ^= 1 << rng.next_below(8),
            1 => b[at] = [0, 1, 0x7f, 0x80, 0xff][rng.next_below(5) as usize],
            2 => b.truncate(at),
            3 => {
                // A number of four bytes.
                let v = [0u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x0100_0000];
                let v = v[rng.next_below(6) as usize];
                for (x, v) in b[at..].iter_mut().zip(v.to_le_bytes()) {
                    *x = v;
                }
            }
            4 => {
                b.remove(at);
            }
            5 => b.insert(at, rng.next_below(256) as u8),
            6 => {
                let to = (at + 1 + rng.next_below(16) as usize).min(b.len());
                let part = b[at..to].to_vec();
                b.splice(at..at, part);
            }
            _ => {
                // A digit more makes a decimal number ten times as large.
                if let Some(i) = b[at..].iter().position(u8::is_ascii_digit) {
                    b.insert(at + i, b'9');
                }
            }
        }
    }
    b
}

/// Reads `file` as `read` does; fails on a panic and beyond the limit. Whether it was read.
fn survives(what: &str, file: &[u8], read: &dyn Fn() -> Result<(), String>) -> bool {
    let before = peak::start();
    let done = catch_unwind(AssertUnwindSafe(read));
    let used = peak::since(before);
    let keep = || {
        let path = std::env::temp_dir().join(format!("metrolux-{what}"));
        fs::write(&path, file).expect("kept");
        path
    };
    match done {
        Ok(r) => {
            assert!(
                used < LIMIT,
                "{what}: {used} bytes, for {}",
                keep().display()
            );
            r.is_ok()
        }
        Err(_) => panic!("{what}: a panic, for {}", keep().display()),
    }
}

/// Reads the original and `n` damaged copies through a scene that names the file; the original must be read.
fn all_damages(name: &str, original: &[u8], scene: &str, n: u32) {
    let dir = tempfile::tempdir().expect("a folder");
    let (file, pbrt) = (dir.path().join(name), dir.path().join("a.pbrt"));
    fs::write(&pbrt, scene).expect("written");
    let read = |bytes: &[u8]| {
        fs::write(&file, bytes).expect("written");
        survives(name, bytes, &|| {
            let r = load_scene(&pbrt, &LoadOptions::default());
            r.map(|_| ()).map_err(|e| {
                let text = e.to_string();
                assert!(text.contains("a.pbrt:"), "no place in: {text}");
                text
            })
        })
    };
    assert!(read(original), "{name} is not read");
    let mut good = 0;
    for i in 0..n {
        let mut rng = Rng::new(77, 1000, i, name.len() as u32);
        good += read(&damage(original, &mut rng)) as u32;
    }
    println!("{name}: {good} of {n} damaged files were still read");
}

fn picture() -> RgbImage {
    RgbImage::from_fn(9, 7, |x, y| {
        Rgb([(x * 28) as u8, (y * 36) as u8, ((x * y) % 256) as u8])
    })
}

#[test]
fn images() {
    let dir = tempfile::tempdir().expect("a folder");
    for ending in ["png", "jpg", "tga", "bmp", "hdr", "exr"] {
        let path = dir.path().join(format!("a.{ending}"));
        match ending {
            "exr" => exr::prelude::write_rgb_file(&path, 9, 7, |x, y| (x as f32, y as f32, 0.5f32))
                .expect("written"),
            "hdr" => image::DynamicImage::ImageRgb8(picture())
                .into_rgb32f()
                .save(&path)
                .expect("written"),
            _ => picture().save(&path).expect("written"),
        }
        let original = fs::read(&path).expect("read");
        let name = format!("t.{ending}");
        let scene = format!(
            "WorldBegin\nTexture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\"\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\""
        );
        all_damages(&name, &original, &scene, 600);
    }
}

#[test]
fn meshes() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n\
             property float z\nproperty float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\n\
             end_header\n"
        )
    };
    let scene = "WorldBegin\nShape \"plymesh\" \"string filename\" \"m.ply\"";
    let ascii = header("ascii") + "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n3 0 1 2\n3 0 2 3\n";
    all_damages("m.ply", ascii.as_bytes(), scene, 2000);
    for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut b = header(format).into_bytes();
        let mut word = |v: [u8; 4]| {
            let mut v = v;
            if big {
                v.reverse();
            }
            b.extend(v);
        };
        for p in [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            for v in [p[0], p[1], 0.0, p[0], p[1]] {
                word(v.to_le_bytes());
            }
        }
        for face in [[0i32, 1, 2], [0, 2, 3]] {
            b.push(3);
            for i in face {
                let mut v = i.to_le_bytes();
                if big {
                    v.reverse();
                }
                b.extend(v);
            }
        }
        all_damages("m.ply", &b, scene, 2000);
    }
}

/// A scene of every kind of directive.
const TEXT: &str = r#"# a comment
Film "rgb" "integer xresolution" 64 "integer yresolution" [ 48 ] "string filename" "a.exr" "float iso" 100
Integrator "mlt" "integer maxdepth" 7 "integer mutationsperpixel" 20
Sampler "independent" "integer pixelsamples" 4
PixelFilter "gaussian" "float xradius" 1.5 "float yradius" 1.5 "float sigma" 0.5
Scale -1 1 1 LookAt 0 -3 1  0 0 0.5  0 0 1
Camera "perspective" "float fov" 40 "float lensradius" 0.01 "float focaldistance" 3
WorldBegin
Attribute "shape" "float radius" 0.5
LightSource "infinite" "rgb L" [ 0.1 0.1 0.2 ] "float scale" 2
LightSource "spot" "blackbody I" 4000 "point3 from" [ 0 0 2 ] "point3 to" [ 0 0 0 ] "float coneangle" 30
Texture "c" "spectrum" "checkerboard" "rgb tex1" [ 0.1 0.2 0.3 ] "rgb tex2" [ 1 1 1 ] "float uscale" 4
Texture "f" "float" "constant" "float value" 0.25
MakeNamedMaterial "glass" "string type" "dielectric" "spectrum eta" "glass-BK7" "texture roughness" "f"
MakeNamedMaterial "wall" "string type" "diffuse" "texture reflectance" "c"
AttributeBegin
  Material "mix" "string materials" [ "glass" "wall" ] "float amount" 0.25
  Rotate 30 0 0 1 Translate 1 0 0 ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ]
  Shape "loopsubdiv" "integer levels" 2 "point3 P" [ 0 0 0  1 0 0  0 1 0  0 0 1 ] "integer indices" [ 0 2 1 0 1 3 1 2 3 0 3 2 ]
AttributeEnd
ObjectBegin "thing"
  NamedMaterial "glass"
  Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  0 1 0  1 1 1 ] "integer indices" [ 0 1 2 3 ]
  Shape "disk" "float radius" 0.5 "float height" 0.1
ObjectEnd
CoordinateSystem "here"
AttributeBegin
  ReverseOrientation
  AreaLightSource "diffuse" "spectrum L" [ 400 1 500 2.5e0 600 .5 ] "bool twosided" true
  Shape "trianglemesh" "point3 P" [ 0 0 1  1 0 1  0 1 1 ] "normal N" [ 0 0 1 0 0 1 0 0 1 ] "point2 uv" [ 0 0 1 0 0 1 ]
AttributeEnd
CoordSysTransform "here"
ObjectInstance "thing"
Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float uroughness" 0.1 "float vroughness" 0.3
Shape "sphere" "float radius" 0.25 "float zmin" -0.2 "float phimax" 270
"#;

#[test]
fn scene_texts() {
    load(TEXT).unwrap_or_else(|e| panic!("{e}"));
    let mut good = 0;
    for i in 0..6000 {
        let mut rng = Rng::new(78, 1000, i, 0);
        let bytes = damage(TEXT.as_bytes(), &mut rng);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        good += survives("text.pbrt", &bytes, &|| {
            load(&text).map(|_| ()).map_err(|e| {
                let m = e.to_string();
                assert!(
                    m.starts_with("<text>") || m.starts_with("default"),
                    "no place in: {m}"
                );
                m
            })
        }) as u32;
    }
    println!("{good} of 6000 damaged texts were still scenes");
}

/// The corpus of the fuzz targets, file by file.
#[test]
fn the_corpus_of_the_fuzz_targets() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let files = |kind: &str| -> Vec<PathBuf> {
        let dir = fs::read_dir(root.join(kind)).unwrap_or_else(|e| panic!("{kind}: {e}"));
        dir.map(|f| f.expect("a file").path()).collect()
    };
    for file in files("pbrt") {
        let bytes = fs::read(&file).expect("read");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        survives("corpus", &bytes, &|| {
            load(&text).map(|_| ()).map_err(|e| e.to_string())
        });
    }
    let dir = tempfile::tempdir().expect("a folder");
    for (kind, line) in [
        ("ply", "Shape \"plymesh\" \"string filename\" \"f.ply\""),
        (
            "image",
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"f.EXT\"",
        ),
    ] {
        for file in files(kind) {
            let ending = file.extension().and_then(|e| e.to_str()).unwrap_or("png");
            let bytes = fs::read(&file).expect("read");
            fs::write(dir.path().join(format!("f.{ending}")), &bytes).expect("written");
            let pbrt = dir.path().join("a.pbrt");
            fs::write(
                &pbrt,
                format!("WorldBegin\n{}", line.replace("EXT", ending)),
            )
            .expect("written");
            survives("corpus", &bytes, &|| {
                let r = load_scene(&pbrt, &LoadOptions::default());
                r.map(|_| ()).map_err(|e| e.to_string())
            });
        }
    }
}
