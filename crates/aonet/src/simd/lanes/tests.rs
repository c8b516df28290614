use super::*;
use crate::simd::{Isa, Kernel, Level, Simd};

/// Calls a check with every instruction set of this machine.
macro_rules! everywhere {
    ($name:ident, $check:ident) => {
        #[test]
        fn $name() {
            struct Check;
            impl Kernel for Check {
                fn run<S: Simd>(self, simd: S) {
                    $check(simd);
                }
            }
            for level in Level::available() {
                Isa::new(level).unwrap().run(Check);
                Isa::new(level).unwrap().run_on_pixels(Check);
                Isa::new(level).unwrap().run_on_chains(Check);
            }
        }
    };
}
everywhere!(functions_are_as_exact_as_they_say, functions);
everywhere!(nan_and_negative_numbers_have_an_index, indices);
everywhere!(masks_choose, masks);
everywhere!(indices_beyond_the_end_read_the_last_value, gathers);
everywhere!(a_store_writes_as_many_as_there_is_room_for, partial_stores);
everywhere!(bits_are_counted_and_shifted_out, bits);

fn over<S: Simd>(simd: S, range: std::ops::RangeInclusive<f32>, check: impl Fn(f32, usize, F<S>)) {
    let (low, high) = (*range.start(), *range.end());
    for block in 0..=1000 {
        let x = low + (high - low) * block as f32 / 1000.0;
        let values: [f32; MAX_LANES] = std::array::from_fn(|i| (x + i as f32 * 1e-3).min(high));
        (0..S::LANES).for_each(|i| check(values[i], i, F::load(simd, &values)));
    }
}

fn functions<S: Simd>(simd: S) {
    over(simd, 0.0..=PI, |x, i, lanes| {
        let (c, s) = lanes.cos_sin_of_half_turn();
        assert!((c.array()[i] - x.cos()).abs() < 4e-6 && (s.array()[i] - x.sin()).abs() < 4e-6, "{x}");
    });
    over(simd, -1.0..=1.0, |x, i, lanes| {
        assert!((lanes.acos().array()[i] - x.acos()).abs() < 8e-5, "{x}");
    });
    over(simd, -20.0..=20.0, |x, i, lanes| {
        assert!((lanes.exp2().array()[i] / x.exp2() - 1.0).abs() < 1e-5, "{x}");
    });
    over(simd, 1e-3..=9.0, |x, i, lanes| {
        assert!((lanes.log2().array()[i] - x.log2()).abs() < 2e-5, "{x}");
        assert!((lanes.inverse_sqrt().array()[i] * x.sqrt() - 1.0).abs() < 1e-6, "{x}");
        assert!((lanes.rough_inverse_sqrt().array()[i] * x.sqrt() - 1.0).abs() < 1e-4, "{x}");
    });
    over(simd, 0.0..=9000.0, |x, i, lanes| {
        assert!((lanes.fract().array()[i] - x.fract()).abs() < 1e-6, "{x}");
        assert_eq!(lanes.index(5000).array()[i], x.round_ties_even().min(5000.0) as u32);
    });
    assert_eq!(F::new(simd, 0.0).exp2().array()[0], 1.0);
    let signed = F::new(simd, 2.0).with_sign_of(F::new(simd, -0.0));
    assert_eq!((signed.array()[3], signed.abs().array()[3]), (-2.0, 2.0));
}

fn indices<S: Simd>(simd: S) {
    let mut lanes = [0.0; MAX_LANES];
    lanes[..4].copy_from_slice(&[f32::NAN, -3.0, 1e30, 7.4]);
    assert_eq!(F::load(simd, &lanes).index(9).array()[..4], [0, 0, 9, 7]);
}

fn masks<S: Simd>(simd: S) {
    let (i, half) = (F::counting_from(simd, 0.0), S::LANES as f32 / 2.0);
    let chosen = (i.lt(1.0) | !i.le(half)).select(-1.0, i).array();
    let expected = |i: usize| if i < 1 || i as f32 > half { -1.0 } else { i as f32 };
    assert_eq!(chosen, (0..S::LANES).map(expected).collect::<Vec<_>>());
    let chosen = (i.lt(half) & i.le(half - 2.0)).select(1.0, 0.0).array();
    let expected = |i: usize| if i as f32 <= half - 2.0 { 1.0 } else { 0.0 };
    assert_eq!(chosen, (0..S::LANES).map(expected).collect::<Vec<_>>());
    for lane in 0..S::LANES {
        let one = F::counting_from(simd, 0.0) - lane as f32;
        assert!((one.lt(0.5) & F::new(simd, -0.5).lt(one)).any());
    }
    assert!(!i.lt(0.0).any());
}

fn gathers<S: Simd>(simd: S) {
    let values: Vec<f32> = (0..12).map(|v| v as f32 * 10.0).collect();
    let indices = F::counting_from(simd, 10.0).index(99);
    assert_eq!(indices.gather(&values).array()[..4], [100.0, 110.0, 110.0, 110.0]);
    let indices = F::counting_from(simd, 0.0).index(99);
    let all: Vec<f32> = (0..S::LANES).map(|i| values[i.min(11)]).collect();
    assert_eq!(indices.gather(&values).array(), all);
    assert_eq!((indices * u32::MAX).gather(&values).array()[..2], [0.0, 110.0]);
    let fours = F(simd, simd.load_fours(&values, |i| 8 - i)).array();
    let expected: Vec<f32> = (0..S::LANES).map(|i| values[8 - i / 4 + i % 4]).collect();
    assert_eq!(fours, expected);
    let triples: [[f32; 3]; MAX_LANES] = std::array::from_fn(|i| [i as f32, 100.0 + i as f32, -(i as f32)]);
    let [x, y, z] = simd.load_triples(&triples).map(|v| F(simd, v).array());
    let found: Vec<_> = (0..S::LANES).map(|i| [x[i], y[i], z[i]]).collect();
    assert_eq!(found, triples[..S::LANES]);
}

fn bits<S: Simd>(simd: S) {
    let count = F::counting_from(simd, 30.0).index(99);
    let one = F::counting_from(simd, 1.0).index(1);
    assert_eq!((one << count).array()[..4], [1 << 30, 1 << 31, 0, 0]);
    // Unsigned, -3 is large.
    let below = |first: f32| F::counting_from(simd, first).round().lt(2).select(1.0, 0.0).array();
    assert_eq!(below(-3.0)[..4], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(below(-1.0)[..4], [0.0, 1.0, 1.0, 0.0]);
    assert_eq!((((one << count) + u32::MAX) >> 1).count_ones().array()[..4], [29, 30, 31, 31]);
}

fn partial_stores<S: Simd>(simd: S) {
    for len in 0..=MAX_LANES {
        let mut to = vec![-1.0; len];
        F::counting_from(simd, 5.0).store(&mut to);
        let expected: Vec<f32> = (0..len).map(|i| if i < S::LANES { 5.0 + i as f32 } else { -1.0 }).collect();
        assert_eq!(to, expected);
    }
}
