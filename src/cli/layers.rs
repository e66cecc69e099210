//! Layers of an EXR file for compositing: parts of the light, and what the camera sees first.

use super::CliError;
use super::render_args::{DirectArg, MltArg, RenderArgs};
use crate::integrator::FirstHit;
use crate::output::{Channel, Image};
use clap::ValueEnum;

/// A layer beside the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayerArg {
    /// Part of white light from everywhere that is sent to the camera
    Albedo,
    /// Shading normal in world space
    Normal,
    /// Distance along the camera's axis
    Depth,
    /// What is seen of emitters, and light scattered once
    Direct,
    /// All other light
    Indirect,
}

impl LayerArg {
    /// It is of what camera rays hit first.
    pub fn is_of_first_hit(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::Depth)
    }

    /// It is a part of the light.
    pub fn is_of_transport(self) -> bool {
        !self.is_of_first_hit()
    }
}

/// Refuses layers that a render cannot have.
///
/// # Errors
/// Which, and why.
pub fn check(args: &RenderArgs, is_mlt: bool, exr: bool) -> Result<(), CliError> {
    let usage = |m: &str| Err(CliError::Usage(m.into()));
    if args.layers.is_empty() {
        return Ok(());
    }
    if args.shard.is_some() {
        return usage(
            "--layers are not kept in parts: found --shard; they need a render of the whole",
        );
    }
    if !exr {
        return usage("--layers need an EXR file: found only PNG, expected -o OUT.exr");
    }
    if args.layers.iter().any(|l| l.is_of_transport()) {
        if !is_mlt {
            return usage(
                "--layers direct and indirect are for --integrator mlt, which computes direct light by a pass of its own; \
                 pt and bdpt do not tell the two apart",
            );
        }
        if args.direct == DirectArg::Chain || args.mlt == MltArg::Relative {
            return usage(
                "--layers direct and indirect: the chain computes both with --direct chain and with --mlt relative; expected --direct separate",
            );
        }
    }
    Ok(())
}

/// The layers that are wanted, with those that are there before the render.
#[derive(Default)]
pub struct Separation {
    before: Vec<Channel>,
    direct: bool,
    indirect: bool,
}

impl Separation {
    /// Of these layers; what camera rays hit first is made before the render.
    pub fn new(wanted: &[LayerArg], hit: Option<&FirstHit>) -> Self {
        let has = |l: LayerArg| wanted.contains(&l);
        let mut before = Vec::new();
        if let Some(hit) = hit {
            if has(LayerArg::Albedo) {
                before.extend(three("albedo", ["R", "G", "B"], &hit.albedo));
            }
            if has(LayerArg::Normal) {
                before.extend(three("normal", ["X", "Y", "Z"], &hit.normal));
            }
            if has(LayerArg::Depth) {
                let (name, values) = ("depth.Z".into(), hit.depth.clone());
                before.push(Channel { name, values });
            }
        }
        Self {
            before,
            direct: has(LayerArg::Direct),
            indirect: has(LayerArg::Indirect),
        }
    }

    /// All channels for an image of which a part is direct light; XYZ, to be multiplied by `scale`.
    pub fn channels(
        &self,
        image: &[[f64; 3]],
        direct: Option<&[[f64; 3]]>,
        scale: f64,
    ) -> Vec<Channel> {
        let mut all = self.before.clone();
        let none = [0.0; 3];
        let direct = |i: usize| direct.map_or(&none, |d| &d[i]);
        let rgb = |part: &dyn Fn(usize) -> [f64; 3]| {
            let xyz: Vec<[f64; 3]> = (0..image.len()).map(part).collect();
            Image::from_xyz(image.len(), 1, &xyz).rgb
        };
        if self.direct {
            let light = rgb(&|i| direct(i).map(|v| v * scale));
            all.extend(three("direct", ["R", "G", "B"], &light));
        }
        if self.indirect {
            let light = rgb(&|i| std::array::from_fn(|c| (image[i][c] - direct(i)[c]) * scale));
            all.extend(three("indirect", ["R", "G", "B"], &light));
        }
        all
    }
}

/// A layer of three channels.
fn three(layer: &str, names: [&str; 3], values: &[[f32; 3]]) -> [Channel; 3] {
    [0, 1, 2].map(|c| Channel {
        name: format!("{layer}.{}", names[c]),
        values: values.iter().map(|v| v[c]).collect(),
    })
}
