//! Plain arrays: SSE2 or NEON, or whatever the compiler makes of them.

use super::operations::{Simd, last_index};

/// Arrays of `N` values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable<const N: usize = 4>;

/// Implements operations on arrays from those on their values.
macro_rules! by_value {
    ($($name:ident($($arg:ident: $from:ty),+) -> $to:ty = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: [$from; N]),+) -> [$to; N] {
            let mut out = [<$to>::default(); N];
            for i in 0..N {
                $(let $arg = $arg[i];)+
                out[i] = $value;
            }
            out
        })+
    };
}

/// Beyond it floats have no fraction; half of it leaves room for a sign.
const ROUNDING: f32 = 1.5 * 8_388_608.0;

impl<const N: usize> Simd for Portable<N> {
    type F = [f32; N];
    type U = [u32; N];
    type M = [bool; N];
    const LANES: usize = N;
    const ACCUMULATORS: usize = 8;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; N]
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        *from.first_chunk().expect("a vector")
    }
    #[inline(always)]
    fn store(self, v: Self::F, to: &mut [f32]) {
        *to.first_chunk_mut().expect("a vector") = v;
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        a.contains(&true)
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> Self::U {
        [value; N]
    }
    by_value! {
        add(a: f32, b: f32) -> f32 = a + b;
        sub(a: f32, b: f32) -> f32 = a - b;
        mul(a: f32, b: f32) -> f32 = a * b;
        div(a: f32, b: f32) -> f32 = a / b;
        // Where the target has no fused instruction, `f32::mul_add` is a slow call.
        mul_add(a: f32, b: f32, c: f32) -> f32 = {
            if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
        };
        min(a: f32, b: f32) -> f32 = if a < b { a } else { b };
        max(a: f32, b: f32) -> f32 = if a > b { a } else { b };
        sqrt(a: f32) -> f32 = a.sqrt();
        inverse_sqrt(a: f32) -> f32 = 1.0 / a.sqrt();
        lt(a: f32, b: f32) -> bool = a < b;
        le(a: f32, b: f32) -> bool = a <= b;
        and(a: bool, b: bool) -> bool = a & b;
        or(a: bool, b: bool) -> bool = a | b;
        not(a: bool) -> bool = !a;
        select(m: bool, a: f32, b: f32) -> f32 = if m { a } else { b };
        add_u(a: u32, b: u32) -> u32 = a.wrapping_add(b);
        sub_u(a: u32, b: u32) -> u32 = a.wrapping_sub(b);
        mul_u(a: u32, b: u32) -> u32 = a.wrapping_mul(b);
        lt_u(a: u32, b: u32) -> bool = a < b;
        and_u(a: u32, b: u32) -> u32 = a & b;
        or_u(a: u32, b: u32) -> u32 = a | b;
        shl_u(a: u32, by: u32) -> u32 = if by < 32 { a << by } else { 0 };
        shr_u(a: u32, by: u32) -> u32 = if by < 32 { a >> by } else { 0 };
        bits(a: f32) -> u32 = a.to_bits();
        float_of_bits(a: u32) -> f32 = f32::from_bits(a);
        // Casts to integers saturate, which costs more.
        round(a: f32) -> u32 = (a + ROUNDING).to_bits().wrapping_sub(ROUNDING.to_bits());
        float(a: u32) -> f32 = a as i32 as f32;
    }
    #[inline(always)]
    fn gather(self, values: &[f32], at: Self::U) -> Self::F {
        let last = last_index(values);
        at.map(|at| values[at.min(last) as usize])
    }
}
