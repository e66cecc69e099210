//! Same seed, same bits: for any number of threads, and for a time limit and the number of rounds it allowed.

mod common;

use common::scene::{embree, of_file};
use metrolux::accel::{Accel, Checked, Obvhs};
use metrolux::chain::{Direct, MltOptions};
use metrolux::integrator::{Bdpt, Budget, Quiet, bdpt, mlt, pt};
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::Scene;
use std::time::Duration;

/// An image's bits and the rounds it took.
type Bits = (Vec<[u64; 3]>, u64);

fn bits((image, rounds): (Vec<[f64; 3]>, u64)) -> Bits {
    let bits = image.iter().map(|p| p.map(f64::to_bits)).collect();
    (bits, rounds)
}

/// Which integrator: all are run through the same questions.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Pt,
    Bdpt,
    Mlt(Direct),
    TwoStage,
}

const KINDS: [Kind; 5] = [
    Kind::Pt,
    Kind::Bdpt,
    Kind::Mlt(Direct::Separate),
    Kind::Mlt(Direct::InChain),
    Kind::TwoStage,
];

/// Small groups and short generations, so that a few rounds cross several of them.
fn options(direct: Direct) -> MltOptions {
    MltOptions {
        groups: 5,
        chains: 3,
        seeds: 128,
        round: 32,
        rounds_per_generation: 3,
        direct,
        ..MltOptions::default()
    }
}

fn run<A: Accel>(world: &World<A>, kind: Kind, budget: Budget, seed: u64) -> Bits {
    let tally = &mut Tally::default();
    bits(match kind {
        Kind::Pt => pt::<4, A>(world, budget, seed, &Quiet, tally),
        Kind::Bdpt => {
            let what = Bdpt {
                heuristic: Heuristic::Power,
                indirect_only: false,
            };
            bdpt::<4, A>(world, what, budget, seed, &Quiet, tally)
        }
        Kind::Mlt(direct) => chains(world, &options(direct), budget, seed, tally),
        Kind::TwoStage => {
            let options = MltOptions {
                test_samples: Some(2),
                ..options(Direct::Separate)
            };
            chains(world, &options, budget, seed, tally)
        }
    })
}

fn chains<A: Accel>(
    world: &World<A>,
    options: &MltOptions,
    budget: Budget,
    seed: u64,
    tally: &mut Tally,
) -> (Vec<[f64; 3]>, u64) {
    let r = mlt::<4, A>(world, options, budget, seed, &Quiet, tally);
    (r.image, r.rounds)
}

fn with_threads<T: Send>(n: usize, f: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.expect("threads start").install(f)
}

/// A scene with specular chains and a wide filter, so that splats of different chains share pixels.
fn scene() -> Scene {
    let mut scene = of_file("cornell-glass/cornell-glass.pbrt", 13, 11);
    scene.settings.filter.kind = metrolux::scene::FilterKind::Gaussian { sigma: 0.7 };
    scene.settings.filter.radius = [2.0, 2.0];
    scene
}

#[test]
fn threads_leave_no_trace() {
    let scene = scene();
    for kind in KINDS {
        let one = |threads| {
            with_threads(threads, || {
                // Embree is built by as many threads too.
                let accel = embree(&scene);
                let world = World::new(&scene, &accel, 8);
                run(&world, kind, Budget::Rounds(10), 3)
            })
        };
        let first = one(1);
        assert!(first.0.iter().any(|p| f64::from_bits(p[1]) > 0.0));
        for threads in [2, 7] {
            assert!(one(threads) == first, "{kind:?} with {threads} threads");
        }
    }
}

#[test]
fn rounds_repeat_what_a_time_limit_stopped() {
    let scene = scene();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 8);
    for kind in KINDS {
        let limit = Budget::Time(Duration::from_millis(120));
        let stopped = with_threads(2, || run(&world, kind, limit, 5));
        assert!(stopped.1 >= 1);
        let again = with_threads(3, || run(&world, kind, Budget::Rounds(stopped.1), 5));
        assert!(again == stopped, "{kind:?} after {} rounds", stopped.1);
        let more = run(&world, kind, Budget::Rounds(stopped.1 + 1), 5);
        assert!(
            more.0 != stopped.0,
            "{kind:?}: one more round changes nothing"
        );
    }
}

