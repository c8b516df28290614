//! WGSL from parts: constants, then files, one after the other. WGSL itself has no way to include a file.

use crate::gpu::options::{Kernels, Precision};
use std::fmt::Display;

/// A shader that grows.
#[derive(Debug, Clone)]
pub(crate) struct Shader(String);

impl Shader {
    /// Nothing but the numbers that activations and weights are made of: `real`, `real4`, `HALF`.
    pub(crate) fn new(precision: Precision) -> Self {
        let (enable, real) = match precision {
            Precision::F32 => ("", "f32"),
            Precision::F16 => ("enable f16;\n", "f16"),
        };
        let types = format!("alias real = {real};\nalias real4 = vec4<{real}>;\n");
        Self(format!("{enable}{types}")).flag("HALF", precision == Precision::F16)
    }

    /// Half floats and products of matrices; see [`Matrices`](crate::gpu::matrices::Matrices).
    pub(crate) fn with_matrices() -> Self {
        let Self(begin) = Self::new(Precision::F16);
        Self(format!("enable wgpu_cooperative_matrix;\n{begin}"))
    }

    /// For these instructions: `together`.
    pub(crate) fn with_kernels(mut self, kernels: Kernels) -> Self {
        // Browsers want to be told; elsewhere it is not known yet.
        if cfg!(target_arch = "wasm32") && kernels == Kernels::Subgroups {
            self.0.insert_str(0, "enable subgroups;\n");
        }
        self.part(match kernels {
            Kernels::Subgroups => include_str!("together_subgroup.wgsl"),
            // Shaders on matrices begin otherwise: what is left of them is plain.
            Kernels::Plain | Kernels::Matrices(_) => include_str!("together.wgsl"),
        })
    }

    /// A whole number.
    pub(crate) fn number(self, name: &str, value: usize) -> Self {
        self.part(&constant(name, ("u32", format!("{value}u"))))
    }

    /// A number.
    pub(crate) fn float(self, name: &str, value: f32) -> Self {
        self.part(&constant(name, ("f32", decimal(value))))
    }

    /// Columns and rows of a workgroup.
    pub(crate) fn tile(self, [width, height]: [usize; 2]) -> Self {
        self.number("TILE_WIDTH", width).number("TILE_HEIGHT", height)
    }

    /// A condition.
    pub(crate) fn flag(self, name: &str, value: bool) -> Self {
        self.part(&constant(name, ("bool", value)))
    }

    /// A file, or declarations made elsewhere.
    pub(crate) fn part(mut self, text: &str) -> Self {
        self.0.push_str(text);
        self.0.push('\n');
        self
    }

    /// The whole.
    pub(crate) fn source(&self) -> &str {
        &self.0
    }
}

/// The declaration of a constant.
pub(crate) fn constant(name: &str, (ty, value): (&str, impl Display)) -> String {
    format!("const {name}: {ty} = {value};")
}

/// A number of 32 bits as a literal.
pub(crate) fn decimal(value: f32) -> String {
    // Rust prints as few digits as it takes to read the same number again. Those for 64 bits: rounded for 32, the largest
    // number is a decimal above it, which WGSL forbids and browsers refuse.
    format!("{:?}f", f64::from(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_numbers_of_32_bits() {
        for value in [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 0.1, -0.0, 1.0] {
            let shader = Shader::new(Precision::F32).float("X", value);
            let line = shader.source().lines().last().unwrap().to_owned();
            let text = line.strip_prefix("const X: f32 = ").and_then(|l| l.strip_suffix("f;")).unwrap();
            let exact: f64 = text.parse().unwrap();
            assert_eq!(exact, f64::from(value), "{line}");
        }
    }
}
