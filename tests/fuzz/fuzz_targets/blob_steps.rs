#![no_main]

#[path = "../entry/blob_steps.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::run(bytes));
