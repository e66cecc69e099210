//! Lens sub-paths are stratified on the image plane (Veach 11.4.4): how evenly their proposals fall on the pixels, with a
//! quota for every pixel and without.

mod common;

use common::scene::{embree, of_file};
use metrolux::chain::{Chain, Direct, MltOptions, Setting, Splat, Which, seed_group, start_chain};
use metrolux::mutation::Strategy;
use metrolux::path::{Sampler, Tally, World};
use metrolux::plan::Shares;
use metrolux::sampling::ROUND;

/// Pixels along a side.
const SIDE: usize = 40;

/// Steps of a chain.
const STEPS: u32 = 32_768;

/// Mean and variance of the number of proposals of lens sub-paths in a pixel, over the pixels of one group's run inside a
/// sphere. Nothing is hidden from anything there, so that every proposal becomes a path and shows where it went.
fn proposals_per_pixel(stratify: bool) -> (f64, f64) {
    let scene = of_file("furnace/point.pbrt", SIDE as u32, SIDE as u32);
    let embree = embree(&scene);
    let world = World::new(&scene, &embree, 8);
    let options = MltOptions {
        shares: Shares::only(Strategy::LensSubpath, 0.1),
        direct: Direct::InChain,
        stratify,
        ..MltOptions::default()
    };
    let set = Setting::new(&world, &options);
    let mut tally = Tally::default();
    let batch = seed_group::<4, _>(&set, 5, 0, 0, &mut tally);
    let mut sampler = Sampler::new(world.max_edges);
    let mut pixels = vec![0u32; SIDE * SIDE];
    for (start, chain) in batch.seeds.iter().zip(0..) {
        let which = Which {
            seed: 5,
            generation: 0,
            group: 0,
            chain,
        };
        let chain = start_chain(&set, which, *start, &mut sampler, &mut tally);
        let mut chain: Chain<4> = chain.expect("the start is found again");
        for _ in 0..STEPS {
            let turn = chain.turn(&set);
            if turn.strategy == Some(Strategy::LensSubpath) && turn.ratio.is_some() {
                let at = chain.proposal().raster.as_uvec2();
                pixels[at.x as usize + SIDE * at.y as usize] += 1;
            }
            chain.settle(&set, &turn, &mut |_: Splat| {});
        }
        let found = chain.stats.strategies[Strategy::LensSubpath as usize];
        assert_eq!(found.proposed, found.constructed);
    }
    let n = pixels.len() as f64;
    let mean = pixels.iter().map(|c| f64::from(*c)).sum::<f64>() / n;
    let squares = pixels.iter().map(|c| (f64::from(*c) - mean).powi(2));
    (mean, squares.sum::<f64>() / (n - 1.0))
}

/// Independent proposals have the variance of their mean; over 1600 pixels it is found within √(2/1599) of that. With a
/// quota of q entries a round, each dealt n_e times, full rounds vary by nothing. Of the last one a part f has been
/// dealt, in random order: n_e²·q·f·(1 − f) ≤ n_e²·q/4. And chains run apart: their numbers of such steps have a standard
/// deviation of 54. Within five of those lie all 16, and what some of them have got beyond others is in the worst case
/// as good as independent, n_e at a time.
#[test]
fn a_quota_spreads_proposals_over_the_pixels() {
    let options = MltOptions::default();
    let (mean, variance) = proposals_per_pixel(false);
    println!("without quota: {mean:.1} proposals a pixel, variance {variance:.1}");
    let five = 5.0 * (2.0f64 / 1599.0).sqrt();
    assert!((variance / mean - 1.0).abs() < five, "{variance} / {mean}");

    let (mean, variance) = proposals_per_pixel(true);
    println!("with quota: {mean:.1} proposals a pixel, variance {variance:.1}");
    let uses = f64::from(options.entry_uses);
    let quota = (ROUND as f64 / 1600.0).ceil();
    let apart = uses * 16.0 * 5.0 * 54.0 / 1600.0;
    let most = (uses * uses * quota / 4.0 + apart) * (1.0 + five);
    assert!(variance < most, "{variance} of {mean}, at most {most}");
    assert!(most < 0.3 * mean);
}
