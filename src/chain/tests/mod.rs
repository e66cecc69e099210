//! What a run between two rounds takes as bytes, and that a run from them is the same run.

use super::{Direct, Mlt, MltOptions, Saved, Shares};
use crate::accel::{Embree, EmbreeOptions};
use crate::film::{Bins, Reader, Writer};
use crate::integrator::test_image;
use crate::path::{Tally, World};
use crate::scene::Scene;
use crate::scene::load::{LoadOptions, load_str};
use crate::scene::spectrum::Target;
use std::path::Path;

const HEAD: &str = r#"
Film "rgb" "integer xresolution" 12 "integer yresolution" 10
LookAt 0 0 -0.9  0 0 1  0 1 0
Camera "perspective" "float fov" 70 "float lensradius" 0.01 "float focaldistance" 1
WorldBegin
Texture "checks" "spectrum" "checkerboard" "float uscale" 3 "float vscale" 3
  "rgb tex1" [ 0.9 0.8 0.7 ] "rgb tex2" [ 0.8 0.9 0.9 ]
MakeNamedMaterial "wall" "string type" "diffuse" "texture reflectance" "checks"
MakeNamedMaterial "brushed" "string type" "conductor" "float uroughness" 0.1 "float vroughness" 0.3
MakeNamedMaterial "glass" "string type" "dielectric"
NamedMaterial "wall"
"#;

/// Nothing but spheres and disks, of an object too: the inside of a ball, so that paths are long.
const ROUND: &str = r#"
ReverseOrientation
Shape "sphere" "float radius" 1
ReverseOrientation
AttributeBegin
  Translate 0 0.8 0
  Rotate 90 1 0.2 0
  AreaLightSource "diffuse" "rgb L" [ 3 3 2 ]
  Shape "disk" "float radius" 0.3
AttributeEnd
AttributeBegin
  Translate 0.5 0.5 0.3
  AreaLightSource "diffuse" "rgb L" [ 2 3 4 ]
  Shape "sphere" "float radius" 0.05
AttributeEnd
AttributeBegin
  NamedMaterial "brushed"
  Translate 0 -0.5 0
  Rotate 80 1 0 0.1
  Shape "disk" "float radius" 0.6
AttributeEnd
AttributeBegin
  NamedMaterial "glass"
  Translate -0.3 -0.2 0.3
  Shape "sphere" "float radius" 0.2
AttributeEnd
ObjectBegin "toy"
  NamedMaterial "brushed"
  Shape "sphere" "float radius" 0.1
  NamedMaterial "wall"
  Shape "disk" "float radius" 0.2
ObjectEnd
Translate 0.4 -0.2 0.2
ObjectInstance "toy"
Translate 0.1 0.4 0.3
Rotate 50 1 2 1
Scale 1 -2 1
ObjectInstance "toy"
"#;

/// Nothing but triangles: the inside of a tetrahedron.
const FLAT: &str = r#"
Shape "trianglemesh" "point3 P" [ 0 3 0  -3 -1 -2  3 -1 -2  0 -1 3 ] "integer indices" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]
AreaLightSource "diffuse" "rgb L" [ 3 3 2 ]
Shape "trianglemesh" "point3 P" [ -0.3 0.7 -0.3  0.3 0.7 -0.3  0 0.7 0.4 ] "integer indices" [ 0 1 2 ]
"#;

/// Room for long paths.
const EDGES: usize = 24;
const SEED: u64 = 5;

fn scene(rest: &str) -> Scene {
    let text = format!("{HEAD}{rest}");
    load_str(&text, Path::new(""), &LoadOptions::default()).expect("a scene")
}

/// One stage or two, direct light apart or not, bins or not, and many lens sub-paths.
fn variants() -> [MltOptions; 4] {
    let one = MltOptions {
        groups: 4,
        chains: 8,
        seeds: 256,
        round: 32,
        rounds_per_generation: 5,
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    let two = MltOptions {
        test_samples: Some(2),
        ..one
    };
    let apart = MltOptions {
        direct: Direct::Separate,
        shares: Shares([0.3, 0.1, 0.1, 0.1, 0.35, 0.05]),
        ..two
    };
    let spectral = MltOptions {
        bins: Some(Bins::new(6)),
        ..apart
    };
    [one, two, apart, spectral]
}

fn bytes_of(run: &mut Mlt<'_, Embree<'_>, 4>) -> Vec<u8> {
    let mut all = Vec::new();
    run.save(&mut Writer::new(&mut all)).expect("memory");
    all
}

/// A state takes no more than its film does in memory, 24 bytes a path vertex and 256 bytes a chain. Each part keeps its own
/// share of that, so that a small film or a short path cannot pay for the rest.
#[cfg_attr(feature = "double", ignore = "numbers of f32 are promised")]
#[test]
fn a_state_takes_at_most_what_is_promised() {
    for (rest, curved) in [(ROUND, true), (FLAT, false)] {
        let scene = scene(rest);
        let has_triangles = scene.geometry.parts().any(|p| !p.triangles.is_empty());
        assert_eq!(has_triangles, !curved, "the scene is not what it is to be");
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("builds");
        for options in variants() {
            let mut world = World::new(&scene, &accel, EDGES as u32);
            if options.bins.is_some() {
                world = world.with_target(Target::Bins);
            }
            let i0 = test_image::<4, _>(&world, &options, SEED, &mut Tally::default());
            assert_eq!(i0.is_some(), options.test_samples.is_some());
            let start = || Mlt::new(&world, options, SEED).with_test_image(i0.clone());
            let mut run = start();
            run.run(8);
            let all = bytes_of(&mut run);

            // XYZ and bins of 16 bytes, the groups' Y of 8.
            let bins = options.bins.map_or(0, |b| b.count);
            let film = 12 * 10 * (16 * (3 + bins) + 8 * options.groups as usize);
            let members = &run.generation.as_ref().expect("it has begun").chains;
            assert_eq!(members.len(), 4 * 8);
            let vertices: usize = members.iter().map(|m| m.chain.x.links.len()).sum();
            assert!(
                vertices > 4 * members.len(),
                "{vertices} vertices test little"
            );
            let most = film + 24 * vertices + 256 * members.len();
            assert!(
                all.len() <= most,
                "{curved} {options:?}: {} > {most}",
                all.len()
            );
            for m in members {
                let (x, pool) = (&m.chain.x, m.chain.pool());
                let mut path = Vec::new();
                super::state_path::save(x, pool, &mut Writer::new(&mut path)).expect("memory");
                let n = x.links.len();
                assert!(path.len() <= 24 * n, "{} bytes, {n} vertices", path.len());
            }

            // And the run from these bytes is the same run.
            let saved = Saved::read(&mut Reader::new(&all)).expect("its own state");
            let again = Mlt::<_, 4>::resume(&world, options, SEED, i0.clone(), saved);
            let mut again = again.expect("its own state");
            assert!(bytes_of(&mut again) == all, "{curved} {options:?}");
            run.run(4);
            again.run(4);
            assert!(
                bytes_of(&mut again) == bytes_of(&mut run),
                "{curved} {options:?}"
            );
        }
    }
}
