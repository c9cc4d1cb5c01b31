//! The root package owns `tests/`: whole-system tests of the workspace. It exports nothing.
