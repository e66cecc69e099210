//! Public scenes beside the checkout load with the expected contents. Skipped, with a line that says so, where
//! they are absent.

use metrolux::scene::load::{LoadOptions, load_scene};
use metrolux::scene::{FilterKind, IntegratorKind, Light, Scene};
use std::path::{Path, PathBuf};

fn shared(scene: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found = ["../shared/scenes", "../../shared/scenes"]
        .iter()
        .map(|s| root.join(s).join(scene))
        .find(|p| p.exists());
    if found.is_none() {
        println!("skipped: ../shared/scenes/{scene} is not there");
    }
    found
}

fn load(scene: &str, lenient: bool) -> Option<Scene> {
    let path = shared(scene)?;
    match load_scene(
        &path,
        &LoadOptions {
            lenient,
            ..LoadOptions::default()
        },
    ) {
        Ok(s) => Some(s),
        Err(e) => panic!("{e}"),
    }
}

/// Triangles, quadrics, area lights, other lights.
fn counts(s: &Scene) -> [usize; 4] {
    let is_area = |l: &&Light| matches!(l, Light::Area { .. });
    let area = s.lights.iter().filter(is_area).count();
    [
        s.geometry.triangles.len(),
        s.geometry.quadrics.len(),
        area,
        s.lights.len() - area,
    ]
}

/// Triangles the warning says were left out.
fn left_out(s: &Scene) -> usize {
    let of = |w: &String| {
        w.strip_suffix(" triangles without area are left out")?
            .rsplit(' ')
            .next()?
            .parse::<usize>()
            .ok()
    };
    s.warnings.iter().find_map(of).unwrap_or(0)
}

fn check(scene: &str, lenient: bool, [triangles, rest @ ..]: [usize; 4]) {
    let Some(s) = load(scene, lenient) else {
        return;
    };
    let got = counts(&s);
    assert_eq!(got[0] + left_out(&s), triangles, "{scene}: triangles");
    assert_eq!(
        got[1..],
        rest,
        "{scene}: quadrics, area lights, other lights"
    );
    assert_eq!(s.sources.lights.len(), s.lights.len());
    assert_eq!(s.sources.materials.len(), s.materials.len());
    assert_eq!(s.sources.shapes.len(), s.geometry.shapes.len());
    // Every light's primitive knows its light.
    for (i, l) in s.lights.iter().enumerate() {
        if let Light::Area { prim, .. } = l {
            assert_eq!(s.geometry.prim_light[*prim as usize], i as u32);
        }
    }
}

#[test]
fn veach_ajar() {
    // Three teapots (body, lid) and the small meshes, by the PLY headers; a lamp of two triangles.
    let triangles = 3 * (78_176 + 47_872) + 2 + 2 + 12 * 7 + 44 + 2 * 372 + 620 + 104 + 2944 + 2;
    for (file, depth) in [("veach-ajar-tiles.pbrt", 65), ("veach-ajar.pbrt", 20)] {
        let scene = format!("veach-ajar/{file}");
        check(&scene, false, [triangles, 0, 2, 0]);
        let Some(s) = load(&scene, false) else { return };
        assert_eq!(s.settings.integrator, Some(IntegratorKind::Mlt));
        assert_eq!(s.settings.max_depth, depth);
        assert_eq!(s.settings.spp, Some(64));
        assert!(matches!(
            s.settings.filter.kind,
            FilterKind::Mitchell { .. }
        ));
        assert_eq!(s.settings.filter.radius, [1.0, 1.0]);
        assert_eq!(s.camera.resolution, [1280, 720]);
        assert_eq!(s.images.len(), 3);
    }
}

#[test]
fn cornell_box_and_its_variants() {
    check("cornell-box/cornell-box-v4.pbrt", false, [36, 0, 2, 0]);
    check(
        "cornell-box-variants/cornell-box.pbrt",
        false,
        [32, 0, 2, 0],
    );
    check(
        "cornell-box-variants/cornell-box-silver.pbrt",
        false,
        [32, 0, 2, 0],
    );
    check(
        "cornell-box-variants/cornell-box-specular.pbrt",
        false,
        [22, 1, 2, 0],
    );
    check("cornell-box-variants/smallpt.pbrt", false, [10, 3, 1, 0]);
    check(
        "cornell-box-variants/cornell-box-volume.pbrt",
        true,
        [32, 0, 2, 0],
    );
}

#[test]
fn veach_bidir_mis_and_torus() {
    check("veach-bidir/veach-bidir-v4.pbrt", false, [11_544, 0, 4, 0]);
    check("veach-mis/veach-mis-v4.pbrt", false, [52, 3, 3, 0]);
    check("torus/torus-v4.pbrt", false, [23_614, 0, 0, 1]);
}

/// Five disks; eight rectangular lamps; media only with `lenient`.
#[test]
fn staircase2() {
    check("staircase2/staircase2.pbrt", true, [30_927, 5, 21, 0]);
    if let Some(path) = shared("staircase2/staircase2.pbrt") {
        let e = load_scene(&path, &LoadOptions::default()).unwrap_err();
        assert!(
            e.to_string()
                .ends_with("staircase2.pbrt:28:1: participating media are not supported (found MakeNamedMedium)"),
            "{e}"
        );
    }
}

#[test]
fn caustic_glass() {
    check(
        "caustic-glass/caustic-glass-v4.pbrt",
        false,
        [88_066, 0, 0, 1],
    );
    let Some(s) = load("caustic-glass/caustic-glass-v4.pbrt", false) else {
        return;
    };
    assert_eq!(s.settings.film_scale, 1.5);
    assert_eq!(s.settings.integrator, Some(IntegratorKind::Bdpt));
    let Light::Spot {
        cos_start, cos_end, ..
    } = s.lights[0]
    else {
        panic!("{:?}", s.lights[0])
    };
    assert!((cos_end - 30f32.to_radians().cos()).abs() < 1e-6);
    assert!((cos_start - 25f32.to_radians().cos()).abs() < 1e-6);
}

/// Measured gold by file, Loop subdivision, an image texture scaled, a light in camera space.
#[test]
fn killeroos() {
    check("killeroos/killeroo-simple.pbrt", false, [66_532, 1, 1, 0]);
    check("killeroos/killeroo-gold.pbrt", false, [532_230, 1, 1, 1]);
    check("killeroos/killeroo-moving.pbrt", true, [66_532, 1, 1, 0]);
}
