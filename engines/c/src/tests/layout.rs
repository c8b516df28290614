//! The header and the definitions here agree: a C compiler compares them.

use crate::abi::{Code, Frame, InputImage, OutputImage, SessionOptions};
use crate::names;
use crate::session::Handle;
use std::ffi::c_char;
use std::mem::offset_of;
use std::path::Path;
use std::process::Command;

/// The type of a function's argument or result, in C.
trait InC {
    const NAME: &'static str;
}

macro_rules! in_c {
    ($($rust:ty => $c:literal,)*) => {
        $(impl InC for $rust { const NAME: &'static str = $c; })*
    };
}

in_c! {
    () => "void",
    u32 => "uint32_t",
    usize => "size_t",
    Code => "AonetError",
    *const c_char => "const char *",
    *mut *const c_char => "const char **",
    *const SessionOptions => "const AonetSessionOptions *",
    *const Frame => "const AonetFrame *",
    *const Handle => "AonetSession",
    *mut Handle => "AonetSession",
}

/// A second declaration of a function, from its type here. C accepts it only if it agrees with the first one.
fn no_argument<R: InC>(name: &str, _: extern "C" fn() -> R) -> String {
    format!("extern {} {name}(void);\n", R::NAME)
}

fn plain_argument<R: InC, A: InC>(name: &str, _: extern "C" fn(A) -> R) -> String {
    format!("extern {} {name}({});\n", R::NAME, A::NAME)
}

fn one_argument<R: InC, A: InC>(name: &str, _: unsafe extern "C" fn(A) -> R) -> String {
    format!("extern {} {name}({});\n", R::NAME, A::NAME)
}

fn two_arguments<R: InC, A: InC, B: InC>(name: &str, _: unsafe extern "C" fn(A, B) -> R) -> String {
    format!("extern {} {name}({}, {});\n", R::NAME, A::NAME, B::NAME)
}

fn functions() -> String {
    [
        one_argument("aonetNewSession", crate::aonetNewSession),
        two_arguments("aonetRun", crate::aonetRun),
        one_argument("aonetReleaseSession", crate::aonetReleaseSession),
        one_argument("aonetGetError", crate::aonetGetError),
        plain_argument("aonetGetMethodName", crate::aonetGetMethodName),
        no_argument("aonetGetVersion", crate::aonetGetVersion),
    ]
    .concat()
}

fn equal(c: &str, rust: usize) -> String {
    format!("_Static_assert({c} == {rust}, \"{c}\");\n")
}

/// Size and offsets of a struct.
macro_rules! structure {
    ($c:literal, $rust:ty, $($field:ident)*) => {
        [
            equal(concat!("sizeof(", $c, ")"), size_of::<$rust>()),
            $(equal(concat!("offsetof(", $c, ", ", stringify!($field), ")"), offset_of!($rust, $field)),)*
        ]
        .concat()
    };
}

fn structs() -> String {
    [
        structure!("AonetSessionOptions", SessionOptions, struct_size width height margin_x margin_y method
            weights_path weights weights_size threads precision),
        structure!("AonetInputImage", InputImage, data pixel_stride row_stride),
        structure!("AonetOutputImage", OutputImage, data pixel_stride row_stride),
        structure!("AonetFrame", Frame, struct_size depth normal second_depth visibility clip_from_view
            view_from_world fov_y radius),
    ]
    .concat()
}

fn numbers() -> String {
    [
        ("AONET_VERSION", names::VERSION as usize),
        ("sizeof(AonetError)", size_of::<Code>()),
        ("AONET_OK", Code::Ok as usize),
        ("AONET_ERROR_INVALID_ARGUMENT", Code::InvalidArgument as usize),
        ("AONET_ERROR_INVALID_WEIGHTS", Code::InvalidWeights as usize),
        ("AONET_ERROR_UNSUPPORTED_HARDWARE", Code::UnsupportedHardware as usize),
        ("AONET_ERROR_OUT_OF_MEMORY", Code::OutOfMemory as usize),
        ("AONET_ERROR_INVALID_OPERATION", Code::InvalidOperation as usize),
        ("AONET_ERROR_INTERNAL", Code::Internal as usize),
    ]
    .map(|(c, rust)| equal(c, rust))
    .concat()
}

/// Whether a C compiler accepts the header with these lines behind it; and what it says.
fn compiles(name: &str, lines: &str) -> (bool, String) {
    let file = std::env::temp_dir().join(format!("aonet_c_{name}_{}.c", std::process::id()));
    std::fs::write(&file, format!("#include <aonet.h>\n{lines}")).unwrap();
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut command = Command::new(compiler);
    command.args(["-std=c11", "-fsyntax-only", "-Wall", "-Werror", "-I"]).arg(include).arg(&file);
    let output = command.output().expect("a C compiler");
    std::fs::remove_file(&file).unwrap();
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn the_header_declares_what_is_defined_here() {
    let (good, messages) = compiles("all", &[functions(), structs(), numbers()].concat());
    assert!(good, "{messages}");
}

#[test]
fn the_comparison_can_fail() {
    for (name, lines) in [
        ("size", equal("sizeof(AonetFrame)", size_of::<Frame>() + 8)),
        ("offset", equal("offsetof(AonetFrame, radius)", offset_of!(Frame, fov_y))),
        ("number", equal("AONET_ERROR_INTERNAL", Code::OutOfMemory as usize)),
        ("function", "extern AonetError aonetRun(AonetSession, AonetFrame *);\n".into()),
    ] {
        assert!(!compiles(name, &lines).0, "{name}");
    }
}

/// Every function that the header declares is compared above.
#[test]
fn no_function_is_left_out() {
    let header = include_str!("../../include/aonet.h");
    let declared = header.lines().filter(|line| line.starts_with("AONET_API ")).count();
    assert_eq!(declared, functions().lines().count());
}
