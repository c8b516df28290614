// Whether a subgroup works on one group of outputs: then its number is one for all, and so is what is read with it.

struct Together {
    group: u32,
    /// Whether that is the group of all.
    whole: bool,
}

fn together(group: u32) -> Together {
    let first = subgroupBroadcastFirst(group);
    return Together(first, subgroupAll(first == group));
}
