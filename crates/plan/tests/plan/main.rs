//! Behaviour of the planner on small sites.

mod bad_input;
mod ground;
mod laws_of_a_plan;
mod placement_data;
mod replanning;
mod site;
