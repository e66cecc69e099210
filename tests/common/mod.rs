//! What the tests of the whole renderer share: scenes, estimators that keep path lengths apart, and statistics.
#![allow(dead_code, reason = "each test uses a part")]

pub mod estimate;
pub mod scene;
pub mod stats;
