//! The check of one backend by another tells wrong from merely different.

use super::super::referee::{Class, Fault, Meeting, judge_nearest, meeting};
use super::super::testing::{Rng, geometry, icosphere, mixed, soup};
use super::super::*;
use super::*;

/// A backend that changes what another answers.
struct Liar<'a, F>(&'a Obvhs<'a>, F);

impl<F: Fn(&Ray, Option<PrimId>) -> Option<PrimId> + Sync> Accel for Liar<'_, F> {
    fn geometry(&self) -> &Geometry {
        self.0.geometry()
    }
    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        self.1(ray, self.0.nearest(ray))
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.nearest(ray).is_some()
    }
    fn nearest_but(&self, ray: &Ray, _: [PrimId; 2]) -> Option<PrimId> {
        self.nearest(ray)
    }
    fn occluded_but(&self, ray: &Ray, _: [PrimId; 2]) -> bool {
        self.occluded(ray)
    }
    fn name(&self) -> String {
        "liar".into()
    }
    fn memory_bytes(&self) -> usize {
        0
    }
}

/// Every triangle stands twice, and of the two this names the odd one, if it may.
struct Odd<'a>(&'a Obvhs<'a>);

impl Accel for Odd<'_> {
    fn geometry(&self) -> &Geometry {
        self.0.geometry()
    }
    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        self.nearest_but(ray, [PrimId::NONE; 2])
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }
    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        let even = self.0.nearest_but(ray, but)?;
        let odd = PrimId::of(even.prim() | 1);
        Some(if but.contains(&odd) { even } else { odd })
    }
    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        self.0.occluded_but(ray, but)
    }
    fn name(&self) -> String {
        "odd".into()
    }
    fn memory_bytes(&self) -> usize {
        0
    }
}

fn ask(checked: &impl Accel, rays: &[Ray]) {
    for ray in rays {
        checked.nearest(ray);
        checked.occluded(ray);
    }
}

fn rays(rng: &mut Rng, n: usize) -> Vec<Ray> {
    (0..n).map(|_| random_ray(rng)).collect()
}

#[test]
fn embree_and_obvhs_are_never_wrong_and_hardly_ever_differ() {
    let mut rng = Rng(11);
    let g = mixed(&mut rng, 1000, 100);
    let checked = Checked::new(embree(&g), Obvhs::new(&g));
    ask(&checked, &rays(&mut rng, 50_000));
    let found = checked.disagreement();
    assert_eq!(
        (found.rays_closest, found.rays_visibility),
        (50_000, 50_000)
    );
    assert_eq!(found.wrong(), 0, "{found:#?}");
    // An edge is met within a rounding, or two faces tie, about once in 10⁵ rays.
    assert!(found.different() < 10, "{found:#?}");
}

#[test]
fn a_primitive_that_is_passed_over_is_missed() {
    let mut rng = Rng(35);
    let g = soup(&mut rng, 300);
    let honest = Obvhs::new(&g);
    let rays = rays(&mut rng, 20_000);
    let hidden = |p: &Option<PrimId>| p.is_some_and(|p| p.prim() % 10 == 0);
    let expected = rays.iter().filter(|r| hidden(&honest.nearest(r))).count() as u64;
    let blind = Liar(&honest, |_: &Ray, p| if hidden(&p) { None } else { p });
    let checked = Checked::new(&honest, blind);
    ask(&checked, &rays);
    let found = checked.disagreement();
    // An edge now and then is no proof.
    assert!(
        found.missed[1] + found.edges == 2 * expected && found.edges < 5,
        "{found:#?}"
    );
    assert_eq!(
        (found.missed[0], found.false_hits, found.ties),
        (0, [0, 0], 0)
    );
    assert!(expected > 300 && found.first.len() == 16);
    // The ray in the message is the ray, bit for bit.
    let said = found.first[0].split(' ').nth(4).expect("kind and numbers");
    let numbers: Vec<f32> = said
        .split(',')
        .skip(1)
        .map(|v| v.parse().expect("f32"))
        .collect();
    assert!(
        rays.iter()
            .any(|r| [r.o.to_array(), r.d.to_array()].concat() == numbers[..6]),
        "{said}"
    );
}

