#![no_main]

#[path = "../entry/flight_csv.rs"]
mod entry;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry::run(bytes));
