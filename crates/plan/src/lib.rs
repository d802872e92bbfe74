//! From a pile and a design surface to a stacking plan.
