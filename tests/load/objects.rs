//! Objects: kept once where they stand more than once, put into the world where they do not.

use super::{TRIANGLE, load, world};
use glam::{DVec3, Vec2, Vec3};
use metrolux::scene::flatten::flatten;
use metrolux::scene::{Geometry, PrimId, Quadric, Scene};

/// Corner 0 of a triangle of an instance, in the true world.
fn corner(s: &Scene, instance: u32, prim: u32) -> DVec3 {
    let (i, object, prim) = s.geometry.resolve(PrimId::through(instance, prim));
    let p = object.corners(prim)[0].as_dvec3();
    i.expect("an instance").to_world().transform_point3(p) + s.origin
}

fn normal(g: &Geometry, prim: u32) -> Vec3 {
    let [a, b, c] = g.corners(prim);
    (b - a).cross(c - a).normalize()
}

/// A triangle and a sphere, once as they are, once stretched and mirrored.
fn twice() -> Scene {
    world(&format!(
        "Translate 10 0 0\nObjectBegin \"o\"\nTranslate 1 0 0\n{TRIANGLE}\nShape \"sphere\"\nObjectEnd\n\
         Identity\nObjectInstance \"o\"\nScale 1 1 -2\nTranslate 0 5 0\nObjectInstance \"o\""
    ))
}

#[test]
fn an_object_in_two_places_is_kept_once() {
    let s = twice();
    let g = &s.geometry;
    assert_eq!(
        (g.prim_count(), g.objects.len(), g.instances.len()),
        (0, 1, 2)
    );
    let o = &g.objects[0];
    // The sphere stays one: it is stretched as a ray comes to it.
    assert_eq!((o.triangles.len(), o.quadrics.len()), (1, 1));
    assert_eq!(
        (g.flat_count(), g.triangle_count(), g.uses()),
        (4, 1, vec![2])
    );
    assert_eq!(corner(&s, 0, 0), DVec3::new(11.0, 0.0, 0.0));
    assert_eq!(corner(&s, 1, 0), DVec3::new(11.0, 5.0, 0.0));
    assert!(!g.instances[0].mirrors() && g.instances[1].mirrors());
    let (lo, hi) = g.bounds().expect("not empty");
    let at = |p: Vec3| p.as_dvec3() + s.origin;
    assert_eq!(at(lo), DVec3::new(10.0, -1.0, -2.0));
    assert_eq!(at(hi), DVec3::new(12.0, 6.0, 2.0));
    let (source, shapes) = &s.sources.objects[0];
    assert_eq!(source.to_string(), "object \"o\" (<text>:3:1)");
    assert_eq!(shapes.len(), o.shapes.len());
    assert!(
        shapes[0].to_string().contains("<text>:5:1"),
        "{}",
        shapes[0]
    );
}

#[test]
fn flattened_instances_are_placed_one_by_one() {
    let mut s = twice();
    flatten(&mut s, |_| true);
    let g = &s.geometry;
    let origin = s.origin.as_vec3();
    assert_eq!(
        (g.objects.len(), g.instances.len(), g.quadrics.len()),
        (0, 0, 1)
    );
    let p = |t: u32| g.corners(t)[0] + origin;
    assert_eq!(p(0), Vec3::new(11.0, 0.0, 0.0));
    assert_eq!(p(1), Vec3::new(11.0, 5.0, 0.0));
    assert!(normal(g, 0).z > 0.0);
    assert!(
        normal(g, 1).z < 0.0,
        "mirrored in z, the outside goes with the object"
    );
    // The second sphere is stretched and so tessellated, with its outside outside.
    assert!(g.triangles.len() > 1000);
    for t in (2..g.triangles.len() as u32).step_by(1001) {
        let out = g.corners(t)[1] + origin - Vec3::new(11.0, 5.0, 0.0);
        assert!(normal(g, t).dot(out) > 0.0, "{t}");
        let n = g.normals[g.triangles[t as usize][1] as usize];
        assert!(n.dot(out) > 0.0 && n.is_normalized(), "{n} {out}");
    }
    let Quadric::Sphere { center, radius, .. } = g.quadrics[0] else {
        panic!()
    };
    assert_eq!((center + origin, radius), (Vec3::X * 11.0, 1.0));
    assert_eq!(g.prim_shape.len(), g.prim_count());
    assert_eq!(g.prim_light.len(), g.prim_count());
    assert_eq!(s.sources.shapes.len(), g.shapes.len());
    assert!(s.sources.objects.is_empty());
}

/// One place costs less than one copy and one instance.
#[test]
fn an_object_in_one_place_is_a_part_of_the_world() {
    let s = world(&format!(
        "ObjectBegin \"o\"\n{TRIANGLE}\nObjectEnd\nObjectBegin \"never\"\n{TRIANGLE}\nObjectEnd\n\
         Translate 0 0 4\nObjectInstance \"o\""
    ));
    let g = &s.geometry;
    assert_eq!((g.triangles.len(), g.objects.len()), (1, 0));
    assert_eq!(g.corners(0)[0] + s.origin.as_vec3(), Vec3::Z * 4.0);
}

/// A transform that f32 cannot invert to any digit is carried out instead.
#[test]
fn a_map_too_skewed_to_carry_rays_is_carried_out() {
    let s = world(&format!(
        "ObjectBegin \"o\"\n{TRIANGLE}\nObjectEnd\n\
         ObjectInstance \"o\"\nObjectInstance \"o\"\n\
         Transform [1 0 0 0  1 1e-7 0 0  0 0 1 0  0 0 0 1]\nObjectInstance \"o\""
    ));
    let g = &s.geometry;
    assert_eq!((g.triangles.len(), g.instances.len()), (1, 2));
}

