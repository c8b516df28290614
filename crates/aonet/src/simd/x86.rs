//! What the instruction sets of x86-64 share.

/// Implements operations by one expression of instructions each.
macro_rules! by_instruction {
    ($($name:ident($($arg:ident: $from:ident),+) -> $to:ident = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: Self::$from),+) -> Self::$to {
            // SAFETY: `self` exists only if the instructions do.
            unsafe { $value }
        })+
    };
}
pub(super) use by_instruction;
