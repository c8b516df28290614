//! Sixteen values at once, in as many registers as that takes: what work on pixels is written with.

use std::fmt::Debug;

/// Values that are computed together.
pub const WIDE: usize = 16;

/// Sixteen floats, whole numbers of 32 bits or conditions. A value of an implementing type is the proof that the machine
/// has the instructions.
// Intrinsics, one by one: where arrays were left for the compiler to turn into vectors, two fifths of the time of GTAO
// and its filter went to instructions for single lanes (`perf annotate`).
pub trait Wide: Copy + Debug {
    /// Floats.
    type F: Copy + Debug;
    /// Whole numbers; they wrap around.
    type U: Copy + Debug;
    /// Conditions.
    type M: Copy + Debug;

    /// The same number everywhere.
    fn splat(self, value: f32) -> Self::F;
    /// From memory.
    fn load(self, from: &[f32; WIDE]) -> Self::F;
    /// To memory.
    fn array(self, v: Self::F) -> [f32; WIDE];
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a * b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a / b.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// a * b + c, rounded once or twice.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a` where it is less, else `b`.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a` where it is greater, else `b`.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Square root of numbers not below 0.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// One over the square root of numbers above 1e-37, off by less than 1e-6 of it.
    fn inverse_sqrt(self, a: Self::F) -> Self::F;
    /// The same, off by less than 1e-4 of it.
    #[inline(always)]
    fn rough_inverse_sqrt(self, a: Self::F) -> Self::F {
        self.inverse_sqrt(a)
    }

    /// a < b.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// a <= b.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// Both.
    fn both(self, a: Self::M, b: Self::M) -> Self::M;
    /// Either.
    fn either(self, a: Self::M, b: Self::M) -> Self::M;
    /// The contrary.
    fn not(self, a: Self::M) -> Self::M;
    /// Whether it holds for one of them.
    fn any(self, a: Self::M) -> bool;
    /// `a` where it holds, `b` elsewhere.
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F;

    /// The same number everywhere.
    fn splat_u(self, value: u32) -> Self::U;
    /// a + b.
    fn add_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// a - b.
    fn sub_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// a * b.
    fn mul_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// a < b, both without a sign.
    fn lt_u(self, a: Self::U, b: Self::U) -> Self::M;
    /// Bits of both.
    fn and_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Bits of either.
    fn or_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Towards the high bits; nothing is left of a shift by 32 or more.
    fn shl_u(self, a: Self::U, by: Self::U) -> Self::U;
    /// Towards the low bits; nothing is left of a shift by 32 or more.
    fn shr_u(self, a: Self::U, by: Self::U) -> Self::U;
    /// A float's bits.
    fn bits(self, a: Self::F) -> Self::U;
    /// The float of such bits.
    fn float_of_bits(self, a: Self::U) -> Self::F;
    /// The nearest whole number of floats in [-2^22, 2^22], as a signed one.
    fn round(self, a: Self::F) -> Self::U;
    /// Signed numbers in [-2^22, 2^22] as floats.
    fn float(self, a: Self::U) -> Self::F;

    /// The values at these places; those beyond the end are at the last one.
    ///
    /// # Panics
    /// When there are no values.
    fn gather(self, values: &[f32], at: Self::U) -> Self::F;

    /// Sixteen triples as three times sixteen values.
    #[inline(always)]
    fn thirds(self, triples: &[[f32; 3]; WIDE]) -> [Self::F; 3] {
        let mut thirds = [[0.0; WIDE]; 3];
        for i in 0..WIDE {
            for c in 0..3 {
                thirds[c][i] = triples[i][c];
            }
        }
        [self.load(&thirds[0]), self.load(&thirds[1]), self.load(&thirds[2])]
    }
}

/// The last place that a gather may look at.
///
/// # Panics
/// When there are no values.
#[inline(always)]
pub(super) fn last_place(values: &[f32]) -> u32 {
    assert!(!values.is_empty(), "values to gather");
    // Vector instructions take places as signed.
    (values.len() - 1).min(i32::MAX as usize) as u32
}

/// Implements operations on arrays from those on their values.
macro_rules! by_value {
    ($($name:ident($($arg:ident: $from:ty),+) -> $to:ty = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: [$from; WIDE]),+) -> [$to; WIDE] {
            let mut out = [<$to>::default(); WIDE];
            for i in 0..WIDE {
                $(let $arg = $arg[i];)+
                out[i] = $value;
            }
            out
        })+
    };
}

/// Beyond it floats have no fraction; half of it leaves room for a sign.
const ROUNDING: f32 = 1.5 * 8_388_608.0;

impl Wide for crate::simd::Portable {
    type F = [f32; WIDE];
    type U = [u32; WIDE];
    type M = [bool; WIDE];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [value; WIDE]
    }
    #[inline(always)]
    fn load(self, from: &[f32; WIDE]) -> Self::F {
        *from
    }
    #[inline(always)]
    fn array(self, v: Self::F) -> [f32; WIDE] {
        v
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        a.contains(&true)
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> Self::U {
        [value; WIDE]
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
        both(a: bool, b: bool) -> bool = a & b;
        either(a: bool, b: bool) -> bool = a | b;
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
        let last = last_place(values);
        at.map(|at| values[at.min(last) as usize])
    }
}
