//! What a study's images are held against.

use super::decompose::{Truth, average};
use super::metrics::luminance;
use crate::output::Image;
use std::path::Path;

/// The image taken for the truth, and what is known of its own noise.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The image.
    pub image: Image,
    /// Its luminance, in independent parts if it was rendered in parts.
    pub truth: Truth,
    /// Where it comes from, for a person.
    pub origin: String,
    /// Arguments of `metrolux render` for each of its parts.
    pub commands: Vec<Vec<String>>,
}

/// Luminance of each pixel.
pub fn luminances(image: &Image) -> Vec<f64> {
    image.rgb.iter().map(|p| luminance(*p)).collect()
}

impl Reference {
    /// The mean of independent images of equal work and equal size.
    pub fn of_parts(parts: &[Image], origin: String, commands: Vec<Vec<String>>) -> Self {
        let n = parts.len() as f32;
        let pixel =
            |i: usize| std::array::from_fn(|c| parts.iter().map(|p| p.rgb[i][c]).sum::<f32>() / n);
        let image = Image {
            rgb: (0..parts[0].rgb.len()).map(pixel).collect(),
            ..parts[0]
        };
        let truth = Truth {
            parts: parts.iter().map(luminances).collect(),
            variance: 0.0,
        };
        Self {
            image,
            truth,
            origin,
            commands,
        }
    }

    /// An image from elsewhere; `errors` are the standard errors of its pixels if it states them.
    pub fn of_file(image: Image, errors: Option<&[f32]>, path: &Path) -> Self {
        let square =
            |e: &[f32]| e.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / e.len() as f64;
        let truth = Truth {
            parts: vec![luminances(&image)],
            variance: errors.map_or(0.0, square),
        };
        let known = if errors.is_some() {
            "its own statement"
        } else {
            "not stated; taken for exact"
        };
        let origin = format!("{}; its noise: {known}", path.display());
        Self {
            image,
            truth,
            origin,
            commands: Vec::new(),
        }
    }

    /// Relative error of the reference, as far as it is known.
    pub fn noise(&self) -> f64 {
        self.truth.noise().max(0.0).sqrt() / average(&self.truth.luminance())
    }
}

/// Channel `error` of an EXR file with as many pixels as asked for.
pub fn stated_errors(path: &Path, pixels: usize) -> Option<Vec<f32>> {
    let file = exr::prelude::read_all_flat_layers_from_file(path).ok()?;
    let channels = &file.layer_data.first()?.channel_data.list;
    let channel = channels.iter().find(|c| c.name == *"error")?;
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    (values.len() == pixels && values.iter().all(|v| v.is_finite())).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Layers, Metadata, write_exr};

    #[test]
    fn parts_tell_their_noise_and_files_state_it() {
        let flat = |v: f32| Image {
            width: 2,
            height: 1,
            rgb: vec![[v; 3]; 2],
        };
        let parts = [0.9, 1.1, 1.0, 1.0].map(flat);
        let r = Reference::of_parts(&parts, String::new(), Vec::new());
        assert!((r.image.rgb[1][2] - 1.0).abs() < 1e-6);
        // Variance of a part 0.02/3, of their mean a quarter of that.
        assert!(
            (r.noise() - (0.02f64 / 12.0).sqrt()).abs() < 1e-6,
            "{}",
            r.noise()
        );

        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("r.exr");
        let layers = Layers {
            error: Some(&[0.3, 0.4]),
            ..Layers::default()
        };
        write_exr(&path, &flat(2.0), &Metadata::default(), layers).expect("written");
        let errors = stated_errors(&path, 2).expect("a channel");
        let r = Reference::of_file(flat(2.0), Some(&errors), &path);
        assert!((r.noise() - 0.125f64.sqrt() / 2.0).abs() < 1e-6);
        assert!(stated_errors(&path, 3).is_none());
        write_exr(&path, &flat(2.0), &Metadata::default(), Layers::default()).expect("written");
        assert!(stated_errors(&path, 2).is_none());
        assert_eq!(Reference::of_file(flat(2.0), None, &path).noise(), 0.0);
    }
}
