// The filters of a block of inputs in workgroup memory: all groups of outputs read them from there.

var<workgroup> filters: array<real4, FILTER_LEN>;

fn load_filters(first: u32, index: u32) {
    for (var i = index; i < FILTER_LEN; i += INVOCATIONS) {
        filters[i] = weights[first + i];
    }
}

fn filter_at(first: u32, i: u32) -> real4 {
    return filters[i];
}
