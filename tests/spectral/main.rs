//! `--spectral`: bins hold radiance per nm, agree with the colours of the same render, and repeat to the bit.

mod file;
mod stats;

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::chain::{Direct, DirectRate, MltOptions};
use metrolux::film::Bins;
use metrolux::integrator::{Bdpt, Budget, Quiet, bdpt_bins, mlt, pt_bins};
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::load::{LoadOptions, load_scene, load_str};
use metrolux::scene::spectrum::{Target, cmf, rgb_albedo, xyz_of_fn};
use metrolux::scene::{Light, Scene};
use stats::{Moments, threshold};
use std::path::Path;

/// Runs of each estimate; errors are taken between them.
const RUNS: u64 = 16;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Pt,
    Bdpt,
    Mlt,
}

const KINDS: [Kind; 3] = [Kind::Pt, Kind::Bdpt, Kind::Mlt];

/// XYZ by pixel, radiance per nm by pixel and bin.
type Picture = (Vec<[f64; 3]>, Vec<f64>);

fn render(scene: &Scene, kind: Kind, bins: Bins, per_pixel: f64, seed: u64) -> Picture {
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).unwrap();
    let world = World::new(scene, &accel, scene.settings.max_depth).with_target(Target::Bins);
    let (budget, tally) = (Budget::PerPixel(per_pixel), &mut Tally::default());
    let what = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: false,
    };
    let options = MltOptions {
        groups: 4,
        chains: 4,
        seeds: 2048,
        direct_rate: DirectRate::constant(0.25),
        bins: Some(bins),
        ..MltOptions::default()
    };
    let (image, spectrum) = match kind {
        Kind::Pt => {
            let r = pt_bins::<4, _>(&world, Some(bins), budget, seed, &Quiet, tally);
            (r.image, r.spectrum)
        }
        Kind::Bdpt => {
            let r = bdpt_bins::<4, _>(&world, what, Some(bins), budget, seed, &Quiet, tally);
            (r.image, r.spectrum)
        }
        Kind::Mlt => {
            let r = mlt::<4, _>(&world, &options, budget, seed, &Quiet, tally);
            (r.image, r.spectrum)
        }
    };
    let faults = tally.fault_nan + tally.fault_negative + tally.fault_infinite;
    assert_eq!(faults, 0, "{kind:?}");
    (image, spectrum.expect("bins were asked for"))
}

/// A sphere that emits `L` and reflects `REFLECTANCE`, seen from inside.
const REFLECTANCE: [f32; 3] = [0.3, 0.5, 0.6];
const DEPTH: i32 = 8;

fn furnace() -> Scene {
    let [r, g, b] = REFLECTANCE;
    let text = format!(
        r#"
Integrator "mlt" "integer maxdepth" {DEPTH}
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
LookAt 0.3 -0.2 0.1  -0.5 0.6 -0.3  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
AreaLightSource "diffuse" "rgb L" [ 0.5 0.4 0.2 ]
Material "diffuse" "rgb reflectance" [ {r} {g} {b} ]
ReverseOrientation
Shape "sphere" "float radius" 1
"#
    );
    load_str(&text, Path::new("."), &LoadOptions::default()).unwrap()
}

fn cornell(size: u32) -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.pbrt");
    let mut scene = load_scene(Path::new(path), &LoadOptions::default()).unwrap();
    scene.camera.resolution = [size; 2];
    scene.camera.crop = [0, 0, size, size];
    scene.settings.max_depth = 4;
    scene
}

/// Mean of a function over each bin, by the midpoint rule at a hundredth of its width.
fn bin_means(bins: Bins, f: impl Fn(f32) -> f64) -> Vec<f64> {
    let mean = |b: usize| {
        let at = |i: i32| bins.center(b) + bins.width() * ((i as f64 + 0.5) / 100.0 - 0.5);
        (0..100).map(|i| f(at(i) as f32)).sum::<f64>() / 100.0
    };
    (0..bins.count).map(mean).collect()
}

/// Mean over the picture of each bin.
fn mean_spectrum(values: &[f64], count: usize) -> Vec<f64> {
    let pixels = (values.len() / count) as f64;
    let sum = |b: usize| values[b..].iter().step_by(count).sum::<f64>();
    (0..count).map(|b| sum(b) / pixels).collect()
}