#[test]
fn seeds_differ() {
    let scene = scene();
    let accel = embree(&scene);
    let world = World::new(&scene, &accel, 8);
    for kind in KINDS {
        let a = run(&world, kind, Budget::Rounds(4), 1);
        let b = run(&world, kind, Budget::Rounds(4), 2);
        // Not one lit pixel may repeat: a stage that forgets the seed would show in all of them.
        let same = |(p, q): &(&[u64; 3], &[u64; 3])| p == q && f64::from_bits(p[1]) > 0.0;
        let repeated = a.0.iter().zip(&b.0).filter(same).count();
        assert_eq!(repeated, 0, "{kind:?}");
    }
}

/// Hits are canonical, so the other backend gives the same bits wherever it names the same triangles. On a border of
/// the scene's surfaces one of them may see what the other misses by a rounding: at most one ray in 10⁵, and then the
/// images may differ.
#[test]
fn backends_give_the_same_bits() {
    let mut same = 0;
    for (file, depth) in [
        ("cornell/cornell.pbrt", 8),
        ("cornell-glass/cornell-glass.pbrt", 8),
        ("ajar/ajar.pbrt", 6),
        ("a crowd", 5),
    ] {
        let scene = match file {
            "a crowd" => crowd(),
            _ => of_file(file, 16, 16),
        };
        let obvhs = Obvhs::new(&scene.geometry);
        for kind in KINDS {
            let both = Checked::new(embree(&scene), &obvhs);
            let a = run(
                &World::new(&scene, &both, depth),
                kind,
                Budget::Rounds(16),
                1,
            );
            let b = run(
                &World::new(&scene, &obvhs, depth),
                kind,
                Budget::Rounds(16),
                1,
            );
            let d = both.disagreement();
            assert_eq!(d.wrong(), 0, "{file}, {kind:?}: {d:#?}");
            let others = d.different();
            let rays = d.rays_closest + d.rays_visibility;
            // Three more, so that a rate of 10⁻⁵ passes in small renders too.
            assert!(others <= 3 + rays / 100_000, "{file}, {kind:?}: {d:?}");
            if others == 0 {
                assert!(
                    a == b,
                    "{file}, {kind:?}: {} pixels differ",
                    differing(&a, &b)
                );
                same += 1;
            }
        }
    }
    assert!(
        same >= 13,
        "only {same} renders of 20 asked rays that both answer alike"
    );
}

/// Sixty places of an object of triangles, a ball and a disk under a lamp, some turned, stretched or mirrored.
fn crowd() -> metrolux::scene::Scene {
    let mut world = String::from(
        r#"
        AttributeBegin AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
        Shape "trianglemesh" "point3 P" [ -1 -1 2.2  -1 1 2.2  1 1 2.2  1 -1 2.2 ] "integer indices" [ 0 1 2 0 2 3 ]
        AttributeEnd
        Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.4 ]
        Shape "trianglemesh" "point3 P" [ -2 -2 0  2 -2 0  2 2 0  -2 2 0 ] "integer indices" [ 0 1 2 0 2 3 ]
        ObjectBegin "toy"
        Shape "trianglemesh" "point3 P" [ 0.2 0 0  -0.2 0 0  0 0.2 0  0 -0.2 0  0 0 0.2  0 0 -0.2 ]
            "normal N" [ 1 0.1 0  -1 0 0.1  0 1 0.1  0.1 -1 0  0 0.1 1  0.1 0 -1 ]
            "integer indices" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ]
        Material "conductor" "float roughness" 0.2
        AttributeBegin Translate 0.3 0 0 Shape "sphere" "float radius" 0.1 AttributeEnd
        Shape "disk" "float radius" 0.3
        ObjectEnd
        "#,
    );
    for i in 0..60 {
        let (x, y, z) = (i % 5, i / 5 % 4, i / 20);
        let scale = ["1 1 1", "-1 1 1", "0.7 1 1.3"][i % 3];
        world += &format!(
            "AttributeBegin Translate {} {} {} Rotate {} 1 2 3 Scale {scale} ObjectInstance \"toy\" AttributeEnd\n",
            0.5 * x as f64 - 1.0,
            0.5 * y as f64 - 0.8,
            0.3 + 0.5 * z as f64,
            37 * i
        );
    }
    let camera = "LookAt 0.4 -3.6 1.5  0 0 0.8  0 0 1\nCamera \"perspective\" \"float fov\" 38";
    common::scene::of_text(16, camera, &world)
}

fn differing(a: &Bits, b: &Bits) -> usize {
    a.0.iter().zip(&b.0).filter(|(p, q)| p != q).count()
}
