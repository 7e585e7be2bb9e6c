//! Whole-rig tests.
