//! From sums to a picture with its report: the last step of every render, and of every look at one on the way.

use super::engine::Rendered;
use super::job::Job;
use super::layers::Separation;
use super::render_args::RenderArgs;
use super::report::Report;
use crate::chain::{MltOptions, Shares};
use crate::film::{Bins, PixelErrors};
use crate::integrator::Outcome;
use crate::output::{Image, SpectralBins};
use crate::path::Tally;
use crate::real::Convert;
use crate::scene::Scene;
use crate::scene::spectrum::Target;
use crate::study::process::{peak_bytes, processor_seconds};
use std::time::Instant;

/// All that a picture needs besides its sums.
pub struct Lab {
    /// What is known before the first ray.
    pub report: Report,
    /// Shares of the mutation strategies.
    pub shares: Shares,
    /// What the chains' target is made of.
    pub target: Target,
    /// Spectral bins.
    pub bins: Option<Bins>,
    /// What these hold where the scene has no colour.
    pub grey: Option<GreyBins>,
    /// Error that was asked for.
    pub target_error: Option<f64>,
    /// Layers beside the image.
    pub layers: Separation,
    /// Factor on the image.
    pub scale: f64,
    /// When the work began, and the processor time used until then.
    pub begun: (Instant, f64),
}

impl Lab {
    /// For a render that began `begun`.
    pub fn new(
        args: &RenderArgs,
        job: &Job,
        scene: &Scene,
        options: &MltOptions,
        report: Report,
        begun: (Instant, f64),
    ) -> Self {
        Self {
            report,
            shares: options.shares,
            target: job.target,
            bins: job.bins,
            grey: GreyBins::of(job),
            target_error: args.target_error,
            layers: Separation::default(),
            scale: scene.settings.film_scale as f64,
            begun,
        }
    }

    /// The same with layers.
    pub fn with_layers(self, layers: Separation) -> Self {
        Self { layers, ..self }
    }

    /// The picture that the sums make.
    pub fn develop(&self, outcome: Outcome, tally: &Tally) -> Rendered {
        let mut report = self.report.clone();
        let (xyz, direct, spectrum, errors, met) = match outcome {
            Outcome::Sampled(r) => {
                report.samples(r.samples);
                (r.image, None, r.spectrum, r.errors, r.target_met)
            }
            Outcome::Mlt(r) => {
                report.mlt(&r, &self.shares, self.target);
                (r.image, r.direct, r.spectrum, r.errors, r.target_met)
            }
        };
        report.error(errors.summary(&xyz), self.target_error, met);
        let (start, cpu) = self.begun;
        let cpu = processor_seconds() - cpu;
        report.finish(start.elapsed(), cpu, peak_bytes(), tally);
        let channels = self.layers.channels(&xyz, direct.as_deref(), self.scale);
        let rendered = self.picture(&xyz, spectrum, &errors, report);
        Rendered {
            channels,
            ..rendered
        }
    }

    fn picture(
        &self,
        xyz: &[[f64; 3]],
        spectrum: Option<Vec<f64>>,
        errors: &PixelErrors,
        report: Report,
    ) -> Rendered {
        let k = self.scale;
        let [x0, y0, x1, y1] = report.crop();
        let scaled: Vec<[f64; 3]> = xyz.iter().map(|p| p.map(|c| c * k)).collect();
        let image = Image::from_xyz((x1 - x0) as usize, (y1 - y0) as usize, &scaled);
        let spectrum = match &self.grey {
            Some(grey) => Some(grey.spread(xyz)),
            None => spectrum,
        };
        let bins = self.bins.zip(spectrum).map(|(bins, values)| SpectralBins {
            bins,
            values: values.iter().map(|v| (v * k) as f32).collect(),
        });
        Rendered {
            image,
            bins,
            error: errors.standard(k),
            channels: Vec::new(),
            metadata: report.metadata(),
            report,
            unsaved: None,
        }
    }
}

/// Radiance per nm in each bin of a unit of luminance, in an image that has its illuminant's spectrum everywhere.
pub struct GreyBins(pub Vec<f64>);

impl GreyBins {
    /// Of a job that asks for bins on a scene without colour.
    pub fn of(job: &Job) -> Option<Self> {
        let (bins, (illuminant, grey)) = job.bins.zip(job.plan.grey.as_ref())?;
        // Values at the one wavelength, per Y of the film; a bin holds the mean of its nanometres.
        let per_y = 1.0 / (grey.xyz[1] * illuminant.at(grey.lambda)) as f64;
        let mut shape = vec![(0.0f64, 0u32); bins.count];
        for tenth in 0..4700 {
            let l = 360.05 + 0.1 * tenth as f32;
            let (sum, n) = &mut shape[bins.index(l)];
            *sum += illuminant.at(l.real()) as f64;
            *n += 1;
        }
        let shape = shape.iter().map(|(sum, n)| sum / *n as f64 * per_y);
        Some(Self(shape.collect()))
    }

    /// The bins of an image: `[pixel · bins + bin]`.
    fn spread(&self, xyz: &[[f64; 3]]) -> Vec<f64> {
        let pixel = |p: &[f64; 3]| {
            let y = p[1];
            self.0.iter().map(move |s| s * y)
        };
        xyz.iter().flat_map(pixel).collect()
    }
}
