//! `tsumu`: subcommands are the stages of the pipeline.
fn main() {}
