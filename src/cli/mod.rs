//! One file a sub-command: typed arguments to a resolved job.

pub mod compare;
