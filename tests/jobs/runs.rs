//! Runs in this process, cut at will.

use metrolux::accel::{Accel, Embree, EmbreeOptions};
use metrolux::chain::{Direct, MltOptions};
use metrolux::film::{Bins, Malformed, Reader, Shards, Writer};
use metrolux::integrator::{
    Bdpt, Budget, Keeper, Outcome, Quiet, Sampling, Standing, State, Stop, bdpt_kept, mlt_kept,
    pt_kept,
};
use metrolux::path::{Heuristic, Tally, World};
use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, load_str};
use metrolux::scene::spectrum::Target;
use std::path::Path;
use std::time::Duration;

/// Every kind of vertex: triangles with and without normals and texture coordinates, spheres, a disk, area, point, spot and
/// distant lights and a sky, a mixture, coats, metal, glass, a lens with an area, and an object in two places.
pub const ROOM: &str = r#"
Film "rgb" "integer xresolution" 13 "integer yresolution" 11
PixelFilter "gaussian" "float xradius" 1.5 "float yradius" 1.5 "float sigma" 0.6
LookAt 0.5 0.45 -0.9  0.5 0.45 1  0 1 0
Camera "perspective" "float fov" 60 "float lensradius" 0.02 "float focaldistance" 1.2
WorldBegin
LightSource "infinite" "rgb L" [ 0.1 0.12 0.2 ]
LightSource "point" "point3 from" [ 0.2 0.8 0.2 ] "rgb I" [ 0.05 0.05 0.04 ]
LightSource "spot" "point3 from" [ 0.8 0.8 0.1 ] "point3 to" [ 0.5 0 0.5 ] "rgb I" [ 0.2 0.1 0.1 ]
LightSource "distant" "point3 from" [ 0 1 -1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 0.2 0.2 0.2 ]
Texture "checks" "spectrum" "checkerboard" "float uscale" 3 "float vscale" 3
  "rgb tex1" [ 0.7 0.2 0.1 ] "rgb tex2" [ 0.1 0.3 0.7 ]
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 0.7 0.2 0.2 ]
MakeNamedMaterial "metal" "string type" "conductor" "float uroughness" 0.1 "float vroughness" 0.3
Material "diffuse" "texture reflectance" "checks"
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  1 0 1  0 0 1 ] "integer indices" [ 0 2 1 0 3 2 ]
  "point2 uv" [ 0 0  1 0  1 1  0 1 ] "normal N" [ 0.1 1 0  0 1 0.1  -0.1 1 0  0 1 -0.1 ]
Material "mix" "string materials" [ "red" "metal" ] "float amount" 0.5
Shape "trianglemesh" "point3 P" [ 0 0 1  1 0 1  1 1 1  0 1 1 ] "integer indices" [ 0 2 1 0 3 2 ]
  "point2 uv" [ 0 0  1 0  1 1  0 1 ]
Material "coateddiffuse" "rgb reflectance" [ 0.6 0.5 0.4 ] "float roughness" 0
Shape "trianglemesh" "point3 P" [ 0 0 0  0 0 1  0 1 1  0 1 0 ] "integer indices" [ 0 2 1 0 3 2 ]
Material "dielectric" "spectrum eta" "glass-F11"
AttributeBegin
  Translate 0.3 0.3 0.5
  Shape "sphere" "float radius" 0.2
AttributeEnd
Material "diffuse" "texture reflectance" "checks"
AttributeBegin
  Translate 0.75 0.2 0.6
  Rotate 30 1 1 0
  Shape "sphere" "float radius" 0.18
AttributeEnd
AttributeBegin
  Translate 0.5 0.99 0.5
  Rotate 90 1 0 0
  AreaLightSource "diffuse" "rgb L" [ 3 3 2 ]
  Shape "disk" "float radius" 0.2
AttributeEnd
AttributeBegin
  Translate 0.85 0.7 0.8
  AreaLightSource "diffuse" "rgb L" [ 2 3 4 ]
  Shape "sphere" "float radius" 0.06
AttributeEnd
ObjectBegin "toy"
  Material "diffuse" "texture reflectance" "checks"
  Shape "trianglemesh" "point3 P" [ 0 0 0  0.1 0 0  0 0.1 0  0 0 0.1 ] "integer indices" [ 0 2 1 0 1 3 0 3 2 1 2 3 ]
    "normal N" [ -1 -1 -1  1 0 0.1  0 1 0  0.1 0 1 ]
  NamedMaterial "metal"
  Translate 0.05 0.15 0.05
  Shape "sphere" "float radius" 0.05
  Shape "disk" "float radius" 0.08
ObjectEnd
Translate 0.2 0.02 0.2
ObjectInstance "toy"
Translate 0.4 0.1 0.5
Rotate 50 1 2 1
Scale 1 -2 1
ObjectInstance "toy"
"#;

/// What is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Run {
    Pt,
    Bdpt,
    Mlt(Direct),
    TwoStage,
    Spectral,
}

