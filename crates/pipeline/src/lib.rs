//! The pipeline: recognise and plan, one call a stage.
