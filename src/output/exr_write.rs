//! EXR out: 32-bit RGB, metadata, standard errors, spectral bins in the layout of Fichet et al. 2021. The same image gives the same bytes.

use super::{Image, ImageError, Window, atomic::write_atomic};
use crate::film::Bins;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, ImageAttributes, IntegerBounds,
    Layer, LayerAttributes, SmallVec, Text, Vec2, WritableImage,
};
use std::io::Cursor;
use std::path::Path;

/// What is written into the header beside the pixels, all as strings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Hash of everything that can change the image; `sceneHash`, 16 hexadecimal digits.
    pub scene_hash: u64,
    /// Random seed; `seed`.
    pub seed: u64,
    /// Mean of the chain's target over path space (thesis eq. 11.6); `b`.
    pub b: Option<f64>,
    /// Standard error of b; `bStandardError`.
    pub b_standard_error: Option<f64>,
    /// Further attributes by name: counters of samples, faults and so on. Names are held to ASCII.
    pub counters: Vec<(String, String)>,
    /// Where the pixels lie, if they are a crop of a larger image.
    pub window: Option<Window>,
}

/// Radiance per nm in equal slices of the spectrum.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralBins {
    /// The slices.
    pub bins: Bins,
    /// `[pixel · bins + bin]`.
    pub values: Vec<f32>,
}

/// What an EXR file may carry beside R, G and B.
#[derive(Clone, Copy, Debug, Default)]
pub struct Layers<'a> {
    /// Spectral bins.
    pub spectral: Option<&'a SpectralBins>,
    /// Standard error of each pixel's luminance Y, in its units; channel `error`.
    pub error: Option<&'a [f32]>,
    /// Further channels.
    pub channels: &'a [Channel],
}

/// A channel of an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name; up to the last dot that of its layer.
    pub name: String,
    /// A value for each pixel.
    pub values: Vec<f32>,
}

/// The channel of emitted radiance at a wavelength: `S0.550,000000nm`, with a comma as the decimal mark.
pub fn spectral_channel_name(nm: f64) -> String {
    format!("S0.{}nm", format!("{nm:.6}").replace('.', ","))
}

/// Writes an EXR file.
pub fn write_exr(
    path: &Path,
    image: &Image,
    metadata: &Metadata,
    layers: Layers,
) -> Result<(), ImageError> {
    write_atomic(path, &encode(image, metadata, layers))
}