/// Radiance in the furnace is Le·Σ ρ^j, at every wavelength. Detects 5 % of a bin between 420 and 680 nm, and 20 % of
/// the outer bins, which hold the fewest wavelengths.
#[test]
fn a_furnace_shows_its_analytic_spectrum() {
    let scene = furnace();
    let bins = Bins::new(12);
    let Light::Area { radiance, .. } = &scene.lights[0] else {
        panic!("the sphere is the light");
    };
    let albedo = rgb_albedo(REFLECTANCE);
    let expected = bin_means(bins, |l| {
        let rho = albedo.at(l) as f64;
        radiance.at(l) as f64 * (0..=DEPTH).map(|j| rho.powi(j)).sum::<f64>()
    });
    let limit = threshold(3 * bins.count, (RUNS - 1) as f64);
    for (kind, work) in [(Kind::Pt, 256.0), (Kind::Bdpt, 64.0), (Kind::Mlt, 1024.0)] {
        let mut each = vec![Moments::default(); bins.count];
        for seed in 0..RUNS {
            let (_, values) = render(&scene, kind, bins, work, 100 + seed);
            let mean = mean_spectrum(&values, bins.count);
            each.iter_mut().zip(mean).for_each(|(m, v)| m.add(v));
        }
        for (b, (m, e)) in each.iter().zip(&expected).enumerate() {
            let (t, detects) = ((m.mean() - e) / m.error(), limit * m.error() / e);
            println!(
                "{kind:?} {:.0} nm: {:.6} {e:.6} t {t:.2}, detects {:.2} %",
                bins.center(b),
                m.mean(),
                100.0 * detects
            );
            assert!(t.abs() < limit, "{kind:?}, bin {b}: {} {e}", m.mean());
            assert!(detects < 0.2, "{kind:?}, bin {b} is noise: {detects}");
            let seen = (420.0..680.0).contains(&bins.center(b));
            assert!(
                !seen || detects < 0.05,
                "{kind:?}, bin {b} is noise: {detects}"
            );
        }
    }
}

/// What a chain's visits are proportional to does not change the image. Detects 5 % of the mean X, Y or Z.
#[test]
fn every_target_shows_the_same_furnace() {
    let scene = furnace();
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).unwrap();
    let Light::Area { radiance, .. } = &scene.lights[0] else {
        panic!("the sphere is the light");
    };
    let albedo = rgb_albedo(REFLECTANCE);
    // The chain leaves paths of one and two edges to the direct pass; here it owns them all.
    let expected = xyz_of_fn(|l| {
        let rho = albedo.at(l) as f64;
        radiance.at(l) as f64 * (0..=DEPTH).map(|j| rho.powi(j)).sum::<f64>()
    });
    let options = MltOptions {
        groups: 4,
        chains: 4,
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    let limit = threshold(9, (RUNS - 1) as f64);
    for target in [Target::Mixed, Target::Luminance, Target::Bins] {
        let world = World::new(&scene, &accel, scene.settings.max_depth).with_target(target);
        let mut each = [Moments::default(); 3];
        for seed in 0..RUNS {
            let (budget, tally) = (Budget::PerPixel(1024.0), &mut Tally::default());
            let image = mlt::<4, _>(&world, &options, budget, 300 + seed, &Quiet, tally).image;
            for (c, m) in each.iter_mut().enumerate() {
                m.add(image.iter().map(|p| p[c]).sum::<f64>() / image.len() as f64);
            }
        }
        for (c, (m, e)) in each.iter().zip(expected).enumerate() {
            let (t, detects) = ((m.mean() - e) / m.error(), limit * m.error() / e);
            println!(
                "{target:?} {c}: {:.5} {e:.5} t {t:.2}, detects {:.2} %",
                m.mean(),
                100.0 * detects
            );
            assert!(
                t.abs() < limit && detects < 0.05,
                "{target:?} {c}: {} {e}",
                m.mean()
            );
        }
    }
}

