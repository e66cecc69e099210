//! Sums on their way to a file and back: little-endian numbers, and blocks of integers as narrow as they may be.
//!
//! A reader believes nothing: every length is held against the bytes that are there before anything is allocated for it.

use crate::real::Real;
use std::io::{self, Write};

/// The bytes do not say what they should.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Malformed(pub String);

impl Malformed {
    /// With a reason.
    pub fn new(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

/// Writes numbers.
pub struct Writer<'a> {
    out: &'a mut dyn Write,
}

impl<'a> Writer<'a> {
    /// Into `out`, which should be buffered.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out }
    }

    /// Bytes as they are.
    pub fn bytes(&mut self, b: &[u8]) -> io::Result<()> {
        self.out.write_all(b)
    }

    /// One byte.
    pub fn u8(&mut self, v: u8) -> io::Result<()> {
        self.bytes(&[v])
    }

    /// Four bytes.
    pub fn u32(&mut self, v: u32) -> io::Result<()> {
        self.bytes(&v.to_le_bytes())
    }

    /// Eight bytes.
    pub fn u64(&mut self, v: u64) -> io::Result<()> {
        self.bytes(&v.to_le_bytes())
    }

    /// A number of transport, in the bytes it has in this build.
    pub fn real(&mut self, v: Real) -> io::Result<()> {
        self.bytes(&v.to_le_bytes())
    }

    /// The four bytes of a float.
    pub fn f32(&mut self, v: f32) -> io::Result<()> {
        self.u32(v.to_bits())
    }

    /// The eight bytes of a float.
    pub fn f64(&mut self, v: f64) -> io::Result<()> {
        self.u64(v.to_bits())
    }

    /// As many floats as there are, eight bytes each, without their number.
    pub fn floats(&mut self, values: &[f64]) -> io::Result<()> {
        let mut block = Vec::with_capacity(BLOCK * 8);
        for part in values.chunks(BLOCK) {
            block.clear();
            for v in part {
                block.extend_from_slice(&v.to_bits().to_le_bytes());
            }
            self.bytes(&block)?;
        }
        Ok(())
    }

    /// Integers, without their number: what their lowest bits share in zeros and their highest in signs is left out.
    pub fn integers(&mut self, values: impl Iterator<Item = i128> + Clone) -> io::Result<()> {
        let (mut low, mut high) = (0u128, 0u128);
        for v in values.clone() {
            low |= v as u128;
            high |= (v ^ (v >> 127)) as u128;
        }
        let shift = if low == 0 { 0 } else { low.trailing_zeros() };
        let bits = 129 - high.leading_zeros() - shift.min(128 - high.leading_zeros());
        let width = bits.div_ceil(8) as usize;
        self.bytes(&[shift as u8, width as u8])?;
        let mut block = Vec::with_capacity(BLOCK * width + 16);
        for v in values {
            block.extend_from_slice(&(v >> shift).to_le_bytes()[..width]);
            if block.len() >= BLOCK * width {
                self.bytes(&block)?;
                block.clear();
            }
        }
        self.bytes(&block)
    }
}

/// Numbers that are written at once.
const BLOCK: usize = 4096;

