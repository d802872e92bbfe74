//! From a cloud to instances and centre hypotheses.
