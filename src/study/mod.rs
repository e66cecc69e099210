//! Studies of images and of speed: how far an image is from a reference, what that costs in time, and a page that shows it.

pub mod analyse;
pub mod axes;
pub mod bench_accel;
pub mod decompose;
pub mod fit;
pub mod flip;
pub mod interval;
pub mod metrics;
pub mod page;
pub mod predict;
pub mod process;
pub mod record;
pub mod reference;
pub mod schedule;
pub mod sums;
pub mod words;
