//! The `veduta` command.
fn main() {}
