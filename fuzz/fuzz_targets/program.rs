//! Program files: lists of dispatches with their data.
#![no_main]

use aonet::gpu::Program;

libfuzzer_sys::fuzz_target!(|files: (&[u8], &[u8])| {
    let (json, blob) = files;
    if let Ok(program) = Program::from_bytes(json, blob) {
        let again = program.to_bytes().expect("a program that was read can be written");
        let read = Program::from_bytes(&again.json, &again.blob).expect("and read back");
        assert_eq!(read.to_bytes().expect("as before"), again);
    }
});
