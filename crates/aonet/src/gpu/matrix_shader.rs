//! The beginning of a shader that multiplies matrices.

use crate::gpu::matrices::{Matrices, WAVES};
#[cfg(test)]
use crate::gpu::options::Precision;
use crate::gpu::shader::Shader;

impl Matrices {
    /// The beginning of a shader that declares `cells`, `weights` and `found`.
    pub(crate) fn shader(self) -> Shader {
        #[cfg(test)]
        if self.spelt_out {
            return self.numbers(Shader::new(Precision::F16)).part(include_str!("matrices_spelt_out.wgsl"));
        }
        let side = self.side;
        let types = ["A", "B", "C"].map(|role| {
            let real = if role == "C" { "f32" } else { "f16" };
            format!("alias Matrix{role} = coop_mat{side}x{side}<{real}, {role}>;\n")
        });
        self.numbers(Shader::with_matrices()).part(&types.concat()).part(include_str!("matrices.wgsl"))
    }

    fn numbers(self, begin: Shader) -> Shader {
        begin
            .number("SIDE", self.side)
            .number("LANES", self.lanes)
            .number("WAVES", WAVES)
            .number("INVOCATIONS", self.invocations())
    }
}

/// Repeats `line` for every row and tile below `counts`, with their numbers in place of `{r}` and `{t}`. Drivers are sure to
/// keep sums in registers only where no index is computed.
pub(crate) fn unrolled(line: &str, counts: [usize; 2]) -> String {
    let pairs = (0..counts[0]).flat_map(|row| (0..counts[1]).map(move |tile| (row, tile)));
    pairs.map(|(row, tile)| line.replace("{r}", &row.to_string()).replace("{t}", &tile.to_string())).collect()
}
