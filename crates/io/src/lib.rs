//! Files in and out, one format a file; whole or not at all.
