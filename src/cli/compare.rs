//! `metrolux compare`: how far an image is from a reference.

use super::distinct::{each, refuse_shared};
use super::engine::is_png;
use crate::output::{Image, ImageError, Window, png_bytes, read_windowed, write_atomic};
use crate::study::metrics::{self, Comparison};
use std::io::Write;
use std::path::PathBuf;

/// Compare an image with a reference.
///
/// Prints the ratio of means by channel, relMSE, RMSE, the relative l1, l2 and l∞ errors in luminance (Veach and Guibas
/// 1997) and MAPE. Reads EXR, PNG, HDR and other common formats; 8-bit formats are taken as sRGB. A reference whose size
/// is a whole multiple of the image's is averaged down; a cropped image is compared with its part of the reference.
#[derive(clap::Args, Clone, Debug)]
pub struct CompareArgs {
    /// The image to judge.
    pub image: PathBuf,
    /// What it should look like.
    pub reference: PathBuf,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    pub json: bool,
    /// Exit with 1 if relMSE is above this, or a pixel is not finite.
    #[arg(long, value_name = "X", value_parser = super::parse::finite)]
    pub max_relmse: Option<f64>,
    /// Write a false-colour image: red where the image is brighter, blue where darker, full at a factor of two.
    #[arg(long, value_name = "FILE.png")]
    pub diff: Option<PathBuf>,
    /// Average both over blocks of B × B pixels first: noise shrinks, a bias stays.
    #[arg(long, value_name = "B", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub block: u32,
}

/// Why a comparison did not come about.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// An image could not be read or the difference not written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The two do not cover the same picture.
    #[error(
        "the image is {}×{} of {}×{} at {},{}; the reference is {}×{} of {}×{} at {},{}: expected the same full size or a whole multiple of it, covering the image",
        .image[0], .image[1], .image_window.full[0], .image_window.full[1], .image_window.origin[0],
        .image_window.origin[1], .reference[0], .reference[1], .reference_window.full[0],
        .reference_window.full[1], .reference_window.origin[0], .reference_window.origin[1]
    )]
    Sizes {
        /// Size of the image.
        image: [usize; 2],
        /// Its place.
        image_window: Window,
        /// Size of the reference.
        reference: [usize; 2],
        /// Its place.
        reference_window: Window,
    },
    /// Files that do not go together.
    #[error("{0}")]
    Usage(String),
    /// The report could not be printed.
    #[error("cannot print the comparison: {0}")]
    Print(#[from] std::io::Error),
}

impl CompareError {
    /// The process exit code this leads to.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Image(e) => e.exit_code(),
            Self::Sizes { .. } | Self::Usage(_) => 2,
            Self::Print(_) => 4,
        }
    }
}

/// Compares, prints to `out` and returns the exit code: 0, or 1 if `--max-relmse` is exceeded.
pub fn run(args: &CompareArgs, out: &mut dyn Write) -> Result<u8, CompareError> {
    if let Some(file) = &args.diff {
        check_difference(args, file).map_err(CompareError::Usage)?;
    }
    let (image, image_window) = read_windowed(&args.image)?;
    let (reference, reference_window) = read_windowed(&args.reference)?;
    let reference = fit(
        [image.width, image.height],
        image_window,
        &reference,
        reference_window,
    )?;
    let block = args.block as usize;
    let (image, reference) = (
        metrics::blocks(&image, block),
        metrics::blocks(&reference, block),
    );
    let result = metrics::compare(&image, &reference).expect("sizes were made to fit");
    if let Some(path) = &args.diff {
        let bytes: Vec<u8> = image
            .rgb
            .iter()
            .zip(&reference.rgb)
            .flat_map(|(x, r)| metrics::false_colour(metrics::signed_difference(*x, *r)))
            .collect();
        write_atomic(path, &png_bytes(image.width, image.height, &bytes))?;
    }
    if args.json {
        let line = serde_json::to_string(&result).expect("plain numbers");
        writeln!(out, "{line}")?;
    } else {
        print(&result, out)?;
    }
    let exceeded = args.max_relmse.is_some_and(|limit| {
        result.non_finite > 0 || result.rel_mse.is_nan() || result.rel_mse > limit
    });
    Ok(u8::from(exceeded))
}

/// The difference is a picture for the eye, and no place for it is where the images are.
fn check_difference(args: &CompareArgs, file: &PathBuf) -> Result<(), String> {
    if !is_png(file) {
        let file = file.display();
        return Err(format!("cannot write {file}: expected --diff FILE.png"));
    }
    let written = each("--diff", [file]).collect();
    let read = each("an image to compare", [&args.image, &args.reference]);
    refuse_shared(&written, &read.collect()).map_err(|e| e.to_string())
}

/// The part of the reference that an image of this size and place shows, averaged down to its size.
///
/// # Errors
/// A reference that does not cover the image.
pub fn fit(
    size: [usize; 2],
    at: Window,
    reference: &Image,
    ref_at: Window,
) -> Result<Image, CompareError> {
    part_of(size, at, reference, ref_at).ok_or(CompareError::Sizes {
        image: size,
        image_window: at,
        reference: [reference.width, reference.height],
        reference_window: ref_at,
    })
}

