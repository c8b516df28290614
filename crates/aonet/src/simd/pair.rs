//! Two vectors as one of twice the lanes.

use super::operations::{Kernel, Simd};

/// An instruction set whose vectors are taken two at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair<S>(S);

/// A kernel that runs on pairs of vectors.
pub(super) struct Paired<K>(pub(super) K);

impl<K: Kernel> Kernel for Paired<K> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.0.run(Pair(simd));
    }
}

/// Implements operations by one operation for each half.
macro_rules! by_half {
    ($($name:ident($($arg:ident: $from:ident),+) -> $to:ident;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: Self::$from),+) -> Self::$to {
            [self.0.$name($($arg[0]),+), self.0.$name($($arg[1]),+)]
        })+
    };
}

impl<S: Simd> Simd for Pair<S> {
    type F = [S::F; 2];
    type U = [S::U; 2];
    type M = [S::M; 2];
    const LANES: usize = 2 * S::LANES;
    const ACCUMULATORS: usize = S::ACCUMULATORS / 2;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        [self.0.splat(value); 2]
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::F {
        let (low, high) = from[..Self::LANES].split_at(S::LANES);
        [self.0.load(low), self.0.load(high)]
    }
    #[inline(always)]
    fn store(self, v: Self::F, to: &mut [f32]) {
        let (low, high) = to[..Self::LANES].split_at_mut(S::LANES);
        self.0.store(v[0], low);
        self.0.store(v[1], high);
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        self.0.any(self.0.or(a[0], a[1]))
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> Self::U {
        [self.0.splat_u(value); 2]
    }
    #[inline(always)]
    fn gather(self, values: &[f32], at: Self::U) -> Self::F {
        [self.0.gather(values, at[0]), self.0.gather(values, at[1])]
    }
    #[inline(always)]
    fn load_triples(self, triples: &[[f32; 3]]) -> [Self::F; 3] {
        let (low, high) = triples[..Self::LANES].split_at(S::LANES);
        let ([a, b, c], [d, e, f]) = (self.0.load_triples(low), self.0.load_triples(high));
        [[a, d], [b, e], [c, f]]
    }
    by_half! {
        add(a: F, b: F) -> F;
        sub(a: F, b: F) -> F;
        mul(a: F, b: F) -> F;
        div(a: F, b: F) -> F;
        mul_add(a: F, b: F, c: F) -> F;
        min(a: F, b: F) -> F;
        max(a: F, b: F) -> F;
        sqrt(a: F) -> F;
        inverse_sqrt(a: F) -> F;
        rough_inverse_sqrt(a: F) -> F;
        lt(a: F, b: F) -> M;
        le(a: F, b: F) -> M;
        and(a: M, b: M) -> M;
        or(a: M, b: M) -> M;
        not(a: M) -> M;
        select(m: M, a: F, b: F) -> F;
        add_u(a: U, b: U) -> U;
        sub_u(a: U, b: U) -> U;
        mul_u(a: U, b: U) -> U;
        lt_u(a: U, b: U) -> M;
        and_u(a: U, b: U) -> U;
        or_u(a: U, b: U) -> U;
        shl_u(a: U, by: U) -> U;
        shr_u(a: U, by: U) -> U;
        bits(a: F) -> U;
        float_of_bits(a: U) -> F;
        round(a: F) -> U;
        float(a: U) -> F;
    }
}
