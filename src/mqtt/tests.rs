//! Sessions with a broker that a test scripts.