/// Reads what a [`Writer`] wrote.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// From the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Bytes not yet read.
    pub fn left(&self) -> usize {
        self.rest.len()
    }

    /// The next `n` bytes.
    pub fn bytes(&mut self, n: usize) -> Result<&'a [u8], Malformed> {
        match self.rest.split_at_checked(n) {
            Some((head, rest)) => {
                self.rest = rest;
                Ok(head)
            }
            None => Err(Malformed(format!(
                "ends {} bytes too early",
                n - self.rest.len()
            ))),
        }
    }

    fn array<const K: usize>(&mut self) -> Result<[u8; K], Malformed> {
        let b = self.bytes(K)?;
        Ok(b.try_into().expect("K bytes were asked for"))
    }

    /// One byte.
    pub fn u8(&mut self) -> Result<u8, Malformed> {
        Ok(self.array::<1>()?[0])
    }

    /// Four bytes.
    pub fn u32(&mut self) -> Result<u32, Malformed> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    /// Eight bytes.
    pub fn u64(&mut self) -> Result<u64, Malformed> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// A number of transport.
    pub fn real(&mut self) -> Result<Real, Malformed> {
        Ok(Real::from_le_bytes(self.array()?))
    }

    /// A float.
    pub fn f32(&mut self) -> Result<f32, Malformed> {
        Ok(f32::from_bits(self.u32()?))
    }

    /// A float.
    pub fn f64(&mut self) -> Result<f64, Malformed> {
        Ok(f64::from_bits(self.u64()?))
    }

    /// A number of things of at least `size` bytes each, all of which must still be there.
    pub fn count(&mut self, size: usize) -> Result<usize, Malformed> {
        let n = self.u32()? as usize;
        self.holds(n, size)?;
        Ok(n)
    }

    /// At least `n` things of `size` bytes are still there.
    pub fn holds(&self, n: usize, size: usize) -> Result<(), Malformed> {
        match n.checked_mul(size) {
            Some(bytes) if bytes <= self.left() => Ok(()),
            _ => Err(Malformed(format!(
                "claims {n} values where {} bytes are left",
                self.left()
            ))),
        }
    }

    /// `n` floats.
    pub fn floats(&mut self, n: usize) -> Result<Vec<f64>, Malformed> {
        self.holds(n, 8)?;
        let all = self.bytes(n * 8)?.chunks_exact(8);
        Ok(all
            .map(|b| f64::from_le_bytes(b.try_into().expect("8 bytes")))
            .collect())
    }

    /// `n` integers.
    pub fn integers(
        &mut self,
        n: usize,
    ) -> Result<impl ExactSizeIterator<Item = i128> + use<'a>, Malformed> {
        let (shift, width) = (self.u8()?, self.u8()? as usize);
        if !(1..=16).contains(&width) || shift > 127 {
            return Err(Malformed(format!(
                "integers of {width} bytes, {shift} bits up"
            )));
        }
        self.holds(n, width)?;
        let all = self.bytes(n * width)?.chunks_exact(width);
        Ok(all.map(move |b| {
            let sign = if b[width - 1] & 0x80 != 0 { 0xff } else { 0 };
            let mut v = [sign; 16];
            v[..width].copy_from_slice(b);
            i128::from_le_bytes(v) << shift
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(v: &[i128]) -> usize {
        let mut bytes = Vec::new();
        let mut w = Writer::new(&mut bytes);
        w.integers(v.iter().copied()).expect("memory");
        let mut r = Reader::new(&bytes);
        let back: Vec<i128> = r.integers(v.len()).expect("whole").collect();
        assert_eq!((back.as_slice(), r.left()), (v, 0));
        assert!(Reader::new(&bytes).integers(v.len() + 1).is_err());
        bytes.len() - 2
    }

    #[test]
    fn integers_come_back_and_are_narrow() {
        assert_eq!(round_trip(&[]), 0);
        assert_eq!(round_trip(&[0, 0]), 2);
        assert_eq!(round_trip(&[127, -128]), 2);
        assert_eq!(round_trip(&[128]), 1);
        assert_eq!(round_trip(&[129]), 2);
        assert_eq!(round_trip(&[3 << 32, -(7 << 34), 0]), 3);
        assert_eq!(round_trip(&[i128::MAX, i128::MIN, 1]), 48);
        assert_eq!(round_trip(&[i128::MIN]), 1);
        let many: Vec<i128> = (0..10_000).map(|i| (i - 5000) << 32).collect();
        assert_eq!(round_trip(&many), 20_000);
    }

    #[test]
    fn nothing_is_read_past_the_end() {
        let mut r = Reader::new(&[255; 7]);
        assert!(r.clone().count(1).is_err() && r.clone().u64().is_err());
        assert!(r.clone().floats(usize::MAX / 4).is_err());
        assert!(r.clone().integers(3).is_err());
        assert_eq!(r.u32(), Ok(u32::MAX));
        assert_eq!(r.left(), 3);
    }
}
