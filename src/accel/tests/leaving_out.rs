//! Queries that leave out triangles answer as if there were none of them, on both backends, through instances too.

use super::super::referee::{Class, judge_nearest, judge_occluded};
use super::super::testing::Rng;
use super::super::*;
use super::instances::crowd;
use super::*;

const NONE: PrimId = PrimId::NONE;

/// What f64 says of visibility, where it is certain.
fn truth(g: &Geometry, ray: &Ray, but: [PrimId; 2]) -> Option<bool> {
    match judge_occluded(g, ray, but, true) {
        // Of two answers, free and occluded, the wrong one is named.
        Class::Wrong { second, .. } => Some(!second),
        _ => None,
    }
}

/// Primitives are left out one after another, and each answer is held against all that are left, in f64.
#[test]
fn what_is_left_out_is_as_if_it_were_not_there() {
    let mut rng = Rng(41);
    let mut g = crowd(&mut rng, 0..5, 10);
    g.leave_out = true;
    let (a, b) = (embree(&g), Obvhs::new(&g));
    let backends: [&dyn Accel; 2] = [&a, &b];
    let (mut deeper, mut through, mut curved, mut certain) = (0, 0, 0, [0, 0]);
    for _ in 0..2000 {
        let ray = random_ray(&mut rng);
        for accel in backends {
            let Some(first) = accel.nearest(&ray) else {
                continue;
            };
            assert_eq!(accel.nearest_but(&ray, [NONE; 2]), Some(first));
            if !g.is_triangle(first) {
                // A curved thing may be met again by a ray that leaves it.
                assert_eq!(accel.nearest_but(&ray, [first, NONE]), Some(first));
                curved += 1;
                continue;
            }
            through += u32::from(first.instance().is_some());
            let Some(second) = accel.nearest_but(&ray, [first, NONE]) else {
                continue;
            };
            let third = accel.nearest_but(&ray, [second, first]);
            for (but, found) in [([first, NONE], Some(second)), ([second, first], third)] {
                let class = judge_nearest(&g, &ray, but, [found, found]);
                let fine = !matches!(class, Class::Wrong { .. });
                assert!(fine, "{} {ray:?} {but:?} {found:?}", accel.name());
                let left = found.is_none_or(|f| !but.contains(&f) || !g.is_triangle(f));
                assert!(left, "{} {ray:?} {but:?} {found:?}", accel.name());
                // As far as a target some way along.
                let t_max = 1.0;
                let short = Ray { t_max, ..ray };
                if let Some(truth) = truth(&g, &short, but) {
                    assert_eq!(accel.occluded_but(&short, but), truth, "{}", accel.name());
                    certain[usize::from(truth)] += 1;
                }
            }
            deeper += 1;
        }
    }
    let all = (deeper, through, curved, certain);
    assert!(
        deeper > 1000 && through > 1000 && curved > 100 && certain.iter().all(|n| *n > 100),
        "{all:?}"
    );
}

/// Where nothing is left out both kinds of query are one, and `checked` holds the backends against each other as ever.
#[test]
fn the_check_knows_what_was_left_out() {
    let mut rng = Rng(42);
    let mut g = crowd(&mut rng, 0..5, 10);
    g.leave_out = true;
    let checked = Checked::new(embree(&g), Obvhs::new(&g));
    for _ in 0..5000 {
        let ray = random_ray(&mut rng);
        if let Some(first) = checked.nearest(&ray) {
            checked.nearest_but(&ray, [first, NONE]);
            checked.occluded_but(&ray, [NONE, first]);
        }
    }
    let found = checked.disagreement();
    assert!(found.rays_closest > 5000 && found.rays_visibility > 1000);
    assert_eq!(found.wrong(), 0, "{found:#?}");
}