#[test]
fn a_primitive_that_is_not_there_is_a_false_hit() {
    let mut rng = Rng(36);
    let g = soup(&mut rng, 50);
    let honest = Obvhs::new(&g);
    let liar = Liar(&honest, |_: &Ray, p: Option<PrimId>| {
        p.or(Some(PrimId::of(7)))
    });
    let checked = Checked::new(liar, &honest);
    ask(&checked, &rays(&mut rng, 5000));
    let found = checked.disagreement();
    assert!(
        found.false_hits[0] > 2000 && found.false_hits[1] == 0,
        "{found:#?}"
    );
    assert_eq!(found.missed, [0, 0]);
}

#[test]
fn faces_that_coincide_tie_and_the_farther_of_two_is_wrong() {
    let mut rng = Rng(37);
    let mut g = soup(&mut rng, 100);
    // Every triangle twice.
    let twice = g.triangles.iter().flat_map(|t| [*t, *t]).collect();
    g = geometry(g.positions[..300].to_vec(), twice, vec![]);
    g.leave_out = true;
    let honest = Obvhs::new(&g);
    let other = Liar(&honest, |_: &Ray, p: Option<PrimId>| {
        p.map(|p| PrimId::of(p.prim() ^ 1))
    });
    let checked = Checked::new(&honest, other);
    ask(&checked, &rays(&mut rng, 2000));
    let found = checked.disagreement();
    assert!(
        found.ties > 200 && found.ties == found.different(),
        "{found:#?}"
    );
    // This one names no twin but in place of the other, so it was not seen to find both.
    assert_eq!(found.reversed, 0);
    let checked = Checked::new(&honest, Odd(&honest));
    ask(&checked, &rays(&mut rng, 2000));
    let found = checked.disagreement();
    assert!(found.ties > 50 && found.reversed == found.ties);
    assert!(found.agreement() == 1.0 && found.same_at_once() < 1.0);

    let near = [0.0, 0.5].map(|z| {
        [
            Vec3::new(0.0, 0.0, z),
            Vec3::new(1.0, 0.0, z),
            Vec3::new(0.0, 1.0, z),
        ]
    });
    let g = geometry(near.concat(), vec![[0, 1, 2], [3, 4, 5]], vec![]);
    let ray = to_infinity(Vec3::new(0.2, 0.2, 2.0), Vec3::NEG_Z);
    let (second, fault) = (true, Fault::Missed);
    assert_eq!(
        judge_nearest(
            &g,
            &ray,
            [PrimId::NONE; 2],
            [Some(PrimId::of(1)), Some(PrimId::of(0))]
        ),
        Class::Wrong { second, fault }
    );
    assert!(
        matches!(meeting(&g, PrimId::of(0), &ray), Meeting::Inside(r) if (r.t - 2.0).abs() < 1e-9)
    );
    let outside = to_infinity(Vec3::new(0.8, 0.8, 2.0), Vec3::NEG_Z);
    assert_eq!(meeting(&g, PrimId::of(0), &outside), Meeting::Outside);
    let at_the_end = Ray { t_max: 1.5, ..ray };
    assert!(matches!(
        meeting(&g, PrimId::of(1), &at_the_end),
        Meeting::End(_)
    ));
}

#[test]
fn rays_at_edges_and_corners_differ_without_being_wrong() {
    let g = icosphere(3);
    let mut rng = Rng(38);
    let checked = Checked::new(embree(&g), Obvhs::new(&g));
    for i in 0..60_000 {
        let [a, b, _] = g.corners((rng.next() * g.triangles.len() as f32) as u32);
        let o = rng.direction() * if i % 2 == 0 { 0.5 } else { 3.0 };
        let target = if i % 3 == 0 { a } else { a.lerp(b, rng.next()) };
        ask(&checked, &[to_infinity(o, target - o)]);
    }
    let found = checked.disagreement();
    assert_eq!(found.wrong(), 0, "{found:#?}");
    assert!(found.different() > 1000, "{found:#?}");
}
