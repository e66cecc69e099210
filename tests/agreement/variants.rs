//! What must not change the image: the number of lanes and the region.

use super::common::scene::{embree, of_file, of_text};
use super::common::stats::{Estimate, Pair, agree};
use super::materials::CAMERA;
use super::{Judged, Limits, QUICK, Work, pairs, runs};
use metrolux::chain::{
    Direct::{InChain, Separate},
    MltOptions,
};
use metrolux::integrator::{Bdpt, Budget, Quiet, bdpt, mlt, pt};
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::spectrum::Target;
use metrolux::scene::{FilterKind, Scene};
use rayon::prelude::*;
use std::ops::Range;

/// Coloured walls, and a dispersive ball on whose paths only the hero wavelength counts.
fn lanes_scene() -> Scene {
    of_text(
        16,
        CAMERA,
        r#"
        Material "diffuse" "rgb reflectance" [ 0.7 0.2 0.4 ]
        Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
        AttributeBegin
        AreaLightSource "diffuse" "rgb L" [ 5 4 1 ]
        Shape "trianglemesh" "point3 P" [ -1 -1 2.2  -1 1 2.2  1 1 2.2  1 -1 2.2 ] "integer indices" [ 0 1 2 0 2 3 ]
        AttributeEnd
        Translate 0 0 0.5
        Material "dielectric" "spectrum eta" "glass-F11"
        Shape "sphere" "float radius" 0.45
        "#,
    )
}

#[test]
fn lanes() {
    let scene = lanes_scene();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3);
    let work = Work {
        steps: 8_000,
        ..QUICK.work
    };
    let limits = Limits {
        least: 0.05,
        tile: 0.2,
        ..QUICK.limits
    };
    let mut all = runs::<4, _>(&world, work, limits, &[Separate]);
    let mut add = |n: usize, more: Vec<Judged>| {
        all.extend(more.into_iter().map(|j| Judged {
            name: format!("{}, {n} lanes", j.name),
            ..j
        }));
    };
    add(1, runs::<1, _>(&world, work, limits, &[Separate]));
    add(8, runs::<8, _>(&world, work, limits, &[Separate]));
    add(16, runs::<16, _>(&world, work, limits, &[Separate]));
    agree("lanes", &pairs(&all, limits));
}

/// Images of independent seeds.
fn images(
    seeds: Range<u64>,
    render: impl Fn(u64, &mut Tally) -> Vec<[f64; 3]> + Sync,
) -> Vec<Vec<[f64; 3]>> {
    seeds
        .into_par_iter()
        .map(|seed| {
            let mut tally = Tally::default();
            let image = render(seed, &mut tally);
            assert_eq!(tally.impossible(), 0, "{tally:?}");
            image
        })
        .collect()
}

