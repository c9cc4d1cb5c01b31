#![no_main]

#[path = "../entry/scenario_toml.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::run(bytes));
