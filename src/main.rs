//! The `warpcheck` command.
fn main() {}