/// The images of the whole and of a region under a wide filter: the raster domain must reach beyond the region's border.
#[test]
fn a_region_is_its_part_of_the_whole() {
    let mut scene = of_file("cornell/cornell.pbrt", 16, 16);
    scene.settings.filter.kind = FilterKind::Gaussian { sigma: 0.8 };
    scene.settings.filter.radius = [2.0, 1.5];
    let crop = [5, 3, 11, 8];
    let mut part = of_file("cornell/cornell.pbrt", 16, 16);
    part.settings.filter = scene.settings.filter;
    part.camera.crop = crop;
    let (a, b) = (embree(&scene), embree(&part));
    let whole = World::new(&scene, &a, 3);
    let region = World::new(&part, &b, 3);
    let what = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: false,
    };
    let options = MltOptions {
        groups: 2,
        chains: 4,
        seeds: 2048,
        ..MltOptions::default()
    };
    let mut all = Vec::new();
    for name in ["pt", "bdpt", "mlt"] {
        let render = |world: &World<_>, per_pixel: f64, seed: u64, tally: &mut Tally| {
            let budget = Budget::PerPixel(per_pixel);
            match name {
                "pt" => pt::<4, _>(world, budget, seed, &Quiet, tally).0,
                "bdpt" => bdpt::<4, _>(world, what, budget, seed, &Quiet, tally).0,
                _ => mlt::<4, _>(world, &options, budget, seed, &Quiet, tally).image,
            }
        };
        let n = if name == "mlt" { 800.0 } else { 128.0 };
        // One pixel meets the lamp through its filter's tail, by one path-traced sample in three images: 24 such images are
        // too few for Student's law.
        let seeds = if name == "pt" { 192 } else { 24 };
        let big = images(0..seeds, |s, t| render(&whole, n, s, t));
        let small = images(1000..1000 + seeds, |s, t| render(&region, 4.0 * n, s, t));
        let [x0, y0, x1, y1] = crop.map(|v| v as usize);
        // The four sides one pixel deep, where a border without its neighbourhood would lose half its light, and all.
        for (part, [x0, y0, x1, y1]) in [
            ("left", [x0, y0, x0 + 1, y1]),
            ("right", [x1 - 1, y0, x1, y1]),
            ("top", [x0, y0, x1, y0 + 1]),
            ("bottom", [x0, y1 - 1, x1, y1]),
            ("all", [x0, y0, x1, y1]),
        ] {
            let mean = |image: &[[f64; 3]], origin: [usize; 2], width: usize| {
                let rows = (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y)));
                let at = |(x, y): (usize, usize)| image[(y - origin[1]) * width + x - origin[0]][1];
                rows.map(at).sum::<f64>()
            };
            all.push(Pair {
                name: format!("{name}, {part}"),
                found: Estimate::of(
                    small
                        .iter()
                        .map(|i| mean(i, [crop[0] as usize, crop[1] as usize], 6)),
                ),
                reference: Estimate::of(big.iter().map(|i| mean(i, [0, 0], 16))),
                limit: 0.2,
            });
        }
    }
    agree("region", &all);
}

/// From one seed a group the image is the same; from the first path found it is so but for a factor, and its mean is 1.
#[test]
fn plain_and_relative_chains_find_the_image() {
    let scene = of_file("cornell/cornell.pbrt", 16, 16);
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 3).with_target(Target::Luminance);
    let plain = MltOptions {
        groups: 2,
        chains: 1,
        entry_uses: 1,
        direct: InChain,
        ..MltOptions::default()
    };
    let relative = MltOptions {
        relative: true,
        ..plain
    };
    let run = |options: MltOptions, seeds: Range<u64>| {
        images(seeds, |seed, tally| {
            let budget = Budget::PerPixel(2000.0);
            mlt::<4, _>(&world, &options, budget, seed, &Quiet, tally).image
        })
    };
    let what = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: false,
    };
    let reference = images(0..24, |seed, tally| {
        bdpt::<4, _>(&world, what, Budget::PerPixel(128.0), seed, &Quiet, tally).0
    });
    let relative = run(relative, 200..224);
    let mean = |image: &[[f64; 3]]| image.iter().map(|p| p[1]).sum::<f64>() / image.len() as f64;
    for image in &relative {
        assert!((mean(image) - 1.0).abs() < 1e-6, "{}", mean(image));
    }
    let plain = run(plain, 100..124);
    let mut all = Vec::new();
    for part in 0..4 {
        let quarter = |image: &Vec<[f64; 3]>| {
            let here = image.chunks(64).nth(part).expect("four rows each");
            mean(here)
        };
        let estimate = |images: &[Vec<[f64; 3]>], relative: bool| {
            let unit = |i| if relative { mean(i) } else { 1.0 };
            Estimate::of(images.iter().map(|i| quarter(i) / unit(i)))
        };
        for (name, images, relative) in [("plain", &plain, false), ("relative", &relative, true)] {
            all.push(Pair {
                name: format!("{name}, rows {} to {}", 4 * part, 4 * part + 3),
                found: estimate(images, relative),
                reference: estimate(&reference, relative),
                limit: 0.1,
            });
        }
    }
    agree("plain and relative", &all);
}
