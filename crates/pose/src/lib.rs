//! From segments and centre hypotheses to accepted blocks with pose and type.
