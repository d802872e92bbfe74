//! Synthetic piles that look like surveys.
