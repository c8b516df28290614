//! Errors as C sees them: a code, and a sentence that each thread keeps.

use crate::abi::Code;
use aonet::Error;
use std::cell::{Cell, RefCell};
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Why a function of the C interface could not do its work.
#[derive(Debug)]
pub(crate) struct Failure {
    code: Code,
    text: String,
}

pub(crate) type Result<T> = std::result::Result<T, Failure>;

impl Failure {
    /// A failure with a sentence of the form that all errors have.
    pub(crate) fn new(code: Code, what: &str, expected: impl ToString, found: impl ToString) -> Self {
        Self { code, text: Error::value(what, expected, found).to_string() }
    }

    /// [`Code::InvalidArgument`].
    pub(crate) fn argument(what: &str, expected: impl ToString, found: impl ToString) -> Self {
        Self::new(Code::InvalidArgument, what, expected, found)
    }

    /// [`Code::OutOfMemory`].
    pub(crate) fn memory(what: &str, bytes: usize) -> Self {
        Self::new(Code::OutOfMemory, what, format!("{bytes} bytes to be available"), "less")
    }

    /// The same failure with another code.
    pub(crate) fn with_code(self, code: Code) -> Self {
        Self { code, ..self }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match &error {
            // How the crate reports that an allocation failed.
            Error::Size { what, .. } if what == "session memory" => Code::OutOfMemory,
            Error::Format { .. } | Error::Config { .. } | Error::Weights { .. } => Code::InvalidWeights,
            Error::Device { .. } => Code::UnsupportedHardware,
            _ => Code::InvalidArgument,
        };
        Self { code, text: error.to_string() }
    }
}

thread_local! {
    static LAST_CODE: Cell<Code> = const { Cell::new(Code::Ok) };
    static LAST_TEXT: RefCell<CString> = RefCell::default();
}

/// Runs what a function of the C interface does. Keeps its failure for this thread and returns the code. A panic becomes
/// a failure.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T>) -> std::result::Result<T, Code> {
    let failure = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => return Ok(value),
        Ok(Err(failure)) => failure,
        Err(panic) => of_panic(panic.as_ref()),
    };
    keep(failure.code, failure.text);
    Err(failure.code)
}

/// The last failure of this thread, which has none afterwards. The text stays until the next failure.
pub(crate) fn take_last() -> (Code, *const c_char) {
    // A thread that is about to end has no error any more.
    let code = LAST_CODE.try_with(|last| last.replace(Code::Ok)).unwrap_or(Code::Ok);
    let text = LAST_TEXT.try_with(|text| text.borrow().as_ptr());
    match (code, text) {
        (Code::Ok, _) | (_, Err(_)) => (code, c"".as_ptr()),
        (code, Ok(text)) => (code, text),
    }
}

fn keep(code: Code, text: String) {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    let _ = LAST_CODE.try_with(|last| last.set(code));
    let _ = LAST_TEXT.try_with(|last| last.replace(text));
}

fn of_panic(panic: &(dyn std::any::Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    Failure { code: Code::Internal, text: format!("mistake in aonet: {text}") }
}
