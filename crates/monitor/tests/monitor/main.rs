//! Tests of the comparison on piles of their own making.

mod alike;
mod laws;
mod pile;
mod series;
mod works;
