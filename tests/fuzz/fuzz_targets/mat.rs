#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rodsweep_fuzz::read("mat", bytes));
