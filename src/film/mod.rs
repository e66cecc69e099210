//! The film: pixel filter and sums. Sums are exact under reordering, so an image does not depend on how the work was cut.
//!
//! Three kinds of contributions, three kinds of sums: Markov-chain splats are bounded and go through [`SplatBuffer`]
//! (64-bit fixed point), light-tracing splats have any size and go through [`WideBuffer`] (128-bit), camera samples belong
//! to a pixel and are summed in order by its owner in [`PixelSums`].

mod bytes;
mod crop;
mod error;
mod exact;
mod filter;
mod groups;
mod pixels;
mod reserve;
mod shards;
mod spectral;
mod splat;
mod squares;

pub use bytes::{Malformed, Reader, Writer};
pub use crop::Crop;
pub use error::{ErrorSummary, PixelErrors};
pub use exact::{Fault, Film, FixedWeight, WideBuffer};
pub use filter::Filter;
pub use groups::GroupFilm;
pub use pixels::{PixelSum, PixelSums};
pub use reserve::Reserve;
pub use shards::{MOST_SHARDS, Shards};
pub use spectral::{Bins, SpectralBuffer, SpectralFilm, WideSpectralBuffer};
pub use splat::SplatBuffer;
pub use squares::{SquareBuffer, Squares};
