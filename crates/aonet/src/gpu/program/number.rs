//! Whole numbers that follow from the size of the frames.

use crate::frame::size::Size;
use crate::gpu::options::Precision;
use serde::{Deserialize, Serialize};
use std::ops::{Add, Mul};

/// A whole number: itself, or a formula of the frames' size.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Number {
    /// The same for every size.
    Fixed(u64),
    /// To be computed.
    Formula(Formula),
}

/// How a number follows from the size of the frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Formula {
    /// Width of the frames (px).
    Width,
    /// Height of the frames (px).
    Height,
    /// Bytes of a `real`, which activations and weights are made of: 4, with half floats 2.
    RealBytes,
    /// A sum.
    Add(Box<[Number; 2]>),
    /// A product.
    Mul(Box<[Number; 2]>),
    /// The first divided by the second, rounded up.
    DivCeil(Box<[Number; 2]>),
    /// The larger one.
    Max(Box<[Number; 2]>),
}

impl Number {
    pub(crate) const WIDTH: Self = Self::Formula(Formula::Width);
    pub(crate) const HEIGHT: Self = Self::Formula(Formula::Height);
    pub(crate) const REAL_BYTES: Self = Self::Formula(Formula::RealBytes);

    /// The number divided by a constant above 0, rounded up.
    pub(crate) fn div_ceil(&self, by: usize) -> Self {
        match self {
            _ if by == 1 => self.clone(),
            Self::Fixed(number) => Self::Fixed(number.div_ceil(by as u64)),
            Self::Formula(_) => Self::Formula(Formula::DivCeil(Box::new([self.clone(), by.into()]))),
        }
    }

    /// The larger one of two numbers.
    pub(crate) fn max(self, other: Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a.max(b)),
            (a, b) if a == b => a,
            (a, b) => Self::Formula(Formula::Max(Box::new([a, b]))),
        }
    }

    /// Its value for frames of a size; none where it is too large, or a divisor is 0.
    pub(crate) fn at(&self, size: Size, precision: Precision) -> Option<u64> {
        let of = |number: &Self| number.at(size, precision);
        let formula = match self {
            Self::Fixed(number) => return Some(*number),
            Self::Formula(formula) => formula,
        };
        match formula {
            Formula::Width => Some(size.width() as u64),
            Formula::Height => Some(size.height() as u64),
            Formula::RealBytes => Some(precision.bytes() as u64),
            Formula::Add(two) => of(&two[0])?.checked_add(of(&two[1])?),
            Formula::Mul(two) => of(&two[0])?.checked_mul(of(&two[1])?),
            Formula::DivCeil(two) => {
                let (number, by) = (of(&two[0])?, of(&two[1])?);
                (by > 0).then(|| number.div_ceil(by))
            }
            Formula::Max(two) => Some(of(&two[0])?.max(of(&two[1])?)),
        }
    }
}

impl From<usize> for Number {
    fn from(number: usize) -> Self {
        Self::Fixed(number as u64)
    }
}

impl Add for Number {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a + b),
            (Self::Fixed(0), number) | (number, Self::Fixed(0)) => number,
            (a, b) => Self::Formula(Formula::Add(Box::new([a, b]))),
        }
    }
}

impl Mul for Number {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a * b),
            (Self::Fixed(1), number) | (number, Self::Fixed(1)) => number,
            (a, b) => Self::Formula(Formula::Mul(Box::new([a, b]))),
        }
    }
}

/// Columns and rows, both of which follow from the size of the frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Grid {
    pub(crate) width: Number,
    pub(crate) height: Number,
}

impl Grid {
    /// The pixels of the frames.
    pub(crate) const FRAME: Self = Self { width: Number::WIDTH, height: Number::HEIGHT };

    /// So many cells for every `side` pixels that have begun, along each axis.
    pub(crate) fn cells(side: usize, cells: Size) -> Self {
        let count = |pixels: Number, cells: usize| Number::from(cells) * pixels.div_ceil(side);
        Self { width: count(Number::WIDTH, cells.width()), height: count(Number::HEIGHT, cells.height()) }
    }

    /// Always the same.
    #[cfg(all(test, feature = "gpu"))]
    pub(crate) fn fixed(size: Size) -> Self {
        Self { width: size.width().into(), height: size.height().into() }
    }

    /// Number of cells.
    pub(crate) fn count(&self) -> Number {
        self.width.clone() * self.height.clone()
    }

    /// Workgroups of so many columns and rows that cover the cells, in so many layers.
    pub(crate) fn workgroups(&self, [width, height]: [usize; 2], layers: usize) -> [Number; 3] {
        [self.width.div_ceil(width), self.height.div_ceil(height), layers.into()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_what_they_say() {
        let at = |number: &Number| number.at(Size::px(65, 43), Precision::F16).unwrap();
        let grid = Grid::cells(32, Size::px(8, 4));
        assert_eq!([&grid.width, &grid.height].map(at), [24, 8]);
        assert_eq!(at(&grid.count()), 192);
        assert_eq!(at(&Number::WIDTH.max(Number::HEIGHT)), 65);
        assert_eq!(at(&(Number::REAL_BYTES * 3.into() + Number::from(1))), 7);
        assert_eq!(Grid::FRAME.workgroups([16, 8], 2).each_ref().map(at), [5, 6, 2]);
    }

    #[test]
    fn numbers_too_large_and_divisors_of_zero_have_no_value() {
        let none = |number: Number| number.at(Size::px(2, 1), Precision::F32).is_none();
        assert!(none(Number::Fixed(u64::MAX) * Number::WIDTH));
        assert!(none(Number::Fixed(u64::MAX) + Number::WIDTH));
        assert!(none(Number::Formula(Formula::DivCeil(Box::new([Number::from(1), Number::Fixed(0)])))));
    }

    #[test]
    fn json_is_short() {
        let number = Number::from(3) * Number::WIDTH.div_ceil(16);
        let text = serde_json::to_string(&number).unwrap();
        assert_eq!(text, r#"{"mul":[3,{"div_ceil":["width",16]}]}"#);
        assert_eq!(serde_json::from_str::<Number>(&text).unwrap(), number);
        assert!(serde_json::from_str::<Number>("-1").is_err());
    }
}
