//! The products of matrices that an adapter has.

use crate::gpu::matrices::Matrices;

impl Matrices {
    /// What a device needs for them.
    pub const FEATURES: wgpu::Features = wgpu::Features::EXPERIMENTAL_COOPERATIVE_MATRIX
        .union(wgpu::Features::SUBGROUP)
        .union(wgpu::Features::SHADER_F16);

    /// The largest that an adapter has; none where it has none, or where subgroups are not all of one size.
    pub fn of(adapter: &wgpu::Adapter) -> Option<Self> {
        use wgpu::CooperativeScalarType::{F16, F32};
        let info = adapter.get_info();
        let lanes = info.subgroup_min_size;
        let one_size = info.subgroup_max_size == lanes && [8, 16, 32, 64].contains(&lanes);
        if !(adapter.features().contains(Self::FEATURES) && one_size) {
            return None;
        }
        let properties = adapter.cooperative_matrix_properties();
        let side = |side: &u32| {
            properties.iter().any(|p| {
                (p.ab_type, p.cr_type) == (F16, F32)
                    && [p.m_size, p.n_size, p.k_size].iter().all(|s| s == side)
            })
        };
        let side = [16, 8].into_iter().filter(|side| *side <= lanes).find(side)?;
        Some(Self {
            side: side as usize,
            lanes: lanes as usize,
            #[cfg(test)]
            spelt_out: false,
        })
    }
}
