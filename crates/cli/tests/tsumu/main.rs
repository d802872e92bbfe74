//! The built program as a user runs it.

mod api;
mod architecture;
mod bad_input;
mod before;
mod compare;
mod dataset;
mod help;
mod killed;
mod labels;
mod method;
mod no_memory;
mod no_room;
mod opened;
mod rated;
mod reviewed;
mod site;
mod tiles;
mod tiny_site;
mod verify;