pub const RUNS: [Run; 6] = [
    Run::Pt,
    Run::Bdpt,
    Run::Mlt(Direct::Separate),
    Run::Mlt(Direct::InChain),
    Run::TwoStage,
    Run::Spectral,
];

pub const SEED: u64 = 11;

/// Groups and generations so small that a few rounds cross several of them.
pub fn options(run: Run) -> MltOptions {
    MltOptions {
        groups: 5,
        chains: 4,
        seeds: 192,
        round: 24,
        rounds_per_generation: 3,
        direct: match run {
            Run::Mlt(direct) => direct,
            _ => Direct::Separate,
        },
        test_samples: (run == Run::TwoStage).then_some(2),
        bins: (run == Run::Spectral).then(|| Bins::new(5)),
        shares: metrolux::chain::Shares([0.35, 0.3, 0.1, 0.1, 0.1, 0.05]),
        ..MltOptions::default()
    }
}

pub fn room() -> Scene {
    load_str(ROOM, Path::new(""), &LoadOptions::default()).expect("a scene")
}

/// Lets a run make a number of rounds, one by one, and keeps what it then has.
pub struct Cut {
    pub shards: Shards,
    pub start: Option<State>,
    /// Rounds to make before the cut.
    pub rounds: u64,
    pub bytes: Vec<u8>,
}

impl Cut {
    pub fn after(rounds: u64) -> Self {
        Self {
            shards: Shards::default(),
            start: None,
            rounds,
            bytes: Vec::new(),
        }
    }
}

impl Keeper for Cut {
    fn shards(&self) -> Shards {
        self.shards.clone()
    }

    fn patience(&self) -> Option<Duration> {
        Some(Duration::ZERO)
    }

    fn begin(&mut self) -> Option<State> {
        self.start.take()
    }

    fn between(&mut self, run: &mut dyn Standing, finished: bool) -> bool {
        if self.rounds > 0 && !finished {
            self.rounds -= 1;
            return true;
        }
        let mut w = Writer::new(&mut self.bytes);
        run.save(&mut w).expect("memory");
        false
    }
}

/// Runs for `rounds` in all, with `keeper`.
pub fn go<A: Accel>(
    world: &World<A>,
    run: Run,
    rounds: u64,
    keeper: &mut dyn Keeper,
) -> Result<(Outcome, Tally), Malformed> {
    let stop = Stop {
        budget: Budget::Rounds(rounds),
        target_error: None,
    };
    let what = Sampling {
        world,
        bins: None,
        stop,
        seed: SEED,
    };
    let mut tally = Tally::default();
    let t = &mut tally;
    let outcome = match run {
        Run::Pt => pt_kept::<4, A>(what, &Quiet, t, keeper).map(Outcome::Sampled),
        Run::Bdpt => {
            let how = Bdpt {
                heuristic: Heuristic::Power,
                indirect_only: false,
            };
            bdpt_kept::<4, A>(what, how, &Quiet, t, keeper).map(Outcome::Sampled)
        }
        _ => {
            let options = options(run);
            mlt_kept::<4, A>(world, &options, (stop, SEED), &Quiet, t, keeper)
                .map(|r| Outcome::Mlt(Box::new(r)))
        }
    };
    outcome.map(|o| (o, tally))
}

/// Everything of an outcome that may not change by a bit.
#[derive(Debug, PartialEq)]
pub struct Bits {
    image: Vec<[u64; 3]>,
    variance: Vec<u64>,
    spectrum: Option<Vec<u64>>,
    rounds: u64,
    b: [u64; 2],
    strategies: String,
}

pub fn bits(o: &Outcome) -> Bits {
    let (image, errors, spectrum, rounds, b, strategies) = match o {
        Outcome::Sampled(r) => {
            let none = String::new();
            (
                &r.image,
                &r.errors,
                &r.spectrum,
                r.samples,
                (0.0, 0.0),
                none,
            )
        }
        Outcome::Mlt(r) => {
            let s = format!("{:?} {}", r.stats.strategies, r.stats.longest_stay);
            (&r.image, &r.errors, &r.spectrum, r.rounds, r.b, s)
        }
    };
    let all = |v: &Vec<f64>| v.iter().map(|v| v.to_bits()).collect();
    Bits {
        image: image.iter().map(|p| p.map(f64::to_bits)).collect(),
        variance: all(&errors.variance),
        spectrum: spectrum.as_ref().map(all),
        rounds,
        b: [b.0.to_bits(), b.1.to_bits()],
        strategies,
    }
}

pub fn state(bytes: &[u8]) -> State {
    State::read(&mut Reader::new(bytes)).expect("what was written can be read")
}

/// Calls `f` in a pool of so many threads, with the room as it is built there.
pub fn in_room<T: Send>(
    threads: usize,
    scene: &Scene,
    run: Run,
    f: impl FnOnce(&World<Embree<'_>>) -> T + Send,
) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads start").install(|| {
        let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
        let mut world = World::new(scene, &accel, 6);
        if run == Run::Spectral {
            world = world.with_target(Target::Bins);
        }
        f(&world)
    })
}
