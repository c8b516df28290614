// Whether a subgroup works on one group of outputs. Without subgroups every invocation is on its own.

struct Together {
    group: u32,
    /// Whether that is the group of all.
    whole: bool,
}

fn together(group: u32) -> Together {
    return Together(group, true);
}
