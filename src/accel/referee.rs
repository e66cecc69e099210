//! Who is right where two backends differ: every primitive is asked in f64, with bounds on what f32 may get wrong.

use super::{Ray, quadric};
use crate::scene::{Geometry, Instance, PrimId, Quadric};
use glam::{DVec3, Vec3};

/// Roundings u = 2⁻²⁴ of the largest distance R of a corner from the origin that a test in f32 may be off by: a corner
/// moves by up to 4u·R when it is made relative and sheared, and products of it are rounded about eight times.
const ROUNDINGS: f64 = 16.0;

/// What f32 can say of a ray and a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meeting {
    /// No.
    Outside,
    /// It cannot: the ray passes an edge or a corner within the roundings.
    Edge(Reach),
    /// It cannot: the primitive lies within the roundings of the ray's beginning or end.
    End(Reach),
    /// Yes.
    Inside(Reach),
}

/// A distance in units of |d| with a bound on what f32 makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Distance.
    pub t: f64,
    /// Bound.
    pub slack: f64,
}

impl Meeting {
    /// The distance, unless outside.
    pub fn reach(self) -> Option<Reach> {
        match self {
            Self::Outside => None,
            Self::Edge(r) | Self::End(r) | Self::Inside(r) => Some(r),
        }
    }
}

/// One primitive.
pub fn meeting(geometry: &Geometry, id: PrimId, ray: &Ray) -> Meeting {
    let u = f32::EPSILON as f64 * 0.5;
    let (instance, part, prim) = geometry.resolve(id);
    let line = match instance {
        None => Line::new(ray),
        Some(i) => Line::through(i, ray),
    };
    match (part.quadric(prim), instance) {
        (None, _) => triangle(part.corners(prim), &line, ROUNDINGS * u),
        // All backends call the one routine, so what it says is so; only its distance is rounded.
        (Some(q), None) => quadric::intersect(q, ray).map_or(Meeting::Outside, |t| {
            let t = t as f64;
            Meeting::Inside(Reach {
                t,
                slack: ROUNDINGS * u * t,
            })
        }),
        (Some(q), Some(_)) => curved(q, &line, ROUNDINGS * u),
    }
}

/// A ray in f64, in the space of what it is to meet.
struct Line {
    o: DVec3,
    d: DVec3,
    t_max: f64,
    /// How much farther off a corner may seem to a backend that carried the ray there in f32, when it is so far away.
    carried: Option<Instance>,
    near: f64,
}

impl Line {
    fn new(ray: &Ray) -> Self {
        Self {
            o: ray.o.as_dvec3(),
            d: ray.d.as_dvec3(),
            t_max: ray.t_max as f64,
            carried: None,
            near: 0.0,
        }
    }

    fn through(instance: &Instance, ray: &Ray) -> Self {
        let world = Self::new(ray);
        let inverse = instance.linear.as_dmat3().inverse();
        Self {
            o: inverse * (world.o - instance.translation.as_dvec3()),
            d: inverse * world.d,
            carried: Some(*instance),
            near: world.o.abs().max_element(),
            ..world
        }
    }

    /// Bound on what f32 may move a point that is `far` away by, beside its own test's roundings.
    fn moved(&self, far: f64) -> f64 {
        self.carried.map_or(0.0, |i| {
            let stretch = i.linear.as_dmat3();
            // ‖A‖ at most: the longest way in the world of so long a way here.
            let norm = [stretch.x_axis, stretch.y_axis, stretch.z_axis]
                .iter()
                .map(|c| c.length_squared())
                .sum::<f64>()
                .sqrt();
            3f64.sqrt() * i.carried(self.near, far * norm)
        })
    }
}

