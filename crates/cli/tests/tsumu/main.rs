//! The built program as a user runs it.

mod api;
mod architecture;
mod bad_input;
mod compare;
mod dataset;
mod help;
mod killed;
mod no_room;
mod rated;
mod reviewed;
mod site;
mod tiny_site;
