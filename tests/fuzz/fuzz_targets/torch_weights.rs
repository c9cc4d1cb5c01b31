#![no_main]

#[path = "../entry/torch_weights.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::run(bytes));
