//! Random streams and warps.
