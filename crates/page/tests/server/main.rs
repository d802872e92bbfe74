//! The server without a browser: who may ask, which paths, how much, and what becomes of work.

mod asked;
mod guarded;
mod uploads;
mod words;
mod works;
