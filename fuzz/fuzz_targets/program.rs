//! Program files: lists of dispatches (JSON), a zero, and their data.
#![no_main]

use aonet::gpu::Program;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    let (json, blob) = (&bytes[..end], bytes.get(end + 1..).unwrap_or_default());
    if let Ok(program) = Program::from_bytes(json, blob) {
        let again = program.to_bytes().expect("a program that was read can be written");
        let read = Program::from_bytes(&again.json, &again.blob).expect("and read back");
        assert_eq!(read.to_bytes().expect("as before"), again);
    }
});
