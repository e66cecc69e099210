//! Transport in f32 and in f64 (the feature `double`): the same steps kept and made again, and the same image.

mod common;

use common::stats::{Estimate, Pair, agree};
use metrolux::output::read_image;
use std::path::{Path, PathBuf};
use std::process::Command;

const GLASS: &str = "cornell-glass/cornell-glass.pbrt";

/// Exit code and output of a command on a scene.
fn run(program: &Path, command: &str, scene: &str, args: &[&str]) -> (i32, String) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(scene);
    let mut c = Command::new(program);
    let done = c.arg(command).arg(scene).args(args).output();
    let done = done.unwrap_or_else(|e| panic!("{}: {e}", program.display()));
    let text = String::from_utf8([done.stdout, done.stderr].concat()).expect("UTF-8");
    (done.status.code().expect("an exit code"), text)
}

fn built() -> PathBuf {
    env!("CARGO_BIN_EXE_metrolux").into()
}

/// In the build that kept them, steps come out to the last bit; so whatever another build prints is its precision.
#[test]
fn steps_made_again_in_the_same_numbers_deviate_by_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let steps = dir.path().join("a.steps");
    let file = steps.to_str().expect("UTF-8");
    for scene in [GLASS, "prism/prism.pbrt", "furnace/point.pbrt"] {
        let size = ["--resolution", "16x16", "--seed", "3"];
        let keep = [&size[..], &["--steps", "60", "--keep-steps", file]].concat();
        let (code, text) = run(&built(), "verify", scene, &keep);
        assert_eq!(code, 0, "{text}");
        let (code, text) = run(
            &built(),
            "verify",
            scene,
            &[&size[..], &["--against", file]].concat(),
        );
        assert_eq!(code, 0, "{text}");
        let made: u64 = text.split(' ').next().unwrap_or("").parse().expect(&text);
        assert!(made > 300, "{text}");
        let rows: Vec<Vec<&str>> = text
            .lines()
            .skip(3)
            .take_while(|l| !l.is_empty())
            .map(|l| l.split_whitespace().rev().take(5).collect())
            .collect();
        assert_eq!(rows.len(), 9, "{text}");
        for row in rows {
            assert_eq!(row[..4], ["0", "0.0e0", "0.0e0", "0.0e0"], "{text}");
            assert!(row[4].parse::<u64>().expect(&text) >= made, "{text}");
        }
        assert!(text.contains("carry no light here: 0\n"), "{text}");
    }
    // Steps of a sphere are not those of a room, and a scene holds no steps.
    let (code, text) = run(&built(), "verify", GLASS, &["--against", file]);
    assert!(code == 2 && text.contains("another render"), "{text}");
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let own = own.to_str().expect("UTF-8");
    let (code, text) = run(&built(), "verify", GLASS, &["--against", own]);
    assert_eq!(code, 2, "{text}");
}

/// Pixels of a side, and of a side of a block.
const SIDE: usize = 16;
const BLOCK: usize = 4;
/// Renders of either build, each with a seed of its own.
const RENDERS: u64 = 24;

/// Luminance of each block in each of the renders.
fn blocks(program: &Path, first_seed: u64) -> Vec<Vec<f64>> {
    let dir = tempfile::tempdir().expect("a folder");
    let image = dir.path().join("a.exr");
    let out = image.to_str().expect("UTF-8");
    let render = |seed: u64| {
        let seed = seed.to_string();
        let size = format!("{SIDE}x{SIDE}");
        let args = ["--resolution", &size, "--seed", &seed, "--rounds", "250"];
        let (code, text) = run(
            program,
            "render",
            GLASS,
            &[&args[..], &["-o", out]].concat(),
        );
        assert_eq!(code, 0, "{text}");
        let rgb = read_image(&image).expect("an image").rgb;
        let mut sums = vec![0.0; (SIDE / BLOCK).pow(2)];
        for (i, c) in rgb.iter().enumerate() {
            let (x, y) = (i % SIDE / BLOCK, i / SIDE / BLOCK);
            let y_of_rgb = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
            sums[y * (SIDE / BLOCK) + x] += y_of_rgb as f64 / (BLOCK * BLOCK) as f64;
        }
        sums
    };
    (first_seed..first_seed + RENDERS).map(render).collect()
}

/// Rounding would show as a bias if some decision of f32 went one way more often than its probability says.
#[test]
#[ignore = "renders with a second build: make test-long"]
fn the_image_is_the_same_in_both_precisions() {
    let other = std::env::var("METROLUX_DOUBLE")
        .expect("METROLUX_DOUBLE names a binary built with --features double");
    let (a, b) = (blocks(&built(), 1), blocks(Path::new(&other), 1001));
    let of = |all: &[Vec<f64>], i: usize| {
        Estimate::of(
            all.iter()
                .map(move |r| r[i])
                .collect::<Vec<_>>()
                .into_iter(),
        )
    };
    let pairs: Vec<Pair> = (0..a[0].len())
        .map(|i| Pair {
            name: format!("block {i}"),
            found: of(&b, i),
            reference: of(&a, i),
            limit: 0.15,
        })
        .collect();
    agree("f64 against f32", &pairs);
}
