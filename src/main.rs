//! The `metrolux` command.
fn main() {}