/// A quadric of an object, of which the ray that a backend carried there in f32 is off by a bound.
fn curved(q: &Quadric, line: &Line, unit: f64) -> Meeting {
    let (Quadric::Sphere { center, radius, .. } | Quadric::Disk { center, radius, .. }) = q;
    let (center, radius) = (center.as_dvec3(), *radius as f64);
    let (t, passes) = quadric::on_line(q, line.o, line.d);
    let (length, at) = (line.d.length(), line.o + line.d * t);
    let (_, normal) = quadric::project(q, at);
    let off = unit * (at - line.o).length() + line.moved((at - line.o).length());
    let cos = normal.dot(line.d).abs() / (length * normal.length());
    // How far inside of the silhouette or the rim the line passes, and how far that may be off.
    let (within, margin, leaves) = match q {
        Quadric::Sphere { .. } => {
            let o = line.o - center;
            let foot = o - line.d * (line.d.dot(o) / (length * length));
            let leaves = (o.length() - radius).abs() <= off;
            (radius - foot.length(), off, leaves)
        }
        Quadric::Disk { .. } => (radius - (at - center).length(), off / cos, false),
    };
    // Twice, because a sphere's cosine changes on the way.
    let reach = Reach {
        t: if leaves { 0.0 } else { t },
        slack: 2.0 * off / (cos * length),
    };
    let end = reach.slack + unit * reach.t.abs();
    if within < -margin || reach.t < -end || reach.t > line.t_max + end {
        Meeting::Outside
    } else if reach.t <= end || reach.t >= line.t_max - end {
        Meeting::End(reach)
    } else if passes || within <= margin {
        Meeting::Edge(reach)
    } else {
        Meeting::Inside(reach)
    }
}

/// Edge functions as volumes: e_i = d · (v_j × v_k) of corners relative to the origin, whose sum is d · n. A corner off
/// by δ moves e_i by δ·|edge|·|d|.
fn triangle(corners: [Vec3; 3], line: &Line, unit: f64) -> Meeting {
    let (o, d) = (line.o, line.d);
    let [a, b, c] = corners.map(|p| p.as_dvec3() - o);
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let far = a.length().max(b.length()).max(c.length());
    // A carried ray errs as if all corners were that much off.
    let off = unit * far + line.moved(far);
    let n = ab.cross(ac);
    let (cos, length) = (d.dot(n), d.length());
    let facing = 1f64.copysign(cos);
    let volume = |p: DVec3, q: DVec3| d.dot(p.cross(q)) * facing;
    let sides = [(volume(b, c), bc), (volume(c, a), ac), (volume(a, b), ab)];
    let mut sure = true;
    for (e, edge) in sides {
        let bound = off * edge.length() * length;
        if e < -bound {
            return Meeting::Outside;
        }
        sure &= e > bound;
    }
    if cos == 0.0 {
        // Edge-on, or no area.
        let reach = Reach {
            t: a.dot(d) / (length * length),
            slack: f64::INFINITY,
        };
        return Meeting::Edge(reach);
    }
    // The plane through corners off by δ is off by δ within the triangle, and by δ times length over height where a
    // test takes it from the edges at one corner.
    let longest2 = ab
        .length_squared()
        .max(ac.length_squared())
        .max(bc.length_squared());
    let needle = 1.0 + longest2 / n.length();
    let reach = Reach {
        t: a.dot(n) / cos,
        slack: off * needle * n.length() / cos.abs(),
    };
    let t_max = line.t_max;
    // Ends are rounded too.
    let end = reach.slack + unit * t_max.min(reach.t.abs());
    if reach.t < -end || reach.t > t_max + end {
        Meeting::Outside
    } else if reach.t <= end || reach.t >= t_max - end {
        Meeting::End(reach)
    } else if sure {
        Meeting::Inside(reach)
    } else {
        Meeting::Edge(reach)
    }
}

/// Two primitives named for one ray lie at the same place, as far as f32 can tell.
pub fn same_place(geometry: &Geometry, a: PrimId, b: PrimId, ray: &Ray) -> bool {
    let reach = |p| meeting(geometry, p, ray).reach();
    match (reach(a), reach(b)) {
        (Some(a), Some(b)) => (a.t - b.t).abs() <= a.slack + b.slack,
        _ => false,
    }
}

/// What is wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Something surely lies nearer.
    Missed,
    /// What was named is surely not there.
    False,
}

