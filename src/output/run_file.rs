//! Files of runs: checkpoints, and the parts that machines share a render in. A label says what the run is of, the run's
//! sums and chains follow, and a checksum over all of it stands at the end.

use super::ImageError;
use super::atomic::write_streamed;
use crate::film::{Malformed, Reader, Writer};
use std::io::{self, Write};
use std::path::Path;

/// The first bytes of the file.
const MAGIC: &[u8; 8] = b"METROLUX";
/// Changes when older files can no longer be read.
const FORMAT: u32 = 2;
/// Stands before the checksum; a file that was cut short does not end so.
const END: &[u8; 8] = b"the end.";
/// Bytes before the label, and after the run.
const HEAD: usize = 16;
const TAIL: usize = 12;

/// Passes on what is written and sums it up.
struct Summing<'a> {
    out: &'a mut dyn Write,
    sum: crc32fast::Hasher,
}

impl Write for Summing<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sum.update(bytes);
        self.out.write_all(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes a run under a temporary name, syncs it and renames it; until then an older file stays. `label` is text, `save`
/// writes the run.
pub fn write_run(
    path: &Path,
    label: &str,
    save: &mut dyn FnMut(&mut Writer) -> io::Result<()>,
) -> Result<(), ImageError> {
    write_streamed(path, &mut |out| {
        let mut out = Summing {
            out,
            sum: crc32fast::Hasher::new(),
        };
        let mut w = Writer::new(&mut out);
        w.bytes(MAGIC)?;
        w.u32(FORMAT)?;
        w.u32(label.len() as u32)?;
        w.bytes(label.as_bytes())?;
        save(&mut w)?;
        w.bytes(END)?;
        let sum = out.sum.clone().finalize();
        out.write_all(&sum.to_le_bytes())
    })
}

/// A file of a run, whole and undamaged.
pub struct RunFile {
    bytes: Vec<u8>,
    label: usize,
}

impl RunFile {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that is no such file, of another format, cut short or damaged.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(|source| ImageError::NotReadable {
            path: path.into(),
            source,
        })?;
        Self::of_bytes(bytes).map_err(|e| ImageError::Bad {
            path: path.into(),
            reason: e.0,
        })
    }

    /// From the bytes of a file.
    pub fn of_bytes(bytes: Vec<u8>) -> Result<Self, Malformed> {
        let mut r = Reader::new(&bytes);
        if r.left() < 8 || r.bytes(8)? != MAGIC {
            return Err(Malformed::new(
                "is no checkpoint or part of metrolux: its first bytes are not METROLUX",
            ));
        }
        let cut = || Malformed(format!("is cut short after {} bytes", bytes.len()));
        let format = r.u32().map_err(|_| cut())?;
        if format != FORMAT {
            return Err(Malformed(format!(
                "is of format {format}; this version reads format {FORMAT}"
            )));
        }
        let label = r.u32().map_err(|_| cut())? as usize;
        let end = bytes.len().saturating_sub(TAIL);
        if bytes.len() < HEAD + TAIL || &bytes[end..end + 8] != END {
            return Err(cut());
        }
        let stated = u32::from_le_bytes(bytes[end + 8..].try_into().expect("4 bytes"));
        let found = crc32fast::hash(&bytes[..end + 8]);
        if stated != found {
            return Err(Malformed(format!(
                "is damaged: its checksum is {found:08x}, {stated:08x} is written in it"
            )));
        }
        if label > end - HEAD || std::str::from_utf8(&bytes[HEAD..HEAD + label]).is_err() {
            return Err(Malformed::new("has no label"));
        }
        Ok(Self { bytes, label })
    }

    /// What the run is of.
    pub fn label(&self) -> &str {
        std::str::from_utf8(&self.bytes[HEAD..HEAD + self.label]).expect("looked at when read")
    }

    /// The run.
    pub fn run(&self) -> Reader<'_> {
        Reader::new(&self.bytes[HEAD + self.label..self.bytes.len() - TAIL])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_seen_wherever_it_is() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("a.run");
        write_run(&path, "{}", &mut |w| w.floats(&[1.5; 20])).expect("written");
        let f = RunFile::read(&path).expect("whole");
        assert_eq!(f.label(), "{}");
        assert_eq!(f.run().floats(20), Ok(vec![1.5; 20]));
        assert_eq!(f.run().left(), 160);
        let bytes = std::fs::read(&path).expect("there");
        for n in 0..bytes.len() {
            let cut = RunFile::of_bytes(bytes[..n].to_vec()).err().expect("cut");
            assert!(n < 8 || cut.0.contains("cut short"), "{n}: {cut}");
            for bit in 0..8 {
                let mut b = bytes.clone();
                b[n] ^= 1 << bit;
                assert!(RunFile::of_bytes(b).is_err(), "bit {bit} of byte {n}");
            }
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(RunFile::of_bytes(longer).is_err());
        // Only the file itself is left.
        assert_eq!(std::fs::read_dir(dir.path()).expect("a folder").count(), 1);
    }
}
