//! Builds ffi/embree.c and the Rust declarations of ffi/embree.h against the Embree that is installed.

use std::path::{Path, PathBuf};
use std::process::exit;

/// What the Rust side names; everything else of Embree's interface stays out.
const FUNCTIONS: &str = "mlx_.*|rtc(NewDevice|ReleaseDevice|GetDeviceError|GetDeviceProperty\
    |NewScene|ReleaseScene|SetSceneFlags|SetSceneBuildQuality|NewGeometry|ReleaseGeometry\
    |SetSharedGeometryBuffer|SetGeometryBuildQuality|CommitGeometry|AttachGeometryByID)";
/// Types nobody names but whose layout the library writes through: their layout is asserted at compile time.
const TYPES: &str = "mlx_.*|RTC(Ray|Hit|RayHit|Bounds)";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=ffi/embree.h");
    println!("cargo::rerun-if-changed=ffi/embree.c");
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    // EMBREE_DIR is where an Embree outside the system's paths has its include/ and lib/.
    let prefix = std::env::var_os("EMBREE_DIR").map(PathBuf::from);
    let include: Vec<PathBuf> = prefix.iter().map(|p| p.join("include")).collect();

    let (library, header) = find(&include).unwrap_or_else(|| {
        eprintln!(
            "Embree is not installed: neither embree4/rtcore.h nor embree3/rtcore.h was found. \
             Run `sh ffi/install-deps.sh` (Debian: the package libembree-dev), \
             or set EMBREE_DIR to where Embree has its include/ and lib/."
        );
        exit(1)
    });
    // An upgrade of the library changes layouts without touching a file of ours.
    println!("cargo::rerun-if-changed={}", header.display());

    let mut c = cc::Build::new();
    c.file("ffi/embree.c").opt_level(3).warnings(true);
    c.includes(&include).compile("mlx_embree");
    if let Some(p) = &prefix {
        println!(
            "cargo::rustc-link-search=native={}",
            p.join("lib").display()
        );
    }
    println!("cargo::rustc-link-lib={library}");

    let bindings = bindgen::Builder::default()
        .header("ffi/embree.h")
        .clang_args(include.iter().map(|p| format!("-I{}", p.display())))
        .allowlist_function(FUNCTIONS)
        .allowlist_type(TYPES)
        .allowlist_var("MLX_.*")
        .default_enum_style(bindgen::EnumVariation::Consts)
        .prepend_enum_name(false)
        .layout_tests(true)
        .derive_default(true)
        .generate()
        .unwrap_or_else(|e| {
            eprintln!(
                "bindgen could not read ffi/embree.h: {e}. It needs libclang and clang's own headers \
                 (Debian: the package libclang-dev)."
            );
            exit(1)
        });
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    if let Err(e) = bindings.write_to_file(out.join("embree.rs")) {
        eprintln!("cannot write {}: {e}", out.join("embree.rs").display());
        exit(1)
    }
}

/// The library to link and the header it was found by; 4 before 3, as ffi/embree.h chooses.
fn find(include: &[PathBuf]) -> Option<(&'static str, PathBuf)> {
    let mut places = include.to_vec();
    places.extend(["/usr/local/include", "/usr/include"].map(PathBuf::from));
    ["embree4", "embree3"].into_iter().find_map(|library| {
        places
            .iter()
            .map(|p| p.join(library).join("rtcore.h"))
            .find(|h| Path::exists(h))
            .map(|h| (library, h))
    })
}
