//! Packets of tev, the image viewer: images that appear in it while they are rendered.
//!
//! A packet is its length in bytes (u32, little-endian, counting itself), a type (u8), and fields: numbers little-endian,
//! truth values as a byte, strings ended by a zero byte.

use super::Image;

/// The port that tev listens on.
pub const TEV_PORT: u16 = 14158;

/// Types of packets.
const OPEN_IMAGE: u8 = 0;
const CREATE_IMAGE: u8 = 4;
/// UpdateImage with several channels, each with an offset and a stride.
const UPDATE_IMAGE_V3: u8 = 6;
/// OpenImage with the choice of channels apart from the path.
const OPEN_IMAGE_V2: u8 = 7;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Most bytes of pixels in one packet, about.
const BAND: usize = 1 << 20;

struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![0, 0, 0, 0, kind])
    }

    fn flag(mut self, v: bool) -> Self {
        self.0.push(v.into());
        self
    }

    fn text(mut self, v: &str) -> Self {
        self.0.extend(v.bytes().filter(|b| *b != 0));
        self.0.push(0);
        self
    }

    fn int(mut self, v: usize) -> Self {
        self.0.extend((v as i32).to_le_bytes());
        self
    }

    fn longs(mut self, all: [i64; 3]) -> Self {
        self.0.extend(all.iter().flat_map(|v| v.to_le_bytes()));
        self
    }

    fn channels(self) -> Self {
        let p = self.int(CHANNELS.len());
        CHANNELS.into_iter().fold(p, Self::text)
    }

    fn done(mut self) -> Vec<u8> {
        let length = (self.0.len() as u32).to_le_bytes();
        self.0[..4].copy_from_slice(&length);
        self.0
    }
}

/// An image of this size comes to be, black, and is shown.
pub fn create_image(name: &str, [width, height]: [usize; 2]) -> Vec<u8> {
    let p = Packet::new(CREATE_IMAGE).flag(true).text(name);
    p.int(width).int(height).channels().done()
}

/// Pixels of it with their upper left corner at `origin`, in bands of whole rows.
pub fn update_image<'a>(
    name: &'a str,
    origin: [usize; 2],
    pixels: &'a Image,
) -> impl Iterator<Item = Vec<u8>> + 'a {
    let row = pixels.width * 12;
    let rows = (BAND / row.max(1)).max(1);
    (0..pixels.height).step_by(rows).map(move |y| {
        let n = rows.min(pixels.height - y);
        let p = Packet::new(UPDATE_IMAGE_V3).flag(false).text(name);
        let p = p.channels().int(origin[0]).int(origin[1] + y);
        let mut p = p.int(pixels.width).int(n).longs([0, 1, 2]).longs([3; 3]);
        let band = &pixels.rgb[y * pixels.width..][..n * pixels.width];
        p.0.extend(band.iter().flatten().flat_map(|v| v.to_le_bytes()));
        p.done()
    })
}

/// A file is opened by the viewer, which has to see it by this path.
pub fn open_image(path: &str) -> Vec<u8> {
    // In the older packet a colon begins the choice of channels.
    if path.contains(':') {
        let p = Packet::new(OPEN_IMAGE_V2).flag(true).text(path);
        return p.text("").done();
    }
    Packet::new(OPEN_IMAGE).flag(true).text(path).done()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_are_laid_out_as_the_viewer_reads_them() {
        let bytes = create_image("a", [2, 258]);
        let mut expected = vec![
            0, 0, 0, 0, 4, 1, b'a', 0, 2, 0, 0, 0, 2, 1, 0, 0, 3, 0, 0, 0,
        ];
        expected.extend(b"R\0G\0B\0");
        expected[0] = expected.len() as u8;
        assert_eq!(bytes, expected);
        assert_eq!(open_image("/é"), [10, 0, 0, 0, 0, 1, b'/', 0xc3, 0xa9, 0]);
        assert_eq!(
            open_image("C:x"),
            [11, 0, 0, 0, 7, 1, b'C', b':', b'x', 0, 0]
        );
        let image = Image {
            width: 1,
            height: 2,
            rgb: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        };
        let all: Vec<Vec<u8>> = update_image("a", [7, 9], &image).collect();
        assert_eq!(all.len(), 1);
        let p = &all[0];
        // Head, flag, name, count and names of channels; place and size; offsets and strides; pixels.
        assert_eq!(p.len(), 5 + 1 + 2 + 4 + 6 + 16 + 48 + 24);
        assert_eq!((p[4], p[5]), (6, 0));
        let int = |at: usize| i32::from_le_bytes(p[at..at + 4].try_into().expect("4 bytes"));
        assert_eq!([18, 22, 26, 30].map(int), [7, 9, 1, 2]);
        assert_eq!([34, 42, 50, 58, 66, 74].map(int), [0, 1, 2, 3, 3, 3]);
        let float = |at: usize| f32::from_le_bytes(p[at..at + 4].try_into().expect("4 bytes"));
        assert_eq!([82, 86, 102].map(float), [1.0, 2.0, 6.0]);
    }

    #[test]
    fn large_images_come_in_bands() {
        let (width, height) = (4096, 100);
        let image = Image {
            width,
            height,
            rgb: vec![[0.5; 3]; width * height],
        };
        let all: Vec<usize> = update_image("a", [0, 0], &image).map(|p| p.len()).collect();
        assert_eq!(all.len(), 5);
        assert!(all.iter().all(|n| *n < BAND + 200));
    }
}