/// Two answers about one ray, judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Different primitives at the same place: coincident faces, a shared edge.
    Tie,
    /// An edge or a corner is met within the roundings, and what one of the two takes for a hit the other does not.
    Edge,
    /// The same at the beginning or the end of the ray.
    End,
    /// One of the two is wrong.
    Wrong {
        /// The second one, not the first.
        second: bool,
        /// In what.
        fault: Fault,
    },
}

/// All primitives that a ray may meet: those of the world, and those of the instances whose box it does not clearly pass,
/// without the triangles `but`.
fn candidates<'g>(
    geometry: &'g Geometry,
    ray: &Ray,
    but: [PrimId; 2],
) -> impl Iterator<Item = PrimId> + 'g {
    let world = (0..geometry.prim_count() as u32).map(PrimId::of);
    let boxes: Vec<_> = geometry.objects.iter().map(Geometry::bounds).collect();
    let line = Line::new(ray);
    let near = line.o.abs().max_element();
    let instances = geometry.instances.iter().enumerate();
    let entered = instances.filter(move |(_, i)| {
        boxes[i.object as usize].is_some_and(|b| {
            let (lo, hi) = i.bounds(b);
            let (c, e) = ((lo + hi) * 0.5, (hi - lo) * 0.5);
            // A sphere around the box, grown far beyond any rounding.
            let (radius, to) = (e.length() + 1e-3 * (near + c.length()), c - line.o);
            let along = to.dot(line.d) / line.d.length();
            to.length_squared() - along * along <= radius * radius && along >= -radius
        })
    });
    let inside = entered.flat_map(|(i, instance)| {
        let count = geometry.objects[instance.object as usize].prim_count();
        (0..count as u32).map(move |p| PrimId::through(i as u32, p))
    });
    let all = world.chain(inside);
    all.filter(move |p| !but.contains(p) || !geometry.is_triangle(*p))
}

/// Judges two different answers about the nearest primitive without the triangles `but`. Asks every primitive: for rare
/// cases.
pub fn judge_nearest(
    geometry: &Geometry,
    ray: &Ray,
    but: [PrimId; 2],
    answers: [Option<PrimId>; 2],
) -> Class {
    let sure = candidates(geometry, ray, but).filter_map(|p| match meeting(geometry, p, ray) {
        Meeting::Inside(r) => Some(r),
        _ => None,
    });
    // The end of its slack: what begins behind that is surely farther.
    let nearest = sure.map(|r| r.t + r.slack).fold(f64::INFINITY, f64::min);
    let named = answers.map(|a| a.map(|p| meeting(geometry, p, ray)));
    for (i, answer) in named.iter().enumerate() {
        let fault = match answer.map(Meeting::reach) {
            Some(None) => Some(Fault::False),
            Some(Some(r)) if nearest < r.t - r.slack => Some(Fault::Missed),
            None if nearest < f64::INFINITY => Some(Fault::Missed),
            _ => None,
        };
        if let Some(fault) = fault {
            let second = i == 1;
            return Class::Wrong { second, fault };
        }
    }
    let end = named.iter().flatten().any(|m| matches!(m, Meeting::End(_)));
    match answers {
        [Some(a), Some(b)] if same_place(geometry, a, b, ray) => Class::Tie,
        _ if end => Class::End,
        _ => Class::Edge,
    }
}

/// Judges two different answers about visibility without the triangles `but`, of which the second says "occluded" if
/// `second` holds, else the first.
pub fn judge_occluded(geometry: &Geometry, ray: &Ray, but: [PrimId; 2], second: bool) -> Class {
    let mut class = None;
    for p in candidates(geometry, ray, but) {
        match meeting(geometry, p, ray) {
            Meeting::Inside(_) => {
                return Class::Wrong {
                    second: !second,
                    fault: Fault::Missed,
                };
            }
            Meeting::Edge(_) => class = Some(Class::Edge),
            Meeting::End(_) => class = class.or(Some(Class::End)),
            Meeting::Outside => {}
        }
    }
    class.unwrap_or(Class::Wrong {
        second,
        fault: Fault::False,
    })
}
