// Sectors of a slice as the bits of a word. CPU twin: `sectors` in search/vbao.rs.

/// All bits but the lowest so many, up to 32.
fn bits_from(low: u32) -> u32 {
    return select(0xffffffffu << (low & 31u), 0u, low >= 32u);
}

/// Bits from `low` up to, not including, `high`; both in 0 to 32.
fn sectors(low: u32, high: u32) -> u32 {
    return bits_from(low) & ~bits_from(high);
}