fn encode(image: &Image, metadata: &Metadata, layers: Layers) -> Vec<u8> {
    let pixels = image.width * image.height;
    assert!(
        pixels > 0 && image.rgb.len() == pixels,
        "the image has its pixels"
    );
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let samples = image.rgb.iter().map(|p| p[c]).collect();
        channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    }
    if let Some(error) = layers.error {
        assert_eq!(error.len(), pixels, "every pixel has its error");
        let samples = FlatSamples::F32(error.to_vec());
        channels.push(AnyChannel::new("error", samples));
    }
    for c in layers.channels {
        assert_eq!(c.values.len(), pixels, "every pixel has its value");
        let samples = FlatSamples::F32(c.values.clone());
        channels.push(AnyChannel::new(c.name.as_str(), samples));
    }
    if let Some(s) = layers.spectral {
        let n = s.bins.count;
        assert_eq!(s.values.len(), pixels * n, "every pixel has its bins");
        for bin in 0..n {
            let samples = s.values[bin..].iter().step_by(n).copied().collect();
            let name = spectral_channel_name(s.bins.center(bin));
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(samples)));
        }
    }

    let window = metadata
        .window
        .unwrap_or(Window::whole(image.width, image.height));
    let mut attributes = LayerAttributes {
        layer_position: Vec2(window.origin[0], window.origin[1]),
        software_name: Some(text(concat!("metrolux ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in entries(metadata, layers.spectral.is_some()) {
        attributes
            .other
            .insert(text(&name), AttributeValue::Text(text(&value)));
    }
    let encoding = Encoding {
        // The crate may write chunks of other orders as threads finish them.
        line_order: exr::prelude::LineOrder::Increasing,
        ..Encoding::SMALL_LOSSLESS
    };
    let layer = Layer::new(
        (image.width, image.height),
        attributes,
        encoding,
        AnyChannels::sort(channels),
    );
    let mut file = exr::prelude::Image::from_layer(layer);
    file.attributes =
        ImageAttributes::new(IntegerBounds::new((0, 0), (window.full[0], window.full[1])));
    let mut out = Cursor::new(Vec::new());
    file.write()
        .to_buffered(&mut out)
        .expect("encoding a consistent image into memory");
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes);
    bytes
}

fn entries(m: &Metadata, spectral: bool) -> Vec<(String, String)> {
    let mut list = vec![
        ("sceneHash".into(), format!("{:016x}", m.scene_hash)),
        ("seed".into(), m.seed.to_string()),
    ];
    list.extend(m.b.map(|v| ("b".into(), format!("{v:e}"))));
    list.extend(
        m.b_standard_error
            .map(|v| ("bStandardError".into(), format!("{v:e}"))),
    );
    list.extend(m.counters.iter().cloned());
    if spectral {
        list.push(("spectralLayoutVersion".into(), "1.0".into()));
        list.push(("emissiveUnits".into(), "W.m^-2.sr^-1".into()));
    }
    list
}

/// Header text is ASCII; anything else becomes a question mark.
fn text(s: &str) -> Text {
    let ascii: String = s
        .chars()
        .map(|c| if c.is_ascii() && c != '\0' { c } else { '?' })
        .collect();
    Text::from(ascii.as_str())
}

/// Sorts the header's attributes by name: the crate keeps ours in a hash map of random order.
fn sort_attributes(bytes: &mut [u8]) {
    // Magic number and version, then (name \0 type \0 length value)* \0.
    const START: usize = 8;
    let mut blobs: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    while bytes[at] != 0 {
        let begin = at;
        for _ in 0..2 {
            while bytes[at] != 0 {
                at += 1;
            }
            at += 1;
        }
        let length = bytes[at..at + 4].try_into().expect("four bytes");
        at += 4 + u32::from_le_bytes(length) as usize;
        blobs.push(bytes[begin..at].to_vec());
    }
    // A name ends in 0, so comparing whole blobs compares names first.
    blobs.sort();
    bytes[START..at].copy_from_slice(&blobs.concat());
}

#[cfg(test)]
mod tests {
    use super::super::{read_image, read_windowed};
    use super::*;

    fn sample() -> Image {
        Image {
            width: 5,
            height: 3,
            rgb: (0..15)
                .map(|i| [i as f32 * 0.1, -1.0 + i as f32, 1e-20 * i as f32])
                .collect(),
        }
    }

    fn metadata() -> Metadata {
        Metadata {
            scene_hash: 0xABC,
            seed: 7,
            b: Some(0.25),
            b_standard_error: Some(1e-3),
            counters: (0..9)
                .map(|i| (format!("counter{i}"), format!("{i} ±")))
                .collect(),
            window: Some(Window {
                origin: [10, 20],
                full: [640, 480],
            }),
        }
    }

    #[test]
    fn pixels_and_window_come_back_and_bytes_repeat() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        write_exr(&path, &sample(), &metadata(), Layers::default()).unwrap();
        let (back, window) = read_windowed(&path).unwrap();
        assert_eq!(back, sample());
        assert_eq!(Some(window), metadata().window);
        let first = std::fs::read(&path).unwrap();
        for _ in 0..5 {
            assert_eq!(encode(&sample(), &metadata(), Layers::default()), first);
        }
    }

    #[test]
    fn spectral_layout_has_its_names_and_units() {
        assert_eq!(spectral_channel_name(550.0), "S0.550,000000nm");
        let bins = Bins::new(47);
        let values = (0..15 * 47).map(|i| i as f32).collect();
        let spectral = SpectralBins { bins, values };
        let errors: Vec<f32> = (0..15).map(|i| i as f32 * 0.5).collect();
        let layers = Layers {
            spectral: Some(&spectral),
            error: Some(&errors),
            channels: &[],
        };
        let bytes = encode(&sample(), &metadata(), layers);
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .unwrap();
        use exr::prelude::{ReadChannels as _, ReadLayers as _};
        let layer = image.layer_data;
        let get = |k: &str| layer.attributes.other.get(&Text::from(k)).cloned();
        let is = |v: &str| Some(AttributeValue::Text(Text::from(v)));
        assert_eq!(get("spectralLayoutVersion"), is("1.0"));
        assert_eq!(get("emissiveUnits"), is("W.m^-2.sr^-1"));
        assert_eq!(get("sceneHash"), is("0000000000000abc"));
        assert_eq!(get("counter3"), is("3 ?"));
        let list = &layer.channel_data.list;
        let channel = |name: &str| -> Vec<f32> {
            let found = list.iter().find(|c| c.name == *name).unwrap();
            found.sample_data.values_as_f32().collect()
        };
        assert_eq!(channel("S0.365,000000nm")[2], 2.0 * 47.0);
        assert_eq!(channel("error"), errors);
        assert_eq!(list.len(), 51);
    }

    #[test]
    fn broken_and_boasting_files_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        assert_eq!(read_image(&path).unwrap_err().exit_code(), 2);
        let whole = encode(&sample(), &Metadata::default(), Layers::default());
        for cut in [0, 3, 40, whole.len() / 2, whole.len() - 3] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let e = read_image(&path).unwrap_err();
            assert_eq!(e.exit_code(), 2, "{cut}: {e}");
        }
        // dataWindow: two corners, inclusive; claim a far corner at (2²⁰, 2²⁰).
        let mut huge = whole.clone();
        let key = b"dataWindow\0box2i\0\x10\0\0\0";
        let at = huge.windows(key.len()).position(|w| w == key).unwrap() + key.len();
        huge[at + 8..at + 12].copy_from_slice(&(1i32 << 20).to_le_bytes());
        huge[at + 12..at + 16].copy_from_slice(&(1i32 << 20).to_le_bytes());
        std::fs::write(&path, &huge).unwrap();
        let e = read_image(&path).unwrap_err();
        assert!(matches!(e, ImageError::TooLarge { .. }), "{e}");
        assert_eq!(e.exit_code(), 2);
    }
}
