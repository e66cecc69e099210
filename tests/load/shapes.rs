//! Orientation, instances, quadrics, recentring, the scene's hash.

use crate::{TRIANGLE, load, world};
use glam::{DVec3, Vec3};
use metrolux::scene::{Geometry, Light, Quadric, Scene};

/// Geometric normal of a triangle, not normalised.
fn normal(g: &Geometry, prim: u32) -> Vec3 {
    let [a, b, c] = g.corners(prim);
    (b - a).cross(c - a)
}

const WITH_NORMALS: &str =
    r#"Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "normal N" [0 0 -1 0 0 -1 0 0 -1]"#;

/// pbrt-v4: given normals decide the side; else the winding; ReverseOrientation turns either, and a mirror neither,
/// seen from the object.
#[test]
fn orientation() {
    let z = |body: &str| normal(&world(body).geometry, 0).z;
    let mirrored = |body: &str| format!("Scale -1 1 1\n{body}");
    let reversed = |body: &str| format!("ReverseOrientation\n{body}");
    for (shape, sign) in [(TRIANGLE, 1.0), (WITH_NORMALS, -1.0)] {
        assert!(z(shape) * sign > 0.0, "{shape}");
        assert!(z(&reversed(shape)) * sign < 0.0, "{shape} reversed");
        assert!(z(&mirrored(shape)) * sign > 0.0, "{shape} mirrored");
        assert!(z(&mirrored(&reversed(shape))) * sign < 0.0, "{shape} both");
        // Mirrored in z the whole triangle turns over.
        assert!(
            z(&format!("Scale 1 1 -1\n{shape}")) * sign < 0.0,
            "{shape} in z"
        );
    }
}

/// Given normals go with the inverse transpose, and turn under ReverseOrientation.
#[test]
fn normals_are_carried() {
    let shape =
        r#"Shape "trianglemesh" "point3 P" [0 0 0 1 0 1 0 1 0] "normal N" [-1 0 1 -1 0 1 -1 0 1]"#;
    let n = world(&format!("Scale 2 1 1\n{shape}")).geometry.normals[0];
    let want = Vec3::new(-0.5, 0.0, 1.0).normalize();
    assert!((n - want).length() < 1e-6, "{n}");
    let n = world(&format!("ReverseOrientation\nScale 2 1 1\n{shape}"))
        .geometry
        .normals[0];
    assert!((n + want).length() < 1e-6, "{n}");
}

/// The default coordinates (0,0) (1,0) (1,1) stay with the corners they belong to when the winding turns.
#[test]
fn default_coordinates_survive_a_turn() {
    let s = world(&format!(
        "Texture \"c\" \"spectrum\" \"checkerboard\"\n\
         Material \"diffuse\" \"texture reflectance\" \"c\"\nReverseOrientation\n{TRIANGLE}"
    ));
    let g = &s.geometry;
    assert!(g.shapes[0].has_uvs);
    for (p, uv) in [
        ([0., 0.], [0., 0.]),
        ([1., 0.], [1., 0.]),
        ([0., 1.], [1., 1.]),
    ] {
        let i = g.triangles[0]
            .iter()
            .find(|i| g.positions[**i as usize].truncate().to_array() == p);
        assert_eq!(g.uvs[*i.unwrap() as usize].to_array(), uv);
    }
}

#[test]
fn quadrics_are_exact_where_they_can_be() {
    let count = |body: &str| {
        let g = world(body).geometry;
        (g.triangles.len(), g.quadrics.len())
    };
    let exact = [
        "Shape \"sphere\" \"float radius\" 2",
        "Rotate 40 1 2 3\nScale 2 -2 2\nShape \"sphere\"",
        "Shape \"disk\"",
        "Scale 2 2 7\nShape \"disk\" \"float height\" 1",
    ];
    for body in exact {
        assert_eq!(count(body), (0, 1), "{body}");
    }
    let meshed = [
        "Scale 1 1 2\nShape \"sphere\"",
        "Shape \"sphere\" \"float phimax\" 180",
        "Shape \"sphere\" \"float zmin\" 0",
        "Scale 1 2 1\nShape \"disk\"",
        "Shape \"disk\" \"float innerradius\" 0.5",
    ];
    for body in meshed {
        let (t, q) = count(body);
        assert!(t > 1000 && q == 0, "{body}");
    }
    let g = world("Scale 2 2 7\nShape \"disk\" \"float height\" 1").geometry;
    let Quadric::Disk {
        center,
        normal,
        radius,
        tangent,
    } = g.quadrics[0]
    else {
        panic!()
    };
    assert_eq!((normal, radius, tangent), (Vec3::Z, 2.0, Vec3::X));
    assert_eq!(center.truncate(), glam::Vec2::ZERO);
}

/// A stretched sphere has outward normals that stand on the ellipsoid: n ∝ (x/a², y/b², z/c²).
#[test]
fn tessellated_normals() {
    let s = world("Scale 1 1 2\nShape \"sphere\"");
    let g = &s.geometry;
    for (t, tri) in g.triangles.iter().enumerate() {
        let mid: Vec3 = g.corners(t as u32).iter().sum::<Vec3>() / 3.0;
        assert!(normal(g, t as u32).dot(mid) > 0.0);
        let (p, n) = (g.positions[tri[0] as usize], g.normals[tri[0] as usize]);
        let want = Vec3::new(p.x, p.y, p.z / 4.0).normalize();
        assert!((n - want).length() < 1e-5, "{n} {want}");
    }
}

