//! Camera and film conventions.

use crate::load;
use glam::Vec3;
use metrolux::scene::Scene;

fn camera(prelude: &str) -> Scene {
    load(&format!("{prelude}\nWorldBegin")).unwrap_or_else(|e| panic!("{e}"))
}

fn close(a: Vec3, b: [f32; 3]) {
    // A handful of f32 roundings of numbers of size 10.
    assert!((a - Vec3::from(b)).length() < 1e-5, "{a} {b:?}");
}

/// The field of view is of the shorter side, whichever it is.
#[test]
fn field_of_view() {
    let half = 20f32.to_radians().tan();
    for (w, h, x, y) in [(400, 200, 2.0, 1.0), (200, 400, 1.0, 2.0)] {
        let film = format!(r#"Film "rgb" "integer xresolution" {w} "integer yresolution" {h}"#);
        let s = camera(&format!("{film}\nCamera \"perspective\" \"float fov\" 40"));
        let want = [-x * half, x * half, -y * half, y * half];
        for (a, b) in s.camera.screen.iter().zip(want) {
            assert!((a - b).abs() < 1e-6, "{:?}", s.camera.screen);
        }
    }
}

/// LookAt makes x the cross product of up and forward.
#[test]
fn look_at() {
    let s = camera("LookAt 1 2 3  1 2 8  0 1 0\nCamera \"perspective\"");
    close(s.camera.position, [1.0, 2.0, 3.0]);
    close(s.camera.axes.x_axis, [1.0, 0.0, 0.0]);
    close(s.camera.axes.y_axis, [0.0, 1.0, 0.0]);
    close(s.camera.axes.z_axis, [0.0, 0.0, 1.0]);
}

/// `Transform` before the camera is world → camera, written column by column, and may mirror.
#[test]
fn transform_is_world_to_camera() {
    let s = camera("Transform [1 0 0 0  0 1 0 0  0 0 -1 0  0 -1 6.8 1]\nCamera \"perspective\"");
    close(s.camera.position, [0.0, 1.0, 6.8]);
    close(s.camera.axes.x_axis, [1.0, 0.0, 0.0]);
    close(s.camera.axes.z_axis, [0.0, 0.0, -1.0]);
    assert!(s.camera.axes.determinant() < 0.0);
}

/// A scaled camera space sees the same image through a lens scaled with it: the ray through z = 1 goes through
/// (x·s, y·s, s), and the lens and the plane in focus are s times as large in the world.
#[test]
fn scale_goes_into_window_and_lens() {
    let s = camera(
        "Scale 0.5 0.5 0.5\nCamera \"perspective\" \"float lensradius\" 0.1 \"float focaldistance\" 3",
    );
    assert!((s.camera.axes.determinant() - 1.0).abs() < 1e-6);
    assert!((s.camera.lens_radius - 0.2).abs() < 1e-6);
    assert!((s.camera.focal_distance - 6.0).abs() < 1e-5);
    assert!((s.camera.screen[3] - 1.0).abs() < 1e-6);
    let s = camera("Scale 0.5 1 1\nCamera \"perspective\"");
    // 1280 × 720: x_max is 16/9, here of a camera space twice as wide.
    assert!((s.camera.screen[1] - 2.0 * 16.0 / 9.0).abs() < 1e-5);
}

/// A density on a lens of 10⁻¹⁸ would overflow, and nobody could tell its picture from a pinhole's.
#[test]
fn a_lens_without_size_is_a_pinhole() {
    let with = |radius: &str| {
        load(&format!(
            "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\" \"float lensradius\" {radius}\nWorldBegin\n\
             LightSource \"point\"\nShape \"sphere\""
        ))
        .unwrap()
    };
    let s = with("1e-18");
    assert_eq!(s.camera.lens_radius, 0.0);
    assert_eq!(
        s.warnings,
        ["<text>:2:1: a lens of radius 1e-18 is as good as none"]
    );
    assert_eq!(with("1e-9").camera.lens_radius, 1e-9);
}

#[test]
fn film() {
    let s = camera(
        r#"Film "rgb" "integer xresolution" 100 "integer yresolution" 50
           "float cropwindow" [0.1 0.5 0.25 1] "float iso" 200
        Camera "perspective" "float shutterclose" 0.25"#,
    );
    assert_eq!(s.camera.crop, [10, 13, 50, 50]);
    assert_eq!(s.settings.film_scale, 0.5);
    let s = camera(r#"Film "rgb" "integer pixelbounds" [5 10 -3 7]"#);
    assert_eq!(s.camera.resolution, [1280, 720]);
    assert_eq!(s.camera.crop, [5, 0, 10, 7]);
}

/// The world begins at the identity again; "camera" leads back to the camera.
#[test]
fn named_spaces() {
    let s = load(
        "Translate 0 0 5\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n\
         CoordSysTransform \"camera\"\nLightSource \"point\"",
    )
    .unwrap();
    let at = |i: usize| match s.lights[i] {
        metrolux::scene::Light::Point { position, .. } => position,
        _ => panic!(),
    };
    close(at(0), [0.0, 0.0, 0.0]);
    close(at(1), [0.0, 0.0, -5.0]);
    close(s.camera.position, [0.0, 0.0, -5.0]);
}
