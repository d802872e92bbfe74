//! Behaviour of the planner on small sites.

mod assortments;
mod bad_input;
mod ground;
mod guided;
mod improving;
mod laws_of_a_plan;
mod patterns;
mod placement_data;
mod replanning;
mod resetting;
mod site;
