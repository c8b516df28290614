//! Four lanes of every machine: SSE2, NEON, 128-bit vectors of WebAssembly, or plain arrays where there is none of them.

use super::operations::{Simd, last_index};
use bytemuck::cast;
use wide::{f32x4, i32x4, u32x4};

/// Vectors of four values.
// Vectors, not arrays: a kernel is one function with thousands of operations. As loops over arrays they took the compiler
// minutes, and it did not turn all of them into vectors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

/// Beyond it floats have no fraction; half of it leaves room for a sign.
const ROUNDING: f32 = 1.5 * 8_388_608.0;

/// Implements operations by those of the vectors.
macro_rules! by_vector {
    ($($name:ident($($arg:ident: $from:ty),+) -> $to:ty = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: $from),+) -> $to {
            $value
        })+
    };
}

impl Simd for Portable {
    type F = f32x4;
    type U = u32x4;
    type M = u32x4;
    const LANES: usize = 4;
    const ACCUMULATORS: usize = 8;

    #[inline(always)]
    fn load(self, from: &[f32]) -> f32x4 {
        f32x4::new(*from.first_chunk().expect("a vector"))
    }
    #[inline(always)]
    fn store(self, v: f32x4, to: &mut [f32]) {
        *to.first_chunk_mut().expect("a vector") = v.to_array();
    }
    by_vector! {
        splat(value: f32) -> f32x4 = f32x4::splat(value);
        add(a: f32x4, b: f32x4) -> f32x4 = a + b;
        sub(a: f32x4, b: f32x4) -> f32x4 = a - b;
        mul(a: f32x4, b: f32x4) -> f32x4 = a * b;
        div(a: f32x4, b: f32x4) -> f32x4 = a / b;
        mul_add(a: f32x4, b: f32x4, c: f32x4) -> f32x4 = a.mul_add(b, c);
        // Those of the library are one instruction, and differ between machines in what they make of NaN. x86's is the right one.
        min(a: f32x4, b: f32x4) -> f32x4 = {
            if cfg!(target_arch = "x86_64") { a.fast_min(b) } else { a.simd_lt(b).bitselect(a, b) }
        };
        max(a: f32x4, b: f32x4) -> f32x4 = {
            if cfg!(target_arch = "x86_64") { a.fast_max(b) } else { b.simd_lt(a).bitselect(a, b) }
        };
        sqrt(a: f32x4) -> f32x4 = a.sqrt();
        inverse_sqrt(a: f32x4) -> f32x4 = f32x4::ONE / a.sqrt();
        lt(a: f32x4, b: f32x4) -> u32x4 = cast(a.simd_lt(b));
        le(a: f32x4, b: f32x4) -> u32x4 = cast(a.simd_le(b));
        and(a: u32x4, b: u32x4) -> u32x4 = a & b;
        or(a: u32x4, b: u32x4) -> u32x4 = a | b;
        not(a: u32x4) -> u32x4 = !a;
        any(a: u32x4) -> bool = a.any();
        select(m: u32x4, a: f32x4, b: f32x4) -> f32x4 = cast::<_, f32x4>(m).bitselect(a, b);
        splat_u(value: u32) -> u32x4 = u32x4::splat(value);
        add_u(a: u32x4, b: u32x4) -> u32x4 = a + b;
        sub_u(a: u32x4, b: u32x4) -> u32x4 = a - b;
        mul_u(a: u32x4, b: u32x4) -> u32x4 = a * b;
        lt_u(a: u32x4, b: u32x4) -> u32x4 = a.simd_lt(b);
        and_u(a: u32x4, b: u32x4) -> u32x4 = a & b;
        or_u(a: u32x4, b: u32x4) -> u32x4 = a | b;
        shl_u(a: u32x4, by: u32x4) -> u32x4 = a.unbounded_shl(by);
        shr_u(a: u32x4, by: u32x4) -> u32x4 = a.unbounded_shr(by);
        bits(a: f32x4) -> u32x4 = cast(a);
        float_of_bits(a: u32x4) -> f32x4 = cast(a);
        // Conversions to integers saturate, which costs more.
        round(a: f32x4) -> u32x4 = cast::<_, u32x4>(a + ROUNDING) - u32x4::splat(ROUNDING.to_bits());
        float(a: u32x4) -> f32x4 = f32x4::from_i32x4(cast::<_, i32x4>(a));
    }
    #[inline(always)]
    fn gather(self, values: &[f32], at: u32x4) -> f32x4 {
        let last = last_index(values);
        let [a, b, c, d] = at.to_array();
        let value = |at: u32| values[at.min(last) as usize];
        f32x4::new([value(a), value(b), value(c), value(d)])
    }
}
