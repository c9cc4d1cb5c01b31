#![no_main]

#[path = "../entry/frame_reader.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::run(bytes));
