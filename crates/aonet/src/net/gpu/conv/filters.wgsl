// The filters of the loaded blocks of inputs in workgroup memory: all groups of outputs read them from there.

var<workgroup> filters: array<real4, FILTER_LEN * DEPTH>;

fn load_filters(first: u32, count: u32, index: u32) {
    for (var i = index; i < count; i += INVOCATIONS) {
        filters[i] = weights[first + i];
    }
}

fn filter_at(first: u32, i: u32) -> real4 {
    return filters[i];
}
