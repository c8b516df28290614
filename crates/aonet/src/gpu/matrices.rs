//! Cooperative matrices: the invocations of a subgroup multiply small matrices together, on units made for that (tensor
//! cores, matrix cores).

#[cfg(test)]
use crate::gpu::options::Precision;
use crate::gpu::shader::Shader;

/// Subgroups of a workgroup.
const WAVES: usize = 4;
/// Channels that a workgroup computes at most: with two rows of cells and a side of 16, eight sums a subgroup.
const MAX_CHANNELS: usize = 64;
/// Workgroups below which a dispatch is cut finer. guess: two for each multiprocessor of a large device.
const ENOUGH_WORKGROUPS: usize = 256;

/// The products of matrices that a device computes: squares of half floats, added up in 32 bits.
///
/// A device has to be made with the features that they need, one of which is experimental in wgpu: `Device` takes them only
/// after a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Matrices {
    /// Rows and columns: 8 or 16.
    pub(crate) side: usize,
    /// Invocations of a subgroup.
    pub(crate) lanes: usize,
    /// Shaders that need no such device.
    #[cfg(test)]
    pub(crate) spelt_out: bool,
}

impl Matrices {
    /// Subgroups of a workgroup.
    #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
    pub(crate) fn waves(self) -> usize {
        WAVES
    }

    /// Invocations of a workgroup.
    pub(crate) fn invocations(self) -> usize {
        WAVES * self.lanes
    }

    /// Matrices of outputs of a workgroup at most.
    pub(crate) fn max_tiles(self) -> usize {
        MAX_CHANNELS / self.side
    }

    /// Rows of cells of a subgroup, for images of cells (width, height) and so many tiles of channels: fewer where there
    /// would be too few workgroups.
    pub(crate) fn rows(self, cells: (usize, usize), tiles: usize) -> usize {
        let enough = self.workgroups(cells, 2, tiles).iter().product::<usize>() >= ENOUGH_WORKGROUPS;
        if enough { 2 } else { 1 }
    }

    /// Workgroups for images of cells (width, height).
    pub(crate) fn workgroups(self, (width, height): (usize, usize), rows: usize, tiles: usize) -> [usize; 3] {
        [width.div_ceil(self.side), height.div_ceil(WAVES * rows), tiles]
    }

    /// The beginning of a shader, which is to declare `cells`, `weights` and `found`.
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

/// `line` for every row and tile below `counts`, which take the places of `{r}` and `{t}`: drivers keep sums in registers
/// for certain only where no index is computed.
pub(crate) fn unrolled(line: &str, counts: [usize; 2]) -> String {
    let pairs = (0..counts[0]).flat_map(|row| (0..counts[1]).map(move |tile| (row, tile)));
    pairs.map(|(row, tile)| line.replace("{r}", &row.to_string()).replace("{t}", &tile.to_string())).collect()
}
