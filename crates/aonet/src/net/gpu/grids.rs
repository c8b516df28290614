//! The sides of a plan's tensors as formulas of the frames' size.

use crate::error::Result;
use crate::frame::size::Size;
use crate::gpu::program::{Grid, Number};
use crate::net::graph::Graph;
use crate::net::plan::{Buffer, BufferId, Layout, Plan};

/// Columns and rows of every tensor of a plan.
#[derive(Debug)]
pub(crate) struct Grids {
    /// The image, padded to the graph's alignment.
    pub(crate) padded: Grid,
    /// How often the plan that they are made from repeats: once for every square of the alignment that has begun.
    pub(crate) repeats: Number,
    tensors: Vec<Grid>,
    /// Sides of the padded image (px) in the plan that they are made from.
    alignment: usize,
}

/// The plan of the smallest frames without padding. Its steps and tensors are those of every size; only their sides differ.
pub(crate) fn smallest_plan(graph: &Graph) -> Result<Plan> {
    let side = graph.alignment();
    Plan::new(graph, Size::new(side, side)?)
}

/// The same with bent normals: see [`Plan::with_bent_normals`].
pub(crate) fn smallest_bent_plan(graph: &Graph) -> Result<(Plan, BufferId)> {
    let side = graph.alignment();
    Plan::with_bent_normals(graph, Size::new(side, side)?)
}

impl Grids {
    /// Those of the smallest plan.
    pub(crate) fn new(plan: &Plan) -> Self {
        let alignment = plan.padded.width();
        let grid = |b: &Buffer| match b.layout {
            Layout::Planar | Layout::Blocked => Grid::cells(alignment, b.size()),
            Layout::Image => Grid::FRAME,
        };
        let tensors = plan.buffers.iter().map(grid).collect();
        let repeats = Grid::cells(alignment, Size::px(1, 1)).count();
        Self { padded: Grid::cells(alignment, plan.padded), repeats, tensors, alignment }
    }

    /// The sides of one plan, whatever the size of the frames.
    #[cfg(all(test, feature = "gpu"))]
    pub(crate) fn fixed(plan: &Plan) -> Self {
        let tensors = plan.buffers.iter().map(|b| Grid::fixed(b.size())).collect();
        Self { padded: Grid::fixed(plan.padded), repeats: 1.into(), tensors, alignment: 0 }
    }

    /// Columns and rows of a tensor.
    pub(crate) fn of(&self, tensor: BufferId) -> &Grid {
        &self.tensors[tensor]
    }

    /// Columns and rows of the patches of the padded image; `patch` is their side (px).
    pub(crate) fn patches(&self, patch: usize) -> Grid {
        Grid::cells(self.alignment, Size::px(self.alignment / patch, self.alignment / patch))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::options::Precision;
    use crate::net::ModelConfig;

    /// The plans of other sizes are computed without formulas.
    #[test]
    fn formulas_are_the_sides_of_every_plan() {
        for config in [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_ao()] {
            let graph = Graph::new(&config).unwrap();
            let smallest = smallest_plan(&graph).unwrap();
            let grids = Grids::new(&smallest);
            for size in (0..50).map(|i| Size::px(1 + i * i * 7919 % 2111, 1 + i * i * 104_729 % 1181)) {
                let plan = Plan::new(&graph, size).unwrap();
                let sides = |grid: &Grid| {
                    let at = |number: &Number| number.at(size, Precision::F32).unwrap();
                    Size::px(at(&grid.width) as usize, at(&grid.height) as usize)
                };
                assert_eq!(sides(&grids.padded), plan.padded);
                assert_eq!(sides(&grids.patches(1)), plan.cells(1));
                assert_eq!(grids.tensors.len(), plan.buffers.len());
                for (grid, (tensor, of_smallest)) in
                    grids.tensors.iter().zip(plan.buffers.iter().zip(&smallest.buffers))
                {
                    assert_eq!(sides(grid), tensor.size(), "{size}");
                    assert_eq!((tensor.live, tensor.channels), (of_smallest.live, of_smallest.channels));
                }
                assert_eq!(plan.steps, smallest.steps);
            }
        }
    }
}