/// The colours of each pixel are those of its bins, up to what the observer varies inside a bin:
/// |Σ f·nm·(x̄(λ) − mean of x̄)| ≤ Σ bins · width · max |x̄ − mean|.
#[test]
fn colours_are_those_of_the_bins() {
    let bins = Bins::new(128);
    let observer: [Vec<f64>; 3] = std::array::from_fn(|c| bin_means(bins, |l| cmf(l)[c] as f64));
    let spread: [Vec<f64>; 3] = std::array::from_fn(|c| {
        let most = |b: usize| {
            let at = |i: i32| bins.center(b) + bins.width() * (i as f64 / 100.0 - 0.5);
            (0..=100)
                .map(|i| (cmf(at(i) as f32)[c] as f64 - observer[c][b]).abs())
                .fold(0.0, f64::max)
        };
        (0..bins.count).map(most).collect()
    });
    let scene = cornell(6);
    for kind in KINDS {
        let (image, values) = render(&scene, kind, bins, 64.0, 5);
        let (mut lit, mut widest) = (0, 0.0f64);
        for (xyz, pixel) in image.iter().zip(values.chunks(bins.count)) {
            for c in 0..3 {
                let sum = |w: &[f64]| {
                    let terms = w.iter().zip(pixel).map(|(w, v)| w * v);
                    terms.sum::<f64>() * bins.width()
                };
                // f32 values, about ten roundings each: 1e-6 of the sum.
                let allowed = sum(&spread[c]) + 1e-6 * xyz[c] + 1e-9;
                let off = (sum(&observer[c]) - xyz[c]).abs();
                assert!(off <= allowed, "{kind:?}: {off} > {allowed}");
                if c == 1 && xyz[1] > 0.0 {
                    lit += 1;
                    widest = widest.max(allowed / xyz[1]);
                }
            }
        }
        println!("{kind:?}: within {:.2} % of Y at most", 100.0 * widest);
        assert!(lit > 20, "{kind:?}: only {lit} pixels are lit");
    }
}

/// Path tracing and chains agree in every bin of every quarter of the Cornell box. Detects 15 % of a quarter's bin.
#[test]
fn pt_and_mlt_agree_by_bin() {
    let scene = cornell(8);
    let bins = Bins::new(8);
    let quarters = |values: &[f64]| {
        let mut q = vec![0.0; 4 * bins.count];
        for (i, pixel) in values.chunks(bins.count).enumerate() {
            let at = (i / 32) * 2 + (i % 8) / 4;
            for (b, v) in pixel.iter().enumerate() {
                q[at * bins.count + b] += v / 16.0;
            }
        }
        q
    };
    let estimate = |kind: Kind, work: f64| {
        let mut each = vec![Moments::default(); 4 * bins.count];
        for seed in 0..RUNS {
            let q = quarters(&render(&scene, kind, bins, work, 200 + seed).1);
            each.iter_mut().zip(q).for_each(|(m, v)| m.add(v));
        }
        each
    };
    // Welch's t with the fewest degrees of freedom it can have.
    let limit = threshold(4 * bins.count, (RUNS - 1) as f64);
    let pairs = estimate(Kind::Pt, 2048.0);
    for (i, (p, m)) in pairs.iter().zip(estimate(Kind::Mlt, 8192.0)).enumerate() {
        let error = p.error().hypot(m.error());
        let (t, detects) = ((p.mean() - m.mean()) / error, limit * error / p.mean());
        println!(
            "quarter {} bin {}: {:.3e} {:.3e} t {t:.2}, detects {:.1} %",
            i / 8,
            i % 8,
            p.mean(),
            m.mean(),
            100.0 * detects
        );
        assert!(t.abs() < limit, "quarter {} bin {}", i / 8, i % 8);
        assert!(
            detects < 0.15,
            "quarter {} bin {} is noise: {detects}",
            i / 8,
            i % 8
        );
    }
}

/// One thread and three give the same bits; another seed does not.
#[test]
fn bins_do_not_depend_on_threads() {
    let scene = cornell(6);
    let bins = Bins::new(16);
    let on = |threads: usize, kind: Kind, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (_, values) = pool.install(|| render(&scene, kind, bins, 32.0, seed));
        values.iter().map(|v| v.to_bits()).collect::<Vec<u64>>()
    };
    for kind in KINDS {
        let one = on(1, kind, 3);
        assert!(one == on(3, kind, 3), "{kind:?}");
        assert!(one != on(1, kind, 4), "{kind:?}");
    }
}
