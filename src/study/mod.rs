//! Studies of images and of speed.

pub mod metrics;
