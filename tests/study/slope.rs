//! Of a scene whose every radiance is 1, the study says what is known beforehand: error falls as the square root of work
//! where there is no bias, and ends on the floor where there is one.

use metrolux::accel::{Embree, EmbreeOptions};
use metrolux::chain::{Direct, MltOptions};
use metrolux::integrator::{Bdpt, Budget, Quiet, bdpt, mlt, pt};
use metrolux::output::Image;
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::load::{LoadOptions, load_scene};
use metrolux::study::analyse::{Judged, Summary, summarise};
use metrolux::study::record::{Clock, Point};
use metrolux::study::reference::Reference;
use std::path::Path;

const SIDE: usize = 12;
const REPEATS: usize = 6;

/// XYZ of the furnace after some rounds.
type Render<'a> = &'a dyn Fn(u64, u64) -> Vec<[f64; 3]>;

/// Six doublings of `least` rounds, six seeds each.
fn curve(least: u64, render: Render) -> Summary {
    let ones = Image {
        width: SIDE,
        height: SIDE,
        rgb: vec![[1.0; 3]; SIDE * SIDE],
    };
    let reference = Reference::of_file(ones, None, Path::new("ones.exr"));
    let judged: Vec<Judged> = (0..6 * REPEATS)
        .map(|i| {
            let (level, repeat) = (i / REPEATS, i % REPEATS);
            let rounds = least << level;
            let seed = 1 + i as u64;
            let image = Image::from_xyz(SIDE, SIDE, &render(rounds, seed));
            let point = Point {
                command: Vec::new(),
                scene_hash: String::new(),
                rounds,
                seed,
                repeat,
                // Counted, not clocked: what is tested is the curve, and clocks of shared machines lie.
                wall_seconds: rounds as f64,
                cpu_seconds: rounds as f64,
                threads: 1,
                claimed: None,
                faults: 0,
            };
            Judged::new(point, level, &image, &reference)
        })
        .collect();
    summarise(&judged.iter().collect::<Vec<_>>(), &reference, Clock::Wall)
}

/// A slope's standard error: 144 pixels tell a mean square to 12 % or, where single bright pixels rule, to some 30 %, that
/// is ±0.15 in ln error at worst; 36 points over five doublings (Σ(x−x̄)² = 50) leave 0.02. The ±0.05 asked for is 2.4 of
/// that at worst and 6 of it as a rule; a slope off by 0.1 is found in 99 of 100 cases.
fn falls_as_a_square_root(name: &str, s: &Summary) {
    let slope = s.fit.expect("many points").slope;
    println!(
        "{name}: slope {:.3} ({:.3} to {:.3}), {:?}",
        slope.value, slope.low, slope.high, s.parts
    );
    assert!((slope.value + 0.5).abs() < 0.05, "{name}: {slope:?}");
    let parts = s.parts.expect("many images");
    // Held to 99.99 %: three integrators in one test.
    let square = parts.floor_square;
    let wide = 4.0 * (square.high - square.value);
    assert!(
        square.value < wide,
        "{name}: a floor without a bias, {square:?}"
    );
}

#[test]
fn error_falls_as_the_square_root_of_work() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/furnace/four-points.pbrt");
    let mut scene = load_scene(&file, &LoadOptions::default()).expect("a scene");
    scene.camera.resolution = [SIDE as u32; 2];
    scene.camera.crop = [0, 0, SIDE as u32, SIDE as u32];
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree");
    let world = World::new(&scene, &accel, scene.settings.max_depth);
    let tally = || Tally::default();
    let paths = curve(4, &|rounds, seed| {
        pt::<4, _>(&world, Budget::Rounds(rounds), seed, &Quiet, &mut tally()).0
    });
    falls_as_a_square_root("pt", &paths);
    let both = Bdpt {
        heuristic: Heuristic::Power,
        indirect_only: false,
    };
    let joined = curve(2, &|rounds, seed| {
        bdpt::<4, _>(
            &world,
            both,
            Budget::Rounds(rounds),
            seed,
            &Quiet,
            &mut tally(),
        )
        .0
    });
    falls_as_a_square_root("bdpt", &joined);
    // Many seeding samples beside few steps, so that the error of b is a small part.
    let options = MltOptions {
        chains: 4,
        seeds: 1024,
        direct: Direct::InChain,
        ..MltOptions::default()
    };
    let chains = curve(4, &|rounds, seed| {
        mlt::<4, _>(
            &world,
            &options,
            Budget::Rounds(rounds),
            seed,
            &Quiet,
            &mut tally(),
        )
        .image
    });
    falls_as_a_square_root("mlt", &chains);

    // Two reflections of the series 1/2 + 1/4 + …: of radiance 1 a quarter is missing, everywhere.
    let short = World::new(&scene, &accel, 2);
    let cut = curve(4, &|rounds, seed| {
        pt::<4, _>(&short, Budget::Rounds(rounds), seed, &Quiet, &mut tally()).0
    });
    let parts = cut.parts.expect("many images");
    println!("depth 2: {parts:?}");
    let floor = parts.floor().expect("a floor");
    assert!(
        floor.low <= 0.25 + 1e-6 && 0.25 - 1e-6 <= floor.high && floor.high - floor.low < 0.02,
        "{floor:?}"
    );
    assert!(
        parts.bias.low <= -0.25 + 1e-6 && -0.25 - 1e-6 <= parts.bias.high,
        "{parts:?}"
    );
    assert!(
        cut.reach.iter().all(Option::is_none),
        "10 % is never reached: {:?}",
        cut.reach
    );
}
