#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| cotan_tests::fuzzing::run("project", data));
