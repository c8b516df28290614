// The filters of the loaded blocks of inputs, read where they are: a subgroup reads each of them once, as a uniform, where the hardware
// has such. Leaves more workgroup memory to tiles.

fn load_filters(first: u32, count: u32, index: u32) {}

fn filter_at(first: u32, i: u32) -> real4 {
    return weights[first + i];
}