fn part_of(size: [usize; 2], at: Window, reference: &Image, ref_at: Window) -> Option<Image> {
    let k = ref_at.full[0] / at.full[0].max(1);
    if k == 0 || ref_at.full != at.full.map(|v| v * k) {
        return None;
    }
    let corner: [Option<usize>; 2] = std::array::from_fn(|i| {
        let c = at.origin[i] as i64 * k as i64 - ref_at.origin[i] as i64;
        usize::try_from(c).ok()
    });
    let part = reference.cut(corner[0]?, corner[1]?, size[0] * k, size[1] * k)?;
    Some(metrics::blocks(&part, k))
}

fn print(c: &Comparison, out: &mut dyn Write) -> std::io::Result<()> {
    let [r, g, b] = c.mean_ratio;
    writeln!(out, "mean ratio  {r:.6} {g:.6} {b:.6}")?;
    writeln!(
        out,
        "relMSE      {:.6e}  (epsilon {})",
        c.rel_mse,
        metrics::REL_MSE_EPSILON
    )?;
    writeln!(out, "RMSE        {:.6e}", c.rmse)?;
    writeln!(out, "l1          {:.6e}  (relative, luminance)", c.l1)?;
    writeln!(out, "l2          {:.6e}", c.l2)?;
    writeln!(out, "l_inf       {:.6e}", c.l_inf)?;
    writeln!(
        out,
        "MAPE        {:.6e}  (epsilon {})",
        c.mape,
        metrics::MAPE_EPSILON
    )?;
    writeln!(out, "pixels      {}", c.pixels)?;
    for (n, what) in [
        (
            c.black_reference,
            "black in the reference, not in l1, l2, l_inf",
        ),
        (c.non_finite, "not finite, left out"),
    ] {
        if n > 0 {
            writeln!(out, "            {n} {what}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Layers, Metadata, write_exr};
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: CompareArgs,
    }

    fn ramp(width: usize, height: usize, gain: f32) -> Image {
        Image {
            width,
            height,
            rgb: (0..width * height)
                .map(|i| [gain * (1.0 + (i % width) as f32); 3])
                .collect(),
        }
    }

    fn call(list: &[&str]) -> (u8, String) {
        let cli = Cli::try_parse_from(std::iter::once("compare").chain(list.iter().copied()));
        let mut out = Vec::new();
        let code = match run(&cli.unwrap().args, &mut out) {
            Ok(code) => code,
            Err(e) => e.exit_code(),
        };
        (code, String::from_utf8(out).unwrap())
    }

    #[test]
    fn limits_json_difference_and_exit_codes() {
        let dir = tempfile::tempdir().unwrap();
        let path = |n: &str| dir.path().join(n).to_str().unwrap().to_owned();
        let (a, b, d) = (path("a.exr"), path("b.exr"), path("d.png"));
        write_exr(
            a.as_ref(),
            &ramp(8, 4, 1.1),
            &Metadata::default(),
            Layers::default(),
        )
        .unwrap();
        write_exr(
            b.as_ref(),
            &ramp(8, 4, 1.0),
            &Metadata::default(),
            Layers::default(),
        )
        .unwrap();
        let (code, text) = call(&[&a, &b, "--json", "--diff", &d, "--max-relmse", "0.02"]);
        assert_eq!(code, 0);
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!((json["mean_ratio"][0].as_f64().unwrap() - 1.1).abs() < 1e-6);
        assert!((json["l_inf"].as_f64().unwrap() - 0.1).abs() < 1e-6);
        assert!(crate::output::read_image(d.as_ref()).unwrap().width == 8);
        // relMSE of 10 % everywhere is just below 0.01.
        assert_eq!(call(&[&a, &b, "--max-relmse", "0.005"]).0, 1);
        assert_eq!(call(&[&a, &path("none.exr")]).0, 2);
        assert_eq!(call(&[&a, &b, "--diff", &path("no/d.png")]).0, 4);
        // What is compared is not written over.
        assert_eq!(call(&[&d, &d, "--diff", &d]).0, 2);
        assert_eq!(call(&[&a, &b, "--diff", &path("d.exr")]).0, 2);
        assert!(!dir.path().join("d.exr").exists());
        assert!(call(&[&a, &b]).1.contains("relMSE"));
    }

    #[test]
    fn larger_references_are_averaged_and_crops_find_their_place() {
        let dir = tempfile::tempdir().unwrap();
        let path = |n: &str| dir.path().join(n).to_str().unwrap().to_owned();
        let (a, b, c) = (path("a.exr"), path("b.exr"), path("c.exr"));
        let big = ramp(12, 6, 1.0);
        write_exr(b.as_ref(), &big, &Metadata::default(), Layers::default()).unwrap();
        let small = metrics::blocks(&big, 3);
        write_exr(a.as_ref(), &small, &Metadata::default(), Layers::default()).unwrap();
        assert_eq!(call(&[&a, &b, "--max-relmse", "0"]).0, 0);
        let crop = Metadata {
            window: Some(Window {
                origin: [1, 1],
                full: [4, 2],
            }),
            ..Metadata::default()
        };
        write_exr(
            c.as_ref(),
            &small.cut(1, 1, 2, 1).unwrap(),
            &crop,
            Layers::default(),
        )
        .unwrap();
        assert_eq!(call(&[&c, &b, "--max-relmse", "0"]).0, 0);
        assert_eq!(call(&[&c, &a, "--max-relmse", "0"]).0, 0);
        // The other way round the reference is the smaller one.
        assert_eq!(call(&[&b, &a]).0, 2);
    }
}