#[test]
fn bilinear_patches() {
    let flat = world(r#"Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0]"#).geometry;
    assert_eq!(flat.triangles.len(), 2);
    assert!(normal(&flat, 0).z > 0.0 && normal(&flat, 1).z > 0.0);
    let g = world(r#"Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1]"#).geometry;
    assert_eq!(g.triangles.len(), 2 * 16 * 16);
    // z = x·y on this patch, and its coordinates are (x, y).
    for (p, uv) in g.positions.iter().zip(&g.uvs) {
        assert!((p.z - p.x * p.y).abs() < 1e-6 && (p.truncate() - *uv).length() < 1e-6);
    }
}

/// One subdivided octahedron: a closed smooth surface around the origin, with normals that point out of it.
#[test]
fn loop_subdivision() {
    let s = world(
        r#"Shape "loopsubdiv" "integer levels" 2
        "point3 P" [1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1]
        "integer indices" [0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5]"#,
    );
    let g = &s.geometry;
    assert_eq!(g.triangles.len(), 8 * 16);
    assert_eq!(
        g.positions.len() - 1,
        4 * 16 + 2,
        "V = F/2 + 2 on a closed surface"
    );
    for (p, n) in g.positions.iter().zip(&g.normals).take(66) {
        assert!((n.length() - 1.0).abs() < 1e-5);
        assert!(p.normalize().dot(*n) > 0.9, "{p} {n}");
    }
    // Limit of a vertex of valence 4 with opposite neighbours: (1 − 4w)·v, w = 1/(4 + 3/(8·3/32)) = 1/8.
    assert!((g.positions[0].x - 0.5).abs() < 1e-6, "{}", g.positions[0]);
}

/// A scene a hundred thousand units away is the same scene, to the last bit of its own size.
#[test]
fn far_away() {
    let body =
        format!("Scale 0.25 0.25 0.25\n{TRIANGLE}\nLightSource \"point\" \"point3 from\" [0 0 3]");
    let camera = |m: &str| format!("{m} Camera \"perspective\" WorldBegin ");
    let near = load(&(camera("") + &body)).unwrap();
    let far = "Translate 131072 -262144 65536 ";
    let there = load(&(camera("Translate -131072 262144 -65536") + far + &body)).unwrap();
    assert_eq!(near.origin, DVec3::ZERO);
    assert_eq!(there.origin, DVec3::new(131072.0, -262144.0, 65536.0));
    assert_eq!(near.geometry.positions, there.geometry.positions);
    assert_eq!(near.camera.position, there.camera.position);
    assert_eq!(near.lights, there.lights);
}

#[test]
fn triangles_without_area_are_left_out() {
    let s = world(
        r#"AreaLightSource "diffuse"
        Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0 2 0 0] "integer indices" [0 1 2  0 1 3  1 1 2]"#,
    );
    assert_eq!((s.geometry.triangles.len(), s.lights.len()), (1, 1));
    assert_eq!(
        s.warnings,
        ["<text>: 2 triangles without area are left out"]
    );
}

/// The hash sees what changes the image and nothing else.
#[test]
fn hash() {
    let base = format!(
        "Material \"diffuse\" \"rgb reflectance\" [.2 .2 .2]\n{TRIANGLE}\nLightSource \"point\""
    );
    let h = |s: Scene| s.hash;
    let one = h(world(&base));
    assert_eq!(
        one,
        h(world(&format!(
            "# a comment\n  {base}\nMakeNamedMaterial \"x\" \"string type\" \"interface\""
        )))
    );
    for (from, to) in [
        ("[.2 .2 .2]", "[.2000001 .2000001 .2000001]"),
        ("0 1 0]", "0 1.0000001 0]"),
        ("\"point\"", "\"point\" \"float scale\" 2"),
    ] {
        assert_ne!(one, h(world(&base.replacen(from, to, 1))), "{to}");
    }
    let with = |p: &str| h(load(&format!("{p}\nWorldBegin\n{base}")).unwrap());
    assert_eq!(one, with("Sampler \"halton\" \"integer pixelsamples\" 3"));
    assert_ne!(one, with("Integrator \"path\" \"integer maxdepth\" 6"));
    assert_ne!(one, with("PixelFilter \"box\""));
}

#[test]
fn invisible_and_interface_shapes_are_left_out() {
    let s = world(&format!(
        "{TRIANGLE} \"float alpha\" 0\n{TRIANGLE} \"float alpha\" 1\nMaterial \"interface\"\n{TRIANGLE}"
    ));
    assert_eq!(s.geometry.triangles.len(), 1);
    let s = world(&format!(
        "AreaLightSource \"diffuse\"\n{TRIANGLE} \"float alpha\" 0"
    ));
    assert!(!s.lights.iter().any(|l| matches!(l, Light::Area { .. })));
    assert!(s.warnings[0].contains("alpha 0"), "{:?}", s.warnings);
}

#[test]
fn attribute_defaults_reach_the_shape() {
    let s = world(
        "Attribute \"shape\" \"float radius\" 3\nShape \"sphere\"\nShape \"disk\" \"float radius\" 2",
    );
    let radius = |q: &Quadric| match q {
        Quadric::Sphere { radius, .. } | Quadric::Disk { radius, .. } => *radius,
    };
    assert_eq!(
        s.geometry.quadrics.iter().map(radius).collect::<Vec<_>>(),
        [3.0, 2.0]
    );
}
