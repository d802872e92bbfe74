//! The page of `tsumu open`: sites, surveys, design, runs and results in a browser, on this machine alone.
//!
//! In: a folder and the program itself. Out: a server on the loopback address that hands out one page and works on the sites of
//! that folder. Everything that reads a user's file or computes is a child process of the program with `--json`, so that a
//! damaged file or a want of memory ends the child and not the page. No file outside the folder is read or written, nothing is
//! sent anywhere, and nothing changes on GET.

mod assets;
mod error;
mod files;
mod guard;
mod jobs;
mod names;
mod order;
mod refusal;
mod routes;
mod server;
mod sites;
mod snapshot;
mod upload;

pub use error::PageError;
pub use server::{Options, Server};
