//! One file a subcommand: its flags, and the calls they become.

pub mod blocks;
pub mod check;
pub mod chosen;
pub mod compare;
pub mod evaluate;
pub mod init;
pub mod measured;
pub mod next;
pub mod open;
pub mod plan;
pub mod recognise;
pub mod report;
pub mod run;
pub mod segment;
pub mod serve_bin;
pub mod sign;
pub mod synth;
pub mod tiles;
pub mod verify;
pub mod what_if;
