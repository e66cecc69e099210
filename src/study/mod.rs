//! Studies of images and of speed.

pub mod bench_accel;
pub mod metrics;
