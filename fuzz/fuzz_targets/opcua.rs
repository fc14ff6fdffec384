#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rungd_fuzz::opcua(bytes));
