//! Measures the engines against one another.

fn main() {}