#[test]
fn nothing_is_instanced_that_cannot_be_seen() {
    let s = world(&format!(
        "ObjectBegin \"o\"\n{TRIANGLE} \"float alpha\" 0\nObjectEnd\nObjectInstance \"o\"\nObjectInstance \"o\"\n{TRIANGLE}"
    ));
    assert_eq!(
        (s.geometry.objects.len(), s.geometry.instances.len()),
        (0, 0)
    );
}

/// A crowd a hundred thousand units away is the same crowd, to the last bit of its own size; and so is an object whose
/// own space is that far away.
#[test]
fn far_away() {
    let camera = |m: &str| format!("{m} Camera \"perspective\" WorldBegin ");
    let body = |inside: &str, before: &str, after: &str| {
        let turn = "Translate 0.5 0.25 1 Rotate 40 1 2 3";
        format!(
            "AttributeBegin ObjectBegin \"o\" {inside} Scale 0.25 0.25 0.25\n{TRIANGLE}\nObjectEnd AttributeEnd\n\
             AttributeBegin {before} {turn} {after} ObjectInstance \"o\" AttributeEnd\n\
             {before} {after} ObjectInstance \"o\" ObjectInstance \"o\""
        )
    };
    let (to, fro) = (
        "Translate 131072 -262144 65536 ",
        "Translate -131072 262144 -65536 ",
    );
    let near = load(&(camera("") + &body("", "", ""))).unwrap();
    let there = load(&(camera(fro) + &body("", to, ""))).unwrap();
    let inside = load(&(camera("") + &body(to, "", fro))).unwrap();
    assert_eq!(there.origin, DVec3::new(131072.0, -262144.0, 65536.0));
    for other in [there, inside] {
        let (a, b) = (&near.geometry, &other.geometry);
        assert_eq!(a.objects[0].positions, b.objects[0].positions);
        assert_eq!(a.instances.len(), b.instances.len());
        for (i, j) in a.instances.iter().zip(&b.instances) {
            // 40° and the way there and back are rounded in f64.
            let off = (i.translation - j.translation).abs().max_element();
            assert!(i.linear == j.linear && off < 1e-7, "{i:?} {j:?}");
        }
    }
}

/// pbrt's default coordinates belong to the corners in the file's order, also in a mirrored copy.
#[test]
fn default_coordinates_survive_a_mirror() {
    let mut s = world(&format!(
        "Texture \"t\" \"spectrum\" \"checkerboard\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n\
         ObjectBegin \"o\"\n{TRIANGLE}\nObjectEnd\nObjectInstance \"o\"\nScale -1 1 1 ObjectInstance \"o\""
    ));
    flatten(&mut s, |_| true);
    let g = &s.geometry;
    assert!(normal(g, 0).z > 0.0 && normal(g, 1).z > 0.0);
    let origin = s.origin.as_vec3();
    for i in g.triangles[1] {
        let p = (g.positions[i as usize] + origin).truncate();
        let uv = match p.to_array() {
            [0., 0.] => Vec2::ZERO,
            [-1., 0.] => Vec2::X,
            _ => Vec2::ONE,
        };
        assert_eq!(g.uvs[i as usize], uv, "{p}");
    }
}

#[test]
fn the_hash_sees_objects_and_their_places() {
    let text = |corner: &str, place: &str| {
        format!(
            "ObjectBegin \"o\"\nShape \"trianglemesh\" \"point3 P\" [{corner} 1 0 0 0 1 0]\nObjectEnd\n\
             ObjectInstance \"o\" Translate {place} ObjectInstance \"o\""
        )
    };
    let hash = |corner, place| world(&text(corner, place)).hash;
    let one = hash("0 0 0", "0 0 1");
    assert_eq!(one, hash("0 0 0", "0 0 1"));
    assert_ne!(one, hash("0 0 1e-6", "0 0 1"));
    assert_ne!(one, hash("0 0 0", "0 0 1.0000002"));
}

#[test]
fn lamps_of_the_world_keep_their_primitives() {
    let mut s = world(&format!(
        "ObjectBegin \"o\"\n{TRIANGLE}\nShape \"disk\"\nObjectEnd\n\
         AttributeBegin AreaLightSource \"diffuse\" Shape \"sphere\" {TRIANGLE} AttributeEnd\n\
         ObjectInstance \"o\" Translate 0 0 3 ObjectInstance \"o\""
    ));
    let area = |s: &Scene| {
        let lamps = s.lights.iter().enumerate().map(|(i, l)| match l {
            metrolux::scene::Light::Area { prim, .. } => {
                assert_eq!(s.geometry.prim_light[*prim as usize], i as u32);
                s.geometry.area(*prim)
            }
            other => panic!("{other:?}"),
        });
        lamps.collect::<Vec<_>>()
    };
    let before = area(&s);
    assert_eq!((s.geometry.prim_count(), before.len()), (2, 2));
    let mut behind = s.clone();
    flatten(&mut s, |_| true);
    assert_eq!(
        (s.geometry.triangles.len(), s.geometry.quadrics.len()),
        (3, 3)
    );
    assert_eq!(area(&s), before);

    // And behind an instance goes what does not emit.
    flatten(&mut behind, |_| true);
    metrolux::scene::flatten::put_behind(&mut behind);
    let g = &behind.geometry;
    assert_eq!((g.prim_count(), g.instances.len()), (2, 1));
    assert_eq!(
        (g.objects[0].triangles.len(), g.objects[0].quadrics.len()),
        (2, 2)
    );
    assert_eq!(area(&behind), before);
    flatten(&mut behind, |_| true);
    assert_eq!(area(&behind), before);
    assert_eq!(behind.geometry.prim_count(), 6);
}
